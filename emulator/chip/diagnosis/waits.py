"""What a loop waits for, and why it waits in vain."""

from __future__ import annotations

from emulator.chip.chip import Chip
from emulator.chip.cpu.exceptions import SYS_TICK
from emulator.chip.diagnosis.interrupts import Interrupts
from emulator.chip.diagnosis.places import Places
from emulator.chip.diagnosis.probe import Loop, Probe
from emulator.chip.diagnosis.report import Cause
from emulator.chip.peripherals.dma import is_any_stream_on
from emulator.time.clock import NEVER_PS, PS_PER_S

_PATIENCE_PS = 3 * PS_PER_S  # hardware does nothing slower by itself than start the 32 kHz crystal, 2 s


class Waits:
    """``quiet_ps``: for how long nothing has happened outside of the chip."""

    def __init__(self, chip: Chip, interrupts: Interrupts, places: Places, quiet_ps: int) -> None:
        self._chip = chip
        self._interrupts = interrupts
        self._places = places
        self._quiet_ps = quiet_ps

    def in_vain(self, loop: Loop) -> Cause | None:
        """Why nothing will end the loop; None if something may."""
        if any(self._may_change(block.clocked, block.next_change_ps()) for block, _, _ in loop.registers):
            return None
        if not loop.variables:
            return self._registers(loop) if loop.registers else Cause("an endless loop", [])
        if self._interrupts.from_blocks() or is_any_stream_on(self._chip.core):
            return None
        return self._variables(loop)

    def _may_change(self, clocked: bool, next_change_ps: int) -> bool:
        return clocked and (next_change_ps < NEVER_PS or self._quiet_ps < _PATIENCE_PS)

    def _registers(self, loop: Loop) -> Cause:
        seen = sorted(
            f"{block.name}_{block.NAMES.get(offset, hex(offset))} (0x{value:08X})"
            for block, offset, value in loop.registers
        )
        off = next((block.name for block, _, _ in loop.registers if not block.clocked), "")
        why = f"{off} has no clock and reads as 0." if off else "No event that could change it is due."
        return Cause(f"waits for ever for {' and '.join(seen)} to change", [why])

    def _variables(self, loop: Loop) -> Cause | None:
        names = sorted({self._places.variable(address) for address in loop.variables})
        short = f"waits for ever for {' or '.join(names)} to change"
        changed = Probe(self._chip.core).handle(SYS_TICK)
        counted = changed is None or any(
            at in changed for address in loop.variables for at in range(address, address + 4)
        )
        why = self._interrupts.why_no_tick()
        if counted and not why:
            return None  # the tick may end it
        if counted and changed is not None:
            return Cause(short, [f"It is counted by SysTick's handler, which cannot run: {why}"])
        if why:
            return Cause(short, [f"Nothing that could change it is running; {why}"])
        return Cause(
            short, ["No interrupt is on that writes it; is the one that should do so enabled and started?"]
        )
