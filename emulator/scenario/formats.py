"""Formats that find a number in a line: by a name of the slides, a ``printf`` format string, or a
regular expression with a group ``number``.

Decision: a format string must match a whole line exactly. "%.2f" means two decimals. If a line may
vary, a pattern is needed.
"""

from __future__ import annotations

import re
from typing import Annotated, Protocol

from pydantic import AfterValidator, Field

from fcu_emulator.emulator.scenario.fields import PatternText, TextPattern, TimeBudget
from fcu_emulator.emulator.scenario.run_view import FORMAT_OF_FIELD
from fcu_emulator.emulator.text import shown, visible

# -- Interface of a format ----------------------------------------------------------------------------------


class NumberFormat(Protocol):
    """Print format of one number."""

    text: str
    """The text of the format in findings."""

    def is_begun_by(self, line: str) -> bool: ...

    def is_meant_by(self, line: str) -> bool:
        """Return whether a line has the same number in another form."""
        ...

    def number(self, line: str) -> float | None:
        """Return the number, or None if the line has another format. Raises TimeoutError."""
        ...


class NamedFormat:
    """A number of the slides."""

    def __init__(self, name: str) -> None:
        self._name = name
        self._line = FORMAT_OF_FIELD[name]
        self.text = self._line.text

    def is_begun_by(self, line: str) -> bool:
        return line.startswith(self._line.label)

    def is_meant_by(self, line: str) -> bool:
        return self._line.is_meant_by(line)

    def number(self, line: str) -> float | None:
        fields = self._line.parse(line)
        return None if fields is None else fields[self._name]


# -- A format string ----------------------------------------------------------------------------------------


_CONVERSION = re.compile(
    r"%(?P<flags>[-+ #0]*)(?P<width>\d*)(?:\.(?P<digits>\d*))?(?:hh|h|ll|l|L|z|j|t)?(?P<kind>.)"
)
_NUMBERS = "diufFeEgGx"
_KINDS = f"{_NUMBERS}Xsc%"
_BLANKS = " \r\n\t"
_LONGEST_MEANT = 200
_MOST_DIGITS = 2  # in a width


