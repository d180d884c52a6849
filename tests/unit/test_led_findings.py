"""Findings about a LED that does not follow the board, from only its edges and the board's inclination."""

from __future__ import annotations

import re
from bisect import bisect_right
from collections.abc import Callable
from types import SimpleNamespace

import pytest

from fcu_emulator.emulator.clock import PS_PER_MS
from fcu_emulator.emulator.scenario.expectations import RunView
from fcu_emulator.emulator.scenario.hardware import ExpectLedFollows
from fcu_emulator.emulator.scenario.result import ExpectationResult
from fcu_emulator.emulator.scenario.run_view import TiltSample
from fcu_emulator.emulator.trace import GpioEdge

MOTION = (
    (0, 0.0),
    (2000, 0.0),
    (3000, 86.0),
    (4500, 86.0),
    (6000, -80.6),
    (7500, -80.6),
    (9000, 79.4),
    (10_500, 79.4),
    (12_000, -84.0),
)
END_MS = 14_000
PASS_MS = 1040


def pitch(at_ms: int) -> float:
    """Return the pitch. The board turns at a constant rate between the times of ``MOTION``."""
    index = bisect_right([moment for moment, _ in MOTION], at_ms)
    (from_ms, from_deg), (to_ms, to_deg) = MOTION[index - 1], (*MOTION, (END_MS, MOTION[-1][1]))[index]
    return from_deg + (to_deg - from_deg) * (at_ms - from_ms) / max(to_ms - from_ms, 1)


def finding(is_lit: Callable[[int], bool]) -> str:
    """Return the finding about a LED, or "" if the LED is correct."""
    return result(is_lit).mistake


def result(is_lit: Callable[[int], bool]) -> ExpectationResult:
    """Return the result of a LED that is lit in the milliseconds for which ``is_lit`` is true."""
    states = [is_lit(at_ms) for at_ms in range(END_MS)]
    changes = [at_ms for at_ms in range(1, END_MS) if states[at_ms] is not states[at_ms - 1]]
    edges = [
        GpioEdge(t_ps=at_ms * PS_PER_MS, pin="PB5", level=int(not states[at_ms]))
        for at_ms in ([0] if states[0] else []) + changes
    ]
    board = SimpleNamespace(
        led=lambda _name: SimpleNamespace(pin="PB5"), trace=SimpleNamespace(of=lambda _kind: edges)
    )
    tilts = [TiltSample(at_ms * PS_PER_MS, pitch(at_ms), 0.0) for at_ms in range(0, END_MS, 10)]
    seen = RunView(board, [], END_MS * PS_PER_MS, tilts=tilts)  # type: ignore[arg-type]
    expected = ExpectLedFollows(kind="led_follows", led="led1", angle="pitch", margin_deg=0.3)
    return expected.evaluate(seen)


def test_correct_led_has_no_finding() -> None:
    assert finding(lambda at_ms: abs(pitch(at_ms)) > 80) == ""


@pytest.mark.parametrize("age_ms", [0, PASS_MS])
@pytest.mark.parametrize("first_ms", [0, 300, 700])
def test_led_switched_in_main_is_late(first_ms: int, age_ms: int) -> None:
    """The LED is switched once in a pass, by the present angle or by the angle of the previous pass."""

    def is_lit(at_ms: int) -> bool:
        since_ms = at_ms - (at_ms - first_ms) % PASS_MS
        return abs(pitch(max(since_ms - age_ms, 0))) > 80

    assert finding(is_lit) == "late"


@pytest.mark.parametrize("side", [1, -1])
@pytest.mark.parametrize("age_ms", [0, PASS_MS])
@pytest.mark.parametrize("first_ms", [0, 300, 700])
def test_one_sided_late_led_is_reported_one_sided(first_ms: int, age_ms: int, side: int) -> None:
    """There are two mistakes: the finding has a time on the dark side, and states the delay on the other side."""

    def is_lit(at_ms: int) -> bool:
        since_ms = at_ms - (at_ms - first_ms) % PASS_MS
        return side * pitch(max(since_ms - age_ms, 0)) > 80

    found = result(is_lit)
    assert found.mistake == "one side"
    assert ("positive" if side > 0 else "negative") in found.seen
    assert "late" in found.seen
    moment = re.search(r"dark at \S+ s with a true pitch of (\S+) degrees", found.seen)
    assert moment is not None
    assert side * float(moment[1]) < -80


def test_one_sided_led_without_delay_is_not_late() -> None:
    found = result(lambda at_ms: pitch(at_ms) > 80)
    assert "late" not in found.seen


@pytest.mark.parametrize(
    ("is_lit", "found"),
    [
        (lambda at_ms: int(abs(pitch(at_ms))) > 80, "threshold"),
        (lambda at_ms: abs(pitch(at_ms)) > 79, "threshold"),
        (lambda at_ms: pitch(at_ms) > 80, "one side"),
        (lambda at_ms: abs(pitch(at_ms)) <= 80, "inverted"),
        (lambda at_ms: at_ms % 2080 < 1040, "blinks"),
        (lambda at_ms: at_ms > 3000, "never dark"),
        (lambda _at_ms: False, "never lit"),
    ],
)
def test_wrong_led_condition_is_named(is_lit: Callable[[int], bool], found: str) -> None:
    assert finding(is_lit) == found


def test_led_finding_does_not_reveal_required_threshold() -> None:
    found = result(lambda at_ms: abs(pitch(at_ms)) > 60)

    assert found.mistake == "threshold"
    assert "80" in found.expected
    assert not re.search(r"\b80\b(?!\.\d)", found.seen)
