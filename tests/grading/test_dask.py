"""A class on a cluster: a real scheduler and two worker processes, one of which is killed during the run."""

from __future__ import annotations

import os
import shutil
import signal
import sys
import threading
import time
from collections import Counter
from concurrent.futures import Future
from pathlib import Path
from typing import Any

import pytest

from fcu_emulator.emulator.errors import InputError
from fcu_emulator.emulator.grading.build import Builder
from fcu_emulator.emulator.grading.grading import Grader
from fcu_emulator.emulator.grading.rubric import load_rubric
from fcu_emulator.emulator.grading.submissions import find_submissions
from fcu_emulator.emulator.grading.tasks import Task, judge_task
from fcu_emulator.emulator.grading.workers import DaskWorkers
from fcu_emulator.firmware_model.arm import prebuilt
from tests.grading.test_grade import RUBRIC

pytest.importorskip("distributed", reason="Dask is not installed")
pytestmark = [
    pytest.mark.filterwarnings("default"),  # Dask's own are not ours to mend
    pytest.mark.skipif(sys.platform == "win32", reason="Windows has no SIGKILL"),
]
STUDENTS = [f"student-{number}" for number in range(6)]


def judge_and_record(task: Task, told: Path, victim: int) -> str:
    """Judge a task and record it. The first process with the victim's task waits until it is killed."""
    if task.seed == victim and not (told / "victim").exists():
        (told / "half").write_text(str(os.getpid()))
        (told / "half").rename(told / "victim")
        signal.pause()
    verdict = judge_task(task)
    with (told / "judged").open("a") as file:
        file.write(f"{task.seed} {os.getpid()}\n")
    return verdict


class Telling(DaskWorkers):
    """Workers that receive the victim's task first, so that its process has no results when it is killed."""

    def __init__(self, address: str, told: Path, victim: int) -> None:
        super().__init__(address)
        self.told, self.victim = told, victim
        self._first = threading.Event()

    def submit(self, fn: Any, /, *args: Any, **kwargs: Any) -> Future[Any]:
        if args[0].seed != self.victim:
            self._first.wait()
        future = super().submit(judge_and_record, *args, self.told, self.victim)
        self._first.set()
        return future


def kill_victim(told: Path, killed: list[int]) -> None:
    while not (told / "victim").exists():
        time.sleep(0.01)
    killed.append(int((told / "victim").read_text()))
    os.kill(killed[0], signal.SIGKILL)


def test_killed_worker_loses_no_results_and_repeats_none(tmp_path: Path) -> None:
    from tests.campaigns.dask_cluster import cluster

    (tmp_path / "little.toml").write_text(RUBRIC, encoding="utf-8")
    rubric = load_rubric(tmp_path / "little.toml")
    folder, told, killed = tmp_path / "submissions", tmp_path / "told", [0][:0]
    told.mkdir()
    for name in STUDENTS:
        (folder / name).mkdir(parents=True)
        shutil.copyfile(prebuilt("solution"), folder / name / "lab3.elf")
    program, salt = prebuilt("solution").read_bytes(), b"salt"
    seeds = {name: rubric.seed_for(name, program, salt) for name in STUDENTS}
    killer = threading.Thread(target=kill_victim, args=(told, killed))
    killer.start()
    with cluster(2) as address, Telling(address, told, seeds[STUDENTS[0]]) as workers:
        assert workers.slots == 2
        grader = Grader(rubric, str(rubric.path), workers, workers.slots, Builder, salt)
        results = [one for _, one in grader.grade(find_submissions(folder, None, tmp_path / "s"))]
    killer.join()
    judged = [line.split() for line in (told / "judged").read_text().splitlines()]

    assert sorted((one.id, one.points) for one in results) == [(name, 3.0) for name in STUDENTS]
    assert Counter(int(seed) for seed, _ in judged) == dict.fromkeys(seeds.values(), 1)
    assert killed
    assert str(killed[0]) not in {pid for _, pid in judged}


def test_missing_scheduler_is_error() -> None:
    with pytest.raises(InputError) as refused:
        DaskWorkers("tcp://127.0.0.1:1", answer_s=0.5)
    assert refused.value.kind == "no_answer"
    assert "tcp://127.0.0.1:1" in str(refused.value)
