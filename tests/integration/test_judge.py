"""Judgement of a program: points, outcomes, evidence. A verdict does not change in its conversion to JSON and back."""

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


def test_replay_file_of_evidence_repeats_run(rubric: Rubric, tmp_path: Path) -> None:
    verdict = judge("lab3", rubric, seed=3)
    (evidence,), (shown,) = verdict.evidence, verdict.for_student(after_due_date=True).evidence
    (tmp_path / "again.toml").write_text(evidence.replay, encoding="utf-8")
    board = Board("lab3", scenario=tmp_path / "again.toml")
    result = run(board)

    assert (board.seed, board.terminal.text) == (3, evidence.terminal)
    assert [one.key for one in result.findings] == ["expect[1]", "expect[3]"]
    assert shown.replay == ""  # a check of the exercise shows its name alone


def test_points_are_share_of_met_expectations(rubric: Rubric) -> None:
    verdict = judge("lab3", rubric, seed=1)
    angles, secret = verdict.checks

    assert (angles.outcome, angles.points, angles.max_points) == ("partial", 2.0, 3.0)
    assert angles.expected == "Roll is within 3 deg of 90"
    assert (secret.outcome, secret.points) == ("failed", 0.0)
    assert (verdict.points, verdict.max_points, verdict.unjudged_points) == (2.0, 4.0, 0.0)
    assert not verdict.is_done("1")


def test_verdict_round_trips_through_json(rubric: Rubric) -> None:
    verdict = judge("lab3", rubric, seed=1)

    assert Verdict.from_json(verdict.to_json()) == verdict
    assert judge("lab3", rubric, seed=1).to_json() == verdict.to_json()
    assert judge("lab3", rubric, seed=2).to_json() != verdict.to_json()


def test_evidence_has_terminal_and_printed_values_with_truth(rubric: Rubric) -> None:
    (run,) = judge("lab3", rubric, seed=1).evidence_of("1")
    pitch = next(series for series in run.series if series.name == "Pitch")

    assert "Pitch: " in run.terminal
    assert pitch.unit == "deg"
    assert pitch.truth == pytest.approx([40.0] * len(pitch.truth))
    assert pitch.printed == pytest.approx([40.0] * len(pitch.truth), abs=3)


def test_student_sees_only_what_rubric_allows(rubric: Rubric) -> None:
    verdict = judge("lab3", rubric, seed=1)
    before, after = verdict.for_student(), verdict.for_student(after_due_date=True)

    assert [check.check for check in before.checks] == ["1.angles"]
    assert before.hidden_checks == 1
    assert [check.check for check in after.checks] == ["1.angles", "1.secret"]
    assert (after.checks[1].expected, after.checks[1].actual) == ("", "")
    assert all(run.series == () for run in after.evidence)


def test_changed_rubric_text_needs_no_new_run(rubric: Rubric, tmp_path: Path) -> None:
    verdict = judge("lab3", rubric, seed=1)
    rubric.path.write_text(RUBRIC.replace("Which axis?", "Which sign?"), encoding="utf-8")
    changed = load_rubric(rubric.path)

    assert reworded(verdict, changed) == judge("lab3", changed, seed=1)


def test_progress_reaches_end_of_all_runs(rubric: Rubric) -> None:
    seen: list[JudgeProgress] = []
    judge("lab3", rubric, seed=1, progress=seen.append)

    assert [one.done_s for one in seen] == sorted(one.done_s for one in seen)
    assert {one.total_s for one in seen} == {3.0}


def test_unknown_exercise_is_reported(rubric: Rubric) -> None:
    with pytest.raises(InputError, match="unknown exercise '7'; the rubric mine has 1"):
        judge("lab3", rubric, seed=1, exercises=["7"])


NEEDY = """\
schema = 1
title = "Prerequisites"

[run.still]
duration = "3s"

[[exercise]]
id = "1"
title = "Print the pitch"
run = "still"

[[exercise.check]]
id = "pitch"
title = "the pitch is printed"
visible = "always"
expect = [{ kind = "printed", name = "Pitch", max_gap = "2s" }]

[[exercise]]
id = "2"
title = "Run on"
run = "still"

[[exercise.check]]
id = "runs"
title = "the program keeps running"
requires = ["1"]
expect = [{ kind = "no_fault" }]

[exercise.check.hint]
"prerequisite" = "Print the pitch first."

[[exercise.check]]
id = "after"
title = "and on"
points = 2
requires = ["runs"]
expect = [{ kind = "no_fault" }]
"""


def judged_by(folder: Path, text: str, firmware: str, exercises: list[str] | None = None) -> Verdict:
    (folder / "needy.toml").write_text(text, encoding="utf-8")
    return judge(firmware, load_rubric(folder / "needy.toml"), seed=1, exercises=exercises)


def test_check_gets_no_points_without_its_prerequisites(tmp_path: Path) -> None:
    verdict = judged_by(tmp_path, NEEDY, "template")
    _, runs, after = verdict.checks

    assert (runs.outcome, runs.points, runs.finding) == ("failed", 0.0, "prerequisite")
    assert runs.requires_unmet == ("1.pitch",)
    assert "1.pitch" in runs.actual
    assert "the pitch is printed" in runs.actual
    assert runs.hint == "Print the pitch first."
    assert after.requires_unmet == ("2.runs",)
    assert verdict.points == 0


def test_new_prerequisite_title_needs_no_new_run(tmp_path: Path) -> None:
    verdict = judged_by(tmp_path, NEEDY, "template")
    renamed = NEEDY.replace('title = "the pitch is printed"', 'title = "the pitch comes"')
    (tmp_path / "needy.toml").write_text(renamed, encoding="utf-8")

    assert reworded(verdict, load_rubric(tmp_path / "needy.toml")) == judged_by(tmp_path, renamed, "template")


