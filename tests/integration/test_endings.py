"""Interrupted commands print one line, have the exit code of an interruption, and leave no files."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path

import pytest

from fcu_emulator.firmware_model.arm import prebuilt
from tests.support.scenario_files import HEAD, write

pytestmark = [
    pytest.mark.skipif(sys.platform == "win32", reason="POSIX signals"),
    pytest.mark.usefixtures("interruptible"),
]
PASSED, NOT_JUDGED, INTERRUPTED = 0, 4, 130
FULL = Path("/dev/full")
FIRMWARE = str(prebuilt("solution", "I2C2"))
LONG_DIFF = ("diff", FIRMWARE, FIRMWARE, "--scenario", "stairs", "--duration", "3000s")
linux = pytest.mark.skipif(sys.platform != "linux", reason="/proc")


@pytest.fixture
def folders(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> list[Path]:
    """Set the folders of temporary files and of files for other commands."""
    made = [tmp_path / "runtime", tmp_path / "temporary"]
    for folder in made:
        folder.mkdir(mode=0o700)
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(made[0]))
    monkeypatch.setenv("TMPDIR", str(made[1]))
    return made


def started(*arguments: str | Path) -> subprocess.Popen[str]:
    return subprocess.Popen(
        [sys.executable, "-m", "fcu_emulator", *map(str, arguments)],
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


def until(process: subprocess.Popen[str], pattern: str) -> Iterator[str]:
    """Yield the lines of standard error up to a matching line."""
    assert process.stderr is not None
    for line in process.stderr:
        yield line
        if re.search(pattern, line):
            return
    raise AssertionError(f"no line with {pattern}")


def left(folders: list[Path]) -> list[Path]:
    return [path for folder in folders for path in folder.rglob("*") if not path.is_dir()]


@pytest.mark.parametrize(
    ("name", "isolated"),
    [
        ("SIGTERM", ()),
        ("SIGHUP", ()),
        ("SIGINT", ()),
        ("SIGTERM", ("--isolate",)),
        ("SIGHUP", ("--isolate",)),
    ],
)
def test_web_command_ends_cleanly_on_signal(
    name: str, isolated: tuple[str, ...], folders: list[Path], tmp_path: Path
) -> None:
    record = tmp_path / "session.toml"
    process = started("web", "lab3", "--no-browser", "--record", record, "--serial", "pty", *isolated)
    list(until(process, "Ctrl-C"))
    assert left(folders) != []
    process.send_signal(getattr(signal, name))
    _, errors = process.communicate(timeout=60)
    lines = errors.splitlines()
    assert process.returncode == PASSED, errors
    assert len([line for line in lines if "ended by SIG" in line]) == 1
    assert all(line.startswith("fcu: ") and line.isprintable() for line in lines)
    assert left(folders) == []
    assert record.read_text(encoding="utf-8").startswith("# A live session")


@pytest.mark.parametrize("name", ["SIGTERM", "SIGHUP"])
@pytest.mark.parametrize(
    "command", [("run", "lab3", "--speed", "1", "--serial", "pty"), ("web", "--no-browser")]
)
def test_second_request_to_end_removes_files(
    name: str, command: tuple[str, ...], folders: list[Path]
) -> None:
    process = started(*command)
    list(until(process, "open it with|page:"))
    for _ in range(2):
        process.send_signal(getattr(signal, name))
    _, errors = process.communicate(timeout=60)
    assert process.returncode in (PASSED, INTERRUPTED), errors
    assert "Traceback" not in errors
    assert left(folders) == []


@pytest.mark.parametrize("name", ["SIGTERM", "SIGHUP", "SIGINT"])
def test_interrupted_scenario_run_is_not_judged(name: str, folders: list[Path], tmp_path: Path) -> None:
    expects = "[[expect]]\nkind = 'line'\ntext = 'LAB3 Init...'\n"
    path = write(tmp_path, HEAD + 'duration = "300s"\n' + expects)
    process = started("run", "--scenario", path, "--speed", "1", "--serial", "pty", "--serial", "stdout")
    assert process.stdout is not None
    process.stdout.read(1)
    process.send_signal(getattr(signal, name))
    _, errors = process.communicate(timeout=60)
    assert process.returncode == NOT_JUDGED, errors
    assert left(folders) == []


@pytest.mark.parametrize(
    ("name", "isolated", "command"),
    [
        ("SIGTERM", (), ("check", FIRMWARE)),
        ("SIGHUP", (), LONG_DIFF),
        ("SIGTERM", ("--isolate",), LONG_DIFF),
        ("SIGHUP", ("--isolate",), ("check", FIRMWARE)),
    ],
    ids=["check", "diff", "diff isolated", "check isolated"],
)
@linux
def test_interrupted_command_without_summary_prints_one_line(
    name: str, isolated: tuple[str, ...], command: tuple[str, ...], folders: list[Path]
) -> None:
    process = started(*command, *isolated)
    _wait_until_loaded(process, worker=bool(isolated) or command[0] == "check")
    process.send_signal(getattr(signal, name))
    _, errors = process.communicate(timeout=60)
    assert process.returncode == INTERRUPTED, errors
    assert errors.splitlines()[-1:] == ["fcu: ended by SIGTERM" if isolated else f"fcu: ended by {name}"]
    assert left(folders) == []


@linux
def test_command_continues_if_hangup_is_ignored(folders: list[Path]) -> None:
    del folders
    diff = f"diff '{FIRMWARE}' '{FIRMWARE}' --scenario flat --duration 1s"
    command = f"trap '' HUP; exec '{sys.executable}' -m fcu_emulator {diff}"
    process = subprocess.Popen(
        ["sh", "-c", command], stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True
    )
    _wait_until_loaded(process)
    process.send_signal(signal.SIGHUP)
    _, errors = process.communicate(timeout=60)
    assert process.returncode == PASSED, errors


LOADING = """
import os, signal, sys
from fcu_emulator.emulator.cli import main

