"""Replay of Python firmware on recorded samples. The firmware may differ from the recorded one only in
arithmetic and text.

The main loop reads a line's values when the last bit of the previous text is sent (TC, RM0368
19.3.2). A callback begins with the first transfer after the previous callback's transfers. If a loop
reads variables immediately after a delay, it may read them one tick late.

Decision: the transfers are fed to the firmware's HAL calls, not to its arithmetic, so that drivers
and boot are included.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

from fcu_emulator.emulator.analysis.observation import (
    END,
    TERMINAL,
    Observation,
    bytes_sent,
    edges_of,
    led_pins,
    lines_of,
)
from fcu_emulator.emulator.assembly.board import Board
from fcu_emulator.emulator.buses.gpio import Gpio
from fcu_emulator.emulator.clock import PS_PER_MS, PS_PER_S, PS_PER_US, Clock
from fcu_emulator.emulator.errors import InputError
from fcu_emulator.emulator.python_cpu.hal import HAL_OK, HAL_TIMEOUT, HalGpio, HostedApplication
from fcu_emulator.emulator.trace import BusTransfer, GpioEdge, TerminalBytes, Trace

_LF = ord("\n")
_LOADED_PS = 2 * PS_PER_US
"""This time is longer than the times that the supplied solution needs: 0.3 us from the last bit of a text until the loop
reads its variables, and 1.6 us from the timer's interrupt until the callback's first transfer.
"""


def replay(board: Board, firmware: Callable[[Any], HostedApplication]) -> Observation:
    """Run ``firmware`` with the samples that were read on ``board``, and return its text and LEDs.

    ``board`` has run with ``trace.record_all()``. ``firmware`` takes a HAL. Raises InputError for a
    failed transfer, or if ``firmware`` requests data that was not read.
    """
    hal = _ReplayHal(_Recording(board))
    application = firmware(hal)
    hal.callback = application.HAL_TIM_PeriodElapsedCallback
    with suppress(_EndOfRecordingError):
        application.main()
    return Observation(
        board.clock.now_ps,
        {
            TERMINAL: lines_of(hal.printed()),
            **{led: edges_of(hal.trace.of(GpioEdge), pin) for led, pin in led_pins(board).items()},
            END: [],
        },
    )


class _EndOfRecordingError(Exception):
    """The recording has no more data."""


@dataclass(frozen=True)
class _Read:
    """Bytes of ``device`` at ``t_ps``, starting at ``register``."""

    t_ps: int
    device: str
    register: int
    data: bytes


class _Recording:
    """The sensors' answers in a trace, and the times of its text bytes."""

    def __init__(self, board: Board) -> None:
        self.end_ps = board.clock.now_ps
        self.reads = deque(_reads(board))
        addresses = board.description.addresses
        # addresses with 8 bits, as in HAL calls
        self.devices = {address << 1: name for name, address in addresses.items()}
        sent = list(bytes_sent(board.trace.of(TerminalBytes), board.terminal.uart))
        self.sent_ps = [at_ps for at_ps, _ in sent]
        self._line_ends = [number for number, (_, byte) in enumerate(sent, start=1) if byte == _LF]
        frame_ps = board.terminal.uart.frames_ps(1)
        self.left_ps = [at_ps + frame_ps for at_ps in self.sent_ps]

    def position(self, text: bytearray) -> int:
        """Return the position in the recording after the number of lines and further bytes that ``text`` has."""
        lines = text.count(_LF)
        if not lines:
            return len(text)
        if lines > len(self._line_ends):
            return len(self.sent_ps) + 1
        return self._line_ends[lines - 1] + len(text) - text.rindex(_LF) - 1

    def times_ps(self, text: bytes | bytearray) -> Iterator[int]:
        """Yield a time for each byte of ``text``, taken from the recorded line with the same number."""
        begin = 0
        for line, sent in enumerate(_lines(text)):
            if line < len(self._line_ends):
                last = self._line_ends[line] - 1
                yield from (self.sent_ps[min(begin + number, last)] for number in range(len(sent) - 1))
                yield self.sent_ps[last]
                begin = last + 1
            else:
                yield from self.sent_ps[begin : begin + len(sent)]
                return


def _lines(text: bytes | bytearray) -> Iterator[bytes]:
    begin = 0
    while begin < len(text):
        end = text.find(_LF, begin) + 1 or len(text)
        yield bytes(text[begin:end])
        begin = end


