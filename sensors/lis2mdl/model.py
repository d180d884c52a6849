"""The LIS2MDL's behaviour behind its registers.

Decisions where the documents are silent: triggering a single measurement does not clear Zyxda (in ST's examples, the
polling loop triggers measurements); a per-axis flag is cleared by its high byte; registers answer during REBOOT, but
not during the boot after power-on. A note reports a measurement with COMP_TEMP_EN = 0, because the bit
"must be 1" (datasheet 8.5).
"""

from __future__ import annotations

from collections.abc import Callable
from typing import ClassVar, Literal, TypeAlias

from fcu_emulator.sensors.declaration import Bus, Function, Quantity, Wires
from fcu_emulator.sensors.errors import PartErrors
from fcu_emulator.sensors.lis2mdl import registers
from fcu_emulator.sensors.lis2mdl.declaration import BUS, FUNCTIONS, SIGNALS, LIS2MDLErrors
from fcu_emulator.sensors.lis2mdl.interrupt import IntDrdyPin, InterruptGenerator
from fcu_emulator.sensors.lis2mdl.magnetometer import (
    DEGC_PER_LSB,
    MGAUSS_PER_LSB,
    TEMPERATURE_COUNTS,
    ZERO_DEGC,
    Magnetometer,
    MagnetometerTemperature,
)
from fcu_emulator.sensors.lis2mdl.modes import BOOT_PS, IDLE, Modes, Outputs, Streams
from fcu_emulator.sensors.lis2mdl.registers import (
    CFG_REG_A,
    CFG_REG_B,
    CFG_REG_C,
    INT_CRTL_REG,
    INT_SOURCE_REG,
    INT_THS,
    OFFSET_X_REG,
    OFFSET_Y_REG,
    OFFSET_Z_REG,
    OUT,
    STATUS_REG,
)
from fcu_emulator.sensors.part import SelfClearingBits, Sensor, Signal
from fcu_emulator.sensors.pin import Pin
from fcu_emulator.sensors.register import RegisterMap
from fcu_emulator.sensors.register_file import NEVER_PS, WriteHook
from fcu_emulator.sensors.sampling import PS_PER_S, SampleStream

_SOFT_RST_PS = 5 * PS_PER_S // 10**6  # datasheet 8.5
_BURST_WRAP = {0x6D: 0x68}  # after Z a burst continues at X, never at the temperature (PX4's driver)


