"""Output of ``fcu run`` on stderr besides errors: progress, the explanation of a failure, the summary.

Firmware that hangs or has crashed is explained at once if a user watches, otherwise at the end of the run.
The firmware is diagnosed after three virtual seconds without a byte of output, and if there is no problem,
again after twice the time.
"""

from __future__ import annotations

import sys
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from typing import TextIO

import click

from fcu_emulator.emulator.analysis.recorder import TruthRecorder
from fcu_emulator.emulator.assembly.board import Board
from fcu_emulator.emulator.chip.diagnosis.diagnose import SCANNED_ADDRESSES
from fcu_emulator.emulator.chip.memory_map import CHIP_NAME
from fcu_emulator.emulator.cli.run_figures import figures
from fcu_emulator.emulator.errors import FirmwareError, I2CNackError
from fcu_emulator.emulator.links import ByteLink
from fcu_emulator.emulator.links.runner import Progress
from fcu_emulator.emulator.links.stdout import StdoutLink
from fcu_emulator.emulator.trace import BusTransfer, DeviceNote, Fault

# -- Progress, never mixed with the terminal's text ---------------------------------------------------------


_FIRST_AFTER_S = 1.0  # a short run shows no progress
_EVERY_TTY_S = 0.2
_EVERY_LOG_S = 10.0


def _is_terminal(stream: TextIO | None) -> bool:
    return stream is not None and stream.isatty()


class ProgressDisplay:
    """Progress on one line that is rewritten in place on a terminal; a line every ten seconds in a log.

    Lines are not rewritten while the board's text goes to the same terminal.
    """

    def __init__(self) -> None:
        self._in_place = _is_terminal(sys.stderr) and not _is_terminal(sys.stdout)
        self._next_s = _FIRST_AFTER_S if self._in_place else _EVERY_LOG_S
        self._shown = False

    def update(self, progress: Progress) -> None:
        """Show the progress of the run, if it is due."""
        if progress.wall_s < self._next_s:
            return
        self._next_s = progress.wall_s + (_EVERY_TTY_S if self._in_place else _EVERY_LOG_S)
        factor = progress.virtual_s / progress.wall_s
        whole = "" if progress.total_s is None else f" of {progress.total_s:.0f}"
        text = f"fcu: {progress.virtual_s:.0f}{whole} s of virtual time, {factor:.1f} x real time"
        with suppress(OSError):  # stderr may be full or closed; the run continues
            click.echo(f"\r{text}\033[K" if self._in_place else text, err=True, nl=not self._in_place)
        self._shown = True

    def close(self) -> None:
        """End the line of the progress."""
        if self._shown and self._in_place:
            with suppress(OSError):
                click.echo("\r\033[K", err=True, nl=False)


# -- The summary --------------------------------------------------------------------------------------------


def summary(
    board: Board, links: Sequence[ByteLink], wall_s: float, recorder: TruthRecorder, all_notes: bool = False
) -> Iterator[str]:
    """Yield the lines of the summary. ``all_notes``: also those of every correct run."""
    factor = board.now_s / wall_s if wall_s > 0 else 0.0
    yield f"{board.now_s:.3f} s of virtual time in {wall_s:.2f} s, {factor:.1f} x real time"
    yield from _ticks(board)
    yield from figures(board, recorder)
    yield from _resets(board)
    yield from _bus_errors(board)
    yield from _notes(board, all_notes)
    for link in links:
        if not (isinstance(link, StdoutLink) and link.reader_gone):  # the reader wanted no more
            yield from link.report()


def _ticks(board: Board) -> Iterator[str]:
    timer = board.timer
    if not timer.ticks:
        yield f"{timer.name} never ticked"
        return
    yield f"{timer.name} {timer.rate_hz:.3f} Hz: {timer.ticks} ticks, {timer.late} late, {timer.lost} lost"
    if timer.lost:
        yield (
            f"the callback takes longer than {1000 / timer.rate_hz:.3f} ms (the next one waited up to "
            f"{1000 * timer.longest_wait_s:.3f} ms): with ticks lost, main() gets little time or none"
        )


