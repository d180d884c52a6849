"""Completion of commands and options in a shell, as docs/student.md sets it up."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PAGE = ROOT / "docs" / "student.md"
SHELLS = ("bash", "zsh", "fish")


def fcu(**environment: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-m", "fcu_emulator"],
        env={**os.environ, "PYTHONPATH": str(ROOT), **environment},
        capture_output=True,
        encoding="utf-8",
        check=False,
    )


def completed(shell: str, *words: str) -> set[str]:
    """Return the completions that the shell offers for the last word."""
    line = " ".join(("fcu", *words))
    done = fcu(_FCU_COMPLETE=f"{shell}_complete", COMP_WORDS=line, COMP_CWORD=completed_word(shell, words))
    assert (done.returncode, done.stderr) == (0, "")
    return set(re.split(r"[\s,]+", done.stdout))


def completed_word(shell: str, words: tuple[str, ...]) -> str:
    return words[-1] if shell == "fish" else str(len(words))


@pytest.mark.parametrize("shell", SHELLS)
def test_commands_and_options_are_completed(shell: str) -> None:
    assert {"registers", "run"} <= completed(shell, "r")
    assert "--scenario" in completed(shell, "run", "--sc")


@pytest.mark.parametrize("shell", SHELLS)
def test_documented_line_prints_completion_script_of_shell(shell: str) -> None:
    assert f"_FCU_COMPLETE={shell}_source fcu" in PAGE.read_text(encoding="utf-8")
    if shell == "bash" and shutil.which("bash") is None:
        pytest.skip("click asks bash for its version, and there is none")
    done = fcu(_FCU_COMPLETE=f"{shell}_source")

    assert (done.returncode, done.stderr) == (0, "")
    assert f"_FCU_COMPLETE={shell}_complete" in done.stdout


@pytest.mark.skipif(shutil.which("bash") is None, reason="there is no bash")
def test_bash_completes_after_documented_line(tmp_path: Path) -> None:
    program = tmp_path / "fcu"
    program.write_text(f'#!/bin/sh\nexec "{sys.executable}" -m fcu_emulator "$@"\n', encoding="utf-8")
    program.chmod(0o755)
    line = 'eval "$(_FCU_COMPLETE=bash_source fcu)"'
    assert line in PAGE.read_text(encoding="utf-8")
    script = f'{line}; COMP_WORDS=(fcu scen); COMP_CWORD=1; _fcu_completion fcu; echo "${{COMPREPLY[@]}}"'
    done = subprocess.run(
        ["bash", "-c", script],
        env={**os.environ, "PYTHONPATH": str(ROOT), "PATH": f"{tmp_path}{os.pathsep}{os.environ['PATH']}"},
        capture_output=True,
        encoding="utf-8",
        check=True,
    )

    assert done.stdout.split() == ["scenario", "scenarios"]
