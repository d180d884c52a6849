"""Plain measuring: both sensors and the thermometer (AN5040 9), and the supply current.

Approximation (datasheet Tables 3 and 4): outside high-performance mode, both sensors together need the sum of their
currents, at most 650 uA. A sleeping gyroscope needs the current of its slowest mode.
"""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction

import numpy as np

from fcu_emulator.sensors.lsm6dsl.accelerometer import MG_PER_LSB, Accelerometer, reference_mode_is_idle
from fcu_emulator.sensors.lsm6dsl.gyroscope import MDPS_PER_LSB, Gyroscope, high_pass_is_idle
from fcu_emulator.sensors.lsm6dsl.registers import (
    CTRL1_XL,
    CTRL2_G,
    CTRL3_C,
    CTRL4_C,
    CTRL5_C,
    CTRL6_C,
    CTRL7_G,
    OUT_G,
    OUT_TEMP,
    OUT_XL,
    STATUS_REG,
    X_OFS_USR,
    Y_OFS_USR,
    Z_OFS_USR,
)
from fcu_emulator.sensors.part import Signal
from fcu_emulator.sensors.register import Register
from fcu_emulator.sensors.register_file import ReadHook, RegisterFile
from fcu_emulator.sensors.sampling import DataReady, OutputWords, SampleStream, Times, to_int16

LSB_PER_DEGC = 256
ZERO_DEGC = 25.0  # the temperature at which the register reads 0
_TEMPERATURE_HZ = Fraction(52)


class Thermometer:
    """The thermometer; ``offset_degc`` is its error."""

    def __init__(self, temperature_degc: Signal, offset_degc: float) -> None:
        self._temperature_degc = temperature_degc
        self._offset_degc = offset_degc
        self.stream = SampleStream(2, self.produce)

    def produce(self, number: int, t_s: Times) -> bytes:
        del number
        degc = np.broadcast_to(self._temperature_degc(t_s), t_s.shape) + self._offset_degc
        return to_int16((degc - ZERO_DEGC) * LSB_PER_DEGC).tobytes()


def thermometer_rate(mem: bytearray, xl_hz: float, *, gyroscope_on: bool) -> Fraction:
    """Return the nominal rate: 52 Hz, or the rate of an accelerometer that runs alone, in low power, at 12.5 or 26 Hz
    (AN5040 9).
    """
    if gyroscope_on or not xl_hz:
        return _TEMPERATURE_HZ if gyroscope_on else Fraction(0)
    low_power = bool(mem[CTRL6_C.addr] & CTRL6_C.XL_HM_MODE.mask)
    return Fraction(xl_hz) if low_power and xl_hz in (12.5, 26) else _TEMPERATURE_HZ


_REGISTERS = (OUT_XL, OUT_G, OUT_TEMP)
_FLAGS = (STATUS_REG.XLDA.mask, STATUS_REG.GDA.mask, STATUS_REG.TDA.mask)


