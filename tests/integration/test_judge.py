"""A program judged: points, outcomes, evidence; and that a verdict survives its way through JSON."""

from __future__ import annotations

from pathlib import Path

import pytest

from fcu_emulator import Board, run
from fcu_emulator.emulator.errors import InputError
from fcu_emulator.emulator.grading.judge import JudgeProgress, judge, reworded
from fcu_emulator.emulator.grading.rubric import Rubric, load_rubric
from fcu_emulator.emulator.grading.verdict import Verdict

RUBRIC = """\
schema = 1
title = "A rubric"

[run.tilted]
duration = "3s"

[run.tilted.world]
pitch_deg = 40

[[exercise]]
id = "1"
title = "Tilted"
run = "tilted"

[[exercise.check]]
id = "angles"
title = "Pitch and roll are right"
points = 3
partial = true
hint = "Which axis?"
expect = [
  { kind = "field", name = "Pitch", truth = true, tolerance = 8 },
  { kind = "field", name = "Roll", value = 90, tolerance = 3 },
  { kind = "field", name = "Altitude", truth = true, tolerance = 3 },
]

[[exercise.check]]
id = "secret"
title = "Yaw is right"
visible = "after_due_date"
detail = "name"
expect = [{ kind = "field", name = "Yaw", value = 170, tolerance = 3 }]
"""


@pytest.fixture
def rubric(tmp_path: Path) -> Rubric:
    path = tmp_path / "mine.toml"
    path.write_text(RUBRIC, encoding="utf-8")
    return load_rubric(path)


def test_a_run_that_is_shown_can_be_run_again_by_hand(rubric: Rubric, tmp_path: Path) -> None:
    verdict = judge("lab3", rubric, seed=3)
    (evidence,), (shown,) = verdict.evidence, verdict.for_student(after_due_date=True).evidence
    (tmp_path / "again.toml").write_text(evidence.replay, encoding="utf-8")
    board = Board("lab3", scenario=tmp_path / "again.toml")
    result = run(board)

    assert (board.seed, board.terminal.text) == (3, evidence.terminal)
    assert [one.key for one in result.findings] == ["expect[1]", "expect[3]"]
    assert shown.replay == ""  # a check of the exercise shows its name alone


def test_points_are_given_for_the_share_of_expectations_that_are_met(rubric: Rubric) -> None:
    verdict = judge("lab3", rubric, seed=1)
    angles, secret = verdict.checks

    assert (angles.outcome, angles.points, angles.max_points) == ("partial", 2.0, 3.0)
    assert angles.expected == "Roll within 3 of 90"
    assert (secret.outcome, secret.points) == ("failed", 0.0)
    assert (verdict.points, verdict.max_points, verdict.unjudged_points) == (2.0, 4.0, 0.0)
    assert not verdict.is_done("1")


def test_a_verdict_survives_json_and_is_the_same_again(rubric: Rubric) -> None:
    verdict = judge("lab3", rubric, seed=1)

    assert Verdict.from_json(verdict.to_json()) == verdict
    assert judge("lab3", rubric, seed=1).to_json() == verdict.to_json()
    assert judge("lab3", rubric, seed=2).to_json() != verdict.to_json()


def test_evidence_has_the_terminal_and_printed_against_truth(rubric: Rubric) -> None:
    (run,) = judge("lab3", rubric, seed=1).evidence_of("1")
    pitch = next(series for series in run.series if series.name == "Pitch")

    assert "Pitch: " in run.terminal
    assert pitch.unit == "deg"
    assert pitch.truth == pytest.approx([40.0] * len(pitch.truth))
    assert pitch.printed == pytest.approx([40.0] * len(pitch.truth), abs=3)


def test_a_student_is_shown_what_the_rubric_allows(rubric: Rubric) -> None:
    verdict = judge("lab3", rubric, seed=1)
    before, after = verdict.for_student(), verdict.for_student(after_due_date=True)

    assert [check.check for check in before.checks] == ["1.angles"]
    assert before.hidden_checks == 1
    assert [check.check for check in after.checks] == ["1.angles", "1.secret"]
    assert (after.checks[1].expected, after.checks[1].actual) == ("", "")
    assert all(run.series == () for run in after.evidence)


def test_words_of_a_rubric_are_changed_without_a_run(rubric: Rubric, tmp_path: Path) -> None:
    verdict = judge("lab3", rubric, seed=1)
    rubric.path.write_text(RUBRIC.replace("Which axis?", "Which sign?"), encoding="utf-8")
    changed = load_rubric(rubric.path)

    assert reworded(verdict, changed) == judge("lab3", changed, seed=1)


def test_progress_comes_to_the_end_of_all_runs(rubric: Rubric) -> None:
    seen: list[JudgeProgress] = []
    judge("lab3", rubric, seed=1, progress=seen.append)

    assert [one.done_s for one in seen] == sorted(one.done_s for one in seen)
    assert {one.total_s for one in seen} == {3.0}


def test_an_unknown_exercise_is_named(rubric: Rubric) -> None:
    with pytest.raises(InputError, match="unknown exercise '7'; the rubric mine has 1"):
        judge("lab3", rubric, seed=1, exercises=["7"])
