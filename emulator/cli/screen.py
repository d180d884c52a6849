"""Colours and progress of the command line on a terminal.

Pipes, files and logs get plain text. The environment variable ``NO_COLOR`` (https://no-color.org)
and ``TERM=dumb`` turn colours off.

Decision: the progress line has a thread, so that the time is updated even during long steps and
while other programs run. Calls from each command's loop were rejected, because a loop makes no calls during a long
step.
"""

from __future__ import annotations

import os
import sys
import textwrap
import threading
import time
from contextlib import suppress
from typing import Any, Final, Literal, Protocol, Self, TextIO, TypeAlias

import click

from fcu_emulator.emulator.cli.exit_codes import ExitCode
from fcu_emulator.emulator.text import visible

_LOCK: Final = threading.RLock()
"""Lock for drawing and erasing the progress line, and for printing another line instead."""
WIDTH: Final = 98
"""Longest line of wrapped text, in columns."""
Look: TypeAlias = Literal["pass", "fail", "warning", "heading"]
_LOOKS: Final[dict[Look, dict[str, Any]]] = {
    "pass": {"fg": "green"},
    "fail": {"fg": "red"},
    "warning": {"fg": "yellow"},
    "heading": {"bold": True},
}
_FIRST_AFTER_S = 1.0  # a short command shows no progress
_EVERY_S = 0.2
_LONGEST = 78  # characters; a longer progress line would be wrapped, and could not be erased


def is_terminal(stream: TextIO | None) -> bool:
    """Return whether a stream is a terminal that can show colours and erase a line."""
    return stream is not None and stream.isatty() and os.environ.get("TERM") != "dumb"


def mark_of(code: ExitCode) -> tuple[Look, str]:
    """Return the colour and the mark of a verdict."""
    if code == ExitCode.NOT_JUDGED:
        return "warning", "----"
    return ("pass", "PASS") if code == ExitCode.PASSED else ("fail", "FAIL")


def paint(text: str, look: Look | None, *, err: bool = False) -> str:
    """Return ``text`` with a colour if the stream (stdout, or stderr with ``err``) shows colours."""
    coloured = is_terminal(sys.stderr if err else sys.stdout) and not os.environ.get("NO_COLOR")
    return click.style(text, **_LOOKS[look]) if look is not None and coloured else text


def wrapped(text: str, width: int = WIDTH, hang: int = 4) -> list[str]:
    """Return untrusted text as lines, with escapes for control characters.

    Lines after the first are indented by ``hang`` more characters. Long words are not broken.
    """
    text = visible(text, lines=True)
    indent = " " * (len(text) - len(text.lstrip()) + hang)
    lines = textwrap.wrap(
        text, width, subsequent_indent=indent, break_long_words=False, break_on_hyphens=False
    )
    return lines or [""]


class Say(Protocol):
    """A function that prints a line, such as :func:`say`."""

    def __call__(self, line: str, look: Look | None = None) -> None:
        """Print a line for the user."""
        ...


def say(line: str, look: Look | None = None, mark: str = "", *, wrap: bool = True) -> None:
    """Print a line on stderr with the prefix ``fcu:``. Control characters become escapes.

    ``mark``, such as "FAIL", begins the line. In this case only the mark has the colour ``look``. A terminal
    wraps long lines, unless ``wrap`` is False.
    """
    text = visible(line)
    first = f"fcu: {mark} " if mark else "fcu: "
    lines = wrapped(text, WIDTH - len(first)) if wrap and is_terminal(sys.stderr) else [text]
    lines = [paint(one, None if mark else look, err=True) for one in lines]
    if mark:
        lines[0] = f"{paint(mark, look, err=True)} {lines[0]}"
    for one in lines:
        _print_err(f"fcu: {one}")


def gap() -> None:
    """Print an empty line on stderr."""
    _print_err("")


class ProgressLine:
    """A context that shows a line on stderr with ``text`` and the elapsed time.

    The line appears after one second, only on a terminal. ``visible_if``: a further condition.
    """

    _current: ProgressLine | None = None

    def __init__(self, text: str, *, visible_if: bool = True) -> None:
        self.text = text
        self._shown = False
        self._over = threading.Event()
        self._thread: threading.Thread | None = None
        if visible_if and is_terminal(sys.stderr):
            self._thread = threading.Thread(target=self._show_until_over, daemon=True)

    def __enter__(self) -> Self:
        self.start()
        return self

    def __exit__(self, *exception: object) -> None:
        self.end()

    def start(self) -> None:
        """Begin to measure the time."""
        if self._thread is not None:
            ProgressLine._current = self
            self._thread.start()

    def end(self) -> None:
        """Erase the line and stop the display."""
        ProgressLine._current = None
        self._over.set()
        if self._thread is not None:
            self._thread.join()
        self.erase()

    def erase(self) -> None:
        """Erase the line, so that other text can be printed."""
        with _LOCK:
            if self._shown:
                _write("\r\033[K")
            self._shown = False

    def _show_until_over(self) -> None:
        began_s, wait_s = time.monotonic(), _FIRST_AFTER_S
        while not self._over.wait(wait_s):
            wait_s = _EVERY_S
            elapsed = f", {time.monotonic() - began_s:.0f} s"
            line = visible(self.text)[: _LONGEST - len(elapsed)] + elapsed
            with _LOCK:
                self._shown = True
                _write(f"\r{line}\033[K")


def _print_err(line: str) -> None:
    with _LOCK:
        if ProgressLine._current is not None:
            ProgressLine._current.erase()
        with suppress(OSError, ValueError):  # stderr may be full or closed; the command continues
            click.echo(line, err=True)


def _write(text: str) -> None:
    with suppress(OSError):
        click.echo(text, err=True, nl=False)
