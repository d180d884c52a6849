"""Wrong numbers and their simple causes: factor, sign, axes, radians, wrap.

Decision: printed numbers are compared with the world, not with the sensors' registers, because
students see the board's movement and not the sensors' registers.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterator, Sequence
from typing import NamedTuple, TypeAlias

from fcu_emulator.emulator.analysis.recorder import LabLine, ValueRange

_FEWEST = 2  # minimum number of wrong lines
_SHARE = 0.9  # minimum share of the lines that a mistake must explain
# factor of the distance from the truth for a wrap, because random numbers must not count as a wrap
_NARROW = 3
AXES = ("x", "y", "z")


class Hint(NamedTuple):
    """The mistake, advice, and the printed line."""

    summary: str
    sentences: tuple[str, ...]
    line: LabLine
    factor: float = 0.0
    """Ratio of the printed value to the truth, if a factor is the only mistake."""
    exchanged_with: Group | None = None
    """The other sensor, if the lines of two sensors show each other's numbers."""


Distance: TypeAlias = Callable[[Sequence[float], Sequence[ValueRange]], float]


class Change(NamedTuple):
    """A possible mistake. ``distance`` compares printed values with the values that this mistake makes of the truth."""

    distance: Distance
    summary: str
    sentences: tuple[str, ...]
    factor: float = 0.0


class Group(NamedTuple):
    """Fields that are checked together. Correct firmware deviates by less than ``far``."""

    label: str
    fields: tuple[str, ...]
    far: float
    unit: str
    per_lsb: float = 0.0


ACC = Group("ACC[x,y,z]", tuple(f"ACC.{axis}" for axis in AXES), 250.0, "mg", 0.122)
GYR = Group("GYR[x,y,z]", tuple(f"GYR.{axis}" for axis in AXES), 40_000.0, "mdps", 70.0)
TILT = Group("Pitch:", ("Pitch", "Roll"), 14.0, "deg")
YAW = Group("Pitch:", ("Yaw",), 25.0, "deg")
PRESSURE = Group("Pre:", ("Pre",), 20.0, "hPa")
ALTITUDE = Group("Altitude:", ("Altitude",), 1.5, "m")


def hint(lines: Sequence[LabLine], group: Group) -> Hint | None:
    """Return the simple mistake that explains a group's wrong numbers, or None."""
    rows = [_Row(seen, group) for seen in lines if seen.label == group.label and seen.values is not None]
    rows = [row for row in rows if all(map(math.isfinite, row.values))]
    if not rows or (group is YAW and not _turns(rows)):
        return None
    wrong = [row for row in rows if _plain(row.values, row.truth) > group.far]
    if len(wrong) < _FEWEST or len(wrong) < (1 - _SHARE) * len(rows):
        return None
    for change in _changes(group, rows):
        telling = [row for row in rows if _shows_factor(row, group)] if change.factor else rows
        fitting = sum(change.distance(row.values, row.truth) <= group.far / 2 for row in telling)
        if len(telling) >= _FEWEST and fitting >= _SHARE * len(telling):
            return Hint(change.summary, change.sentences, wrong[-1].seen, change.factor)
    return None


def is_far_off(lines: Sequence[LabLine], group: Group) -> bool:
    """Return whether several lines of a group are far from the truth or contain nan."""
    rows = [_Row(seen, group) for seen in lines if seen.label == group.label and seen.values is not None]
    return sum(not _plain(row.values, row.truth) <= group.far for row in rows) >= _FEWEST


def always_0(lines: Sequence[LabLine], group: Group) -> bool:
    """Return whether all the group's numbers are 0."""
    rows = [_Row(seen, group) for seen in lines if seen.label == group.label and seen.values is not None]
    return bool(rows) and all(value == 0 for row in rows for value in row.values)


def _shows_factor(row: _Row, group: Group) -> bool:
    return any(min(abs(one.low), abs(one.high)) > group.far and one.low * one.high > 0 for one in row.truth)


