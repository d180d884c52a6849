"""The command line for a user: processes, their streams, and their exit codes."""

from __future__ import annotations

import importlib.metadata
import json
import os
import re
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from tests.support.words import Words

BANNER = "STEVAL-FCU001V1 FH rev.1.0 - Sep 2017\n\n"


def fcu(*arguments: str, code: int = 0, cwd: Path | None = None) -> subprocess.CompletedProcess[bytes]:
    """Run ``fcu`` and check its exit code."""
    done = subprocess.run(
        [sys.executable, "-m", "fcu_emulator", *arguments],
        capture_output=True,
        stdin=subprocess.DEVNULL,
        timeout=120,
        check=False,
        cwd=cwd or Path(__file__).parents[2],
    )
    assert done.returncode == code, done.stderr.decode()
    return done


def one_line_error(*arguments: str) -> str:
    """Return the only line on stderr of a command that is refused; stdout must be empty."""
    done = fcu(*arguments, code=2)
    assert done.stdout == b""
    lines = done.stderr.decode().splitlines()
    assert len(lines) == 1, lines
    return lines[0]


def test_help_lists_every_command() -> None:
    text = fcu("--help").stdout.decode()
    for command in ("run", "scenarios", "scenario", "registers", "doctor"):
        assert f"\n  {command} " in text


def test_run_separates_terminal_and_messages(words: Words) -> None:
    done = fcu("run", "--duration", "2500ms")
    assert done.stdout.decode().startswith(BANNER)
    assert b"fcu:" not in done.stdout
    errors = done.stderr.decode()
    words("run", errors.splitlines()[0])
    assert "\nfcu: 2.500 s " in errors
    assert "TIM9 800.000 Hz" in errors


def test_template_prints_no_angles() -> None:
    text = fcu("run", "template", "--duration", "3s", "-q").stdout.decode()
    assert "ACC[x,y,z] " in text
    assert "Pitch" not in text


def test_seed_determines_output_and_trace(tmp_path: Path) -> None:
    runs = []
    for name in ("a", "b", "c"):
        trace = tmp_path / f"{name}.jsonl"
        seed = "7" if name == "c" else "6"
        done = fcu("run", "--duration", "2s", "--seed", seed, "--trace", str(trace), "-q")
        runs.append((done.stdout, trace.read_bytes()))
    assert runs[0] == runs[1]
    assert runs[0][0] != runs[2][0]
    assert runs[0][1] != runs[2][1]


def test_trace_is_json_lines_with_register_names(tmp_path: Path) -> None:
    trace = tmp_path / "trace.jsonl"
    done = fcu("run", "--duration", "1200ms", "--trace", str(trace), "-q")
    events = [json.loads(line) for line in trace.read_text().splitlines()]
    kinds = {event["kind"] for event in events}
    assert {"bus", "register", "gpio", "terminal"} <= kinds
    assert all(float(event["t_s"]) >= 0 for event in events)
    writes = [(event["device"], event["register"]) for event in events if event["kind"] == "register"]
    assert ("LSM6DSL", "CTRL1_XL") in writes
    sent = b"".join(bytes.fromhex(event["data"]) for event in events if event["kind"] == "terminal")
    assert sent.startswith(done.stdout)


@pytest.mark.parametrize(
    "arguments",
    [
        ("lab4",),
        ("--wiring", "lab9"),
        ("--duration", "10"),
        ("--duration", "999999h"),
        ("--duration", "-1s"),
        ("--speed", "fast"),
        ("--speed", "-1"),
        ("--serial", "com3"),
        ("--scenario", "nowhere"),
    ],
)
def test_invalid_arguments_are_refused_in_one_line(arguments: tuple[str, ...], words: Words) -> None:
    words("run", one_line_error("run", *arguments))


def test_unwritable_trace_is_refused_before_run(tmp_path: Path) -> None:
    where = tmp_path / "no such folder" / "trace.jsonl"
    line = one_line_error("run", "--duration", "1s", "--trace", str(where))
    assert "trace file" in line
    assert not where.exists()


def test_registers_command_prints_map_with_meanings(words: Words) -> None:
    text = fcu("registers", "lsm6dsl").stdout.decode()
    assert "0x10       RW 0x00     CTRL1_XL: " in text
    assert "ODR_XL: rate: 0 off, 1 to 10: 12.5" in text
    assert "bank A" in text
    assert "INT1_CTRL" in text
    assert "(not modelled)" in text
    words("registers", one_line_error("registers", "bme280"))