def _reads(board: Board) -> Iterator[_Read]:
    for event in board.trace.of(BusTransfer):
        if event.result != "ok":
            at = f"at {event.t_ps / PS_PER_S:.6f} s"
            raise InputError(
                f"cannot be replayed: {at} a transfer on the sensor bus failed ({event.result})",
                kind="bus_fault",
            )
        if event.read:
            register = event.written[0] & 0x7F if event.bus in board.description.spi else event.written[0]
            yield _Read(event.t_ps, event.device, register, event.read)


class _ReplayHal(HalGpio):
    """HAL calls from a recording. ``trace`` has the LEDs' edges."""

    def __init__(self, recording: _Recording) -> None:
        self.callback: Callable[[], None] = lambda: None
        self.trace = Trace()
        self._clock = Clock()
        super().__init__(Gpio(self._clock, self.trace))
        self._recording = recording
        self._text = bytearray()
        self._spoken_ps = 0  # end of the latest text
        self._delayed_ps = 0  # sum of the firmware's delays after the latest text
        self._timer_runs = False

    def printed(self) -> Iterator[tuple[int, int]]:
        """Yield each printed byte's time and value."""
        return zip(self._recording.times_ps(self._text), self._text, strict=False)

    # -- time -------------------------------------------------------------------------------------------

    def HAL_GetTick(self) -> int:
        return self._clock.now_ps // PS_PER_MS

    def HAL_Delay(self, delay_ms: int) -> None:
        """Set the time to the end of the latest text plus all delays since then."""
        self._delayed_ps += delay_ms * PS_PER_MS
        self._clock.now_ps = self._spoken_ps + self._delayed_ps
        if self._clock.now_ps > self._recording.end_ps:
            self._end()
        self._run_callbacks(self._clock.now_ps)

    def _end(self) -> None:
        self._run_callbacks(self._recording.end_ps)
        raise _EndOfRecordingError

    def _run_callbacks(self, until_ps: int) -> None:
        reads = self._recording.reads
        while self._timer_runs and reads and reads[0].t_ps <= until_ps:
            self._clock.now_ps = reads[0].t_ps
            self.callback()
        self._clock.now_ps = until_ps

    # -- the sensors ------------------------------------------------------------------------------------

    def HAL_I2C_Mem_Read(self, dev_address: int, mem_address: int, size: int) -> tuple[int, bytes]:
        """Return the next recorded bytes of these registers, from one or several transfers."""
        device, data = self._recording.devices[dev_address], b""
        while len(data) < size:
            data += self._read(device, mem_address + len(data))
        return HAL_OK, data

    def _read(self, device: str, register: int) -> bytes:
        """Return the next recorded read. Skip reads over SPI during the boot, because Python firmware does
        not make these reads."""
        while reads := self._recording.reads:
            read = reads.popleft()
            if (read.device, read.register) == (device, register):
                return read.data
            if self._timer_runs:
                raise InputError(
                    f"cannot be replayed: at {read.t_ps / PS_PER_S:.6f} s register 0x{read.register:02X} of "
                    f"{read.device} was read, but this firmware reads 0x{register:02X} of {device}",
                    kind="other_register",
                )
        raise _EndOfRecordingError

    def HAL_I2C_Mem_Write(self, dev_address: int, mem_address: int, data: bytes) -> int:
        """Accept the data, and do not compare it."""
        del dev_address, mem_address, data
        return HAL_OK

    # -- text, LEDs, timer ------------------------------------------------------------------------------

    def HAL_UART_Transmit(self, data: bytes, timeout_ms: int) -> int:
        """Advance to the end of this text in the recording, and run the callbacks until then."""
        del timeout_ms
        self._text += data
        left_ps = self._recording.left_ps
        position = self._recording.position(self._text)
        if position > len(left_ps):
            self._end()
        self._spoken_ps = left_ps[position - 1] if position else 0
        self._delayed_ps = 0
        self._run_callbacks(self._spoken_ps + _LOADED_PS)
        return HAL_OK

    def HAL_UART_Receive(self, size: int, timeout_ms: int) -> tuple[int, bytes]:
        """Return a timeout, because a replay has no input."""
        del size
        self.HAL_Delay(timeout_ms)
        return HAL_TIMEOUT, b""

    def HAL_TIM_Base_Init(self, prescaler: int, period: int) -> None:
        """Ignore the rate, because the recording determines callback times."""

    def HAL_TIM_Base_Start_IT(self) -> None:
        """Treat later reads as callback reads."""
        self._timer_runs = True
