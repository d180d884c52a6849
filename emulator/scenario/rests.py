"""Use the lines printed at rest to find the mistake in lines that must follow a condition.

Decision: lines are evaluated only while the board rests for longer than ``max_gap``, but LEDs at
all moments, because a line can be missing only when it is due.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import groupby, pairwise
from typing import NamedTuple

from fcu_emulator.emulator.scenario.conditions import Condition, Stretch
from fcu_emulator.emulator.scenario.run_view import SAMPLE_STEP_PS

_RESTING = 1e-3  # change of a true value in 10 ms


class Rest(NamedTuple):
    """A period in which a quantity does not change."""

    value: float
    other: float
    """The other inclination of the board."""
    holds: bool
    printed: bool | None
    """Whether the line is printed: True if all the time, False if never, None if part of the time."""


def resting(samples: Sequence[float], stretch: Stretch) -> Iterator[tuple[float, int, int]]:
    """Yield (value, from, until in ps) of each rest."""
    first = -(-stretch.begin_ps // SAMPLE_STEP_PS)
    last = min(stretch.end_ps // SAMPLE_STEP_PS, len(samples) - 1)
    changes = ((index, abs(samples[index + 1] - samples[index])) for index in range(first, last))
    for rests, group in groupby(changes, key=lambda one: one[1] < _RESTING):
        indices = [index for index, _ in group]
        if rests:
            yield samples[indices[0]], indices[0] * SAMPLE_STEP_PS, (indices[-1] + 1) * SAMPLE_STEP_PS


def is_printed(lines_ps: Sequence[int], begin_ps: int, end_ps: int, max_gap_ps: int) -> bool | None:
    """Return :attr:`Rest.printed` for these times."""
    within = [at_ps for at_ps in lines_ps if begin_ps <= at_ps < end_ps]
    if not within:
        return False
    gaps = (after - before for before, after in pairwise([begin_ps, *within, end_ps]))
    return True if max(gaps) <= max_gap_ps else None


def mistake(rests: Sequence[Rest], condition: Condition) -> tuple[str, str]:
    """Return the kind of the mistake and the end of the message, or "" for both if unknown."""
    wrong = [rest for rest in rests if rest.printed is not rest.holds]
    shown = [rest for rest in rests if rest.printed]
    silent = [rest for rest in rests if rest.printed is False]
    if not wrong or not shown or not silent or len(shown) + len(silent) < len(rests):
        return "", ""
    if len(wrong) == len(rests):
        return "inverted", ": it is printed exactly when it must not be"
    if condition.beyond is not None and _follows_other(rests, condition.beyond):
        return "other axis", f": it follows {'roll' if condition.quantity == 'pitch' else 'pitch'}"
    if _is_one_sided(wrong, shown):
        side = "positive" if shown[0].value > 0 else "negative"
        return "one side", f": it is printed for {side} values only"
    beyond, within = (silent, shown) if condition.below is not None else (shown, silent)
    low, high = (max(abs(rest.value) for rest in within), min(abs(rest.value) for rest in beyond))
    if low < high:
        between = f"between {low:.1f} and {high:.1f}"
        return "threshold", f": its threshold is {between}"
    return "", ""


def _follows_other(rests: Sequence[Rest], beyond: float) -> bool:
    return all((abs(rest.other) > beyond) is rest.printed for rest in rests)


def _is_one_sided(wrong: Sequence[Rest], shown: Sequence[Rest]) -> bool:
    """Return whether the lines are missing on one side only, and are printed on the other side only."""
    silent_sides = {rest.value > 0 for rest in wrong}
    shown_sides = {rest.value > 0 for rest in shown}
    return all(rest.holds for rest in wrong) and len(silent_sides) == 1 and not silent_sides & shown_sides
