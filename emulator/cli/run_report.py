"""Output of ``fcu run`` on stderr: progress, explanation of a failure, summary.

Firmware is diagnosed after three virtual seconds without output, and again each time this period
has doubled.
"""

from __future__ import annotations

import sys
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from typing import TYPE_CHECKING

from fcu_emulator.emulator.analysis.recorder import TruthRecorder
from fcu_emulator.emulator.assembly.board import Board
from fcu_emulator.emulator.buses.i2c import is_scan
from fcu_emulator.emulator.chip.memory_map import CHIP_NAME
from fcu_emulator.emulator.cli.run_figures import figures
from fcu_emulator.emulator.cli.screen import Look, ProgressLine, Say, is_terminal, say
from fcu_emulator.emulator.errors import FirmwareError, I2CNackError
from fcu_emulator.emulator.links import ByteLink
from fcu_emulator.emulator.links.runner import Progress
from fcu_emulator.emulator.links.stdout import StdoutLink
from fcu_emulator.emulator.trace import BusTransfer, DeviceNote, Fault

if TYPE_CHECKING:
    from fcu_emulator.emulator.chip.diagnosis.report import Diagnosis

# -- Progress, never mixed with the terminal's text ---------------------------------------------------------


_EVERY_LOG_S = 10.0


class ProgressDisplay:
    """Display of progress: one line on a terminal, or a line every ten seconds in a log.

    A terminal with the board's text shows no progress.
    """

    def __init__(self) -> None:
        self._in_place = is_terminal(sys.stderr) and not is_terminal(sys.stdout)
        self._line = ProgressLine("fcu: running", visible_if=self._in_place)
        self._next_s = _EVERY_LOG_S
        self._line.start()

    def update(self, progress: Progress) -> None:
        """Show the progress if it is due."""
        factor = progress.virtual_s / progress.wall_s if progress.wall_s > 0 else 0.0
        whole = "" if progress.total_s is None else f" of {progress.total_s:.0f}"
        self._line.text = f"fcu: {progress.virtual_s:.0f}{whole} s of virtual time, {factor:.1f} x real time"
        if not self._in_place and progress.wall_s >= self._next_s:
            self._next_s = progress.wall_s + _EVERY_LOG_S
            say(self._line.text.removeprefix("fcu: "))

    def close(self) -> None:
        """Erase the line of the progress."""
        self._line.end()


# -- The summary --------------------------------------------------------------------------------------------


def summary(
    board: Board,
    links: Sequence[ByteLink],
    wall_s: float,
    recorder: TruthRecorder,
    *,
    all_notes: bool = False,
    all_uarts: bool = False,
) -> Iterator[tuple[str, Look | None]]:
    """Yield the lines of the summary with their colours.

    ``all_notes``: also yield the notes of correct runs. ``all_uarts``: also yield the output of
    USARTs without a terminal.
    """
    factor = board.now_s / wall_s if wall_s > 0 else 0.0
    yield f"{board.now_s:.3f} s of virtual time in {wall_s:.2f} s, {factor:.1f} x real time", "heading"
    yield from ((line, None) for line in (*_ticks(board), *figures(board, recorder)))
    warnings = [*_lost_ticks(board), *_resets(board), *_bus_errors(board), *_notes(board, all_notes)]
    yield from ((line, "warning") for line in warnings)
    yield from ((line, None) for line in _other_uarts(board, all_uarts))
    for link in links:
        if not (isinstance(link, StdoutLink) and link.reader_gone):  # the reader had closed the output
            yield from ((line, None) for line in link.report())


def _ticks(board: Board) -> Iterator[str]:
    timer = board.timer
    if not timer.ticks:
        yield f"{timer.name} never ticked"
        return
    yield f"{timer.name} {timer.rate_hz:.3f} Hz: {timer.ticks} ticks, {timer.late} late, {timer.lost} lost"


def _lost_ticks(board: Board) -> Iterator[str]:
    timer = board.timer
    if timer.lost:
        yield (
            f"the callback takes longer than {1000 / timer.rate_hz:.3f} ms (the next call waited up to "
            f"{1000 * timer.longest_wait_s:.3f} ms); main() gets little time or none"
        )


def _other_uarts(board: Board, show: bool) -> Iterator[str]:
    for name, data in board.other_uarts().items():
        if show:
            yield from (f"{name}: {line}" for line in data.decode(errors="replace").splitlines())
        elif board.terminal.uart.received_count():  # otherwise the diagnosis shows the first lines
            yield f"the program sends on {name}, which has no terminal; show the output with --all-uarts"


def _resets(board: Board) -> Iterator[str]:
    for text, (first_s, times) in chip_events(board).items():
        again = f", {times} times" if times > 1 else ""
        yield f"{CHIP_NAME}: {text} at {first_s:.6f} s{again}"


def _no_answer(address: int) -> str:
    return str(I2CNackError(address, 0))


