"""USART1's serial line: which bytes are on the wire when (reference manual RM0368 section 19).

Sending has two stages, the data register and the shift register: a byte may be written as soon as the one
before has moved on to the shift register (TXE), so a sender that is not interrupted keeps the line busy
without gaps, and one that is interrupted leaves a gap. Runs of bytes without a gap are kept as one piece,
never byte by byte.

Receiving has one data register: a byte that completes while the one before has not been read is lost and
counted (ORE), exactly as on the board; the stock firmware never reads, so all but the first are lost there
too.
"""

from __future__ import annotations

from collections import deque
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
        self._run_ps, self._run_frames = 0, 0  # the frames since the line was last idle, so that none drifts
        self._on_wire: deque[tuple[int, bytes]] = deque()  # not yet complete: (first frame's start, bytes)
        self._text = bytearray()
        self.dropped = 0
        self._rx_line_free_ps = 0
        self._rx_data: int | None = None
        self.rx_lost = 0

    def frames_ps(self, count: int) -> int:
        """Time of ``count`` frames on the wire."""
        return count * self._frame_ps.numerator // self._frame_ps.denominator

    # -- sending ----------------------------------------------------------------------------------------

    def write(self, data: bytes, until_ps: int) -> int:
        """Write bytes to the data register, each as soon as it is empty, but none after ``until_ps``.

        The sender is there from now until ``until_ps``. The first byte is always written (the caller has
        waited for ``txe_ps``). Returns the number written.
        """
        if self._clock.now_ps > self.idle_ps:  # there is a gap on the line: a new run of frames begins
            self._run_ps, self._run_frames = self._clock.now_ps, 0
        start_ps = self._run_ps + self.frames_ps(self._run_frames)
        room = max(until_ps - start_ps, 0)
        count = min(len(data), 1 + -(-room * self._frame_ps.denominator // self._frame_ps.numerator))
        piece = data[:count]
        self._run_frames += count
        self.txe_ps = self._run_ps + self.frames_ps(self._run_frames - 1)
        self.idle_ps = self._run_ps + self.frames_ps(self._run_frames)
        self._on_wire.append((start_ps, piece))
        if self._trace.detailed:
            self._trace.add_detail(TerminalBytes(start_ps, "tx", piece))
        return count

    def received(self) -> bytearray:
        """What has arrived at the terminal by now, of long runs the latest part. Not to be changed."""
        now_ps = self._clock.now_ps
        while self._on_wire:
            start_ps, piece = self._on_wire[0]
            if start_ps + self.frames_ps(len(piece)) <= now_ps:
                self._on_wire.popleft()
                self._text += piece
                continue
            complete = max(now_ps - start_ps, 0) * self._frame_ps.denominator // self._frame_ps.numerator
            if complete:
                self._text += piece[:complete]
                self._on_wire[0] = (start_ps + self.frames_ps(complete), piece[complete:])
            break
        if len(self._text) > _KEPT:
            excess = len(self._text) - _KEPT // 2
            del self._text[:excess]
            self.dropped += excess
        return self._text

    # -- receiving --------------------------------------------------------------------------------------

    def type(self, data: bytes) -> None:
        """The terminal sends bytes, one frame after the other, from now on."""
        start_ps = max(self._clock.now_ps, self._rx_line_free_ps)
        if self._trace.detailed and data:
            self._trace.add_detail(TerminalBytes(start_ps, "rx", data))
        for number, value in enumerate(data, start=1):
            self._clock.schedule(start_ps + self.frames_ps(number), partial(self._arrive, value))
        self._rx_line_free_ps = start_ps + self.frames_ps(len(data))

    @property
    def rxne(self) -> bool:
        """Whether a received byte waits in the data register."""
        return self._rx_data is not None

    def read_data(self) -> int | None:
        """Read the data register: the byte received, or None when RXNE is not set."""
        value, self._rx_data = self._rx_data, None
        return value

    def _arrive(self, value: int) -> None:
        if self._rx_data is None:
            self._rx_data = value
            return
        self.rx_lost += 1
        text = f"overrun: received byte 0x{value:02X} is lost"
        self._trace.add(Fault(self._clock.now_ps, self.name, text))