def shows_another(lines: Sequence[LabLine], group: Group, others: Sequence[Group]) -> Hint | None:
    """Return a hint if a vector shows another sensor's numbers, or if two vectors are exchanged."""
    for other in others:
        wrong = _rows_of_another(lines, group, other)
        if not wrong:
            continue
        name, what = group.label[:3], other.label[:3]
        if _rows_of_another(lines, other, group):
            sentences = (
                "The lab calls ReadSensorRawData(&acc, &gyro, &mag, &press).",
                f"If this call is correct, check the variables in the lines that print {name} and {what}.",
            )
            summary = f"the numbers of {name} and {what} are exchanged"
            return Hint(summary, sentences, wrong[-1].seen, exchanged_with=other)
        sentences = (
            f"Check whether the line of {name} prints the variable of {what}.",
            "Or the arguments of ReadSensorRawData(&acc, &gyro, &mag, &press) are exchanged.",
        )
        return Hint(f"{name} shows the numbers of {what}", sentences, wrong[-1].seen)
    return None


def _rows_of_another(lines: Sequence[LabLine], group: Group, other: Group) -> list[_Row]:
    """Return the wrong rows of a vector if nearly all rows fit the other sensor; otherwise []."""
    pairs = list(_pairs(lines, group, other))
    wrong = [one for one, _ in pairs if _plain(one.values, one.truth) > min(group.far, other.far)]
    fitting = sum(_plain(one.values, two.truth) <= other.far / 2 for one, two in pairs)
    is_other = len(pairs) >= _FEW_PAIRS and len(wrong) >= _FEWEST and fitting >= _SHARE * len(pairs)
    return wrong if is_other else []


_FEW_PAIRS = 4


def _pairs(lines: Sequence[LabLine], group: Group, other: Group) -> Iterator[tuple[_Row, _Row]]:
    """Yield pairs of rows, one of each group, printed within half a second."""
    rows = {
        one: [_Row(line, one) for line in lines if line.label == one.label and line.values is not None]
        for one in (group, other)
    }
    for row in rows[group]:
        near = [two for two in rows[other] if abs(two.seen.at_s - row.seen.at_s) < 0.5]
        if near:
            yield row, near[0]


class _Row:
    """The printed values of one group in a line, and the truth."""

    def __init__(self, seen: LabLine, group: Group) -> None:
        self.seen = seen
        values = seen.values or {}
        self.values = [values[name] for name in group.fields]
        self.truth = [seen.truth[name] for name in group.fields]


def _turns(rows: Sequence[_Row]) -> bool:
    angles = [row.truth[0].middle for row in rows]
    return max(angles) - min(angles) > 90


def _plain(values: Sequence[float], truth: Sequence[ValueRange]) -> float:
    return max(one.distance(value) for value, one in zip(values, truth, strict=True))


def _changes(group: Group, rows: Sequence[_Row]) -> Iterator[Change]:
    if group in (ACC, GYR):
        yield from _of_vector(group, rows)
    elif group is TILT:
        yield from _of_tilt()
    elif group is YAW:
        yield from _of_yaw()
    elif group is PRESSURE:
        yield from _of_pressure(rows)
    else:
        yield from _of_altitude(rows)


# -- vectors ------------------------------------------------------------------------------------------------


