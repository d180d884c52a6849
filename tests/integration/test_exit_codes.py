"""Exit codes of ``fcu``: one number for the verdict, and no undetected loss of output."""

from __future__ import annotations

import json
import os
import re
import shutil
import signal
import subprocess
import sys
from contextlib import ExitStack
from pathlib import Path

import pytest

from fcu_emulator.firmware_model.arm import prebuilt
from tests.grading.test_build import needs_compiler
from tests.grading.test_grade import RUBRIC
from tests.support.scenario_files import HEAD, write
from tests.support.words import Words

PASSED, FAILED, USAGE_ERROR, FIRMWARE_FAILED, NOT_JUDGED = range(5)
READER_GONE = 141
FULL = Path("/dev/full")
needs_full = pytest.mark.skipif(not FULL.exists(), reason="/dev/full is a Linux device")
posix = pytest.mark.skipif(sys.platform == "win32", reason="how a POSIX shell starts a program")

GOOD = "[[expect]]\nkind = 'line'\ntext = 'LAB3 Init...'\n"
BAD = "[[expect]]\nkind = 'line'\ntext = 'LAB4 Init...'\n"
ENDLESS_SEARCH = "[[expect]]\nkind = 'regex'\npattern = '^(.|..)+(?<!.)$'\n"
SECOND = HEAD + 'duration = "1200ms"\n'

PRINTING = (
    ("--help",),
    ("--version",),
    ("run", "--help"),
    ("scenarios",),
    ("scenario", "check", "scenarios/flat.toml"),
    ("scenario", "schema"),
    ("registers", "LSM6DSL"),
    ("registers", "--fidelity"),
    ("doctor",),
    ("diff", "lab3", "lab3", "--scenario", "flat", "--duration", "100ms"),
    ("diff", "lab3", "template", "--scenario", "flat", "--duration", "3s"),
)
printing = pytest.mark.parametrize("arguments", PRINTING, ids=" ".join)


def fcu(
    *arguments: str | Path,
    stdout: int | Path = subprocess.PIPE,
    stderr: int | Path = subprocess.PIPE,
    before: str = "",
    after: str = "",
) -> subprocess.CompletedProcess[str]:
    """Run one command. ``before`` and ``after`` are shell text around the command."""
    command = [sys.executable, "-m", "fcu_emulator", *map(str, arguments)]
    if before or after:
        command = ["sh", "-c", f'{before} "$@" {after}', "sh", *command]
    with ExitStack() as stack:
        streams = [
            stream if isinstance(stream, int) else stack.enter_context(stream.open("wb", buffering=0))
            for stream in (stdout, stderr)
        ]
        return subprocess.run(
            command,
            stdin=subprocess.DEVNULL,
            stdout=streams[0],
            stderr=streams[1],
            text=True,
            timeout=60,
            check=False,
            cwd=Path(__file__).parents[2],
        )


def run_scenario(folder: Path, text: str, *more: str, **shell: str) -> subprocess.CompletedProcess[str]:
    return fcu("run", "--scenario", write(folder, text), "--speed", "max", *more, **shell)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("text", "more", "code"),
    [
        (SECOND + GOOD, (), PASSED),
        (SECOND + BAD, (), FAILED),
        (SECOND + GOOD + BAD, (), FAILED),
        (SECOND + "[[expect]]\nkind = 'lines'\n", (), USAGE_ERROR),
        (SECOND + GOOD, ("--duration", "1s"), NOT_JUDGED),
        (SECOND, ("--duration", "1s"), PASSED),  # nothing was to be judged
        (SECOND + GOOD + ENDLESS_SEARCH, (), NOT_JUDGED),
        (SECOND + BAD + ENDLESS_SEARCH, (), NOT_JUDGED),
        (SECOND + GOOD + '[limits]\nwall = "1us"\n', (), NOT_JUDGED),
        (SECOND + GOOD + "[limits]\nterminal_bytes = 100\n", (), FIRMWARE_FAILED),
        (SECOND + GOOD, ("--limit", "terminal_bytes=100"), FIRMWARE_FAILED),
        (SECOND + GOOD, ("--limit", "wall_s=0.000001"), NOT_JUDGED),
        (SECOND + GOOD, ("--limit", "trace_bytes=1000", "--trace", os.devnull), NOT_JUDGED),
        (SECOND + GOOD, ("--limit", "walls=1"), USAGE_ERROR),
    ],
)
def test_run_exit_code_is_verdict(tmp_path: Path, text: str, more: tuple[str, ...], code: int) -> None:
    done = run_scenario(tmp_path, text, *more)
    assert done.returncode == code, done.stderr
    assert "Traceback" not in done.stderr


