"""The speed table: ``python -m tests.bench`` (two minutes; ``--quick`` leaves out the hour).

Each row first asserts what it computed (text, tick count), then reports the time. Ratios against real time
are those of this machine; compare two versions only in one sitting.
"""

from __future__ import annotations

import json
import subprocess
import sys
import time
from collections.abc import Callable

from emulator import Board
from tests.bench import arm

BOOT = "STEVAL-FCU001V1 FH rev.1.0 - Sep 2017\n\nLSM6DSL MEMS Accelerometer initialized and enabled\n"
TICK_HZ = 800


def run_board(seconds: float, *, ideal: bool, firmware: str = "lab3") -> tuple[Board, float]:
    """A board run for so long, and the CPU seconds it took after the first virtual second and a half."""
    board = Board(firmware=firmware, ideal=ideal)
    board.run_for(1.5)  # boot: no ticks yet, and the first blocks of samples
    started = time.process_time()
    ticks = board.tim9.ticks
    board.run_for(seconds)
    took = time.process_time() - started
    assert board.terminal.text.startswith(BOOT), board.terminal.text[:200]
    assert board.terminal.text.count("ACC[x,y,z] ") >= int(seconds * 0.9), "a block a second"
    assert abs(board.tim9.ticks - ticks - TICK_HZ * seconds) <= 1, board.tim9.ticks
    assert (board.tim9.late, board.tim9.lost) == (0, 0)
    return board, took


def factor(seconds: float, *, ideal: bool) -> float:
    """Virtual over CPU time, the best of three."""
    return max(seconds / run_board(seconds, ideal=ideal)[1] for _ in range(3))


def burst_us() -> float:
    """CPU microseconds of one six-register burst of old data through bus and target."""
    board = Board(ideal=True)
    board.i2c2.write(0x6B, b"\x10\xa8")
    board.run_for(0.1)
    board.i2c2.write(0x6B, b"\x10\x00")
    count = 50_000
    started = time.process_time()
    for _ in range(count):
        data = board.bus.read_from(0x6B, 0x28, 6)
    took = time.process_time() - started
    assert data == bytes.fromhex("00000000 0520".replace(" ", "")), data.hex()
    return took / count * 1e6


def hour() -> dict[str, float]:
    """An hour of the lab firmware in a process of its own: factor, exact tick count, peak memory."""
    script = (
        "import json,time\n"
        "try:\n    import resource\nexcept ImportError:\n    resource=None\n"
        "from emulator import Board\n"
        "board=Board(firmware='lab3'); started=time.process_time(); board.run_for(3600)\n"
        "timer=board.tim9\n"
        "print(json.dumps(dict(took=time.process_time()-started, ticks=timer.ticks, lost=timer.lost,"
        "rss=resource.getrusage(resource.RUSAGE_SELF).ru_maxrss if resource else 0,"
        "blocks=board.terminal.text.count('Altitude: '))))\n"
    )
    result = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    found: dict[str, float] = json.loads(result.stdout)
    assert found["lost"] == 0
    assert found["ticks"] >= (3600 - 1.2) * TICK_HZ
    assert found["blocks"] >= 3400, "a block a second and the time it takes to print"
    return found


def command(expected: str, *arguments: str) -> float:
    """Wall seconds of an ``fcu`` command that prints ``expected`` first, the best of five."""

    def once() -> float:
        started = time.perf_counter()
        done = subprocess.run(
            [sys.executable, "-m", "emulator", *arguments], capture_output=True, text=True, check=True
        )
        took = time.perf_counter() - started
        assert done.stdout.startswith(expected), done.stdout[:200]
        return took

    return min(once() for _ in range(5))


def row(name: str, value: str, wanted: str) -> None:
    """One line of the table."""
    sys.stdout.write(f"{name:<58} {value:>12}   {wanted}\n")
    sys.stdout.flush()


def main() -> None:
    """Print the table."""
    measured: list[tuple[str, Callable[[], str], str]] = [
        (
            "lab3, 800 Hz, every register read, ideal sensors",
            lambda: f"{factor(20, ideal=True):.0f} x",
            "60 x, aim 100 x",
        ),
        (
            "lab3, 800 Hz, every register read, typical noise",
            lambda: f"{factor(20, ideal=False):.0f} x",
            "40 x",
        ),
        ("burst of six registers through the bus", lambda: f"{burst_us():.2f} us", "aim 0.5 us"),
        ("cost of a second: 600 s run over 10 s run", lambda: f"{linearity():.3f}", "0.9 to 1.1"),
        ("fcu --help", lambda: f"{command('Usage: fcu', '--help'):.2f} s", "0.3 s"),
        (
            "fcu run --duration 1s --speed max",
            lambda: f"{command(BOOT[:39], 'run', '--duration', '1s', '--speed', 'max'):.2f} s",
            "1 s",
        ),
        *arm.rows(),
    ]
    row("what", "measured", "wanted")
    for name, measure, wanted in measured:
        row(name, measure(), wanted)
    if "--quick" not in sys.argv:
        found = hour()
        row("an hour of virtual time, typical noise", f"{3600 / found['took']:.0f} x", "")
        row("... ticks lost", f"{found['lost']:.0f}", "0")
        row("... peak memory", f"{found['rss'] / 1024:.0f} MB", "150 MB")


def linearity() -> float:
    """CPU time of a virtual second in a long run, relative to one in a short run."""
    short = min(run_board(10, ideal=True)[1] for _ in range(3)) / 10
    return run_board(600, ideal=True)[1] / 600 / short


if __name__ == "__main__":
    main()
