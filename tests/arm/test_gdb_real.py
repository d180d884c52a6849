"""A real gdb in batch mode, connected to the board, tests the protocol from the debugger's side.

The transcript is from docs/debugging.md. Addresses, line numbers and times are not compared, because they change
with the compiler and with each change of the C sources.
"""

from __future__ import annotations

import json
import re
import shutil
import subprocess
import sys
import time
from pathlib import Path

import pytest

from fcu_emulator import Board
from fcu_emulator.emulator.chip.gdb.attach import serve
from fcu_emulator.emulator.clock import PS_PER_MS
from fcu_emulator.firmware_model.arm import prebuilt

GDB = shutil.which("gdb-multiarch") or shutil.which("arm-none-eabi-gdb")
pytestmark = pytest.mark.skipif(GDB is None, reason="no gdb for ARM here; Debian: apt install gdb-multiarch")

ROOT = Path(__file__).parents[2]
LONGEST_S = 60.0  # of wall time; a gdb that hangs must not hang the tests

SESSION = """\
break eCompass
continue
backtrace
print acc
next
next
finish
print pitch
delete
watch pitch
monitor attitude 0 85 0
continue
delete
tbreak BSP_LED_On
continue
info registers pc sp
stepi
monitor time
monitor where
detach
"""


REVERSE_SESSION = """\
break BSP_LED_On
monitor attitude 0 85 0
continue
watch pitch
reverse-continue
print acc
reverse-finish
reverse-next
monitor time
detach
"""


def gdb_command(script: Path, elf: Path, target: str) -> list[str]:
    settings = ("set confirm off", "set width 0", f"directory {ROOT / 'firmware_model' / 'arm'}")
    commands = (*settings, f"file {elf}", f"target {target}")
    options = [word for command in commands for word in ("-ex", command)]
    return [GDB or "", "-nx", "-batch", *options, "-ex", "set trace-commands on", "-x", str(script)]


def debug(board: Board, script: str, tmp_path: Path, *, kind: str = "remote", elf: str = "solution") -> str:
    """Return gdb's output for a script on a waiting board; each command has "(gdb) " before it."""
    file = tmp_path / "script.gdb"
    file.write_text(script)
    server = serve(board, 0, halted=True)
    command = gdb_command(file, prebuilt(elf, "I2C2"), f"{kind} 127.0.0.1:{server.port}")
    deadline_s = time.monotonic() + LONGEST_S
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True) as gdb:
        while gdb.poll() is None and time.monotonic() < deadline_s:
            server.run_until_ps(board.clock.now_ps + PS_PER_MS)
        gdb.kill()
        printed = gdb.communicate()[0]
    server.close()
    return re.sub(r"^\+", "(gdb) ", printed, flags=re.MULTILINE)


def comparable(transcript: str) -> str:
    for pattern, instead in (
        (r"(?m)^warning: Source file is more recent than executable\.\n", ""),  # a fresh checkout's are
        (r"(\(gdb\) reverse-\w+\n)\(gdb\) \w+ ?\n", r"\1"),  # gdb shows the command that it repeats backwards
        (r"0x[0-9a-f]+", "0xADDRESS"),
        (r"<(\w+)\+\d+>", r"<\1+N>"),
        (r"\d+\.\d{9} s", "TIME"),
        (r"(?i)(\.[csh]:|line )\d+", r"\1N"),
        (r"(?m)^\d+\t", "N\t"),
        (r"(?m)^(New value = ).*", r"\1VALUE"),  # the accelerometer's filter is still settling
        (r" +", " "),
    ):
        transcript = re.sub(pattern, instead, transcript)
    return transcript.strip()


@pytest.mark.parametrize(
    ("first", "session"), [("Reset_Handler", SESSION), (r"\(gdb\) break", REVERSE_SESSION)]
)
def test_gdb_session_matches_its_guide(first: str, session: str, tmp_path: Path) -> None:
    manual = (ROOT / "docs" / "debugging.md").read_text()
    shown = re.search(rf"```text\n({first}.*?)```", manual, re.DOTALL)
    assert shown is not None

    printed = debug(Board(firmware="solution", ideal=True), session, tmp_path)

    assert comparable(printed).endswith(comparable(shown[1])), printed


def test_settings_for_editors_are_json() -> None:
    manual = (ROOT / "docs" / "debugging.md").read_text()
    kinds = [
        json.loads(block)["configurations"][0]["type"]
        for block in re.findall(r"```json\n(.*?)```", manual, re.DOTALL)
    ]

    assert kinds == ["cortex-debug", "cppdbg"]


def test_program_replaced_by_load_command_runs(tmp_path: Path) -> None:
    board = Board(firmware="template-arm", ideal=True)
    script = """\
load
compare-sections
monitor reset halt
maintenance flush register-cache
tbreak getAltitude
continue
detach
"""
    printed = debug(board, script, tmp_path, kind="extended-remote")
    board.run_for(0.2)

    assert "Transfer rate" in printed
    assert printed.count(": matched.") >= 3
    assert "MIS-MATCHED" not in printed
    assert "breakpoint 1, getAltitude" in printed
    assert "Altitude: 0.000000 m" in board.terminal.text


def test_gdb_sets_variables_and_calls_functions(tmp_path: Path) -> None:
    board = Board(firmware="solution", ideal=True)
    script = """\
tbreak getAltitude
continue
set var press_zero_level = 1000
print getAltitude(1000.0f, 20.0f)
set $s1 = 2.5
print $s1
set *(unsigned *) 0x40020418 = 0x20
awatch *(unsigned *) 0x40020418
monitor attitude 0 85 0
continue
kill
"""
    printed = debug(board, script, tmp_path)

    assert "$1 = 0\n" in printed
    assert "$2 = 2.5\n" in printed
    assert "Hardware access (read/write) watchpoint 2: *(unsigned *) 0x40020418" in printed
    assert not board.gpio.level("B", 5)  # LED1 is lit by the write that was seen
    assert "killed" in printed


def test_run_command_with_gdb_option_serves_gdb(tmp_path: Path) -> None:
    run = [
        sys.executable,
        "-m",
        "fcu_emulator",
        "run",
        "solution",
        "--gdb",
        "0",
        "--halt",
        "--duration",
        "100ms",
    ]
    script = tmp_path / "script.gdb"
    script.write_text("tbreak HAL_Init\ncontinue\nbacktrace\ndetach\n")
    with subprocess.Popen(run, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as fcu:
        assert fcu.stderr is not None
        found = (re.search(r"remote 127\.0\.0\.1:\d+", line) for line in fcu.stderr)
        match = next(one for one in found if one is not None)
        gdb = subprocess.run(
            gdb_command(script, prebuilt("solution", "I2C2"), match[0]),
            capture_output=True,
            text=True,
            timeout=LONGEST_S,
            check=True,
        )
        printed, _ = fcu.communicate(timeout=LONGEST_S)

    assert "#0  HAL_Init" in gdb.stdout
    assert printed.startswith("STEVAL-FCU001V1")
    assert fcu.returncode == 0
