"""Wrong formulas that compute the printed angles and altitude from other numbers in the same block.

Decision: the candidates are a fixed list of whole formulas, as students write them, because a
search for formulas would also fit noise.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from statistics import median
from typing import NamedTuple, TypeAlias

from fcu_emulator.emulator.analysis.numbers import YAW, Hint, always_0
from fcu_emulator.emulator.analysis.recorder import LabLine

_FEWEST = 5  # minimum number of blocks
_SHARE = 0.85  # share of the blocks that a formula must explain
_DIFFERENT = 2  # minimum number of blocks that the correct formula does not explain
_BETTER = 3  # factor by which a wrong formula must be nearer to the output than the correct one
_NEAR_DEG = 4.0  # printing a block takes about 30 ms, and the board may turn meanwhile
_NEAR_SHARE, _NEAR_M = 0.04, 0.3
# tolerance for motion: this share of the truth's change in the last 0.15 s, at most 15
_MOVING_SHARE, _MOST_MOVING = 0.3, 15.0
_LONGEST_S = 0.5  # maximum time between the lines of a block
_LABELS = {"ACC[x,y,z]": "acc", "MAG[x,y,z]": "mag", "Pre:": "pre"}


Near: TypeAlias = Callable[[float, float], float]
"""Maximum distance of a printed value from a formula's value, as a function of the formula's value and the scale."""


class Block(NamedTuple):
    """A block's numbers and the line to explain."""

    line: LabLine
    acc: tuple[float, ...]
    mag: tuple[float, ...]
    pre: float
    raw_mag: tuple[float, ...] = ()
    """MAG as measured by the sensor, including the board's hard iron."""


class Formula(NamedTuple):
    """The correct or a mistaken formula."""

    of: Callable[[Block], float]
    summary: str
    advice: str
    scale: float = 1.0
    """Factor by which noise and offsets are larger than in the correct formula."""
    period_deg: float = 360.0
    """Period of the yaw. The yaw jumps by this angle."""


_NOTHING = (math.nan,) * 3


def blocks(lines: Sequence[LabLine], label: str, iron_mgauss: Sequence[float] = (0, 0, 0)) -> list[Block]:
    """Return each line of ``label`` with the preceding ACC, MAG and Pre."""
    found, latest = [], dict[str, LabLine]()
    for line in lines:
        if line.values is None:
            continue
        if line.label in _LABELS:
            latest[_LABELS[line.label]] = line
        elif line.label == label and all(math.isfinite(value) for value in line.values.values()):
            fresh = {
                name: tuple((one.values or {}).values())
                for name, one in latest.items()
                if line.at_s - one.at_s < _LONGEST_S
            }
            pre = fresh.get("pre", _NOTHING)[0]
            raw = _raw(latest["mag"], iron_mgauss) if "mag" in fresh else _NOTHING
            found.append(Block(line, fresh.get("acc", _NOTHING), fresh.get("mag", _NOTHING), pre, raw))
    return found


def _raw(mag: LabLine, iron_mgauss: Sequence[float]) -> tuple[float, ...]:
    return tuple(one.middle + iron for one, iron in zip(mag.truth.values(), iron_mgauss, strict=True))


def explained(
    field: str,
    rows: Sequence[Block],
    right: Formula,
    wrong: Sequence[Formula],
    near: Near,
) -> Hint | None:
    """Return the best wrong formula, unless the correct formula fits."""
    rows = [row for row in rows if math.isfinite(_value(right, row))]
    different = [row for row in rows if not _fits(field, right, row, near) and not _is_true(field, row, near)]
    if len(rows) < _FEWEST or len(different) < max(_DIFFERENT, (1 - _SHARE) * len(rows)):
        return None
    most = median(_apart(field, right, row) for row in different) / _BETTER
    fitting = []
    for formula in wrong:
        share = sum(_fits(field, formula, row, near) for row in rows) / len(rows)
        of_different = sum(_fits(field, formula, row, near) for row in different) / len(different)
        apart = median(_apart(field, formula, row) for row in different)
        if min(share, of_different) >= _SHARE and apart < most:
            fitting.append((apart, formula))
    if not fitting:
        return None
    _, best = min(fitting, key=lambda one: one[0])
    return Hint(best.summary, (best.advice,), different[-1].line)


def _value(formula: Formula, row: Block) -> float:
    try:
        return formula.of(row)
    except (ValueError, ZeroDivisionError, OverflowError):
        return math.nan


def _fits(field: str, formula: Formula, row: Block, near: Near) -> bool:
    truth = row.line.truth[field]
    moving = min(_MOVING_SHARE * (truth.high - truth.low), _MOST_MOVING)
    return _apart(field, formula, row) <= near(_value(formula, row), formula.scale) + moving


