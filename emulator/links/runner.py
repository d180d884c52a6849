"""The run loop. It runs a board in short periods (slices), follows the wall clock, and serves links."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Protocol

from fcu_emulator.emulator.clock import NEVER_PS, PS_PER_S, Clock, to_ps
from fcu_emulator.emulator.links import ByteLink

# -- Virtual time against wall time -------------------------------------------------------------------------


_SLICE_WALL_S = 0.01  # wall time between two services of the links in a paced run
_SLICE_FREE_S = 0.25  # virtual time between two polls in an unpaced run
_SHORTEST_SLICE_S = 1e-5
_PATIENCE_S = 0.1  # wall time that a slice may take before the next slice is shortened
_LAG_FORGIVEN_S = 0.5


class Pacer:
    """Pacing of a run: virtual time is ``speed`` times wall time.

    If ``speed`` is None, the run never sleeps. ``slice_s``: virtual time of the next slice.
    """

    def __init__(self, speed: float | None) -> None:
        self.speed = speed
        self._longest_s = _SLICE_FREE_S if speed is None else min(speed * _SLICE_WALL_S, _SLICE_FREE_S)
        self.slice_s = min(self._longest_s, _SLICE_WALL_S)
        self._origin_wall = self._slice_began = time.monotonic()
        self._origin_virtual = 0.0

    def wait(self, now_s: float) -> None:
        took = time.monotonic() - self._slice_began
        factor = 0.25 if took > _PATIENCE_S else 2.0
        self.slice_s = max(min(self.slice_s * factor, self._longest_s), _SHORTEST_SLICE_S)
        self._sleep(now_s)
        self._slice_began = time.monotonic()

    def _sleep(self, now_s: float) -> None:
        if self.speed is None:
            return
        due = self._origin_wall + (now_s - self._origin_virtual) / self.speed
        ahead = due - time.monotonic()
        if ahead > 0:
            time.sleep(ahead)
        elif ahead < -_LAG_FORGIVEN_S:
            self._origin_wall, self._origin_virtual = time.monotonic(), now_s


# -- The run ------------------------------------------------------------------------------------------------


_TYPED_AHEAD = 4096  # maximum bytes on the way to the board; further bytes wait in their link
_FLUSH_S = 5.0  # maximum wall time for a slow reader at the end of a run


@dataclass(frozen=True)
class Progress:
    """Virtual seconds so far, virtual seconds of the whole run (None: no end), and wall seconds so far."""

    virtual_s: float
    total_s: float | None
    wall_s: float


class SerialEnd(Protocol):
    """Interface of the board's end of the serial line."""

    def since(self, position: int) -> tuple[bytes, int]: ...

    @property
    def typing_left(self) -> int: ...

    def write(self, data: bytes | str) -> None: ...


class RunnableBoard(Protocol):
    """Interface of a board, such as :class:`fcu_emulator.emulator.assembly.board.Board`."""

    clock: Clock

    @property
    def terminal(self) -> SerialEnd: ...

    def run_until_ps(self, at_ps: int) -> None: ...


class Debugger(Protocol):
    """Interface of a debugger, which may halt the board or end the run."""

    @property
    def halted(self) -> bool: ...

    @property
    def killed(self) -> bool: ...

    def run_until_ps(self, at_ps: int) -> None:
        """Run the board, or wait briefly if it is halted."""
        ...


class Runner:
    """A board's run with links until ``end_ps`` of virtual time (None: until stopped).

    ``speed``: ratio of virtual to wall time, None for no limit. If ``exceeded(wall_s)`` returns a
    text, the run ends, and the attribute ``limit`` gets this text.
    """

    def __init__(
        self,
        board: RunnableBoard,
        links: Sequence[ByteLink],
        end_ps: int | None,
        speed: float | None,
        exceeded: Callable[[float], str] = lambda _wall_s: "",
        wall_clock_s: Callable[[], float] = time.monotonic,
        debugger: Debugger | None = None,
    ) -> None:
        self._board = board
        self._links = links
        self._end_ps = end_ps
        self._pacer = Pacer(speed)
        self._exceeded = exceeded
        self._wall_clock_s = wall_clock_s
        self._debugger = debugger
        self._held_s = 0.0
        self._position = 0
        self.stopped = False
        self.limit = ""
        self.wall_s = 0.0

    def stop(self) -> None:
        self.stopped = True

    def run(self, on_progress: Callable[[Progress], None] = lambda _progress: None) -> None:
        """Run to the end. Raises FirmwareError after the links are flushed."""
        started = self._wall_clock_s()
        end_ps = NEVER_PS if self._end_ps is None else self._end_ps
        total_s = None if self._end_ps is None else self._end_ps / PS_PER_S
        clock = self._board.clock
        try:
            while clock.now_ps < end_ps and not self.stopped and not self.limit:
                self._run_until(min(clock.now_ps + to_ps(self._pacer.slice_s), end_ps))
                self._serve_links()
                self._pacer.wait(clock.now_s)
                self.wall_s = self._wall_clock_s() - started - self._held_s
                on_progress(Progress(clock.now_s, total_s, self.wall_s))
                self.limit = self._exceeded(self.wall_s)
        finally:
            self._serve_links()
            for link in self._links:
                link.flush(_FLUSH_S)

    def _run_until(self, at_ps: int) -> None:
        debugger = self._debugger
        if debugger is None:
            self._board.run_until_ps(at_ps)
            return
        began_s = self._wall_clock_s()
        debugger.run_until_ps(at_ps)
        self.stopped |= debugger.killed
        if debugger.halted:
            self._held_s += self._wall_clock_s() - began_s

    def _serve_links(self) -> None:
        printed, self._position = self._board.terminal.since(self._position)
        for link in self._links:
            link.send(printed)
            room = _TYPED_AHEAD - self._board.terminal.typing_left
            typed = link.receive(room) if room > 0 else b""
            if typed:
                self._board.terminal.write(typed)
