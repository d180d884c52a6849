"""Worker processes: damage that one task does to its process does not affect other tasks."""

from __future__ import annotations

import os
import signal
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from fcu_emulator.emulator.errors import InputError, NotJudgedError
from fcu_emulator.emulator.grading import workers as workers_module
from fcu_emulator.emulator.grading.workers import LocalWorkers


@pytest.fixture(scope="module")
def workers() -> Iterator[LocalWorkers]:
    with LocalWorkers(2) as found:
        yield found


def die() -> None:
    os._exit(7)


def die_once(marker: Path) -> str:
    if not marker.exists():
        marker.touch()
        os.kill(os.getpid(), signal.SIGKILL)
    return "done"


def fail() -> None:
    raise InputError("no firmware")


def no_memory() -> None:
    raise MemoryError


def pid_after(seconds: float) -> int:
    time.sleep(seconds)
    return os.getpid()


def give(value: object) -> object:
    return value


def a_lambda() -> object:
    return lambda: None


def test_results_and_errors_are_returned(workers: LocalWorkers) -> None:
    assert [one.result() for one in [workers.submit(give, number) for number in range(20)]] == list(range(20))
    with pytest.raises(InputError, match="no firmware"):
        workers.submit(fail).result()


def test_worker_processes_are_reused(workers: LocalWorkers) -> None:
    pids = {workers.submit(os.getpid).result() for _ in range(10)}

    assert len(pids) <= 2
    assert os.getpid() not in pids


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no SIGKILL")
def test_task_of_killed_process_is_repeated(workers: LocalWorkers, tmp_path: Path) -> None:
    victim = workers.submit(die_once, tmp_path / "marker")
    others = [workers.submit(give, number) for number in range(10)]

    assert victim.result() == "done"
    assert [one.result() for one in others] == list(range(10))


def test_task_that_ends_its_process_fails_with_cause(workers: LocalWorkers) -> None:
    with pytest.raises(NotJudgedError, match=r"\(exit code 7\)") as ended:
        workers.submit(die).result()
    assert ended.value.kind == "worker_died"
    assert workers.submit(give, 1).result() == 1


def test_unpicklable_task_fails_alone(workers: LocalWorkers) -> None:
    with pytest.raises(Exception, match=r"pickle|local object"):
        workers.submit(give, lambda: None).result()
    with pytest.raises(NotJudgedError, match=r"pickle|local object"):
        workers.submit(a_lambda).result()


def test_process_without_memory_is_replaced(workers: LocalWorkers) -> None:
    with pytest.raises(MemoryError):
        workers.submit(no_memory).result()
    assert workers.submit(give, 1).result() == 1


def test_task_that_takes_too_long_is_stopped() -> None:
    with LocalWorkers(1, longest_s=0.2) as workers:
        stuck = workers.submit(pid_after, 3600)
        with pytest.raises(NotJudgedError, match=r"0\.2 s") as ended:
            stuck.result()
    assert ended.value.kind == "wall_time"


def test_task_without_process_is_not_judged(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: object) -> None:
        raise BlockingIOError(11, "Resource temporarily unavailable")

    monkeypatch.setattr(workers_module, "_Worker", refuse)
    with LocalWorkers(1) as workers:
        for _ in range(2):
            with pytest.raises(NotJudgedError) as ended:
                workers.submit(give, 1).result(timeout=10)
            assert ended.value.kind == "no_worker"


def test_shutdown_with_cancel_leaves_no_process() -> None:
    workers = LocalWorkers(2)
    tasks = [workers.submit(pid_after, 3600) for _ in range(4)]
    while len(workers.pids) < 2:
        time.sleep(0.01)
    pids = workers.pids
    workers.shutdown(cancel_futures=True)

    assert all(task.done() for task in tasks)
    assert workers.pids == []
    for pid in pids:
        with pytest.raises(ProcessLookupError):
            os.kill(pid, 0)
    with pytest.raises(RuntimeError):
        workers.submit(give, 1)
