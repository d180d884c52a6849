"""Showing how texts differ, in bounded time for texts of any length."""

from __future__ import annotations

import difflib
import re
from collections.abc import Sequence

from emulator.scenario.printed import visible
from emulator.scenario.result import Fault

_CONTEXT = 3
_SHOWN = 6  # lines of each side after the first difference
_CANDIDATES = 500  # distinct lines among which a similar one is looked for
_LONGEST = 300  # characters of a line that are compared for similarity
_NUMBER = re.compile(r"-?\d+(?:\.\d+)?")


def first_difference(expected: Sequence[str], printed: Sequence[str]) -> int:
    """Index of the first line that differs."""
    common = min(len(expected), len(printed))
    return next((index for index in range(common) if expected[index] != printed[index]), common)


def difference(expected: Sequence[str], printed: Sequence[str]) -> tuple[str, ...]:
    """The place of the first difference, as a unified diff with a few lines of context."""
    index = first_difference(expected, printed)
    begin, end = max(index - _CONTEXT, 0), index + _SHOWN
    old, new = (list(map(visible, side[begin:end])) for side in (expected, printed))
    hunks = difflib.unified_diff(old, new, n=_CONTEXT, lineterm="")
    return (f"@@ line {index + 1} @@", *(line for line in hunks if not line.startswith(("---", "+++", "@@"))))


def nearest(wanted: str, lines: Sequence[str]) -> str | None:
    """The line most like the wanted one, the same but for its numbers first; None when none is like it."""
    distinct = list(dict.fromkeys(line[:_LONGEST] for line in lines if line))[:_CANDIDATES]
    same_form = [line for line in distinct if _form(line) == _form(wanted)]
    folded = {line.casefold(): line for line in same_form or distinct}
    found = difflib.get_close_matches(wanted[:_LONGEST].casefold(), folded, n=1, cutoff=0.6)
    return folded[found[0]] if found else next(iter(same_form), None)


def fault_between(wanted: str, found: str | None) -> Fault:
    """Which of the faults it is that ``found`` stands in place of ``wanted``."""
    if found is None:
        return "missing"
    return "wrong value" if _form(wanted) == _form(found) else "wrong format"


def _form(line: str) -> str:
    return _NUMBER.sub("#", line)