def _is_true(field: str, row: Block, near: Near) -> bool:
    truth, printed = row.line.truth[field], (row.line.values or {})[field]
    turns = (-360, 0, 360) if field == "Yaw" else (0,)
    return min(truth.distance(printed + turn) for turn in turns) <= near(truth.middle, 1.0)


def _apart(field: str, formula: Formula, row: Block) -> float:
    printed = (row.line.values or {})[field]
    apart = printed - _value(formula, row)
    if field == "Yaw" and abs(printed) <= 360:
        apart = (apart + formula.period_deg / 2) % formula.period_deg - formula.period_deg / 2
    return abs(apart)


def _degrees(value: float, scale: float) -> float:
    return _NEAR_DEG * scale + _NEAR_SHARE * abs(value)


def _metres(value: float, scale: float) -> float:
    return _NEAR_M * scale + _NEAR_SHARE * abs(value)


# -- pitch and roll -----------------------------------------------------------------------------------------

_PITCH = "pitch = atan2(-Gx, sqrt(Gy * Gy + Gz * Gz)) * 180 / pi"
_ROLL = "roll = atan2(Gy, sqrt(mu * Gx * Gx + Gz * Gz)) * 180 / pi"


def _tilt(field: str) -> tuple[Formula, list[Formula], str]:
    """Return the correct formula of pitch or roll, wrong formulas, and the correct formula's text."""
    own, other, sign, name = (0, 1, -1, "Gx") if field == "Pitch" else (1, 0, 1, "Gy")
    text = _PITCH if field == "Pitch" else _ROLL

    def up(row: Block) -> float:
        return sign * row.acc[own]

    def root(row: Block, first: int = other) -> float:
        return math.hypot(row.acc[first], row.acc[2])

    right = Formula(lambda row: _deg(math.atan2(up(row), root(row))), "", text)
    wrong = [
        Formula(
            lambda row: _deg(math.atan2(up(row), root(row) ** 2)),
            f"{field} fits the formula without sqrt(), or with a wrong root",
            f"Take the square root of the sum of the squares: {text}.",
        ),
        Formula(
            lambda row: _deg(math.atan2(up(row), root(row, own))),
            f"{field} fits a formula with {name} in the root",
            f"Put the other two axes in the root: {text}.",
        ),
        Formula(
            lambda row: _deg(math.atan2(up(row), math.hypot(row.acc[0], row.acc[1]))),
            f"{field} fits the formula with Gx and Gy in the root",
            f"Use Gz in the root: {text}.",
        ),
        Formula(
            lambda row: _deg(math.atan2(root(row), up(row))),
            f"{field} fits the formula with atan2's arguments exchanged",
            f"The numerator comes first in atan2(y, x): {text}.",
        ),
        Formula(
            lambda row: _deg(math.atan2(up(row), row.acc[other] + row.acc[2])),
            f"{field} fits the formula with a sum in place of the root of the sum of squares",
            text + ".",
        ),
        Formula(
            lambda row: _deg(up(row) / root(row)),
            f"{field} fits the formula without atan2()",
            text + ".",
        ),
        Formula(
            lambda row: _deg(_deg(math.atan2(up(row), root(row)))),
            f"{field} fits a formula that converts to degrees twice",
            "Convert once, after the sines and cosines of the yaw.",
        ),
    ]
    return right, wrong, text


def _deg(radians: float) -> float:
    return math.degrees(radians)


_NOT_CALLED = "Call eCompass() in the callback, and let it write the printed variables."


def tilt_hint(lines: Sequence[LabLine]) -> Hint | None:
    """Return the mistake in pitch or roll that explains the output."""
    rows = blocks(lines, "Pitch:")
    if len(rows) >= _FEWEST and not any(value for row in rows for value in (row.line.values or {}).values()):
        return Hint("Pitch, Roll and Yaw are always 0", (_NOT_CALLED,), rows[-1].line)
    for field in ("Pitch", "Roll"):
        right, wrong, _ = _tilt(field)
        found = explained(field, rows, right, wrong, _degrees)
        if found is not None:
            return found
    return None


# -- yaw ----------------------------------------------------------------------------------------------------

_LINES = (
    "By2 = Bz sin(roll) - By cos(roll), Bz2 = By sin(roll) + Bz cos(roll), "
    "Bx3 = Bx cos(pitch) + Bz2 sin(pitch)"
)


class _Angles(NamedTuple):
    pitch: float
    roll: float


def _angles(row: Block) -> _Angles:
    values = row.line.values or {}
    return _Angles(math.radians(values["Pitch"]), math.radians(values["Roll"]))


