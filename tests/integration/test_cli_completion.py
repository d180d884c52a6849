"""Completion of commands and options in a shell, as docs/student.md sets it up."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from tests.support.terminal import Terminal

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


@pytest.mark.parametrize("shell", SHELLS)
@pytest.mark.parametrize(
    ("words", "expected"),
    [
        (("run", "sol"), "solution"),
        (("run", "--scenario", "sta"), "stairs"),
        (("run", "--wiring", "fcu"), "fcu001v1"),
        (("registers", "lsm"), "LSM6DSL"),
        (("registers", "TIM1"), "TIM10"),
        (("check", "--rubric", "la"), "lab3"),
        (("move", "fig"), "figure_eight"),
    ],
)
def test_names_are_completed(shell: str, words: tuple[str, ...], expected: str) -> None:
    assert expected in completed(shell, *words)


def test_files_are_completed_beside_names(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("lab3.elf", "lab3.c", "lamp.toml", "lab/other.hex"):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).touch()
    monkeypatch.chdir(tmp_path)

    assert completed("bash", "run", "la") - {"plain", ""} == {"lab3", "lab3.elf"}
    assert completed("bash", "run", "lab/") - {"plain", ""} == {"lab/other.hex"}
    assert completed("bash", "run", "--scenario", "la") - {"plain", ""} == {"lamp.toml"}
    assert completed("bash", "run", "mai") == {"file", "mai", ""}
    assert completed("bash", "run", "no/such/") == {"file", "no/such/", ""}


# -- The real shells ----------------------------------------------------------------------------------------


@pytest.fixture
def programs(tmp_path: Path) -> dict[str, str]:
    """Return an environment whose PATH begins with a folder that has the program ``fcu``, and a home folder."""
    program = tmp_path / "bin" / "fcu"
    program.parent.mkdir()
    program.write_text(f'#!/bin/sh\nexec "{sys.executable}" -m fcu_emulator "$@"\n', encoding="utf-8")
    program.chmod(0o755)
    path = f"{program.parent}{os.pathsep}{os.environ['PATH']}"
    return {**os.environ, "PYTHONPATH": str(ROOT), "PATH": path, "HOME": str(tmp_path), "TERM": "dumb"}


def documented(shell: str) -> str:
    """Return the line of the page for a shell."""
    (line,) = re.findall(
        rf"^\| {shell} \| [^|]*\| `(.*)` \|$", PAGE.read_text(encoding="utf-8"), re.MULTILINE
    )
    return str(line.replace("\\|", "|"))


@pytest.mark.skipif(shutil.which("bash") is None, reason="bash is not installed")
@pytest.mark.parametrize(
    ("words", "expected"),
    [
        ("scen", ["scenario", "scenarios"]),
        ("run --scenario tilt", ["tilt_sweep"]),
        ("registers lps", ["LPS22HB"]),
    ],
)
def test_bash_completes_after_documented_line(
    words: str, expected: list[str], programs: dict[str, str]
) -> None:
    typed = f"fcu {words}"
    script = (
        f"{documented('bash')}; COMP_WORDS=({typed}); COMP_CWORD={len(words.split())}; "
        'complete -p fcu >/dev/null && _fcu_completion fcu; echo "${COMPREPLY[@]}"'
    )
    done = subprocess.run(
        ["bash", "--norc", "-c", script], env=programs, capture_output=True, encoding="utf-8", check=True
    )

    assert done.stdout.split() == expected


@pytest.mark.skipif(shutil.which("fish") is None, reason="fish is not installed")
@pytest.mark.parametrize(
    ("words", "expected"),
    [
        ("scen", ["scenario", "scenarios"]),
        ("run --scenario tilt", ["tilt_sweep"]),
        ("registers lps", ["LPS22HB"]),
    ],
)
def test_fish_completes_after_documented_line(
    words: str, expected: list[str], programs: dict[str, str]
) -> None:
    file = Path(programs["HOME"], ".config", "fish", "completions", "fcu.fish")
    file.parent.mkdir(parents=True)
    file.write_text(f"{documented('fish')}\n", encoding="utf-8")
    environment = {name: value for name, value in programs.items() if not name.startswith("XDG_")}
    done = subprocess.run(
        ["fish", "--private", "-c", f"complete --do-complete 'fcu {words}'"],
        env=environment,
        stdin=subprocess.DEVNULL,
        capture_output=True,
        encoding="utf-8",
        check=True,
    )

    assert [line.partition("\t")[0] for line in done.stdout.splitlines()] == expected


@pytest.mark.skipif(shutil.which("zsh") is None, reason="zsh is not installed")
@pytest.mark.parametrize(
    ("typed", "expected"),
    [
        ("fcu docto", "doctor"),
        ("fcu run --scenario tilt", "tilt_sweep"),
        ("fcu registers LPS", "LPS22HB"),
    ],
)
def test_zsh_completes_after_documented_line(typed: str, expected: str, programs: dict[str, str]) -> None:
    """A pseudo-terminal, in which the Tab key is pressed, because zsh completes only in its line editor."""
    with Terminal(["zsh", "-f", "-i"], {**programs, "PS1": "ready> "}) as terminal:
        terminal.read_until("ready> ")
        terminal.type(f"{documented('zsh')}\n")
        terminal.read_until("ready> ")
        terminal.type(f"{typed}\t")
        terminal.read_until(expected)
