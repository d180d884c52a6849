"""What a diagnosis is, and how it reads."""

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
"""Kinds of what lets no samples come, or not in time: numbers are wrong then whatever the arithmetic is."""

_INDENT = "  "


@dataclass(frozen=True)
class Diagnosis:
    """``str()`` is the whole text: the summary, and the details indented below it.

    ``kind``: a fault of the core, a loop without end, a stack that has grown into the variables, resets, a
    callback that takes too long, a peripheral without clock, transfers that nobody answers, a terminal that gets
    nothing, a timer that does not tick as it should, full memories, numbers that printf could not print; and,
    held against the world and the sensors by :mod:`fcu_emulator.emulator.analysis.mistakes`, numbers that are not the
    truth, sensors that are not set up, LEDs that do not follow the board.
    """

    kind: Kind
    summary: str
    """One line."""
    details: tuple[str, ...]
    fatal: bool = True
    """The firmware has failed. False: it runs on, but hardly as it was meant to."""
    at_ps: int | None = None
    """When it has failed, as far as that is known."""

    def __str__(self) -> str:
        return "\n".join((self.summary, *(f"{_INDENT}{line}" for line in self.details)))


class Cause(NamedTuple):
    """Why: a few words for the summary, and sentences that say more."""

    short: str
    sentences: list[str]


def section(title: str, lines: list[str]) -> list[str]:
    """A title with its lines indented below; nothing if there are none."""
    return [f"{title}:", *(f"{_INDENT}{line}" for line in lines)] if lines else []


def at(t_ps: int) -> str:
    """A moment: seconds of virtual time, to the microsecond."""
    return f"{t_ps / PS_PER_S:.6f} s"


def milliseconds(duration_ps: int) -> str:
    """A duration: ``2.1 ms``."""
    return f"{duration_ps / PS_PER_MS:.3g} ms"
