"""The sensor hub's master: at each trigger a round over the slaves, transfer by transfer (AN5040 7.1 to 7.5).

A round reads each slave at the time its transfer ends and shows all results when the round ends; until then
the outputs keep those of the round before. A trigger during a round is lost.

Decisions where the documents are silent: a slave that does not answer keeps its bytes, and its NACK flag
shows its latest turn; a trigger at which no slave has a turn is no round; switching off drops the round under
way. SENSORHUB_END_OP is a level, 1 while idle, and a pulse of 1/100 s while ironing is on (AN5040 7.2.3 and
7.5.3 say one each); its pin pulses either way.
"""

from __future__ import annotations

from collections.abc import Iterator

from sensors.lsm6dsl.bank_a import DATAWRITE_SRC_MODE_SUB_SLV0, MAG_OFFZ_H, MAG_SI_XX, SLV0_ADD
from sensors.lsm6dsl.bank_access import BANK_A, on_bank_write
from sensors.lsm6dsl.feature import Chip
from sensors.lsm6dsl.function_sources import HUB_IDLE, HUB_IRONED, IRON, FunctionSources
from sensors.lsm6dsl.hub_bus import UNANSWERED_PS, WRITE_PS, AuxiliaryBus, read_ps
from sensors.lsm6dsl.hub_ironing import RAW_BYTES, Ironing
from sensors.lsm6dsl.hub_slaves import OUTPUT_BYTES, Plan, Slave
from sensors.lsm6dsl.hub_trigger import Trigger
from sensors.lsm6dsl.hub_violations import violations
from sensors.lsm6dsl.registers import (
    CTRL1_XL,
    CTRL2_G,
    CTRL4_C,
    CTRL9_XL,
    CTRL10_C,
    FUNC_SRC1,
    FUNC_SRC2,
    MASTER_CONFIG,
    OUT_MAG_RAW,
    SENSORHUB,
    SENSORHUB_EXT,
)
from sensors.lsm6dsl.violations import Violations
from sensors.register import Register, RegisterMap
from sensors.sampling import NEVER_PS

_NACK = (
    FUNC_SRC2.SLAVE0_NACK.mask,
    FUNC_SRC2.SLAVE1_NACK.mask,
    FUNC_SRC2.SLAVE2_NACK.mask,
    FUNC_SRC2.SLAVE3_NACK.mask,
)
_FIRST_SLAVE, _LAST_SLAVE = SLV0_ADD.addr, DATAWRITE_SRC_MODE_SUB_SLV0.addr
_FIRST_IRON, _LAST_IRON = MAG_SI_XX.addr, MAG_OFFZ_H.addr


def _set_up_by(bank: RegisterMap) -> list[type[Register]]:
    """The hub's registers in bank A: slaves and correction."""
    return [
        register
        for register in bank.registers
        if _FIRST_SLAVE <= register.addr <= _LAST_SLAVE or _FIRST_IRON <= register.addr <= _LAST_IRON
    ]


