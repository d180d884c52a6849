"""Safe display of untrusted text with escaped control, reordering and invisible characters."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence

_SPACES = frozenset(
    "\xa0\u1680\u2000\u2001\u2002\u2003\u2004\u2005\u2006\u2007\u2008\u2009\u200a\u202f\u205f\u3000"
)
_KEPT = frozenset("\n\t")
_FORMULA = ("=", "+", "-", "@", "\t", "\r", "\uff1d", "\uff0b", "\uff0d", "\uff20")
"""First characters of a cell that a spreadsheet evaluates as a formula (OWASP, CSV injection)."""
_AFTER_SEMICOLON = re.compile(rf"""(;[\s"']*)(?=[{re.escape("".join(_FORMULA))}])""")
"""The beginning of a cell, for a spreadsheet program that separates cells by semicolons because of system settings."""
_SHOWN = 40  # maximum length of an invalid value in a message


def visible(text: str, *, lines: bool = False) -> str:
    """Return ``text`` with escaped control and hidden characters.

    If ``lines`` is True, keep newlines and tabs, and omit carriage returns beside newlines.
    """
    if lines:
        text = text.replace("\r\n", "\n").replace("\n\r", "\n")
    if text.isprintable():
        return text
    kept = _KEPT if lines else frozenset()
    return "".join(sign if sign.isprintable() or sign in kept else _escape(sign) for sign in text)


def one_line(text: str, longest: int = 200) -> str:
    """Return ``text`` on one line of at most ``longest`` characters."""
    line = visible(" ".join(text.split()))
    return line if len(line) <= longest else line[: longest - 3] + "..."


def shown(value: object) -> str:
    """Return a value's text for messages, possibly shortened."""
    try:
        text = repr(value)
    except ValueError:  # an integer of more digits than Python prints
        return "(thousands of digits)"
    return text if len(text) <= _SHOWN else text[:_SHOWN] + "..."


def choices(names: Iterable[str]) -> str:
    """Return names for messages: 'pitch', 'roll' or 'yaw'."""
    *first, last = map(repr, names)
    return f"{', '.join(first)} or {last}" if first else last


def csv_text(rows: Iterable[Sequence[str | float]]) -> str:
    """Return CSV rows with one-line texts that spreadsheets do not evaluate as formulas."""
    import csv
    import io

    sink = io.StringIO(newline="")
    csv.writer(sink).writerows([_cell(value) for value in row] for row in rows)
    return sink.getvalue()


def _cell(value: str | float) -> str | float:
    if not isinstance(value, str):
        return value
    text = _AFTER_SEMICOLON.sub(r"\1'", visible(value))
    return f"'{text}" if text.startswith(_FORMULA) else text


def _escape(sign: str) -> str:
    if sign in _SPACES:
        return " "
    code = ord(sign)
    if code < 0x100:
        return f"\\x{code:02x}"
    return f"\\u{code:04x}" if code < 0x1_0000 else f"\\U{code:08x}"
