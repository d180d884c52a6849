"""One quantity over time: the pieces of a track, overlays on it, and the pace of a motion.

A constant result has one row, so that a world at rest is cheap. A hand's motion has minimum jerk (Flash and
Hogan, J. Neurosci. 5, 1985).

Decision: a piece of a track is active until the next one starts, and planning a piece discards later plans.
"""

from __future__ import annotations

import math
from bisect import bisect_left, bisect_right
from collections.abc import Callable
from dataclasses import dataclass
from typing import Generic, Protocol, TypeVar

import numpy as np
import numpy.typing as npt

# -- Consecutive pieces -------------------------------------------------------------------------------------


Array = npt.NDArray[np.float64]
P = TypeVar("P")


class Track(Generic[P]):
    """Consecutive pieces of one quantity; ``first`` applies to all earlier times."""

    def __init__(self, first: P) -> None:
        self._starts = [-math.inf]
        self._pieces = [first]

    def at(self, t_s: float) -> P:
        return self._pieces[bisect_right(self._starts, t_s) - 1]

    @property
    def last(self) -> P:
        return self._pieces[-1]

    def plan(self, start_s: float, piece: P) -> None:
        keep = bisect_left(self._starts, start_s)
        del self._starts[keep:], self._pieces[keep:]
        self._starts.append(start_s)
        self._pieces.append(piece)

    def forget(self, before_s: float) -> None:
        old = bisect_right(self._starts, before_s) - 1
        if old > 0:
            del self._starts[:old], self._pieces[:old]
            self._starts[0] = -math.inf

    def evaluate(self, t_s: Array, function: Callable[[P, Array], Array]) -> Array:
        """Return ``function(piece, t_s)`` of the pieces active at ``t_s`` (N,)."""
        if len(self._pieces) == 1 or t_s.size == 0:
            return function(self._pieces[-1], t_s)
        first = bisect_right(self._starts, t_s.min()) - 1
        last = bisect_right(self._starts, t_s.max()) - 1
        if first == last:
            return function(self._pieces[first], t_s)
        index = np.searchsorted(self._starts[first + 1 : last + 1], t_s, side="right")
        parts = []
        for offset in np.unique(index):
            here = index == offset
            parts.append((here, function(self._pieces[first + offset], t_s[here])))
        values = np.empty((t_s.size, *parts[0][1].shape[1:]))
        for here, part in parts:
            values[here] = part
        return values


class Constant:
    """A constant value of shape S as a piece, (1, *S)."""

    pace_s = math.inf

    def __init__(self, value: npt.ArrayLike) -> None:
        self._value = np.array(value, dtype=np.float64)[np.newaxis]

    def value(self, _t_s: Array, /) -> Array:
        return self._value


# -- Events that add up -------------------------------------------------------------------------------------


class Overlays(Generic[P]):
    """Events with start and end whose vectors (N, width) are summed."""

    def __init__(self, width: int = 3) -> None:
        self._width = width
        self._events: list[tuple[float, float, P]] = []

    def add(self, start_s: float, end_s: float, event: P) -> None:
        self._events.append((start_s, end_s, event))

    def forget(self, before_s: float) -> None:
        if self._events:
            self._events = [event for event in self._events if event[1] >= before_s]

    def total(self, t_s: Array, function: Callable[[P, Array], Array]) -> Array:
        total = np.zeros((1, self._width))
        for start_s, end_s, event in self._events:
            here = (t_s >= start_s) & (t_s < end_s)
            if here.any():
                total = np.array(np.broadcast_to(total, (t_s.size, self._width)))
                total[here] += function(event, t_s[here])
        return total


class Agitation:
    """Intervals in which a quantity jumps or moves fast, so that sensors sample densely."""

    def __init__(self) -> None:
        self._motions: list[tuple[float, float, float]] = []

    def add(self, start_s: float, end_s: float, pace_s: float = 0.0) -> None:
        """Add a motion; ``pace_s``: seconds from one rest to another, 0 for jumps."""
        if end_s <= 0.0:
            return
        if self._motions:  # following a hand at 50 commands per second is one motion
            first_s, last_s, pace = self._motions[-1]
            if pace == pace_s and first_s <= start_s <= last_s:
                self._motions[-1] = first_s, max(last_s, end_s), pace_s
                return
        self._motions.append((start_s, end_s, pace_s))

    def end(self, end_s: float, pace_s: float) -> None:
        for number, (start_s, end, pace) in enumerate(self._motions):
            if end == math.inf and pace == pace_s:
                self._motions[number] = min(start_s, end_s), end_s, pace_s

    def forget(self, before_s: float) -> None:
        if self._motions:
            self._motions = [motion for motion in self._motions if motion[1] >= before_s]

    def rests(self, from_s: float, to_s: float) -> bool:
        return not any(start_s <= to_s and end_s >= from_s for start_s, end_s, _ in self._motions)

    def between(self, from_s: float, to_s: float, pace_s: float) -> list[tuple[float, float]]:
        return [
            (start_s, end_s)
            for start_s, end_s, taken_s in self._motions
            if taken_s < pace_s and start_s <= to_s and end_s >= from_s
        ]


# -- The pace of a motion: progress from 0 to 1, and its exact derivatives in time --------------------------


class MotionProfile(Protocol):
    """Progress of a motion from 0 to 1; ``t_s`` (N,) -> (N,)."""

    @property
    def duration_s(self) -> float: ...

    def progress(self, t_s: Array) -> Array: ...

    def speed(self, t_s: Array) -> Array: ...

    def acceleration(self, t_s: Array) -> Array: ...


@dataclass(frozen=True)
class Linear:
    """Constant speed: it starts and stops with a jump."""

    start_s: float
    duration_s: float

    def progress(self, t_s: Array) -> Array:
        return np.clip((t_s - self.start_s) / self.duration_s, 0.0, 1.0)

    def speed(self, t_s: Array) -> Array:
        return np.full(t_s.shape, 1.0 / self.duration_s)

    def acceleration(self, t_s: Array) -> Array:
        return np.zeros(t_s.shape)


@dataclass(frozen=True)
class MinimumJerk:
    """10 u^3 - 15 u^4 + 6 u^5 of u = (t - start) / duration."""

    start_s: float
    duration_s: float

    def progress(self, t_s: Array) -> Array:
        u = self._u(t_s)
        return u * u * u * (10.0 - 15.0 * u + 6.0 * u * u)

    def speed(self, t_s: Array) -> Array:
        rest = self._u(t_s)
        rest *= 1.0 - rest
        return 30.0 / self.duration_s * rest * rest

    def acceleration(self, t_s: Array) -> Array:
        u = self._u(t_s)
        return 60.0 / self.duration_s**2 * u * (1.0 - u) * (1.0 - 2.0 * u)

    def _u(self, t_s: Array) -> Array:
        return np.clip((t_s - self.start_s) / self.duration_s, 0.0, 1.0)