@pytest.mark.parametrize(("key", "told"), [("title", True), ('detail = "none"\ntitle', False)])
def test_title_of_hidden_prerequisite_is_not_shown(tmp_path: Path, key: str, told: bool) -> None:
    text = NEEDY.replace('title = "the pitch is printed"', f'{key} = "the pitch is printed"')
    runs = judged_by(tmp_path, text, "template").for_student().checks[1]

    assert ("the pitch is printed" in runs.actual) is told


def test_single_hint_is_not_shown_for_failed_prerequisite(tmp_path: Path) -> None:
    table = '[exercise.check.hint]\n"prerequisite" = "Print the pitch first."\n'
    verdict = judged_by(tmp_path, NEEDY.replace(table, 'hint = "It crashes."\n'), "template")

    assert (verdict.checks[1].finding, verdict.checks[1].hint) == ("prerequisite", "")


LIT = """\
[[exercise.check]]
id = "led"
title = "LED1 shows a pitch beyond 45 degrees"
expect = [{ kind = "led_follows", led = "led1", when = { quantity = "pitch", beyond = 45 } }]

[exercise.check.hint]
"""


@pytest.mark.parametrize(
    ("hints", "shown"),
    [
        ({"wrong value": "VALUE"}, "VALUE"),
        ({"wrong value": "VALUE", "never lit": "LED"}, "LED"),
        ({"missing": "NONE", "late": "LATE"}, ""),
    ],
)
def test_general_hint_applies_to_more_specific_findings(
    tmp_path: Path, hints: dict[str, str], shown: str
) -> None:
    table = "".join(f'"{kind}" = "{text}"\n' for kind, text in hints.items())
    text = NEEDY.replace('duration = "3s"', 'duration = "3s"\nworld = { pitch_deg = 60 }') + LIT + table
    led = judged_by(tmp_path, text, "lab3").checks[-1]

    assert (led.finding, led.fault, led.hint) == ("never lit", "wrong value", shown)


def test_check_gets_points_when_its_prerequisites_pass(tmp_path: Path) -> None:
    verdict = judged_by(tmp_path, NEEDY, "lab3")

    assert (verdict.points, verdict.max_points) == (4, 4)
    assert Verdict.from_json(verdict.to_json()) == verdict


@pytest.mark.parametrize(("firmware", "points"), [("template", 0), ("lab3", 3)])
def test_single_exercise_is_judged_with_its_prerequisites(tmp_path: Path, firmware: str, points: int) -> None:
    verdict = judged_by(tmp_path, NEEDY, firmware, ["2"])

    assert [one.check for one in verdict.checks] == ["2.runs", "2.after"]
    assert verdict.points == points


def test_hidden_prerequisite_is_not_shown_to_students(tmp_path: Path) -> None:
    shown = judged_by(tmp_path, NEEDY.replace('"always"', '"never"'), "template").for_student()

    assert shown.hidden_checks == 1
    assert "1.pitch" not in shown.to_json()
    assert shown.checks[0].finding == "prerequisite"


def test_unjudged_prerequisite_leaves_check_unjudged(tmp_path: Path) -> None:
    text = NEEDY.replace('{ kind = "printed", name = "Pitch", max_gap = "2s" }', '{ kind = "no_warnings" }')
    verdict = judged_by(tmp_path, text, "lab3")

    assert {one.outcome for one in verdict.checks} == {"unjudged"}
    assert (verdict.points, verdict.unjudged_points) == (0, 4)


FOLLOWING = """\
schema = 1
title = "LED1 follows the pitch"
[run.steep]
duration = "6s"
sensors = { quality = "ideal" }
timeline = [{ do = "set_attitude", pitch_deg = 85, at = "3s" }]
[[exercise]]
id = "1"
title = "LED1"
run = "steep"
[[exercise.check]]
id = "led"
title = "LED1 is lit"
DETAIL
expect = [{ kind = "led_follows", led = "led1", angle = "pitch" }]
"""


def test_evidence_shows_leds_with_their_conditions(tmp_path: Path) -> None:
    (evidence,) = judged_by(tmp_path, FOLLOWING.replace("DETAIL", ""), "lab3").evidence
    (led,) = evidence.following

    assert led.name == "LED1"
    for spans in (led.wanted, led.shown):
        (span,) = spans
        assert span == pytest.approx((3.0, 6.0), abs=0.05)


def test_conditions_of_hidden_checks_are_not_shown(tmp_path: Path) -> None:
    verdict = judged_by(tmp_path, FOLLOWING.replace("DETAIL", 'detail = "actual"'), "lab3")

    assert verdict.evidence[0].following
    assert verdict.for_student().evidence[0].following == ()


def test_pattern_that_takes_too_long_is_not_judged(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("fcu_emulator.emulator.scenario.fields._LINE_PATIENCE_S", 0.01)
    monkeypatch.setattr("fcu_emulator.emulator.scenario.fields._RUN_PATIENCE_S", 0.02)
    slow = "pattern = '^(?P<number>.|..)+(?<!.)$'"
    following = f"kind = 'line_follows', {slow}, max_gap = '1s', when = {{ led = 'led1' }}"
    number = f"kind = 'field', {slow}, truth = 'roll', tolerance = 1"
    for expectation in (following, number):
        old = '{ kind = "printed", name = "Pitch", max_gap = "2s" }'
        verdict = judged_by(tmp_path, NEEDY.replace(old, f"{{ {expectation} }}"), "lab3", ["1"])
        assert verdict.checks[0].outcome == "unjudged"