class LIS2MDL(Sensor):
    """Magnetometer with thermometer; ``magnetic_field_mgauss``: (n, 3) in the sensor's axes.

    ``powered_on_ps``: time of power-on, 20 ms before registers answer; None if already started. ``int_idle_level``: bit
    INT while IEN = 0 and IEA = 0.
    """

    NAME: ClassVar[str] = "LIS2MDL"
    WHO_AM_I: ClassVar[int] = 0x40
    MAP: ClassVar[RegisterMap] = RegisterMap.of(registers)
    SIGNALS: ClassVar[tuple[Quantity, ...]] = SIGNALS
    BUS: ClassVar[Bus] = BUS
    ERRORS: ClassVar[type[PartErrors]] = LIS2MDLErrors
    FUNCTIONS: ClassVar[tuple[Function, ...]] = FUNCTIONS

    def __init__(
        self,
        magnetic_field_mgauss: Signal,
        temperature_degc: Signal,
        errors: LIS2MDLErrors | None = None,
        seed: int = 0,
        *,
        powered_on_ps: int | None = None,
        int_idle_level: Literal[0, 1] = 0,
    ) -> None:
        accessible_ps = 0 if powered_on_ps is None else powered_on_ps + BOOT_PS
        super().__init__(self.MAP, _BURST_WRAP, accessible_ps)
        errors = errors or LIS2MDLErrors()
        main, mem = self.registers, self.registers.mem
        self._magnetometer = Magnetometer(magnetic_field_mgauss, temperature_degc, errors, seed, mem)
        thermometer = MagnetometerTemperature(temperature_degc, errors.temperature_offset_degc)
        self._streams = streams = Streams(
            SampleStream(6, self._magnetometer.produce),
            SampleStream(2, thermometer.produce),
            SampleStream(1, self._magnetometer.compare),
            self._magnetometer.pulses,
        )
        self.streams = streams.all
        self._outputs = Outputs(main, streams, self._after_sample)
        self._modes = Modes(mem, streams, accessible_ps)
        self._pin = IntDrdyPin()
        self._interrupt = InterruptGenerator(
            streams.compared,
            self._magnetometer.interrupt,
            int_idle_level,
            lambda at_ps, level: self._pin.drive("INT", level, at_ps),
        )
        self._clearing = SelfClearingBits(main, CFG_REG_A)
        self._drives_after_output = False
        self._wire()

    def _wire(self) -> None:
        main = self.registers
        main.set_status(STATUS_REG, self._refresh)
        main.before_read(CFG_REG_A, self._before_config)
        main.before_read(INT_SOURCE_REG, self._before_source)
        main.after_read(INT_SOURCE_REG, self._after_source)
        main.on_write(CFG_REG_A, self._write_config_a)
        main.on_write(CFG_REG_B, self._noting(_forbidden_in_b))
        main.on_write(CFG_REG_C, self._noting(_forbidden_in_c))
        for register in (INT_CRTL_REG, INT_THS, OFFSET_X_REG, OFFSET_Y_REG, OFFSET_Z_REG):
            main.on_write(register, self._configure)

    # -- interface of the sensor ------------------------------------------------------------------------

    def supply_current_ua(self, single_hz: float = 0.0) -> float:
        return _supply_current_ua(self.registers.mem, single_hz)

    def spi_wires(self) -> Wires:
        return 4 if self.registers.mem[CFG_REG_C.addr] & CFG_REG_C.FOURWSPI.mask else 3

    def pins(self) -> tuple[Pin, ...]:
        return (self._pin.pin,)

    def catch_up(self, now_ps: int) -> None:
        self._interrupt.catch_up(now_ps)
        if self._pin.shows == "DRDY":
            self._outputs.field.refresh(now_ps)

    def next_event_ps(self) -> int:
        """Return the time at which the next sample can change the pin."""
        if self._pin.pin.wired and self._pin.shows == "DRDY":
            return self._streams.field.next_ps
        if self._pin.pin.wired and self._pin.shows == "INT" and self._interrupt.settings.on:
            return min(self._streams.compared.next_ps, NEVER_PS)
        return NEVER_PS

    def sample_range(self, channel: str) -> tuple[float, float, float]:
        lsb, zero, counts = {
            "magnetic_field_mgauss": (MGAUSS_PER_LSB, 0.0, 32768),
            "temperature_degc": (DEGC_PER_LSB, ZERO_DEGC, TEMPERATURE_COUNTS),
        }[channel]
        return zero - counts * lsb, zero + (counts - 1) * lsb, lsb

    # -- samples ----------------------------------------------------------------------------------------

    def _refresh(self, first: int, end: int, now_ps: int) -> None:
        del first, end
        self._outputs.refresh(now_ps)

    def _after_sample(self, count: int) -> None:
        self._modes.measured()
        if self._pin.shows == "DRDY":
            field = self._streams.field
            self._pin.drive("DRDY", 1, field.time_ps(field.index - count + 1))

    # -- registers with side effects of reads -----------------------------------------------------------

    def _before_config(self, first: int, end: int, now_ps: int) -> None:
        self._refresh(first, end, now_ps)
        self._clearing.before_read(first, end, now_ps)

    def _before_source(self, first: int, end: int, now_ps: int) -> None:
        del first, end
        self._interrupt.catch_up(now_ps)
        self.registers.mem[INT_SOURCE_REG.addr] = self._interrupt.source

    def _after_source(self, first: int, end: int, now_ps: int) -> None:
        del first, end
        self._interrupt.after_reading_source()
        self._drive_pin(now_ps)

    def _after_output(self, first: int, end: int, now_ps: int) -> None:
        del first, end
        self._drive_pin(now_ps)

    # -- configuration ----------------------------------------------------------------------------------

    def _write_config_a(self, old: int, new: int, now_ps: int) -> None:
        main, clearing = self.registers, self._clearing
        # First process a single measurement that may have ended before this write.
        main.mem[CFG_REG_A.addr] = old
        self._refresh(0, 0, now_ps)
        main.mem[CFG_REG_A.addr] = new
        self._note(_forbidden_in_a, old, new, now_ps)
        if new & CFG_REG_A.SOFT_RST.mask:
            self._reset(now_ps)
            clearing.begin(CFG_REG_A.SOFT_RST.mask, now_ps + _SOFT_RST_PS)
        boots = new & CFG_REG_A.REBOOT.mask and not clearing.pending(CFG_REG_A.REBOOT.mask, now_ps)
        if boots:
            main.mem[CFG_REG_A.addr] = CFG_REG_A.MD.put(main.mem[CFG_REG_A.addr], IDLE)
            clearing.begin(CFG_REG_A.REBOOT.mask, now_ps + BOOT_PS)
        self._configure(old, new, now_ps)
        if boots:
            self._modes.boot(now_ps)

    def _reset(self, now_ps: int) -> None:
        self._interrupt.catch_up(now_ps)
        self.registers.reset()
        self._outputs.reset()
        self._modes.stop()

    def _configure(self, old: int, new: int, now_ps: int) -> None:
        del old, new
        self._interrupt.catch_up(now_ps)
        self._refresh(0, 0, now_ps)
        magnetometer, mem = self._magnetometer, self.registers.mem
        was = magnetometer.settings
        magnetometer.configure(mem, self._streams.next_number())
        self._interrupt.configure(magnetometer.interrupt, now_ps)
        self._streams.invalidate()
        self._outputs.configure()
        self._modes.configure(was, magnetometer.settings, now_ps)
        self._configure_bus(now_ps)

    def _configure_bus(self, now_ps: int) -> None:
        control = self.registers.mem[CFG_REG_C.addr]
        self.i2c_off = bool(control & CFG_REG_C.I2C_DIS.mask)
        self._pin.configure(control, now_ps)
        if self._pin.shows == "DRDY" and not self._drives_after_output:
            self._drives_after_output = True
            self.registers.after_read(
                OUT, self._after_output
            )  # added only when needed, because this hook makes reads slower
        self._drive_pin(now_ps)
        self._outputs.field.one_by_one = not self._modes.continuous or self._pin.shows == "DRDY"

    def _drive_pin(self, now_ps: int) -> None:
        self._pin.drive("INT", self._interrupt.level, now_ps)
        self._pin.drive("DRDY", STATUS_REG.Zyxda.get(self.registers.mem[STATUS_REG.addr]), now_ps)

    def _noting(self, forbidden: _Forbidden) -> WriteHook:
        def note_and_configure(old: int, new: int, now_ps: int) -> None:
            self._note(forbidden, old, new, now_ps)
            self._configure(old, new, now_ps)

        return note_and_configure

    def _note(self, forbidden: _Forbidden, old: int, new: int, now_ps: int) -> None:
        violation = forbidden(new)
        if violation not in (None, forbidden(old)):
            self.registers.note(now_ps, "forbidden", *violation)


