"""The four data sets of the LSM6DSL's FIFO: what their three words hold at a trigger (AN5040 Rev 3, 8).

A trigger stores the latest sample of each set. Where a set's sensor is off, or has not measured yet, that is
what its output registers still hold. With DRDY_MASK the words of samples that are to be discarded are 7FFF;
the documents allow 7FFE and 7FFD as well and do not say which is when.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from sensors.lsm6dsl.den_gate import Gates
from sensors.lsm6dsl.feature import Chip
from sensors.lsm6dsl.fifo_settings import Fourth, Layout
from sensors.lsm6dsl.registers import CTRL4_C, SENSORHUB, STEP_COUNTER
from sensors.lsm6dsl.timestamp import Timestamp
from sensors.sampling import SampleStream

Rows: TypeAlias = list[list[int]]
"""Three words for each trigger."""

Contents: TypeAlias = Callable[[list[int]], Rows]
"""``contents(times_ps)``: a set's words at these triggers, which are in order."""

_SET_BYTES = 6
_UNSETTLED = np.frombuffer(b"\xff\x7f" * 3, dtype=np.uint8)


class LatestSample:
    """A stream's latest sample at any time since ``mark``, which goes with every change of configuration.

    The sample that was the latest then is kept: computed anew, it would follow the new configuration.
    """

    def __init__(self, stream: SampleStream, gates: Gates) -> None:
        self._sensor, self._gates = stream, gates
        self.mark(masked=False)

    def mark(self, *, masked: bool) -> None:
        """The configuration has changed; ``masked``: DRDY_MASK."""
        self._stream = self._gates.shown(self._sensor)
        self._running, self._masked = self._stream.running, masked
        self._index, self._data = self._stream.index, self._stream.data

    def at(self, times_ps: list[int]) -> NDArray[np.uint8]:
        """Register bytes at each time, shape (n, width)."""
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
    """Reads the sets out of streams, registers and timestamp."""

    def __init__(self, chip: Chip, timestamp: Timestamp) -> None:
        self._mem = chip.registers.mem
        self._timestamp = timestamp
        self._xl, self._g = LatestSample(chip.xl, chip.gates), LatestSample(chip.g, chip.gates)
        self._temperature = LatestSample(chip.temperature, chip.gates)

    def mark(self) -> None:
        """The configuration has changed."""
        masked = bool(self._mem[CTRL4_C.addr] & CTRL4_C.DRDY_MASK.mask)
        for samples in (self._xl, self._g):
            samples.mark(masked=masked)
        self._temperature.mark(masked=False)

    def contents(self, layout: Layout) -> tuple[Contents, ...]:
        """The four sets, in their order."""
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
        """AXh GXh AYh GYh AZh GZh."""
        mixed = np.empty((len(times_ps), _SET_BYTES), dtype=np.uint8)
        mixed[:, 0::2] = self._xl.at(times_ps)[:, 1::2]
        mixed[:, 1::2] = self._g.at(times_ps)[:, 1::2]
        return _words(mixed)

    def _hub(self, number: int, times_ps: list[int]) -> Rows:
        """SENSORHUB1 to 6 or 7 to 12; the hub lets the FIFO catch up before it changes them."""
        first = SENSORHUB.addr + number * _SET_BYTES
        data = np.frombuffer(bytes(self._mem[first : first + _SET_BYTES]), dtype=np.uint8)
        return _words(np.tile(data, (len(times_ps), 1)))

    def _timestamps(self, times_ps: list[int]) -> Rows:
        """TS[15:8], TS[23:16], unused, TS[7:0], steps[7:0], steps[15:8] (AN5040 Table 73).

        The pedometer lets the FIFO catch up before it counts.
        """
        steps = int.from_bytes(self._mem[STEP_COUNTER.addr : STEP_COUNTER.addr + 2], "little")
        values = [self._timestamp.value(t_ps) for t_ps in times_ps]
        return [[value >> 8, (value & 0xFF) << 8, steps] for value in values]

    def _temperatures(self, times_ps: list[int]) -> Rows:
        """Unused, unused, T[7:0], T[15:8], unused, unused."""
        return [[0, word, 0] for (word,) in _words(self._temperature.at(times_ps))]


def _words(rows: NDArray[np.uint8]) -> Rows:
    words: Rows = np.ascontiguousarray(rows).view("<u2").tolist()
    return words
