"""Exception frames: what the hardware saves on the stack at entry and takes back at return (ARMv7-M ARM
B1.5.6 to B1.5.8).

Eight words are saved, or 26 when floating point is in use (CONTROL.FPCA). The frame is aligned to eight
bytes if CCR.STKALIGN says so, and always with floating point; bit 9 of the saved xPSR tells the return
that a word was left out for it.

Decision: S0 to S15 and FPSCR are saved at once. With FPCCR.LSPEN the hardware only leaves room for them
until the handler uses floating point; a handler that restores what it has changed cannot tell the
difference.

The engine marks a floating-point context in CONTROL not only by FPCA but also by bit 3, which a Cortex-M4
has not; without it the next floating-point instruction would begin a new context, with FPSCR reset. MRS
shows that bit to the firmware.
"""

from __future__ import annotations

import struct

from emulator.arm.cpu.engine import RAM, RAM_SIZE, Engine
from emulator.arm.cpu.registers import Registers

NPRIV, SPSEL, FPCA = 1 << 0, 1 << 1, 1 << 2
"""Bits of CONTROL."""
_FLOATING_CONTEXT = FPCA | 1 << 3

THREAD_BIT, PROCESS_STACK_BIT, BASIC_FRAME_BIT = 1 << 3, 1 << 2, 1 << 4
"""Bits of EXC_RETURN (ARMv7-M ARM table B1-8)."""

_EXC_RETURN = 0xFFFF_FFE1
_PADDED = 1 << 9
THUMB = 1 << 24
HIGHEST_ADDRESS = 0xFFFF_FFFF
_IPSR = 0x1FF
_STORED_XPSR = 0xFF0F_FDFF  # all but the padding bit
_BASIC = struct.Struct("<8I")
_FLOATING = struct.Struct("<17I4x")


class Frames:
    """Pushes and pops frames; the engine must not be running."""

    def __init__(self, engine: Engine) -> None:
        self._engine = engine
        self._ram = engine.ram
        self.lowest = HIGHEST_ADDRESS
        """The lowest address that the main stack has had at an exception entry."""
        self.floating_area = 0
        """Where floating-point registers were last saved: FPCAR."""
        self._read = Registers(engine, ("r0", "r1", "r2", "r3", "r12", "lr", "xpsr", "sp", "control"))
        self._sp = Registers(engine, ("sp",))
        self._xpsr = Registers(engine, ("xpsr",))
        self._enter = Registers(engine, ("xpsr", "control", "lr"))
        self._stacks = Registers(engine, ("msp", "psp", "control"))
        general = ("r0", "r1", "r2", "r3", "r12", "lr", "control", "xpsr")
        self._leave = {
            False: Registers(engine, ("msp", *general)),
            True: Registers(engine, ("psp", *general)),
        }
        self._floating = Registers(engine, (*(f"s{number}" for number in range(16)), "fpscr"))

    def push(self, return_address: int, align: bool) -> tuple[int, bool]:
        """Save the present context: its EXC_RETURN value, and whether the stack could be written."""
        r0, r1, r2, r3, r12, lr, xpsr, sp, control = self._read.read()
        floating = bool(control & FPCA)
        align = align or floating
        padded = bool(sp & 4) and align
        frame = (sp - (0x68 if floating else 0x20)) & 0xFFFF_FFFF
        if align:
            frame &= ~4
        exc_return = _EXC_RETURN | (0 if floating else BASIC_FRAME_BIT)
        if not xpsr & _IPSR:
            exc_return |= THREAD_BIT | (PROCESS_STACK_BIT if control & SPSEL else 0)
        saved = xpsr & _STORED_XPSR | (_PADDED if padded else 0)
        if frame < self.lowest and not exc_return & PROCESS_STACK_BIT:
            self.lowest = frame
        self._sp.write(frame)
        offset = frame - RAM
        if not 0 <= offset <= RAM_SIZE - (0x68 if floating else 0x20):
            return exc_return, False
        _BASIC.pack_into(self._ram, offset, r0, r1, r2, r3, r12, lr, return_address, saved)
        if floating:
            self.floating_area = frame + 0x20
            _FLOATING.pack_into(self._ram, offset + 0x20, *self._floating.read())
        return exc_return, True

    def enter(self, exception: int, exc_return: int, thumb: bool) -> None:
        """Handler mode, main stack, no floating-point context (ExceptionTaken)."""
        control = self._stacks.read()[2] & NPRIV
        self._enter.write(exception | (THUMB if thumb else 0), control, exc_return)

    def pop(self, exc_return: int) -> tuple[int, int] | None:
        """Restore a context: (return address, xPSR); None if the stack could not be read."""
        process = exc_return & 0xF == THREAD_BIT | PROCESS_STACK_BIT | 1
        msp, psp, control = self._stacks.read()
        frame = psp if process else msp
        floating = not exc_return & BASIC_FRAME_BIT
        size = 0x68 if floating else 0x20
        content = self._engine.memory(frame, size)
        if content is None:
            return None
        r0, r1, r2, r3, r12, lr, address, xpsr = _BASIC.unpack_from(content)
        if floating:
            self._floating.write(*_FLOATING.unpack_from(content, 0x20))
        sp = (frame + size) | (4 if xpsr & _PADDED else 0)
        control = control & NPRIV | (SPSEL if process else 0) | (_FLOATING_CONTEXT if floating else 0)
        restored = xpsr & _STORED_XPSR
        self._leave[process].write(sp, r0, r1, r2, r3, r12, lr, control, restored)
        return address, restored

    def handled(self) -> int:
        """The exception being handled (IPSR); 0 in Thread mode."""
        return self._xpsr.read()[0] & _IPSR
