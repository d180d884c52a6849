"""The rows about starting: commands, the first byte, the next board, memory, restoring a snapshot."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager

from fcu_emulator import Board
from tests.bench.row import PEAK_MB, TIMES, Row, cpu_s

try:
    import resource
except ImportError:  # not on Windows
    resource = None  # type: ignore[assignment]

FIRST_LINE = "STEVAL-FCU001V1 FH rev.1.0 - Sep 2017"


@contextmanager
def _compiled_once() -> Iterator[dict[str, str]]:
    """Return an environment in which Python keeps compiled modules, as after an installation."""
    with tempfile.TemporaryDirectory() as cache:
        environment = {**os.environ, "PYTHONPYCACHEPREFIX": cache}
        environment.pop("PYTHONDONTWRITEBYTECODE", None)
        yield environment


def _childrens_cpu_s() -> float:
    """Return the CPU time of ended child processes, or the wall time if the system does not tell it."""
    if resource is None:
        return time.perf_counter()
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def command(expected: str, *arguments: str, times: int = TIMES) -> float:
    """Return the CPU seconds of an ``fcu`` command that prints ``expected`` first, the best of several runs."""
    with _compiled_once() as environment:

        def once() -> float:
            started = _childrens_cpu_s()
            done = subprocess.run(
                [sys.executable, "-m", "fcu_emulator", *arguments],
                capture_output=True,
                text=True,
                check=True,
                env=environment,
            )
            assert done.stdout.startswith(expected), done.stdout[:200]
            return _childrens_cpu_s() - started

        return min([once() for _ in range(times + 1)][1:])


def check() -> float:
    """Return the CPU seconds of the lab's whole rubric for the solution, 119 s of virtual time; measured one time."""
    return command("LAB3: pitch, roll, yaw", "check", "solution", times=1)


def first_byte() -> float:
    """Return the CPU seconds of ``fcu run solution`` until its first byte arrives; best of five.

    Then the program is killed, because a user does not wait for later work such as the summary.
    """
    with _compiled_once() as environment:

        def once() -> float:
            started = _childrens_cpu_s()
            command = [sys.executable, "-m", "fcu_emulator", "run", "solution"]
            with subprocess.Popen(
                command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, env=environment
            ) as process:
                assert process.stdout is not None
                first = process.stdout.read(1)
                process.kill()
            assert first == FIRST_LINE[:1].encode(), first
            return _childrens_cpu_s() - started

        return min([once() for _ in range(TIMES + 1)][1:])


def next_board() -> float:
    """Return the CPU milliseconds for another board with the solution, after one has been created."""

    def prints_as_the_first(board: Board) -> None:
        board.run_for(0.006)
        assert board.terminal.text.startswith(FIRST_LINE), board.terminal.text

    boards = [Board(firmware="solution")]
    prints_as_the_first(boards[0])
    best = min(cpu_s(lambda: boards.append(Board(firmware="solution"))) for _ in range(TIMES))
    for board in boards[1:]:
        prints_as_the_first(board)
    return best * 1e3


def memory() -> float:
    """Return the peak megabytes of a process after two virtual seconds of the solution."""
    script = (
        PEAK_MB + "import json\n"
        "from fcu_emulator.emulator import Board\n"
        "board=Board(firmware='solution')\n"
        "board.run_for(2)\n"
        "print(json.dumps(dict(text=board.terminal.text, rss=peak_mb())))\n"
    )
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    found = json.loads(done.stdout)
    assert found["text"].startswith(FIRST_LINE), found["text"][:200]
    return float(found["rss"])


def restores() -> float:
    """Return the number of restores in a CPU second for a board with the solution.

    Each must continue like the original.
    """
    board = Board(firmware="solution")
    board.run_for(1.2)
    kept = board.snapshot()  # type: ignore[attr-defined]
    board.run_for(0.01)
    text = board.terminal.text
    count = 1_000
    started = time.process_time()
    for _ in range(count):
        board.restore(kept)  # type: ignore[attr-defined]
    took = time.process_time() - started
    board.run_for(0.01)
    assert board.terminal.text == text
    return count / took


def rows() -> list[Row]:
    """Return the rows. Restoring is measured if a board supports it."""
    run = ("run", "--duration", "1s", "--speed", "max")
    found = [
        Row("fcu --help", lambda: command("Usage: fcu", "--help"), "s", 2, 0.3, less_is_better=True),
        Row("fcu run, 1 s of lab3", lambda: command(FIRST_LINE, *run), "s", 2, 1, less_is_better=True),
        Row("first byte of fcu run solution", first_byte, "s", 3, 0.3, 0.15, less_is_better=True),
        Row("fcu check solution", check, "s", 1, 12, less_is_better=True),
        Row("next board in the process", next_board, "ms", 1, 10, 3, less_is_better=True),
        Row("peak memory, solution", memory, "MB", 0, 120, less_is_better=True),
    ]
    if hasattr(Board, "snapshot"):
        found.append(Row("restores of a snapshot", restores, "/s", 0, 1000))
    return found
