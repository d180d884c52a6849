"""One quantity over time: pieces in force one after the other.

Decision: a piece is in force from its start until the next one's, and the last word wins: planning a piece
drops what was planned from its start on. One rule serves timelines (planned in order of time) and live
changes (which cut off what was planned later). Road not taken: re-planning later motions from the changed
state, where a student's slider would bend a scenario's expected values.

A piece's function returns a first axis of length N, or of length 1 when its value does not change: numpy's
broadcasting then carries "the same for the whole block" through all arithmetic, and a world at rest costs one
row.
"""

from __future__ import annotations

import math
from bisect import bisect_left, bisect_right
from collections.abc import Callable
from typing import Generic, TypeVar

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]
P = TypeVar("P")


class Track(Generic[P]):
    """The pieces of one quantity in order of their starts; ``first`` reaches back to the start of time."""

    def __init__(self, first: P) -> None:
        self._starts = [-math.inf]
        self._pieces = [first]

    def at(self, t_s: float) -> P:
        """The piece in force at ``t_s``."""
        return self._pieces[bisect_right(self._starts, t_s) - 1]

    @property
    def last(self) -> P:
        """The piece in force at the end of time."""
        return self._pieces[-1]

    def plan(self, start_s: float, piece: P) -> None:
        """Put ``piece`` in force from ``start_s`` on, in place of everything planned from there on."""
        keep = bisect_left(self._starts, start_s)
        del self._starts[keep:], self._pieces[keep:]
        self._starts.append(start_s)
        self._pieces.append(piece)

    def forget(self, before_s: float) -> None:
        """Drop the pieces that ended before ``before_s``; the oldest one kept stands for all times before."""
        old = bisect_right(self._starts, before_s) - 1
        if old > 0:
            del self._starts[:old], self._pieces[:old]
            self._starts[0] = -math.inf

    def evaluate(self, t_s: Array, function: Callable[[P, Array], Array]) -> Array:
        """``function(piece, t_s)`` of the pieces in force at ``t_s`` (N,): first axis N, or 1 if constant."""
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
    """A value (shape S) that does not change, as a piece: always (1, *S)."""

    def __init__(self, value: npt.ArrayLike) -> None:
        self._value = np.array(value, dtype=np.float64)[np.newaxis]

    def value(self, _t_s: Array, /) -> Array:
        """The value at any time."""
        return self._value
