"""What is said at the end of a run: time, ticks, and whatever a user should not miss."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence

from emulator.board.board import Board
from emulator.chip.peripherals.peripheral import CHIP
from emulator.links import ByteLink
from emulator.time.clock import PS_PER_MS, PS_PER_S
from emulator.trace import BusTransfer, DeviceNote, Fault


def summary(board: Board, links: Sequence[ByteLink], wall_s: float) -> Iterator[str]:
    """The lines of the summary."""
    factor = board.now_s / wall_s if wall_s > 0 else 0.0
    yield f"{board.now_s:.3f} s of virtual time in {wall_s:.2f} s, {factor:.1f} x real time"
    yield from _ticks(board)
    yield from _resets(board)
    yield from _bus_errors(board)
    yield from _notes(board)
    for link in links:
        yield from link.report()


def _ticks(board: Board) -> Iterator[str]:
    timer = board.tim9
    if not timer.ticks:
        yield f"{timer.name} never ticked"
        return
    yield f"{timer.name} {timer.rate_hz:.3f} Hz: {timer.ticks} ticks, {timer.late} late, {timer.lost} lost"
    if timer.lost:
        yield (
            f"the callback takes longer than {1000 / timer.rate_hz:.3f} ms (the next one waited up to "
            f"{timer.longest_wait_ps / PS_PER_MS:.3f} ms): with ticks lost, main() gets little time or none"
        )


def _resets(board: Board) -> Iterator[str]:
    first_s: dict[str, float] = {}
    count: Counter[str] = Counter()
    for event in board.trace.of(Fault):
        if event.where == CHIP:
            first_s.setdefault(event.text, event.t_ps / PS_PER_S)
            count[event.text] += 1
    for text, times in count.items():
        again = f", {times} times" if times > 1 else ""
        yield f"{CHIP}: {text} at {first_s[text]:.6f} s{again}"


def _bus_errors(board: Board) -> Iterator[str]:
    failed = Counter(event.result for event in board.trace.of(BusTransfer) if event.result != "ok")
    for result, count in failed.most_common():
        yield f"{board.bus.name}: {count} failed transfers: {result}"
    lost = sum(1 for event in board.trace.of(Fault) if event.where == board.uart.name)
    if lost:
        yield f"{board.uart.name}: {lost} received bytes lost, the firmware does not read them (overrun)"


def _notes(board: Board) -> Iterator[str]:
    notes = Counter((note.what, note.device, note.text) for note in board.trace.of(DeviceNote))
    for (what, device, text), count in notes.items():
        times = f" ({count} times)" if count > 1 else ""
        yield f"{what}: {device} {text}{times}"