def _of_vector(group: Group, rows: Sequence[_Row]) -> Iterator[Change]:
    name = group.label[:3]
    sensor = "accelerometer" if group is ACC else "gyroscope"
    if all(value == 0 for row in rows for value in row.values):
        yield Change(
            lambda _values, _truth: 0.0,
            f"{name} is always 0",
            (
                f"The {sensor} measures other values: check that it is switched on and read.",
                "Check that the program writes the values to the variable that it prints."
                + (" Check divisions: in C 950 / 1000 is 0; ACC is in mg." if group is ACC else ""),
            ),
        )
        return
    if group is ACC and all(abs(value) <= _FEW_G for row in rows for value in row.values):
        yield Change(
            lambda values, truth: max(map(_from_whole_g, values, truth)),
            "ACC is truncated to whole g",
            ("In C 950 / 1000 is 0; ACC is in mg, as returned by ReadSensorRawData().",),
        )
    yield from _signed_axes(name)
    factor = _factor(rows, group.far)
    if factor is not None:
        yield Change(
            lambda values, truth: _plain(values, [one.scaled(factor) for one in truth]) / max(factor, 1.0),
            f"{name} is {factor:.3g} times the true value",
            ("Check the factor between the raw value and the unit.",),
            factor,
        )
    raw_wrap = 65_536 * group.per_lsb
    yield Change(
        lambda values, truth: max(
            min(one.distance(value), one.distance(value - raw_wrap))
            for value, one in zip(values, truth, strict=True)
        ),
        f"{name} is {raw_wrap:.0f} {group.unit} too large if the true value is negative",
        (
            "The sensor's values are signed 16 bits: (int16_t)(low | high << 8).",
            "As uint16_t, or as int without the cast, -1 becomes 65535.",
        ),
    )
    if group is GYR:
        yield Change(
            lambda values, truth: (
                _NARROW
                * max(
                    one.distance(value + 65_536 * round((one.middle - value) / 65_536))
                    for value, one in zip(values, truth, strict=True)
                )
            ),
            f"{name} is wrong by multiples of 65536: a value does not fit into 16 bits",
            (
                "An int16_t holds -32768 to 32767, and 33 dps are 33000 mdps.",
                "Use int32_t wherever the number is computed or stored; AxesRaw_TypeDef has int32_t.",
            ),
        )
    yield Change(
        lambda values, truth: max(
            _of_swapped(value, one, group) for value, one in zip(values, truth, strict=True)
        ),
        f"{name} has the high byte of the true value as its low byte",
        (
            "The sensors send the low byte first: (int16_t)(bytes[0] | bytes[1] << 8).",
            (
                "Or the address of the read bytes is wrong by one: an odd register, or a struct with "
                "padding before an int16_t."
            ),
        ),
    )


_FEW_G = 5


def _from_whole_g(value: float, truth: ValueRange) -> float:
    low, high = 1000 * value - 1000 * (value <= 0), 1000 * value + 1000 * (value >= 0)
    return max(low - truth.high, truth.low - high, 0.0)


Way = tuple[tuple[int, ...], tuple[int, ...]]
"""For each printed axis: the true axis, and its sign."""


def signed_axes() -> list[Way]:
    """Return all exchanges and negations of axes, the simplest first."""
    ways = [
        (order, signs)
        for order in itertools.permutations(range(3))
        for signs in itertools.product((1, -1), repeat=3)
    ]
    ways.sort(key=lambda way: sum(n != m for n, m in enumerate(way[0])) + way[1].count(-1))
    return list(ways[1:])


def axes_in_words(order: Sequence[int], signs: Sequence[int]) -> str:
    """Return text such as "x and y exchanged, y negated"."""
    exchanged = [AXES[n] for n in range(3) if order[n] != n]
    negated = [AXES[n] for n in range(3) if signs[n] < 0]
    what = [f"{' and '.join(exchanged)} exchanged"] if exchanged else []
    what += [f"{' and '.join(negated)} negated"] if negated else []
    return ", ".join(what)


def _signed_axes(name: str) -> Iterator[Change]:
    for order, signs in signed_axes():
        yield Change(
            _rearranged(order, signs),
            f"{name} has {axes_in_words(order, signs)}",
            (
                "The board's axes are X right, Y forward, Z up: X = -raw.Y, Y = raw.X, Z = raw.Z of the sensors.",
            ),
        )


def _rearranged(order: Sequence[int], signs: Sequence[int]) -> Distance:
    return lambda values, truth: max(
        truth[source].scaled(sign).distance(value)
        for value, source, sign in zip(values, order, signs, strict=True)
    )


def _scaled(factor: float) -> Distance:
    return lambda values, truth: _plain([value / factor for value in values], truth)