def _yaw(row: Block, angles: _Angles) -> tuple[float, float]:
    """Return By2 and Bx3 as the slides define them."""
    bx, by, bz = row.mag
    pitch, roll = angles
    by2 = bz * math.sin(roll) - by * math.cos(roll)
    bz2 = by * math.sin(roll) + bz * math.cos(roll)
    return by2, bx * math.cos(pitch) + bz2 * math.sin(pitch)


def _in_degrees(row: Block) -> _Angles:
    return _Angles(*map(math.degrees, _angles(row)))


RIGHT_YAW = Formula(lambda row: _deg(math.atan2(*_yaw(row, _angles(row)))), "", _LINES)
_WRONG_YAW = (
    Formula(
        lambda row: _deg(math.atan2(*_yaw(row, _in_degrees(row)))),
        "Yaw fits the formula with sin() and cos() of degrees",
        "sin() and cos() take radians: convert pitch and roll to degrees after the yaw is computed.",
    ),
    Formula(
        lambda row: _deg(math.atan2(-row.mag[1], row.mag[0])),
        "Yaw fits the formula without the tilt compensation",
        f"That formula is correct only while the board is level; use By2 and Bx3: {_LINES}.",
    ),
    Formula(
        lambda row: _deg(math.atan(_ratio(*_yaw(row, _angles(row))))),
        "Yaw fits the formula with atan() of a quotient, from -90 to 90 degrees",
        "Use atan2(By2, Bx3), which covers all four quadrants.",
        period_deg=180.0,
    ),
    Formula(
        lambda row: _deg(math.atan2(*reversed(_yaw(row, _angles(row))))),
        "Yaw fits the formula with atan2's arguments exchanged",
        "yaw = atan2(By2, Bx3): By2 comes first.",
    ),
    Formula(
        lambda row: -_deg(math.atan2(*_yaw(row, _angles(row)))),
        "Yaw is negated",
        f"Check the signs: {_LINES}.",
    ),
    Formula(
        lambda row: _deg(math.atan2(*_yaw(row, _Angles(_angles(row).roll, _angles(row).pitch)))),
        "Yaw fits the formula with pitch and roll exchanged",
        f"{_LINES}.",
    ),
    Formula(
        lambda row: _deg(math.atan2(*_yaw(row, _Angles(-_angles(row).pitch, _angles(row).roll)))),
        "Yaw fits the formula with the sign of pitch reversed",
        f"{_LINES}.",
    ),
    Formula(
        lambda row: _deg(math.atan2(*_yaw(row, _Angles(_angles(row).pitch, -_angles(row).roll)))),
        "Yaw fits the formula with the sign of roll reversed",
        f"{_LINES}.",
    ),
)
_NO_YAW = Formula(
    lambda _: 0.0, "Yaw is always 0", "Compute the yaw in eCompass(), and print the variable azimuth."
)
_STRONG_MGAUSS = 100.0
_YAW_IN_RADIANS = Formula(
    lambda row: math.atan2(*_yaw(row, _angles(row))),
    "Yaw is 57.3 times too small, as if in radians",
    "Likely the conversion is missing: azimuth = azimuth * 180 / pi.",
    math.pi / 180,
)


def _ratio(one: float, other: float) -> float:
    return one / other


_UNCALIBRATED = Formula(
    lambda row: _deg(math.atan2(*_yaw(row._replace(mag=row.raw_mag), _angles(row)))),
    "Yaw is computed from MAG before its calibration, with the board's hard iron",
    "In HAL_TIM_PeriodElapsedCallback(): ReadSensorRawData(), then MagCalibration(), then eCompass().",
)


def yaw_hint(lines: Sequence[LabLine], iron_mgauss: Sequence[float]) -> Hint | None:
    """Return the mistake in yaw that explains the output."""
    rows = [row for row in blocks(lines, "Pitch:", iron_mgauss) if any(row.mag)]
    if any(abs(one) > _STRONG_MGAUSS for one in iron_mgauss):
        found = explained("Yaw", rows, RIGHT_YAW, (_UNCALIBRATED,), _degrees)
        if found is not None:
            return found
    none = (_NO_YAW,) if always_0(lines, YAW) else ()
    return explained("Yaw", rows, RIGHT_YAW, (*_WRONG_YAW, _YAW_IN_RADIANS, *none), _degrees)


# -- altitude -----------------------------------------------------------------------------------------------

_EXPONENT, _KELVIN, _LAPSE = 1 / 5.257, 273.15, 0.0065
_ALTITUDE = "h = (pow(P0 / P, 1 / 5.257) - 1) * (T + 273.15) / 0.0065"
_SEA_HPA = 1013.25
_SAME_HPA = 0.005
_OFF_M = 0.8
_FEW_HEIGHTS = 3


