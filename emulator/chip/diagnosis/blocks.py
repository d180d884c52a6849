"""What firmware did with the chip's blocks that cannot work, as the trace has noted it."""

from __future__ import annotations

from emulator.chip.chip import Chip
from emulator.chip.cpu.python_blocks import GATES
from emulator.chip.diagnosis.report import Cause, at
from emulator.trace import DeviceNote, Trace

_NO_CLOCK = "while the block has no clock"
_SHOWN = 6


class BlockNotes:
    """The forbidden accesses to blocks of the chip, in order."""

    def __init__(self, chip: Chip, trace: Trace) -> None:
        self._clocked = {block.name: block.clocked for block in chip.core.all_blocks}
        self._notes = [
            note for note in trace.of(DeviceNote) if note.what == "forbidden" and note.device in self._clocked
        ]

    def without_clock(self) -> list[str]:
        """The blocks that were used without a clock, and still have none."""
        names = dict.fromkeys(note.device for note in self._notes if _NO_CLOCK in note.text)
        return [name for name in names if not self._clocked[name]]

    def cause(self) -> Cause | None:
        """The first block without clock; else None."""
        for name in self.without_clock():
            first = next(note for note in self._notes if note.device == name)
            return Cause(
                f"{name} has no clock: __HAL_RCC_{name}_CLK_ENABLE() is missing",
                [
                    (
                        f"{GATES[name]} is 0, so the block forgets what is written and reads as 0; "
                        f"first used at {at(first.t_ps)}."
                    )
                ],
            )
        return None

    def lines(self) -> list[str]:
        """All of them, the first of each block and kind."""
        lines = [f"{at(note.t_ps)}  {note.device} {note.text}" for note in self._notes]
        return lines[:_SHOWN] + ([f"and {len(lines) - _SHOWN} more"] if len(lines) > _SHOWN else [])
