"""The sequence of an I2C block in C (emulator/arm/native/i2c.c), for the native engine.

It does what :class:`Sequence` does; the same tests hold for both. While neither an interrupt nor DMA waits
for flags and nothing is injected on the bus, the engine reads and writes CR1, SR1, SR2 and DR without coming
here: a byte on the wire is then all that Python is called for, and a device that is sure of the bytes that
come next tells them ahead. What reading them does is made up for before anything else happens.

What is under way ends when the engine looks. Before the clock fires anything, ``hand_over`` makes a deferred
call of it, so that its end keeps its place among the events.
"""

from __future__ import annotations

import ctypes
import weakref
from collections.abc import Callable
from fractions import Fraction
from typing import Any, Final

from emulator.arm.cpu.native_bus import NativeBus
from emulator.arm.cpu.slice import Slice
from emulator.arm.peripherals.i2c_sequence import DATA_LOST, STOP_EARLY, Sequence
from emulator.clock import NEVER_PS
from emulator.i2c_wire import Answer, I2CWire

_time = ctypes.c_int64
_ANSWERS: Final[tuple[Answer, ...]] = ("ack", "nack", "bus_error", "arbitration")  # enum Answer of i2c.h
_WRONG: Final = (DATA_LOST, STOP_EARLY)  # enum Wrong


_FUNCTIONS: Final[tuple[tuple[str, Any], ...]] = (
    ("address", ctypes.CFUNCTYPE(ctypes.c_int32, _time, ctypes.c_int32, _time)),
    ("write", ctypes.CFUNCTYPE(ctypes.c_int32, _time, ctypes.c_int32)),
    ("read", ctypes.CFUNCTYPE(ctypes.c_int32, _time)),
    ("stop", ctypes.CFUNCTYPE(None, _time)),
    ("abort", ctypes.CFUNCTYPE(None)),
    ("released_ps", ctypes.CFUNCTYPE(_time, _time)),
    ("note", ctypes.CFUNCTYPE(None, _time, ctypes.c_int32)),
)


class _Wire(ctypes.Structure):
    """struct Wire."""

    _fields_ = _FUNCTIONS


_NUMBERS: Final = (
    "control status1 status2 data due_ps nack_next seen alone checked may_be_held bit_ps byte_ps "
    "told taken told_until_ps"
)
_AHEAD: Final = 16  # bytes


class _I2c(ctypes.Structure):
    """The beginning of struct I2c."""

    _fields_ = (*((name, _time) for name in _NUMBERS.split()), ("ahead", ctypes.c_uint8 * _AHEAD))


class NativeSequence(_I2c, Sequence):
    """See :class:`Sequence`, and :meth:`make`. Its numbers are C's."""

    _library: ctypes.PyDLL
    _handle: ctypes.c_void_p

    @staticmethod
    def make(
        native: NativeBus,
        run: Slice,
        base: int,
        clocked: bool,
        wire: I2CWire,
        connected: Callable[[], bool],
        changed: Callable[[], None],
        note: Callable[[str, str], None],
    ) -> NativeSequence:
        """The sequence of the block at ``base``."""
        library = native.library
        callbacks = _Callbacks(run, wire, connected, note)
        handle = library.i2c_create(callbacks.table)
        if handle is None:
            raise MemoryError("the native engine's I2C block")
        sequence = NativeSequence.from_address(handle)
        sequence._library, sequence._handle = library, ctypes.c_void_p(handle)
        weakref.finalize(sequence, library.i2c_destroy, sequence._handle)
        sequence._callbacks = callbacks
        callbacks.sequence = sequence
        sequence._clock, sequence._wire, sequence._changed = run.clock, wire, changed
        sequence._planned, sequence._planned_ps = None, NEVER_PS
        sequence._ahead = b""
        # memory, because the attributes of a ctypes structure take five times as long
        told = (_time * 3).from_address(handle + _I2c.told.offset)
        sequence._told = memoryview(told).cast("B").cast("q")
        sequence._bytes_ahead = memoryview(sequence.ahead).cast("B")
        sequence._watched, sequence._clocked = False, clocked
        library.bus_attach_i2c(native.handle, sequence._handle, ctypes.c_uint32(base))
        run.clock.before_firing.append(sequence.hand_over)
        native.engine.when_a_run_has_ended.append(sequence.catch_up)
        wire.bus.when_broken.append(sequence._look_who_is_needed)
        sequence._look_who_is_needed()
        return sequence

    # -- who is needed ----------------------------------------------------------------------------------

    @property
    def watched(self) -> bool:
        """Whether an interrupt or DMA waits for flags: operations end in events of the clock."""
        return self._watched

    @watched.setter
    def watched(self, watched: bool) -> None:
        self._watched = watched
        self._look_who_is_needed()

    @property
    def clocked(self) -> bool:
        """Set by RCC."""
        return self._clocked

    @clocked.setter
    def clocked(self, clocked: bool) -> None:
        self._clocked = clocked
        self._look_who_is_needed()

    def _look_who_is_needed(self) -> None:
        self.may_be_held = self._wire.bus.has_faults
        self.alone = self._clocked and not self._watched and not self.may_be_held

    def tell_ahead(self) -> bool:
        """The bytes that come next, for C to take without calling; whether there are any."""
        ahead, until_ps = self._wire.read_ahead()
        if ahead:
            self._ahead = ahead = ahead[:_AHEAD]
            told = self._told
            self._bytes_ahead[: len(ahead)] = ahead
            told[0], told[1], told[2] = len(ahead), 0, until_ps
        return bool(ahead)

    def catch_up(self) -> None:
        """Bytes that C has taken of those told ahead have been read: the device and the wire hear of it."""
        if self._ahead:
            ahead, self._ahead = self._ahead, b""
            taken, self._told[0] = self._told[1], 0
            if taken:
                self._wire.taken(ahead[:taken])

    def hand_over(self, until_ps: int) -> None:
        """The clock is about to fire until then: what ends by then takes its place in the queue."""
        self.catch_up()
        if self.due_ps <= until_ps:
            self._plan_if_changed()

    def _plan_if_changed(self) -> None:
        if self.due_ps != self._planned_ps:
            self.plan_again()

    def plan_again(self) -> None:
        """``watched`` or the time has changed: the operation under way ends in the other way."""
        if self._planned is not None:
            self._planned.cancel()
            self._planned = None
        self._planned_ps = due_ps = self.due_ps
        if due_ps < NEVER_PS:
            put = self._clock.schedule if self._watched else self._clock.defer
            self._planned = put(due_ps, self._end)

    def _end(self) -> None:
        self._planned, self._planned_ps = None, NEVER_PS
        self._library.i2c_settle(self._handle, _time(self._clock.now_ps))
        if self._watched:
            self._changed()
        self._plan_if_changed()

    # -- what software does, from Python ----------------------------------------------------------------

    def settle(self) -> None:
        """Carry out what has become due by now."""
        if self.due_ps <= self._clock.now_ps:
            self._library.i2c_settle(self._handle, _time(self._clock.now_ps))
        self._plan_if_watched()

    def _plan_if_watched(self) -> None:
        if self._watched:
            self._plan_if_changed()

    def reset(self) -> None:
        """No operation, no flag, the bus let go in the middle of whatever was under way."""
        self._library.i2c_reset(self._handle)
        self.seen = 0
        self._plan_if_changed()

    def set_period(self, period_ps: Fraction | None) -> None:
        """The period of SCL from the next operation on; None: it does not run."""
        self.bit_ps = NEVER_PS if period_ps is None else int(period_ps)
        self.byte_ps = NEVER_PS if period_ps is None else int(9 * period_ps)

    def request(self, control: int) -> None:
        """CR1 was written: START and STOP are obeyed when no byte is under way."""
        self._library.i2c_request(self._handle, _time(control), _time(self._clock.now_ps))
        self._plan_if_watched()

    def clear_addr(self) -> None:
        """ADDR is cleared: the data phase begins."""
        self._library.i2c_clear_addr(self._handle, _time(self._clock.now_ps))
        self._plan_if_watched()

    def write_data(self, value: int) -> None:
        """DR was written: an address after SB, or a byte to be sent."""
        self._library.i2c_write_data(self._handle, _time(value), _time(self._clock.now_ps))
        self._plan_if_watched()

    def read_data(self) -> int:
        """DR was read: the shift register moves up, and SCL goes on if it was held."""
        value: int = self._library.i2c_read_data(self._handle, _time(self._clock.now_ps))
        self._plan_if_watched()
        return value


