"""``fcu run`` and ``--limit`` with firmware that hangs, crashes, runs slowly or prints without end."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest

from tests.support.words import Words

BROKEN = Path(__file__).parent / "broken"


def run(program: str, *arguments: str) -> tuple[int, str]:
    """Return the exit code and the output on stderr."""
    firmware = program if program == "solution" else str(BROKEN / f"{program}.elf")
    done = subprocess.run(
        [sys.executable, "-m", "fcu_emulator", "run", firmware, "--speed", "max", *arguments],
        capture_output=True,
        stdin=subprocess.DEVNULL,
        timeout=120,
        check=False,
    )
    return done.returncode, done.stderr.decode()


@pytest.mark.parametrize(
    ("program", "named"),
    [("wrong_address", "0x6B"), ("outside_memory", "0x20010000"), ("stack_overflow", "HardFault")],
)
def test_stuck_firmware_is_explained_and_exits_3(program: str, named: str, words: Words) -> None:
    code, text = run(program, "--duration", "100ms")
    assert code == 3
    summary = next(line for line in text.splitlines() if named in line)
    assert summary.startswith("fcu: ")
    assert text.count(summary) == 1
    words("run", summary)


def test_silent_firmware_is_explained_during_and_after_run() -> None:
    code, text = run("wrong_address", "--duration", "4s")
    lines = text.splitlines()
    told = [number for number, line in enumerate(lines) if "fcu: stuck in Error_Handler()" in line]
    end = next(number for number, line in enumerate(lines) if re.match(r"fcu: [\d.]+ s ", line))
    assert code == 3
    assert len(told) == 2
    assert told[0] < end < told[1]
    assert text.count("callers (") == 1


def test_slow_firmware_is_explained_and_keeps_exit_code() -> None:
    code, text = run("slow_callback", "--duration", "300ms")
    assert code == 0
    assert "main() never runs" in text


def test_lost_store_is_explained_and_keeps_exit_code() -> None:
    code, text = run("null_pointer", "--duration", "100ms")
    assert code == 0
    assert "write through a NULL pointer at 0.002357 s in storeReading()" in text


@pytest.mark.parametrize("limit", ["instructions=1000", "terminal_bytes=20"])
def test_exceeded_limit_is_reported_in_one_line(limit: str, words: Words) -> None:
    code, text = run("solution", "--duration", "100ms", "--limit", limit)
    assert code == 3
    words("run", text.splitlines()[-1])


@pytest.mark.parametrize("limit", ["instructions", "instructions=-1", "memory=7", "wall_s=soon"])
def test_impossible_limit_is_refused(limit: str) -> None:
    code, text = run("unshifted_address", "--limit", limit)
    assert code == 2
    assert text.count("\n") == 1
