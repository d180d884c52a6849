"""An LSM6DSL that receives acceleration sample by sample, for tests of its event functions and pins.

At 416 Hz and below the default filters do not change samples, so the event functions get the given samples.
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from functools import partial
from typing import TypeAlias

import numpy as np

from tests.support.sensor_fakes import PS_PER_S, Array, Chip, Signal

CTRL1_XL, CTRL2_G, CTRL3_C, CTRL4_C, CTRL8_XL = 0x10, 0x11, 0x12, 0x13, 0x17
WAKE_UP_SRC, TAP_SRC, D6D_SRC = 0x1B, 0x1C, 0x1D
TAP_CFG, TAP_THS_6D, INT_DUR2, WAKE_UP_THS, WAKE_UP_DUR, FREE_FALL = 0x58, 0x59, 0x5A, 0x5B, 0x5C, 0x5D
DRDY_PULSE_CFG, INT1_CTRL, INT2_CTRL, MD1_CFG, MD2_CFG = 0x0B, 0x0D, 0x0E, 0x5E, 0x5F
ENABLE, LIR = 0x80, 0x01

RATE_HZ = 416  # CTRL1_XL.ODR_XL = 6
ON = 0x60
FULL_SCALES = ((0x00, 2), (0x08, 4), (0x0C, 8), (0x04, 16))  # FS_XL bits and g, datasheet Table 52

Sample: TypeAlias = tuple[float, float, float]
"""X, Y, Z in mg."""
Edge: TypeAlias = tuple[str, int, int]
"""Pin, time in ps, level."""

STILL: Sample = (0.0, 0.0, 0.0)


def played(samples_mg: Sequence[Sample], rate_hz: Fraction | int = RATE_HZ) -> Signal:
    """Return a signal with these samples in turn; the last sample stays. The first comes one period after time 0."""
    table = np.array(samples_mg) / 1000

    def signal(t_s: Array) -> Array:
        numbers = np.rint(t_s * float(rate_hz)).astype(int) - 1
        values: Array = table[np.clip(numbers, 0, len(table) - 1)]
        return values

    return signal


def sample_ps(number: int, rate_hz: Fraction | int = RATE_HZ, start_ps: int = 0) -> int:
    """Return the time of sample ``number`` (0, 1 ...) of an accelerometer that was switched on at ``start_ps``."""
    period = PS_PER_S / Fraction(rate_hz)
    first = -int(-period // 1)
    return start_ps + first - int(-number * period // 1)


class Bench(Chip):
    """A bench. ``edges``: the edges of the pins, up to the latest evaluation."""

    def __init__(self, samples_mg: Sequence[Sample], *writes: tuple[int, int], xl: int = ON) -> None:
        super().__init__("LSM6DSL")
        self.world.signals["acceleration_g"] = played(samples_mg)
        self.edges: list[Edge] = []
        for pin in self.part.pins():
            pin.observe(partial(self._edge, pin.name))
        self.configure((*writes, (CTRL1_XL, xl)))

    def _edge(self, name: str, at_ps: int, level: int) -> None:
        self.edges.append((name, at_ps, level))

    def at(self, number: int) -> Bench:
        """Go to the time of a sample."""
        self.t_ps = sample_ps(number)
        return self

    def look(self) -> list[Edge]:
        """Evaluate the sensor, and return the pins' edges until now."""
        self.part.catch_up(self.t_ps)
        return self.edges


def source_bits(register: int, samples_mg: Sequence[Sample], *writes: tuple[int, int]) -> list[int]:
    """Return a source register at the time of each sample, with interrupts enabled and not latched."""
    bench = Bench(samples_mg, *writes)
    bench.write(TAP_CFG, bench.byte(TAP_CFG) | ENABLE)
    return [bench.at(number).byte(register) for number in range(len(samples_mg))]