@pytest.mark.parametrize(
    ("limit", "code"),
    [
        ("instructions=1000", FIRMWARE_FAILED),
        ("terminal_bytes=10", FIRMWARE_FAILED),
        ("wall_s=1e-6", NOT_JUDGED),
    ],
)
@pytest.mark.parametrize("command", ["run", "diff"])
def test_limits_apply_to_every_command(command: str, limit: str, code: int) -> None:
    both = ("run", "solution", "--duration", "2s") if command == "run" else DIFF
    done = fcu(*both, "--limit", limit)
    assert done.returncode == code, done.stderr
    assert f"--limit {limit.partition('=')[0]}=" in done.stdout + done.stderr  # how to allow more


DIFF = ("diff", "solution", "solution", "--scenario", "flat", "--duration", "2s")


@needs_full
@printing
def test_output_to_full_disk_is_not_judged(arguments: tuple[str, ...]) -> None:
    done = fcu(*arguments, stdout=FULL)
    assert done.returncode == NOT_JUDGED
    (line,) = done.stderr.splitlines()
    assert "standard output: No space left on device" in line


@needs_full
@printing
def test_all_streams_to_full_disk_are_not_judged(arguments: tuple[str, ...]) -> None:
    assert fcu(*arguments, stdout=FULL, stderr=FULL).returncode == NOT_JUDGED


@posix
@printing
def test_output_to_closed_stream_is_not_judged(arguments: tuple[str, ...]) -> None:
    done = fcu(*arguments, after=">&-")
    assert done.returncode == NOT_JUDGED
    (line,) = done.stderr.splitlines()
    assert line.endswith(f" > {os.devnull}")


@needs_full
@posix
def test_lost_output_is_reported(words: Words) -> None:
    words("doctor", fcu("doctor", stdout=FULL).stderr)
    words("doctor", fcu("doctor", after=">&-").stderr)


@posix
@printing
def test_run_with_closed_streams_is_not_judged(arguments: tuple[str, ...]) -> None:
    assert fcu(*arguments, after="<&- >&- 2>&-").returncode == NOT_JUDGED


@posix
@printing
def test_closed_reader_causes_separate_exit_code(arguments: tuple[str, ...]) -> None:
    read, written = os.pipe()
    os.close(read)
    try:
        done = fcu(*arguments, stdout=written)
    finally:
        os.close(written)
    assert (done.returncode, done.stderr) == (READER_GONE, "")


@posix
@pytest.mark.parametrize(
    "arguments",
    [
        ("registers", "LSM6DSL"),
        ("scenario", "schema"),
        ("run", "lab3", "--quiet"),  # without an end: it ends with its reader
        ("run", "lab3", "--scenario", "desk", "--speed", "max", "--quiet"),
    ],
    ids=" ".join,
)
def test_closing_reader_ends_every_command(arguments: tuple[str, ...]) -> None:
    """With ``| head -1`` there is no message about the closed pipe. Only a verdict is printed, on standard error."""
    with subprocess.Popen(
        [sys.executable, "-m", "fcu_emulator", *arguments], stdout=subprocess.PIPE, stderr=subprocess.PIPE
    ) as process:
        assert process.stdout is not None
        assert process.stderr is not None
        assert process.stdout.readline()
        process.stdout.close()
        said = process.stderr.read().decode()
        code = process.wait(timeout=120)

    assert code in (READER_GONE, PASSED)  # what fits into the pipe's buffer has been printed
    assert said in ("", "fcu: PASS 8 of 8 expectations met\n")
    if arguments[0] == "run":
        assert code == READER_GONE


def test_unknown_sensor_error_is_one_line() -> None:
    for name in ("", " ", "LSM", "\x1b"):
        done = fcu("registers", name)
        assert (done.returncode, done.stdout) == (USAGE_ERROR, "")
        (line,) = done.stderr.splitlines()
        assert line.startswith("fcu: ")


def test_names_of_files_are_printed_safely(words: Words) -> None:
    done = fcu("run", "a\x1b[31m\x07.elf")
    assert done.returncode == USAGE_ERROR
    assert done.stderr.startswith("fcu: a\\x1b[31m\\x07.elf: ")
    words("run", done.stderr)


@pytest.mark.parametrize("command", ["build", "check", "run"])
def test_too_long_file_name_is_usage_error(command: str) -> None:
    done = fcu(command, "x" * 4000)

    assert (done.returncode, len(done.stderr.splitlines())) == (USAGE_ERROR, 1)
    assert len(done.stderr) < 200 or sys.platform == "win32"


