"""What the debugger needs of the machine it debugs: the seam between the protocol and the core."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from typing import Protocol


class PointKind(Enum):
    """What makes the core stop at a place; the values are the numbers in Z packets."""

    SOFTWARE_BREAK = 0
    HARDWARE_BREAK = 1
    WRITE = 2
    READ = 3
    ACCESS = 4

    @property
    def is_break(self) -> bool:
        """Both kinds of breakpoints are one here: neither changes memory, and there is no limit to either."""
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
    """Of the access that a watchpoint saw."""
    failure: str = ""
    """What happened, for a person; empty if nothing went wrong."""


class Target(Protocol):
    """A stopped core. Time passes only in ``run_until_ps``, and only after ``resume`` or ``step``.

    Registers go by the core's names, ``"r0"`` to ``"control"``, ``"s0"`` to ``"s31"`` and ``"fpscr"``; values
    are words.
    """

    def attach(self) -> None:
        """A debugger has come: halt."""
        ...

    def release(self) -> None:
        """The debugger is gone: forget its points and go on."""
        ...

    def halt(self) -> None:
        """Stop before the next instruction; an exception being entered may be entered first."""
        ...

    def read_registers(self) -> dict[str, int]:
        """Return the values of all registers."""
        ...

    def write_register(self, name: str, value: int) -> None:
        """Change one; what the core ignores it ignores."""
        ...

    def read_memory(self, address: int, size: int) -> bytes:
        """What is there, without side effects, up to where nothing answers any more."""
        ...

    def write_memory(self, address: int, data: bytes) -> bool:
        """Write, the flash too; False if something there cannot be written, and then nothing was."""
        ...

    def add(self, point: Point) -> None:
        """Stop there from now on."""
        ...

    def remove(self, point: Point) -> None:
        """Stop there no more; harmless if it is not known."""
        ...

    def resume(self) -> None:
        """The next ``run_until_ps`` goes on, past a breakpoint on the very next instruction."""
        ...

    def step(self) -> None:
        """The next ``run_until_ps`` executes one instruction and stops."""
        ...

    def run_until_ps(self, at_ps: int) -> HaltReason | None:
        """Run up to ``at_ps`` of virtual time: why it stopped before, or None."""
        ...
