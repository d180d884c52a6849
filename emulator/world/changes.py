"""Changes of the world: start times, planned motions that a change discards, and callbacks to observers."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from itertools import pairwise

import numpy as np
import numpy.typing as npt

from fcu_emulator.emulator.clock import Clock
from fcu_emulator.emulator.errors import InputError
from fcu_emulator.emulator.world import limits
from fcu_emulator.emulator.world.air import Drift
from fcu_emulator.emulator.world.attitude import Attitude
from fcu_emulator.emulator.world.follow import FollowedAttitude, FollowedHeight
from fcu_emulator.emulator.world.position import Coordinate
from fcu_emulator.emulator.world.track import Array, Constant, Track
from fcu_emulator.emulator.world.truth import Disturbance, Truth

NOW_TOLERANCE_S = 1e-9  # tolerance for rounding, because the present is an integer number of picoseconds
ZURICH_ALTITUDE_M = 408.0
TURNED_SIGNALS = ("acc", "gyro", "mag")  # signals that change when the board turns


class Changes(Truth):
    """The truth, with motions that are planned from the present time of ``clock``."""

    def __init__(self, clock: Clock | None = None, floor_altitude_m: float = ZURICH_ALTITUDE_M) -> None:
        super().__init__(floor_altitude_m)
        self._clock = clock or Clock()
        self._listeners: list[Callable[[float], None]] = []

    def on_change(self, callback: Callable[[float], None]) -> None:
        """Call ``callback(from_s)`` after each change. The change does not affect signals before ``from_s``."""
        self._listeners.append(callback)

    def _set(
        self, track: Track[Constant] | Track[Constant | Drift], value: npt.ArrayLike, *signals: str
    ) -> None:
        now = self._clock.now_s
        track.plan(now, Constant(value))
        for signal in signals:
            self._agitation[signal].add(now, now)
        self._changed(now, signals)

    def _start(self, start_s: float | None) -> float:
        now = self._clock.now_s
        if start_s is None:
            return now
        start = limits.TIME.check("start_s", start_s)
        if start < now - NOW_TOLERANCE_S:
            problem = f"start_s must be at least {now:g} s, the current time, not {start_s!r}"
            raise InputError(problem, kind="past")
        return max(start, now)

    def _span(self, start_s: float | None, duration_s: float) -> tuple[float, float]:
        start = self._start(start_s)
        return start, start + limits.DURATION.check("duration_s", duration_s)

    def _rotation_at(self, t_s: float) -> Array:
        rotation: Array = self._attitude.at(t_s).rotation(np.array([t_s]))[0]
        return rotation

    def _euler_deg_at(self, t_s: float) -> Array:
        euler_deg: Array = self._attitude.at(t_s).euler_deg(np.array([t_s]))[0]
        return euler_deg

    def _plan_attitude(self, *pieces: tuple[float, Attitude]) -> float:
        for start_s, piece in pieces:
            self._attitude.plan(start_s, piece)
        self._agitate(pieces, TURNED_SIGNALS)
        self._changed(pieces[0][0], TURNED_SIGNALS)
        return pieces[-1][0]

    def _plan_height(self, *pieces: tuple[float, Coordinate]) -> float:
        return self._plan_position(self._height, *pieces)

    def _plan_position(self, track: Track[Coordinate], *pieces: tuple[float, Coordinate]) -> float:
        signals = ("acc", "pressure") if track is self._height else ("acc",)
        for start_s, piece in pieces:
            track.plan(start_s, piece)
        self._agitate(pieces, (*signals, "mag"))  # the field may vary with the board's position
        self._changed(pieces[0][0], signals)
        return pieces[-1][0]

    def _agitate(self, pieces: Sequence[tuple[float, Attitude | Coordinate]], signals: Iterable[str]) -> None:
        """Mark signals as moving during the pieces. All pieces begin with a jump, except pieces that follow a hand."""
        for signal in signals:
            agitation = self._agitation[signal]
            for (start_s, piece), (end_s, _) in pairwise(pieces):
                agitation.add(start_s, end_s, piece.pace_s)
            if not isinstance(pieces[0][1], FollowedAttitude | FollowedHeight):
                for start_s, _ in pieces:
                    agitation.add(start_s, start_s)

    def _disturb(self, start_s: float, end_s: float, disturbance: Disturbance) -> float:
        self._disturbances.add(start_s, end_s, disturbance)
        mag = self._agitation["mag"]
        mag.add(start_s, end_s, disturbance.pace_s)
        mag.add(start_s, start_s)
        mag.add(end_s, end_s)
        self._changed(start_s, ("mag",))
        return end_s

    def _changed(self, from_s: float, signals: Iterable[str]) -> None:
        """Apply a change of ``signals``: stop the replay of these signals from recordings, and call the observers."""
        self._clock.inputs += 1
        self._restore_laws(from_s, signals)
        self._bound_history(self._clock.now_s)
        for callback in self._listeners:
            callback(from_s)


def position_at(track: Track[Coordinate], t_s: float) -> float:
    """Return the coordinate of the position on ``track`` at ``t_s``."""
    return float(track.at(t_s).position_m(np.array([t_s]))[0])
