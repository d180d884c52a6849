"""The FIFO and the timestamp of the LSM6DSL alone, between sensors whose samples show their times.

Other tests use the whole sensor through its registers. Here it is easier to raise events of other functions.
"""

from __future__ import annotations

from fractions import Fraction
from functools import partial

import numpy as np

from fcu_emulator.sensors import LSM6DSL
from fcu_emulator.sensors.lsm6dsl.feature import FeatureContext, SignalName, Signals
from fcu_emulator.sensors.lsm6dsl.fifo import Fifo
from fcu_emulator.sensors.lsm6dsl.timestamp import Timestamp
from fcu_emulator.sensors.pin import Pin
from fcu_emulator.sensors.register_file import RegisterFile
from fcu_emulator.sensors.sampling import Producer, SampleStream, Times
from tests.support.sensor_fakes import PS_PER_S, ramp
from tests.support.sensor_fakes import Chip as WholePart

RATES_HZ = (0, 12.5, 26, 52, 104, 208, 416, 833, 1666, 3332, 6664)  # ODR_XL, ODR_G, ODR_FIFO (datasheet T52)
FLAGS: tuple[SignalName, ...] = ("FTH", "FULL_FLAG", "FIFO_OVR")
XL, G, TEMPERATURE = 1, 2, 3  # marks the samples of each
FIFO_CTRL1, FIFO_CTRL2, FIFO_CTRL3, FIFO_CTRL4, FIFO_CTRL5 = 0x06, 0x07, 0x08, 0x09, 0x0A
INT1_CTRL, CTRL1_XL, CTRL2_G, CTRL3_C, CTRL4_C, MD2_CFG = 0x0D, 0x10, 0x11, 0x12, 0x13, 0x5F
FIFO_STATUS1, FIFO_DATA_OUT = 0x3A, 0x3E
STOP_ON_FTH, ONLY_HIGH_DATA = 0x80, 0x40
TIMER_PEDO_FIFO_EN, TIMER_PEDO_FIFO_DRDY, FIFO_TEMP_EN = 0x80, 0x40, 0x08
BYPASS, FIFO, CONTINUOUS_TO_FIFO, BYPASS_TO_CONTINUOUS, CONTINUOUS = 0, 1, 3, 4, 6
HZ_104, HZ_208 = 4, 5  # codes of ODR_XL, ODR_G and ODR_FIFO
WATERMARK, OVERRUN, FULL, EMPTY = 0x80, 0x40, 0x20, 0x10
XL_ONLY, G_ONLY, BOTH = 0x01, 0x08, 0x09  # DEC_FIFO_*: 1, every sample
PERIOD_PS = -(-PS_PER_S // 104)


def sample_word(mark: int, t_s: float, axis: int) -> int:
    """Return the word of a sample taken at ``t_s``; all words within a second are different."""
    return round(t_s * 44101 + 0.1234 + 9000 * mark + 1000 * axis) & 0xFFFF


def _producer(mark: int, axes: int) -> Producer:
    def produce(number: int, t_s: Times) -> bytes:
        words = [sample_word(mark, t, axis) for t in t_s.tolist() for axis in range(axes)]
        return np.array(words, dtype="<u2").tobytes()

    return produce


class Bench:
    """Registers, streams and signals around a FIFO at the time ``t_ps``.

    ``heard``: (signal, level, time) of the FIFO's three flags; ``notes``: the texts.
    """

    def __init__(self) -> None:
        self.t_ps = 0
        self.heard: list[tuple[SignalName, bool, int]] = []
        self.notes: list[str] = []
        self.registers = RegisterFile(LSM6DSL.MAP, {0x3F: 0x3E})
        self.registers.note = lambda now_ps, what, problem, text, **_: self.notes.append(text)
        self.xl, self.g = SampleStream(6, _producer(XL, 3)), SampleStream(6, _producer(G, 3))
        self.temperature = SampleStream(2, _producer(TEMPERATURE, 1))
        self.signals = Signals()
        chip = FeatureContext(
            self.registers,
            {},
            self.xl,
            self.g,
            self.temperature,
            self.signals,
            Pin("INT1"),
            Pin("INT2"),
            self.catch_up,
        )
        self.timestamp = Timestamp(chip)
        self.fifo = Fifo(chip, self.timestamp)
        for name in FLAGS:
            self.signals.listen(name, partial(self._hear, name))
        self.write(CTRL3_C, 0x44)

    def _hear(self, name: SignalName, on: bool, at_ps: int) -> None:
        self.heard.append((name, on, at_ps))

    def catch_up(self, now_ps: int) -> None:
        """Catch up as the sensor does: call the active features in their order."""
        for feature in (self.timestamp, self.fifo):
            if feature.active:
                feature.catch_up(now_ps)

    def write(self, address: int, *values: int) -> None:
        """Write bytes to ``address`` and the following registers; streams follow CTRL1_XL and CTRL2_G."""
        for offset, value in enumerate(values):
            self.registers.write(address + offset, bytes((value,)), self.t_ps)
            self.catch_up(self.t_ps)
            if address + offset in {CTRL1_XL, CTRL2_G}:
                self._follow_rates()
            for feature in (self.timestamp, self.fifo):
                feature.configure(self.t_ps)

    def read(self, address: int, count: int = 1) -> bytes:
        """Read registers in a burst."""
        return self.registers.read(address, count, self.t_ps)

    def words(self, count: int) -> list[int]:
        """Read words from the FIFO."""
        data = self.read(0x3E, 2 * count) if count else b""
        return [int.from_bytes(data[at : at + 2], "little") for at in range(0, len(data), 2)]

    def fill(self) -> int:
        """Return DIFF_FIFO, the number of unread words."""
        status = self.read(0x3A, 2)
        return status[0] | (status[1] & 0x07) << 8

    def wait(self, ps: int) -> None:
        """Let time pass."""
        self.t_ps += ps

    def pulse(self, name: SignalName) -> None:
        """Raise an event of another function now."""
        self.signals.set(name, True, self.t_ps)
        self.signals.set(name, False, self.t_ps)

    def _follow_rates(self) -> None:
        mem = self.registers.mem
        rates = RATES_HZ[mem[CTRL1_XL] >> 4], RATES_HZ[mem[CTRL2_G] >> 4]
        for stream, rate in zip((self.xl, self.g, self.temperature), (*rates, 52 * any(rates)), strict=True):
            if self.t_ps >= stream.next_ps:
                stream.advance(self.t_ps)
            if Fraction(rate) != stream.rate_hz:
                if rate:
                    stream.start(self.t_ps, Fraction(rate))
                else:
                    stream.stop()


def sample_ps(start_ps: int, rate_hz: float, number: int) -> int:
    """Return the time of sample ``number`` (1, 2 ...) of a sensor started at ``start_ps``, which is never early."""
    halves = int(2 * rate_hz)  # 12.5 Hz is the only rate that is not whole
    return start_ps - (-2 * PS_PER_S // halves) - (-2 * PS_PER_S * (number - 1) // halves)


def fifo_of(
    mode: int, sets: int = XL_ONLY, ctrl4: int = 0, watermark: int = 0, odr: int = HZ_104
) -> WholePart:
    """Return a sensor whose accelerometer runs at 104 Hz in a world where all samples are different."""
    chip = WholePart("LSM6DSL")
    chip.world.signals["acceleration_g"] = ramp((0.0, 0.0, 0.0), (0.01, 0.02, -0.03))
    chip.configure(
        (
            (CTRL3_C, 0x44),
            (CTRL1_XL, HZ_104 << 4),
            (FIFO_CTRL1, watermark),
            (FIFO_CTRL3, sets),
            (FIFO_CTRL4, ctrl4),
            (FIFO_CTRL5, odr << 3 | mode),
        )
    )
    return chip


def samples(chip: WholePart, count: int) -> None:
    """Wait for ``count`` samples at 104 Hz, at most a few ps longer."""
    chip.t_ps += count * PERIOD_PS


def status(chip: WholePart) -> tuple[int, int, int]:
    """Return unread words, flags, and the place in the pattern."""
    data = chip.read(FIFO_STATUS1, 4)
    return data[0] | (data[1] & 0x07) << 8, data[1] & 0xF8, data[2] | data[3] << 8


def bench_of(
    mode: int, *, xl: int = HZ_104, g: int = 0, dec: tuple[int, ...] = (0, 1, 0, 0), ctrl2: int = 0
) -> Bench:
    """Return a bench with simulated sensors; ``dec``: DEC_* codes in the order of the sets."""
    bench = Bench()
    bench.write(CTRL1_XL, xl << 4, g << 4)
    bench.write(FIFO_CTRL2, ctrl2, dec[0] << 3 | dec[1], dec[3] << 3 | dec[2])
    bench.write(FIFO_CTRL5, 10 << 3 | mode)
    return bench
