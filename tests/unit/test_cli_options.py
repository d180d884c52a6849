"""Each option of the command line reaches the place where its command reads it, and no other place."""

from __future__ import annotations

import importlib
import shlex
from datetime import datetime
from pathlib import Path
from typing import Any

import click
import pytest

from fcu_emulator.emulator.cli import execute
from fcu_emulator.emulator.cli.commands import cli
from fcu_emulator.emulator.cli.exit_codes import ExitCode
from fcu_emulator.emulator.cli.options import (
    CheckOptions,
    DiffOptions,
    GradeOptions,
    MoveOptions,
    RunOptions,
    WebOptions,
)

LINES: list[tuple[str, str, Any]] = [
    (
        "fcu_emulator.emulator.cli.run.run_board",
        """run a.elf --wiring lab3 --scenario desk --duration 1s --speed 2 --serial tcp --serial
        stdout --seed 3 --ideal --trace t.jsonl --vcd v.vcd --perfetto p.json --quiet --gdb 1234
        --halt --limit lines=5 --json j.json --verbose --all-uarts
        --crystal 8 --flash f.bin""",
        RunOptions(
            firmware="a.elf",
            wiring="lab3",
            scenario="desk",
            duration="1s",
            speed="2",
            serial=("tcp", "stdout"),
            seed=3,
            ideal=True,
            trace=Path("t.jsonl"),
            quiet=True,
            gdb=1234,
            halt=True,
            limit=("lines=5",),
            json=Path("j.json"),
            verbose=True,
            all_uarts=True,
            crystal=8.0,
            flash=Path("f.bin"),
            vcd=Path("v.vcd"),
            perfetto=Path("p.json"),
        ),
    ),
    (
        "fcu_emulator.emulator.cli.run.run_board",
        "run",
        RunOptions(),
    ),
    (
        "fcu_emulator.emulator.cli.run_boards.run_on_boards",
        "run --boards 4",
        RunOptions(boards=4),
    ),
    (
        "fcu_emulator.emulator.cli.move.move",
        "move tap 2.5 --roll 1 --pitch -2 --yaw 3 --north 1 --east 2 --up -3 --for 4s --axis west --board 99",
        MoveOptions(
            gesture="tap",
            amount=2.5,
            roll=1.0,
            pitch=-2.0,
            yaw=3.0,
            north=1.0,
            east=2.0,
            up=-3.0,
            duration="4s",
            axis="west",
            board="99",
        ),
    ),
    ("fcu_emulator.emulator.cli.move.move", "move", MoveOptions()),
    (
        "fcu_emulator.emulator.cli.diff.compare_firmwares",
        """diff a.elf b.elf --scenario desk --wiring lab3 --seed 3 --ideal --duration 1s --time-tolerance
        5ms --tolerance ACC=1 --tolerance Yaw=2 --ignore leds --ignore time --replay --limit
        lines=5""",
        DiffOptions(
            first="a.elf",
            second="b.elf",
            scenario="desk",
            wiring="lab3",
            seed=3,
            ideal=True,
            duration="1s",
            time_tolerance="5ms",
            tolerance=("ACC=1", "Yaw=2"),
            ignore=("leds", "time"),
            replay=True,
            limit=("lines=5",),
        ),
    ),
    (
        "fcu_emulator.emulator.cli.diff.compare_firmwares",
        "diff a.elf b.elf --scenario desk",
        DiffOptions(first="a.elf", second="b.elf", scenario="desk"),
    ),
    (
        "fcu_emulator.emulator.cli.grade.grade",
        """grade class --rubric lab3 --out out --roster r.csv --salt s.key --jobs 3 --dask tcp://h:1 --submission-type
        source
        --bus SPI2 --build-without-sandbox --anonymous --before-due-date --gradescope --autograder
        there --overrides o.csv --deadline 2026-11-20T23:59 --only n.txt --gradescope-zip a.zip --wheel w.whl""",
        GradeOptions(
            submissions=Path("class"),
            rubric="lab3",
            out=Path("out"),
            roster=Path("r.csv"),
            salt=Path("s.key"),
            jobs=3,
            dask="tcp://h:1",
            submission_type="source",
            bus="SPI2",
            build_without_sandbox=True,
            anonymous=True,
            before_due_date=True,
            gradescope=True,
            autograder=Path("there"),
            overrides=Path("o.csv"),
            deadline=datetime.fromisoformat("2026-11-20T23:59"),
            only=Path("n.txt"),
            gradescope_zip=Path("a.zip"),
            wheel=Path("w.whl"),
        ),
    ),
    (
        "fcu_emulator.emulator.cli.grade.grade",
        "grade class --rubric lab3 --autograder there",
        GradeOptions(submissions=Path("class"), rubric="lab3", autograder=Path("there")),
    ),
    (
        "fcu_emulator.emulator.cli.web.serve_board",
        """web a.elf --scenario desk --wiring lab3 --seed 3 --ideal --port 8000 --no-browser
        --record r.toml --duration 1h --serial tcp --gdb 1234 --halt --listen 127.0.0.2
        --base-path /ada/fcu/ --behind https://hub.example""",
        WebOptions(
            firmware="a.elf",
            scenario="desk",
            wiring="lab3",
            seed=3,
            ideal=True,
            port=8000,
            no_browser=True,
            record=Path("r.toml"),
            duration="1h",
            serial=("tcp",),
            gdb=1234,
            halt=True,
            listen="127.0.0.2",
            base_path="/ada/fcu/",
            behind="https://hub.example",
        ),
    ),
    (
        "fcu_emulator.emulator.cli.web.serve_board",
        "web",
        WebOptions(),
    ),
    (
        "fcu_emulator.emulator.cli.check.check_program",
        """check a.elf --exercise 1 -e 2 --seed 3 --rubric other --jobs 2 --json j.json --save motions --hint --hint
        --boards 4 --annotations github --junit j.xml""",
        CheckOptions(
            target="a.elf",
            rubric="other",
            exercises=("1", "2"),
            seed=3,
            json=Path("j.json"),
            jobs=2,
            save=Path("motions"),
            hints=2,
            boards=4,
            annotations="github",
            junit=Path("j.xml"),
        ),
    ),
    ("fcu_emulator.emulator.cli.check.check_program", "check", CheckOptions()),
]
ELSEWHERE = {"--isolate", "--help"}
"""Tested in tests/integration/test_isolation.py: a worker runs the same command without the option."""
_OF_A_PROCESS = {"web", "check"}
"""Commands whose limits apply to a process; such limits belong to ``--isolate``."""


@pytest.mark.parametrize(
    ("function", "line", "expected"), LINES, ids=[" ".join(line.split()[:4]) for _, line, _ in LINES]
)
def test_options_reach_command_as_typed(
    function: str, line: str, expected: object, monkeypatch: pytest.MonkeyPatch
) -> None:
    module, _, name = function.rpartition(".")
    seen: list[object] = []

    def take(options: object, *_: object) -> ExitCode:
        seen.append(options)
        return ExitCode.PASSED

    monkeypatch.setattr(importlib.import_module(module), name, take)

    assert execute(shlex.split(line)) == 0
    assert seen == [expected]


@pytest.mark.parametrize("name", dict.fromkeys(line.split()[0] for _, line, _ in LINES))
def test_every_command_option_is_tested(name: str) -> None:
    typed = {word for _, line, _ in LINES for word in line.split() if line.split()[0] == name}
    options = {param.opts[0] for param in cli.commands[name].params if isinstance(param, click.Option)}

    assert options - typed == options & (ELSEWHERE | ({"--limit"} if name in _OF_A_PROCESS else set()))
