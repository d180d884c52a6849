"""Texts of bounded size: pages of long texts, and a store from which the rest is read.

Decision: a long text is cut at its end, because the first error of a compiler and the first failed check are the
important ones. The rest can be read by name. The terminal of a live board is cut at its beginning.
"""

from __future__ import annotations

import threading
from collections import OrderedDict
from typing import Any, Final

from fcu_emulator.emulator.errors import InputError
from fcu_emulator.emulator.text import choices, shown, visible

MOST_LINES: Final = 200
"""Maximum number of lines in one page."""
MOST_BYTES: Final = 16_000
"""Maximum size of one page in bytes of UTF-8."""
_LONGEST_LINE: Final = 500  # characters; a longer line is continued on the next line
_MOST_KEPT: Final = 16  # texts
_LARGEST_KEPT: Final = 1 << 20  # characters of one text


def lines_of(text: str) -> list[str]:
    """Return the lines of untrusted text with escaped control characters. Long lines are continued on the next."""
    return [
        line[start : start + _LONGEST_LINE]
        for line in visible(text, lines=True).splitlines()
        for start in range(0, max(len(line), 1), _LONGEST_LINE)
    ]


def page(lines: list[str], first_line: int = 1) -> tuple[str, int]:
    """Return the text that begins at ``first_line``, counted from 1, and the number of the line after it."""
    size, last = 0, first_line - 1
    for line in lines[last : last + MOST_LINES]:
        size += len(line.encode("utf-8", "replace")) + 1
        if size > MOST_BYTES:
            break
        last += 1
    return "\n".join(lines[first_line - 1 : last]), last + 1


def latest(lines: list[str]) -> list[str]:
    """Return the last lines that fit into one page."""
    size = 0
    for count, line in enumerate(reversed(lines[-MOST_LINES:])):
        size += len(line.encode("utf-8", "replace")) + 1
        if size > MOST_BYTES:
            return lines[len(lines) - count :]
    return lines[-MOST_LINES:]


class TextStore:
    """The latest long texts by name. Safe for several threads."""

    def __init__(self) -> None:
        self._texts: OrderedDict[str, str] = OrderedDict()
        self._count = 0
        self._lock = threading.Lock()

    def shown(self, kind: str, text: str, lost_bytes: int = 0) -> dict[str, Any]:
        """Return the first page of a text; if the text is longer, keep it under a name that begins with ``kind``.

        ``lost_bytes``: number of bytes at the end of the text that the caller has not kept.
        """
        whole, lost = text[:_LARGEST_KEPT], text[_LARGEST_KEPT:]
        lines = lines_of(whole)
        first, next_line = page(lines)
        result: dict[str, Any] = {"text": first}
        if next_line <= len(lines):
            result |= _rest(self._keep(kind, whole), 1, next_line, len(lines))
        if lost_bytes := lost_bytes + len(lost.encode("utf-8", "replace")):
            result["lost"] = f"the last {lost_bytes} bytes were not kept"
        return result

    def keep(self, kind: str, text: str) -> dict[str, Any]:
        """Keep a text, and return its name and its number of lines."""
        whole = text[:_LARGEST_KEPT]
        return {"name": self._keep(kind, whole), "lines": len(lines_of(whole))}

    def read(self, name: str, first_line: int) -> dict[str, Any]:
        """Return a page of a kept text. Raises InputError."""
        with self._lock:
            text = self._texts.get(name)
            known = list(self._texts)
        if text is None:
            kept = f"; the texts are {choices(known)}" if known else ""
            raise InputError(f"unknown text {shown(name)}{kept}", kind="unknown_text")
        return page_of(name, lines_of(text), first_line)

    def _keep(self, kind: str, text: str) -> str:
        with self._lock:
            self._count += 1
            name = f"{kind}-{self._count}"
            self._texts[name] = text
            while len(self._texts) > _MOST_KEPT:
                self._texts.popitem(last=False)
        return name


def page_of(name: str, lines: list[str], first_line: int) -> dict[str, Any]:
    """Return a page of the text ``name``, with the call that returns the next page. Raises InputError."""
    if not 1 <= first_line <= max(len(lines), 1):
        raise InputError(f"first_line must be from 1 to {max(len(lines), 1)}, not {first_line}")
    text, next_line = page(lines, first_line)
    result: dict[str, Any] = {"text": text}
    if next_line <= len(lines):
        result |= _rest(name, first_line, next_line, len(lines))
    return result


def _rest(name: str, first_line: int, next_line: int, count: int) -> dict[str, Any]:
    cut = f"lines {first_line} to {next_line - 1} of {count}"
    return {"cut": cut, "rest": f'read_text(name="{name}", first_line={next_line})'}
