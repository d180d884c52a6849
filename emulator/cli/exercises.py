"""Exercises of a live board, which are judged in another process."""

from __future__ import annotations

import shutil
import tempfile
from concurrent.futures import Future
from contextlib import suppress
from pathlib import Path
from typing import Any

from fcu_emulator.emulator.cli.project import shown_exercises
from fcu_emulator.emulator.errors import FcuError, InputError
from fcu_emulator.emulator.grading.exercise_result import as_checked
from fcu_emulator.emulator.grading.judge import judge
from fcu_emulator.emulator.grading.rubric import load_rubric
from fcu_emulator.emulator.grading.verdict import Verdict
from fcu_emulator.emulator.grading.workers import LocalWorkers
from fcu_emulator.emulator.live.messages import Checked
from fcu_emulator.emulator.text import visible

_LONGEST_S = 600.0  # wall time


class LabExercises:
    """The exercises of a rubric, judged one at a time. Raises InputError."""

    def __init__(self, rubric: str = "lab3") -> None:
        self._rubric = load_rubric(rubric)
        self._workers: LocalWorkers | None = None
        self._running: tuple[str, Future[Verdict], tempfile.TemporaryDirectory[str]] | None = None

    def offered(self) -> list[dict[str, Any]]:
        """Return ``id``, ``title``, ``question`` and ``next`` of the exercises that students see."""
        return [
            {
                "id": one.id,
                "title": one.title,
                "question": self._question(one.id),
                "next": one.next.strip(),
            }
            for one in shown_exercises(self._rubric)
        ]

    def start(self, exercise: str, firmware: str, seed: int) -> None:
        """Start to judge a copy of the firmware, because its file may change. Raises InputError."""
        self._rubric.exercise(exercise)
        if self._running is not None:
            raise InputError(
                f"cannot check exercise {exercise}: exercise {self._running[0]} is being checked", kind="busy"
            )
        folder = tempfile.TemporaryDirectory(prefix="fcu-check-")
        try:
            path = Path(firmware)
            if path.is_file():
                firmware = str(shutil.copy(path, folder.name))
        except OSError as error:
            folder.cleanup()
            raise InputError(f"cannot check {visible(firmware)}: {error.strerror or error}") from error
        if self._workers is None:
            self._workers = LocalWorkers(1, longest_s=_LONGEST_S)
        future = self._workers.submit(judged, firmware, self._rubric.file, exercise, seed)
        self._running = exercise, future, folder

    def finished(self) -> list[Checked]:
        """Return the result if judging has just ended."""
        if self._running is None or not self._running[1].done():
            return []
        exercise, future, folder = self._running
        self._running = None
        folder.cleanup()
        try:
            return [as_checked(exercise, future.result())]
        except FcuError as error:
            return [Checked(exercise, "error", problem=str(error))]

    def close(self) -> None:
        if self._workers is not None:
            self._workers.shutdown(cancel_futures=True)
            self._workers = None
        if self._running is not None:
            with suppress(OSError):
                self._running[2].cleanup()
            self._running = None

    def _question(self, exercise: str) -> str:
        """Return the question of the exercise's run; without this run, of its first check's run; or ""."""
        table = self._rubric.exercise(exercise)
        run = table.run or self._rubric.run_of(table, table.check[0])
        question = self._rubric.scenario(run, 0).question
        return "" if question == run else question  # a scenario without a question has the run's name instead


def judged(firmware: str, rubric: str, exercise: str, seed: int) -> Verdict:
    """Judge one exercise in a worker. Raises InputError."""
    try:
        return judge(firmware, load_rubric(rubric), seed=seed, exercises=[exercise]).for_student()
    except FcuError as error:  # some kinds of FcuError cannot be pickled
        raise InputError(str(error).splitlines()[0]) from None
