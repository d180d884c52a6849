"""A timer's counter as arithmetic: where it is after n counts, and when it will be where (RM0368 12.3.2,
13.3.2).

The counter walks round a cycle of positions; ``index`` is the position. Counting up, the index is the
value; counting down, it is the distance from ARR; centre-aligned, it runs from 0 up to ARR and back in 2 *
ARR counts. An overflow or underflow is the arrival at index 0, centre-aligned also the one at ARR.

A negative index is a counter outside its cycle, because ARR was set below it: counting up (or
centre-aligned) it goes on to its largest value and wraps to 0 without an event, counting down it walks back
into the cycle. What the centre-aligned counter does there is not documented; this is the plausible reading.
"""

from __future__ import annotations

from enum import Enum


class Mode(Enum):
    """Direction of counting (CR1.DIR and CMS)."""

    UP = "up"
    DOWN = "down"
    CENTRE = "centre"


class Counter:
    """CNT, ARR (the active one) and the direction; knows nothing of time."""

    __slots__ = ("_length", "_top", "arr", "blocked", "event_spacing", "index", "mode")

    def __init__(self, bits: int) -> None:
        self._top = 1 << bits
        self.mode = Mode.UP
        self._set_arr(self._top - 1)
        self.index = 0

    def _set_arr(self, arr: int) -> None:
        """Attributes and no properties: they are read at each interrupt."""
        self.arr = arr
        self.blocked = arr == 0
        """With ARR = 0 the counter does not count (12.3.2)."""
        self.event_spacing = arr if self.mode is Mode.CENTRE else arr + 1
        """Counts from one overflow or underflow to the next."""
        self._length = 2 * arr if self.mode is Mode.CENTRE else arr + 1

    @property
    def value(self) -> int:
        """CNT."""
        if self.mode is Mode.DOWN:
            return self.arr - self.index
        if self.index < 0:
            return self.index + self._top
        return 2 * self.arr - self.index if self.index > self.arr else self.index

    @property
    def falling(self) -> bool:
        """Whether the next count goes down."""
        return self.mode is Mode.DOWN or (self.mode is Mode.CENTRE and self.index >= self.arr)

    def place(self, value: int, *, falling: bool) -> None:
        """Set CNT; ``falling`` matters to the centre-aligned mode only."""
        if self.mode is Mode.DOWN:
            self.index = self.arr - value
        elif value > self.arr:
            self.index = value - self._top
        elif self.mode is Mode.CENTRE and falling and value:
            self.index = 2 * self.arr - value
        else:
            self.index = value

    def reshape(self, mode: Mode, arr: int) -> None:
        """Another direction or ARR; CNT keeps its value."""
        value, falling = self.value, self.falling
        self.mode = mode
        self._set_arr(arr)
        self.place(value, falling=falling)

    def restart(self) -> None:
        """What an update by software does: CNT is 0, or ARR when counting down (12.4.6)."""
        self.index = 0

    def reload(self, arr: int) -> None:
        """Another ARR, at an update: the new cycle begins, or its falling half."""
        if self.mode is Mode.CENTRE and self.index:
            self.index = arr  # at the top
        self._set_arr(arr)

    def steps_to_event(self) -> int:
        """Counts until the next overflow or underflow; the counter must not be blocked."""
        spacing = self.event_spacing
        return spacing - self.index if self.index < 0 else spacing - self.index % spacing

    def events_in(self, steps: int) -> int:
        """How many overflows and underflows happen in the next ``steps`` counts."""
        first = self.steps_to_event()
        return 0 if steps < first else 1 + (steps - first) // self.event_spacing

    def steps_to(self, index: int) -> int:
        """Counts until the counter arrives at a position of the cycle."""
        if self.index < 0:
            return index - self.index
        return (index - self.index - 1) % self._length + 1

    def advance(self, steps: int) -> None:
        """Count ``steps`` times."""
        index = self.index + steps
        self.index = index if index < self._length else index % self._length

    def matches(self, compare: int, *, rising: bool = True, falling: bool = True) -> list[int]:
        """The positions at which CNT equals ``compare``; one beyond ARR matches at the overflow (12.4.5).

        ``rising`` and ``falling``: which halves of the centre-aligned cycle count (CR1.CMS).
        """
        if self.mode is Mode.UP:
            return [compare if compare <= self.arr else 0]
        if self.mode is Mode.DOWN:
            return [self.arr - compare if compare <= self.arr else 0]
        if compare > self.arr:
            return [self.arr] * rising + [0] * falling
        positions = [compare] if rising and compare else []
        if falling and compare < self.arr:
            positions.append(2 * self.arr - compare if compare else 0)
        return positions