def _resets(board: Board) -> Iterator[str]:
    for text, (first_s, times) in chip_events(board).items():
        again = f", {times} times" if times > 1 else ""
        yield f"{CHIP_NAME}: {text} at {first_s:.6f} s{again}"


def _no_answer(address: int) -> str:
    return str(I2CNackError(address, 0))


def _bus_errors(board: Board) -> Iterator[str]:
    silent: dict[str, set[int]] = {}
    for one in board.trace.of(BusTransfer):
        if one.result == _no_answer(one.address):
            silent.setdefault(one.bus, set()).add(one.address)
    scanned = {bus: addresses for bus, addresses in silent.items() if len(addresses) >= SCANNED_ADDRESSES}
    for bus, addresses in scanned.items():
        yield f"{bus}: no answer at {len(addresses)} addresses, from 0x{min(addresses):02X} to 0x{max(addresses):02X}"
    for (bus, result), count in failed_transfers(board).most_common():
        if result not in {_no_answer(address) for address in scanned.get(bus, ())}:
            yield f"{bus}: {count} failed transfers: {result}"
    lost = received_bytes_lost(board)
    if lost:
        name = board.terminal.uart.name
        yield f"{name}: {lost} received bytes lost, the firmware does not read them (overrun)"


_USUAL_NOTES = {("forbidden", "LIS2MDL", "CFG_REG_A: measuring with COMP_TEMP_EN = 0")}
"""Notes in every correct run: the lab's own start-up sets that bit after it has switched the sensor on."""


def _notes(board: Board, all_notes: bool) -> Iterator[str]:
    for (what, device, text), count in notes(board).items():
        if (what, device, text) in _USUAL_NOTES and not all_notes:
            continue
        times = f" ({count} times)" if count > 1 else ""
        yield f"{what}: {device} {text}{times}"


def chip_events(board: Board) -> dict[str, tuple[float, int]]:
    """Return the chip's events (resets and the like): first time in seconds, and count."""
    found: dict[str, tuple[float, int]] = {}
    for event in board.trace.of(Fault):
        if event.where == CHIP_NAME:
            first_s, count = found.get(event.text, (event.t_s, 0))
            found[event.text] = first_s, count + 1
    return found


def failed_transfers(board: Board) -> Counter[tuple[str, str]]:
    """Return the number of failed transfers, by bus and result."""
    return Counter((event.bus, event.result) for event in board.trace.of(BusTransfer) if event.result != "ok")


def received_bytes_lost(board: Board) -> int:
    """Return the number of bytes that the firmware did not read in time."""
    name = board.terminal.uart.name
    return sum(1 for event in board.trace.of(Fault) if event.where == name)


def notes(board: Board) -> Counter[tuple[str, str, str]]:
    """Return operations that a sensor refuses, forbids or does not model (kind, device, text), with their count."""
    return Counter((note.what, note.device, note.text) for note in board.trace.of(DeviceNote))


# -- The explanation of a failure ---------------------------------------------------------------------------


_FIRST_QUESTION_S = 3.0


class Explainer:
    """Explains failures in one run of a board. ``say`` gets the lines of an explanation."""

    def __init__(self, board: Board, say: Callable[[str], None]) -> None:
        self._board = board
        self._say = say
        self.recorder = TruthRecorder(board)
        self._told = ""
        self._printed = 0
        self._silent_since_s = 0.0
        self._patience_s = _FIRST_QUESTION_S

    def look(self) -> None:
        """Diagnose silent firmware between two slices, and explain it if it is stuck."""
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

    def conclude(self) -> None:
        """Explain every mistake of the run at its end.

        Raises FirmwareError if the firmware has failed permanently.
        """
        from fcu_emulator.emulator.analysis.mistakes import (
            explain,  # loads the chip's diagnosis: a later import lets runs start sooner
        )

        for diagnosis in explain(self._board, self.recorder):
            if not diagnosis.fatal:
                self._tell(str(diagnosis))
            elif self._told:
                raise FirmwareError(diagnosis.summary)
            else:
                raise FirmwareError(str(diagnosis))

    def _tell(self, text: str) -> None:
        if text != self._told:
            for line in text.splitlines():
                self._say(line)
        self._told = text
