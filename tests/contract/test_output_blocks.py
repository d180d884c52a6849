"""Output blocks under any permitted use, compared with an oracle that handles single bytes and samples.

The rules are AN5040 4.3 to 4.5 (LSM6DSL), AN5069 6.3 to 6.5 (LIS2MDL) and the LPS22HB datasheet (9.5, 9.20). If these
do not state a rule, the decisions at the top of the models apply.
"""

from __future__ import annotations

from collections.abc import Callable

from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, precondition, rule

from tests.support.sensor_fakes import (
    ACCELEROMETER,
    GYROSCOPE,
    LIS2MDL_TEMPERATURE,
    LPS22HB_TEMPERATURE,
    LSM6DSL_TEMPERATURE,
    MAGNETOMETER,
    PRESSURE,
    Channel,
    Chip,
    ramp,
)

PERIODS = st.one_of(st.sampled_from((0.0, 0.3, 1.0)), st.floats(0, 5))


def counts_per_sample(channel: Channel) -> int:
    """Return a step that changes both bytes of a word, and keeps a thermometer of 12 bits in range for a while."""
    return 317 if channel.bits > 12 else 61


def started(channel: Channel) -> Chip:
    """Start a channel. Sample k has k + 1 steps of ``counts_per_sample`` on axis 0, each next axis 1000 counts more."""
    chip = Chip(channel.part)
    lsb = channel.scales[0][1]
    step = counts_per_sample(channel) * lsb
    per_s = step * float(channel.rate_hz)
    at_first = step - per_s * channel.sample_ps(0) / 1e12
    offsets = tuple(channel.zero + at_first + axis * 1000 * lsb for axis in range(channel.axes))
    chip.world.signals[channel.name] = ramp(offsets, channel.value(per_s))
    chip.configure(channel.scales[0][0])
    return chip


def word_bytes(channel: Channel, sample: int, axis: int) -> bytes:
    """Return the little-endian word of ``sample``, 0 before the first."""
    count = 0 if sample < 0 else counts_per_sample(channel) * (sample + 1) + 1000 * axis
    return min(count, channel.limits[1]).to_bytes(channel.width, "little")


class Samples:
    """Oracle that takes the samples up to a given time, one by one."""

    def __init__(self, channel: Channel, on_sample: Callable[[], None]) -> None:
        self._channel = channel
        self._on_sample = on_sample
        self.latest = -1

    def run_to(self, t_ps: int) -> None:
        while self._channel.sample_ps(self.latest + 1) <= t_ps:
            self.latest += 1
            self._on_sample()


class WordsMachine(RuleBasedStateMachine):
    """LSM6DSL and LIS2MDL: words are held independently, with one data-ready flag."""

    channel: Channel
    bdu_register = (0x12, 0x04, 0x40, 0x02)  # address, the other bits, BDU, BLE

    @initialize()
    def power_up(self) -> None:
        self.chip = started(self.channel)
        self.samples = Samples(self.channel, self.sample_comes)
        self.shown = [bytes(2)] * self.channel.axes
        self.read_half: list[int | None] = [None] * self.channel.axes  # the byte read whose partner was not
        self.ready = False
        self.bdu = self.ble = False

    def sample_comes(self) -> None:
        self.ready = True

    def word(self, axis: int) -> bytes:
        return word_bytes(self.channel, self.samples.latest, axis)

    def expect_byte(self, offset: int) -> int:
        axis, half = divmod(offset, 2)
        if self.read_half[axis] is None:
            word = self.word(axis)
            self.shown[axis] = word[::-1] if self.ble else word
        if half == 1:
            self.ready = False
        if self.bdu:
            self.read_half[axis] = None if self.read_half[axis] == 1 - half else half
        return self.shown[axis][half]

    @rule(periods=PERIODS)
    def time_passes(self, periods: float) -> None:
        self.chip.wait(int(periods * 1e12 / self.channel.rate_hz))
        self.samples.run_to(self.chip.t_ps)

    @rule(data=st.data())
    def burst(self, data: st.DataObject) -> None:
        first = data.draw(st.integers(0, self.channel.size - 1))
        count = data.draw(st.integers(1, self.channel.size - first))
        expected = bytes(self.expect_byte(offset) for offset in range(first, first + count))
        assert self.chip.read(self.channel.address + first, count) == expected

    @rule(data=st.data())
    def high_byte_then_whole_block(self, data: st.DataObject) -> None:
        """A pair whose high byte is read first is released in the middle of the next burst."""
        high = 2 * data.draw(st.integers(0, self.channel.axes - 1)) + 1
        assert self.chip.byte(self.channel.address + high) == self.expect_byte(high)
        self.time_passes(data.draw(PERIODS))
        expected = bytes(self.expect_byte(offset) for offset in range(self.channel.size))
        assert self.chip.read(self.channel.address, self.channel.size) == expected

    @rule()
    def read_status(self) -> None:
        if self.channel.ready is not None:
            assert self.chip.is_ready(self.channel) == self.ready

    @rule(bdu=st.booleans(), ble=st.booleans())
    def configure(self, bdu: bool, ble: bool) -> None:
        address, others, bdu_bit, ble_bit = self.bdu_register
        self.chip.write(address, others | bdu * bdu_bit | ble * ble_bit)
        self.bdu, self.ble = bdu, ble
        if not bdu:
            self.read_half = [None] * self.channel.axes


