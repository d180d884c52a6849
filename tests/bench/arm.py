"""The chip's rows of the speed table. Each asserts what was computed before it reports a time."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

from emulator import Board
from tests.arm.speed_programs import ARITHMETIC, POLLS_A_PIN, SHOWS_A_PIN, program

_HSI_HZ = 16_000_000
_NOMINAL = 84_000_000 / _HSI_HZ  # the programs in assembly run from HSI: a second of theirs is less work
_TICK_HZ = 800


def _best(board: Board, seconds: float, times: int = 5) -> float:
    """CPU seconds for a virtual second, the best of some."""

    def once() -> float:
        started = time.process_time()
        board.run_for(seconds)
        return (time.process_time() - started) / seconds

    return min(once() for _ in range(times))


def solution(profile: str) -> float:
    """Virtual over CPU time of the shipped solution."""
    board = Board(profile, "solution", "desk")
    board.run_for(1.5)
    ticks = board.tim9.ticks
    took = _best(board, 0.3)
    assert "LAB3 Init..." in board.terminal.text, board.terminal.text[:300]
    assert board.terminal.text.count("Pitch: ") >= 2, board.terminal.text
    assert abs(board.tim9.ticks - ticks - 1.5 * _TICK_HZ) <= 1, board.tim9.ticks
    assert (board.tim9.late, board.tim9.lost) == (0, 0)
    return 1 / took


def _chip(source: str, seconds: float) -> tuple[Board, float, int, int]:
    """A program in assembly: board, CPU seconds a virtual second, instructions a virtual second, R4."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "program.bin"
        file.write_bytes(program(source))
        board = Board(firmware=file)
    board.run_for(0.05)
    assert board.arm is not None
    core = board.arm.chip.core
    before = core.timeline.retired
    took = _best(board, seconds)
    return board, took, round((core.timeline.retired - before) / (5 * seconds)), core.engine.register(4)


def polling() -> float:
    """A main loop that polls a pin and never repeats itself, against 84 MHz."""
    _, took, rate, laps = _chip(POLLS_A_PIN, 0.2)
    assert abs(rate * 1.3 - _HSI_HZ) < 100, rate
    assert laps > 1_000_000, laps
    return 1 / took / _NOMINAL


def button() -> float:
    """A main loop that shows a pin on a LED, against 84 MHz."""
    board, took, _, _ = _chip(SHOWS_A_PIN, 0.2)
    assert board.led1.on
    return 1 / took / _NOMINAL


def arithmetic() -> float:
    """Million instructions a CPU second without loads and stores."""
    _, took, rate, laps = _chip(ARITHMETIC, 0.5)
    assert laps > 1_000_000, laps
    return rate / took / 1e6


def start() -> dict[str, float]:
    """A process of its own, with compiled modules as in an installation: wall seconds from importing to the
    first byte, and megabytes after 2 virtual seconds.
    """
    script = (
        "import json,time\nstarted=time.perf_counter()\n"
        "try:\n    import resource\nexcept ImportError:\n    resource=None\n"
        "from emulator import Board\n"
        "board=Board(firmware='solution')\n"
        "while not board.terminal.text: board.run_for(0.001)\n"
        "first=time.perf_counter()-started\n"
        "board.run_for(2)\n"
        "print(json.dumps(dict(first=first, text=board.terminal.text[:15],"
        "rss=resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024 if resource else 0)))\n"
    )
    with tempfile.TemporaryDirectory() as cache:
        environment = {**os.environ, "PYTHONPYCACHEPREFIX": cache}
        environment.pop("PYTHONDONTWRITEBYTECODE", None)
        runs = [
            subprocess.run(
                [sys.executable, "-c", script], capture_output=True, text=True, check=True, env=environment
            )
            for _ in range(4)
        ]
    found = [json.loads(run.stdout) for run in runs]
    assert all(run["text"] == "STEVAL-FCU001V1" for run in found), found
    return {"first": min(run["first"] for run in found), "rss": max(run["rss"] for run in found)}


def rows() -> list[tuple[str, Callable[[], str], str]]:
    """Name, measurement and what is wanted."""
    return [
        ("chip: solution on I2C2, 800 Hz", lambda: f"{solution('lab3'):.2f} x", "5 x, aim 10 x"),
        ("chip: solution on SPI2, 800 Hz", lambda: f"{solution('fcu001v1'):.2f} x", ""),
        ("chip: a loop that polls a pin and counts, of 84 MHz", lambda: f"{polling():.2f} x", "0.8 x"),
        ("chip: a loop that shows a pin on a LED, of 84 MHz", lambda: f"{button():.1f} x", ""),
        ("chip: arithmetic", lambda: f"{arithmetic():.0f} MIPS", "150 MIPS"),
        ("chip: start to first byte", lambda: f"{start()['first']:.2f} s", "0.5 s"),
        ("chip: peak memory", lambda: f"{start()['rss']:.0f} MB", "120 MB"),
    ]
