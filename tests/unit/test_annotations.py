"""``fcu check --annotations github``: commands of the runner from a verdict, with hostile text escaped."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click
import pytest

from fcu_emulator.emulator.cli.annotations import MOST, annotation_commands, commands_ignored
from fcu_emulator.emulator.grading.verdict import CheckResult, DiagnosedCause, RunEvidence, Verdict


def verdict(*checks: CheckResult, causes: tuple[DiagnosedCause, ...] = ()) -> Verdict:
    run = RunEvidence(run="stairs", question="?", exercises=("2",), duration_s=1, terminal="", causes=causes)
    return Verdict(
        rubric="r", rubric_title="R", rubric_digest="", firmware_digest="", seed=0, version="1", exercises=(),
        checks=checks, evidence=(run,),
    )  # fmt: skip


def check(**fields: Any) -> CheckResult:
    usual = {
        "check": "2.a",
        "exercise": "2",
        "title": "altitude",
        "points": 0,
        "max_points": 1,
        "outcome": "failed",
    }
    return CheckResult.model_validate({**usual, **fields})


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("GITHUB_WORKSPACE", str(tmp_path))
    lab = tmp_path / "lab"
    (lab / "support").mkdir(parents=True)
    for name in ("main.c", "support/board.c", "../outside.c"):
        (lab / name).write_text("int main;", encoding="utf-8")
    return lab


def test_failed_check_is_shown_at_source_line(folder: Path) -> None:
    failed = check(source="main(), main.c:48", expected="1 m", actual="2 m")
    assert annotation_commands(verdict(failed), folder) == [
        "::error file=lab/main.c,line=48,title=altitude::expected: 1 m%0Aseen: 2 m"
    ]


def test_passed_and_ungraded_checks_are_omitted(folder: Path) -> None:
    assert annotation_commands(verdict(check(outcome="passed"), check(max_points=0)), folder) == []


def test_diagnosis_is_shown_before_checks(folder: Path) -> None:
    cause = DiagnosedCause(
        kind="x", summary="HardFault", fatal=True, data={"file": "support/board.c", "line": "7"}
    )
    first, second = annotation_commands(verdict(check(), causes=(cause,)), folder)
    assert first == "::error file=lab/support/board.c,line=7,title=diagnosis::HardFault"
    assert second.startswith("::error title=altitude::")


@pytest.mark.parametrize(
    "source", ["../outside.c:1", "/etc/hosts.c:1", "absent.c:3", "main.c", "main.c:x", "\n::error::", ""]
)
def test_place_outside_of_project_is_omitted(source: str, folder: Path) -> None:
    (line,) = annotation_commands(verdict(check(source=source)), folder)
    assert line.startswith("::error title=altitude::")


def test_hostile_text_stays_in_one_command(folder: Path) -> None:
    hostile = "x%0A\r\n::add-mask::secret\n::set-env name=A::b\x1b[2J,line=1::"
    (line,) = annotation_commands(verdict(check(title=hostile, expected=hostile, actual=hostile)), folder)
    assert "\n" not in line
    assert "\r" not in line
    assert "\x1b" not in line
    command, options, message = line[2:].split(" ", 1)[0], *line[2:].split(" ", 1)[1].split("::", 1)
    assert command == "error"
    assert options.count("=") == 2 + options.count("name=")  # of the title, and quoted in it
    assert "," not in options
    assert "%250A" in options
    assert "%250A" in message


def test_number_of_annotations_is_limited(folder: Path) -> None:
    many = [check(check=f"2.{number}", title=f"t{number}") for number in range(50)]
    assert len(annotation_commands(verdict(*many), folder)) == MOST


def test_commands_in_output_are_ignored(capsys: pytest.CaptureFixture[str]) -> None:
    words = []
    for _ in range(2):
        with commands_ignored(True):
            click.echo("::add-mask::x")
        first, text, last = capsys.readouterr().out.splitlines()
        assert text == "::add-mask::x"
        words.append(first.removeprefix("::stop-commands::"))
        assert last == f"::{words[-1]}::"
    assert words[0] != words[1]