def test_same_file_for_two_outputs_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "run"
    done = fcu("run", "--duration", "1s", "--json", file, "--trace", file)
    assert (done.returncode, done.stdout) == (USAGE_ERROR, "")
    assert done.stderr == f"fcu: --json and --trace must not both name {file}; give two different files\n"


@needs_full
@posix
@pytest.mark.parametrize("after", [">/dev/full", ">&-", "<&- >&- 2>&-"])
def test_new_command_with_lost_output_exits_with_4(tmp_path: Path, after: str) -> None:
    done = fcu("new", tmp_path / "mylab", after=after)
    assert done.returncode == NOT_JUDGED
    assert "Traceback" not in done.stderr


@needs_full
@pytest.mark.parametrize("expected", [GOOD, BAD])
def test_lost_terminal_text_leaves_no_verdict(tmp_path: Path, expected: str, words: Words) -> None:
    path = write(tmp_path, SECOND + expected)
    done = fcu("run", "--scenario", path, "--speed", "max", stdout=FULL)
    assert done.returncode == NOT_JUDGED
    (lost,) = [line for line in done.stderr.splitlines() if "No space left on device" in line]
    words("run", re.sub(r"\d+", "COUNT", lost))


@needs_full
def test_lost_standard_error_keeps_verdict(tmp_path: Path) -> None:
    for expected, code in ((GOOD, PASSED), (BAD, FAILED)):
        path = write(tmp_path, SECOND + expected)
        assert fcu("run", "--scenario", path, "--speed", "max", stderr=FULL).returncode == code


@needs_full
def test_full_disk_for_output_file_is_reported(tmp_path: Path) -> None:
    for option in ("--trace", "--json"):
        done = run_scenario(tmp_path, SECOND + GOOD, option, str(FULL))
        assert done.returncode == NOT_JUDGED
        assert "/dev/full: No space left on device" in done.stderr.splitlines()[-1]


@posix
def test_closed_standard_output_is_refused(words: Words) -> None:
    done = fcu("run", "--duration", "100ms", after=">&-")
    assert done.returncode == USAGE_ERROR
    words("run", done.stderr)


@posix
@pytest.mark.parametrize("name", ["/", ".", "..", "/tmp", "/dev/null", "/dev/null/x", "x" * 5000, "a/b/c"])
def test_invalid_port_name_is_refused(tmp_path: Path, name: str) -> None:
    done = fcu("run", "--duration", "100ms", "--serial", f"pty:{name}", before=f"cd '{tmp_path}';")
    assert done.returncode == USAGE_ERROR
    (line,) = done.stderr.splitlines()
    assert line.startswith("fcu: --serial pty")


@posix
@pytest.mark.parametrize("megabytes", [100, 250, 400, 600])
def test_run_without_enough_memory_is_not_judged(tmp_path: Path, megabytes: int) -> None:
    """The missing resource may be a library, a thread, or an array."""
    path = write(tmp_path, SECOND + GOOD)
    done = fcu("run", "--scenario", path, "--speed", "max", before=f"ulimit -v {megabytes << 10};")
    assert done.returncode in (PASSED, NOT_JUDGED) or done.returncode >= 126, done.stderr