class Measuring:
    """The two sensors and the thermometer behind their output registers."""

    def __init__(
        self,
        registers: RegisterFile,
        accelerometer: Accelerometer,
        gyroscope: Gyroscope,
        thermometer: Thermometer,
    ) -> None:
        self._registers = registers
        self._accelerometer, self._gyroscope = accelerometer, gyroscope
        self.streams = (accelerometer.stream, gyroscope.stream, thermometer.stream)
        self._outputs = tuple(
            _output(registers, register, stream, flag)
            for register, stream, flag in zip(_REGISTERS, self.streams, _FLAGS, strict=True)
        )
        self._temperature_rate = Fraction(0)
        self._catches_up_before_reading = self._masks = False
        registers.set_status(STATUS_REG, self._before_status)

    def refresh(self, now_ps: int) -> None:
        for output in self._outputs:
            output.refresh(now_ps)
        if self._registers.mem[CTRL4_C.addr] & CTRL4_C.DRDY_MASK.mask:
            self._hide_unsettled()

    def _before_status(self, first: int, end: int, now_ps: int) -> None:
        del first, end
        self.refresh(now_ps)

    def _before_masked_status(self, first: int, end: int, now_ps: int) -> None:
        """Do the same as ``_before_status``. This separate hook makes Python handle the reads, because C would not hide
        masked samples.
        """
        self._before_status(first, end, now_ps)

    def _set_mask(self, mem: bytearray) -> None:
        masks = bool(mem[CTRL4_C.addr] & CTRL4_C.DRDY_MASK.mask)
        if masks != self._masks and not self._catches_up_before_reading:
            hook = self._before_masked_status if masks else self._before_status
            self._registers.before_read(STATUS_REG, hook)
        self._masks = masks

    def apply(self, mem: bytearray, now_ps: int) -> None:
        """Configure the measurement; earlier samples use the old settings."""
        self._set_mask(mem)
        was = self._rates()
        self._accelerometer.configure(mem)
        self._gyroscope.configure(mem, now_ps)
        gyroscope_on = bool(self._gyroscope.settings.odr_hz)
        xl_hz = self._accelerometer.settings.odr_hz
        nominal = thermometer_rate(mem, xl_hz, gyroscope_on=gyroscope_on)
        self._temperature_rate = nominal * self._accelerometer.rate_factor
        for stream, rate, before in zip(self.streams, self._rates(), was, strict=True):
            if rate != before:
                if rate:
                    self._start(stream, rate, now_ps)
                else:
                    stream.stop()
            stream.invalidate()

    def _start(self, stream: SampleStream, rate: Fraction, now_ps: int) -> None:
        """Start a stream, in phase with the other stream if possible (AN5040 3)."""
        xl, g, _ = self.streams
        if stream is g:
            now_ps += self._gyroscope.drive_start_ps(now_ps)
        other = {xl: g, g: xl}.get(stream)
        if other is not None and other.running and 1 in (rate / other.rate_hz).as_integer_ratio():
            stream.start_in_step(other, now_ps, rate)
        else:
            stream.start(now_ps, rate)

    def show_through(self, shown: Callable[[SampleStream], SampleStream]) -> None:
        for output, stream in zip(self._outputs, self.streams, strict=True):
            output.stream = shown(stream)

    def set_format(self) -> None:
        control = self._registers.mem[CTRL3_C.addr]
        bdu, big_endian = bool(control & CTRL3_C.BDU.mask), bool(control & CTRL3_C.BLE.mask)
        for output in self._outputs:
            output.set_format(bdu=bdu, big_endian=big_endian)

    def reset(self) -> None:
        for output in self._outputs:
            output.reset()

    def catch_up_before_reading(self, catch_up: Callable[[int], None]) -> None:
        """Call ``catch_up(now_ps)`` before later reads, because inactivity can change the rates."""
        if self._catches_up_before_reading:
            return
        self._catches_up_before_reading = True
        for register, output in zip(_REGISTERS, self._outputs, strict=True):
            self._registers.before_read(register, _caught_up(catch_up, output.before_read))
        self._registers.before_read(STATUS_REG, _caught_up(catch_up, self._before_status))

    def sample_range(self, channel: str) -> tuple[float, float, float]:
        lsb, zero = {
            "acceleration_g": (MG_PER_LSB[self._accelerometer.settings.scale] / 1000, 0.0),
            "angular_rate_dps": (MDPS_PER_LSB[self._gyroscope.settings.scale] / 1000, 0.0),
            "temperature_degc": (1 / LSB_PER_DEGC, ZERO_DEGC),
        }[channel]
        return zero - 32768 * lsb, zero + 32767 * lsb, lsb

    def _hide_unsettled(self) -> None:
        for stream, flag in zip(self.streams, _FLAGS, strict=True):
            if stream.index < stream.settled_index:
                self._registers.mem[STATUS_REG.addr] &= ~flag

    def _rates(self) -> tuple[Fraction, Fraction, Fraction]:
        return self._accelerometer.rate, self._gyroscope.rate, self._temperature_rate


