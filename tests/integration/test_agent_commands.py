"""Commands that ``fcu mcp`` starts: time and output are limited, and child processes end with their command."""

from __future__ import annotations

import subprocess
from pathlib import Path

import pytest

from fcu_emulator.emulator.agents import commands
from fcu_emulator.emulator.agents.commands import TimeLimit, run_fcu
from fcu_emulator.emulator.errors import InputError, NotJudgedError


@pytest.fixture
def processes(monkeypatch: pytest.MonkeyPatch) -> list[subprocess.Popen[bytes]]:
    """Return the processes that the commands start."""
    started = []

    class Recorded(subprocess.Popen[bytes]):
        def __init__(self, *arguments: object, **settings: object) -> None:
            super().__init__(*arguments, **settings)  # type: ignore[call-overload]
            started.append(self)

    monkeypatch.setattr(commands.subprocess, "Popen", Recorded)
    return started


def test_command_returns_streams_and_code() -> None:
    done = run_fcu(["run", "lab3", "--duration=1500ms", "--speed=max"], TimeLimit(60))

    assert (done.code, done.lost) == (0, 0)
    assert "LAB3 Init..." in done.output
    assert "1.500 s of virtual time" in done.errors
    done.raise_usage_error()


def test_usage_error_is_raised_without_prefix() -> None:
    done = run_fcu(["run", "no_such.elf"], TimeLimit(60))

    with pytest.raises(InputError, match=r"^(?!fcu: ).*no_such\.elf"):
        done.raise_usage_error()


def test_usage_error_of_click_is_one_line(tmp_path: Path) -> None:
    file = tmp_path / "file"
    file.touch()
    done = run_fcu(["build", "--", str(file)], TimeLimit(60))

    with pytest.raises(InputError, match=r"^Invalid value for .* is a file\.$"):
        done.raise_usage_error()


def test_slow_command_is_ended(processes: list[subprocess.Popen[bytes]]) -> None:
    with pytest.raises(NotJudgedError, match=r"fcu run did not end within 0\.2 s of wall time"):
        run_fcu(["run", "solution", "--duration=100000s", "--speed=max"], TimeLimit(0.2))

    (process,) = processes
    assert process.returncode is not None


def test_cancelled_command_is_ended(processes: list[subprocess.Popen[bytes]]) -> None:
    limit = TimeLimit(1000)
    limit.cancel()
    with pytest.raises(NotJudgedError):
        run_fcu(["run", "solution", "--duration=100000s", "--speed=max"], limit)

    assert processes[0].returncode is not None


def test_command_that_ignores_request_is_killed(
    processes: list[subprocess.Popen[bytes]], monkeypatch: pytest.MonkeyPatch
) -> None:
    ignores = "import signal, sys; signal.signal(signal.SIGTERM, signal.SIG_IGN); sys.stdout.close()"
    monkeypatch.setattr(commands, "_START", f"{ignores}; [0 for _ in iter(int, 1)]")
    monkeypatch.setattr(commands, "_END_S", 0.2)
    with pytest.raises(NotJudgedError):
        run_fcu(["run"], TimeLimit(1))

    assert processes[0].returncode is not None


def test_long_output_is_cut_and_counted(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(commands, "_START", "import sys; sys.stdout.write('x' * 3_000_000)")
    done = run_fcu(["run"], TimeLimit(60))

    assert done.output == "x" * (1 << 20)
    assert done.lost == 3_000_000 - (1 << 20)


def test_time_limit_restarts_after_waiting() -> None:
    limit = TimeLimit(-1)
    assert limit.over
    limit.wall_s = 1000
    limit.begin()
    assert not limit.over
    limit.cancel()
    assert limit.over
