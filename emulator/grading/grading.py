"""Grading of a class: from the file of each submission to its verdict.

Each submission is processed in a thread. Only a few threads run at the same time.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Generator, Iterable
from concurrent.futures import Executor, ThreadPoolExecutor, as_completed
from dataclasses import dataclass, field
from pathlib import Path
from tempfile import TemporaryDirectory

from fcu_emulator.emulator.errors import FcuError
from fcu_emulator.emulator.grading.build import Builder, CompileError
from fcu_emulator.emulator.grading.copies import program_digest, source_digest
from fcu_emulator.emulator.grading.platforms import shown_name
from fcu_emulator.emulator.grading.results import Graded, Status, report_name
from fcu_emulator.emulator.grading.roster import Student
from fcu_emulator.emulator.grading.rubric import Rubric
from fcu_emulator.emulator.grading.store import Store
from fcu_emulator.emulator.grading.submissions import RejectedError, Submission, SubmittedFirmware, Take
from fcu_emulator.emulator.grading.tasks import Task, code_digest, judge_task
from fcu_emulator.emulator.grading.verdict import Verdict
from fcu_emulator.emulator.host.isolation import WorkerLimits
from fcu_emulator.emulator.text import one_line

_MORE_THREADS = 2  # threads that read and build submissions while the workers judge other submissions


@dataclass(frozen=True)
class Grader:
    """Grader of a class, with its settings.

    ``rubric_name``: name or path from which each worker loads the rubric. ``slots``: number of parallel
    tasks. ``builder``: function that returns a builder; it is called when the first source is built.
    ``salt``: the teacher's secret. ``store``: if None, all submissions are judged again. ``limits``: limits
    of a worker; None on a cluster. ``shown``: function that returns the student as named in reports.
    """

    rubric: Rubric
    rubric_name: str
    workers: Executor
    slots: int
    builder: Callable[[], Builder]
    salt: bytes
    store: Store | None = None
    take: Take | None = None
    limits: WorkerLimits | None = None
    shown: Callable[[Student], Student] = lambda student: student
    _building: threading.Lock = field(default_factory=threading.Lock)
    _made: list[Builder] = field(default_factory=list)

    def grade(self, submissions: Iterable[Submission]) -> Generator[tuple[Submission, Graded]]:
        """Yield results as they complete. Closing the generator stops workers and compilers."""
        pool = ThreadPoolExecutor(self.slots + _MORE_THREADS, thread_name_prefix="fcu-grade")
        try:
            for done in as_completed({pool.submit(self._grade, one) for one in submissions}):
                yield done.result()
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            self.workers.shutdown(wait=False, cancel_futures=True)
            for builder in self._made:
                builder.stop()
            raise
        finally:
            pool.shutdown()

    def close(self) -> None:
        """Remove the temporary files of the builds."""
        while self._made:
            self._made.pop().close()

    def _grade(self, submission: Submission) -> tuple[Submission, Graded]:
        return submission, self._graded(submission)

    def _graded(self, submission: Submission) -> Graded:
        task, log, verdict = None, "", None
        digests: dict[str, str] = {}
        status: Status = "unjudged"
        try:
            task, log = self._task(submission, digests)
            verdict = self._judged(task)
        except CompileError as error:
            status, reason, log = "rejected", str(error), error.log
        except RejectedError as error:
            nothing = submission.path is None and not submission.entries
            status, reason = "missing" if nothing else "rejected", str(error)
        except FcuError as error:
            reason = str(error)
        except OSError as error:
            reason = f"this machine has run out of a resource: {error.strerror or error}"
        except (
            Exception
        ) as error:  # out of memory, an error of Dask, or a bug of fcu: not caused by the program
            reason = f"fcu failed, please report this bug: {type(error).__name__}: {error}"
        else:
            reason = "; ".join(dict.fromkeys(check.unjudged_because for check in verdict.unjudged))
            if verdict.counts:
                status, reason = "judged", ""
            elif verdict.max_points:
                status = "partly"
        return self._result(submission, status, reason, task, verdict, log).model_copy(update=digests)

    def _task(self, submission: Submission, digests: dict[str, str]) -> tuple[Task, str]:
        with TemporaryDirectory(prefix="fcu-", ignore_cleanup_errors=True) as scratch:
            content = submission.content(Path(scratch), self.take)
        log, sources = None, {}
        if not isinstance(content, SubmittedFirmware):
            sources = dict(content.files)
            digests["source_digest"] = source_digest(content)
            built = self._builder().build(content)
            content, log = built.firmware, built.log
        digests["program_digest"] = program_digest(content)
        task = Task(
            firmware=content.data,
            name=content.name,
            rubric=self.rubric_name,
            rubric_digest=self.rubric.digest,
            seed=self.rubric.seed_for(submission.board, content.data, self.salt),
            code=code_digest(),
            build_log=log,
            limits=self.limits,
            sources=sources,
        )
        return task, log or ""

    def _judged(self, task: Task) -> Verdict:
        verdict = self.store.find(task) if self.store else None
        if verdict is None:
            verdict = Verdict.from_json(self.workers.submit(judge_task, task).result())
            if self.store is not None:
                self.store.keep(task, verdict)
        return verdict

    def _builder(self) -> Builder:
        with self._building:
            if not self._made:
                self._made.append(self.builder())
            return self._made[0]

    def _result(
        self,
        submission: Submission,
        status: Status,
        reason: str,
        task: Task | None,
        verdict: Verdict | None,
        log: str,
    ) -> Graded:
        student = self.shown(submission.student)
        files = tuple(map(shown_name, submission.files))
        reason = one_line(reason, 400)
        if student != submission.student:
            for name, number in sorted(
                zip(files, range(1, len(files) + 1), strict=True), key=lambda one: -len(one[0])
            ):
                reason = reason.replace(name, f"file {number}")
        seed = task.seed if task is not None and verdict is not None else None
        if student != submission.student and not self.rubric.same_for_all:
            seed, verdict = None, verdict and verdict.without_seed()
        return Graded(
            id=student.id,
            name=student.name,
            email=student.email,
            status=status,
            reason=reason,
            seed=seed,
            firmware=task.name if task is not None and verdict is not None else "",
            build_log=log,
            report=report_name(student.id),
            on_roster=submission.known,
            files=files if student == submission.student else (),
            handed_in=len(files),
            note=submission.note,
            verdict=verdict,
        )
