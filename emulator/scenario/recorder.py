"""What checks need of a run and the board does not keep: when each line was printed, and the truth then.

The board keeps text without times, and the world forgets its past when it is changed; so a recorder looks at
the terminal every millisecond of virtual time (SysTick's period, a fraction of a line's time on the wire),
and takes the truth of new lines once a second, well within what the world remembers. Looking changes nothing
on the board.

Decision: the terminal's length is polled. Recording every byte's event would also record every bus transfer,
a hundred times as many.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Mapping
from dataclasses import dataclass, field
from fractions import Fraction

import numpy as np

from emulator.scenario.board_view import BoardView
from emulator.scenario.printed import ANGLES, FORMATS
from emulator.scenario.truth import G_MODULUS, TRUTH, deviation
from emulator.time.clock import PS_PER_MS, PS_PER_S, Periodic
from emulator.world.track import Array

_LOOK_PS = Fraction(PS_PER_MS)
_COLLECT_PS = Fraction(PS_PER_S)
_TRUTH_STEPS = 21  # instants at which the truth is taken in a settling time
MAX_SETTLE_PS = PS_PER_S  # the world remembers five seconds


@dataclass(frozen=True)
class Line:
    """A line of the terminal: its text without blanks around it, and when its printing began."""

    number: int  # counted from 1
    text: str
    at_ps: int
    truth: Mapping[str, tuple[Array, Array]] = field(default_factory=dict)
    """For each field of interest: instants (N,) in s up to the moment of printing, and the truth (N,)."""

    def error(self, name: str, printed: float, settle_ps: int) -> float:
        """Smallest deviation from the truth of the last ``settle_ps`` before the line was printed."""
        t_s, values = self.truth[name]
        recent = values[t_s >= t_s[-1] - settle_ps / PS_PER_S - 1e-9]
        return min((deviation(name, printed, float(value)) for value in recent), key=abs)


class Recorder:
    """Watches one board until ``until_ps``; ``settle_ps`` names the fields whose truth is wanted."""

    def __init__(self, board: BoardView, until_ps: int, settle_ps: Mapping[str, int]) -> None:
        self.until_ps = until_ps
        self._world, self._uart, self._clock = board.world, board.uart, board.clock
        self._settle_ps = settle_ps
        self._lines: list[Line] = []
        self._looks: list[tuple[int, int]] = [(0, 0)]  # (bytes received, time of the look before)
        self._last_look_ps = 0
        self._collected = 0  # bytes, counted from power-on
        self._stopped = False
        self._watching = [
            Periodic(self._clock, 0, _LOOK_PS, self._look),
            Periodic(self._clock, 0, _COLLECT_PS, self._collect),
        ]
        self._clock.schedule(until_ps, self._stop, last=True)

    def lines(self) -> list[Line]:
        """The complete lines printed by now, until ``until_ps`` at the latest."""
        if not self._stopped:
            self._collect()
        return self._lines

    def _stop(self) -> None:
        self._collect()
        self._stopped = True
        for periodic in self._watching:
            periodic.cancel()

    def _look(self) -> None:
        count = self._uart.received_count()
        if count > self._looks[-1][0]:
            self._looks.append((count, self._last_look_ps))
        self._last_look_ps = self._clock.now_ps

    def _collect(self) -> None:
        self._look()
        start = max(self._collected - self._uart.dropped, 0)
        *complete, _ = bytes(self._uart.received()[start:]).split(b"\n")
        for raw in complete:
            self._add(raw, self._collected)
            self._collected += len(raw) + 1
        self._looks = [look for look in self._looks if look[0] > self._collected] or self._looks[-1:]

    def _add(self, raw: bytes, position: int) -> None:
        """One line; "\\n\\r" puts a return in front of the next line that is not its beginning."""
        begin = position + len(raw) - len(raw.lstrip(b"\r"))
        first_seen = bisect_right(self._looks, begin, key=lambda look: look[0])
        at_ps = self._looks[first_seen][1]
        text = raw.decode("latin-1").strip(" \r\t")
        self._lines.append(Line(len(self._lines) + 1, text, at_ps, self._truth(text, at_ps)))

    def _truth(self, text: str, at_ps: int) -> dict[str, tuple[Array, Array]]:
        wanted = [
            name
            for line_format in FORMATS
            if text.startswith(line_format.label)
            for name in line_format.fields
            if name in self._settle_ps
        ]
        if not ANGLES.isdisjoint(wanted):
            wanted.append(G_MODULUS)
        truth = {}
        for name in wanted:
            at_s = at_ps / PS_PER_S
            settle_s = self._settle_ps.get(name, 0) / PS_PER_S
            t_s = np.linspace(max(at_s - settle_s, 0.0), at_s, _TRUTH_STEPS)
            truth[name] = (t_s, TRUTH[name](self._world, t_s))
        return truth
