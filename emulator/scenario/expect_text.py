"""Expectations about the terminal's text: a line, a pattern, a pattern never, the whole text."""

from __future__ import annotations

from typing import Annotated, Literal

import regex
from pydantic import Field, PlainSerializer, PlainValidator, ValidationInfo, WithJsonSchema

from emulator.scenario.comparing import difference, fault_between, first_difference, nearest
from emulator.scenario.expectation import Expectation, Seen, Windowed
from emulator.scenario.printed import same_banner, visible
from emulator.scenario.recorder import Line
from emulator.scenario.result import Miss
from emulator.scenario.tables import folder_of, read_bounded
from emulator.time.durations import seconds, shown

LONGEST_PATTERN = 500
_PATIENCE_S = 0.5  # for one line; a sane pattern takes microseconds


class ExpectLine(Windowed):
    """A line with exactly this text appears; with ``count`` exactly so often."""

    kind: Literal["line"]
    text: str = Field(max_length=255)  # what PRINTF can send at once
    count: int | None = Field(None, ge=1)

    def judge(self, seen: Seen) -> Miss | None:
        """Compares whole lines, blanks around them aside."""
        wanted = same_banner(self.text.strip())
        lines = [same_banner(line.text) for line in self.lines_in_window(seen)]
        found = lines.count(wanted)
        if found == self.count or (found and self.count is None):
            return None
        times = "" if self.count is None else f" {self.count} times"
        expected = f"the line {shown_line(wanted)}{times}{self.window_text()}"
        if found:
            return Miss("wrong value", expected, f"{found} times")
        near = nearest(wanted, lines)
        if near is None:
            return Miss("missing", expected, f"{len(lines)} other lines")
        diff = (f"-{visible(wanted)}", f"+{visible(near)}")
        return Miss(fault_between(wanted, near), expected, shown_line(near), diff)


class Pattern:
    """A regular expression and the text it was made of."""

    def __init__(self, text: str) -> None:
        self.text = text
        self._compiled = regex.compile(text)

    def found_in(self, line: str) -> bool:
        """Searches one line; the banner may be either. Raises TimeoutError when that takes too long."""
        return any(self._compiled.search(text, timeout=_PATIENCE_S) for text in {line, same_banner(line)})


def _parse_pattern(value: object) -> Pattern:
    if not isinstance(value, str) or len(value) > LONGEST_PATTERN:
        longest = f"of at most {LONGEST_PATTERN} characters"
        raise ValueError(f"is {shown(value)}; give a regular expression {longest}")
    try:
        return Pattern(value)
    except (regex.error, OverflowError, RecursionError) as error:
        raise ValueError(f"is {shown(value)}: {error}; give a regular expression") from error


PatternText = Annotated[
    Pattern,
    PlainValidator(_parse_pattern),
    PlainSerializer(lambda pattern: pattern.text),
    WithJsonSchema({"type": "string", "format": "regex", "maxLength": LONGEST_PATTERN}),
]


class _Matching(Windowed):
    pattern: PatternText

    def matches(self, seen: Seen) -> list[Line]:
        """The lines in the window in which the pattern is found."""
        return [line for line in self.lines_in_window(seen) if self.pattern.found_in(line.text)]


class ExpectRegex(_Matching):
    """The pattern is found in a line; ``count``: in exactly so many."""

    kind: Literal["regex"]
    count: int | None = Field(None, ge=1)

    def judge(self, seen: Seen) -> Miss | None:
        """Searches line by line."""
        found = len(self.matches(seen))
        if found == self.count or (found and self.count is None):
            return None
        times = "" if self.count is None else f" in {self.count} lines"
        expected = f"a match of {shown_line(self.pattern.text)}{times}{self.window_text()}"
        return Miss("wrong value" if found else "missing", expected, f"{found} matches")


class ExpectNever(_Matching):
    """The pattern is found in no line."""

    kind: Literal["never"]

    def judge(self, seen: Seen) -> Miss | None:
        """Searches line by line."""
        found = self.matches(seen)
        if not found:
            return None
        expected = f"no match of {shown_line(self.pattern.text)}{self.window_text()}"
        first = found[0]
        seen_text = f"{len(found)} lines, first line {first.number} at {seconds(first.at_ps)}"
        return Miss("wrong value", expected, seen_text, (f"+{visible(first.text)}",))


class NamedText:
    """A text file's content and the path under which the scenario names it."""

    def __init__(self, path: str, data: bytes) -> None:
        self.path = path
        self.data = data


def _read_text(value: object, info: ValidationInfo) -> NamedText:
    if not isinstance(value, str) or "\0" in value:
        raise ValueError(f'is {shown(value)}; give a path in quotes, such as "golden.txt"')
    return NamedText(value, read_bounded(folder_of(info) / value, "the text the board is to print"))


class ExpectText(Expectation):
    """Everything printed equals a file, byte by byte; its path counts from the scenario's folder."""

    kind: Literal["text"]
    file: Annotated[
        NamedText,
        PlainValidator(_read_text),
        PlainSerializer(lambda named: named.path),
        WithJsonSchema({"type": "string"}),
    ]

    def judge(self, seen: Seen) -> Miss | None:
        """Only the banner may differ."""
        expected = same_banner(self.file.data.decode("latin-1"))
        printed = same_banner(seen.board.terminal.text)
        if printed == expected:
            return None
        wanted_lines, printed_lines = expected.split("\n"), printed.split("\n")
        index = first_difference(wanted_lines, printed_lines)
        fault = fault_between(
            wanted_lines[index] if index < len(wanted_lines) else "",
            printed_lines[index] if index < len(printed_lines) else None,
        )
        count = f"{len(printed_lines)} lines, {len(printed)} bytes"
        wanted_count = f"{self.file.path} ({len(wanted_lines)} lines, {len(expected)} bytes)"
        return Miss(fault, wanted_count, count, difference(wanted_lines, printed_lines))


def shown_line(text: str) -> str:
    """A line in a message."""
    return f'"{visible(text)}"'
