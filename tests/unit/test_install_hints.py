"""Words that depend on the system, with simulated systems, and characters that the system's encoding lacks."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest

from fcu_emulator.emulator.host.install_hints import _INSTALL, command_line, how_to_install, quoted


@pytest.mark.parametrize(
    ("system", "word", "expected"),
    [
        ("linux", "lab3.elf", "lab3.elf"),
        ("linux", "my lab/it's.elf", "'my lab/it'\"'\"'s.elf'"),
        ("darwin", "$HOME", "'$HOME'"),
        ("win32", r"C:\lab\lab3.elf", r"C:\lab\lab3.elf"),
        ("win32", r"C:\my lab\lab3.elf", r'"C:\my lab\lab3.elf"'),
        ("win32", "", '""'),
    ],
)
def test_word_is_quoted_for_shell(
    monkeypatch: pytest.MonkeyPatch, system: str, word: str, expected: str
) -> None:
    monkeypatch.setattr(sys, "platform", system)
    assert quoted(word) == expected
    assert command_line(["fcu", "run", word]) == f"fcu run {expected}"


@pytest.mark.parametrize("program", _INSTALL)
def test_apt_hint_is_shown_on_linux_only(monkeypatch: pytest.MonkeyPatch, program: str) -> None:
    for system, debian in (("linux", True), ("darwin", False), ("win32", False), ("freebsd14", True)):
        monkeypatch.setattr(sys, "platform", system)
        assert ("apt" in how_to_install(program).split()) is debian


@pytest.mark.parametrize("encoding", ["ascii", "cp1252", "cp437", "cp932"])
@pytest.mark.parametrize(
    "command", [("scenarios",), ("registers", "LSM6DSL"), ("registers", "--fidelity"), ("run", "-h")]
)
def test_output_in_old_encoding_replaces_characters(encoding: str, command: tuple[str, ...]) -> None:
    if encoding != "ascii" and command[0] == "run":
        pytest.skip("as with ascii")
    done = subprocess.run(
        [sys.executable, "-m", "fcu_emulator", *command],
        env={**os.environ, "PYTHONIOENCODING": f"{encoding}:strict", "PYTHONUTF8": "0"},
        capture_output=True,
        check=False,
        timeout=120,
    )
    assert (done.returncode, done.stderr) == (0, b"")
    assert len(done.stdout.decode(encoding).splitlines()) > 5