def _bus_errors(board: Board) -> Iterator[str]:
    silent: dict[str, Counter[int]] = {}
    for one in board.trace.of(BusTransfer):
        if one.result == _no_answer(one.address):
            silent.setdefault(one.bus, Counter())[one.address] += 1
    scanned = {bus: addresses for bus, addresses in silent.items() if is_scan(addresses.values())}
    for bus, addresses in scanned.items():
        yield f"{bus}: no answer at {len(addresses)} addresses, from 0x{min(addresses):02X} to 0x{max(addresses):02X}"
    for (bus, result), count in failed_transfers(board).most_common():
        if result not in {_no_answer(address) for address in scanned.get(bus, ())}:
            yield f"{bus}: {count} failed transfer{'s' * (count > 1)}: {result}"
    lost = received_bytes_lost(board)
    if lost:
        name = board.terminal.uart.name
        yield f"{name}: {lost} received bytes lost: the firmware does not read them (overrun)"


_USUAL_NOTES = {("LIS2MDL", "no-temperature-compensation")}
"""Notes that every correct run causes: the lab's firmware sets this bit only after it has switched the sensor on."""


def _notes(board: Board, all_notes: bool) -> Iterator[str]:
    for note, count in notes(board):
        if all_notes or (note.device, note.problem) not in _USUAL_NOTES:
            times = f" ({count} times)" if count > 1 else ""
            yield f"{note.what}: {note.device} {note.text}{times}"


def chip_events(board: Board) -> dict[str, tuple[float, int]]:
    """Return the chip's events, each with its first time in seconds and its count."""
    found: dict[str, tuple[float, int]] = {}
    for event in board.trace.of(Fault):
        if event.where == CHIP_NAME:
            first_s, count = found.get(event.text, (event.t_s, 0))
            found[event.text] = first_s, count + 1
    return found


def failed_transfers(board: Board) -> Counter[tuple[str, str]]:
    """Return the number of failed transfers, keyed by bus and result."""
    return Counter((event.bus, event.result) for event in board.trace.of(BusTransfer) if event.result != "ok")


def received_bytes_lost(board: Board) -> int:
    """Return the number of bytes that the firmware read too late."""
    name = board.terminal.uart.name
    return sum(1 for event in board.trace.of(Fault) if event.where == name)


def notes(board: Board) -> list[tuple[DeviceNote, int]]:
    """Return each different note once, with the number of equal notes."""
    first: dict[tuple[str, str, str], DeviceNote] = {}
    counts: Counter[tuple[str, str, str]] = Counter()
    for note in board.trace.of(DeviceNote):
        key = note.what, note.device, note.text
        first.setdefault(key, note)
        counts[key] += 1
    return [(note, counts[key]) for key, note in first.items()]


# -- The explanation of a failure ---------------------------------------------------------------------------


_FIRST_QUESTION_S = 3.0


class Explainer:
    """Explanation of the failures in one run. ``say`` prints each line."""

    def __init__(self, board: Board, say: Say) -> None:
        self._board = board
        self._say = say
        self.recorder = TruthRecorder(board)
        self.diagnoses: list[Diagnosis] = []
        """The mistakes of the run, after :meth:`conclude`."""
        self._told = ""
        self._printed = 0
        self._silent_since_s = 0.0
        self._patience_s = _FIRST_QUESTION_S

    def look(self) -> None:
        """Explain why firmware without output is stuck. Called between time slices."""
        board = self._board
        if board.chip is None:
            return
        printed = board.terminal.uart.received_count()
        if printed != self._printed:
            self._printed, self._silent_since_s = printed, board.now_s
            self._patience_s = _FIRST_QUESTION_S
        elif board.now_s - self._silent_since_s >= self._patience_s:
            self._patience_s *= 2
            diagnosis = board.chip.diagnosis()
            if diagnosis is not None and diagnosis.fatal:
                self._tell(str(diagnosis))

    def conclude(self, explain_wrong: Callable[[], Sequence[Diagnosis]] = tuple) -> None:
        """Explain every mistake of the run. Raises FirmwareError after a permanent failure.

        ``explain_wrong`` is called to explain wrong numbers, if the firmware runs and gets samples.
        """
        from fcu_emulator.emulator.analysis.mistakes import (
            explain,
            without_explained,
        )  # imported late, so that runs start sooner
        from fcu_emulator.emulator.chip.diagnosis.report import KEEPS_SAMPLES_AWAY

        found = explain(self._board, self.recorder)
        if not any(one.fatal or one.kind in KEEPS_SAMPLES_AWAY for one in found):
            formulas = explain_wrong()
            found = [*formulas, *without_explained(found, formulas)]
        self.diagnoses += found
        for diagnosis in found:
            if not diagnosis.fatal:
                self._tell(str(diagnosis))
            elif self._told:
                raise FirmwareError(diagnosis.summary)
            else:
                raise FirmwareError(str(diagnosis))

    def _tell(self, text: str) -> None:
        if text != self._told:
            summary, *details = text.splitlines()
            self._say(summary, "warning")
            for line in details:
                self._say(line)
        self._told = text