def _factor(rows: Sequence[_Row], far: float) -> float | None:
    """Return the median ratio of printed value to truth, or None if it is near 1 or negative."""
    ratios = sorted(
        value / one.middle
        for row in rows
        for value, one in zip(row.values, row.truth, strict=True)
        if abs(one.middle) > 2 * far
    )
    if not ratios:
        return None
    middle = ratios[len(ratios) // 2]
    return middle if middle > 0 and abs(math.log(middle)) > math.log(1.15) else None


def _swapped(raw: int) -> int:
    value = (raw & 0xFF) << 8 | raw >> 8 & 0xFF
    return value - 0x1_0000 if value & 0x8000 else value


def _around(value: float, group: Group) -> range:
    """Return the raw values that firmware may print as ``value``, with or without truncation."""
    slack = math.ceil(1 / group.per_lsb) if group.per_lsb < 1 else 0
    raw = round(value / group.per_lsb)
    return range(raw - slack, raw + slack + 1)


def _of_swapped(value: float, truth: ValueRange, group: Group) -> float:
    return min(truth.distance(_swapped(raw) * group.per_lsb) for raw in _around(value, group))


# -- angles -------------------------------------------------------------------------------------------------

_LOOK_TILT = "pitch = atan2(-Gx, sqrt(Gy^2 + Gz^2)), roll = atan2(Gy, sqrt(mu Gx^2 + Gz^2))."


def _of_tilt() -> Iterator[Change]:
    for pitch, roll, what in ((-1, 1, "Pitch is"), (1, -1, "Roll is"), (-1, -1, "Pitch and Roll are")):
        yield Change(
            _rearranged((0, 1), (pitch, roll)),
            f"{what} negated",
            (f"Check the signs: {_LOOK_TILT}", "Otherwise, axes of ACC may be negated."),
        )
    yield Change(
        lambda values, truth: _plain((values[1], values[0]), truth),
        "Pitch and Roll are exchanged",
        ("Check the order of PRINTF's arguments, and the axes in each formula.", _LOOK_TILT),
    )
    ways = (
        (math.pi / 180, "57.3 times too small, as if in radians"),
        (180 / math.pi, "57.3 times too large"),
    )
    for factor, what in ways:
        yield Change(
            _scaled(factor),
            f"Pitch and Roll are {what}",
            (
                "Likely the conversion is wrong: atan2 returns radians; multiply once by 180 / pi, after sin() and cos().",
            ),
            factor,
        )


def _of_yaw() -> Iterator[Change]:
    ways = (
        (-1, 0, "negated"),
        (1, 90, "90 degrees too large"),
        (1, -90, "90 degrees too small"),
        (1, 180, "turned by 180 degrees"),
        (-1, 90, "90 degrees minus the true yaw, likely because atan2's arguments are exchanged"),
    )
    for sign, offset, what in ways:
        yield Change(
            _turned(sign, offset),
            f"Yaw is {what}",
            ("yaw = atan2(By2, Bx3); By2 = Bz sin(roll) - By cos(roll). Check MAG, too.",),
        )


def _turned(sign: int, offset_deg: float) -> Distance:
    return lambda values, truth: abs((values[0] - sign * truth[0].middle - offset_deg + 180) % 360 - 180)


# -- pressure and altitude ----------------------------------------------------------------------------------


def _of_pressure(rows: Sequence[_Row]) -> Iterator[Change]:
    factor = _factor(rows, 20.0)
    if factor is not None:
        yield Change(
            _scaled(factor),
            f"Pre is {factor:.4g} times the true value",
            ("The raw value is 4096 for 1 hPa, and 1 hPa is 100 Pa.",),
        )


def _of_altitude(rows: Sequence[_Row]) -> Iterator[Change]:
    first = rows[0].values[0]
    if all(row.values[0] == 0 for row in rows):
        yield Change(
            lambda _values, _truth: 0.0,
            "Altitude is always 0",
            (
                "Likely an integer division: 1 / 5 is 0 in C, and pow(x, 0) is 1. Write 1 / 5.257.",
                "Or the pressure at the floor is read again for each altitude: read it once, at the start.",
            ),
        )
    elif first < -20_000:
        yield Change(
            lambda values, _truth: 0.0 if values[0] < -20_000 else math.inf,
            "Altitude fits the formula with a pressure of 0 at the floor",
            (
                "Likely the pressure at the floor is 0: the LPS22HB was read before its first sample.",
                "Wait for P_DA in its STATUS register (27h), as LPS22HB_WaitForData() does, then read the pressure.",
            ),
        )
    yield Change(
        lambda values, truth: truth[0].scaled(-1).distance(values[0]),
        "Altitude is negated",
        ("The ratio is P0 / P: the pressure at the floor divided by the measured pressure.",),
        -1.0,
    )
