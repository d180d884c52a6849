"""The rows of the firmware in Python: its speed, the cost of a burst, and the constant cost of a long run."""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from fcu_emulator import Board
from tests.bench.row import PEAK_MB, Row, cpu_s

BOOT = "STEVAL-FCU001V1 FH rev.1.0 - Sep 2017\n\nLSM6DSL MEMS Accelerometer initialized and enabled\n"
TICK_HZ = 800
_TRANSFERS_A_TICK = 4


def run_board(seconds: float, *, ideal: bool, trace: Path | None = None) -> tuple[Board, float]:
    """Run a board for this time; return it, and the CPU seconds after the first 1.5 virtual seconds."""
    board = Board(firmware="lab3", ideal=ideal)
    board.run_for(1.5)  # boot: no ticks yet, and the first blocks of samples
    ticks = board.tim9.ticks
    if trace is not None:
        board.trace.write_to(trace)
    took = cpu_s(lambda: (board.run_for(seconds), board.trace.close()))
    assert board.terminal.text.startswith(BOOT), board.terminal.text[:200]
    assert board.terminal.text.count("ACC[x,y,z] ") >= int(seconds * 0.9), "a block a second"
    assert abs(board.tim9.ticks - ticks - TICK_HZ * seconds) <= 1, board.tim9.ticks
    assert (board.tim9.late, board.tim9.lost) == (0, 0)
    return board, took


def speed(*, ideal: bool) -> float:
    """Return virtual over CPU time, the best of five."""
    return max(20 / run_board(20, ideal=ideal)[1] for _ in range(5))


def traced() -> float:
    """Return virtual over CPU time if every event is written to a file."""
    seconds = 10

    def once() -> float:
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder) / "trace.jsonl"
            _, took = run_board(seconds, ideal=False, trace=file)
            lines = file.read_text(encoding="utf-8").splitlines()
        kinds = [json.loads(line)["kind"] for line in lines]
        assert abs(kinds.count("bus") - _TRANSFERS_A_TICK * TICK_HZ * seconds) <= 8, kinds.count("bus")
        assert kinds.count("terminal") > 0
        return seconds / took

    return max(once() for _ in range(3))


def burst_us() -> float:
    """Return CPU microseconds of one six-register burst of old data through bus and target."""
    board = Board(ideal=True)
    board.i2c2.write(0x6B, b"\x10\xa8")
    board.run_for(0.1)
    board.i2c2.write(0x6B, b"\x10\x00")
    count = 50_000
    started = time.process_time()
    for _ in range(count):
        data = board.i2c2.bus.read_from(0x6B, 0x28, 6)
    took = time.process_time() - started
    assert data == bytes.fromhex("000000000520"), data.hex()
    return took / count * 1e6


def linearity() -> float:
    """Return the CPU time of a virtual second in a long run, relative to that in a short run."""
    short = min(run_board(10, ideal=True)[1] for _ in range(3)) / 10
    return run_board(600, ideal=True)[1] / 600 / short


def hour() -> dict[str, float]:
    """Run an hour in a separate process; return factor, exact tick count, peak memory."""
    script = (
        PEAK_MB + "import json,time\n"
        "from fcu_emulator.emulator import Board\n"
        "board=Board(firmware='lab3'); started=time.process_time(); board.run_for(3600)\n"
        "timer=board.tim9\n"
        "print(json.dumps(dict(took=time.process_time()-started, ticks=timer.ticks, lost=timer.lost,"
        "rss=peak_mb(),"
        "blocks=board.terminal.text.count('Altitude: '))))\n"
    )
    result = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    found: dict[str, float] = json.loads(result.stdout)
    assert found["lost"] == 0
    assert found["ticks"] >= (3600 - 1.2) * TICK_HZ
    assert found["blocks"] >= 3400, "a block a second and the time it takes to print"
    return {"factor": 3600 / found["took"], "rss": found["rss"]}


def rows() -> list[Row]:
    """Return all rows except the hour."""
    return [
        Row("lab3, every register read, ideal sensors", lambda: speed(ideal=True), "x", 0, 120, 165),
        Row("lab3, every register read, typical noise", lambda: speed(ideal=False), "x", 0, 110),
        Row("lab3, typical noise, with a trace file", traced, "x", 0, 30, 50),
        Row("burst of six registers through the bus", burst_us, "us", 2, None, 0.5, less_is_better=True),
        Row("cost of a second: 600 s run over 10 s run", linearity, "", 3),
    ]


def hour_rows() -> list[Row]:
    """Return the rows of the hour, which is run once for both."""
    found: dict[str, float] = {}

    def of(name: str) -> float:
        found.update(found or hour())
        return found[name]

    return [
        Row("an hour of lab3, typical noise", lambda: of("factor"), "x", 0),
        Row("an hour of lab3: peak memory", lambda: of("rss"), "MB", 0, 150, less_is_better=True),
    ]
