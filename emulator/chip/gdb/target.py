"""The debugger's interface to its target, between the protocol and the core."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from typing import Protocol


class PointKind(Enum):
    """The kind of a point that stops the core; the values are the numbers in Z packets."""

    SOFTWARE_BREAK = 0
    HARDWARE_BREAK = 1
    WRITE = 2
    READ = 3
    ACCESS = 4

    @property
    def is_break(self) -> bool:
        """Whether it is a breakpoint; both kinds are the same here: neither changes memory, and neither is limited."""
        return self in {PointKind.SOFTWARE_BREAK, PointKind.HARDWARE_BREAK}


@dataclass(frozen=True)
class Point:
    """A breakpoint on the instruction at ``address``, or a watchpoint on ``size`` bytes from there."""

    kind: PointKind
    address: int
    size: int


@dataclass(frozen=True)
class HaltReason:
    """Why the core has stopped by itself: at a point, after a step (``point`` None), or by a failure."""

    point: Point | None = None
    address: int = 0
    """The address of the access that a watchpoint detected."""
    failure: str = ""
    """A description for the user; empty without an error."""


class Target(Protocol):
    """A stopped core. Time passes only in ``run_until_ps``, and only after ``resume`` or ``step``.

    Registers have the core's names, ``"r0"`` to ``"control"``, ``"s0"`` to ``"s31"`` and ``"fpscr"``; values
    are words.
    """

    def attach(self) -> None:
        """Halt for a newly connected debugger."""
        ...

    def release(self) -> None:
        """Remove the debugger's points and resume, after it has left."""
        ...

    def halt(self) -> None:
        """Halt before the next instruction; an exception entry may be completed first."""
        ...

    def read_registers(self) -> dict[str, int]:
        """Return the values of all registers."""
        ...

    def write_register(self, name: str, value: int) -> None:
        """Change one register; bits that the core ignores do not change."""
        ...

    def read_memory(self, address: int, size: int) -> bytes:
        """Return memory without side effects, up to the first address without memory or register."""
        ...

    def write_memory(self, address: int, data: bytes) -> bool:
        """Write memory, including flash; False, without any change, if a part cannot be written."""
        ...

    def add(self, point: Point) -> None:
        """Stop at a point from now on."""
        ...

    def remove(self, point: Point) -> None:
        """Do not stop at a point any more; an unknown point is ignored."""
        ...

    def resume(self) -> None:
        """Resume in the next ``run_until_ps``, past a breakpoint on the very next instruction."""
        ...

    def step(self) -> None:
        """Execute one instruction in the next ``run_until_ps``, then stop."""
        ...

    def run_until_ps(self, at_ps: int) -> HaltReason | None:
        """Run up to ``at_ps`` of virtual time; return the reason of an earlier stop, or None."""
        ...
