"""``fcu rubric check``: which points a rubric gives away, and expectations that it does not count."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from fcu_emulator.emulator.errors import RubricError
from fcu_emulator.emulator.grading.judge import judge
from fcu_emulator.emulator.grading.rubric import load_rubric
from fcu_emulator.emulator.grading.trials import lines_of, trials

TILT = """\
schema = 1
title = "Tilt alarm"

[run.tilt]
sensors = { quality = "ideal" }
threshold = [{ quantity = "roll", value = 45, margin = 1, rest = "1.5s", turn = "500ms" }]

[[exercise]]
id = "1"
title = "Tilt alarm"
run = "tilt"

[[exercise.check]]
id = "alarm"
title = "ALARM beyond 45 degrees of roll"
points = 3

[[exercise.check.expect]]
kind = "line_follows"
text = "ALARM"
max_gap = "1.1s"
when = { quantity = "roll", beyond = 45, margin = 0.3 }

[[exercise.check]]
id = "runs"
title = "the program keeps running"
REQUIRES
expect = [{ kind = "no_fault" }]

[[exercise.check]]
id = "dark"
title = "LED2 is dark"
REQUIRES
expect = [{ kind = "led", led = "led2", state = "off", from = "100ms" }]
"""
SCENARIO = """\
schema = 1
question = "Is the pitch printed?"
duration = "3s"
[[expect]]
kind = "printed"
name = "Pitch"
max_gap = "2s"
"""
NAMED = """\
schema = 1
title = "By a scenario"
run.still.scenario = "still.toml"
[[exercise]]
id = "1"
title = "Lie still"
run = "still"
[[exercise.check]]
id = "pitch"
title = "The pitch"
"""


def written(folder: Path, text: str) -> Path:
    (folder / "mine.toml").write_text(text, encoding="utf-8")
    (folder / "still.toml").write_text(SCENARIO, encoding="utf-8")
    return folder / "mine.toml"


def checked(file: Path, *options: str) -> str:
    done = subprocess.run(
        [sys.executable, "-m", "fcu_emulator", "rubric", "check", str(file), *options],
        capture_output=True,
        encoding="utf-8",
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_trials_show_points_that_need_no_work(tmp_path: Path) -> None:
    rubric = load_rubric(written(tmp_path, TILT.replace("REQUIRES\n", "")))
    earned = [set(trial.earned) for trial in trials(rubric, "template-arm")]

    assert earned == [{"1.runs"}, {"1.runs", "1.dark"}, {"1.runs"}, {"1.runs", "1.dark"}, {"1.runs"}]


def test_lab3_gives_no_points_without_sensor_reads() -> None:
    earned = {one.program: one.verdict.points for one in trials(load_rubric("lab3"), "template-arm", seed=5)}

    assert earned.pop("the template") == 5
    assert set(earned.values()) == {0}


def test_prerequisites_leave_no_free_points(tmp_path: Path) -> None:
    rubric = load_rubric(written(tmp_path, TILT.replace("REQUIRES", 'requires = ["alarm"]')))

    assert [trial.earned for trial in trials(rubric, "template-arm")] == [{}] * 5


@pytest.mark.parametrize(("requires", "warned"), [("", True), ('requires = ["alarm"]', False)])
def test_rubric_check_warns_of_points_given_away(tmp_path: Path, requires: str, warned: bool) -> None:
    output = checked(written(tmp_path, TILT.replace("REQUIRES", requires)))

    assert ("warning: 1.runs" in output) is warned
    assert output.count(" of 5 ") >= 5


def test_rubric_check_with_file_only_runs_no_program(tmp_path: Path) -> None:
    output = checked(written(tmp_path, TILT.replace("REQUIRES", "")), "--file-only")

    assert "warning" not in output
    assert len(output.splitlines()) == 1


@pytest.mark.parametrize(
    ("expectation", "line"),
    [
        ('kind = "line", text = "HELLO"', "HELLO"),
        ('kind = "field", name = "Altitude", truth = true, tolerance = 1', "Altitude: 0.000000 m"),
        ('kind = "printed", format = "t=%5.1f %s 50%%", max_gap = "1s"', "t=  0.0 x 50%"),
        ('kind = "within", pattern = "^t=(?P<number>-?[0-9]+)$", min = 0, max = 1', "t=0"),
        ('kind = "regex", pattern = "^t=\\\\d+ deg"', "t=0 deg"),
        ('kind = "never", pattern = "ALARM"', None),
    ],
)
def test_printed_line_is_generated_from_expectation(
    tmp_path: Path, expectation: str, line: str | None
) -> None:
    rubric = load_rubric(written(tmp_path, NAMED + f"expect = [{{ {expectation} }}]\n"))

    assert lines_of(rubric) == ([line] if line else [])


# -- A scenario's own expectations --------------------------------------------------------------------------


def test_check_without_expect_uses_expectations_of_scenario(tmp_path: Path) -> None:
    rubric = load_rubric(written(tmp_path, NAMED))

    assert [judge(name, rubric, seed=1).points for name in ("lab3", "template")] == [1, 0]
    assert rubric.uncounted == {}


def test_uncounted_expectations_of_scenario_cause_warning(tmp_path: Path) -> None:
    file = written(tmp_path, NAMED + 'expect = [{ kind = "no_fault" }]\n')

    assert load_rubric(file).uncounted == {"still": 1}
    assert "warning: run still" in checked(file, "--file-only")


def test_check_without_any_expectations_is_refused(tmp_path: Path) -> None:
    file = written(tmp_path, NAMED.replace('scenario = "still.toml"', 'duration = "2s"'))

    with pytest.raises(RubricError) as caught:
        load_rubric(file)
    assert caught.value.key == "exercise[0].check[0].expect"
