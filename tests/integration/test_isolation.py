"""``fcu run --isolate`` and :mod:`fcu_emulator.emulator.host.isolation`: a worker's crash is not a wrong answer."""

from __future__ import annotations

import os
import re
import select
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from fcu_emulator.emulator.errors import InputError
from fcu_emulator.emulator.host.isolation import WorkerLimits, limits_of_worker, not_limited, run_isolated
from fcu_emulator.firmware_model.arm import prebuilt
from tests.integration.test_exit_codes import (
    BAD,
    FAILED,
    FIRMWARE_FAILED,
    GOOD,
    NOT_JUDGED,
    PASSED,
    SECOND,
    USAGE_ERROR,
    fcu,
    posix,
    run_scenario,
)
from tests.support.scenario_files import HEAD, write
from tests.support.words import Words

linux = pytest.mark.skipif(sys.platform != "linux", reason="limits that only Linux keeps; /proc")
INTERRUPTED = 130


# -- A program that ends gives the same result without --isolate -------------------------------------------


@pytest.mark.parametrize(
    ("text", "more", "code"),
    [
        (SECOND + GOOD, (), PASSED),
        (SECOND + BAD, (), FAILED),
        (SECOND + "[[expect]]\nkind = 'lines'\n", (), USAGE_ERROR),
        (SECOND + GOOD, ("--limit", "terminal_bytes=100"), FIRMWARE_FAILED),
        (SECOND + GOOD, ("--duration", "1s"), NOT_JUDGED),
    ],
)
def test_isolated_run_has_same_verdict(tmp_path: Path, text: str, more: tuple[str, ...], code: int) -> None:
    alone, isolated = (run_scenario(tmp_path, text, *more, *isolate) for isolate in ((), ("--isolate",)))
    assert (alone.returncode, isolated.returncode) == (code, code), isolated.stderr
    assert isolated.stdout == alone.stdout
    assert isolated.stderr.splitlines()[-1] == alone.stderr.splitlines()[-1]


def test_applied_limits_are_printed(words: Words) -> None:
    more = ("--limit", "cpu_s=60", "--limit", "memory_bytes=536870912") if not not_limited() else ()
    done = fcu("run", "--duration", "100ms", "--isolate", *more)
    if more:
        (line,) = [line for line in done.stderr.splitlines() if "512 MiB" in line]
        words("run", line)


@pytest.mark.parametrize(
    "arguments",
    [
        ("--limit", "cpu_s=5"),
        ("--isolate", "--limit", "cpu_s=1.5"),
        ("--isolate", "--limit", "open_files=0"),
        ("--isolate", "--limit", "memory_bytes=1000"),
    ],
)
def test_senseless_limits_are_refused(arguments: tuple[str, ...], words: Words) -> None:
    done = fcu("run", "--duration", "100ms", *arguments)
    assert (done.returncode, done.stdout, len(done.stderr.splitlines())) == (USAGE_ERROR, "", 1)
    words("run", done.stderr)


@posix
def test_closed_standard_output_stays_closed_for_worker(words: Words) -> None:
    done = fcu("run", "--duration", "100ms", "--isolate", after=">&-")
    assert done.returncode == USAGE_ERROR
    words("run", done.stderr)


@posix
def test_isolated_run_without_streams_is_refused() -> None:
    assert fcu("run", "--duration", "100ms", "--isolate", after="<&- >&- 2>&-").returncode == USAGE_ERROR


# -- Limits of the machine ----------------------------------------------------------------------------------


@linux
def test_exhausted_processor_time_is_not_judged(words: Words) -> None:
    done = fcu(
        "run",
        prebuilt("solution"),
        "--duration",
        "10min",
        "--isolate",
        "--limit",
        "cpu_s=1",
        "--speed",
        "max",
    )
    assert done.returncode == NOT_JUDGED
    words("run", done.stderr.splitlines()[-1])


@linux
def test_exceeded_file_size_is_not_judged(tmp_path: Path, words: Words) -> None:
    trace = tmp_path / "trace.jsonl"
    done = fcu("run", "--duration", "3s", "--trace", trace, "--isolate", "--limit", "file_bytes=1000")
    assert done.returncode == NOT_JUDGED
    words("run", done.stderr.splitlines()[-1])
    assert trace.stat().st_size == 1000


@linux
def test_exhausted_memory_is_not_judged(program: str, words: Words) -> None:
    ending = run_isolated(program, ["list(range(10**9))"], WorkerLimits(memory_bytes=256 << 20))
    assert ending.code is None
    words("run", ending.cause)


def test_worker_may_set_its_limits_again() -> None:
    """A worker that does many tasks sets its limits for each task.

    The second call does not reduce the remaining limits of the first call.
    """
    code = (
        "from fcu_emulator.emulator.host.isolation import WorkerLimits\n"
        "[WorkerLimits(cpu_s=5).apply() for _ in range(3)]; print('done')"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout) == (0, "done\n"), done.stderr


def test_this_process_is_not_worker() -> None:
    assert limits_of_worker() is None


@pytest.mark.parametrize("number", [0, 1 << 62, 10**30])
@pytest.mark.parametrize("name", ["memory_bytes", "cpu_s", "file_bytes", "open_files"])
def test_limit_out_of_range_is_refused(name: str, number: int) -> None:
    with pytest.raises(InputError, match=name):
        WorkerLimits(**{name: number})


# -- How a worker ends --------------------------------------------------------------------------------------


