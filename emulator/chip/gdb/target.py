"""The debugger's interface to its target."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum
from typing import Protocol


class PointKind(Enum):
    """Kinds of points, numbered as in Z packets."""

    SOFTWARE_BREAK = 0
    HARDWARE_BREAK = 1
    WRITE = 2
    READ = 3
    ACCESS = 4

    @property
    def is_break(self) -> bool:
        return self in {PointKind.SOFTWARE_BREAK, PointKind.HARDWARE_BREAK}


@dataclass(frozen=True)
class Point:
    """A breakpoint, or a watchpoint on ``size`` bytes."""

    kind: PointKind
    address: int
    size: int


@dataclass(frozen=True)
class HaltReason:
    """The reason for a stop: a point, a completed step (``point`` is None), or a failure."""

    point: Point | None = None
    address: int = 0
    """The address of the watched access."""
    failure: str = ""
    """A description for the user; empty without an error."""


class Target(Protocol):
    """A stopped core. Time passes only in ``run_until_ps`` after ``resume`` or ``step``.

    Registers are words named ``"r0"`` to ``"control"``, ``"s0"`` to ``"s31"`` and ``"fpscr"``.
    """

    def attach(self) -> None:
        """Halt for a newly connected debugger."""
        ...

    def release(self) -> None: ...

    def halt(self) -> None: ...

    def read_registers(self) -> dict[str, int]: ...

    def write_register(self, name: str, value: int) -> None:
        """Change one register, except bits that the core ignores."""
        ...

    def read_memory(self, address: int, size: int) -> bytes:
        """Return memory without side effects, up to the first unused address."""
        ...

    def write_memory(self, address: int, data: bytes) -> bool:
        """Write all of ``data`` to memory or flash, or write nothing and return False."""
        ...

    def add(self, point: Point) -> None: ...

    def remove(self, point: Point) -> None: ...

    def resume(self) -> None:
        """Resume in the next ``run_until_ps``, past a breakpoint at the present address."""
        ...

    def step(self) -> None: ...

    @property
    def can_reverse(self) -> bool:
        """Whether the target has a history."""
        ...

    def reverse_step(self) -> bool:
        """Return to the state before the previous instruction. Return False at the start of the history."""
        ...

    def reverse_continue(self, is_interrupted: Callable[[], bool]) -> HaltReason | None:
        """Return to the previous breakpoint or watched access. Return None at the start of the history."""
        ...

    def take_remark(self) -> str:
        """Return and clear a text for the user about a discarded part of the history, or ""."""
        ...

    def run_until_ps(self, at_ps: int) -> HaltReason | None:
        """Run until ``at_ps``. If the core stops earlier, return the reason."""
        ...
