"""Grading a class: every submission from its file to its verdict.

A thread follows each submission: it takes it, has it built, asks a worker for the verdict, and waits. Only a
few more are under way than the workers can judge, so a class of thousands takes no more memory here than one
of thirty.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Generator, Iterable
from concurrent.futures import Executor, ThreadPoolExecutor, as_completed
from dataclasses import dataclass, field
from pathlib import Path
from tempfile import TemporaryDirectory

from emulator.errors import FcuError, InputError
from emulator.grading.build import Builder, CompileError
from emulator.grading.results import Graded, Status, report_name
from emulator.grading.roster import Student
from emulator.grading.rubric import Rubric
from emulator.grading.store import Store
from emulator.grading.submissions import Firmware, RejectedError, Submission, Take
from emulator.grading.tasks import Task, code_digest, judge_task
from emulator.grading.verdict import Verdict
from emulator.isolation import Limits
from emulator.text import one_line

_MORE_THREADS = 2  # than tasks at a time: what is taken and built while the workers judge


@dataclass(frozen=True)
class Grader:
    """How submissions are graded.

    ``rubric_name``: what workers load it by. ``builder``: gives the builder when the first source is met, so
    that a class of ELF files needs no compiler. ``slots``: how many tasks the workers do at a time.
    ``store``: None to judge everything anew. ``limits``: of each worker process; None leaves them to the
    cluster. ``shown``: whom the reports name; whom
    they name otherwise, they show without the seed, which is made of the id.
    """

    rubric: Rubric
    rubric_name: str
    workers: Executor
    slots: int
    builder: Callable[[], Builder]
    store: Store | None = None
    take: Take | None = None
    limits: Limits | None = None
    shown: Callable[[Student], Student] = lambda student: student
    _building: threading.Lock = field(default_factory=threading.Lock)
    _made: list[Builder] = field(default_factory=list)

    def grade(self, submissions: Iterable[Submission]) -> Generator[tuple[Submission, Graded]]:
        """Each submission once, in the order in which they are finished; verdicts come with their evidence.

        Raises InputError when there is source and this machine cannot build. Whoever stops before the end
        ends the workers, too.
        """
        pool = ThreadPoolExecutor(self.slots + _MORE_THREADS, thread_name_prefix="fcu-grade")
        try:
            for done in as_completed({pool.submit(self._grade, one) for one in submissions}):
                yield done.result()
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            self.workers.shutdown(wait=False, cancel_futures=True)
            raise
        finally:
            pool.shutdown()

    def close(self) -> None:
        """Remove what was only needed for building."""
        while self._made:
            self._made.pop().close()

    def _grade(self, submission: Submission) -> tuple[Submission, Graded]:
        return submission, self._graded(submission)

    def _graded(self, submission: Submission) -> Graded:
        log = ""
        try:
            task, log = self._task(submission)
            verdict = self._judged(task)
        except CompileError as error:
            return self._result(submission, "rejected", str(error), log=error.log)
        except RejectedError as error:
            status: Status = "missing" if submission.path is None else "rejected"
            return self._result(submission, status, str(error), log=log)
        except _UnjudgedError as error:
            return self._result(submission, "unjudged", str(error), log=log)
        firmware = task.name
        if verdict.counts:
            return self._result(submission, "judged", "", verdict, firmware, log)
        reasons = dict.fromkeys(check.unjudged_because for check in verdict.unjudged)
        status = "partly" if verdict.max_points else "unjudged"
        return self._result(submission, status, "; ".join(reasons), verdict, firmware, log)

    def _task(self, submission: Submission) -> tuple[Task, str]:
        """What is to be judged, and what the compiler said."""
        with TemporaryDirectory(prefix="fcu-") as scratch:
            content = submission.content(Path(scratch), self.take)
        log = None
        if not isinstance(content, Firmware):
            builder = self._builder()
            try:
                built = builder.build(content)
            except InputError:  # it does not compile, or this machine cannot compile anything
                raise
            except FcuError as error:
                raise _UnjudgedError(str(error)) from error
            content, log = built.firmware, built.log
        task = Task(
            firmware=content.data,
            name=content.name,
            rubric=self.rubric_name,
            rubric_digest=self.rubric.digest,
            seed=self.rubric.seed_for(submission.student.id),
            code=code_digest(),
            build_log=log,
            limits=self.limits,
        )
        return task, log or ""

    def _judged(self, task: Task) -> Verdict:
        verdict = self.store.find(task) if self.store else None
        if verdict is None:
            try:
                verdict = Verdict.from_json(self.workers.submit(judge_task, task).result())
            except RejectedError:
                raise
            except FcuError as error:
                raise _UnjudgedError(str(error)) from error
            except Exception as error:  # a worker's memory, Dask's errors, a bug of ours: not the program's
                raise _UnjudgedError(f"{type(error).__name__}: {one_line(str(error))}") from error
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
        verdict: Verdict | None = None,
        firmware: str = "",
        log: str = "",
    ) -> Graded:
        student = self.shown(submission.student)
        seed: int | None = self.rubric.seed_for(submission.student.id)
        if student != submission.student and not self.rubric.same_for_all:
            seed, verdict = None, verdict and verdict.without_seed()
        return Graded(
            id=student.id,
            name=student.name,
            email=student.email,
            status=status,
            reason=one_line(reason, 400),
            seed=seed,
            firmware=firmware,
            build_log=log,
            report=report_name(student.id),
            on_roster=submission.known,
            verdict=verdict,
        )


class _UnjudgedError(Exception):
    """Something around the program failed, so that nothing can be said about it."""