@pytest.fixture
def program(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    """Write a module with this program."""
    (tmp_path / "told.py").write_text("import os, signal, sys\nexec(sys.argv[1])\n", encoding="utf-8")
    monkeypatch.syspath_prepend(tmp_path)
    return "told"


@pytest.mark.parametrize(("code", "number"), [("pass", 0), ("sys.exit(3)", 3), ("sys.exit('no')", 1)])
def test_worker_exit_code_is_reported(program: str, code: str, number: int) -> None:
    ending = run_isolated(program, [code], WorkerLimits())
    assert (ending.code, ending.cause, ending.interrupted) == (number, "", False)


@posix
@pytest.mark.parametrize(
    "code",
    [
        "os.kill(os.getpid(), signal.SIGKILL)",
        "os.kill(os.getpid(), signal.SIGSEGV)",
        "os.abort()",
        "os.kill(os.getpid(), signal.SIGTERM)",
        "os._exit(0)",
        "os._exit(1)",
        "os._exit(120)",
    ],
)
def test_worker_death_is_reported_with_cause(program: str, code: str, words: Words) -> None:
    ending = run_isolated(program, [code], WorkerLimits())
    assert ending.code is None
    words("run", ending.cause)


def workers(process: subprocess.Popen[str]) -> list[int]:
    listed = Path(f"/proc/{process.pid}/task/{process.pid}/children").read_text(encoding="ascii")
    return [int(number) for number in listed.split()]


def started(*arguments: str | Path, group: bool = False) -> subprocess.Popen[str]:
    """Start an isolated run, and wait until it has printed some text."""
    process = subprocess.Popen(
        [sys.executable, "-m", "fcu_emulator", "run", *map(str, arguments), "--isolate", "--speed", "1"],
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=group,
    )
    assert process.stdout is not None
    process.stdout.read(1)
    return process


@linux
def test_killed_worker_is_not_judged(tmp_path: Path, words: Words) -> None:
    process = started("--scenario", write(tmp_path, HEAD + 'duration = "300s"\n' + GOOD))
    (worker,) = workers(process)
    os.kill(worker, signal.SIGKILL)
    _, errors = process.communicate(timeout=60)
    assert process.returncode == NOT_JUDGED
    words("run", errors.splitlines()[-1])


@linux
@pytest.mark.usefixtures("interruptible")
@pytest.mark.parametrize("name", ["SIGINT", "SIGTERM", "SIGHUP"])
@pytest.mark.parametrize("everybody", [False, True], ids=["parent", "both"])
def test_request_to_end_reaches_worker_exactly_once(name: str, everybody: bool) -> None:
    """The signal goes only to the parent, as from ``kill``, or to both, as for Ctrl-C in a terminal."""
    process = started("--duration", "300s", group=everybody)
    (worker,) = workers(process)
    if everybody:
        os.killpg(process.pid, getattr(signal, name))
    else:
        process.send_signal(getattr(signal, name))
    _, errors = process.communicate(timeout=60)
    assert process.returncode == PASSED, errors
    assert re.search(r"^fcu: [\d.]+ s .* s", errors, re.M)
    assert not Path(f"/proc/{worker}").exists()


@linux
def test_no_worker_outlives_its_parent() -> None:
    process = started("--duration", "300s")
    (worker,) = workers(process)
    its_end = os.pidfd_open(worker)
    process.kill()
    ended, _, _ = select.select([its_end], [], [], 60)
    os.close(its_end)
    process.communicate(timeout=60)
    assert ended


@linux
@pytest.mark.usefixtures("interruptible")
def test_end_request_before_worker_start_leaves_no_process() -> None:
    process = subprocess.Popen(
        [sys.executable, "-m", "fcu_emulator", "run", "--duration", "300s", "--isolate", "--speed", "1"],
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    while not (children := workers(process)):
        assert process.poll() is None
    process.send_signal(signal.SIGTERM)
    _, errors = process.communicate(timeout=60)
    assert process.returncode in (INTERRUPTED, PASSED)
    assert "Traceback" not in errors
    assert not Path(f"/proc/{children[0]}").exists()


# -- Every command that runs firmware -----------------------------------------------------------------------


@pytest.mark.parametrize(
    "command",
    [
        ("run", "lab3", "--duration", "200ms", "--quiet"),
        ("diff", "lab3", "template", "--scenario", "desk", "--duration", "1s"),
        ("check", "template-arm", "--exercise", "4"),
    ],
)
def test_isolated_command_prints_same_output(command: tuple[str, ...]) -> None:
    alone, isolated = fcu(*command), fcu(*command, "--isolate")

    assert (isolated.returncode, isolated.stdout) == (alone.returncode, alone.stdout)


@linux
@pytest.mark.parametrize(
    "command", [("diff", "lab3", "solution", "--scenario", "tilt_sweep"), ("check", "solution")]
)
def test_exceeded_worker_limit_is_not_verdict(command: tuple[str, ...], words: Words) -> None:
    done = fcu(*command, "--isolate", "--limit", "cpu_s=1")

    assert done.returncode == NOT_JUDGED
    words(command[0], done.stderr)


def test_live_board_may_run_in_worker() -> None:
    done = fcu("web", "--isolate", "--scenario", "iron", "--duration", "100ms")

    assert done.returncode == PASSED, done.stderr
    assert "fcu: board lab3, firmware lab3, scenario iron, seed 4\n" in done.stderr
    assert re.search(r"^fcu: .*128 open files$", done.stderr, re.M) or not_limited()
    assert re.search(r"^fcu: \d of \d .*, \d .* [\d.]+ s .* \d+ s$", done.stderr, re.M)


def test_run_limit_is_refused_by_other_commands(words: Words) -> None:
    done = fcu("check", "lab3", "--limit", "wall_s=3")

    assert done.returncode == USAGE_ERROR
    words("check", done.stderr)
