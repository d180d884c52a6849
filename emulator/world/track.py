"""One quantity over time: the pieces of its track, overlays that are added to it, and the pace of a motion.

A constant result has one row, so that a motionless world needs little time. A hand's motion has minimum jerk (Flash and
Hogan, J. Neurosci. 5, 1985).

Decision: a piece of a track is active until the next piece starts, and planning a piece discards later plans.
"""

from __future__ import annotations

import math
from bisect import bisect_left, bisect_right
from collections.abc import Callable
from dataclasses import dataclass
from typing import Generic, NamedTuple, Protocol, TypeVar

import numpy as np
import numpy.typing as npt

from fcu_emulator.emulator.errors import InputError

# -- Consecutive pieces -------------------------------------------------------------------------------------


Array = npt.NDArray[np.float64]
P = TypeVar("P")


def not_kept(t_s: float, oldest_s: float) -> InputError:
    """Return the error for a time whose history was dropped."""
    return InputError(
        f"the state of the world at {t_s:g} s is no longer stored: the oldest stored time is {oldest_s:g} s",
        kind="not_kept",
    )


class Track(Generic[P]):
    """Consecutive pieces of one quantity; ``first`` applies to all earlier times."""

    def __init__(self, first: P) -> None:
        self._starts = [-math.inf]
        self._pieces = [first]

    def __len__(self) -> int:
        return len(self._pieces)

    @property
    def middle_s(self) -> float:
        """Time before which half of the pieces started."""
        return self._starts[len(self._starts) // 2]

    def at(self, t_s: float) -> P:
        """Return the piece active at ``t_s``. Raises InputError if the piece was dropped."""
        return self._pieces[self._index(t_s)]

    def _index(self, t_s: float) -> int:
        index = bisect_right(self._starts, t_s) - 1
        if index < 0:
            raise not_kept(t_s, self._starts[0])
        return index

    @property
    def last(self) -> P:
        return self._pieces[-1]

    def plan(self, start_s: float, piece: P) -> None:
        keep = bisect_left(self._starts, start_s)
        del self._starts[keep:], self._pieces[keep:]
        self._starts.append(start_s)
        self._pieces.append(piece)

    def forget(self, before_s: float) -> None:
        """Drop the pieces that ended before ``before_s``. A query for a time before the oldest remaining
        piece raises an error."""
        old = bisect_right(self._starts, before_s) - 1
        if old > 0:
            del self._starts[:old], self._pieces[:old]

    def evaluate(self, t_s: Array, function: Callable[[P, Array], Array]) -> Array:
        """Return ``function(piece, t_s)`` of the active pieces at ``t_s`` (N,): N rows, or 1 if constant.

        Raises InputError for a time whose piece was dropped.
        """
        if (len(self._pieces) == 1 and self._starts[0] == -math.inf) or t_s.size == 0:
            return function(self._pieces[-1], t_s)
        first = self._index(t_s.min())
        last = self._index(t_s.max())
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
    """A piece with a constant value of shape S; results have the shape (1, *S)."""

    pace_s = math.inf

    def __init__(self, value: npt.ArrayLike) -> None:
        self._value = np.array(value, dtype=np.float64)[np.newaxis]

    def value(self, _t_s: Array, /) -> Array:
        return self._value


# -- Events that add up -------------------------------------------------------------------------------------


class Span(NamedTuple, Generic[P]):
    """An event with its times; ``number`` counts the events in the order in which they were added."""

    end_s: float
    number: int
    start_s: float
    event: P


class Spans(Generic[P]):
    """Events with a start and an end. Finding events by time is fast even with many past events."""

    def __init__(self) -> None:
        self._recent: list[Span[P]] = []
        self._past: list[Span[P]] = []  # in the order of their ends; all ended before the recent events
        self._count = 0
        self._oldest_s = -math.inf

    def __len__(self) -> int:
        return len(self._recent) + len(self._past)

    @property
    def middle_s(self) -> float:
        """Time before which half of the past events ended."""
        return self._past[len(self._past) // 2].end_s if self._past else -math.inf

    def add(self, start_s: float, end_s: float, event: P) -> None:
        """Add ``event`` for ``start_s`` <= t < ``end_s``."""
        self._count += 1
        self._recent.append(Span(end_s, self._count, start_s, event))

    def settle(self, before_s: float) -> None:
        """Move the events that ended before ``before_s`` to the past. ``before_s`` must not decrease between calls."""
        ended = [span for span in self._recent if span.end_s < before_s]
        if ended:
            self._past += sorted(ended, key=_order)
            self._recent = [span for span in self._recent if span.end_s >= before_s]

    def forget(self, before_s: float) -> None:
        """Drop the past events that ended before ``before_s``. From now on, a query for an earlier time
        raises an error."""
        old = bisect_left(self._past, before_s, key=_end)
        if old:
            self._oldest_s = before_s
            del self._past[:old]

    def between(self, from_s: float, to_s: float) -> list[Span[P]]:
        """Return the events that are active at these times, in the order in which they were added.

        Raises InputError if some of these events may have been dropped.
        """
        if from_s < self._oldest_s:
            raise not_kept(from_s, self._oldest_s)
        found = [span for span in self._recent if span.start_s <= to_s and span.end_s >= from_s]
        if self._past and self._past[-1].end_s >= from_s:
            late = self._past[bisect_left(self._past, from_s, key=_end) :]
            found = sorted(found + [span for span in late if span.start_s <= to_s], key=_number)
        return found


def _end(span: Span[P]) -> float:
    return span.end_s


def _number(span: Span[P]) -> int:
    return span.number


def _order(span: Span[P]) -> tuple[float, int]:
    return span.end_s, span.number


class Overlays(Spans[P]):
    """Events whose vectors (N, ``width``) are added."""

    def __init__(self, width: int = 3) -> None:
        super().__init__()
        self._width = width

    def total(self, t_s: Array, function: Callable[[P, Array], Array]) -> Array:
        total = np.zeros((1, self._width))
        if not self._count or t_s.size == 0:
            return total
        for end_s, _, start_s, event in self.between(t_s.min(), t_s.max()):
            here = (t_s >= start_s) & (t_s < end_s)
            if here.any():
                total = np.array(np.broadcast_to(total, (t_s.size, self._width)))
                total[here] += function(event, t_s[here])
        return total


class Agitation(Spans[float]):
    """Intervals in which a quantity jumps or moves fast, so that sensors must sample densely.

    Each event is the pace of a motion: its duration in s from rest to rest, or 0 for a jump.
    """

    def add(self, start_s: float, end_s: float, event: float = 0.0) -> None:
        """Add a motion with the pace ``event`` from ``start_s`` to ``end_s``; the default is the pace of jumps.

        A jump at the beginning of the world is ignored, because the new state also applies before the jump.
        """
        if end_s <= 0.0:
            return
        if self._recent:  # the commands of a hand, 50 per second, are merged into one motion
            last = self._recent[-1]
            if last.event == event and last.start_s <= start_s <= last.end_s:
                self._recent[-1] = last._replace(end_s=max(last.end_s, end_s))
                return
        super().add(start_s, end_s, event)

    def end(self, end_s: float, pace_s: float) -> None:
        """End all unfinished motions of this pace at ``end_s``."""
        self._recent = [
            span._replace(start_s=min(span.start_s, end_s), end_s=end_s)
            if span.end_s == math.inf and span.event == pace_s
            else span
            for span in self._recent
        ]

    def rests(self, from_s: float, to_s: float) -> bool:
        """Return whether there is no motion of any pace between these times."""
        return not self.between(from_s, to_s)

    def faster(self, from_s: float, to_s: float, pace_s: float) -> list[tuple[float, float]]:
        """Return begin and end of the motions between these times with a pace below ``pace_s`` (faster motions)."""
        return [(span.start_s, span.end_s) for span in self.between(from_s, to_s) if span.event < pace_s]


# -- The pace of a motion: progress from 0 to 1, and its exact derivatives in time --------------------------


class MotionProfile(Protocol):
    """Progress of a motion from 0 to 1. The functions map ``t_s`` (N,) to an array (N,)."""

    @property
    def duration_s(self) -> float: ...

    def progress(self, t_s: Array) -> Array: ...

    def speed(self, t_s: Array) -> Array: ...

    def acceleration(self, t_s: Array) -> Array: ...


@dataclass(frozen=True)
class Linear:
    """A motion at constant speed, which starts and stops with a jump of the speed."""

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
    """A motion by 10 u^3 - 15 u^4 + 6 u^5 with u = (t - start) / duration."""

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
