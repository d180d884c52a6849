"""Colours and progress of the command line: on a terminal, and in a pipe."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path

import pytest

if sys.platform == "win32":
    pytest.skip("pseudo-terminals", allow_module_level=True)

import pty

from fcu_emulator.emulator.cli.screen import WIDTH, wrapped
from tests.support.words import FOLDER, sections

COLUMNS = 100
_LONG_WORD = re.compile(r"\S{60}|TMP/|PYTHON|fcu:   main\.c:")
"""A path, or a quoted line of the program."""
SCENARIO = """
schema = 1
question = "Is it printed?"
duration = "1s"
[[expect]]
kind = "{kind}"
pattern = "no such line"
"""
RED, GREEN, BOLD = "\x1b[31m", "\x1b[32m", "\x1b[1m"
WAITS = """
import sys, time
from fcu_emulator.emulator.cli.screen import ProgressLine, say
with ProgressLine("working") as line:
    time.sleep(1.5)
    line.text = "half done"
    time.sleep(0.5)
    say("a line")
    time.sleep(0.5)
"""


def on_terminal(command: list[str], **variables: str) -> str:
    """Return the output of a command whose stdout and stderr are a pseudo-terminal."""
    ours, theirs = pty.openpty()
    environment = {**_environment(), "TERM": "xterm", **variables}
    with subprocess.Popen(
        command, stdin=subprocess.DEVNULL, stdout=theirs, stderr=theirs, env=environment
    ) as process:
        os.close(theirs)
        chunks = []
        while chunk := _read(ours):
            chunks.append(chunk)
        process.wait()
    os.close(ours)
    return b"".join(chunks).decode()


def in_pipe(command: list[str]) -> str:
    """Return the output of a command whose stdout and stderr are a pipe."""
    done = subprocess.run(
        command,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        env=_environment(),
        check=False,
    )
    return done.stdout.decode()


def _environment() -> Mapping[str, str]:
    return {name: value for name, value in os.environ.items() if name not in {"NO_COLOR", "TERM"}}


def _read(descriptor: int) -> bytes:
    try:
        return os.read(descriptor, 4096)
    except OSError:  # Linux: the other end is closed
        return b""


def fcu(*arguments: str) -> list[str]:
    return [sys.executable, "-m", "fcu_emulator", *arguments]


@pytest.fixture
def run(tmp_path: Path) -> list[str]:
    scenario = tmp_path / "one.toml"
    scenario.write_text(SCENARIO.format(kind="regex"), encoding="utf-8")
    return fcu("run", "lab3", "--scenario", str(scenario), "--speed", "max")


def test_terminal_shows_failure_in_red_and_summary_bold(run: list[str]) -> None:
    text = on_terminal(run)

    assert f"fcu: {RED}FAIL\x1b[0m missing: " in text
    assert f"fcu: {RED}FAIL\x1b[0m 0 of 1 expectations met" in text
    assert f"fcu: {BOLD}1.000 s of virtual time" in text


def test_terminal_shows_passed_run_in_green(run: list[str], tmp_path: Path) -> None:
    (tmp_path / "one.toml").write_text(SCENARIO.format(kind="never"), encoding="utf-8")

    assert f"fcu: {GREEN}PASS\x1b[0m 1 of 1 expectations met" in on_terminal(run)


def test_error_is_red_on_terminal() -> None:
    assert f"fcu: {RED}unknown firmware 'nothing'" in on_terminal(fcu("run", "nothing"))


@pytest.mark.parametrize("variables", [{"NO_COLOR": "1"}, {"TERM": "dumb"}], ids=["NO_COLOR", "dumb"])
def test_terminal_without_colours_gets_plain_text(run: list[str], variables: Mapping[str, str]) -> None:
    text = on_terminal(run, **variables)

    assert "fcu: FAIL 0 of 1 expectations met" in text
    assert "\x1b" not in text


def test_pipe_gets_plain_text(run: list[str]) -> None:
    text = in_pipe(run)

    assert "fcu: FAIL 0 of 1 expectations met" in text
    assert "\x1b" not in text


def test_progress_line_is_erased_for_other_text() -> None:
    text = on_terminal([sys.executable, "-c", WAITS])

    assert "\rworking, 1 s\x1b[K" in text
    assert "\r\x1b[Kfcu: a line\r\n" in text
    assert "\rhalf done, 2 s\x1b[K" in text
    assert text.endswith("\r\x1b[K")


def test_progress_is_not_shown_in_pipe() -> None:
    assert in_pipe([sys.executable, "-c", WAITS]) == "fcu: a line\n"


def test_progress_is_not_shown_on_dumb_terminal() -> None:
    assert on_terminal([sys.executable, "-c", WAITS], TERM="dumb") == "fcu: a line\r\n"


def test_wrapped_text_fits_and_keeps_indent() -> None:
    lines = wrapped(f"  {'word ' * 60}/{'p' * 120} \x1b end")

    assert all(len(line) <= WIDTH for line in lines if "ppp" not in line)
    assert lines[0].startswith("  word")
    assert all(line.startswith("      ") for line in lines[1:])
    assert "\x1b" not in "".join(lines)


@pytest.mark.parametrize("file", sorted(FOLDER.glob("*.txt")), ids=lambda file: file.stem)
def test_output_fits_into_100_columns(file: Path) -> None:
    """Lines of screens are indented and not wrapped; messages are wrapped on a terminal."""
    lines = [line for text in sections(file).values() for line in text.splitlines()]
    printed = [part for line in lines for part in ([line] if line.startswith("  ") else wrapped(line))]
    unbroken = [line for line in printed if not _LONG_WORD.search(line)]

    assert [line for line in unbroken if len(line) > COLUMNS] == []
