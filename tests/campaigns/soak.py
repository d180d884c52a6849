"""Two virtual hours of a firmware, and their cost: ``python -m tests.campaigns.soak``.

::

    FIRMWARE ...     names of firmwares; default: lab3 solution
    --hours NUMBER   hours of virtual time; default: 2

It prints a row every five minutes of virtual time: memory of the process (RSS), open descriptors, ticks of the
timer and printed bytes since the previous row, and virtual time over processor time. Each firmware has a separate
process. A run is served as in ``fcu run``, with a link that takes all bytes. Memory and descriptors come from
/proc of Linux.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from fcu_emulator import Board
from fcu_emulator.emulator.analysis.recorder import TruthRecorder
from fcu_emulator.emulator.clock import to_ps
from fcu_emulator.emulator.links import MemoryLink
from fcu_emulator.emulator.links.runner import Progress, Runner

EVERY_S = 300.0
FIRMWARE = ("lab3", "solution")
_HEAD = "| virtual time | memory MiB | descriptors | ticks | bytes | x real time |"


@dataclass(frozen=True)
class Sample:
    """One row. ``ticks``, ``printed`` and ``speed`` count from the previous row."""

    virtual_s: float
    memory_mib: float
    descriptors: int
    ticks: int
    printed: int
    speed: float


class Counting(MemoryLink):
    """A link whose reader accepts all bytes immediately, without storing them."""

    taken = 0

    def send(self, data: bytes) -> None:
        """Count the bytes."""
        self.taken += len(data)


def soak(
    firmware: str,
    duration_s: float,
    every_s: float = EVERY_S,
    say: Callable[[Sample], None] = lambda _: None,
) -> list[Sample]:
    """Run ``firmware``; yield a sample after each ``every_s`` of virtual time."""
    board = Board(firmware)
    recorder = TruthRecorder(board)
    link = Counting()
    samples: list[Sample] = []
    before = [0.0, 0, 0, time.process_time()]  # virtual time, ticks, bytes, processor time

    def look(progress: Progress) -> None:
        if progress.virtual_s < every_s * (len(samples) + 1):
            return
        now = [progress.virtual_s, board.timer.ticks, link.taken, time.process_time()]
        passed_s, ticks, printed, cpu_s = (new - old for new, old in zip(now, before, strict=True))
        before[:] = now
        sample = Sample(now[0], memory_mib(), descriptors(), int(ticks), int(printed), passed_s / cpu_s)
        samples.append(sample)
        say(sample)

    Runner(board, [link], to_ps(duration_s), None).run(look)
    recorder.close()
    return samples


def memory_mib() -> float:
    """Return the memory of this process."""
    pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / 2**20


def descriptors() -> int:
    """Return the number of open files, pipes and sockets of this process, without the listed folder."""
    return sum(1 for _ in Path("/proc/self/fd").iterdir()) - 1


def show(sample: Sample) -> None:
    """Print a row immediately."""
    minutes = round(sample.virtual_s / 60)
    sys.stdout.write(
        f"| {minutes // 60}:{minutes % 60:02d} | {sample.memory_mib:.1f} | {sample.descriptors} "
        f"| {sample.ticks} | {sample.printed} | {sample.speed:.0f} |\n"
    )
    sys.stdout.flush()


def main() -> None:
    """Run the command."""
    parser = argparse.ArgumentParser(
        prog="python -m tests.campaigns.soak", description=__doc__.splitlines()[0]
    )
    parser.add_argument("firmware", nargs="*", metavar="FIRMWARE")
    parser.add_argument("--hours", type=float, default=2.0)
    given = parser.parse_args()
    if len(given.firmware) != 1:
        for firmware in given.firmware or FIRMWARE:
            command = [sys.executable, "-m", "tests.campaigns.soak", firmware, "--hours", str(given.hours)]
            subprocess.run(command, check=True)
        return
    sys.stdout.write(f"{given.firmware[0]}\n\n{_HEAD}\n|{' --- |' * 6}\n")
    soak(given.firmware[0], given.hours * 3600, say=show)


if __name__ == "__main__":
    main()