def _output(
    registers: RegisterFile, register: type[Register], stream: SampleStream, flag: int
) -> OutputWords:
    flags = DataReady(STATUS_REG, words=(flag,) * (register.size // 2), any=flag)
    return OutputWords(registers, register, stream, flags)


def _caught_up(catch_up: Callable[[int], None], hook: ReadHook) -> ReadHook:
    def catch_up_and_read(first: int, end: int, now_ps: int) -> bytes | None:
        catch_up(now_ps)
        return hook(first, end, now_ps)

    return catch_up_and_read


# -- invalid settings ---------------------------------------------------------------------------------------

_NOT_A_USER_OFFSET = 0x80  # -128; datasheet 9.91 to 9.93 give -127 to 127


def measuring_violations(mem: bytearray) -> dict[tuple[str, str], bool]:
    """Return the invalid settings of both sensors (datasheet Tables 52, 55, 63, 64)."""
    offsets = {register.__name__: mem[register.addr] for register in (X_OFS_USR, Y_OFS_USR, Z_OFS_USR)}
    return {
        ("reserved-rate", "CTRL1_XL.ODR_XL above 11"): CTRL1_XL.ODR_XL.get(mem[CTRL1_XL.addr]) > 11,
        ("reserved-rate", "CTRL2_G.ODR_G above 10"): CTRL2_G.ODR_G.get(mem[CTRL2_G.addr]) > 10,
        ("reserved-self-test", "CTRL5_C.ST_XL = 11b"): CTRL5_C.ST_XL.get(mem[CTRL5_C.addr]) == 3,
        ("reserved-self-test", "CTRL5_C.ST_G = 10b"): CTRL5_C.ST_G.get(mem[CTRL5_C.addr]) == 2,
        (
            "reference-mode",
            "CTRL8_XL.HP_REF_MODE, which needs HP_SLOPE_XL_EN = 1 and HPCF_XL above 0",
        ): reference_mode_is_idle(mem),
        ("high-pass", "CTRL7_G.HP_EN_G outside high performance"): high_pass_is_idle(mem),
        **{("user-offset", f"{name} = 0x80"): value == _NOT_A_USER_OFFSET for name, value in offsets.items()},
    }


# -- supply current of the sensors, for estimates of battery life -------------------------------------------

_POWER_DOWN_UA = 3.0
_XL_LOW_POWER_UA = {1: 9.0, 2: 14.0, 3: 25.0, 4: 44.0, 5: 85.0, 11: 4.5}  # ODR code, XL_HM_MODE = 1
_XL_HIGH_PERFORMANCE_UA = 150.0
_XL_FAST_UA = 160.0  # 1666 Hz and above
_XL_FAST_CODE = 8
_XL_LAST_CODE = 11
_G_LOW_POWER_UA = {1: 232.0, 2: 245.0, 3: 270.0, 4: 325.0, 5: 430.0}  # ODR code, G_HM_MODE = 1
_G_HIGH_PERFORMANCE_UA = 555.0
_G_LAST_CODE = 10
_BOTH_HIGH_PERFORMANCE_UA = 650.0


def supply_current_ua(mem: bytearray) -> float:
    """Return the supply current in microampere."""
    xl, g = _accelerometer_ua(mem), _gyroscope_ua(mem)
    if xl and g:
        return min(xl + g, _BOTH_HIGH_PERFORMANCE_UA)
    return xl or g or _POWER_DOWN_UA


def _accelerometer_ua(mem: bytearray) -> float:
    code = CTRL1_XL.ODR_XL.get(mem[CTRL1_XL.addr])
    if not 0 < code <= _XL_LAST_CODE:
        return 0.0
    if mem[CTRL6_C.addr] & CTRL6_C.XL_HM_MODE.mask and code in _XL_LOW_POWER_UA:
        return _XL_LOW_POWER_UA[code]
    return _XL_FAST_UA if _XL_FAST_CODE <= code < _XL_LAST_CODE else _XL_HIGH_PERFORMANCE_UA


def _gyroscope_ua(mem: bytearray) -> float:
    code = CTRL2_G.ODR_G.get(mem[CTRL2_G.addr])
    if not 0 < code <= _G_LAST_CODE:
        return 0.0
    if mem[CTRL4_C.addr] & CTRL4_C.SLEEP.mask:
        return _G_LOW_POWER_UA[1]
    if mem[CTRL7_G.addr] & CTRL7_G.G_HM_MODE.mask and code in _G_LOW_POWER_UA:
        return _G_LOW_POWER_UA[code]
    return _G_HIGH_PERFORMANCE_UA