# -- forbidden settings -------------------------------------------------------------------------------------

_Forbidden: TypeAlias = Callable[[int], tuple[str, str] | None]
"""``forbidden(value)``: returns name and text of the violation that the register value causes."""


def _forbidden_in_a(value: int) -> tuple[str, str] | None:
    """Return violations of AN5069 section 7 and datasheet 8.5."""
    if value & CFG_REG_A.REBOOT.mask and value & CFG_REG_A.SOFT_RST.mask:
        return "boot-and-reset", "CFG_REG_A: REBOOT and SOFT_RST at once"
    idle = CFG_REG_A.MD.get(value) > 1 or value & (CFG_REG_A.REBOOT.mask | CFG_REG_A.SOFT_RST.mask)
    if not idle and not value & CFG_REG_A.COMP_TEMP_EN.mask:
        return "no-temperature-compensation", "CFG_REG_A: measuring with COMP_TEMP_EN = 0"
    return None


def _forbidden_in_b(value: int) -> tuple[str, str] | None:
    if value & CFG_REG_B.OFF_CANC_ONE_SHOT.mask and not value & CFG_REG_B.OFF_CANC.mask:
        return "offset-cancellation", "CFG_REG_B: OFF_CANC_ONE_SHOT without OFF_CANC"
    return None


def _forbidden_in_c(value: int) -> tuple[str, str] | None:
    """Return violations of AN5069 Rev 4: INT/DRDY is SDO in 4-wire SPI."""
    shown = value & (CFG_REG_C.INT_on_PIN.mask | CFG_REG_C.DRDY_on_PIN.mask)
    if shown and value & CFG_REG_C.FOURWSPI.mask:
        return "pin-is-sdo", "CFG_REG_C: INT/DRDY is SDO while 4WSPI = 1"
    return None


# -- supply current, for estimates of battery life (datasheet Table 3, AN5069 Table 8) ----------------------

_IDLE_UA = 1.5
_CONTINUOUS_UA = {  # by (low power, offset cancellation): at 10, 20, 50 and 100 Hz
    (False, False): (100.0, 200.0, 475.0, 950.0),
    (False, True): (120.0, 235.0, 575.0, 1130.0),
    (True, False): (25.0, 50.0, 125.0, 250.0),
    (True, True): (50.0, 100.0, 235.0, 460.0),
}


def _supply_current_ua(mem: bytearray, single_hz: float) -> float:
    """Return the mean supply current in microampere; for single measurements it is scaled from 10 Hz."""
    config = mem[CFG_REG_A.addr]
    mode = bool(config & CFG_REG_A.LP.mask), bool(mem[CFG_REG_B.addr] & CFG_REG_B.OFF_CANC.mask)
    at_rate = _CONTINUOUS_UA[mode]
    if not config & CFG_REG_A.MD.mask:
        return at_rate[CFG_REG_A.ODR.get(config)]
    return (at_rate[0] - _IDLE_UA) * single_hz / 10 + _IDLE_UA
