"""Differences between texts, computed in bounded time."""

from __future__ import annotations

import difflib
import re
from collections.abc import Sequence

from fcu_emulator.emulator.scenario.result import Fault
from fcu_emulator.emulator.scenario.run_view import escaped

_CONTEXT = 3
_SHOWN = 6  # lines shown from the first difference on
_CANDIDATES = 500  # distinct lines that are compared
_LONGEST = 300  # characters compared
_NUMBER = re.compile(r"-?\d+(?:\.\d+)?")


def first_difference(expected: Sequence[str], printed: Sequence[str]) -> int:
    """Return the index of the first different line."""
    common = min(len(expected), len(printed))
    return next((index for index in range(common) if expected[index] != printed[index]), common)


def difference(expected: Sequence[str], printed: Sequence[str]) -> tuple[str, ...]:
    """Return the first difference as a unified diff."""
    index = first_difference(expected, printed)
    begin, end = max(index - _CONTEXT, 0), index + _SHOWN
    old, new = (list(map(escaped, side[begin:end])) for side in (expected, printed))
    hunks = difflib.unified_diff(old, new, n=_CONTEXT, lineterm="")
    return (f"@@ line {index + 1} @@", *(line for line in hunks if not line.startswith(("---", "+++", "@@"))))


def nearest(wanted: str, lines: Sequence[str]) -> str | None:
    """Return the most similar line, or None. Lines that differ only in numbers are preferred."""
    distinct = list(dict.fromkeys(line[:_LONGEST] for line in lines if line))[:_CANDIDATES]
    same_form = [line for line in distinct if _form(line) == _form(wanted)]
    folded = {line.casefold(): line for line in same_form or distinct}
    found = difflib.get_close_matches(wanted[:_LONGEST].casefold(), folded, n=1, cutoff=0.6)
    return folded[found[0]] if found else next(iter(same_form), None)


def fault_between(wanted: str, found: str | None) -> Fault:
    """Return the kind of failure if ``found`` is printed instead of ``wanted``."""
    if found is None:
        return "missing"
    return "wrong value" if _form(wanted) == _form(found) else "wrong format"


def _form(line: str) -> str:
    return _NUMBER.sub("#", line)


# -- A printed line against a format of printf --------------------------------------------------------------

_TOKEN = re.compile(r"%[-+ #0]*\d*(?:\.\d+)?[a-zA-Z]|-?\d+(?:\.\d+)?|[^\W\d_]+|[^\w\s]|_")
_DIGITS = re.compile(r"\.(\d+)f")
_MOST_DIFFERENCES = 3


def format_difference(wanted: str, line: str) -> str:
    """Describe the difference between a line and a format, or return ""."""
    tokens, printed = _TOKEN.findall(wanted), _TOKEN.findall(line[:_LONGEST])
    found = dict.fromkeys(filter(None, map(_token_difference, tokens, printed)))
    if not found and len(tokens) == len(printed):
        return "the spaces differ" if _squeezed(wanted) == wanted else ""
    if len(printed) < len(tokens) and not found:
        return f'"{tokens[len(printed)]}" is missing at the end'
    if len(printed) > len(tokens) and not found:
        return f'"{printed[len(tokens)]}" is surplus at the end'
    return ", ".join(list(found)[: _MOST_DIFFERENCES if len(tokens) == len(printed) else 1])


def _squeezed(text: str) -> str:
    return " ".join(text.split())


def _token_difference(wanted: str, printed: str) -> str:
    number = re.fullmatch(_NUMBER, printed)
    if wanted.startswith("%") and len(wanted) > 1:
        if number is None:
            return "" if printed in ("nan", "inf") else f'"{printed}" in place of {wanted}'
        decimals = len(printed.partition(".")[2])
        wanted_decimals = int(_DIGITS.findall(wanted)[0]) if _DIGITS.search(wanted) else 6
        if wanted.endswith("f") and decimals != wanted_decimals:
            kind = (
                f"{decimals} decimals, as printed by %.{decimals}f,"
                if decimals
                else "no decimals, as printed by %d,"
            )
            return f"{printed} has {kind} but {wanted} prints {wanted_decimals}"
        return f"{printed} in place of a whole number, {wanted}" if wanted.endswith("d") and decimals else ""
    return "" if wanted == printed else f'"{printed}" in place of "{wanted}"'
