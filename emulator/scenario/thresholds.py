"""Threshold tables: the board stops just inside and just outside of each threshold.

::

    [[threshold]]
    quantity = "roll"
    value = 45
    margin = 1

For this table, the board stops at 44, 46, -44, -46 and 55 degrees of roll (ten margins beyond 45), and
at 46 degrees of pitch, in random order.

Decision: a threshold becomes entries of the timeline when a file is read. Random poses were
rejected, because with them a program with a wrong threshold (40 degrees instead of 45) passed.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Annotated, Any, Literal, NamedTuple

from pydantic import Field, TypeAdapter, model_validator

from fcu_emulator.emulator.clock import PS_PER_MS, PS_PER_S, format_duration, parse_duration, seconds
from fcu_emulator.emulator.errors import ScenarioError
from fcu_emulator.emulator.scenario.fields import Duration, Length, Table

_STEEPEST_DEG = 90.0
_DIGITS = 6
_FAR = 10  # distance in multiples of the margin


class ThresholdTable(Table):
    """One ``[[threshold]]``: quantity, threshold, and distance of the stops from the threshold.

    ``both_sides``: whether minus ``value`` is a threshold, too (default: only for angles). ``at``:
    begin (default: 2 s, or the end of the previous threshold). Each motion takes the time ``turn``,
    each stop the time ``rest``.
    """

    quantity: Literal["pitch", "roll", "Altitude"]
    value: float = Field(gt=0, le=1000)
    margin: float = Field(gt=0)
    both_sides: bool | None = None
    at: Duration | None = None
    turn: Length = PS_PER_S
    rest: Length = 2_500 * PS_PER_MS

    @model_validator(mode="after")
    def _can_rest_there(self) -> ThresholdTable:
        if self.margin >= self.value:
            raise ValueError(f"margin must be less than the value, {self.value:g}, not {self.margin:g}")
        if self.is_angle and self.value + self.margin >= _STEEPEST_DEG:
            raise ValueError(
                f"value and margin together must be less than 90 degrees, not {self.value + self.margin:g}"
            )
        return self

    @property
    def is_angle(self) -> bool:
        """Return whether the quantity is an inclination."""
        return self.quantity != "Altitude"

    def poses(self) -> list[tuple[str, float]]:
        """Return (quantity, value) of each stop."""
        both = self.is_angle if self.both_sides is None else self.both_sides
        inside, outside = self.value - self.margin, self.value + self.margin
        signs = (1, -1) if both else (1,)
        poses = [(self.quantity, sign * at) for sign in signs for at in (outside, inside)]
        poses.append((self.quantity, self._far()))
        if self.is_angle:
            poses.append(("pitch" if self.quantity == "roll" else "roll", outside))
        return [(name, round(value, _DIGITS)) for name, value in poses]

    def _far(self) -> float:
        """Return a value far beyond the threshold, to detect a missing threshold."""
        far = self.value + _FAR * self.margin
        return min(far, (self.value + self.margin + _STEEPEST_DEG) / 2) if self.is_angle else far


MOST_THRESHOLDS = 20  # in a scenario
_Tables = Annotated[list[ThresholdTable], Field(max_length=MOST_THRESHOLDS)]
_TABLES: TypeAdapter[list[ThresholdTable]] = TypeAdapter(_Tables)


def parse_thresholds(value: Any) -> list[ThresholdTable]:
    """Return the threshold tables of a file. Raises pydantic's ValidationError."""
    return _TABLES.validate_python(value)


class ThresholdSection(NamedTuple):
    """The part of a run for threshold ``number``, with its timeline entries."""

    number: int
    begin_ps: int
    end_ps: int
    entries: range


def put_in_place(
    table: Mapping[str, Any],
    thresholds: Sequence[ThresholdTable],
    pick: Callable[[str, int], float],
    file: str,
) -> tuple[dict[str, Any], list[ThresholdSection]]:
    """Return the table with motions instead of thresholds, and the part of the run for each threshold.

    The function ``pick`` selects a random order. By default, the run ends after the final stop. Raises
    ScenarioError.
    """
    timeline = table.get("timeline", [])
    others = [entry for entry in timeline if isinstance(entry, dict)] if isinstance(timeline, list) else []
    added: list[dict[str, Any]] = []
    parts: list[ThresholdSection] = []
    at_ps, height_m = 2 * PS_PER_S, 0.0
    for number, one in enumerate(thresholds):
        if not one.is_angle and any(map(_may_lift, others)):
            problem = "must not be Altitude if the timeline lifts the board; use another run for it"
            raise ScenarioError(file, f"threshold[{number}].quantity", problem)
        at_ps = begin_ps = at_ps if one.at is None else one.at
        first = len(timeline) + len(added)
        poses = one.poses()
        order = sorted(range(len(poses)), key=lambda index: pick(f"threshold[{number}]", index))
        for name, value in (poses[index] for index in order):
            entry = _lift(value - height_m) if name == "Altitude" else _turn(name, value, table)
            height_m = value if name == "Altitude" else height_m
            added.append({**entry, "at": format_duration(at_ps), "for": format_duration(one.turn)})
            at_ps += one.turn + one.rest
        parts.append(ThresholdSection(number, begin_ps, at_ps, range(first, len(timeline) + len(added))))
    return {**_lasting(table, at_ps, len(thresholds) - 1, file), "timeline": [*timeline, *added]}, parts


_LIFTING = frozenset({"lift", "free_fall", "follow_altitude", "replay"})


def _may_lift(entry: Mapping[str, Any]) -> bool:
    return entry.get("do") in _LIFTING or (entry.get("do") == "move" and bool(entry.get("up_m")))


def _lift(metres: float) -> dict[str, Any]:
    return {"do": "lift", "metres": round(metres, _DIGITS)}


def _turn(angle: str, value: float, table: Mapping[str, Any]) -> dict[str, Any]:
    """Return a motion to an angle, with the other angle at 0."""
    world = table.get("world")
    yaw_deg = world.get("yaw_deg", 0.0) if isinstance(world, dict) else 0.0
    return {"do": "rotate_to", f"{angle}_deg": value, "yaw_deg": yaw_deg}


def _lasting(table: Mapping[str, Any], end_ps: int, last: int, file: str) -> dict[str, Any]:
    kept = {key: value for key, value in table.items() if key != "threshold"}
    if "duration" not in kept:
        return {**kept, "duration": format_duration(end_ps)}
    try:
        duration_ps = parse_duration(kept["duration"])
    except ValueError:
        return kept  # the schema will refuse this duration
    if duration_ps < end_ps:
        problem = f"must end before the scenario's end at {seconds(duration_ps)}, not at {seconds(end_ps)}"
        hint = "give a longer duration, or omit it"
        raise ScenarioError(file, f"threshold[{last}]", f"{problem}; {hint}")
    return kept
