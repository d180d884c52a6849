"""Exceptions where the native engine can enter and leave them (emulator/arm/native/nvic.h, exceptions.c).

In the usual cases it does so without coming back; in all others nothing has happened yet, and it is done
here as :mod:`exceptions` says.
"""

from __future__ import annotations

import ctypes

from emulator.arm.cpu import scb as scb_registers
from emulator.arm.cpu.exceptions import Exceptions
from emulator.arm.cpu.frames import Frames
from emulator.arm.cpu.native_bus import NativeBus
from emulator.arm.cpu.nvic import FIRST_INTERRUPT, INTERRUPTS, Nvic
from emulator.arm.cpu.scb import Scb
from emulator.arm.cpu.timeline import Timeline

_WORD = (1 << 64) - 1
_NUMBERS = (
    "subpriority_bits changed event event_on_pending alone vtor align may_sleep base_return "
    "lowest floating_area thread_ps"
)
_SETS = ("pending", "enabled", "active", "lines")  # of two words each


class NativeNvic(ctypes.Structure, Nvic):
    """See :class:`Nvic`; made by :func:`nvic_of`."""

    bus: NativeBus

    _fields_ = (
        *((f"{name}_{half}", ctypes.c_uint64) for name in _SETS for half in ("low", "high")),
        *((name, ctypes.c_int64) for name in _NUMBERS.split()),
        ("priority", ctypes.c_int16 * (FIRST_INTERRUPT + INTERRUPTS)),
    )

    @property
    def pending(self) -> int:
        """Bit = exception number."""
        return int(self.pending_low | self.pending_high << 64)

    @pending.setter
    def pending(self, mask: int) -> None:
        self.pending_low, self.pending_high = mask & _WORD, mask >> 64

    @property
    def enabled(self) -> int:
        """Bit = exception number."""
        return int(self.enabled_low | self.enabled_high << 64)

    @enabled.setter
    def enabled(self, mask: int) -> None:
        self.enabled_low, self.enabled_high = mask & _WORD, mask >> 64

    @property
    def active(self) -> int:
        """Bit = exception number."""
        return int(self.active_low | self.active_high << 64)

    @active.setter
    def active(self, mask: int) -> None:
        self.active_low, self.active_high = mask & _WORD, mask >> 64

    @property
    def lines(self) -> int:
        """Bit = exception number."""
        return int(self.lines_low | self.lines_high << 64)

    @lines.setter
    def lines(self, mask: int) -> None:
        self.lines_low, self.lines_high = mask & _WORD, mask >> 64

    def set_line(self, number: int, level: bool) -> None:
        """Input ``number`` (0 to 84) is active or not."""
        self.bus.library.nvic_set_line(ctypes.byref(self), FIRST_INTERRUPT + number, level)

    def pend(self, number: int) -> None:
        """Make an exception pending."""
        self.bus.library.nvic_pend(ctypes.byref(self), number)

    def configured(self, register: int, value: int) -> None:
        """A register of the system control block that exceptions depend on has been written."""
        if register == scb_registers.VTOR:
            self.vtor = value
        elif register == scb_registers.SCR:
            self.may_sleep = bool(value & scb_registers.SLEEPONEXIT)
        elif register == scb_registers.CCR:
            self.align = bool(value & scb_registers.STKALIGN)
            self.base_return = bool(value & scb_registers.NONBASETHRDENA)


def nvic_of(bus: NativeBus) -> NativeNvic:
    """The one that C sees."""
    nvic = NativeNvic.from_address(bus.library.bus_nvic(bus.handle))
    nvic.bus = bus  # as long as one lives, so does the other
    nvic.alone = True
    nvic.reset()
    return nvic


class _NativeFrames(Frames):
    """Both sides save frames, so both note how low the stack has come."""

    def __init__(self, nvic: NativeNvic, bus: NativeBus) -> None:
        self._nvic = nvic
        super().__init__(bus.engine)

    @property
    def lowest(self) -> int:
        """The lowest address that the main stack has had at an exception entry."""
        return int(self._nvic.lowest)

    @lowest.setter
    def lowest(self, address: int) -> None:
        self._nvic.lowest = address

    @property
    def floating_area(self) -> int:
        """Where floating-point registers were last saved."""
        return int(self._nvic.floating_area)

    @floating_area.setter
    def floating_area(self, address: int) -> None:
        self._nvic.floating_area = address


class NativeExceptions(Exceptions):
    """See :class:`Exceptions`."""

    def __init__(self, bus: NativeBus, timeline: Timeline, nvic: NativeNvic, block: Scb) -> None:
        self._native, self._bus = nvic, bus
        super().__init__(bus.engine, timeline, nvic, block, _NativeFrames(nvic, bus))
        block.before_read = self._show_floating_area

    @property
    def thread_ps(self) -> int:
        """When Thread mode was last returned to."""
        return int(self._native.thread_ps)

    @thread_ps.setter
    def thread_ps(self, now_ps: int) -> None:
        self._native.thread_ps = now_ps

    def take_pending(self) -> bool:
        """Enter the most urgent pending exception, if it may preempt what is running."""
        engine = self._bus.engine
        engine.put_pc()
        if not self._bus.library.bus_take_exception(self._bus.handle):
            return super().take_pending()
        engine.take_pc()
        return True

    def _show_floating_area(self) -> None:
        """FPCAR is looked at: the latest frame that C has saved, if it was the latest of all."""
        if self._native.floating_area:
            self._scb.registers[scb_registers.FPCAR] = self._native.floating_area
            self._native.floating_area = 0
