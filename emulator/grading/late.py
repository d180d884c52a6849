"""Penalty for late submissions, by the rubric's table ``[late]``::

    [late]
    penalty_per_day = "10 %"   # of all points, for each day that has begun; or points
    grace_minutes = 15
    max_penalty = "50 %"
    at_most_days = 7           # later: no points

Decision: a percentage refers to all points of the rubric, so that the penalty reveals nothing about
hidden checks.
"""

from __future__ import annotations

import re
from typing import Annotated

from pydantic import Field, PlainValidator, WithJsonSchema

from fcu_emulator.emulator.scenario.fields import Table
from fcu_emulator.emulator.text import shown

_MOST_POINTS = 1_000.0
_DAY_S = 86_400
_MINUTE_S = 60

_PERCENTAGE = re.compile(r"(100|[0-9]{1,2}([.][0-9]+)?) ?%")


def _amount(value: object) -> float | str:
    if isinstance(value, str) and _PERCENTAGE.fullmatch(value):
        return value
    if isinstance(value, int | float) and not isinstance(value, bool) and 0 <= value <= _MOST_POINTS:
        return value
    raise ValueError(
        f'must be points from 0 to {_MOST_POINTS:g}, or a percentage such as "10 %", not {shown(value)}'
    )


Amount = Annotated[
    float | str,
    PlainValidator(_amount),
    WithJsonSchema(
        {
            "anyOf": [
                {"type": "number", "minimum": 0, "maximum": _MOST_POINTS},
                {"type": "string", "pattern": f"^{_PERCENTAGE.pattern}$"},
            ]
        }
    ),
]
"""Points, or a percentage of all points."""


class LateTable(Table):
    """The table ``[late]``. If ``at_most_days`` is None, the delay is not limited."""

    penalty_per_day: Amount
    grace_minutes: float = Field(0.0, ge=0, le=100_000)
    max_penalty: Amount = "100 %"
    at_most_days: int | None = Field(None, ge=0, le=10_000)


def late_penalty(rule: LateTable, late_by_s: float, max_points: float) -> float:
    """Return the lost points, at most ``max_points``. Days are counted from the deadline, even with
    a grace period.
    """
    if late_by_s <= rule.grace_minutes * _MINUTE_S:
        return 0.0
    days = max(1, -(-late_by_s // _DAY_S))
    if rule.at_most_days is not None and days > rule.at_most_days:
        return max_points
    penalty = days * _points(rule.penalty_per_day, max_points)
    return round(min(penalty, _points(rule.max_penalty, max_points), max_points), 4)


def after_penalty(points: float, penalty: float) -> float:
    """Return the points that remain after the penalty, at least 0."""
    return round(max(points - penalty, 0.0), 4)


def _points(amount: float | str, max_points: float) -> float:
    if isinstance(amount, str):
        return float(amount.rstrip("% ")) / 100 * max_points
    return amount