def test_register_is_printed_for_every_sensor() -> None:
    text = fcu("registers", "who_am_i").stdout.decode()
    assert re.findall(r"^(L\w+)$|: always (0x\w+)", text, re.MULTILINE) == [
        ("LSM6DSL", ""),
        ("", "0x6A"),
        ("LIS2MDL", ""),
        ("", "0x40"),
        ("LPS22HB", ""),
        ("", "0xB1"),
    ]
    assert fcu("registers", "SR1").stdout.decode().count("SMBALERT: ") == len(["I2C1", "I2C2", "I2C3"])


def test_registers_command_prints_bus_access_and_deviations(words: Words) -> None:
    text = fcu("registers", "lps22hb").stdout.decode()
    lines = text.splitlines()
    assert lines[0].startswith("LPS22HB ")
    assert "0x5C or 0x5D" in lines[1]
    words("registers", "\n".join(lines[:2]))
    assert "[sensors.lps22hb]" in text
    rows = [line.split() for line in text.partition("deviations of")[2].splitlines()]
    assert ["odr_percent", "%", "+-2.5"] in [row[:3] for row in rows]
    words("registers", "\n".join(" ".join(row) for row in rows if "0.0075" in row))
    deviations = fcu("registers", "lsm6dsl").stdout.decode().partition("deviations of")[2]
    assert "zero-g offset (datasheet Table 3; 4.6: a standard deviation)" in deviations
    assert "0 to 1000" in deviations


def test_doctor_lists_working_features() -> None:
    text = fcu("doctor").stdout.decode()
    assert re.search(r"^  ok       .*\blab3 .*\d", text, re.MULTILINE)
    needed = [one for one in importlib.metadata.requires("fcu-emulator") or [] if "extra ==" not in one]
    assert needed
    for requirement in needed:
        name = re.split(r"[^\w-]", requirement, maxsplit=1)[0]
        assert re.search(rf"^  ok       {name} \d", text, re.MULTILINE), name


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no SIGINT for another process")
@pytest.mark.usefixtures("interruptible")
def test_ctrl_c_ends_run_with_its_summary() -> None:
    process = subprocess.Popen(
        [sys.executable, "-m", "fcu_emulator", "run", "--speed", "1"],
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
    )
    assert process.stdout is not None
    first = os.read(process.stdout.fileno(), 10)  # the board is running
    process.send_signal(signal.SIGINT)
    rest, errors = process.communicate(timeout=60)
    assert process.returncode == 0
    assert BANNER.encode().startswith((first + rest)[: len(BANNER)])
    assert "s of virtual time" in errors.decode()
    assert "Traceback" not in errors.decode()


@pytest.mark.skipif(sys.platform == "win32", reason="head is a POSIX tool")
def test_closed_reader_does_not_break_run() -> None:
    done = subprocess.run(
        f"'{sys.executable}' -m fcu_emulator run --duration 20s | head -c 20",
        shell=True,
        capture_output=True,
        timeout=120,
        check=True,
    )
    assert done.stdout == BANNER[:20].encode()
    assert b"Traceback" not in done.stderr
    assert b"20.000 s of virtual time" in done.stderr


def test_python_m_emulator_runs_fcu() -> None:
    assert fcu("--version").stdout.decode().startswith("fcu-emulator 0.")


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="/dev/full is a Linux device")
def test_full_disk_error_shows_trace_file() -> None:
    done = fcu("run", "--duration", "3s", "--trace", "/dev/full", "-q", code=4)
    assert "fcu: trace file /dev/full: No space left on device" in done.stderr.decode()


def test_seed_0_overrides_scenario() -> None:
    assert b"seed 0" in fcu("run", "--scenario", "flat", "--seed", "0").stderr


@pytest.mark.parametrize("firmware", ["lab3", "solution"])
def test_plain_run_loads_no_needless_modules(firmware: str) -> None:
    """Schemas of scenarios and readers of debug information would each take a tenth of the start time."""
    command = [sys.executable, "-X", "importtime", "-m", "fcu_emulator", "run", firmware, "--duration", "3ms"]
    done = subprocess.run([*command, "--speed", "max"], capture_output=True, encoding="utf-8", check=True)
    loaded = {line.rpartition("|")[2].strip() for line in done.stderr.splitlines()}
    assert "fcu_emulator.emulator.assembly.board" in loaded
    needless = {
        "pydantic",
        "importlib.metadata",
        "fcu_emulator.emulator.scenario.schema",
        "fcu_emulator.emulator.chip.calls",
        "fcu_emulator.emulator.chip.image.dwarf",
    }
    assert not loaded & needless
