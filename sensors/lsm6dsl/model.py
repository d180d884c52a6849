"""The LSM6DSL's behaviour behind its registers (datasheet DocID028475 Rev 7; application note AN5040 Rev 3).

Decisions where the documents are silent (they are also in the README's list of what is approximated):
SW_RESET takes effect at once and its bit reads 1 for 50 us; the temperature's data-ready flag is cleared by
reading OUT_TEMP_H; reserved ODR codes measure nothing; a changed configuration acts from the next sample on.
"""

from __future__ import annotations

from fractions import Fraction
from typing import ClassVar

import numpy as np

from sensors.errors import to_int16
from sensors.lsm6dsl import accelerometer, bank_a, bank_b, gyroscope, registers
from sensors.lsm6dsl.accelerometer import MG_PER_LSB, Accelerometer
from sensors.lsm6dsl.boot import BOOT_PS, Boot
from sensors.lsm6dsl.data_ready import DataReadySignals
from sensors.lsm6dsl.embedded import EmbeddedFunctions
from sensors.lsm6dsl.errors import LSM6DSLErrors
from sensors.lsm6dsl.events import Events
from sensors.lsm6dsl.feature import Chip, Feature
from sensors.lsm6dsl.fifo import Fifo
from sensors.lsm6dsl.filters import high_pass_is_idle, reference_mode_is_idle
from sensors.lsm6dsl.function_sources import FunctionSources
from sensors.lsm6dsl.gyroscope import MDPS_PER_LSB, Gyroscope
from sensors.lsm6dsl.hub import SensorHub
from sensors.lsm6dsl.registers import (
    CTRL1_XL,
    CTRL2_G,
    CTRL3_C,
    CTRL4_C,
    CTRL5_C,
    FUNC_CFG_ACCESS,
    OUT_G,
    OUT_TEMP,
    OUT_XL,
    STATUS_REG,
    X_OFS_USR,
    Y_OFS_USR,
    Z_OFS_USR,
)
from sensors.lsm6dsl.rounding import Rounding
from sensors.lsm6dsl.routing import Routing
from sensors.lsm6dsl.signals import Signals
from sensors.lsm6dsl.supply import supply_current_ua
from sensors.lsm6dsl.timestamp import Timestamp
from sensors.output import DataReady, OutputWords
from sensors.part import Part, SelfClearingBits, Signal, Write
from sensors.pin import Pin
from sensors.register import Register, RegisterMap
from sensors.register_file import ReadHook, RegisterFile
from sensors.sampling import NEVER_PS, PS_PER_S, SampleStream, Times
from sensors.spi import Wires
from sensors.subaddress import AddressedDevice

_SW_RESET_PS = 50 * PS_PER_S // 10**6  # AN5040 5.7
_TEMPERATURE_LSB_PER_DEGC = 256  # datasheet Table 4; 0 counts are 25 degC
_FIFO_BURST = {0x3F: 0x3E}  # a burst on FIFO_DATA_OUT goes round in it (AN5040 4.7)


