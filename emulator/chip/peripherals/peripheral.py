"""The interface of a peripheral, and the connections that peripherals share.

When firmware accesses a register, ``soc.clock.now_ps`` is exact and all due events have been
handled. A peripheral computes its state when firmware reads this state. It schedules events for
interrupts, pins and DMA. ``write`` gets a mask of the accessed bits.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import ClassVar, Protocol

from fcu_emulator.emulator.buses.gpio import Gpio
from fcu_emulator.emulator.chip.registers.declaration import DeclaredPeripheral
from fcu_emulator.emulator.clock import NEVER_PS, Clock
from fcu_emulator.emulator.trace import DeviceNote, NoteValue, Trace

# -- the internal connections of the chip -------------------------------------------------------------------


class ClockTree(Protocol):
    """Clock frequencies that RCC's registers select (RM0368 section 6.2)."""

    sysclk_hz: int
    hclk_hz: int
    nominal_hclk_hz: int
    """HCLK if the oscillators were exact; the manual's limits apply to this value."""
    pclk1_hz: int
    nominal_pclk1_hz: int
    pclk2_hz: int
    timer1_hz: int
    """Clock of the timers on APB1: twice PCLK1, or four times if TIMPRE is set, but at most HCLK."""
    timer2_hz: int
    """Clock of the timers on APB2: twice PCLK2, or four times if TIMPRE is set, but at most HCLK."""
    lsi_hz: int
    """The internal oscillator of 32 kHz; 0 while it is not ready."""
    lse_hz: int

    def on_change(self, changed: Callable[[], None]) -> None: ...


class InterruptLines(Protocol):
    """The NVIC's inputs, implemented by the core."""

    def set_line(self, number: int, level: bool) -> None:
        """Set input ``number`` (IRQn). If an input is active after its handler, it becomes pending again."""
        ...


@dataclass
class Soc:
    """The chip's internal connections, completed during assembly."""

    clock: Clock
    trace: Trace
    gpio: Gpio
    reset: Callable[[str], None]
    """Reset the chip because of "IWDG", "WWDG" or "SYSRESETREQ"."""
    clocks: ClockTree = field(init=False)
    irq: InterruptLines = field(init=False)


# -- shared interrupt inputs (RM0368 table 38) -------------------------------------------------------------------


class InterruptInput:
    """One NVIC input, active while any peripheral's ``source`` is active."""

    def __init__(self, soc: Soc, number: int) -> None:
        self.number = number
        self._soc = soc
        self._active: set[str] = set()

    def set(self, source: str, level: bool) -> None:
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
"""Called with (old value, new value) after each write."""


class Peripheral:
    """One peripheral at ``base``, with its ``declared`` registers.

    ``REGISTERS`` has the reset value of each offset, and ``WRITABLE`` has the stored bits. Other offsets read as 0
    and ignore writes.
    """

    index: int | None = None
    """Index among the peripherals implemented in C; None if implemented in Python."""
    REGISTERS: ClassVar[dict[int, int]] = {}
    NAMES: Mapping[int, str] = MappingProxyType({})
    """The manual's names of registers, by offset."""
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
        """Set by RCC. Without clock, registers read as 0 and ignore writes."""
        self.registers = dict(self.REGISTERS)
        self._noted: set[tuple[str, str]] = set()

    def note(self, what: str, problem: str, text: str, **data: NoteValue) -> None:
        """Add a note "forbidden", "refused" or "not modelled" unless it was added before.

        See :class:`DeviceNote`.
        """
        if (what, text) not in self._noted:
            self._noted.add((what, text))
            self.soc.trace.add(DeviceNote(self.soc.clock.now_ps, self.name, what, text, problem, data))

    def gate(self, *, clocked: bool) -> None:
        self.clocked = clocked

    def reset(self) -> None:
        self.registers = dict(self.REGISTERS)

    def read(self, offset: int) -> int:
        return self.registers.get(offset, 0)

    def peek(self, offset: int) -> int:
        """Return the register's word without side effects."""
        return self.registers.get(offset, 0)

    def write(self, offset: int, value: int, mask: int = WORD) -> None:
        mask &= self.WRITABLE.get(offset, WORD)
        if offset in self.registers:
            self.registers[offset] = self.registers[offset] & ~mask | value & mask

    def pure_read(self, offset: int) -> bool:
        """Return whether a read has no side effect and its value is constant until ``next_change_ps()``."""
        del offset
        return True

    def read_with_validity(self, offset: int) -> tuple[int, int]:
        """Return the value of ``read`` and the time of its next change.

        The time is ``NOT_CACHEABLE_PS`` if the read may have had a side effect.
        """
        pure = self.pure_read(offset)
        value = self.read(offset)
        return value, self.next_change_ps() if pure else NOT_CACHEABLE_PS

    def same_write_until_ps(self, offset: int, value: int) -> int:
        """Return the time until which an immediate repetition of the write has no effect."""
        del offset, value
        return NOT_CACHEABLE_PS

    def next_change_ps(self) -> int:
        """Return the time of the next change that happens without an access or event."""
        return NEVER_PS

    def quiet_since_ps(self) -> int | None:
        """Return the time of the latest activity if only firmware can start another activity.

        None: signals from outside can change the registers.
        """
        return None
