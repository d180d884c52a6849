"""A run as the command line does it: the board in slices, its serial links served between them.

Wall time exists only here and in :mod:`emulator.pacing`. Input from a link reaches the board between two
slices; apart from that, what is printed does not depend on how the run is sliced.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from emulator.board import Board
from emulator.clock import NEVER_PS, to_ps
from emulator.errors import FirmwareError
from emulator.links import ByteLink
from emulator.pacing import Pacer

_FLUSH_S = 5.0  # how long a slow reader gets at the end to take what is queued


@dataclass(frozen=True)
class Progress:
    """How far a run is: virtual seconds done and to do (None: no end), and wall seconds spent."""

    virtual_s: float
    total_s: float | None
    wall_s: float


class Runner:
    """Runs a board for ``duration_s`` of virtual time (None: until stopped) and serves its links.

    ``speed``: virtual over wall time, None for as fast as possible. ``wall_limit_s`` ends a run that takes
    longer with FirmwareError. ``stop()`` ends it after the present slice, from a signal handler too.
    """

    def __init__(
        self,
        board: Board,
        links: Sequence[ByteLink],
        duration_s: float | None,
        speed: float | None,
        wall_limit_s: float | None = None,
    ) -> None:
        self._board = board
        self._links = links
        self._duration_s = duration_s
        self._pacer = Pacer(speed)
        self._wall_limit_s = wall_limit_s
        self._position = 0
        self._stopped = False
        self.wall_s = 0.0

    def stop(self) -> None:
        """End the run soon."""
        self._stopped = True

    def run(self, on_progress: Callable[[Progress], None] = lambda _progress: None) -> None:
        """Run to the end. Raises FirmwareError; the links have had their bytes then, too."""
        started = time.monotonic()
        end_ps = NEVER_PS if self._duration_s is None else to_ps(self._duration_s)
        slice_ps = to_ps(self._pacer.slice_s)
        clock = self._board.clock
        try:
            while clock.now_ps < end_ps and not self._stopped:
                self._board.run_until(min(clock.now_ps + slice_ps, end_ps))
                self._serve_links()
                self._pacer.wait(clock.now_s)
                self.wall_s = time.monotonic() - started
                on_progress(Progress(clock.now_s, self._duration_s, self.wall_s))
                self._check_limit()
        finally:
            self._serve_links()
            for link in self._links:
                link.flush(_FLUSH_S)

    def _check_limit(self) -> None:
        if self._wall_limit_s is not None and self.wall_s > self._wall_limit_s:
            raise FirmwareError(
                f"the run took longer than its limit of {self._wall_limit_s:g} s of wall time "
                f"and was stopped at {self._board.now_s:.3f} s of virtual time"
            )

    def _serve_links(self) -> None:
        printed, self._position = self._board.terminal.since(self._position)
        for link in self._links:
            link.send(printed)
            typed = link.receive()
            if typed:
                self._board.terminal.write(typed)
