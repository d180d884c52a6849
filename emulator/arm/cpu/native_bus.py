"""Time, the run under way and waiting, where the native engine can see them (emulator/arm/native/bus.h).

The classes do what :mod:`timeline`, :mod:`slice` and :mod:`waiting` say; only where the numbers are kept
differs, and that loops are looked for in C.
"""

from __future__ import annotations

import ctypes
import weakref
from collections.abc import Callable, Iterable
from fractions import Fraction

from emulator.arm.cpu.native_engine import NativeEngine
from emulator.arm.cpu.nvic import Nvic
from emulator.arm.cpu.slice import Slice
from emulator.arm.cpu.timeline import Timeline
from emulator.arm.cpu.waiting import Waiting
from emulator.clock import Clock

_FIRE = ctypes.CFUNCTYPE(ctypes.c_bool, ctypes.c_int64)


class _NativeTimeline(ctypes.Structure, Timeline):
    _fields_ = tuple(
        (name, ctypes.c_int64) for name in ("count", "origin_ps", "num", "den", "extra", "cycle")
    )


class _NativeSlice(ctypes.Structure, Slice):
    _fields_ = tuple((name, ctypes.c_int64) for name in ("end", "end_ps", "at_ps", "until_ps"))

    def end_in_time(self) -> None:
        """After something has been scheduled or made pending: end the run when it matters."""
        if not self.engine.running:
            return
        if self.nvic.changed:
            self.limit.value = self.counter.value  # the engine looks whether something is to be taken
        self._end_by_then()


class _NativeWaiting(ctypes.Structure, Waiting):
    _fields_ = tuple((name, ctypes.c_int64) for name in ("accesses", "skipped", "kept", "skips"))

    bus: NativeBus

    @property
    def comparing(self) -> bool:
        """Whether there are passages that a disturbance would make useless."""
        return bool(self.kept)

    def disturb(self) -> None:
        """An access that is no mere look at a register."""
        self.accesses += 1
        if self.kept:
            self.forget()

    def forget(self) -> None:
        """Something has happened that the next iteration need not repeat."""
        self.bus.library.waiting_forget(self.bus.handle)

    def know_loop(self, addresses: Iterable[int], period: int) -> None:
        """An iteration of the loop at these addresses has so many instructions; 0 forgets it."""
        for address in addresses:
            self.bus.library.idle_add(self.bus.handle, ctypes.c_uint32(address), ctypes.c_uint32(period))

    def polled(self, position: int, register: int, now_ps: int, until_ps: int) -> bool:
        """The instruction at ``position`` has read a register, which will be the same until ``until_ps``."""
        again: bool = self.bus.library.waiting_polled(self.bus.handle, position, register, now_ps, until_ps)
        return again


class NativeBus:
    """The numbers that C shares; each part is made once."""

    def __init__(self, engine: NativeEngine) -> None:
        self.library = engine.library
        handle = self.library.bus_create(engine.handle)
        if handle is None:
            raise MemoryError("the native engine's bus")
        self.engine = engine
        self.handle = ctypes.c_void_p(handle)
        weakref.finalize(self, self.library.bus_destroy, self.handle)
        slice_at = handle + ctypes.sizeof(_NativeTimeline)
        waiting_at = slice_at + ctypes.sizeof(_NativeSlice)
        self._line = _NativeTimeline.from_address(handle)
        self._slice = _NativeSlice.from_address(slice_at)
        self._waiting = _NativeWaiting.from_address(waiting_at)

    def fire_by(self, fire: Callable[[int], bool]) -> None:
        """``fire(now_ps)`` carries out what the clock has for now; False if that ends the run."""
        self._fire = _FIRE(fire)
        self.library.bus_fire_by(self.handle, self._fire)

    def timeline(self, hclk_hz: int, cycles_per_instruction: Fraction) -> Timeline:
        """See :class:`Timeline`."""
        Timeline.__init__(self._line, hclk_hz, cycles_per_instruction)
        return self._line

    def slice(self, timeline: Timeline, clock: Clock, nvic: Nvic) -> Slice:
        """See :class:`Slice`."""
        Slice.__init__(self._slice, self.engine, timeline, clock, nvic)
        return self._slice

    def waiting(self, run: Slice, enabled: bool) -> Waiting:
        """See :class:`Waiting`."""
        Waiting.__init__(self._waiting, run, enabled)
        self._waiting.bus, self._waiting.skips = self, enabled
        return self._waiting
