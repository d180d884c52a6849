"""``fcu run --scenario S --boards N``: one program on boards whose sensors differ."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from fcu_emulator.emulator.cli import execute

LEVEL = """\
schema = 1
question = "Is ACC within 12 mg of the truth?"
duration = "2.5s"
seed = 7
[[expect]]
kind = "field"
name = "ACC.z"
truth = true
tolerance = 12
from = "1.2s"
[[expect]]
kind = "printed"
name = "ACC.z"
max_gap = "1.5s"
from = "1.2s"
"""
"""Some boards meet this expectation and some do not, because the accelerometer's offset is up to 40 mg."""


@pytest.fixture
def level(tmp_path: Path) -> str:
    path = tmp_path / "level.toml"
    path.write_text(LEVEL, encoding="utf-8")
    return str(path)


def rows(text: str) -> dict[int, str]:
    return {
        int(seed): rest
        for seed, rest in re.findall(r"^  (?:PASS|FAIL)  board (\d+)\s+(.*)$", text, re.MULTILINE)
    }


def test_boards_agree_with_single_runs(level: str, capfd: pytest.CaptureFixture[str]) -> None:
    code = execute(["run", "template-arm", "--scenario", level, "--boards", "6"])
    table = capfd.readouterr()
    single = {
        seed: execute(["run", "template-arm", "--scenario", level, "--seed", str(seed), "-q"])
        for seed in range(7, 13)
    }

    shown = rows(table.out)
    assert {seed: int("expect[0]" in row) for seed, row in shown.items()} == single
    assert set(single.values()) == {0, 1}  # the boards do differ
    assert f"{list(single.values()).count(0)} of 6 boards" in table.out
    assert code == 1
    assert "mg" not in table.out  # nothing of the terminal


def test_boards_have_consecutive_seeds_from_given_one(level: str, capfd: pytest.CaptureFixture[str]) -> None:
    execute(["run", "template-arm", "--scenario", level, "--boards", "2", "--seed", "40"])

    assert list(rows(capfd.readouterr().out)) == [40, 41]


def test_boards_with_correct_program_exit_with_0(level: str, capfd: pytest.CaptureFixture[str]) -> None:
    wide = Path(level)
    wide.write_text(LEVEL.replace("tolerance = 12", "tolerance = 200"), encoding="utf-8")

    assert execute(["run", "lab3", "--scenario", level, "--boards", "2"]) == 0
    assert "2 of 2 boards" in capfd.readouterr().out


def test_boards_with_stopped_program_exit_with_3(level: str, capfd: pytest.CaptureFixture[str]) -> None:
    limit = ["--limit", "instructions=100000"]

    assert execute(["run", "template-arm", "--scenario", level, "--boards", "2", *limit]) == 3
    assert all("instructions" in row for row in rows(capfd.readouterr().out).values())


def test_boards_that_end_early_cause_exit_code_4(level: str) -> None:
    assert execute(["run", "template-arm", "--scenario", level, "--boards", "2", "--duration", "1s"]) == 4


@pytest.mark.parametrize(
    "option",
    [
        ["--ideal"],
        ["--json", "j.json"],
        ["--trace", "t.jsonl"],
        ["--vcd", "v.vcd"],
        ["--perfetto", "p.json"],
        ["--gdb", "0"],
        ["--halt"],
        ["--verbose"],
        ["--speed", "2"],
        ["--serial", "tcp"],
    ],
    ids=lambda option: option[0],
)
def test_boards_with_option_for_one_board_are_refused(
    level: str, option: list[str], capfd: pytest.CaptureFixture[str]
) -> None:
    code = execute(["run", "template-arm", "--scenario", level, "--boards", "2", *option])
    seen = capfd.readouterr()

    assert (code, seen.out, seen.err.count("\n")) == (2, "", 1)
    assert option[0] in seen.err


def test_boards_without_scenario_are_refused(capfd: pytest.CaptureFixture[str]) -> None:
    code = execute(["run", "template-arm", "--boards", "2"])

    assert (code, capfd.readouterr().err.count("\n")) == (2, 1)


def test_boards_of_scenario_without_expectations_are_refused(
    level: str, capfd: pytest.CaptureFixture[str]
) -> None:
    Path(level).write_text(LEVEL.partition("[[expect]]")[0], encoding="utf-8")
    code = execute(["run", "template-arm", "--scenario", level, "--boards", "2"])

    assert (code, capfd.readouterr().err.count("\n")) == (2, 1)
