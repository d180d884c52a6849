"""Compare the changes of MAG with the changes of the true field.

Raw and calibrated values differ by a constant, so the values themselves are not compared.

Decision: if the board has not been turned far enough, no hint about MAG is given, because
the calibration still changes.
"""

from __future__ import annotations

from collections.abc import Sequence
from statistics import median
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fcu_emulator.emulator.analysis.numbers import AXES, Group, Hint, axes_in_words, signed_axes
from fcu_emulator.emulator.analysis.recorder import LabLine

MAG = Group("MAG[x,y,z]", tuple(f"MAG.{axis}" for axis in AXES), 50.0, "mgauss", 1.5)
_FEWEST = 5  # minimum number of lines
_SHARE = 0.9  # share of the lines that must fit
_TURNED = 400.0  # mgauss by which two axes must change: a large part of a turn
_SLACK = 60.0  # mgauss by which later values may exceed the extremes of the run's first half
_RIGHT_FACTOR = 1.15
# if firmware exchanges the bytes, the printed low byte is the true high byte; with the earth's field and
# hard iron, its range is at most 6 steps of 384 mgauss
_HIGH_BYTES = 6

Numbers = NDArray[np.float64]


class _Rows(NamedTuple):
    """Printed ``values``, and the truth's ``low`` and ``high``, each (N, 3)."""

    seen: Sequence[LabLine]
    values: Numbers
    low: Numbers
    high: Numbers

    @property
    def middle(self) -> Numbers:
        return (self.low + self.high) / 2

    def residual(self, mapped_low: Numbers, mapped_high: Numbers, values: Numbers | None = None) -> float:
        """Return the error in mgauss that only a few rows exceed. Ignore a constant error of each axis."""
        printed = self.values if values is None else values
        offset = np.median(printed - (mapped_low + mapped_high) / 2, axis=0)
        moved = printed - offset
        off = np.maximum(np.maximum(mapped_low - moved, moved - mapped_high), 0.0).max(axis=1)
        return float(np.quantile(off, _SHARE))


def field_hint(lines: Sequence[LabLine]) -> Hint | None:
    """Return the simple mistake that explains a wrong magnetic field, or None."""
    rows = _judgeable([line for line in lines if line.label == MAG.label and line.values is not None])
    if rows is None or rows.residual(rows.low, rows.high) <= MAG.far:
        return None
    return _of_axes(rows) or _of_factor(rows) or _of_bytes(rows)


def changes(lines: Sequence[LabLine]) -> tuple[Numbers, float, LabLine] | None:
    """Return MAG's constant error of each axis and the field's modulus (both in mgauss), and the last line that was used.

    Return None if the board was not turned far enough, or MAG's changes are wrong.
    """
    rows = _judgeable([line for line in lines if line.label == MAG.label and line.values is not None])
    if rows is None or rows.residual(rows.low, rows.high) > MAG.far:
        return None
    constant = np.median(rows.values - rows.middle, axis=0)
    return constant, float(np.median(np.linalg.norm(rows.middle, axis=1))), rows.seen[-1]


def _judgeable(seen: Sequence[LabLine]) -> _Rows | None:
    if len(seen) < 2 * _FEWEST:
        return None
    values = np.array([[line.values[name] for name in MAG.fields] for line in seen if line.values])
    low = np.array([[line.truth[name].low for name in MAG.fields] for line in seen])
    high = np.array([[line.truth[name].high for name in MAG.fields] for line in seen])
    half = len(seen) // 2
    inside = (low > low[:half].min(axis=0) - _SLACK) & (high < high[:half].max(axis=0) + _SLACK)
    kept = [n for n in range(half, len(seen)) if inside[n].all()]
    if len(kept) < _FEWEST:
        return None
    rows = _Rows([seen[n] for n in kept], values[kept], low[kept], high[kept])
    return rows if (np.ptp(rows.middle, axis=0) > _TURNED).sum() >= 2 else None


def _of_axes(rows: _Rows) -> Hint | None:
    for order, signs in signed_axes():
        ends = rows.low[:, order] * signs, rows.high[:, order] * signs
        if rows.residual(np.minimum(*ends), np.maximum(*ends)) <= MAG.far / 2:
            look = (
                "Each axis may be wrong by a constant, the board's hard iron.",
                "The board's axes are X right, Y forward, Z up: X = -raw.Y, Y = raw.X, Z = raw.Z of the sensors.",
            )
            return Hint(f"MAG has {axes_in_words(order, signs)}", look, rows.seen[-1])
    return None


def _of_factor(rows: _Rows) -> Hint | None:
    """Return a hint with one least-squares factor for all axes."""
    truth = rows.middle - rows.middle.mean(axis=0)
    printed = rows.values - rows.values.mean(axis=0)
    factor = float((truth * printed).sum() / (truth * truth).sum())
    if factor <= 0 or 1 / _RIGHT_FACTOR < factor < _RIGHT_FACTOR:
        return None
    if rows.residual(rows.low * factor, rows.high * factor) > MAG.far / 2 * max(factor, 0.5):
        return None
    look = (
        "Each axis may be wrong by a constant, the board's hard iron; the changes are wrong by this factor.",
        "Check the factor between the raw value and the unit: the LIS2MDL has 1.5 mgauss/LSB.",
    )
    return Hint(f"MAG changes {factor:.3g} times as much as the true field", look, rows.seen[-1], factor)


def _of_bytes(rows: _Rows) -> Hint | None:
    steps = rows.values / MAG.per_lsb
    if all(np.ptp(axis) > 1_000 and _few_low_bytes(axis) for axis in steps.T[:2]):
        look = (
            "Its values jump by multiples of 384 mgauss, which is 256 LSB of the sensor.",
            "The sensors send the low byte first: (int16_t)(bytes[0] | bytes[1] << 8).",
        )
        return Hint("MAG has the high byte of the true value as its low byte", look, rows.seen[-1])
    return None


def _few_low_bytes(steps: Numbers) -> bool:
    """Return whether the values are close together modulo 128.

    The modulus is half of 256, because the calibration subtracts half of a sum.
    """
    moved = steps - median(steps)
    return bool(min(np.ptp((moved + 64) % 128), np.ptp(moved % 128)) <= _HIGH_BYTES)
