"""Verdicts stored by content, so that a judged program is not judged again.

The key of a verdict does not depend on the rubric's texts. These texts are inserted when a stored verdict is returned.
"""

from __future__ import annotations

import hashlib
import json
from pathlib import Path

from fcu_emulator.emulator.grading.rubric import Rubric
from fcu_emulator.emulator.grading.tasks import Task
from fcu_emulator.emulator.grading.verdict import Verdict
from fcu_emulator.emulator.host.files import write_atomically

_FORMAT = 1


class Store:
    """A folder of stored verdicts."""

    def __init__(self, folder: Path, rubric: Rubric) -> None:
        self._folder = folder
        self._rubric = rubric

    def find(self, task: Task) -> Verdict | None:
        """Return the stored verdict with current texts, or None."""
        from fcu_emulator.emulator.grading.judge import reworded

        try:
            verdict = Verdict.from_json(self._path(task).read_bytes())
            return (
                verdict if verdict.rubric_digest == self._rubric.digest else reworded(verdict, self._rubric)
            )
        except (OSError, ValueError, KeyError):
            return None

    def keep(self, task: Task, verdict: Verdict) -> None:
        """Store a verdict if all its points could be judged."""
        if verdict.counts:
            write_atomically(self._path(task), verdict.to_json())

    def _path(self, task: Task) -> Path:
        decides = [
            _FORMAT,
            task.code,
            self._rubric.judging_digest,
            hashlib.sha256(task.firmware).hexdigest(),
            task.seed,
            task.build_log,
            task.sources_digest,
        ]
        key = hashlib.sha256(json.dumps(decides).encode()).hexdigest()
        return self._folder / key[:2] / f"{key}.json"
