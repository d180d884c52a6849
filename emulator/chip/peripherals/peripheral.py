"""The interface of a peripheral: its place in the memory map, registers, clock and reset, and the connections
that peripherals share: time, trace, interrupt lines, clock tree, pins.

The core sets ``soc.clock.now_ps`` to the exact time of an access before it calls ``read`` or ``write``. It
also fires every event that is due by then. A peripheral therefore computes its state from the time when it is
read, or schedules an event. An event ends a run of instructions, so use it for actions that may raise an
interrupt, move a pin or start a DMA transfer.

Registers are words. Byte and half-word accesses reach ``write`` with a mask of the accessed bits. A
peripheral with a side effect for each byte (a data register) checks the mask; other peripherals merge.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import ClassVar, Protocol

from fcu_emulator.emulator.buses.gpio import Gpio
from fcu_emulator.emulator.chip.registers.declaration import DeclaredPeripheral
from fcu_emulator.emulator.time.clock import NEVER_PS, Clock
from fcu_emulator.emulator.trace import DeviceNote, Trace

# -- the internal connections of the chip -------------------------------------------------------------------


class ClockTree(Protocol):
    """Frequencies as firmware has configured RCC (RM0368 section 6.2); implemented by the RCC peripheral."""

    sysclk_hz: int
    hclk_hz: int
    nominal_hclk_hz: int
    """HCLK of a chip with exact oscillators, to which the manual's limits apply."""
    pclk1_hz: int
    pclk2_hz: int
    timer1_hz: int
    """Clock of the timers on APB1: twice PCLK1 unless its prescaler is 1."""
    timer2_hz: int
    """Clock of the timers on APB2, by the same rule."""

    def on_change(self, changed: Callable[[], None]) -> None:
        """Call ``changed()`` after a change of any frequency."""
        ...


class InterruptLines(Protocol):
    """The NVIC's inputs; implemented by the core."""

    def set_line(self, number: int, level: bool) -> None:
        """Set or clear input ``number`` (0 is the first one after the system exceptions).

        A level that stays active makes the interrupt pending again when its handler returns, as in hardware.
        """
        ...


class DmaRequests(Protocol):
    """The request lines of DMA1 and DMA2; implemented by the DMA peripherals."""

    def request(self, line: str) -> bool:
        """Request one transfer for ``line`` ("I2C2_RX", "USART1_TX" as in RM0368 tables 28, 29).

        It is done at once. False: no stream serves the line now.
        """
        ...

    def remaining(self, line: str) -> int:
        """Return the transfers left (SxNDTR) of the stream that serves ``line``; 0 if none does."""
        ...


class Memory(Protocol):
    """The bus matrix for DMA (RM0368 section 2.1); implemented by the core.

    Accesses to a peripheral have side effects. ``size`` and ``len(data)`` are 1, 2 or 4.
    """

    def read(self, address: int, size: int) -> bytes | None:
        """Return the bytes at ``address``; None for a bus error."""
        ...

    def write(self, address: int, data: bytes) -> bool:
        """Write ``data``; False for a bus error."""
        ...


@dataclass
class Soc:
    """The chip's internal connections. The fields that are peripherals themselves are set during assembly."""

    clock: Clock
    trace: Trace
    gpio: Gpio
    reset: Callable[[str], None]
    """Reset the chip, for the reason given ("IWDG", "WWDG", "SYSRESETREQ")."""
    clocks: ClockTree = field(init=False)
    irq: InterruptLines = field(init=False)
    dma: DmaRequests = field(init=False)
    memory: Memory = field(init=False)


# -- interrupt inputs that several peripherals share (RM0368 table 38: TIM1_BRK and TIM9 are both number 24) -----


class InterruptInput:
    """One NVIC input, active while any of its sources is: the OR gate before the NVIC.

    Peripherals that share a number share the object; each has a ``source`` name.
    """

    def __init__(self, soc: Soc, number: int) -> None:
        self.number = number
        self._soc = soc
        self._active: set[str] = set()

    def set(self, source: str, level: bool) -> None:
        """Set or clear ``source``; the NVIC is called only at changes."""
        if level == (source in self._active):
            return
        before = bool(self._active)
        if level:
            self._active.add(source)
        else:
            self._active.discard(source)
        if bool(self._active) is not before:
            self._soc.irq.set_line(self.number, not before)


