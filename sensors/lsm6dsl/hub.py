"""The LSM6DSL's sensor hub: an I2C master that reads other sensors by itself (AN5040 section 7).

A trigger (data-ready at 104 Hz at most, or INT2) starts a round, in which the hub reads its slaves. All results appear
at the end of the round. Decision: INT2 triggers when it rises, or if it is high when the hub is switched on.

Decisions where the documents are silent: if a hub slave does not answer, its output bytes do not change; if
no slave is due at a trigger, no round starts; switching off aborts the round. SENSORHUB_END_OP is 1 while
idle; with correction, it is a pulse of 1/100 s.

Iron correction (7.5): calibrated = SI * (M - HI), uncalibrated = SI * (M - HI) + HI.

Decisions where the documents are silent: corrected fields are rounded to the nearest LSB; if a field exceeds
16 bits, it saturates and sets HI_FAIL.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fcu_emulator.sensors.lsm6dsl.banks import BANK_A, BankA, on_bank_write
from fcu_emulator.sensors.lsm6dsl.feature import FeatureContext, Violations
from fcu_emulator.sensors.lsm6dsl.function_sources import HUB_CORRECTED, HUB_IDLE, IRON, FunctionSources
from fcu_emulator.sensors.lsm6dsl.registers import (
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
from fcu_emulator.sensors.part import Sensor, SubaddressTarget
from fcu_emulator.sensors.register import Register, RegisterMap
from fcu_emulator.sensors.register_file import NEVER_PS
from fcu_emulator.sensors.sampling import PS_PER_S, to_int16

# -- the auxiliary bus, and the duration of a transfer ------------------------------------------------------

_CLOCK_HZ = 116_300


def _clocks_ps(clocks: int) -> int:
    return -(-clocks * PS_PER_S // _CLOCK_HZ)


WRITE_PS = _clocks_ps(1 + 9 * 3 + 1)  # address, sub-address, one byte of data
UNANSWERED_PS = _clocks_ps(1 + 9 + 1)  # the address; then the master stops


def read_ps(count: int) -> int:
    """Return the duration of a read of ``count`` bytes."""
    return _clocks_ps(1 + 9 * 2 + 1 + 9 * (1 + count) + 1)


class AuxiliaryBus:
    """The attached sensors, keyed by 7-bit address."""

    def __init__(self) -> None:
        self._targets: dict[int, SubaddressTarget] = {}
        self._now_ps = 0

    def attach(self, address: int, device: Sensor) -> None:
        """Connect a sensor. Raises ValueError if the address is invalid or in use."""
        if not 0 <= address < 0x80:
            raise ValueError(f"auxiliary bus: address 0x{address:02X} is not in 0x00 to 0x7F")
        if address in self._targets:
            raise ValueError(f"auxiliary bus: two devices at address 0x{address:02X}")
        self._targets[address] = SubaddressTarget(device, lambda: self._now_ps)

    def answers(self, address: int) -> bool:
        target = self._targets.get(address)
        return target is not None and not target.part.i2c_off

    def read(self, address: int, subaddress: int, count: int, at_ps: int) -> bytes:
        """Read bytes from a sensor that acknowledges its address; the read ends at ``at_ps``."""
        target = self._begin(address, at_ps)
        target.write(bytes((subaddress,)))
        target.start(read=True)
        data = target.read(count)
        target.stop()
        return data

    def write(self, address: int, subaddress: int, value: int, at_ps: int) -> None:
        target = self._begin(address, at_ps)
        target.write(bytes((subaddress, value)))
        target.stop()

    def _begin(self, address: int, at_ps: int) -> SubaddressTarget:
        self._now_ps = at_ps
        target = self._targets[address]
        target.start(read=False)
        return target


# -- hard- and soft-iron correction -------------------------------------------------------------------------

RAW_BYTES = 6
_SIGN, _PER_UNIT = 0x80, 8  # sign and magnitude, 1/8 per LSB


@dataclass(frozen=True)
class Corrected:
    """Register bytes of both results, X, Y, Z as little-endian int16."""

    calibrated: bytes
    uncalibrated: bytes
    failed: bool


@dataclass(frozen=True)
class IronCorrection:
    """``soft``: matrix (3, 3); ``hard``: offsets (3,) in LSB of the magnetometer."""

    soft: NDArray[np.float64]
    hard: NDArray[np.float64]

    @classmethod
    def decode(cls, mem: bytearray, *, soft: bool) -> IronCorrection:
        hard = np.frombuffer(bytes(mem[BankA.MAG_OFFX_L.addr : BankA.MAG_OFFX_L.addr + 6]), dtype="<i2")
        elements = [_element(value) for value in mem[BankA.MAG_SI_XX.addr : BankA.MAG_SI_XX.addr + 9]]
        matrix = np.array(elements).reshape(3, 3) if soft else np.eye(3)
        return cls(soft=matrix, hard=hard.astype(np.float64))

    def apply(self, raw: bytes) -> Corrected:
        calibrated = np.rint(self.soft @ (np.frombuffer(raw, dtype="<i2") - self.hard))
        uncalibrated = calibrated + self.hard
        both = np.concatenate((calibrated, uncalibrated))
        return Corrected(
            calibrated=to_int16(calibrated).tobytes(),
            uncalibrated=to_int16(uncalibrated).tobytes(),
            failed=bool(np.any(both != to_int16(both))),
        )


def _element(value: int) -> float:
    magnitude = (value & ~_SIGN) / _PER_UNIT
    return -magnitude if value & _SIGN else magnitude


# -- settings of the four slaves in bank A (datasheet 11.2 to 11.15; AN5040 7.2) ----------------------------

OUTPUT_BYTES = 18  # SENSORHUB1 to SENSORHUB18
_BYTES_PER_SLAVE = 3  # address, sub-address, configuration


@dataclass(frozen=True)
class Slave:
    """One slave that the hub reads or writes. ``place``: index of the slave's first byte in the outputs."""

    number: int
    address: int
    subaddress: int
    every: int  # number of triggers per access
    length: int = 0  # bytes to read; 0 for the write
    place: int = 0


