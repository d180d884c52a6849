"""Explaining a firmware that hangs or has crashed: at once while somebody watches, and at the end of the run.

The terminal's silence is what a user notices, so that is what asks the question: after three virtual seconds
without a byte, and, when the answer is that nothing is wrong, again after twice the time.
"""

from __future__ import annotations

from collections.abc import Callable

from emulator.board.board import Board
from emulator.errors import FirmwareError

_FIRST_QUESTION_S = 3.0


class Explainer:
    """Watches one run of a board. ``say`` gets the lines of an explanation."""

    def __init__(self, board: Board, say: Callable[[str], None]) -> None:
        self._board = board
        self._say = say
        self._told = ""
        self._printed = 0
        self._silent_since_s = 0.0
        self._patience_s = _FIRST_QUESTION_S

    def look(self) -> None:
        """Between two slices: has the firmware been silent for long, and can it never speak again?"""
        board = self._board
        if board.arm is None:
            return
        printed = board.uart.received_count()
        if printed != self._printed:
            self._printed, self._silent_since_s = printed, board.now_s
            self._patience_s = _FIRST_QUESTION_S
        elif board.now_s - self._silent_since_s >= self._patience_s:
            self._patience_s *= 2
            diagnosis = board.arm.diagnosis()
            if diagnosis is not None and diagnosis.fatal:
                self._tell(str(diagnosis))

    def conclude(self) -> None:
        """At the end of the run. Raises FirmwareError when the firmware has failed for good."""
        if self._board.arm is None:
            return
        diagnosis = self._board.arm.diagnosis()
        if diagnosis is None:
            return
        if not diagnosis.fatal:
            self._tell(str(diagnosis))
        elif self._told:
            raise FirmwareError(diagnosis.summary)
        else:
            raise FirmwareError(str(diagnosis))

    def _tell(self, text: str) -> None:
        if not self._told:
            for line in text.splitlines():
                self._say(line)
        self._told = text