class PrintfFormat:
    """A ``printf`` format string and the index of the number, counted from 1. Raises ValueError."""

    def __init__(self, text: str, number: int = 1, patience: TimeBudget | None = None) -> None:
        bare = text.strip(_BLANKS)
        self.text = visible(bare)
        self._patience = TimeBudget() if patience is None else patience
        self._label = bare.partition("%")[0].rstrip()
        self._base = 10
        self._meant_number, self._numbers = number, 0
        place, pattern = 0, ""
        for match in _CONVERSION.finditer(bare):
            pattern += re.escape(bare[place : match.start()]) + self._conversion(match)
            place = match.end()
        if "%" in bare[place:]:
            raise ValueError(
                f"must not end inside a conversion, as {shown(text)} does; write %% for a percent sign"
            )
        if not 1 <= number <= self._numbers:
            count = f"{self._numbers} number{'s' * (self._numbers != 1)}"
            raise ValueError(f"is {shown(text)}, which prints {count}; number {number} is not among them")
        self._line = TextPattern(rf"\A{pattern}{re.escape(bare[place:])}\Z")
        word = re.search(r"[^\W\d_]{3}", self._label)  # to recognise the number in another form
        meant = rf"\b{word[0]}\w*[^\w\n][^\n]*?\d" if word else ""
        self._meant = re.compile(meant, re.IGNORECASE) if meant else None

    def _conversion(self, match: re.Match[str]) -> str:
        """Return a pattern for one conversion. The conversion of the wanted number becomes a group of the pattern."""
        kind = match["kind"]
        if kind not in _KINDS:
            raise ValueError(
                f"has the conversion {shown(match[0])}; known: {', '.join(f'%{k}' for k in _KINDS)}"
            )
        if max(len(match["width"]), len(match["digits"] or "")) > _MOST_DIGITS:
            raise ValueError(f"has the conversion {shown(match[0])}; give a width and digits below 100")
        if kind == "%":
            return "%"
        if kind in "sc":
            return ".*?" if kind == "s" else "."
        self._numbers += 1
        group = "?:"
        if self._numbers == self._meant_number:
            group, self._base = "?P<number>", 16 if kind in "xX" else 10
        sign = r"[-+]" if "+" in match["flags"] else r"[- ]?" if " " in match["flags"] else "-?"
        blanks = " *" if match["width"] else ""
        after = " *" if "-" in match["flags"] else ""
        return f"{blanks}({group}{sign}{self._digits(kind, match['digits'])}){after}"

    @staticmethod
    def _digits(kind: str, digits: str | None) -> str:
        if kind in "diu":
            return "[0-9]+"
        if kind in "xX":
            return "(?:0[xX])?[0-9a-fA-F]+"
        if kind in "gG":
            return r"(?:[0-9]+\.?[0-9]*(?:[eE][-+][0-9]+)?|inf|nan)"
        count = 6 if digits is None else int(digits or 0)
        decimals = rf"\.[0-9]{{{count}}}" if count else ""
        exponent = "[eE][-+][0-9]+" if kind in "eE" else ""
        return rf"(?:[0-9]+{decimals}{exponent}|inf|nan|INF|NAN)"

    def is_begun_by(self, line: str) -> bool:
        """Return whether the line begins with the text before the first conversion."""
        return line.startswith(self._label) if self._label else self.number(line) is not None

    def is_meant_by(self, line: str) -> bool:
        """Return whether the label's first word appears before a number."""
        return self._meant is not None and self._meant.search(line[:_LONGEST_MEANT]) is not None

    def number(self, line: str) -> float | None:
        found = self._line.group_in(line, "number", self._patience)
        if found is None:
            return None
        text = found.replace(" ", "")
        return float(int(text, 16)) if self._base == 16 else float(text)


def printed_with_zeros(text: str) -> str:
    """Return the output of a format if all numbers are 0 and all texts are "x"."""

    def printed(match: re.Match[str]) -> str:
        kind = match["kind"]
        if kind in "%sc":
            return "%" if kind == "%" else "x"
        digits = "" if match["digits"] is None else f".{match['digits']}"
        return f"%{match['flags']}{match['width']}{digits}{'d' if kind in 'iu' else kind}" % 0

    return _CONVERSION.sub(printed, text)


# -- A pattern ----------------------------------------------------------------------------------------------


class PatternFormat:
    """A regular expression with a group ``number``."""

    def __init__(self, pattern: TextPattern, patience: TimeBudget | None = None) -> None:
        self.text = visible(pattern.text)
        self._pattern = pattern
        self._patience = TimeBudget() if patience is None else patience

    def is_begun_by(self, line: str) -> bool:
        return self.number(line) is not None

    def is_meant_by(self, line: str) -> bool:
        """Return False, because a pattern does not define similar lines."""
        del line
        return False

    def number(self, line: str) -> float | None:
        text = self._pattern.group_in(line, "number", self._patience)
        try:
            return None if text is None else float(text)
        except ValueError:
            return None


# -- The keys of a file -------------------------------------------------------------------------------------


def _prints_a_number(text: str) -> str:
    PrintfFormat(text)
    return text


def _has_a_number(pattern: TextPattern) -> TextPattern:
    if "number" not in pattern.groups:
        raise ValueError(f"is {shown(pattern.text)}; give a group (?P<number>...) around the number")
    return pattern


FormatText = Annotated[str, Field(max_length=255), AfterValidator(_prints_a_number)]
NumberPattern = Annotated[PatternText, AfterValidator(_has_a_number)]


def shown_format(text: str) -> str:
    """Return a format in the form that is used in messages."""
    return f'"{visible(text.strip(_BLANKS))}"'