class SensorHub:
    """Master of the auxiliary bus. ``pass_through``: the host's I2C is connected to that bus."""

    CONFIGURATION: tuple[type[Register], ...] = (
        CTRL1_XL,
        CTRL2_G,
        CTRL4_C,  # a sleeping gyroscope triggers nothing
        CTRL9_XL,
        CTRL10_C,
        MASTER_CONFIG,
    )

    def __init__(self, chip: Chip, sources: FunctionSources) -> None:
        self.active = False
        self.pass_through = False
        self.bus = AuxiliaryBus()
        self._chip = chip
        self._sources = sources
        self._mem, self._bank = chip.registers.mem, chip.banks[BANK_A].mem
        self._violations = Violations(chip)
        self._enabled = False
        self._trigger = Trigger(chip)
        self._triggers = 0  # since the master is on
        self._written = False  # slave 0 has been written since
        self._round: Iterator[int] | None = None
        self._step_ps = NEVER_PS  # when the round's present transfer ends
        self._outputs = bytearray(OUTPUT_BYTES)
        self._magnetometer: bytes | None = None  # slave 0's bytes in this round, to be ironed
        self._nacks = 0
        self._plan = Plan.decode(self._bank)
        self._ironing: Ironing | None = None
        for register in (SENSORHUB, SENSORHUB_EXT, OUT_MAG_RAW):
            chip.registers.before_read(register, self._before_read)
        on_bank_write(chip, BANK_A, _set_up_by(chip.banks[BANK_A].map), self.configure)

    # -- as a feature -----------------------------------------------------------------------------------

    def configure(self, now_ps: int) -> None:
        """Decode the registers; a round under way goes on unless the hub is off now."""
        control = self._mem[MASTER_CONFIG.addr]
        master = bool(control & MASTER_CONFIG.MASTER_ON.mask)
        self.pass_through = bool(control & MASTER_CONFIG.PASS_THROUGH_MODE.mask)
        self._plan = Plan.decode(self._bank)
        soft = bool(self._mem[CTRL9_XL.addr] & CTRL9_XL.SOFT_EN.mask)
        iron = bool(control & MASTER_CONFIG.IRON_EN.mask) and self._plan.reads_magnetometer
        was_ironing = self._ironing is not None
        self._ironing = Ironing.decode(self._bank, soft=soft) if iron else None
        if self._enabled and was_ironing != iron:
            self._sources.show(HUB_IDLE, on=not iron and self._round is None)
        self._enable(master and bool(self._mem[CTRL10_C.addr] & CTRL10_C.FUNC_EN.mask), now_ps)
        was_ready = self.active and self._trigger.by_pin
        self._trigger.configure(now_ps)
        self.active = self._enabled and self._trigger.running and not self.pass_through
        if not was_ready and self._chip.int2.applied:
            self._trigger_by_pin(now_ps)
        if not self.active and self._round is not None:
            self._round, self._step_ps = None, NEVER_PS
            self._show_idle(on=self._enabled)
        found = violations(self._mem, self._plan, enabled=self._enabled, active=self.active)
        self._violations.report(found, now_ps)

    def catch_up(self, now_ps: int) -> None:
        """Begin and go through the rounds that are due, transfer by transfer."""
        while (at_ps := self.next_event_ps()) <= now_ps:
            if self._round is None:
                self._begin(at_ps)
            else:
                self._go_on(self._round, at_ps)

    def level_changes(self, level: int, at_ps: int) -> None:
        """INT2 has another level after ``at_ps``."""
        if level:
            self._trigger_by_pin(at_ps)

    def reset(self, now_ps: int) -> None:
        """SW_RESET: the hub is off and its outputs are empty."""
        del now_ps
        self.active = self._enabled = False
        self._round, self._step_ps = None, NEVER_PS
        self._outputs = bytearray(OUTPUT_BYTES)
        self._nacks = 0

    def next_event_ps(self) -> int:
        """The end of the present transfer, or the next trigger."""
        return self._trigger.next_ps() if self._round is None else self._step_ps

    # -- configuration ----------------------------------------------------------------------------------

    def _enable(self, enabled: bool, now_ps: int) -> None:
        if enabled and not self._enabled:
            self._triggers, self._written = 0, False
            self._show_idle(on=True)
        elif self._enabled and not enabled:
            self._round, self._step_ps = None, NEVER_PS
            self._sources.fall((HUB_IDLE, HUB_IRONED, IRON), now_ps)
        self._enabled = enabled

    # -- a round ----------------------------------------------------------------------------------------

    def _trigger_by_pin(self, at_ps: int) -> None:
        if self.active and self._trigger.by_pin and self._round is None:
            self._begin(at_ps)

    def _begin(self, at_ps: int) -> None:
        number = self._triggers
        self._triggers += 1
        self._trigger.aim(at_ps)
        transfers = self._transfers(number, at_ps)
        first_end = next(transfers, None)
        if first_end is not None:
            self._round, self._step_ps = transfers, first_end
            self._show_idle(on=False)

    def _go_on(self, transfers: Iterator[int], at_ps: int) -> None:
        following = next(transfers, None)
        if following is not None:
            self._step_ps = following
            return
        self._round, self._step_ps = None, NEVER_PS
        self._trigger.aim(at_ps)
        self._show_results(at_ps)

    def _transfers(self, trigger: int, at_ps: int) -> Iterator[int]:
        """The transfers of one round: gives the time at which each ends, and does it when asked on."""
        plan = self._plan
        for slave in plan.slaves:
            if trigger % slave.every or (not slave.length and plan.write_once and self._written):
                continue
            if not self.bus.answers(slave.address):
                at_ps += UNANSWERED_PS
                yield at_ps
                self._nacks |= _NACK[slave.number]
                continue
            if not slave.length:
                at_ps += WRITE_PS
                yield at_ps
                self.bus.write(slave.address, slave.subaddress, plan.data, at_ps)
                self._written = True
            else:
                if plan.tested and slave.number == 0:
                    at_ps += read_ps(1)
                    yield at_ps
                    if self.bus.read(slave.address, plan.data, 1, at_ps) == b"\0":
                        continue
                at_ps += read_ps(slave.length)
                yield at_ps
                self._take(slave, self.bus.read(slave.address, slave.subaddress, slave.length, at_ps))
            self._nacks &= ~_NACK[slave.number]

    def _take(self, slave: Slave, data: bytes) -> None:
        if slave.number == 0 and len(data) == RAW_BYTES:
            self._magnetometer = data
        fitting = data[: max(0, OUTPUT_BYTES - slave.place)]
        self._outputs[slave.place : slave.place + len(fitting)] = fitting

    def _show_results(self, at_ps: int) -> None:
        self._chip.catch_up(at_ps - 1)  # the FIFO copies the outputs: first with their values until now
        ironed = self._iron()
        mem = self._mem
        mem[SENSORHUB.addr : SENSORHUB.addr + SENSORHUB.size] = self._outputs[: SENSORHUB.size]
        mem[SENSORHUB_EXT.addr : SENSORHUB_EXT.addr + SENSORHUB_EXT.size] = self._outputs[SENSORHUB.size :]
        mem[FUNC_SRC2.addr] = mem[FUNC_SRC2.addr] & ~sum(_NACK) | self._nacks
        self._sources.happened(HUB_IDLE if self._ironing is None else HUB_IRONED, at_ps)
        if ironed:
            self._sources.happened(IRON, at_ps)

    def _iron(self) -> bool:
        """Put slave 0's bytes through the correction; whether there was something to correct."""
        raw, self._magnetometer = self._magnetometer, None
        if self._ironing is None or raw is None:
            return False
        ironed = self._ironing.apply(raw)
        self._mem[OUT_MAG_RAW.addr : OUT_MAG_RAW.addr + RAW_BYTES] = raw
        self._outputs[:RAW_BYTES] = ironed.calibrated
        self._outputs[SENSORHUB.size :] = ironed.uncalibrated
        self._mem[FUNC_SRC1.addr] &= ~FUNC_SRC1.HI_FAIL.mask
        if ironed.failed:
            self._mem[FUNC_SRC1.addr] |= FUNC_SRC1.HI_FAIL.mask
        return True

    def _show_idle(self, *, on: bool) -> None:
        if self._ironing is None:
            self._sources.show(HUB_IDLE, on=on)

    def _before_read(self, first: int, end: int, now_ps: int) -> None:
        del first, end
        self._chip.catch_up(now_ps)
