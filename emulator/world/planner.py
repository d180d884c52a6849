"""Changing the truth: when a change takes effect, what it drops, and who hears of it."""

from __future__ import annotations

from collections.abc import Callable, Iterable

import numpy as np

from emulator.errors import InputError
from emulator.world import limits
from emulator.world.attitude import Attitude
from emulator.world.line import Line
from emulator.world.track import Array
from emulator.world.truth import Disturbance, Truth

NOW_TOLERANCE_S = 1e-9  # now comes from integer picoseconds: the same instant may differ in the last bit
HISTORY_S = 5.0  # kept behind now; sensors evaluate from about now on


class Planner(Truth):
    """A `Truth` that knows the present (``now_s``) and whose state can be changed from a time on."""

    def __init__(self, now_s: Callable[[], float], floor_altitude_m: float) -> None:
        super().__init__(floor_altitude_m)
        self._now_s = now_s
        self._listeners: list[Callable[[float], None]] = []

    def on_change(self, callback: Callable[[float], None]) -> None:
        """Call ``callback(from_s)`` after each change; no signal differs before ``from_s``."""
        self._listeners.append(callback)

    def _start(self, start_s: float | None) -> float:
        """``start_s`` checked; None is now."""
        now = self._now_s()
        if start_s is None:
            return now
        start = limits.TIME.check("start_s", start_s)
        if start < now - NOW_TOLERANCE_S:
            raise InputError(f"start_s is {start_s!r}: it is {now:g} s already, give a later time")
        return max(start, now)

    def _span(self, start_s: float | None, duration_s: float) -> tuple[float, float]:
        """Start and end, checked."""
        start = self._start(start_s)
        return start, start + limits.DURATION.check("duration_s", duration_s)

    def _rotation_at(self, t_s: float) -> Array:
        rotation: Array = self._attitude.at(t_s).rotation(np.array([t_s]))[0]
        return rotation

    def _euler_deg_at(self, t_s: float) -> Array:
        euler_deg: Array = self._attitude.at(t_s).euler_deg(np.array([t_s]))[0]
        return euler_deg

    def _height_at(self, t_s: float) -> float:
        return float(self._height.at(t_s).position_m(np.array([t_s]))[0])

    def _plan_attitude(self, *pieces: tuple[float, Attitude]) -> float:
        """Plan (start, piece) in order; the last one is at rest, and its start is the end returned."""
        for start_s, piece in pieces:
            self._attitude.plan(start_s, piece)
        self._changed(pieces[0][0], ("acc", "gyro", "mag"))
        return pieces[-1][0]

    def _plan_height(self, *pieces: tuple[float, Line]) -> float:
        """Likewise for the altitude."""
        for start_s, piece in pieces:
            self._height.plan(start_s, piece)
        self._changed(pieces[0][0], ("acc", "pressure"))
        return pieces[-1][0]

    def _disturb(self, start_s: float, end_s: float, disturbance: Disturbance) -> float:
        self._disturbances.add(start_s, end_s, disturbance)
        self._changed(start_s, ("mag",))
        return end_s

    def _changed(self, from_s: float, signals: Iterable[str]) -> None:
        """After a change to ``signals``: take them back from recordings, drop the past, tell everybody."""
        self._restore_laws(from_s, signals)
        self._forget(self._now_s() - HISTORY_S)
        for callback in self._listeners:
            callback(from_s)