class Signals:
    def find_spec(self, name, path=None, target=None):
        if name == {module!r}:
            sys.meta_path.remove(self)
            os.kill(os.getpid(), signal.SIGTERM)

sys.meta_path.insert(0, Signals())
sys.argv = ["fcu", "run", "lab3", "--duration", "10ms", "--speed", "max"]
main()
"""
"""A run that receives a signal while it loads a module, and thus while it loads the modules that need it."""


@pytest.mark.parametrize(
    "module",
    [
        "click",
        "fcu_emulator.emulator.text",
        "fcu_emulator.emulator.errors",
        "fcu_emulator.emulator.host.isolation",
        "numpy",
    ],
)
def test_signal_while_module_loads_ends_command(module: str, folders: list[Path]) -> None:
    command = [sys.executable, "-c", LOADING.format(module=module)]
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=60)
    assert done.returncode == INTERRUPTED, done.stderr
    assert done.stderr.splitlines() == ["fcu: ended by SIGTERM"]
    assert left(folders) == []


IN_A_CLASS = """
import dataclasses, os, signal, sys
from fcu_emulator.emulator.cli import main

def set_name(self, owner, name):
    del dataclasses.Field.__set_name__
    os.kill(os.getpid(), signal.{signal})

dataclasses.Field.__set_name__ = set_name
sys.argv = ["fcu", "run", "lab3", "--duration", "10ms", "--speed", "max"]
main()
"""
"""Python 3.11 raises RuntimeError for any exception that is raised at this place."""


@pytest.mark.parametrize("name", ["SIGINT", "SIGTERM"])
def test_signal_during_class_creation_ends_command(name: str, folders: list[Path]) -> None:
    command = [sys.executable, "-c", IN_A_CLASS.format(signal=name)]
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=60)
    assert done.returncode == INTERRUPTED, done.stderr
    assert done.stderr.splitlines() == ([] if name == "SIGINT" else [f"fcu: ended by {name}"])
    assert left(folders) == []


TWO_SIGNALS = """
import os, signal, sys
from fcu_emulator.emulator.cli import main
import {module} as module

replaced = {place}

def interrupted(*arguments, **options):
    if {first}:
        replaced(*arguments, **options)
    os.kill(os.getpid(), signal.SIGTERM)
    return replaced(*arguments, **options)

