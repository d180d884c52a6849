"""Which engine executes the firmware, as the command line tells it."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest

from emulator import Board, InputError
from emulator.arm.cpu import engines
from emulator.cli.doctor import Finding, _engine


def fcu(*arguments: str, engine: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-m", "emulator", *arguments],
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
        env=os.environ | {engines.VARIABLE: engine},
    )


def not_built(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(engines, "why_not_native", lambda: "was not built")


@pytest.mark.parametrize("command", [("run", "solution", "--duration", "1ms"), ("scenarios",), ("doctor",)])
def test_a_wrong_engine_is_told_in_one_line_by_every_command(command: tuple[str, ...]) -> None:
    done = fcu(*command, engine="qemu")

    assert done.returncode == 2
    assert done.stdout == ""
    assert done.stderr == "fcu: FCU_ENGINE=qemu: no such engine; known: native, unicorn\n"


def test_both_engines_print_the_same() -> None:
    if engines.why_not_native():
        pytest.skip("the native engine was not built here")
    native, unicorn = (fcu("run", "solution", "--duration", "2s", engine=name) for name in engines.CHOICES)

    assert native.returncode == unicorn.returncode == 0
    assert "ACC[x,y,z]" in native.stdout
    assert native.stdout == unicorn.stdout


def test_an_engine_that_was_not_built_is_refused_only_if_it_is_asked_for(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    not_built(monkeypatch)
    monkeypatch.delenv(engines.VARIABLE, raising=False)
    assert engines.default() == engines.UNICORN

    monkeypatch.setenv(engines.VARIABLE, engines.NATIVE)
    with pytest.raises(InputError, match="FCU_ENGINE=native: the native engine was not built; install"):
        Board(firmware="solution")


def test_an_engine_of_another_name_is_an_error() -> None:
    with pytest.raises(ValueError, match="Native: no such engine"):
        engines.make("Native")


def test_doctor_says_which_engine_executes_and_why(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(engines, "why_not_native", str)
    monkeypatch.delenv(engines.VARIABLE, raising=False)
    assert _engine() == Finding(True, "the native engine executes firmware built for the chip")

    monkeypatch.setenv(engines.VARIABLE, engines.UNICORN)
    assert "FCU_ENGINE says so" in _engine().text

    not_built(monkeypatch)
    monkeypatch.delenv(engines.VARIABLE)
    finding = _engine()
    assert not finding.ok
    assert not finding.needed
    assert "was not built: install gcc or clang" in finding.text