@posix
@pytest.mark.parametrize("name", ["SIGHUP", "SIGINT", "SIGTERM"])
def test_run_with_ignored_signal_continues(name: str) -> None:
    """``nohup`` and a script's ``&`` start a program that ignores the signal."""
    command = f"trap '' {name[3:]}; exec '{sys.executable}' -m fcu_emulator run --duration 1100ms --speed 1"
    process = subprocess.Popen(
        ["sh", "-c", command],
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    assert process.stdout is not None
    process.stdout.read(1)
    process.send_signal(getattr(signal, name))
    _, errors = process.communicate(timeout=60)
    assert process.returncode == PASSED
    assert "1.100 s of virtual time" in errors


@posix
@pytest.mark.usefixtures("interruptible")
def test_interrupted_run_is_not_judged(tmp_path: Path, words: Words) -> None:
    path = write(tmp_path, HEAD + 'duration = "300s"\n' + GOOD)
    process = subprocess.Popen(
        [sys.executable, "-m", "fcu_emulator", "run", "--scenario", str(path), "--speed", "1"],
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    assert process.stdout is not None
    process.stdout.read(1)
    process.send_signal(signal.SIGINT)
    _, errors = process.communicate(timeout=60)
    assert process.returncode == NOT_JUDGED
    (unchecked,) = [line for line in errors.splitlines() if line.endswith(" 300 s")]
    words("run", re.sub(r"\d+\.\d+ s", "TIME", unchecked))


def test_interrupt_lost_in_destructor_is_raised_again() -> None:
    """An exception cannot leave a destructor: Python prints it and continues."""
    program = """
import signal
from fcu_emulator.emulator import cli
from tests.support.words import Words

class Destroyed:
    def __del__(self):
        signal.raise_signal(signal.SIGINT)

def execute(arguments):
    Destroyed()
    while True:
        pass

signal.signal(signal.SIGINT, signal.default_int_handler)
cli._execute = execute
cli.main()
"""
    done = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=False, timeout=60
    )
    assert (done.returncode, done.stderr) == (130, "")


def test_summary_is_written_as_json(tmp_path: Path) -> None:
    file = tmp_path / "run.json"
    done = run_scenario(tmp_path, SECOND + GOOD + BAD, "--json", str(file), "--seed", "3")
    said = json.loads(file.read_text(encoding="utf-8"))

    assert (said["schema"], said["exit_code"], said["verdict"], said["error"]) == (1, FAILED, "failed", None)
    assert said["board"]["seed"] == 3
    assert said["virtual_s"] == 1.2
    assert said["timer"]["ticks"] > 0
    assert (said["expectations"]["checks"], said["expectations"]["held"]) == (2, 1)
    (finding,) = said["expectations"]["findings"]
    assert (finding["key"], finding["fault"]) == ("expect[1]", "wrong value")
    assert finding["diff"] == ["-LAB4 Init...", "+LAB3 Init..."]
    assert said["lines"] == [
        line.removeprefix("fcu: ") for line in done.stderr.splitlines() if line[5:] in said["lines"]
    ]
    assert len(said["lines"]) >= 4


def test_json_summary_has_firmware_failure(tmp_path: Path) -> None:
    file = tmp_path / "run.json"
    done = fcu(
        "run", prebuilt("solution"), "--limit", "terminal_bytes=10", "--json", file, "--duration", "2s", "-q"
    )
    said = json.loads(file.read_text(encoding="utf-8"))
    assert said["exit_code"] == done.returncode == FIRMWARE_FAILED
    assert said["verdict"] == "firmware failed"
    assert said["error"] in done.stderr
    assert any("s of virtual time" in line for line in said["lines"])


def test_unwritable_summary_is_refused_before_run(tmp_path: Path) -> None:
    done = fcu("run", "--duration", "1s", "--json", tmp_path / "no" / "run.json")
    assert done.returncode == USAGE_ERROR
    assert done.stdout == ""


@posix
@pytest.mark.parametrize(
    "arguments",
    [
        ("run", "{elf}", "--duration", "10ms", "--speed", "max", "--serial", "file:{folder}/text\x07"),
        ("run", "--scenario", "{scenario}", "--duration", "10ms", "--serial", "pty:{folder}/tty\x07", "-q"),
        ("web", "{elf}", "--duration", "10ms", "--no-browser", "--record", "{folder}/session\x07.toml"),
        ("diff", "{elf}", "{elf}", "--scenario", "{scenario}", "--duration", "10ms"),
        ("scenario", "check", "{scenario}"),
        ("check", "{elf}", "--exercise", "4"),
        ("new", "{folder}/project\x07"),
    ],
    ids=lambda arguments: " ".join(arguments[:2]),
)
def test_names_of_used_files_are_printed_safely(tmp_path: Path, arguments: tuple[str, ...]) -> None:
    folder = tmp_path / "of\x1b[31m\x07"
    folder.mkdir()
    names = {"folder": folder, "elf": folder / "lab3\x07.elf", "scenario": folder / "f\x07.toml"}
    shutil.copy(prebuilt("solution", "I2C2"), names["elf"])
    write(folder, SECOND).replace(names["scenario"])
    done = fcu(*(one.format(**names) for one in arguments))
    assert done.returncode in (PASSED, FAILED, NOT_JUDGED), done.stderr
    assert (done.stdout + done.stderr).replace("\n", "").replace("\r", "").isprintable()


@posix
@needs_compiler
def test_names_of_projects_are_printed_safely(tmp_path: Path) -> None:
    project, classes, out = (tmp_path / name for name in ("of\x1b[31m\x07", "class\x07", "out\x07"))
    said = [fcu("new", project), fcu("build", project)]
    (classes / "a\x07").mkdir(parents=True)
    shutil.copy(prebuilt("solution", "I2C2"), classes / "a\x07" / "b\x07.elf")
    rubric = tmp_path / "r\x07.toml"
    rubric.write_text(RUBRIC, encoding="utf-8")
    said.append(fcu("grade", classes, "--rubric", rubric, "--out", out, "--jobs", "1"))
    for done in said:
        assert done.returncode == PASSED, done.stderr
        assert (done.stdout + done.stderr).replace("\n", "").replace("\r", "").isprintable()
