"""A USART's serial line (RM0368 section 19).

A received byte is lost if the previous byte is unread (ORE).

Decision: the terminal follows the chip's bit rate, so text sent at a wrong rate stays readable
here. A real terminal shows garbage, and the trace records the wrong rate.
"""

from __future__ import annotations

import codecs
from bisect import bisect_right
from collections import deque
from dataclasses import dataclass
from fractions import Fraction
from typing import Protocol

from fcu_emulator.emulator.clock import PS_PER_S, Clock
from fcu_emulator.emulator.trace import Fault, TerminalBytes, Trace

BAUD = 115_200
_FRAME_BITS = 10  # start, eight data, stop
_KEPT = 16 << 20  # bytes of terminal text; older bytes are dropped and counted


def divider(kernel_clock_hz: int, baud: int) -> int:
    """Return BRR for oversampling by 16 (RM0368 19.3.4)."""
    return (kernel_clock_hz + baud // 2) // baud


NOT_UTF_8 = "latin-1-where-not-utf-8"


def _as_latin_1(error: UnicodeError) -> tuple[str, int]:
    assert isinstance(error, UnicodeDecodeError)
    return error.object[error.start : error.end].decode("latin-1"), error.end


codecs.register_error(NOT_UTF_8, _as_latin_1)


def decoded(data: bytes | bytearray) -> str:
    """Return text decoded as UTF-8, with invalid bytes as Latin-1."""
    return data.decode("utf-8", NOT_UTF_8)


class _ByteRun:
    """Frames without gaps, timed from the first frame."""

    __slots__ = ("connected", "done", "frame_ps", "start_ps", "waiting")

    def __init__(self, start_ps: int, frame_ps: Fraction, connected: bool = True) -> None:
        self.start_ps = start_ps
        self.frame_ps = frame_ps
        self.connected = connected
        self.done = 0  # bytes that have arrived
        self.waiting = bytearray()

    def count(self) -> int:
        return self.done + len(self.waiting)

    def time_ps(self, frames: int) -> int:
        return self.start_ps + frames * self.frame_ps.numerator // self.frame_ps.denominator

    def take(self, now_ps: int) -> bytearray:
        ticks = (now_ps - self.start_ps + 1) * self.frame_ps.denominator - 1
        ready = max(ticks // self.frame_ps.numerator - self.done, 0)
        arrived = self.waiting[:ready]
        del self.waiting[:ready]
        self.done += len(arrived)
        return arrived


class ArrivalTimes:
    """Arrival times of output bytes; ``number`` counts from 0 at power-on."""

    def __init__(self) -> None:
        self._runs: list[tuple[int, int, Fraction]] = []  # of each run: first byte, start, frame duration

    def add(self, first: int, run: _ByteRun) -> None:
        if not self._runs or self._runs[-1][0] != first:
            self._runs.append((first, run.start_ps, run.frame_ps))

    def ps(self, number: int) -> int:
        """Return a byte's arrival time; 0 for a byte before the recording."""
        index = bisect_right(self._runs, number, key=lambda run: run[0]) - 1
        if index < 0:
            return 0
        first, start_ps, frame_ps = self._runs[index]
        return start_ps + (number - first + 1) * frame_ps.numerator // frame_ps.denominator

    def forget(self, before: int) -> None:
        """Forget the times of bytes before ``before``."""
        del self._runs[: max(bisect_right(self._runs, before, key=lambda run: run[0]) - 1, 0)]


class Transceiver(Protocol):
    """A chip's USART, which calls ``open_run`` and ``carry`` of :class:`Uart`."""

    def flush(self) -> None:
        """Put all pending bytes on the line."""
        ...

    def frame_ps(self) -> Fraction | None:
        """Return a frame's duration; None without a bit clock."""
        ...

    def frame_bits(self) -> Fraction: ...

    def receive(self, value: int) -> bool:
        """Receive a byte. Return False if it is lost."""
        ...

    def line_idle(self) -> None:
        """Handle a line that is idle for one frame."""
        ...


@dataclass
class _Typed:
    """Consecutive typed bytes, which begin at ``start_ps``."""

    start_ps: int
    frame_ps: Fraction
    data: bytearray
    arrived: int = 0  # number of bytes before ``data``

    def arrives_ps(self, number: int) -> int:
        """Return the arrival time of byte ``number``, counted from 1."""
        count = self.arrived + number
        return self.start_ps + count * self.frame_ps.numerator // self.frame_ps.denominator


class Uart:
    """One USART with a terminal, at the divider's exact rate."""

    def __init__(self, name: str, clock: Clock, trace: Trace, kernel_clock_hz: int, baud: int = BAUD) -> None:
        self.name = name
        self._clock = clock
        self._trace = trace
        self.brr = divider(kernel_clock_hz, baud)
        self._frame_ps = Fraction(_FRAME_BITS * self.brr * PS_PER_S, kernel_clock_hz)
        self.txe_ps = 0  # time at which the data register is next empty
        self.idle_ps = 0  # time at which the line is next idle (TC)
        self._run = _ByteRun(0, self._frame_ps)
        self._on_wire = deque((self._run,))  # the runs that are not complete, and the latest run
        self._text = bytearray()
        self.dropped = 0
        self._skipped: list[
            tuple[int, int]
        ] = []  # ranges of skipped byte numbers: the first, and the last plus one
        self._times: list[ArrivalTimes] = []
        self._typed: deque[_Typed] = deque()  # bytes on the way to the board
        self._rx_line_free_ps = 0
        self._rx_data: int | None = None
        self.rx_lost = 0
        self._transceiver: Transceiver | None = None

    def frames_ps(self, count: int) -> int:
        """Return the duration of ``count`` frames, even without a bit clock."""
        frame_ps = self._present_frame_ps()
        return count * frame_ps.numerator // frame_ps.denominator

    @property
    def bit_rate(self) -> float:
        """Bits per second; the terminal's rate without a bit clock."""
        chip = self._transceiver
        frame_ps = chip.frame_ps() if chip is not None else None
        if chip is None or frame_ps is None:
            return float(_FRAME_BITS * PS_PER_S / self._frame_ps)
        return float(chip.frame_bits() * PS_PER_S / frame_ps)

    def _present_frame_ps(self) -> Fraction:
        frame_ps = self._transceiver.frame_ps() if self._transceiver is not None else None
        return frame_ps or self._frame_ps

    # -- sending ----------------------------------------------------------------------------------------

    def send(self, data: bytes, until_ps: int) -> int:
        """Write bytes until ``until_ps``, each as soon as the data register is empty.

        Return the number of written bytes, at least one.
        """
        run = self._open_run()
        start_ps = self.idle_ps if run.count() else run.start_ps
        room = max(until_ps - start_ps, 0)
        count = min(len(data), 1 + -(-room * self._frame_ps.denominator // self._frame_ps.numerator))
        piece = data[:count]
        run.waiting += piece
        frames = run.count()
        self.txe_ps, self.idle_ps = run.time_ps(frames - 1), run.time_ps(frames)
        if self._trace.detailed:
            self._trace.add_detail(TerminalBytes(start_ps, "tx", piece))
        return count

    def received(self) -> bytearray:
        """Return the latest bytes; do not change them."""
        self.catch_up()
        now_ps = self._clock.now_ps
        for run in self._on_wire:
            arrived = run.take(now_ps)
            if arrived and run.connected:
                self._text += arrived
                for times in self._times:
                    times.add(self._count() - run.done, run)
        while len(self._on_wire) > 1 and not self._on_wire[0].waiting:
            self._on_wire.popleft()
        if len(self._text) > _KEPT:
            excess = len(self._text) - _KEPT // 2
            del self._text[:excess]
            self.dropped += excess
        return self._text

    def arrival_times(self) -> ArrivalTimes:
        """Record arrival times. The caller must drop old times with ``forget``."""
        self.received()
        self._times.append(ArrivalTimes())
        return self._times[-1]

    def release_times(self, times: ArrivalTimes) -> None:
        """Stop adding to ``times``."""
        self._times.remove(times)

    def received_count(self) -> int:
        """Return the number of received bytes, including dropped bytes and skipped numbers."""
        self.received()
        return self._count()

    def index_of(self, number: int) -> int:
        """Return the index in :meth:`received` of the byte with this number, or of the next kept byte."""
        skipped = sum(min(max(number, begin), end) - begin for begin, end in self._skipped)
        return max(number - skipped - self.dropped, 0)

    def skip_numbers(self, until: int) -> None:
        """Give the next byte the number ``until`` or a higher one, because readers have read a discarded run up to it."""
        count = self.received_count()
        if until > count:
            self._skipped.append((count, until))

    def _count(self) -> int:
        return self.dropped + len(self._text) + sum(end - begin for begin, end in self._skipped)

    def _open_run(self) -> _ByteRun:
        if self._clock.now_ps > self.idle_ps:
            self._run = _ByteRun(self._clock.now_ps, self._frame_ps)
            self._on_wire.append(self._run)
        return self._run

    # -- a chip's own USART -----------------------------------------------------------------------------

    def connect(self, transceiver: Transceiver) -> None:
        self._transceiver = transceiver

    def catch_up(self) -> None:
        """Put bytes sent by the chip on the line."""
        if self._transceiver is not None:
            self._transceiver.flush()

    def open_run(self, start_ps: int, frame_ps: Fraction, *, connected: bool) -> None:
        self._run = _ByteRun(start_ps, frame_ps, connected)
        self._on_wire.append(self._run)

    def carry(self, data: bytes, *, detailed: bool) -> None:
        run = self._run
        first = run.count()
        run.waiting += data
        self.txe_ps, self.idle_ps = run.time_ps(first + len(data) - 1), run.time_ps(first + len(data))
        if detailed and run.connected:
            self._trace.add_detail(TerminalBytes(run.time_ps(first), "tx", data))

    def replace_last(self, value: int) -> None:
        """Replace the latest byte, which firmware has overwritten in the data register."""
        self._run.waiting[-1] = value

    # -- receiving --------------------------------------------------------------------------------------

    def type(self, data: bytes) -> None:
        if not data:
            return
        self._clock.inputs += 1
        start_ps = max(self._clock.now_ps, self._rx_line_free_ps)
        if self._trace.detailed:
            self._trace.add_detail(TerminalBytes(start_ps, "rx", data))
        frame_ps = self._present_frame_ps()
        last = self._typed[-1] if self._typed else None
        if last is not None and self._rx_line_free_ps == start_ps and last.frame_ps == frame_ps:
            last.data += data
        else:
            last = _Typed(start_ps, frame_ps, bytearray(data))
            self._typed.append(last)
            if len(self._typed) == 1:
                self._clock.schedule(last.arrives_ps(1), self._next_arrives)
        self._rx_line_free_ps = last.arrives_ps(len(last.data))
        if self._transceiver is not None:
            self._clock.schedule(self._rx_line_free_ps + self.frames_ps(1), self._line_idle)

    @property
    def typing_left(self) -> int:
        return sum(len(typed.data) for typed in self._typed)

    @property
    def rxne(self) -> bool:
        return self._rx_data is not None

    def read_data(self) -> int | None:
        """Read the data register; None if RXNE is not set."""
        value, self._rx_data = self._rx_data, None
        return value

    def _next_arrives(self) -> None:
        typed = self._typed[0]
        value = typed.data[0]
        del typed.data[:1]  # a bytearray does not move its other bytes
        typed.arrived += 1
        if not typed.data:
            self._typed.popleft()
        if self._typed:
            self._clock.schedule(self._typed[0].arrives_ps(1), self._next_arrives)
        self._arrive(value)

    def _arrive(self, value: int) -> None:
        if self._transceiver is not None:
            taken = self._transceiver.receive(value)
        else:
            taken = self._rx_data is None
            self._rx_data = value if taken else self._rx_data
        if not taken:
            self.rx_lost += 1
            text = f"overrun: received byte 0x{value:02X} is lost"
            self._trace.add(Fault(self._clock.now_ps, self.name, text))

    def _line_idle(self) -> None:
        if self._transceiver is not None and self._rx_line_free_ps < self._clock.now_ps:
            self._transceiver.line_idle()
