"""Contents of the LSM6DSL's FIFO and times of storage (AN5040 8; datasheet 5.5, 9.4 to 9.8).

Decisions where the documents are silent or disagree: reserved modes (2, 5, 7) act as bypass, reserved rates as off; a
watermark of 0 is never reached; the faster sensor limits the FIFO rate (figure 32, not 5.5); ONLY_HIGH_DATA does not
remove the second data set.

Samples of the faster sensor trigger storage; at equal rates, samples of the gyroscope do. ODR_FIFO selects every 2nd,
4th ... sample. DRDY_MASK replaces words of samples to be discarded by 7FFF.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum, IntEnum
from fractions import Fraction
from math import lcm, log2
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from fcu_emulator.sensors.lsm6dsl.accelerometer import ODR_HZ
from fcu_emulator.sensors.lsm6dsl.feature import FeatureContext, Gates, SignalName
from fcu_emulator.sensors.lsm6dsl.registers import (
    CTRL1_XL,
    CTRL2_G,
    CTRL3_C,
    CTRL4_C,
    FIFO_CTRL1,
    FIFO_CTRL2,
    FIFO_CTRL3,
    FIFO_CTRL4,
    FIFO_CTRL5,
    INT1_CTRL,
    INT2_CTRL,
    MASTER_CONFIG,
    MD2_CFG,
    SENSORHUB,
    STEP_COUNTER,
)
from fcu_emulator.sensors.lsm6dsl.timestamp import Timestamp
from fcu_emulator.sensors.register import Register
from fcu_emulator.sensors.register_file import NEVER_PS
from fcu_emulator.sensors.sampling import SampleStream

# -- settings -----------------------------------------------------------------------------------------------

CONFIGURATION: tuple[type[Register], ...] = (
    CTRL1_XL,
    CTRL2_G,
    CTRL3_C,
    FIFO_CTRL1,
    FIFO_CTRL2,
    FIFO_CTRL3,
    FIFO_CTRL4,
    FIFO_CTRL5,
    INT1_CTRL,
    INT2_CTRL,
    MASTER_CONFIG,
    MD2_CFG,
)
"""Registers that configure the FIFO."""

_DECIMATION = (0, 1, 2, 3, 4, 8, 16, 32)  # the factor of each DEC_* code; 0: the set is not in the FIFO
SET_WORDS = 3
WORDS = 2048  # words of memory (4 kB in section 5.5 of the datasheet; its section 5.5.2 says 4096 words)

_INT1_FLAGS = INT1_CTRL.INT1_FULL_FLAG.mask | INT1_CTRL.INT1_FIFO_OVR.mask | INT1_CTRL.INT1_FTH.mask
_INT2_FLAGS = INT2_CTRL.INT2_FULL_FLAG.mask | INT2_CTRL.INT2_FIFO_OVR.mask | INT2_CTRL.INT2_FTH.mask

# Signals that switch a triggered mode if routed by this bit (AN5040 8).
_TRIGGERS: tuple[tuple[SignalName, int, int], ...] = (
    ("SIGN_MOT", INT1_CTRL.addr, INT1_CTRL.INT1_SIGN_MOT.mask),
    ("STEP_DETECTOR", INT1_CTRL.addr, INT1_CTRL.INT1_STEP_DETECTOR.mask),
    ("TILT", MD2_CFG.addr, MD2_CFG.INT2_TILT.mask),
    ("SINGLE_TAP", MD2_CFG.addr, MD2_CFG.INT2_SINGLE_TAP.mask),
    ("DOUBLE_TAP", MD2_CFG.addr, MD2_CFG.INT2_DOUBLE_TAP.mask),
    ("FF", MD2_CFG.addr, MD2_CFG.INT2_FF.mask),
    ("WU", MD2_CFG.addr, MD2_CFG.INT2_WU.mask),
    ("6D", MD2_CFG.addr, MD2_CFG.INT2_6D.mask),
)
TRIGGERS: tuple[SignalName, ...] = tuple(name for name, _, _ in _TRIGGERS)


class FifoMode(IntEnum):
    """Operating mode from FIFO_CTRL5.FIFO_MODE."""

    BYPASS = 0
    FIFO = 1
    CONTINUOUS_TO_FIFO = 3
    BYPASS_TO_CONTINUOUS = 4
    CONTINUOUS = 6


class Writer(Enum):
    """Signal that makes the FIFO store data sets."""

    DATA_READY = "of the faster sensor"
    STEP = "STEP_DETECTOR"
    HUB = "SENSORHUB"


class Fourth(Enum):
    """Contents of the fourth data set."""

    HUB = 0
    TIMESTAMP = 1
    TEMPERATURE = 2


class FifoPattern:
    """Data sets stored at each trigger: set ``s`` at every ``decimations[s]``-th trigger.

    ``period``: triggers until the pattern repeats; ``length``: words per period; ``widest``: most words per trigger.
    """

    def __init__(self, decimations: tuple[int, ...]) -> None:
        self.period = lcm(*(every for every in decimations if every))
        self._sets = [
            tuple(number for number, every in enumerate(decimations) if every and trigger % every == 0)
            for trigger in range(self.period)
        ]
        self.length = SET_WORDS * sum(len(sets) for sets in self._sets)
        self.widest = SET_WORDS * len(self._sets[0])

    def sets(self, trigger: int) -> tuple[int, ...]:
        return self._sets[trigger % self.period]

    def words(self, trigger: int) -> int:
        return SET_WORDS * len(self.sets(trigger))


@dataclass(frozen=True)
class Layout:
    """Stored data sets and their triggers; firmware must switch to bypass to change them.

    ``odr_fifo``: code in FIFO_CTRL5; ``odr_sensors``: codes in the sensors' registers.
    """

    decimations: tuple[int, ...]
    fourth: Fourth
    only_high: bool
    writer: Writer
    odr_fifo: int
    odr_sensors: tuple[int, int]


@dataclass(frozen=True)
class FifoSettings:
    """The FIFO's configuration; ``triggers``: signals that switch a triggered mode on or off."""

    mode: FifoMode
    layout: Layout
    watermark: int
    depth: int
    triggers: frozenset[SignalName]
    on_pin: bool

    @classmethod
    def decode(cls, mem: bytearray) -> FifoSettings:
        mode = FIFO_CTRL5.FIFO_MODE.get(mem[FIFO_CTRL5.addr])
        watermark = mem[FIFO_CTRL1.addr] | FIFO_CTRL2.FTH_10_8.get(mem[FIFO_CTRL2.addr]) << 8
        limited = bool(mem[FIFO_CTRL4.addr] & FIFO_CTRL4.STOP_ON_FTH.mask) and watermark > 0
        return cls(
            mode=FifoMode(mode) if mode in set(FifoMode) else FifoMode.BYPASS,
            layout=_layout(mem),
            watermark=watermark,
            depth=watermark if limited else WORDS,
            triggers=frozenset(name for name, address, mask in _TRIGGERS if mem[address] & mask),
            on_pin=bool(mem[INT1_CTRL.addr] & _INT1_FLAGS or mem[INT2_CTRL.addr] & _INT2_FLAGS),
        )


