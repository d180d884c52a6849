"""Figures that the lab's slides ask for: bus clock, read duration, load of serial line and
callback.

The callback's load is estimated by sampling, to two digits.

Decision: the callback's load is not given for Python firmware, because its time passes only in
HAL calls.
"""

from __future__ import annotations

from collections.abc import Iterator

from fcu_emulator.emulator.analysis.recorder import TruthRecorder
from fcu_emulator.emulator.assembly.board import Board
from fcu_emulator.emulator.buses.i2c import I2CBus
from fcu_emulator.emulator.buses.spi import SpiBus
from fcu_emulator.emulator.clock import PS_PER_MS, PS_PER_S

_FEWEST_LOOKS = 100  # number of samples, enough for a share with two digits


def figures(board: Board, recorder: TruthRecorder) -> Iterator[str]:
    """Return the lines of the summary with these figures."""
    for i2c in board.signals.i2c.values():
        yield from _bus(i2c)
    for spi in board.signals.spi.values():
        yield from _bus(spi)
    yield from _serial(board)
    yield from _callback(board, recorder)


def _bus(bus: I2CBus | SpiBus) -> Iterator[str]:
    reads = [transfer for transfer in bus.recent_transfers() if transfer.read]
    if not reads:
        return
    longest = max(reads, key=lambda transfer: len(transfer.read))
    taken_ms = (longest.end_ps - longest.t_ps) / PS_PER_MS
    line, speed = ("SCL", bus.speed_hz) if isinstance(bus, I2CBus) else ("SCK", bus.speed_hz)
    clock = f"{speed / 1e6:g} MHz" if speed >= 1_000_000 else f"{speed / 1e3:g} kHz"
    count = len(longest.read)
    yield f"{bus.name}: {line} {clock}; a read of {count} byte{'s' * (count > 1)} took {taken_ms:.3f} ms"


def _serial(board: Board) -> Iterator[str]:
    uart = board.terminal.uart
    count, frame_ps = uart.received_count(), uart.frames_ps(1)
    if count and board.now_s:
        load = count * frame_ps / PS_PER_S / board.now_s
        baud = 10 * PS_PER_S / frame_ps
        yield f"{uart.name}: {baud:.0f} baud; {count} bytes, {100 * load:.1f} % of the time"


def _callback(board: Board, recorder: TruthRecorder) -> Iterator[str]:
    timer = board.timer
    if recorder.looks_at_callback < _FEWEST_LOOKS or not timer.rate_hz:
        return
    share = recorder.callback_seen / recorder.looks_at_callback
    period_ms = 1000 / timer.rate_hz
    digits = 2 if period_ms >= 1 else 3
    took = f"{share * period_ms:.{digits}f} ms, {100 * share:.0f} % of its period of {period_ms:.3g} ms"
    yield f"the callback takes about {took}"