class AccelerometerMachine(WordsMachine):
    channel = ACCELEROMETER


class GyroscopeMachine(WordsMachine):
    """The gyroscope's samples come from filters: a second chip without reads gives the expected values."""

    channel = GYROSCOPE

    @initialize()
    def no_sample_yet(self) -> None:
        self.undisturbed = started(self.channel)
        self.sample = bytes(6)

    def sample_comes(self) -> None:
        super().sample_comes()
        self.undisturbed.t_ps = self.channel.sample_ps(self.samples.latest)
        self.sample = self.undisturbed.read(self.channel.address, self.channel.size)

    def word(self, axis: int) -> bytes:
        return self.sample[2 * axis : 2 * axis + 2]


class Lsm6dslTemperatureMachine(WordsMachine):
    channel = LSM6DSL_TEMPERATURE


class Lis2mdlTemperatureMachine(WordsMachine):
    channel = LIS2MDL_TEMPERATURE
    bdu_register = (0x62, 0x00, 0x10, 0x08)


class MagnetometerMachine(WordsMachine):
    """The LIS2MDL has a flag and an overrun flag for each axis, and a common flag of each kind for all axes."""

    channel = MAGNETOMETER
    bdu_register = (0x62, 0x00, 0x10, 0x08)
    ALL = 3

    @initialize()
    def no_flags(self) -> None:
        self.available = [False] * 4  # X, Y, Z, all
        self.overrun = [False] * 4

    def sample_comes(self) -> None:
        super().sample_comes()
        self.overrun = [over or there for over, there in zip(self.overrun, self.available, strict=True)]
        self.available = [True] * 4

    def expect_byte(self, offset: int) -> int:
        if offset % 2 == 1:
            for flag in (offset // 2, self.ALL):
                self.available[flag] = self.overrun[flag] = False
        return super().expect_byte(offset)

    @rule()
    def read_all_flags(self) -> None:
        expected = sum(flag << bit for bit, flag in enumerate(self.available + self.overrun))
        assert self.chip.byte(0x67) == expected


class BarometerMachine(RuleBasedStateMachine):
    """LPS22HB: pressure and temperature are one sample, which is held until PRESS_OUT_H (0x2A) is read."""

    @initialize()
    def power_up(self) -> None:
        self.chip = started(PRESSURE)
        self.chip.world.signals["temperature_degc"] = started(LPS22HB_TEMPERATURE).world.signals[
            "temperature_degc"
        ]
        self.chip.part.world_changed()
        self.samples = Samples(PRESSURE, self.sample_comes)
        self.shown = bytes(5)
        self.bdu = self.held = False
        self.pressure_ready = self.temperature_ready = False
        self.pressure_overrun = self.temperature_overrun = False

    def sample_comes(self) -> None:
        self.pressure_overrun |= self.pressure_ready
        self.temperature_overrun |= self.temperature_ready
        self.pressure_ready = self.temperature_ready = True

    def expect_byte(self, offset: int) -> int:
        if not self.held:
            latest = self.samples.latest
            self.shown = word_bytes(PRESSURE, latest, 0) + word_bytes(LPS22HB_TEMPERATURE, latest, 0)
        if offset == 2:
            self.held = self.pressure_ready = self.pressure_overrun = False
        elif offset < 2:
            self.held = self.bdu
        elif offset == 4:
            self.temperature_ready = self.temperature_overrun = False
        return self.shown[offset]

    @rule(periods=PERIODS)
    def time_passes(self, periods: float) -> None:
        self.chip.wait(int(periods * 1e12 / PRESSURE.rate_hz))
        self.samples.run_to(self.chip.t_ps)

    @rule(first=st.integers(0, 4), count=st.integers(1, 12))
    def burst(self, first: int, count: int) -> None:
        """After the temperature a burst continues with the pressure (datasheet 5.8)."""
        expected = bytes(self.expect_byte(offset % 5) for offset in range(first, first + count))
        assert self.chip.read(0x28 + first, count) == expected

    @rule()
    def read_status(self) -> None:
        expected = self.pressure_ready | self.temperature_ready << 1
        expected |= self.pressure_overrun << 4 | self.temperature_overrun << 5
        assert self.chip.byte(0x27) == expected

    @rule()
    @precondition(lambda self: self.bdu)
    def bdu_off(self) -> None:
        self.chip.write(0x10, 0x50)
        self.bdu = self.held = False

    @rule()
    @precondition(lambda self: not self.bdu)
    def bdu_on(self) -> None:
        self.chip.write(0x10, 0x52)
        self.bdu = True


MACHINES = (
    AccelerometerMachine,
    GyroscopeMachine,
    Lsm6dslTemperatureMachine,
    Lis2mdlTemperatureMachine,
    MagnetometerMachine,
    BarometerMachine,
)
for machine in MACHINES:
    machine.TestCase.settings = settings(max_examples=40, stateful_step_count=30)
TestAccelerometer = AccelerometerMachine.TestCase
TestGyroscope = GyroscopeMachine.TestCase
TestLsm6dslTemperature = Lsm6dslTemperatureMachine.TestCase
TestLis2mdlTemperature = Lis2mdlTemperatureMachine.TestCase
TestMagnetometer = MagnetometerMachine.TestCase
TestBarometer = BarometerMachine.TestCase
