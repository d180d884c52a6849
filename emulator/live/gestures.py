"""Timeline entries with default values, for ``fcu move`` and a page's buttons."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

Entries = Callable[[float, str | None, str | None], list[dict[str, Any]]]


@dataclass(frozen=True)
class Gesture:
    """``entries`` maps (amount, time, axis) to timeline entries. None selects a default."""

    usual: float | None
    """Default amount; None if the gesture does not take an amount."""
    entries: Entries
    takes_time: bool = True
    takes_axis: bool = False
    interrupts: bool = False
    """Whether the gesture can interrupt a motion in progress."""


GESTURES = {
    "lift": Gesture(
        1.0,
        lambda metres, time, _: [{"do": "lift", "metres": metres, "for": time or "1s"}],
        interrupts=True,
    ),
    "tap": Gesture(
        3.0,
        lambda g, time, axis: [
            {"do": "tap", "amplitude_g": g, "axis": axis or "up"} | ({"for": time} if time else {})
        ],
        takes_axis=True,
    ),
    "shake": Gesture(
        0.5,
        lambda g, time, axis: [
            {"do": "shake", "amplitude_g": g, "frequency_hz": 5, "axis": axis or "north", "for": time or "1s"}
        ],
        takes_axis=True,
    ),
    "free_fall": Gesture(
        None,
        lambda _, time, __: [{"do": "free_fall", "for": time or "300ms"}],
        interrupts=True,
    ),
    "figure_eight": Gesture(
        2.0,
        lambda turns, time, _: [
            {"do": "figure_eight", "turns": int(turns), "for": time or "12s", "by": "hand"}
        ],
        interrupts=True,
    ),
    "turn_over": Gesture(
        None,
        lambda _, time, __: [{"do": "turn_over", "for": time or "1s"}],
        interrupts=True,
    ),
    "pass_magnet": Gesture(
        0.1,
        lambda metres, _, __: [
            {"do": "pass_magnet", "moment_am2": 1, "distance_m": metres, "speed_m_s": 0.3}
        ],
        takes_time=False,
    ),
    "flat": Gesture(
        None,
        lambda _, __, ___: [{"do": "follow_attitude"}, {"do": "follow_altitude", "metres": 0}],
        takes_time=False,
    ),
}

OLD_WORDS = {
    "fall": "free_fall",
    "eight": "figure_eight",
    "over": "turn_over",
    "magnet": "pass_magnet",
    "reset": "flat",
}
"""Words of earlier releases; ``fcu move`` accepts them for one more release."""

_BUTTONS: tuple[tuple[str, float | None, str | None, str], ...] = (
    ("flat", None, None, "Lay the board flat on the floor, X to the north"),
    ("tap", None, None, "A tap of 3 g from above"),
    ("shake", None, None, "Shake for one second, 0.5 g at 5 Hz"),
    ("lift", 1.0, "2s", "Lift by 1 m in 2 s"),
    ("lift", -1.0, "2s", "Lower by 1 m in 2 s"),
    ("turn_over", None, None, "Turn by 180 degrees about the board's X axis in 1 s"),
    ("free_fall", None, None, "Drop for 0.3 s, then catch"),
    ("figure_eight", 2.0, "12s", "Two figures of eight in 12 s, by hand, for the calibration"),
    ("pass_magnet", None, None, "A magnet of 1 A m\N{SUPERSCRIPT TWO} passes at 0.1 m to the east"),
)


def buttons() -> list[dict[str, Any]]:
    """Return ``word``, ``label``, ``doc`` and ``entries`` of the page's gestures."""
    return [_button(*one) for one in _BUTTONS]


def _button(word: str, amount: float | None, time: str | None, doc: str) -> dict[str, Any]:
    gesture = GESTURES[word]
    entries = gesture.entries(gesture.usual or 0.0 if amount is None else amount, time, None)
    if gesture.interrupts:
        entries = [entry | {"interrupts": True} for entry in entries]
    metres = f" {amount:+g} m".replace("-", "\N{MINUS SIGN}") if word == "lift" else ""
    label = word.replace("_", " ").capitalize() + metres
    return {"word": word, "label": label, "doc": doc, "entries": entries}
