"""The result of a diagnosis, and its text."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, NamedTuple, TypeAlias

from fcu_emulator.emulator.time.clock import PS_PER_MS, PS_PER_S

Kind: TypeAlias = Literal[
    "fault",
    "stuck",
    "stack",
    "reset",
    "callback",
    "clock",
    "bus",
    "terminal",
    "timer",
    "memory",
    "printing",
    "numbers",
    "sensor",
    "led",
]

KEEPS_SAMPLES_AWAY: frozenset[Kind] = frozenset({"callback", "timer", "bus", "clock"})
"""Kinds of problems that stop or delay samples: numbers are then wrong regardless of the arithmetic."""

_INDENT = "  "


@dataclass(frozen=True)
class Diagnosis:
    """``str()`` is the whole text: the summary, and the details indented below it.

    ``kind``: a fault of the core, an endless loop, a stack that has grown into the variables, resets, a
    callback that takes too long, a peripheral without clock, unacknowledged transfers, a terminal without
    output, a timer with a wrong rate, full memories, numbers that printf could not print.
    :mod:`fcu_emulator.emulator.analysis.mistakes` compares with the world and the sensors. It adds numbers
    that differ from the truth, unconfigured sensors, and LEDs that do not follow the board.
    """

    kind: Kind
    summary: str
    """One line."""
    details: tuple[str, ...]
    fatal: bool = True
    """Whether the firmware has failed. False: it continues, but probably not as intended."""
    at_ps: int | None = None
    """The time of the failure, as far as known."""

    def __str__(self) -> str:
        return "\n".join((self.summary, *(f"{_INDENT}{line}" for line in self.details)))


class Cause(NamedTuple):
    """The reason: a few words for the summary, and sentences with details."""

    short: str
    sentences: list[str]


def section(title: str, lines: list[str]) -> list[str]:
    """Return a title with its lines indented below; an empty list without lines."""
    return [f"{title}:", *(f"{_INDENT}{line}" for line in lines)] if lines else []


def at(t_ps: int) -> str:
    """Return a time: seconds of virtual time, to the microsecond."""
    return f"{t_ps / PS_PER_S:.6f} s"


def milliseconds(duration_ps: int) -> str:
    """Return a duration: ``2.1 ms``."""
    return f"{duration_ps / PS_PER_MS:.3g} ms"
