"""Plain measuring: the two sensors and the thermometer of the LSM6DSL behind their output registers."""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction

from sensors.lsm6dsl.accelerometer import MG_PER_LSB, Accelerometer
from sensors.lsm6dsl.gyroscope import MDPS_PER_LSB, Gyroscope
from sensors.lsm6dsl.registers import CTRL3_C, CTRL4_C, OUT_G, OUT_TEMP, OUT_XL, STATUS_REG
from sensors.lsm6dsl.thermometer import LSB_PER_DEGC, ZERO_DEGC, Thermometer, thermometer_rate
from sensors.output import DataReady, OutputWords
from sensors.register import Register
from sensors.register_file import ReadHook, RegisterFile
from sensors.sampling import SampleStream

_REGISTERS = (OUT_XL, OUT_G, OUT_TEMP)
_FLAGS = (STATUS_REG.XLDA.mask, STATUS_REG.GDA.mask, STATUS_REG.TDA.mask)


class Measuring:
    """Brings sensors and output registers in line with the control registers, and with the time."""

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
        self._looks_before_reading = False
        registers.before_read(STATUS_REG, self.refresh)

    def refresh(self, first: int, end: int, now_ps: int) -> None:
        """The read hook of STATUS_REG: the latest samples and their flags."""
        del first, end
        for output in self._outputs:
            output.refresh(now_ps)
        if self._registers.mem[CTRL4_C.addr] & CTRL4_C.DRDY_MASK.mask:
            self._hide_unsettled()

    def apply(self, mem: bytearray, now_ps: int) -> None:
        """Measure as the main bank ``mem`` says; samples until ``now_ps`` are those of before."""
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
        """With both sensors on they sample in step (AN5040 3), where Table 3's rates are whole multiples."""
        xl, g, _ = self.streams
        if stream is g:
            now_ps += self._gyroscope.drive_start_ps(now_ps)
        other = {xl: g, g: xl}.get(stream)
        if other is not None and other.running and 1 in (rate / other.rate_hz).as_integer_ratio():
            stream.start_in_step(other, now_ps, rate)
        else:
            stream.start(now_ps, rate)

    def show_through(self, shown: Callable[[SampleStream], SampleStream]) -> None:
        """Each output shows ``shown(stream)`` of its sensor's stream from now on."""
        for output, stream in zip(self._outputs, self.streams, strict=True):
            output.stream = shown(stream)

    def set_format(self) -> None:
        """BDU and BLE as CTRL3_C says."""
        control = self._registers.mem[CTRL3_C.addr]
        bdu, big_endian = bool(control & CTRL3_C.BDU.mask), bool(control & CTRL3_C.BLE.mask)
        for output in self._outputs:
            output.set_format(bdu=bdu, big_endian=big_endian)

    def reset(self) -> None:
        """The outputs read 0 until the next samples."""
        for output in self._outputs:
            output.reset()

    def world_changed(self, now_ps: int | None) -> None:
        """The signals are others: samples still to come are computed anew."""
        self._accelerometer.world_changed(now_ps)
        self._gyroscope.world_changed(now_ps)
        self.streams[2].invalidate()

    def look_before_reading(self, catch_up: Callable[[int], None]) -> None:
        """From now on ``catch_up(now_ps)`` comes before a sample or its flag is read.

        Inactivity changes the rates unseen; without it reading need not ask.
        """
        if self._looks_before_reading:
            return
        self._looks_before_reading = True
        for register, output in zip(_REGISTERS, self._outputs, strict=True):
            self._registers.before_read(register, _caught_up(catch_up, output.before_read))
        self._registers.before_read(STATUS_REG, _caught_up(catch_up, self.refresh))

    def sample_range(self, channel: str) -> tuple[float, float, float]:
        """(lowest value, highest value, size of one LSB) of ``channel`` as now configured."""
        lsb, zero = {
            "acceleration_g": (MG_PER_LSB[self._accelerometer.settings.scale] / 1000, 0.0),
            "angular_rate_dps": (MDPS_PER_LSB[self._gyroscope.settings.scale] / 1000, 0.0),
            "temperature_degc": (1 / LSB_PER_DEGC, ZERO_DEGC),
        }[channel]
        return zero - 32768 * lsb, zero + 32767 * lsb, lsb

    def _hide_unsettled(self) -> None:
        """No data-ready from samples that are to be discarded (AN5040 4.3)."""
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