def violations(mem: bytearray) -> dict[tuple[str, str], bool]:
    """Return all kinds of invalid settings. The value is True if the registers have this setting."""
    ctrl2, ctrl4, ctrl5 = mem[FIFO_CTRL2.addr], mem[FIFO_CTRL4.addr], mem[FIFO_CTRL5.addr]
    mode = FIFO_CTRL5.FIFO_MODE.get(ctrl5)
    on = mode != FifoMode.BYPASS
    decimations = _decimations(mem)
    both = FIFO_CTRL2.TIMER_PEDO_FIFO_EN.mask | FIFO_CTRL2.FIFO_TEMP_EN.mask
    bus = CTRL3_C.BDU.mask | CTRL3_C.IF_INC.mask
    unlimited = not mem[FIFO_CTRL1.addr] and not ctrl2 & FIFO_CTRL2.FTH_10_8.mask
    mixed = not decimations[0] or bool(decimations[1])
    return {
        ("reserved-fifo-mode", f"FIFO_CTRL5.FIFO_MODE = {mode} is reserved"): mode not in set(FifoMode),
        ("reserved-fifo-rate", "FIFO_CTRL5.ODR_FIFO above 10"): FIFO_CTRL5.ODR_FIFO.get(ctrl5) >= len(ODR_HZ),
        ("fifo-temperature", "FIFO_CTRL2.FIFO_TEMP_EN needs TIMER_PEDO_FIFO_EN = 0"): on
        and ctrl2 & both == both,
        (
            "fifo-high-data",
            "FIFO_CTRL4.ONLY_HIGH_DATA needs the gyroscope in the FIFO, without the accelerometer",
        ): on and bool(ctrl4 & FIFO_CTRL4.ONLY_HIGH_DATA.mask) and mixed,
        ("fifo-watermark", "FIFO_CTRL4.STOP_ON_FTH needs a watermark"): on
        and bool(ctrl4 & FIFO_CTRL4.STOP_ON_FTH.mask)
        and unlimited,
        ("fifo-without-bdu", "FIFO used without CTRL3_C.BDU and IF_INC"): on
        and mem[CTRL3_C.addr] & bus != bus,
    }


