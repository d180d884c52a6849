"""A Dask cluster on 127.0.0.1: a real scheduler and worker processes, one thread each.

``python -m tests.campaigns.dask_cluster [TASKS]`` measures the gain of the second worker, on a quiet machine.
"""

from __future__ import annotations

import os
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory

from fcu_emulator.emulator.grading.rubric import load_rubric
from fcu_emulator.emulator.grading.tasks import Task, code_digest, judge_task
from fcu_emulator.emulator.grading.workers import DaskWorkers
from fcu_emulator.firmware_model.arm import prebuilt

ROOT = Path(__file__).parents[2]


@contextmanager
def cluster(workers: int) -> Iterator[str]:
    """Yield the address of the scheduler, and end all processes afterwards. A dead worker is not restarted."""
    with TemporaryDirectory() as folder:
        file = Path(folder) / "scheduler.json"
        local = ["--host", "127.0.0.1", "--no-dashboard", "--scheduler-file", str(file)]
        commands = [["scheduler", "--port", "0", *local]]
        commands += [["worker", "--nthreads", "1", "--no-nanny", *local]] * workers
        environment = {
            **os.environ,
            "PYTHONPATH": str(ROOT),
            "DASK_DISTRIBUTED__WORKER__MULTIPROCESSING": "0",
        }
        processes = [
            subprocess.Popen(
                [sys.executable, "-m", "dask", *command],
                cwd=folder,
                env=environment,
                stdout=subprocess.DEVNULL,
                stderr=subprocess.DEVNULL,
            )
            for command in commands
        ]
        try:
            yield _address(file, workers)
        finally:
            for process in processes:
                process.kill()
            for process in processes:
                process.wait()


def _address(file: Path, workers: int) -> str:
    """Return the scheduler's address from its output, once all workers have connected."""
    from distributed import Client

    while not file.exists() or not file.stat().st_size:
        time.sleep(0.02)
    with Client(scheduler_file=str(file), set_as_default=False) as client:
        client.wait_for_workers(workers)
        return str(client.scheduler.address)


def measure(tasks: int) -> dict[int, float]:
    """Return the seconds for the lab's whole rubric on ``tasks`` boards, by the number of workers."""
    rubric = load_rubric("lab3")
    program = prebuilt("solution").read_bytes()
    seconds = {}
    for workers in (1, 2):
        with cluster(workers) as address, DaskWorkers(address) as executor:
            boards = [
                Task(program, "lab3.elf", "lab3", rubric.digest, seed, code_digest()) for seed in range(tasks)
            ]
            for future in [executor.submit(judge_task, boards[0]) for _ in range(workers)]:
                future.result()  # everything is loaded
            began_s = time.perf_counter()
            for future in [executor.submit(judge_task, board) for board in boards]:
                future.result()
            seconds[workers] = time.perf_counter() - began_s
    return seconds


if __name__ == "__main__":
    taken = measure(int(sys.argv[1]) if len(sys.argv) > 1 else 8)
    for number, wall_s in taken.items():
        sys.stdout.write(f"{number} workers: {wall_s:.1f} s\n")
    sys.stdout.write(f"two take {taken[2] / taken[1]:.2f} of the time of one\n")