{place} = interrupted
sys.argv = ["fcu", *{command!r}]
main()
"""
"""A command that receives a signal before or after a call, and a further signal each time the cleanup repeats it."""
LINKS = "fcu_emulator.emulator.links."
RUN = ("run", "lab3", "--speed", "1", "--serial", "pty", "--duration", "10ms")
WEB = ("web", "--no-browser", "--duration", "10ms")


@pytest.mark.parametrize(
    ("command", "module", "place", "first"),
    [
        (RUN, LINKS + "control", "module.write_atomically", True),
        (RUN, LINKS + "control", "module.ControlServer.close", False),
        (RUN, LINKS + "port_name", "module.PortName.point_to", True),
        (RUN, LINKS + "port_name", "module.PortName.release", False),
        (WEB, LINKS + "control", "module.write_atomically", True),
        (WEB, LINKS + "control", "module.ControlServer.close", False),
        (WEB, "fcu_emulator.emulator.live.server", "module.PageServer.close", False),
    ],
)
def test_signal_during_shared_file_change_removes_file(
    command: tuple[str, ...], module: str, place: str, first: bool, folders: list[Path]
) -> None:
    program = TWO_SIGNALS.format(module=module, place=place, first=first, command=command)
    done = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=False, timeout=60
    )
    assert done.returncode == INTERRUPTED, done.stderr
    assert "Traceback" not in done.stderr
    assert left(folders) == []


# -- A full disk --------------------------------------------------------------------------------------------


@pytest.mark.skipif(not FULL.exists(), reason="/dev/full is a Linux device")
@pytest.mark.parametrize("isolated", [(), ("--isolate",)], ids=["", "isolated"])
def test_recording_on_full_disk_is_not_judged(isolated: tuple[str, ...], folders: list[Path]) -> None:
    process = started("web", "lab3", "--no-browser", "--duration", "200ms", "--record", FULL, *isolated)
    _, errors = process.communicate(timeout=60)
    assert process.returncode == NOT_JUDGED
    assert "/dev/full" in errors.splitlines()[-1]
    assert "Traceback" not in errors
    assert left(folders) == []


def test_recording_beyond_file_limit_is_not_written(tmp_path: Path, folders: list[Path]) -> None:
    del folders
    record = tmp_path / "session.toml"
    record.write_text("before", encoding="utf-8")
    web = f"web lab3 --no-browser --duration 200ms --record '{record}'"
    command = f"ulimit -f 0; exec '{sys.executable}' -m fcu_emulator {web}"
    done = subprocess.run(["sh", "-c", command], capture_output=True, text=True, check=False, timeout=60)
    assert done.returncode == NOT_JUDGED, done.stderr
    assert done.stderr.splitlines()[-1].startswith(f"fcu: --record cannot write {record}")
    assert record.read_text(encoding="utf-8") == "before"
    assert [path.name for path in tmp_path.iterdir() if path.suffix == ".tmp"] == []


@pytest.mark.parametrize("make", [os.mkfifo, os.mkdir], ids=["pipe", "folder"])
def test_recording_to_non_file_is_refused_immediately(make: Callable[[Path], None], tmp_path: Path) -> None:
    make(tmp_path / "session.toml")
    process = started(
        "web", "lab3", "--no-browser", "--duration", "1s", "--record", tmp_path / "session.toml"
    )
    _, errors = process.communicate(timeout=60)
    assert process.returncode == 2
    assert len(errors.splitlines()) == 1


# -- Waiting ------------------------------------------------------------------------------------------------


def _wait_until_loaded(process: subprocess.Popen[str], *, worker: bool = False) -> None:
    """Poll until the process or its worker has loaded the chip's library, so that it will run the firmware soon."""
    while True:
        assert process.poll() is None, process.communicate()
        threads = Path(f"/proc/{process.pid}/task").glob("*/children")
        children = [number for one in threads for number in one.read_text(encoding="ascii").split()]
        for number in children if worker else [str(process.pid)]:
            with suppress(OSError):
                if "/emulator/chip/native/" in Path(f"/proc/{number}/maps").read_text(encoding="utf-8"):
                    return