def _decimations(mem: bytearray) -> tuple[int, ...]:
    ctrl3, ctrl4 = mem[FIFO_CTRL3.addr], mem[FIFO_CTRL4.addr]
    return (
        _DECIMATION[FIFO_CTRL3.DEC_FIFO_GYRO.get(ctrl3)],
        _DECIMATION[FIFO_CTRL3.DEC_FIFO_XL.get(ctrl3)],
        _DECIMATION[FIFO_CTRL4.DEC_DS3_FIFO.get(ctrl4)],
        _DECIMATION[FIFO_CTRL4.DEC_DS4_FIFO.get(ctrl4)],
    )


def _layout(mem: bytearray) -> Layout:
    odr_fifo = FIFO_CTRL5.ODR_FIFO.get(mem[FIFO_CTRL5.addr])
    return Layout(
        decimations=_decimations(mem),
        fourth=_fourth(mem[FIFO_CTRL2.addr]),
        only_high=bool(mem[FIFO_CTRL4.addr] & FIFO_CTRL4.ONLY_HIGH_DATA.mask),
        writer=_writer(mem),
        odr_fifo=odr_fifo if odr_fifo < len(ODR_HZ) else 0,
        odr_sensors=(CTRL1_XL.ODR_XL.get(mem[CTRL1_XL.addr]), CTRL2_G.ODR_G.get(mem[CTRL2_G.addr])),
    )


def _fourth(ctrl2: int) -> Fourth:
    if ctrl2 & FIFO_CTRL2.TIMER_PEDO_FIFO_EN.mask:
        return Fourth.TIMESTAMP
    return Fourth.TEMPERATURE if ctrl2 & FIFO_CTRL2.FIFO_TEMP_EN.mask else Fourth.HUB


def _writer(mem: bytearray) -> Writer:
    if mem[MASTER_CONFIG.addr] & MASTER_CONFIG.DATA_VALID_SEL_FIFO.mask:
        return Writer.HUB
    steps = mem[FIFO_CTRL2.addr] & FIFO_CTRL2.TIMER_PEDO_FIFO_DRDY.mask
    return Writer.STEP if steps else Writer.DATA_READY


# -- data sets: their three words at a trigger --------------------------------------------------------------

Rows: TypeAlias = list[list[int]]
"""Three words for each trigger."""

Contents: TypeAlias = Callable[[list[int]], Rows]
"""``contents(times_ps)``: returns a data set's words at ascending times."""

_SET_BYTES = 6
_UNSETTLED = np.frombuffer(b"\xff\x7f" * 3, dtype=np.uint8)


class LatestSample:
    """The latest sample of a stream at any time after a call of ``mark``."""

    def __init__(self, stream: SampleStream, gates: Gates) -> None:
        self._sensor, self._gates = stream, gates
        self.mark(masked=False)

    def mark(self, *, masked: bool) -> None:
        self._stream = self._gates.shown(self._sensor)
        self._running, self._masked = self._stream.running, masked
        self._index, self._data = self._stream.index, self._stream.data

    def at(self, times_ps: list[int]) -> NDArray[np.uint8]:
        """Return the register bytes at each time, shape (n, width)."""
        rows = np.tile(np.frombuffer(self._data, dtype=np.uint8), (len(times_ps), 1))
        if self._running:
            latest = np.array([self._stream.latest(t_ps) for t_ps in times_ps])
            fresh = latest > self._index
            if fresh.any():
                first = int(latest[fresh][0])
                samples = self._stream.samples(first, int(latest[-1]) + 1)
                rows[fresh] = samples[latest[fresh] - first]
            if self._masked:
                rows[fresh & (latest < self._stream.settled_index)] = _UNSETTLED
        return rows


