"""Laws of the late penalty: points never become negative or increase, and later submissions lose more."""

from __future__ import annotations

from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from fcu_emulator.emulator.grading.late import LateTable, after_penalty, late_penalty

MINUTE_S, DAY_S = 60, 86_400
POINTS = st.floats(0, 1_000)
LATE = st.one_of(st.floats(-10 * DAY_S, 40 * DAY_S), st.integers(-3, 40).map(lambda days: days * DAY_S))
AMOUNTS = st.one_of(
    st.floats(0, 1_000), st.integers(0, 100).map("{} %".format), st.floats(0, 99).map("{:.1f}%".format)
)


def table(**keys: Any) -> LateTable:
    return LateTable.model_validate(keys)


RULES = st.builds(
    table,
    penalty_per_day=AMOUNTS,
    grace_minutes=st.floats(0, 10_000),
    max_penalty=AMOUNTS,
    at_most_days=st.none() | st.integers(0, 30),
)


@given(RULES, LATE, POINTS, POINTS)
def test_remaining_points_are_between_zero_and_original(
    rule: LateTable, late_s: float, points: float, max_points: float
) -> None:
    left = after_penalty(points, late_penalty(rule, late_s, max_points))

    assert 0 <= left <= round(points, 4)


@given(RULES, LATE, LATE, POINTS)
def test_later_submission_never_loses_fewer_points(
    rule: LateTable, one: float, other: float, max_points: float
) -> None:
    early, late = sorted([one, other])

    assert late_penalty(rule, early, max_points) <= late_penalty(rule, late, max_points)


@given(RULES, LATE, POINTS, st.tuples(POINTS, POINTS))
def test_more_original_points_never_leave_fewer_points(
    rule: LateTable, late_s: float, max_points: float, points: tuple[float, float]
) -> None:
    less, more = (after_penalty(one, late_penalty(rule, late_s, max_points)) for one in sorted(points))

    assert less <= more


@given(RULES, POINTS, st.floats(0, 1))
def test_grace_period_costs_no_points(rule: LateTable, max_points: float, share: float) -> None:
    assert late_penalty(rule, -share * DAY_S, max_points) == 0
    assert late_penalty(rule, share * rule.grace_minutes * MINUTE_S, max_points) == 0


@pytest.mark.parametrize(
    ("keys", "late_s", "lost"),
    [
        ({"penalty_per_day": "10 %"}, 1, 2),
        ({"penalty_per_day": "10 %"}, DAY_S, 2),
        ({"penalty_per_day": "10 %"}, DAY_S + 1, 4),
        ({"penalty_per_day": 1.5}, 2 * DAY_S + 1, 4.5),
        ({"penalty_per_day": "10%", "grace_minutes": 15}, 15 * MINUTE_S, 0),
        ({"penalty_per_day": "10%", "grace_minutes": 15}, 15 * MINUTE_S + 1, 2),
        ({"penalty_per_day": "10 %", "max_penalty": "50 %"}, 30 * DAY_S, 10),
        ({"penalty_per_day": "10 %", "max_penalty": 3}, 30 * DAY_S, 3),
        ({"penalty_per_day": "10 %", "max_penalty": 3, "at_most_days": 2}, 2 * DAY_S, 3),
        ({"penalty_per_day": "10 %", "max_penalty": 3, "at_most_days": 2}, 2 * DAY_S + 1, 20),
        ({"penalty_per_day": 0, "at_most_days": 0}, 1, 20),
        ({"penalty_per_day": "10 %"}, 30 * DAY_S, 20),
    ],
)
def test_late_penalty_of_twenty_points_is_exact(keys: dict[str, Any], late_s: float, lost: float) -> None:
    assert late_penalty(table(**keys), late_s, 20) == lost