# -- one peripheral ----------------------------------------------------------------------------------------------

WORD = 0xFFFF_FFFF
NOT_CACHEABLE_PS = -1

RegisterWritten = Callable[[int, int], None]
"""Called with (old value, new value) after a register has changed or the same value was written again."""


class Peripheral:
    """One peripheral at ``base``; ``size`` bytes of the address space belong to it.

    ``declared``: its registers (:mod:`fcu_emulator.emulator.chip.registers`). They define ``REGISTERS``, the
    reset value by offset, and ``WRITABLE``, the bits that store written values. Unlisted offsets read as 0
    and ignore writes, and the core notes the access by name.
    """

    index: int | None = None
    """The index among the peripherals in C; None for one in Python."""
    REGISTERS: ClassVar[dict[int, int]] = {}
    NAMES: Mapping[int, str] = MappingProxyType({})
    """The reference manual's name of each register, by offset: for the trace and for diagnoses."""
    WRITABLE: ClassVar[dict[int, int]] = {}

    def __init_subclass__(cls, declared: DeclaredPeripheral | None = None) -> None:
        if declared is not None:
            cls.REGISTERS, cls.NAMES, cls.WRITABLE = declared.resets, declared.names, declared.stored

    def __init__(self, soc: Soc, name: str, base: int, size: int = 0x400) -> None:
        self.soc = soc
        self.name = name
        self.base = base
        self.size = size
        self.clocked = True
        """Set by RCC: a peripheral without clock reads as 0 and ignores writes; the core reports such accesses."""
        self.registers = dict(self.REGISTERS)
        self._noted: set[tuple[str, str]] = set()

    def note(self, what: str, text: str) -> None:
        """Add a trace note about a "forbidden", "refused" or "not modelled" access of firmware.

        The same note is added once only: firmware repeats itself thousands of times a second.
        """
        if (what, text) not in self._noted:
            self._noted.add((what, text))
            self.soc.trace.add(DeviceNote(self.soc.clock.now_ps, self.name, what, text))

    def gate(self, *, clocked: bool) -> None:
        """Switch the clock of the peripheral on or off, for RCC."""
        self.clocked = clocked

    def reset(self) -> None:
        """Restore the state after reset (system reset, or the peripheral's bit in RCC_xxxRSTR)."""
        self.registers = dict(self.REGISTERS)

    def read(self, offset: int) -> int:
        """Return the word at a word-aligned ``offset``, with side effects."""
        return self.registers.get(offset, 0)

    def peek(self, offset: int) -> int:
        """Return the word at ``offset`` without side effects: for debuggers and diagnoses."""
        return self.registers.get(offset, 0)

    def write(self, offset: int, value: int, mask: int = WORD) -> None:
        """Write the bits of ``mask`` of the word at ``offset``."""
        mask &= self.WRITABLE.get(offset, WORD)
        if offset in self.registers:
            self.registers[offset] = self.registers[offset] & ~mask | value & mask

    def pure_read(self, offset: int) -> bool:
        """Return whether a read of ``offset`` has no side effect and is constant until ``next_change_ps()``.

        Only then may a loop that polls it be skipped. False for counters that run with time, and for data
        registers.
        """
        del offset
        return True

    def read_with_validity(self, offset: int) -> tuple[int, int]:
        """Return ``read``, and the end of the value's validity without further accesses and events of the clock.

        That is ``NOT_CACHEABLE_PS`` if the read has a side effect. Frequently polled peripherals override this with
        one step.
        """
        pure = self.pure_read(offset)
        value = self.read(offset)
        return value, self.next_change_ps() if pure else NOT_CACHEABLE_PS

    def next_change_ps(self) -> int:
        """Return when a register may next change without an access and without an event of the clock."""
        return NEVER_PS
