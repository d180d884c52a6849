"""Detection of incomplete hard-iron calibration, from MAG's constant error and the board's iron."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from fcu_emulator.emulator.analysis.field import changes
from fcu_emulator.emulator.analysis.numbers import AXES, Hint
from fcu_emulator.emulator.analysis.recorder import LabLine

_FAR = 60.0  # mgauss: larger errors of an axis are reported; hard iron below this is ignored
_NEAR, _NEAR_SHARE = 40.0, 0.15

Numbers = NDArray[np.float64]


def calibration_hint(lines: Sequence[LabLine], iron_mgauss: Numbers) -> Hint | None:
    """Return a hint on the remaining calibration error, if a yaw is printed."""
    found = changes(lines)
    if found is None or not any(line.label == "Pitch:" and line.values for line in lines):
        return None
    constant, radius, line = found
    off = np.abs(constant) > _FAR
    if not off.any() or np.abs(iron_mgauss).max() < _FAR:
        return None
    summary, advice = _cause(constant, iron_mgauss, radius, off)
    shown = (
        f"The printed MAG is wrong by {_vector(constant)} mgauss; the board's hard iron is {_vector(iron_mgauss)}.",
    )
    return Hint(summary, (*shown, advice), line)


_SUBTRACT = (
    "mag.AXIS_X -= (mag_max.AXIS_X + mag_min.AXIS_X) / 2, likewise Y and Z, in the callback after each read."
)


def _cause(constant: Numbers, iron: Numbers, radius: float, off: NDArray[np.bool_]) -> tuple[str, str]:
    centre = iron - constant  # the value that the firmware subtracts
    magnetic = np.abs(iron) > _FAR
    names = " and ".join(axis for axis, wrong in zip(AXES, off, strict=True) if wrong)
    if _alike(constant[magnetic], iron[magnetic]):
        return (
            "MAG still contains the board's hard iron on each axis",
            f"Likely the calibration is missing: {_SUBTRACT}",
        )
    if _alike(constant[off], iron[off]):
        return (
            f"MAG still contains the board's hard iron on {names}",
            f"Likely this axis is omitted, or another axis is used: {_SUBTRACT}",
        )
    if _alike(constant[magnetic], 2 * iron[magnetic]):
        return (
            "MAG contains the board's hard iron twice",
            f"Likely the hard iron is added instead of subtracted: {_SUBTRACT}",
        )
    outside = magnetic & (np.abs(iron) > radius)
    from_zero = (iron + np.sign(iron) * radius) / 2
    if outside.any() and _alike(centre[outside], from_zero[outside]):
        return (
            "MAG is wrong by a constant, as if a minimum or maximum began at 0",
            "Set mag_min to 10000 and mag_max to -10000 at the start, so that the first sample replaces both.",
        )
    if _alike(np.abs(centre), np.full(3, radius)):
        return (
            "MAG is wrong by half of its range",
            "Likely (max - min) / 2 is subtracted: the middle is (max + min) / 2.",
        )
    return (
        f"MAG is wrong by a constant on {names} after the board was turned",
        f"Subtract the middle of each axis: {_SUBTRACT}",
    )


def _alike(one: Numbers, other: Numbers) -> bool:
    return bool(len(one)) and bool((np.abs(one - other) <= _NEAR + _NEAR_SHARE * np.abs(other)).all())


def _vector(values: Numbers) -> str:
    return ", ".join(f"{axis} {value:.0f}" for axis, value in zip(AXES, values, strict=True))
