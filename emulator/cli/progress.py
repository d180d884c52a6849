"""Progress of a long run on stderr, never in the terminal's text."""

from __future__ import annotations

import sys
from contextlib import suppress
from typing import TextIO

import click

from emulator.links.runner import Progress

_FIRST_AFTER_S = 1.0  # a short run shows nothing
_EVERY_TTY_S = 0.2
_EVERY_LOG_S = 10.0


def _is_terminal(stream: TextIO | None) -> bool:
    return stream is not None and stream.isatty()


class ProgressDisplay:
    """One line rewritten in place on a terminal; a line every ten seconds in a log.

    Nothing is rewritten in place while the board's text goes to the same terminal.
    """

    def __init__(self) -> None:
        self._in_place = _is_terminal(sys.stderr) and not _is_terminal(sys.stdout)
        self._next_s = _FIRST_AFTER_S if self._in_place else _EVERY_LOG_S
        self._shown = False

    def update(self, progress: Progress) -> None:
        """Show how far the run is, if it is time to."""
        if progress.wall_s < self._next_s:
            return
        self._next_s = progress.wall_s + (_EVERY_TTY_S if self._in_place else _EVERY_LOG_S)
        factor = progress.virtual_s / progress.wall_s
        whole = "" if progress.total_s is None else f" of {progress.total_s:.0f}"
        text = f"fcu: {progress.virtual_s:.0f}{whole} s of virtual time, {factor:.1f} x real time"
        with suppress(OSError):  # stderr may be full or gone; the run goes on
            click.echo(f"\r{text}\033[K" if self._in_place else text, err=True, nl=not self._in_place)
        self._shown = True

    def close(self) -> None:
        """Leave the line."""
        if self._shown and self._in_place:
            click.echo("\r\033[K", err=True, nl=False)
