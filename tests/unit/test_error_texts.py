"""Errors of this package have one line without control characters, for any names in them."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

import pytest

from fcu_emulator import Board
from fcu_emulator.emulator.cli.build import ProjectBuildError
from fcu_emulator.emulator.errors import (
    ExpectationError,
    FcuError,
    FirmwareError,
    FirmwareFileError,
    InputError,
    LimitError,
    LinkError,
    NotJudgedError,
    OutputError,
    RecordingError,
    RubricError,
    ScenarioError,
)
from fcu_emulator.emulator.grading.roster import load_roster
from fcu_emulator.emulator.grading.rubric import load_rubric
from fcu_emulator.emulator.scenario import load_scenario
from fcu_emulator.emulator.world.recording import load_recording

HOSTILE = "a\x1b[31m\n\r\x85\u2028\u202eb\udcff"
LONGEST = 600
"""Maximum characters of an error, including a file name of about a hundred characters."""


LOADERS: list[Callable[[Path], object]] = [load_scenario, load_rubric, load_roster, load_recording, Board]


@pytest.mark.parametrize(
    "error",
    [
        InputError(HOSTILE),
        LinkError(HOSTILE),
        NotJudgedError(HOSTILE),
        OutputError(HOSTILE),
        ScenarioError(HOSTILE, HOSTILE, HOSTILE),
        RubricError(HOSTILE, HOSTILE, HOSTILE),
        RecordingError(HOSTILE, 1, HOSTILE),
        FirmwareFileError(HOSTILE, HOSTILE),
    ],
    ids=lambda error: type(error).__name__,
)
def test_error_is_one_line_without_control_characters(error: FcuError) -> None:
    assert str(error).isprintable()


@pytest.mark.parametrize(
    "error",
    [
        FirmwareError(HOSTILE),
        LimitError("work", HOSTILE),
        ExpectationError(HOSTILE, (HOSTILE,), HOSTILE),
        ProjectBuildError(HOSTILE),
    ],
    ids=lambda error: type(error).__name__,
)
def test_error_with_lines_has_no_other_control_characters(error: FcuError) -> None:
    lines = str(error).split("\n")
    assert len(lines) > 1
    assert all(line.isprintable() for line in lines)


@pytest.mark.parametrize("error", [ScenarioError, RubricError], ids=lambda error: error.__name__)
def test_long_error_text_of_file_is_cut(error: Callable[..., FcuError]) -> None:
    assert len(str(error("file", "key", "x" * 10_000))) < LONGEST
    assert len(str(RecordingError("file", 1, "x" * 10_000))) < LONGEST
    assert len(str(FirmwareFileError("file", "x" * 10_000))) < LONGEST


@pytest.mark.parametrize(
    "load",
    LOADERS,
    ids=["scenario", "rubric", "roster", "recording", "firmware"],
)
@pytest.mark.parametrize("data", [b"", b"\xff", b"[" * 10_000, b"k" * 10_000, b"k.k=1\n[k.k]\n"])
def test_error_for_hostile_file_name_is_printable(
    load: Callable[[Path], object], data: bytes, tmp_path: Path
) -> None:
    for suffix in (".toml", ".csv", ".elf"):
        path = tmp_path / f"a\x1b[31m\n\r\x85\u2028\u202eb{suffix}"
        path.write_bytes(data)
        with pytest.raises(InputError) as refused:
            load(path)
        assert str(refused.value).isprintable()
        assert len(str(refused.value)) < LONGEST + len(str(path))


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="named pipes are POSIX")
@pytest.mark.parametrize("load", LOADERS, ids=["scenario", "rubric", "roster", "recording", "firmware"])
def test_pipe_is_refused_without_waiting(load: Callable[[Path], object], tmp_path: Path) -> None:
    for suffix in (".toml", ".csv", ".elf"):
        path = tmp_path / f"pipe{suffix}"
        os.mkfifo(path)
        with pytest.raises(InputError):
            load(path)