class DataSets:
    """Reader that takes the data sets from streams, registers and timestamp."""

    def __init__(self, chip: FeatureContext, timestamp: Timestamp) -> None:
        self._mem = chip.registers.mem
        self._timestamp = timestamp
        self._xl, self._g = LatestSample(chip.xl, chip.gates), LatestSample(chip.g, chip.gates)
        self._temperature = LatestSample(chip.temperature, chip.gates)

    def mark(self) -> None:
        masked = bool(self._mem[CTRL4_C.addr] & CTRL4_C.DRDY_MASK.mask)
        for samples in (self._xl, self._g):
            samples.mark(masked=masked)
        self._temperature.mark(masked=False)

    def contents(self, layout: Layout) -> tuple[Contents, ...]:
        fourth = {
            Fourth.HUB: lambda times_ps: self._hub(1, times_ps),
            Fourth.TIMESTAMP: self._timestamps,
            Fourth.TEMPERATURE: self._temperatures,
        }[layout.fourth]
        first = self._high_bytes if layout.only_high else self._angular_rate
        return first, self._acceleration, lambda times_ps: self._hub(0, times_ps), fourth

    def _angular_rate(self, times_ps: list[int]) -> Rows:
        return _words(self._g.at(times_ps))

    def _acceleration(self, times_ps: list[int]) -> Rows:
        return _words(self._xl.at(times_ps))

    def _high_bytes(self, times_ps: list[int]) -> Rows:
        """Return AXh GXh AYh GYh AZh GZh."""
        mixed = np.empty((len(times_ps), _SET_BYTES), dtype=np.uint8)
        mixed[:, 0::2] = self._xl.at(times_ps)[:, 1::2]
        mixed[:, 1::2] = self._g.at(times_ps)[:, 1::2]
        return _words(mixed)

    def _hub(self, number: int, times_ps: list[int]) -> Rows:
        """Return SENSORHUB1 to 6 or 7 to 12."""
        first = SENSORHUB.addr + number * _SET_BYTES
        data = np.frombuffer(bytes(self._mem[first : first + _SET_BYTES]), dtype=np.uint8)
        return _words(np.tile(data, (len(times_ps), 1)))

    def _timestamps(self, times_ps: list[int]) -> Rows:
        """Return TS[15:8], TS[23:16], unused, TS[7:0], steps[7:0], steps[15:8] (AN5040 Table 73)."""
        steps = int.from_bytes(self._mem[STEP_COUNTER.addr : STEP_COUNTER.addr + 2], "little")
        values = [self._timestamp.value(t_ps) for t_ps in times_ps]
        return [[value >> 8, (value & 0xFF) << 8, steps] for value in values]

    def _temperatures(self, times_ps: list[int]) -> Rows:
        """Return unused, unused, T[7:0], T[15:8], unused, unused."""
        return [[0, word, 0] for (word,) in _words(self._temperature.at(times_ps))]


def _words(rows: NDArray[np.uint8]) -> Rows:
    words: Rows = np.ascontiguousarray(rows).view("<u2").tolist()
    return words


# -- triggers: which samples make the FIFO store data sets --------------------------------------------------


class SampleTriggers:
    """Counter of the samples that make the FIFO store data sets."""

    def __init__(self, chip: FeatureContext) -> None:
        self._chip = chip
        self._leader = chip.xl  # samples that data enable (DEN) lets pass
        self._every = 0  # samples per trigger; 0: no triggers
        self._next = 0  # the next sample with a trigger

    def follow(self, rate_code: int, now_ps: int, *, restart: bool) -> None:
        """Apply new rates; without ``restart``, continue in phase if possible."""
        xl, g = self._chip.xl, self._chip.g
        leader = g if g.rate_hz >= xl.rate_hz else xl
        self._leader = self._chip.gates.shown(leader)
        self._every = _samples_per_trigger(leader.rate_hz, rate_code)
        if self._leader is not leader:  # data enable lets single samples pass, and each of them triggers
            self._every = min(self._every, 1) if self._leader.running else 0
        latest = self._leader.latest(now_ps)
        if (
            restart or not latest < self._next <= latest + self._every
        ):  # the second condition: the stream has restarted
            self._next = latest + 1

    def begin(self, at_ps: int) -> None:
        self._next = self._leader.latest(at_ps - 1) + 1

    def due(self, until_ps: int) -> int:
        if not self._every:
            return 0
        return max(0, (self._leader.latest(until_ps) - self._next) // self._every + 1)

    def take(self, count: int) -> list[int]:
        first, self._next = self._next, self._next + count * self._every
        return [self._leader.time_ps(sample) for sample in range(first, self._next, self._every)]

    def skip(self, count: int) -> None:
        self._next += count * self._every

    def time_ps(self, number: int) -> int:
        """Return the time of trigger ``number`` after the next trigger, or ``NEVER_PS``."""
        if not self._every:
            return NEVER_PS
        return self._leader.time_ps(self._next + number * self._every)


def _samples_per_trigger(sensor_hz: Fraction, rate_code: int) -> int:
    if not sensor_hz or not rate_code:
        return 0
    return 1 << max(0, round(log2(sensor_hz / Fraction(ODR_HZ[rate_code]))))
