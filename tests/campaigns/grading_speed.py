"""Cost of grading: ``python -m tests.campaigns.grading_speed [BOARDS]``; with ``--class N`` a class of N, twice.

It measures processor time and memory of a worker process that judges the lab's solution and its template by the lab's
whole rubric, one board after the other. Other load on the machine does not affect processor time.
"""

from __future__ import annotations

import shutil
import sys
import time
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

from fcu_emulator.emulator.cli import execute
from fcu_emulator.emulator.grading.rubric import load_rubric
from fcu_emulator.emulator.grading.tasks import Task, code_digest, judge_task
from fcu_emulator.emulator.grading.verdict import Verdict
from fcu_emulator.emulator.grading.workers import LocalWorkers
from fcu_emulator.firmware_model.arm import prebuilt

CLASS = 300
PROGRAMS = {"solution": (20.0, 20.0), "template": (4.0, 5.0)}
"""The shipped programs, with their minimum and maximum points."""


def judged(task: Task) -> tuple[float, float, int]:
    """Return points, seconds of processor time, and the peak memory in bytes, measured in a worker."""
    import resource

    began_s = time.process_time()
    verdict = Verdict.from_json(judge_task(task))
    size = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return verdict.points, time.process_time() - began_s, size if sys.platform == "darwin" else size * 1024


def measure(boards: int) -> dict[str, tuple[float, float]]:
    """Return by program the mean of the seconds, and the megabytes of the worker."""
    digest = load_rubric("lab3").digest
    found = {}
    for name, (least, most) in PROGRAMS.items():
        task = Task(prebuilt(name).read_bytes(), "lab3.elf", "lab3", digest, 0, code_digest())
        with LocalWorkers(1) as workers:
            results = [workers.submit(judged, replace(task, seed=seed)).result() for seed in range(boards)]
        assert all(least <= points <= most for points, _, _ in results), results
        found[name] = sum(seconds for _, seconds, _ in results) / boards, results[-1][2] / 1e6
    return found


def grade_twice(students: int) -> tuple[float, float]:
    """Return the seconds for a class, and for the same class again."""
    with TemporaryDirectory() as scratch:
        folder = Path(scratch) / "submissions"
        for number in range(students):
            (folder / f"{number:04}").mkdir(parents=True)
            shutil.copyfile(prebuilt("solution"), folder / f"{number:04}" / "lab3.elf")
        taken = []
        for _ in range(2):
            began_s = time.perf_counter()
            assert execute(["grade", str(folder), "--rubric", "lab3", "--out", f"{scratch}/out"]) == 0
            taken.append(time.perf_counter() - began_s)
    return taken[0], taken[1]


def main(arguments: list[str]) -> None:
    """Print the results, and their meaning for a class."""
    if arguments[:1] == ["--class"]:
        first_s, second_s = grade_twice(int(arguments[1]))
        sys.stdout.write(f"{arguments[1]} submissions: {first_s:.0f} s; again: {second_s:.1f} s\n")
        return
    for name, (seconds, megabytes) in measure(int(arguments[0]) if arguments else 4).items():
        whole_min = seconds * CLASS / 2 / 60
        sys.stdout.write(f"{name}: {seconds:.1f} s of processor time a board, {megabytes:.0f} MB a worker; ")
        sys.stdout.write(f"{CLASS} on two cores: {whole_min:.0f} min\n")


if __name__ == "__main__":
    main(sys.argv[1:])
