"""``fcu run --json FILE``: results of a run as one JSON object.

The number ``schema`` increases when a key changes its meaning or is removed. Times are seconds. The file is
written after the verdict, so the file stays empty if the run is killed.

==============  ====================================================================================
exit_code       a code of :mod:`fcu_emulator.emulator.cli.exit_codes`; ``verdict``: its name
error           the error that ended the run, or null
timer           the lab's timer: rate, ticks, late ticks, lost ticks, longest wait
chip            resets and similar events
bus_errors      failed transfers
bytes_lost      received bytes that the firmware read too late
notes           refused, forbidden or unmodelled operations of sensors
serial          lost terminal text by link
diagnoses       problems of the firmware, a wrong formula first: kind, summary, details, data
expectations    counts and failures; null if not evaluated, then ``unchecked`` says why
printed         the latest 1,000 lines: time, values by field (null in another format),
                and each field's smallest and largest true value before printing
leds            changes, sampled 20 times a second
lines           further lines on stderr, also with ``--quiet``
==============  ====================================================================================
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, suppress
from io import TextIOWrapper
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fcu_emulator.emulator.analysis.recorder import TruthRecorder
from fcu_emulator.emulator.assembly.board import Board
from fcu_emulator.emulator.cli.exit_codes import ExitCode
from fcu_emulator.emulator.cli.run_report import chip_events, failed_transfers, notes, received_bytes_lost
from fcu_emulator.emulator.cli.screen import Look, Say
from fcu_emulator.emulator.errors import LinkError, OutputError
from fcu_emulator.emulator.links import ByteLink

if TYPE_CHECKING:  # the core and pydantic are slow to import
    from fcu_emulator.emulator.chip.diagnosis.report import Diagnosis
    from fcu_emulator.emulator.scenario import Result

SCHEMA = 1


class RunRecord:
    """Record of one run for the file ``path``. Raises LinkError if it cannot be opened."""

    def __init__(self, board: Board, links: Sequence[ByteLink], path: Path | None, stack: ExitStack) -> None:
        self.wall_s = 0.0
        self.result: Result | None = None
        self.unchecked = ""
        self.recorder: TruthRecorder | None = None
        self.diagnoses: Sequence[Diagnosis] = ()
        self._board = board
        self._links = links
        self._path = path
        self._lines: list[str] = []
        self._file: TextIOWrapper | None = None
        if path is not None:
            try:
                self._file = path.open("w", encoding="utf-8", newline="\n")
            except OSError as error:
                problem = f"{error.strerror or error}; give a writable path"
                raise LinkError(f"--json {path}: {problem}") from error
            stack.callback(self._file.close)

    def add_line(self, line: str, look: Look | None = None) -> None:
        """Record a line about the run."""
        del look
        self._lines.append(line)

    def add_line_and(self, say: Say) -> Say:
        """Return a function that records a line, then calls ``say``."""

        def both(line: str, look: Look | None = None) -> None:
            self.add_line(line)
            say(line, look)

        return both

    def write(self, code: ExitCode, error: str | None = None) -> None:
        """Write the file. Raises OutputError."""
        if self._file is None:
            return
        try:
            json.dump(self._contents(code, error), self._file, indent=2)
            self._file.write("\n")
            self._file.flush()
        except OSError as failure:
            with suppress(OSError):  # closing the file would fail again
                self._file.close()
            raise OutputError(f"--json {self._path}: {failure.strerror or failure}") from failure

    def _contents(self, code: ExitCode, error: str | None) -> dict[str, Any]:
        from importlib.metadata import version  # slow to import

        board, timer = self._board, self._board.timer
        return {
            "schema": SCHEMA,
            "fcu": version("fcu-emulator"),
            "exit_code": int(code),
            "verdict": code.name.lower().replace("_", " "),
            "error": error,
            "board": {
                "wiring": board.booted.wiring.name,
                "profile": board.booted.wiring.name,  # previous name
                "firmware": board.booted.name,
                "notes": list(board.booted.notes),
                "scenario": board.scenario.file if board.scenario else None,
                "seed": board.seed,
            },
            "virtual_s": board.now_s,
            "wall_s": self.wall_s,
            "timer": {
                "name": timer.name,
                "rate_hz": timer.rate_hz if timer.ticks else None,
                "ticks": timer.ticks,
                "late": timer.late,
                "lost": timer.lost,
                "longest_wait_s": timer.longest_wait_s,
            },
            "chip": [
                {"text": text, "first_s": first_s, "count": count}
                for text, (first_s, count) in chip_events(board).items()
            ],
            "bus_errors": [
                {"bus": bus, "result": result, "count": count}
                for (bus, result), count in failed_transfers(board).items()
            ],
            "bytes_lost": received_bytes_lost(board),
            "notes": [
                {
                    "what": note.what,
                    "device": note.device,
                    "problem": note.problem,
                    "data": note.data,
                    "text": note.text,
                    "count": count,
                }
                for note, count in notes(board)
            ],
            "diagnoses": [one.as_data() for one in self.diagnoses],
            "serial": [{"undelivered": link.undelivered(), "report": link.report()} for link in self._links],
            "expectations": self._expectations(),
            "unchecked": self.unchecked or None,
            "printed": list(_printed(self.recorder)) if self.recorder else [],
            "leds": list(_leds(self.recorder)) if self.recorder else [],
            "lines": self._lines,
        }

    def _expectations(self) -> dict[str, Any] | None:
        result = self.result
        if result is None:
            return None
        return {
            "checks": result.checks,
            "held": result.passed_count,
            "judged": result.judged,
            "findings": [finding.to_dict() for finding in result.findings],
            "reports": list(result.reports),
        }


def _printed(recorder: TruthRecorder) -> Iterator[dict[str, Any]]:
    for seen in recorder.lines:
        yield {
            "label": seen.label,
            "at_s": round(seen.at_s, 6),
            "values": dict(seen.values) if seen.values is not None else None,
            "truth": {name: [one.low, one.high] for name, one in seen.truth.items()},
        }


def _leds(recorder: TruthRecorder) -> Iterator[list[float | bool]]:
    before: tuple[bool, ...] | None = None
    for light in recorder.lights:
        if light.on != before:
            before = light.on
            yield [round(light.at_s, 6), *before]
