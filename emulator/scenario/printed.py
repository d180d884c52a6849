"""The lines the lab's firmware prints, and the numbers in them (brief, "Exact text").

A number is a field of a line that has its exact format from beginning to end, never a piece of text that
looks right: "4" is not found in "164", and a sign cannot get lost. A line that begins like one of the formats
and does not follow it is malformed, which is another fault than a wrong value.

Decision: blanks and carriage returns around a line do not count here; terminals do not show them. Whoever
wants every byte compares whole texts.
"""

from __future__ import annotations

import re

_PATTERN = {"%d": r"(-?\d+)", "%f": r"(-?(?:\d+\.\d{6}|inf|nan))"}
ANGLES = frozenset({"Pitch", "Roll", "Yaw"})

_FORMATS: tuple[tuple[str, tuple[str, ...]], ...] = (
    ("ACC[x,y,z] %d mg %d mg %d mg", ("ACC.x", "ACC.y", "ACC.z")),
    ("GYR[x,y,z] %d mdps %d mdps %d mdps", ("GYR.x", "GYR.y", "GYR.z")),
    ("MAG[x,y,z] %d mg %d mg %d mg", ("MAG.x", "MAG.y", "MAG.z")),
    ("Pre: %f hPa", ("Pre",)),
    ("Pitch: %f deg Roll: %f deg Yaw: %f deg", ("Pitch", "Roll", "Yaw")),
    ("Altitude: %f m", ("Altitude",)),
)


class LineFormat:
    """One kind of line: its format string, what it begins with, and the fields it carries."""

    def __init__(self, text: str, fields: tuple[str, ...]) -> None:
        self.text = text
        self.fields = fields
        self.label = text.split(" ", 1)[0]
        pattern = re.escape(text).replace(r"\ ", " ")
        for conversion, number in _PATTERN.items():
            pattern = pattern.replace(conversion, number)
        self._pattern = re.compile(pattern, re.ASCII)

    def parse(self, line: str) -> dict[str, float] | None:
        """The fields' values; None when the line does not follow the format."""
        match = self._pattern.fullmatch(line)
        return dict(zip(self.fields, map(float, match.groups()), strict=True)) if match else None


FORMATS = tuple(LineFormat(text, fields) for text, fields in _FORMATS)
FORMAT_OF_FIELD = {field: line_format for line_format in FORMATS for field in line_format.fields}
FIELDS = tuple(FORMAT_OF_FIELD)

_BANNER = re.compile(r"STEVAL-FCU001V1 FW(?= rev\.)")


def same_banner(text: str) -> str:
    """The text with ST's "FW" banner as the slides' "FH": every comparison takes either (brief)."""
    return _BANNER.sub("STEVAL-FCU001V1 FH", text)


def visible(text: str) -> str:
    """A line with its control characters as escapes."""
    return text.encode("unicode_escape").decode("ascii")
