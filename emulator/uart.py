"""A USART's serial line: which bytes are on the wire when (reference manual RM0368 section 19).

Sending has two stages, the data register and the shift register: a byte may be written as soon as the one
before has moved on to the shift register (TXE), so a sender that is not interrupted keeps the line busy
without gaps, and one that is interrupted leaves a gap. Runs of bytes without a gap are kept as one piece,
never byte by byte.

Receiving has one data register: a byte that completes while the one before has not been read is lost and
counted (ORE), exactly as on the board; the stock firmware never reads, so all but the first are lost there
too.

Decision: the terminal follows the chip's bit rate, so text sent at a wrong rate stays readable here, where a
real terminal at 115200 baud shows garbage. Whoever sets another rate says so in the trace. Sampling the wire
at the terminal's rate would show the garbage, but no hint of its cause.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from fractions import Fraction
from functools import partial

from emulator.clock import PS_PER_S, Clock
from emulator.trace import Fault, TerminalBytes, Trace

BAUD = 115_200
_FRAME_BITS = 10  # start, eight data, stop
_KEPT = 16 << 20  # bytes of terminal text kept in memory; older ones are dropped and counted


def divider(kernel_clock_hz: int, baud: int) -> int:
    """The BRR value for oversampling by 16: clock over baud, rounded to the nearest (RM0368 19.3.4)."""
    return (kernel_clock_hz + baud // 2) // baud


class _Run:
    """Frames on the wire without a gap. Each one's time is computed from the first one's, so none drifts."""

    __slots__ = ("connected", "done", "frame_ps", "start_ps", "waiting")

    def __init__(self, start_ps: int, frame_ps: Fraction, connected: bool = True) -> None:
        self.start_ps = start_ps
        self.frame_ps = frame_ps
        self.connected = connected
        self.done = 0  # bytes that have arrived and are forgotten here
        self.waiting = bytearray()

    def count(self) -> int:
        """All its frames so far."""
        return self.done + len(self.waiting)

    def time_ps(self, frames: int) -> int:
        """The end of the ``frames``-th frame."""
        return self.start_ps + frames * self.frame_ps.numerator // self.frame_ps.denominator

    def take(self, now_ps: int) -> bytearray:
        """The bytes that have become complete by ``now_ps``."""
        ticks = (now_ps - self.start_ps + 1) * self.frame_ps.denominator - 1
        ready = max(ticks // self.frame_ps.numerator - self.done, 0)
        arrived = self.waiting[:ready]
        del self.waiting[:ready]
        self.done += len(arrived)
        return arrived


class Uart:
    """One USART with a line to a terminal.

    The bit time is the divider's, as on the board: 84 MHz / 729 is 115226 baud, 0.02 % above the nominal
    rate.
    """

    def __init__(self, name: str, clock: Clock, trace: Trace, kernel_clock_hz: int, baud: int = BAUD) -> None:
        self.name = name
        self._clock = clock
        self._trace = trace
        self.brr = divider(kernel_clock_hz, baud)
        self._frame_ps = Fraction(_FRAME_BITS * self.brr * PS_PER_S, kernel_clock_hz)
        self.txe_ps = 0  # when the data register is next empty
        self.idle_ps = 0  # when the line is next idle (TC)
        self._run = _Run(0, self._frame_ps)
        self._on_wire = deque((self._run,))  # runs with frames not yet complete; the latest one stays
        self._text = bytearray()
        self.dropped = 0
        self._rx_line_free_ps = 0
        self._rx_data: int | None = None
        self.rx_lost = 0
        self.connected = True
        """Whether the transmitter's pin is; without it frames take their time and reach nobody."""
        self.receiver_on = True
        self.overrun = False
        """Whether a byte was lost since the flag was last cleared (ORE)."""
        self.rx_idle = False
        """Whether the line was idle for a frame after a byte since the flag was last cleared (IDLE)."""
        self.on_receive: Callable[[], None] | None = None
        """Called after a received byte or an idle line has changed one of the flags above."""

    def set_frame(self, frame_ps: Fraction) -> None:
        """Frames of another length, from the next byte on."""
        if frame_ps != self._frame_ps:
            self._frame_ps = frame_ps

    def frames_ps(self, count: int) -> int:
        """Time of ``count`` frames on the wire."""
        return count * self._frame_ps.numerator // self._frame_ps.denominator

    # -- sending ----------------------------------------------------------------------------------------

    def write(self, data: bytes, until_ps: int) -> int:
        """Write bytes to the data register, each as soon as it is empty, but none after ``until_ps``.

        The sender is there from now until ``until_ps``. The first byte is always written (the caller has
        waited for ``txe_ps``). Returns the number written.
        """
        run = self._open_run()
        start_ps = self.idle_ps if run.count() else run.start_ps
        room = max(until_ps - start_ps, 0)
        count = min(len(data), 1 + -(-room * self._frame_ps.denominator // self._frame_ps.numerator))
        piece = data[:count]
        run.waiting += piece
        frames = run.count()
        self.txe_ps, self.idle_ps = run.time_ps(frames - 1), run.time_ps(frames)
        if self._trace.detailed and run.connected:
            self._trace.add_detail(TerminalBytes(start_ps, "tx", piece))
        return count

    def send(self, value: int) -> bool:
        """Write one byte to the data register now; False if it took the place of one still waiting there."""
        if self._clock.now_ps >= self.txe_ps:
            self.write(bytes((value,)), self._clock.now_ps)
            return True
        self._run.waiting[-1] = value
        return False

    def received(self) -> bytearray:
        """What has arrived at the terminal by now, of long runs the latest part. Not to be changed."""
        now_ps = self._clock.now_ps
        for run in self._on_wire:
            arrived = run.take(now_ps)
            if run.connected:
                self._text += arrived
        while len(self._on_wire) > 1 and not self._on_wire[0].waiting:
            self._on_wire.popleft()
        if len(self._text) > _KEPT:
            excess = len(self._text) - _KEPT // 2
            del self._text[:excess]
            self.dropped += excess
        return self._text

    def received_count(self) -> int:
        """How many bytes have arrived at the terminal by now, those no longer kept included."""
        kept = len(self.received())  # which may drop some
        return self.dropped + kept

    def _open_run(self) -> _Run:
        """The run that the next frame belongs to: another one after a gap or when frames become others."""
        run = self._run
        gap = self._clock.now_ps > self.idle_ps
        if gap or run.frame_ps is not self._frame_ps or run.connected is not self.connected:
            start_ps = max(self._clock.now_ps, self.idle_ps)
            self._run = run = _Run(start_ps, self._frame_ps, self.connected)
            self._on_wire.append(run)
        return run

    # -- receiving --------------------------------------------------------------------------------------

    def type(self, data: bytes) -> None:
        """The terminal sends bytes, one frame after the other, from now on."""
        start_ps = max(self._clock.now_ps, self._rx_line_free_ps)
        if self._trace.detailed and data:
            self._trace.add_detail(TerminalBytes(start_ps, "rx", data))
        for number, value in enumerate(data, start=1):
            self._clock.schedule(start_ps + self.frames_ps(number), partial(self._arrive, value))
        self._rx_line_free_ps = start_ps + self.frames_ps(len(data))
        if self.on_receive is not None:
            self._clock.schedule(self._rx_line_free_ps + self.frames_ps(1), self._line_idle)

    @property
    def rxne(self) -> bool:
        """Whether a received byte waits in the data register."""
        return self._rx_data is not None

    def read_data(self) -> int | None:
        """Read the data register: the byte received, or None when RXNE is not set."""
        value, self._rx_data = self._rx_data, None
        return value

    def _arrive(self, value: int) -> None:
        if not self.receiver_on:
            return
        if self._rx_data is None:
            self._rx_data = value
        else:
            self.rx_lost += 1
            self.overrun = True
            text = f"overrun: received byte 0x{value:02X} is lost"
            self._trace.add(Fault(self._clock.now_ps, self.name, text))
        if self.on_receive is not None:
            self.on_receive()

    def _line_idle(self) -> None:
        """A frame's time after the last stop bit: an idle frame, if nothing has begun meanwhile."""
        if self.on_receive is not None and self._rx_line_free_ps < self._clock.now_ps and self.receiver_on:
            self.rx_idle = True
            self.on_receive()
