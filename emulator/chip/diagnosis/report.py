"""The result of a diagnosis, and its text."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal, NamedTuple, TypeAlias

from fcu_emulator.emulator.clock import PS_PER_MS, PS_PER_S

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
    "formula",
    "call",
]

KEEPS_SAMPLES_AWAY: frozenset[Kind] = frozenset({"callback", "timer", "bus", "clock"})
"""Kinds of problems that stop or delay samples, so that numbers are wrong even if the arithmetic is correct."""

_INDENT = "  "


@dataclass(frozen=True)
class Diagnosis:
    """A problem of the firmware; ``str()`` gives the whole text."""

    kind: Kind
    summary: str
    """The problem in one line."""
    details: tuple[str, ...]
    fatal: bool = True
    """Whether the firmware has failed. If False, the firmware continues, but probably not as intended."""
    at_ps: int | None = None
    """The time of the failure, if known."""
    data: Mapping[str, str] = field(default_factory=dict, hash=False)
    """The parts of the summary by name, for programs.

    The kind "formula" has ``file`` and ``line`` (or ``address``), ``step``, ``computed``, ``formula`` (of the
    lab) and ``fields`` (the printed numbers that the problem explains).
    """

    def __str__(self) -> str:
        return "\n".join((self.summary, *(f"{_INDENT}{line}" for line in self.details)))

    def as_data(self) -> dict[str, Any]:
        """Return the diagnosis for JSON, without its time."""
        return {
            "kind": self.kind,
            "summary": self.summary,
            "details": list(self.details),
            "fatal": self.fatal,
            "data": dict(self.data),
        }


class Cause(NamedTuple):
    """A short reason, and details in sentences."""

    short: str
    sentences: list[str]


def section(title: str, lines: list[str]) -> list[str]:
    """Return a title with indented lines; [] without lines."""
    return [f"{title}:", *(f"{_INDENT}{line}" for line in lines)] if lines else []


def at(t_ps: int) -> str:
    """Return a virtual time as text, in seconds with six decimals."""
    return f"{t_ps / PS_PER_S:.6f} s"


def milliseconds(duration_ps: int) -> str:
    """Return a duration as text, such as ``2.1 ms``."""
    return f"{duration_ps / PS_PER_MS:.3g} ms"