@dataclass(frozen=True)
class Plan:
    """All used slaves, in the order of access, and slave 0's options."""

    slaves: tuple[Slave, ...]
    length: int  # requested bytes of output
    data: int  # the byte written to slave 0, or the register of slave 0 that is tested
    write_once: bool
    tested: bool  # Src_mode: slave 0 is read only if its register ``data`` is not zero

    @property
    def reads_magnetometer(self) -> bool:
        """Whether slave 0 provides the six bytes of the correction."""
        return bool(self.slaves) and self.slaves[0].number == 0 and self.slaves[0].length == RAW_BYTES

    @classmethod
    def decode(cls, mem: bytearray) -> Plan:
        """Decode bank A; slaves fill the outputs one after the other."""
        config = mem[BankA.SLAVE0_CONFIG.addr]
        extra = BankA.SLAVE0_CONFIG.Aux_sens_on.get(config)
        slaves: list[Slave] = []
        place = 0
        for number in range(extra + 1):
            slave = _slave(mem, number, place)
            if slave is not None:
                slaves.append(slave)
                place += slave.length
        return cls(
            slaves=tuple(slaves),
            length=place,
            data=mem[BankA.DATAWRITE_SRC_MODE_SUB_SLV0.addr],
            # datasheet 11.8: only with more than one slave
            write_once=bool(extra and mem[BankA.SLAVE1_CONFIG.addr] & BankA.SLAVE1_CONFIG.write_once.mask),
            tested=bool(config & BankA.SLAVE0_CONFIG.Src_mode.mask),
        )


def _slave(mem: bytearray, number: int, place: int) -> Slave | None:
    offset = _BYTES_PER_SLAVE * number
    config = mem[BankA.SLAVE0_CONFIG.addr + offset]
    reads = bool(mem[BankA.SLV0_ADD.addr + offset] & BankA.SLV0_ADD.rw_0.mask)
    length = BankA.SLAVE0_CONFIG.Slave0_numop.get(config) if reads else 0
    if not length and (reads or number):
        return None
    return Slave(
        number=number,
        address=BankA.SLV0_ADD.Slave0_add.get(mem[BankA.SLV0_ADD.addr + offset]),
        subaddress=mem[BankA.SLV0_SUBADD.addr + offset],
        every=1 << BankA.SLAVE0_CONFIG.Slave0_rate.get(config),
        length=length,
        place=place,
    )


# -- the trigger --------------------------------------------------------------------------------------------

_FASTEST_HZ = 104


