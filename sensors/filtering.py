"""A filter on a stream of samples, computed where somebody looks.

Decision: a filtered sample is a pure function of its number. Samples are computed in pages of fixed place and
size, each from the state the page before it left behind; every sixteen pages or more, a segment, begins
afresh, so many samples early that what came before them has been forgotten. A reader who skips an hour thus
pays for a segment, not for the hour, and gets the same bits as one who read every sample.

Inputs already taken are kept to the end of their page: a world that changes at sample n changes the samples
from n on, and the world need not remember what was before.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeAlias

import numpy as np

from sensors.filters import PAGE, Array, Chain

Source: TypeAlias = Callable[[int, int], Array]
"""``source(number, count)``: unfiltered samples, (axes, count), of the present settings and world."""

_SEGMENT = 16  # times the pages of warming up
_KEPT = 4  # pages: the stream's block, and what a second reader may lag behind


class _Page:
    """One page: its input less the reference, the output, and the filter's state after it.

    Arrays are replaced, never changed: a snapshot of the part keeps them as they are.
    """

    __slots__ = ("after", "known", "output", "samples")

    def __init__(self, axes: int) -> None:
        self.samples = np.empty((axes, 0))
        self.known = 0  # of ``samples``, how many are taken already
        self.output: Array | None = None
        self.after: Array | None = None


class SampledFilter:
    """The samples of ``source`` through a chain; numbers are those of the stream's samples."""

    def __init__(self, source: Source, axes: int = 3) -> None:
        self._source = source
        self._axes = axes
        self._chain: Chain | None = None
        self._started = 0  # number of the chain's first sample
        self._first = 0  # number of the first one under the present settings
        self._initial = np.empty((axes, 0))  # the state before it
        self._reference: Array | None = None
        self._warm = self._segment = 1
        self._pages: dict[int, _Page] = {}

    def restart(self, chain: Chain | None, number: int) -> None:
        """Filter with another chain from ``number`` on, which starts as its ``start`` says."""
        self._chain = chain
        self._started = self._first = number
        self._reference = None
        self._pages.clear()
        if chain is not None:
            self._initial = chain.at_rest(self._axes)
            self._warm = -(-chain.settling // PAGE)
            self._segment = _SEGMENT * self._warm

    def split(self, number: int) -> None:
        """The source's settings are about to change from ``number`` on: keep the filter's state so far."""
        if self._chain is None or number == self._first:
            return
        page, offset = divmod(number - self._first, PAGE)
        state = self._state_before(page)
        self._initial = self._chain.after(self._input(page).samples[:, :offset], state)
        self._first = number
        self._pages.clear()

    def forget(self, number: int) -> None:
        """The world has changed: what was computed ahead from ``number`` on is computed anew."""
        if number <= self._started:
            self._reference = None
            self._pages.clear()
        page, offset = divmod(number - self._first, PAGE)
        for key, entry in self._pages.items():
            if key >= page:
                entry.output = entry.after = None
                entry.known = min(entry.known, offset) if key == page else 0

    def block(self, number: int, count: int) -> Array:
        """Filtered samples ``number`` to ``number + count - 1``, (axes, count)."""
        first = number - self._first
        end = first + count
        pieces = []
        while first < end:
            page, inside = divmod(first, PAGE)
            stop = min(end, (page + 1) * PAGE)
            pieces.append(self._output(page)[:, inside : inside + stop - first])
            first = stop
        return np.concatenate(pieces, axis=1)

    def _output(self, page: int) -> Array:
        entry = self._pages.get(page)
        if entry is not None and entry.output is not None:
            return entry.output
        assert self._chain is not None
        state = self._state_before(page)
        entry = self._input(page)
        output, entry.after = self._chain.run(entry.samples, state)
        if self._chain.start == "settled":
            output += self._reference_value()
        entry.output = output
        return output

    def _state_before(self, page: int) -> Array:
        """The filter's state before a page: from the page before it, or by warming up for its segment."""
        assert self._chain is not None
        segment = page - page % self._segment
        for begin in range(page, segment, -1):
            entry = self._pages.get(begin - 1)
            if entry is not None and entry.after is not None:
                state = entry.after
                break
        else:
            begin = max(segment - self._warm, 0)
            state = self._chain.at_rest(self._axes) if begin else self._initial
        for number in range(begin, page):
            entry = self._input(number)
            state = self._chain.run(entry.samples, state)[1]
            if number >= segment:
                entry.after = state
        return state

    def _input(self, page: int) -> _Page:
        """A page with all of its samples taken."""
        entry = self._pages.get(page)
        if entry is None:
            while len(self._pages) >= _KEPT:
                self._pages.pop(next(iter(self._pages)))
            entry = self._pages[page] = _Page(self._axes)
        known = entry.known
        if known < PAGE:
            reference = self._reference_value()
            taken = self._source(self._first + page * PAGE + known, PAGE - known)
            samples = np.empty((self._axes, PAGE))
            samples[:, :known] = entry.samples[:, :known]
            np.subtract(taken, reference, out=samples[:, known:])
            entry.samples, entry.known = samples, PAGE
        return entry

    def _reference_value(self) -> Array:
        """What the filter's deviations are counted from, (axes, 1): a still world passes it bit by bit."""
        if self._reference is None:
            assert self._chain is not None
            zero = self._chain.start == "zero"
            self._reference = np.zeros((self._axes, 1)) if zero else self._source(self._started, 1)
        return self._reference
