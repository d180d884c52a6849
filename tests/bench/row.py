"""A row of the speed table, and the measurement of CPU time."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass

from fcu_emulator import Board

PEAK_MB = """
def peak_mb():
    from pathlib import Path
    status = Path("/proc/self/status")
    if status.is_file():  # getrusage() has the peak of the process that started this one, too
        return int(status.read_text().partition("VmHWM:")[2].split()[0]) / 1024
    try:
        import resource
    except ImportError:
        return 0
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
"""
"""Python source of a function that returns the peak memory of its process, or 0 if the system does not tell it."""

_LONG_ENOUGH_S = 0.15
_LONGEST_S = 2.0
TIMES = 5


@dataclass(frozen=True)
class Row:
    """A row: ``measure()`` asserts its results and returns the figure in ``unit``, which is shown with ``digits``.

    ``at_least`` and ``aim`` are the required and the desired figure. If less is better, they are maxima.
    """

    name: str
    measure: Callable[[], float]
    unit: str = "x"
    digits: int = 1
    at_least: float | None = None
    aim: float | None = None
    less_is_better: bool = False

    @property
    def wanted(self) -> str:
        """Return the text of the last column."""
        words = [] if self.at_least is None else [f"{self.at_least:g} {self.unit}"]
        if self.aim is not None:
            words.append(f"aim {self.aim:g} {self.unit}")
        return ", ".join(words)


def cpu_s(work: Callable[[], object]) -> float:
    """Return the CPU seconds of this process for an action."""
    started = time.process_time()
    work()
    return time.process_time() - started


def factor(board: Board, seconds: float = 0.1) -> tuple[float, float]:
    """Return virtual over CPU time, the best of five, and the total virtual seconds.

    The time is doubled from ``seconds`` until a measurement is long enough for the clock.
    """

    def run_for(one_s: float) -> float:
        return cpu_s(lambda: board.run_for(one_s))

    spent = seconds
    took = run_for(seconds)
    while took < _LONG_ENOUGH_S and seconds < _LONGEST_S:
        seconds *= 2
        took = run_for(seconds)
        spent += seconds
    best = min(took, *(run_for(seconds) for _ in range(TIMES - 1)))
    return seconds / best, spent + (TIMES - 1) * seconds
