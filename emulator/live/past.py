"""States (ten per second, at most five minutes) and printed numbers, for clients that connect later."""

from __future__ import annotations

from collections import deque
from typing import Any

from fcu_emulator.emulator.live import messages

MOST_STATES = 3000
MOST_PRINTS = 1000
_EVERY_S = 0.0999  # seconds of virtual or wall time; less than 0.1, because the times of frames are not exact
_NOT_PLOTTED = frozenset({"rotation", "magnet_m"})


class Past:
    """Stored states and printed numbers of one run."""

    def __init__(self, run_number: int) -> None:
        self._run_number = run_number
        self._states: deque[dict[str, Any]] = deque(maxlen=MOST_STATES)
        self._prints: deque[dict[str, Any]] = deque(maxlen=MOST_PRINTS)
        self._kept_s = -1.0
        self._kept_wall_s = -1.0

    def add_state(self, state: messages.State, wall_s: float) -> None:
        passed_s = state.t_s - self._kept_s
        if passed_s < _EVERY_S and (passed_s <= 0 or wall_s - self._kept_wall_s < _EVERY_S):
            return
        self._kept_s, self._kept_wall_s = state.t_s, wall_s
        truth = {name: value for name, value in state.truth.items() if name not in _NOT_PLOTTED}
        plotted = {"t_s": state.t_s, "truth": truth, "samples": state.samples, "variables": state.variables}
        self._states.append(plotted)

    def add_printed(self, printed: messages.PrintedEvent) -> None:
        self._prints.append({"t_s": printed.t_s, "values": printed.values})

    def message(self) -> messages.PastEvent:
        return messages.PastEvent(self._run_number, list(self._states), list(self._prints))