class _Callbacks:
    """What C calls: a byte on the wire, at its time. Nothing may be raised into it."""

    sequence: NativeSequence

    def __init__(
        self,
        run: Slice,
        wire: I2CWire,
        connected: Callable[[], bool],
        note: Callable[[str, str], None],
    ) -> None:
        self._slice, self._clock, self._nvic, self._engine = run, run.clock, run.nvic, run.engine
        self._wire, self._connected, self._note = wire, connected, note
        self._knows_ahead = False
        called = self._address, self._write, self._read, self._stop, self._abort, self._released, self._wrong
        kinds = (kind for _, kind in _FUNCTIONS)
        self.table = _Wire(*(kind(function) for kind, function in zip(kinds, called, strict=True)))

    def _arrive(self, now_ps: int) -> None:
        self.sequence.catch_up()
        self._clock.now_ps = now_ps

    def _done(self) -> None:
        if self._clock.next_ps < self._slice.end_ps or self._nvic.changed:
            self._slice.end_in_time()

    def _address(self, now_ps: int, address: int, start_ps: int) -> int:
        answer: Answer = "nack"
        try:
            self._arrive(now_ps)
            read = bool(address & 1)
            if self._connected():
                answer = self._wire.start(address >> 1, read=read, start_ps=start_ps)
            self._knows_ahead = read and answer == "ack" and self.sequence.tell_ahead()
            self._done()
        except BaseException as error:
            self._engine.keep_error(error)
        return _ANSWERS.index(answer)

    def _write(self, now_ps: int, value: int) -> int:
        acknowledged = False
        try:
            self._arrive(now_ps)
            acknowledged = self._wire.write_byte(value)
            self._done()
        except BaseException as error:
            self._engine.keep_error(error)
        return acknowledged

    def _read(self, now_ps: int) -> int:
        value = 0
        try:
            self._arrive(now_ps)
            value = self._wire.read_byte()
            if self._knows_ahead:
                self.sequence.tell_ahead()
            self._done()
        except BaseException as error:
            self._engine.keep_error(error)
        return value

    def _stop(self, now_ps: int) -> None:
        try:
            self._arrive(now_ps)
            self._wire.stop()
            self._done()
        except BaseException as error:
            self._engine.keep_error(error)

    def _abort(self) -> None:
        try:
            self._arrive(self._clock.now_ps)
            self._wire.abort()
        except BaseException as error:
            self._engine.keep_error(error)

    def _released(self, now_ps: int) -> int:
        try:
            self._clock.now_ps = now_ps
            return self._wire.released_ps() if self._wire.held() else 0
        except BaseException as error:
            self._engine.keep_error(error)
            return 0

    def _wrong(self, now_ps: int, wrong: int) -> None:
        try:
            self._clock.now_ps = now_ps
            self._note("forbidden", _WRONG[wrong])
        except BaseException as error:
            self._engine.keep_error(error)