class Trigger:
    """Trigger of the hub; ``by_pin``: whether INT2 triggers instead of samples."""

    def __init__(self, chip: FeatureContext) -> None:
        self.by_pin = False
        self._chip = chip
        self._stream, self._every, self._next = (
            chip.xl,
            1,
            0,
        )  # the samples, and the next sample that triggers

    @property
    def running(self) -> bool:
        return self._stream.running

    def configure(self, now_ps: int) -> None:
        self.by_pin = bool(self._chip.registers.mem[MASTER_CONFIG.addr] & MASTER_CONFIG.START_CONFIG.mask)
        self._stream = self._chip.xl if self._chip.xl.running else self._chip.g
        if self._stream.running:
            self._every = max(1, round(self._chip.nominal_hz(self._stream) / _FASTEST_HZ))
        self.aim(now_ps)

    def aim(self, after_ps: int) -> None:
        """Compute the next trigger after ``after_ps``."""
        following = self._stream.latest(after_ps) + 1
        self._next = -(-following // self._every) * self._every

    def next_ps(self) -> int:
        return NEVER_PS if self.by_pin else self._stream.time_ps(self._next)


# -- invalid settings ---------------------------------------------------------------------------------------


def violations(mem: bytearray, plan: Plan, *, enabled: bool, active: bool) -> dict[tuple[str, str], bool]:
    """Return every violation, and whether it is present."""
    control = mem[MASTER_CONFIG.addr]
    iron = bool(control & MASTER_CONFIG.IRON_EN.mask)
    soft = bool(mem[CTRL9_XL.addr] & CTRL9_XL.SOFT_EN.mask)
    passes = bool(control & MASTER_CONFIG.PASS_THROUGH_MODE.mask)
    longest = OUTPUT_BYTES - RAW_BYTES if iron else OUTPUT_BYTES
    return {
        ("hub-pass-through", "MASTER_CONFIG: MASTER_ON and PASS_THROUGH_MODE at once"): enabled and passes,
        ("hub-too-long", f"SLAVEx_CONFIG: more than {longest} bytes to read"): active
        and plan.length > longest,
        ("hub-correction", "MASTER_CONFIG.IRON_EN needs slave 0 to read 6 bytes"): active
        and iron
        and not plan.reads_magnetometer,
        ("hub-soft-iron", "CTRL9_XL.SOFT_EN needs MASTER_CONFIG.IRON_EN"): active and soft and not iron,
    }


# -- the master ---------------------------------------------------------------------------------------------

_NACK = (
    FUNC_SRC2.SLAVE0_NACK.mask,
    FUNC_SRC2.SLAVE1_NACK.mask,
    FUNC_SRC2.SLAVE2_NACK.mask,
    FUNC_SRC2.SLAVE3_NACK.mask,
)
_FIRST_SLAVE, _LAST_SLAVE = BankA.SLV0_ADD.addr, BankA.DATAWRITE_SRC_MODE_SUB_SLV0.addr
_FIRST_CORRECTION, _LAST_CORRECTION = BankA.MAG_SI_XX.addr, BankA.MAG_OFFZ_H.addr


def _set_up_by(bank: RegisterMap) -> list[type[Register]]:
    return [
        register
        for register in bank.registers
        if _FIRST_SLAVE <= register.addr <= _LAST_SLAVE
        or _FIRST_CORRECTION <= register.addr <= _LAST_CORRECTION
    ]


class SensorHub:
    """Master of the auxiliary bus; ``pass_through``: the host's I2C is connected to this bus."""

    CONFIGURATION: tuple[type[Register], ...] = (
        CTRL1_XL,
        CTRL2_G,
        CTRL4_C,  # a sleeping gyroscope triggers nothing
        CTRL9_XL,
        CTRL10_C,
        MASTER_CONFIG,
    )

    def __init__(self, chip: FeatureContext, sources: FunctionSources) -> None:
        self.active = False
        self.pass_through = False
        self.bus = AuxiliaryBus()
        self._chip = chip
        self._sources = sources
        self._mem, self._bank = chip.registers.mem, chip.banks[BANK_A].mem
        self._violations = Violations(chip)
        self._enabled = False
        self._trigger = Trigger(chip)
        self._triggers = 0  # number of triggers since the master was switched on
        self._written = False  # slave 0 has been written since the master was switched on
        self._round: Iterator[int] | None = None
        self._step_ps = NEVER_PS  # end of the present transfer
        self._outputs = bytearray(OUTPUT_BYTES)
        self._magnetometer: bytes | None = None  # slave 0's bytes in this round, to be corrected
        self._nacks = 0
        self._plan = Plan.decode(self._bank)
        self._correction: IronCorrection | None = None
        for register in (SENSORHUB, SENSORHUB_EXT, OUT_MAG_RAW):
            chip.registers.before_read(register, self._before_read)
        on_bank_write(chip, BANK_A, _set_up_by(chip.banks[BANK_A].map), self.configure)

    # -- feature interface ------------------------------------------------------------------------------

    def configure(self, now_ps: int) -> None:
        control = self._mem[MASTER_CONFIG.addr]
        master = bool(control & MASTER_CONFIG.MASTER_ON.mask)
        self.pass_through = bool(control & MASTER_CONFIG.PASS_THROUGH_MODE.mask)
        self._plan = Plan.decode(self._bank)
        soft = bool(self._mem[CTRL9_XL.addr] & CTRL9_XL.SOFT_EN.mask)
        iron = bool(control & MASTER_CONFIG.IRON_EN.mask) and self._plan.reads_magnetometer
        was_correcting = self._correction is not None
        self._correction = IronCorrection.decode(self._bank, soft=soft) if iron else None
        if self._enabled and was_correcting != iron:
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
        while (at_ps := self.next_event_ps()) <= now_ps:
            if self._round is None:
                self._begin(at_ps)
            else:
                self._go_on(self._round, at_ps)

    def level_changes(self, level: int, at_ps: int) -> None:
        if level:
            self._trigger_by_pin(at_ps)

    def reset(self, now_ps: int) -> None:
        del now_ps
        self.active = self._enabled = False
        self._round, self._step_ps = None, NEVER_PS
        self._outputs = bytearray(OUTPUT_BYTES)
        self._nacks = 0

    def next_event_ps(self) -> int:
        return self._trigger.next_ps() if self._round is None else self._step_ps

    # -- configuration ----------------------------------------------------------------------------------

    def _enable(self, enabled: bool, now_ps: int) -> None:
        if enabled and not self._enabled:
            self._triggers, self._written = 0, False
            self._show_idle(on=True)
        elif self._enabled and not enabled:
            self._round, self._step_ps = None, NEVER_PS
            self._sources.fall((HUB_IDLE, HUB_CORRECTED, IRON), now_ps)
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
        """Yield the end time of each transfer; the next step of the generator executes the transfer."""
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
        self._chip.catch_up(at_ps - 1)  # the FIFO copies the outputs: let it store the old values first
        corrected = self._correct()
        mem = self._mem
        mem[SENSORHUB.addr : SENSORHUB.addr + SENSORHUB.size] = self._outputs[: SENSORHUB.size]
        mem[SENSORHUB_EXT.addr : SENSORHUB_EXT.addr + SENSORHUB_EXT.size] = self._outputs[SENSORHUB.size :]
        mem[FUNC_SRC2.addr] = mem[FUNC_SRC2.addr] & ~sum(_NACK) | self._nacks
        self._sources.happened(HUB_IDLE if self._correction is None else HUB_CORRECTED, at_ps)
        if corrected:
            self._sources.happened(IRON, at_ps)

    def _correct(self) -> bool:
        raw, self._magnetometer = self._magnetometer, None
        if self._correction is None or raw is None:
            return False
        corrected = self._correction.apply(raw)
        self._mem[OUT_MAG_RAW.addr : OUT_MAG_RAW.addr + RAW_BYTES] = raw
        self._outputs[:RAW_BYTES] = corrected.calibrated
        self._outputs[SENSORHUB.size :] = corrected.uncalibrated
        self._mem[FUNC_SRC1.addr] &= ~FUNC_SRC1.HI_FAIL.mask
        if corrected.failed:
            self._mem[FUNC_SRC1.addr] |= FUNC_SRC1.HI_FAIL.mask
        return True

    def _show_idle(self, *, on: bool) -> None:
        if self._correction is None:
            self._sources.show(HUB_IDLE, on=on)

    def _before_read(self, first: int, end: int, now_ps: int) -> None:
        del first, end
        self._chip.catch_up(now_ps)
