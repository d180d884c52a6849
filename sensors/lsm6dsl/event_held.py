"""A condition that has to last: durations of the event functions are counted in samples.

Decision: a duration of N/ODR is over at the sample that comes N periods after the first at which the
condition was true, so N = 0 acts on the first sample. The road not taken, N samples in a row, would make 0
and 1 the same.
"""

from __future__ import annotations


class Held:
    """Counts the samples in a row at which a condition was true."""

    __slots__ = ("_run", "periods")

    def __init__(self) -> None:
        self.periods = 0
        self._run = 0

    def reset(self) -> None:
        """The condition begins anew."""
        self._run = 0

    def step(self, condition: bool) -> bool:
        """Whether the condition has lasted ``periods`` periods as of this sample."""
        self._run = self._run + 1 if condition else 0
        return self._run > self.periods