class LSM6DSL(Part):
    """Accelerometer, gyroscope and their thermometer; signals in the sensor's own right-handed axes.

    ``acceleration_g``: specific force, (n, 3); ``angular_rate_dps``: (n, 3); ``temperature_degc``: (n,).
    """

    NAME: ClassVar[str] = "LSM6DSL"
    WHO_AM_I: ClassVar[int] = 0x6A
    MAP: ClassVar[RegisterMap] = RegisterMap.of(registers)
    BANKS: ClassVar[dict[str, RegisterMap]] = {
        "A": RegisterMap.of(bank_a),
        "B": RegisterMap.of(bank_b),
    }

    def __init__(
        self,
        acceleration_g: Signal,
        angular_rate_dps: Signal,
        temperature_degc: Signal,
        errors: LSM6DSLErrors | None = None,
        seed: int = 0,
    ) -> None:
        super().__init__(self.MAP, _FIFO_BURST)
        errors = errors or LSM6DSLErrors()
        self._banks = {0x80: RegisterFile(self.BANKS["A"]), 0xA0: RegisterFile(self.BANKS["B"])}
        self._accelerometer = Accelerometer(acceleration_g, temperature_degc, errors, seed)
        self._gyroscope = Gyroscope(angular_rate_dps, temperature_degc, errors, seed)
        self._temperature_degc = temperature_degc
        self._temperature_offset = errors.temperature_offset_degc
        self._xl = self._output(OUT_XL, self._accelerometer.stream, STATUS_REG.XLDA.mask)
        self._g = self._output(OUT_G, self._gyroscope.stream, STATUS_REG.GDA.mask)
        self._temp = self._output(OUT_TEMP, SampleStream(2, self._produce_temperature), STATUS_REG.TDA.mask)
        self._outputs = (self._xl, self._g, self._temp)
        self._clearing = SelfClearingBits(self.registers, CTRL3_C)
        self._temperature_rate = Fraction(0)
        self.int1, self.int2 = Pin("INT1"), Pin("INT2")
        streams = self._xl.stream, self._g.stream, self._temp.stream
        self._chip = Chip(
            self.registers, self._banks, *streams, Signals(), self.int1, self.int2, self.catch_up
        )
        self._events = Events(self._chip, self._rate_changed)
        self._boot = Boot(self._chip.signals)
        self._looks_before_reading = False
        sources = FunctionSources(self._chip)
        self._hub = SensorHub(self._chip, sources)
        timestamp = Timestamp(self._chip)
        # In the order in which they depend on each other's results: the events come first because they may
        # change the rates, pulses end after all events, and the pins come last.
        self._features: tuple[Feature, ...] = (
            self._events,
            Rounding(self._chip),
            timestamp,
            EmbeddedFunctions(self._chip, sources),
            self._hub,
            Fifo(self._chip, timestamp),
            sources,
            DataReadySignals(self._chip),
            self._boot,
            Routing(self._chip),
        )
        self._wire()

    @classmethod
    def maps(cls) -> dict[str, RegisterMap]:
        """The main bank and the embedded banks A and B."""
        titles = {"A": "Embedded bank A, selected by FUNC_CFG_ACCESS = 0x80", "B": "... bank B, by 0xA0"}
        return {"": cls.MAP, **{titles[name]: bank for name, bank in cls.BANKS.items()}}

    def files(self) -> tuple[RegisterFile, ...]:
        """The main bank and the embedded banks A and B."""
        return (self.registers, *self._banks.values())

    def supply_current_ua(self) -> float:
        """Supply current in microampere as now configured."""
        return supply_current_ua(self.registers.mem)

    def spi_wires(self) -> Wires:
        """CTRL3_C.SIM: three wires or four (datasheet 9.15)."""
        return 3 if self.registers.mem[CTRL3_C.addr] & CTRL3_C.SIM.mask else 4

    def pins(self) -> tuple[Pin, ...]:
        """INT1 and INT2."""
        return self.int1, self.int2

    def catch_up(self, now_ps: int) -> None:
        """Let every active feature do what has become due."""
        for feature in self._features:
            if feature.active:
                feature.catch_up(now_ps)

    def next_event_ps(self) -> int:
        """When a pin may change next."""
        return min(
            (feature.next_event_ps() for feature in self._features if feature.active), default=NEVER_PS
        )

    def world_changed(self, now_ps: int | None = None) -> None:
        """The signals differ from what they were: samples still to come are computed anew.

        ``now_ps``: features first work through what came before; it may be left out where none is active.
        """
        if now_ps is not None:
            self.catch_up(now_ps)
        self._accelerometer.world_changed(now_ps)
        self._gyroscope.world_changed(now_ps)
        self._temp.stream.invalidate()

    @property
    def pass_through(self) -> bool:
        """MASTER_CONFIG.PASS_THROUGH_MODE: the host's I2C is connected to the auxiliary bus (AN5040 7.3)."""
        return self._hub.pass_through

    def attach_auxiliary(self, address: int, device: AddressedDevice) -> None:
        """Connect ``device`` to the sensor hub's bus at a 7-bit I2C address."""
        self._hub.bus.attach(address, device)

    def sample_range(self, channel: str) -> tuple[float, float, float]:
        """``acceleration_g``, ``angular_rate_dps`` or ``temperature_degc`` as now configured."""
        lsb, zero = {
            "acceleration_g": (MG_PER_LSB[self._accelerometer.settings.scale] / 1000, 0.0),
            "angular_rate_dps": (MDPS_PER_LSB[self._gyroscope.settings.scale] / 1000, 0.0),
            "temperature_degc": (1 / _TEMPERATURE_LSB_PER_DEGC, 25.0),
        }[channel]
        return zero - 32768 * lsb, zero + 32767 * lsb, lsb

    # -- wiring -----------------------------------------------------------------------------------------

    def _writer(self, registers: RegisterFile) -> Write:
        del registers
        return self._write_across_banks

    def _write_across_banks(self, address: int, data: bytes, now_ps: int) -> None:
        """A burst over FUNC_CFG_ACCESS goes on in the bank it has selected."""
        for value in data:
            self.active.write(address, bytes((value,)), now_ps)
            address = self.active.advance(address, 1)

    def _output(self, register: type[Register], stream: SampleStream, flag: int) -> OutputWords:
        flags = DataReady(STATUS_REG, words=(flag,) * (register.size // 2), any=flag)
        return OutputWords(self.registers, register, stream, flags)

    def _wire(self) -> None:
        main = self.registers
        main.before_read(STATUS_REG, self._refresh)
        main.before_read(CTRL3_C, self._clearing.before_read)
        main.on_write(CTRL3_C, self._write_ctrl3)
        changing = {*accelerometer.CONFIGURATION, *gyroscope.CONFIGURATION}
        for feature in self._features:
            changing.update(feature.CONFIGURATION)
        for register in (*(changing - {CTRL3_C}), X_OFS_USR, Y_OFS_USR, Z_OFS_USR):
            main.on_write(register, self._configure)
        main.on_write(FUNC_CFG_ACCESS, self._select_bank)
        for bank in self._banks.values():
            bank.on_write(FUNC_CFG_ACCESS, self._select_bank)

    # -- behaviour --------------------------------------------------------------------------------------

    def _refresh(self, first: int, end: int, now_ps: int) -> None:
        del first, end
        for output in self._outputs:
            output.refresh(now_ps)

    def _write_ctrl3(self, old: int, new: int, now_ps: int) -> None:
        self.catch_up(now_ps)  # under the settings until now
        boot, reset = new & CTRL3_C.BOOT.mask, new & CTRL3_C.SW_RESET.mask
        if boot and reset:
            self.registers.note(now_ps, "forbidden", "CTRL3_C: BOOT and SW_RESET at once")  # AN5040 5.7
        if reset and not self._clearing.pending(CTRL3_C.SW_RESET.mask, now_ps):
            self._refresh(0, 0, now_ps)
            self.registers.reset()
            for bank in self._banks.values():
                bank.reset()
            for output in self._outputs:
                output.reset()
            for feature in self._features:
                feature.reset(now_ps)
            self._clearing.begin(CTRL3_C.SW_RESET.mask, now_ps + _SW_RESET_PS)
            self._configure(old, new, now_ps)
        if boot and not self._clearing.pending(CTRL3_C.BOOT.mask, now_ps):
            # trimming only: configuration and mode are unchanged
            self._clearing.begin(CTRL3_C.BOOT.mask, now_ps + BOOT_PS)
            self._boot.begin(now_ps)
        control = self.registers.mem[CTRL3_C.addr]
        for output in self._outputs:
            output.set_format(
                bdu=bool(control & CTRL3_C.BDU.mask), big_endian=bool(control & CTRL3_C.BLE.mask)
            )
        for registers_ in self.files():
            registers_.increment = bool(control & CTRL3_C.IF_INC.mask)
        for feature in self._features:
            if CTRL3_C in feature.CONFIGURATION:
                feature.configure(now_ps)

    def _configure(self, old: int, new: int, now_ps: int) -> None:
        """A control register has changed: bring all three streams in line with the registers."""
        del old, new
        self.catch_up(now_ps)  # under the settings until now
        self.i2c_off = bool(self.registers.mem[CTRL4_C.addr] & CTRL4_C.I2C_disable.mask)
        self._note_impossible(self.registers.mem, now_ps)
        self._apply(now_ps)

    def _rate_changed(self, at_ps: int) -> None:
        """The part falls asleep or wakes at ``at_ps``; the events themselves have come so far already."""
        for feature in self._features:
            if feature.active and feature is not self._events:
                feature.catch_up(at_ps)
        self._apply(at_ps)

    def _apply(self, now_ps: int) -> None:
        """The sensors run as the registers say; a part that lies still may have put them to sleep."""
        self._refresh(0, 0, now_ps)
        mem = self._events.activity.effective(self.registers.mem)
        was = self._accelerometer.rate, self._gyroscope.rate, self._temperature_rate
        self._accelerometer.configure(mem)
        self._gyroscope.configure(mem, now_ps)
        self._temperature_rate = self._temperature_odr(mem)
        now = self._accelerometer.rate, self._gyroscope.rate, self._temperature_rate
        for output, rate, before in zip(self._outputs, now, was, strict=True):
            if rate != before:
                if rate:
                    waits_ps = self._gyroscope.drive_start_ps(now_ps) if output is self._g else 0
                    output.stream.start(now_ps + waits_ps, rate)
                else:
                    output.stream.stop()
            output.stream.invalidate()
        for feature in self._features:
            feature.configure(now_ps)
        if self._events.activity.enabled and not self._looks_before_reading:
            self._look_before_reading()

    def _look_before_reading(self) -> None:
        """Inactivity changes the rates unseen: from now on catch up before a sample or its flag is read."""
        self._looks_before_reading = True
        for register, output in zip((OUT_XL, OUT_G, OUT_TEMP), self._outputs, strict=True):
            self.registers.before_read(register, self._caught_up(output.before_read))
        self.registers.before_read(STATUS_REG, self._caught_up(self._refresh))

    def _caught_up(self, hook: ReadHook) -> ReadHook:
        def catch_up_and_read(first: int, end: int, now_ps: int) -> bytes | None:
            self.catch_up(now_ps)
            return hook(first, end, now_ps)

        return catch_up_and_read

    def _temperature_odr(self, mem: bytearray) -> Fraction:
        """AN5040 section 9: 52 Hz, or the accelerometer's rate alone at 12.5 or 26 Hz in low power."""
        if self._gyroscope.settings.odr_hz:
            return Fraction(52)
        odr = self._accelerometer.settings.odr_hz
        if not odr:
            return Fraction(0)
        low_power = bool(mem[registers.CTRL6_C.addr] & registers.CTRL6_C.XL_HM_MODE.mask)
        return self._accelerometer.rate if low_power and odr in (12.5, 26) else Fraction(52)

    def _note_impossible(self, mem: bytearray, now_ps: int) -> None:
        note = self.registers.note
        if CTRL1_XL.ODR_XL.get(mem[CTRL1_XL.addr]) > 11:
            note(now_ps, "forbidden", "CTRL1_XL.ODR_XL above 11")
        if CTRL2_G.ODR_G.get(mem[CTRL2_G.addr]) > 10:
            note(now_ps, "forbidden", "CTRL2_G.ODR_G above 10")
        if CTRL5_C.ST_XL.get(mem[CTRL5_C.addr]) == 3:
            note(now_ps, "forbidden", "CTRL5_C.ST_XL = 11b")
        if CTRL5_C.ST_G.get(mem[CTRL5_C.addr]) == 2:
            note(now_ps, "forbidden", "CTRL5_C.ST_G = 10b")
        if reference_mode_is_idle(mem):
            note(now_ps, "forbidden", "CTRL8_XL.HP_REF_MODE without HP_SLOPE_XL_EN = 1 and HPCF_XL above 0")
        if high_pass_is_idle(mem):
            note(now_ps, "forbidden", "CTRL7_G.HP_EN_G outside high performance")

    def _select_bank(self, old: int, new: int, now_ps: int) -> None:
        del old
        if new == FUNC_CFG_ACCESS.FUNC_CFG_EN_B.mask:
            self.registers.note(now_ps, "forbidden", "FUNC_CFG_ACCESS = 0x20 selects no bank")
        chosen = self._banks.get(new, self.registers)
        for registers_ in self.files():  # the register is visible in every bank
            registers_.mem[FUNC_CFG_ACCESS.addr] = new
        if chosen is not self.active:
            self._activate(chosen)

    def _produce_temperature(self, number: int, t_s: Times) -> bytes:
        del number
        degc = self._temperature_degc(t_s) + self._temperature_offset
        return to_int16((np.asarray(degc) - 25.0) * _TEMPERATURE_LSB_PER_DEGC).tobytes()
