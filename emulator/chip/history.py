"""The history of a board: snapshots from which the board repeats its past.

Decision: the run between two snapshots has no input, because each input is followed by a snapshot. A repetition is
therefore exact. Inputs are changes of the world, pins, typed bytes, bus faults and changes by a debugger.

Decision: while a board repeats its past, trace files, subscribers and links receive nothing, because they have
received it before. A new input in the past discards the later history.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, ClassVar, Protocol

from fcu_emulator.emulator.buses.uart import Uart
from fcu_emulator.emulator.chip.cpu.core import RESETS_KEPT
from fcu_emulator.emulator.chip.firmware import ArmFirmware, Limits
from fcu_emulator.emulator.clock import PS_PER_MS, PS_PER_S, Clock
from fcu_emulator.emulator.trace import Trace

_SPACING_PS = 250 * PS_PER_MS
_NO_LIMITS = Limits(
    instructions=1 << 62,
    terminal_bytes=1 << 62,
    resets_per_s=RESETS_KEPT - 1,
    wall_s=math.inf,
    work_per_s=1 << 62,
)
_MOST = 56
"""Maximum number of snapshots in memory: about 64 MB, with 1.2 MB each."""


class PrintingEnd(Protocol):
    """A terminal."""

    uart: Uart

    @property
    def position(self) -> int: ...


class RestorableBoard(Protocol):
    """A board such as :class:`fcu_emulator.emulator.assembly.board.Board`."""

    clock: Clock
    trace: Trace

    @property
    def terminal(self) -> PrintingEnd: ...

    def run_until_ps(self, at_ps: int) -> None: ...

    def snapshot(self) -> Any: ...

    def restore(self, snapshot: Any) -> None: ...


@dataclass(frozen=True, slots=True)
class Moment:
    """A snapshot. ``has_input``: an input came before the snapshot, at the same time."""

    at_ps: int
    snapshot: Any
    has_input: bool


class History:
    """Runs a board with firmware for the chip, and keeps its history, which begins now.

    A snapshot is taken every 250 ms of virtual time and after each input. Older snapshots are farther apart.
    """

    in_snapshots: ClassVar[bool] = False

    def __init__(self, board: RestorableBoard, firmware: ArmFirmware) -> None:
        self._board = board
        self._firmware = firmware
        self._core = firmware.core
        self._clock = board.clock
        self._moments: list[Moment] = []
        self._present_ps = 0
        self._inputs_seen = 0  # number of inputs of the clock, after the latest run
        self._printed = 0  # number of bytes printed up to the present
        self._remark = ""
        self.inputs = 0
        """Number of inputs in the history so far."""
        self._keep(has_input=True)

    @property
    def is_past(self) -> bool:
        """Whether the board's time is earlier than the end of its history."""
        return self._clock.now_ps < self._present_ps

    def take_remark(self) -> str:
        """Return and clear the text that says which part of the history was discarded, or ""."""
        remark, self._remark = self._remark, ""
        return remark

    def close(self) -> None:
        """Continue from the current time without a history. The board prints the later text again."""
        if self.is_past:
            self._board.terminal.uart.skip_numbers(self._printed)
        self._moments.clear()
        self._board.trace.replaying = False

    # -- forwards ---------------------------------------------------------------------------------------

    def run_until_ps(self, at_ps: int) -> None:
        """Run up to and including ``at_ps``, or until a debugger halts the core. Raises FirmwareError."""
        if self._clock.inputs != self._inputs_seen:
            self.add_input()
        while True:
            now_ps = self._clock.now_ps
            later = self._input_after(now_ps)
            stop_ps = min(at_ps, self._next_stop_ps(now_ps), later.at_ps if later else at_ps)
            self._run_until_ps(stop_ps)
            has_halted = self._clock.now_ps < stop_ps
            if later and self._clock.now_ps >= later.at_ps:
                self._apply(later)
            self._arrive()
            if has_halted or stop_ps >= at_ps:
                return

    def _run_until_ps(self, at_ps: int) -> None:
        """Run without limits in the past, because the run has already passed their checks."""
        limits = self._firmware.limits
        if self.is_past:
            self._firmware.limits = _NO_LIMITS
        try:
            self._board.run_until_ps(at_ps)
        finally:
            self._firmware.limits = limits
            self._inputs_seen = self._clock.inputs
            self._present_ps = max(self._present_ps, self._clock.now_ps)

    def add_input(self) -> None:
        """Take a snapshot after an input. If the board is in the past, discard the later history."""
        now_ps = self._clock.now_ps
        self.inputs += 1
        if self.is_past:
            self._remark = (
                f"the past has changed at {now_ps / PS_PER_S:.6f} s: the run from there to "
                f"{self._present_ps / PS_PER_S:.6f} s is discarded, but its output remains in files and terminals\n"
            )
            self._moments = [one for one in self._moments if one.at_ps <= now_ps]
            self._board.terminal.uart.skip_numbers(self._printed)
        self._keep(has_input=True)

    def _next_stop_ps(self, now_ps: int) -> int:
        if self.is_past:
            return self._present_ps
        return max(self._moments[-1].at_ps + _SPACING_PS, now_ps)

    def _input_after(self, now_ps: int) -> Moment | None:
        return next((one for one in self._moments if one.has_input and one.at_ps > now_ps), None)

    def _apply(self, moment: Moment) -> None:
        """Restore the state after an input. The core continues in the same way: halted, stepping or running."""
        is_halted, is_stepping = self._core.halted, self._core.stepping
        self._restore(moment)
        if is_halted:
            self._core.halt()
        else:
            self._core.resume(is_stepping)

    def _arrive(self) -> None:
        """At the end of the history, send events to observers again, and take a snapshot if one is due."""
        if self.is_past:
            return
        if self._board.trace.replaying:
            self._core.settle()  # observers have received these events
            self._board.trace.replaying = False
        if self._present_ps >= self._moments[-1].at_ps + _SPACING_PS:
            self._keep(has_input=False)

    # -- backwards --------------------------------------------------------------------------------------

    def moments_before(self, at_ps: int) -> list[Moment]:
        """Return the snapshots before a time, the latest first."""
        return [one for one in reversed(self._moments) if one.at_ps < at_ps]

    def moment(self) -> Moment:
        """Return the current state, which the history does not keep."""
        return Moment(self._clock.now_ps, self._board.snapshot(), has_input=False)

    def return_to(self, moment: Moment) -> None:
        """Restore a moment of the past. The core is then halted."""
        if not self.is_past:
            self._core.settle()  # observers receive all events of the present
            self._present_ps = self._clock.now_ps
            self._printed = self._board.terminal.position
        self._board.trace.replaying = True
        self._restore(moment)
        self._core.halt()
        self._board.trace.replaying = self.is_past

    def _restore(self, moment: Moment) -> None:
        self._board.restore(moment.snapshot)
        self._inputs_seen = self._clock.inputs

    # -- snapshots --------------------------------------------------------------------------------------

    def _keep(self, *, has_input: bool) -> None:
        """Take a snapshot of the present."""
        now_ps = self._present_ps = self._clock.now_ps
        self._board.trace.replaying = False
        self._inputs_seen = self._clock.inputs
        if self._moments and self._moments[-1].at_ps == now_ps:
            has_input |= self._moments.pop().has_input
        self._moments.append(Moment(now_ps, self._board.snapshot(), has_input))
        if len(self._moments) > _MOST:
            self._forget_one()

    def _forget_one(self) -> None:
        """Forget the snapshot whose neighbours are closest for its age, or the oldest one after many inputs."""
        times = [one.at_ps for one in self._moments]
        candidates = [n for n in range(1, len(times) - 1) if not self._moments[n].has_input]
        del self._moments[min(candidates, key=lambda n: _distance(times, n), default=0)]


def _distance(times: Sequence[int], index: int) -> float:
    """Return the distance of a snapshot's neighbours, divided by its age."""
    return (times[index + 1] - times[index - 1]) / (times[-1] - times[index])
