"""The changes of the LEDs' pins, with the firmware's registers and stack."""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping, Sequence
from functools import partial
from typing import TYPE_CHECKING, Final, NamedTuple

from fcu_emulator.emulator.chip.memory_map import RAM_MEMORY

if TYPE_CHECKING:
    from fcu_emulator.emulator.assembly.board import Board
    from fcu_emulator.emulator.chip.firmware import ArmFirmware

_SP, _LR, _PC = 13, 14, 15
_STACK_BYTES: Final = 512
_KEPT: Final = 32


class LedChange(NamedTuple):
    """Registers and stack when a LED's pin changed."""

    pc: int
    lr: int
    sp: int
    stack: bytes

    def word(self, address: int) -> int | None:
        at = address - self.sp
        inside = 0 <= at <= len(self.stack) - 4
        return int.from_bytes(self.stack[at : at + 4], "little") if inside else None


class LedSwitches:
    """Recorder of each LED's latest changes, for compiled firmware."""

    def __init__(self, board: Board) -> None:
        self._changes: dict[tuple[str, bool], deque[LedChange]] = {}
        if board.chip is not None:
            for name, (port, pin) in board.chip.signals.board.leds.items():
                board.chip.signals.gpio.listen(port, pin, partial(self._record, board.chip, name))

    @property
    def changes(self) -> Mapping[tuple[str, bool], Sequence[LedChange]]:
        """The latest changes, keyed by LED and its new state (True: lit)."""
        return self._changes

    def _record(self, arm: ArmFirmware, led: str, level: int) -> None:
        core = arm.chip.core
        sp = core.register(_SP)
        stack = core.memory(sp, min(_STACK_BYTES, RAM_MEMORY.end - sp)) or b""
        change = LedChange(core.register(_PC), core.register(_LR), sp, bytes(stack))
        self._changes.setdefault((led, not level), deque(maxlen=_KEPT)).append(change)