def _height(ratio: float, kelvin: float, exponent: float = _EXPONENT) -> float:
    return (math.pow(ratio, exponent) - 1) * kelvin / _LAPSE


def altitude_hint(lines: Sequence[LabLine], temperature_degc: float) -> Hint | None:
    """Return the mistake in altitude that explains the output."""
    kelvin = temperature_degc + _KELVIN
    pressures = [line for line in lines if line.values and line.label == "Pre:"]
    at_floor = [line for line in pressures if line.truth["Pre"].distance(_first(pressures)) < _SAME_HPA]
    if not at_floor:
        return None
    floor_hpa = median(line.values["Pre"] for line in at_floor if line.values)

    def ratio(row: Block) -> float:
        return floor_hpa / row.pre

    right = Formula(lambda row: _height(ratio(row), kelvin), "", _ALTITUDE)
    rows = blocks(lines, "Altitude:")
    printed = {(row.line.values or {})["Altitude"] for row in rows}
    if len(printed) >= _FEW_HEIGHTS and all(one == round(one) for one in printed):
        advice = "An int loses the fraction of a number: declare float alt."
        return Hint("Altitude is truncated to whole metres", (advice,), rows[-1].line)
    truths = [(row.line.truth["Altitude"], (row.line.values or {})["Altitude"]) for row in rows]
    off = sum(truth.distance(value) > _OFF_M for truth, value in truths)
    if off < _DIFFERENT:
        # correct programs deviate too, because of noise and because they read the pressure at the floor
        # only once
        return None
    named = explained("Altitude", rows, right, list(_wrong_altitudes(ratio, kelvin)), _metres)
    return named or explained("Altitude", rows, right, list(_times(rows, right)), _metres)


def _first(pressures: Sequence[LabLine]) -> float:
    return pressures[0].truth["Pre"].middle


def _times(rows: Sequence[Block], right: Formula) -> Iterator[Formula]:
    high = [row for row in rows if abs(_value(right, row)) > _HIGH_M]
    if len(high) < _FEWEST:
        return
    factor = median((row.line.values or {})["Altitude"] / right.of(row) for row in high)
    if factor <= 0 or 1 / _PLAIN_FACTOR < factor < _PLAIN_FACTOR:
        return
    degc = (
        ", as if the temperature were in degC, or the constant 0.0065 were 0.065"
        if _OF_DEGC[0] < factor < _OF_DEGC[1]
        else ""
    )
    summary = f"Altitude is {factor:.2g} times the true value{degc}"
    yield Formula(
        lambda row: factor * right.of(row), summary, f"With h in metres and T in degC: {_ALTITUDE}.", factor
    )


_OF_DEGC = 0.03, 0.13  # range of T in degC divided by T in kelvin, for 8 to 40 degC
_HIGH_M, _PLAIN_FACTOR = 1.0, 1.15


def _wrong_altitudes(ratio: Callable[[Block], float], kelvin: float) -> Iterator[Formula]:
    yield Formula(
        lambda row: _height(ratio(row), kelvin, 5.257),
        "Altitude fits the formula with the exponent 5.257",
        f"The exponent is 1 / 5.257: {_ALTITUDE}.",
        _EXPONENT**-2,
    )
    yield Formula(
        lambda row: -_height(1 / ratio(row), kelvin),
        "Altitude fits the formula with the ratio inverted or the sign reversed",
        f"The floor's pressure is the numerator: {_ALTITUDE}.",
    )
    yield Formula(
        lambda row: _height(1 / ratio(row), kelvin),
        "Altitude is negated",
        f"The floor's pressure is the numerator: {_ALTITUDE}.",
    )
    yield Formula(
        lambda row: _height(_SEA_HPA / row.pre, kelvin),
        "Altitude is the height above sea level, as if P0 were 1013.25 hPa",
        f"0 m is the room's floor: P0 is press_zero_level, read at the start. {_ALTITUDE}.",
    )
    yield Formula(
        lambda row: 44330 * (1 - math.pow(row.pre / _SEA_HPA, 1 / 5.255)),
        "Altitude is the height above sea level, as if computed with 44330 m and 1013.25 hPa",
        f"0 m is the room's floor: P0 is press_zero_level, read at the start. {_ALTITUDE}.",
    )
    yield Formula(
        lambda row: _height(100 * ratio(row), kelvin),
        "Altitude fits the formula with one pressure in Pa and the other in hPa",
        "Both are in hPa: neither is multiplied by 100.",
    )
    yield Formula(
        lambda row: _height(ratio(row) / 100, kelvin),
        "Altitude fits the formula with one pressure in Pa and the other in hPa",
        "Both are in hPa: neither is multiplied by 100.",
    )
