"""Rubric files: an error in one is reported in a line with file, key and the correct form."""

from __future__ import annotations

import json
import tomllib
from pathlib import Path

import jsonschema
import pytest

from fcu_emulator.emulator.errors import InputError, RubricError
from fcu_emulator.emulator.grading.rubric import json_schema, load_rubric, rubric_names
from tests.support.words import Words

GOOD = """\
schema = 1
title = "A rubric"

[run.still]
duration = "2s"

[[exercise]]
id = "1"
title = "Lie still"
run = "still"

[[exercise.check]]
id = "pitch"
title = "Pitch is right"
points = 2
hint = "Which axis?"
expect = [{ kind = "field", name = "Pitch", truth = true, tolerance = 1 }]
"""


def written(folder: Path, text: str) -> Path:
    path = folder / "mine.toml"
    path.write_text(text, encoding="utf-8")
    return path


def test_valid_rubric_is_loaded(tmp_path: Path) -> None:
    rubric = load_rubric(written(tmp_path, GOOD))

    assert (rubric.name, rubric.title, rubric.max_points) == ("mine", "A rubric", 2)
    assert [check.id for check in rubric.exercise("1").check] == ["pitch"]


def test_shipped_rubrics_load_and_follow_schema() -> None:
    for name in rubric_names():
        table = tomllib.loads(load_rubric(name).path.read_text(encoding="utf-8"))
        table = json.loads(json.dumps(table, default=str))  # dates
        jsonschema.Draft202012Validator(json_schema()).validate(table)


@pytest.mark.parametrize(
    ("old", "new", "key", "kind"),
    [
        ("points = 2", "points = -2", "exercise[0].check[0].points", "greater_than_equal"),
        ('id = "pitch"', 'id = "a b"', "exercise[0].check[0].id", "string_pattern_mismatch"),
        ("hint =", "hnt =", "exercise[0].check[0].hnt", "unknown_key"),
        ("tolerance = 1", 'tolerance = "1"', "exercise[0].check[0].expect[0].tolerance", "float_type"),
        ('"field"', '"feild"', "exercise[0].check[0].expect[0].kind", "union_tag_invalid"),
        ('run = "still"', 'run = "stil"', "exercise[0].check[0].run", "unknown_run"),
        ('run = "still"\n', "", "exercise[0].check[0].run", "missing"),
        ('duration = "2s"', "duration = 2", "run.still.duration", "value_error"),
        ('duration = "2s"', 'scenario = "dsk"', "run.still.scenario", "unknown_scenario"),
        ('duration = "2s"', 'scenario = "desk"\nduration = "2s"', "run.still", "scenario_and_keys"),
        ('duration = "2s"', "seed = 2", "run.still.seed", "misplaced_key"),
        ("schema = 1", "schema = 2", "schema", "literal_error"),
        ("[run.still]", "[run]", "run.duration", "unknown_key"),
    ],
)
def test_wrong_rubric_is_refused_with_its_key(
    tmp_path: Path, old: str, new: str, key: str, kind: str, words: Words
) -> None:
    path = written(tmp_path, GOOD.replace(old, new))

    with pytest.raises(RubricError) as caught:
        load_rubric(path)

    assert (caught.value.file, caught.value.key, caught.value.kind) == (str(path), key, kind)
    assert "\n" not in str(caught.value)
    words("rubric", caught.value.problem)


def test_rubric_of_invalid_toml_is_refused(tmp_path: Path) -> None:
    path = written(tmp_path, GOOD.replace("[run.still]", "[run.still"))

    with pytest.raises(RubricError) as caught:
        load_rubric(path)

    assert (caught.value.file, caught.value.key, caught.value.kind) == (str(path), "", "invalid_toml")
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("table", "key", "place"),
    [
        ("[[threshold]]", "threshold", "[[run.NAME.threshold]]"),
        ("[[timeline]]", "timeline", "[[run.NAME.timeline]]"),
        ("[sensors]", "sensors", "[run.NAME.sensors]"),
        ("[world]", "world", "[run.NAME.world]"),
        ("[[expect]]", "expect", "[[exercise.check.expect]]"),
        ("[[check]]", "check", "[[exercise.check]]"),
        ("[hint]", "hint", "[exercise.check.hint]"),
        ("[[exercise.threshold]]", "exercise[0].threshold", "[[run.NAME.threshold]]"),
        ("[[exercise.expect]]", "exercise[0].expect", "[[exercise.check.expect]]"),
        ("[[exercise.check.threshold]]", "exercise[0].check[0].threshold", "[[run.NAME.threshold]]"),
        ("[exercise.check.late]", "exercise[0].check[0].late", "[late]"),
    ],
)
def test_misplaced_table_is_refused_with_its_place(tmp_path: Path, table: str, key: str, place: str) -> None:
    path = written(tmp_path, f"{GOOD}\n{table}\nx = 1\n")

    with pytest.raises(RubricError) as caught:
        load_rubric(path)

    assert caught.value.key == key
    assert place in caught.value.problem


MORE = """
[[exercise.check]]
id = "roll"
title = "Roll is right"
requires = ["pitch"]
expect = [{ kind = "field", name = "Roll", truth = true, tolerance = 1 }]
"""


@pytest.mark.parametrize("entry", ["pitch", "1.pitch"])
def test_requires_key_may_name_check_of_rubric(tmp_path: Path, entry: str) -> None:
    rubric = load_rubric(written(tmp_path, GOOD + MORE.replace('["pitch"]', f'["{entry}"]')))

    assert rubric.prerequisites.needed(["1.roll"]) == {"1.roll", "1.pitch"}


def test_required_exercise_means_its_checks_with_points(tmp_path: Path) -> None:
    second = MORE.replace('["pitch"]', '["1"]').replace(
        "\n[[exercise.check]]", '\n[[exercise]]\nid = "2"\ntitle = "More"\nrun = "still"\n[[exercise.check]]'
    )
    remark = MORE.replace("roll", "remark").replace("requires", "points = 0\nrequires")
    rubric = load_rubric(written(tmp_path, GOOD + remark + second))

    assert rubric.prerequisites.needed(["2.roll"]) == {"2.roll", "1.pitch"}


@pytest.mark.parametrize(
    ("old", "new", "key"),
    [
        ('["pitch"]', '["pich"]', "exercise[0].check[1].requires[0]: must be '1.pitch', not 'pich'"),
        ('["pitch"]', '["pitch", "roll"]', "exercise[0].check[1].requires[1]: "),
        ('["pitch"]', '["1"]', "exercise[0].check[1].requires[0]: "),
        ('title = "Pitch is', 'requires = ["roll"]\ntitle = "Pitch is', "exercise[0].check[0].requires[0]: "),
        ('["pitch"]', '"pitch"', "exercise[0].check[1].requires: "),
    ],
)
def test_unknown_or_circular_requires_key_is_refused(tmp_path: Path, old: str, new: str, key: str) -> None:
    path = written(tmp_path, (GOOD + MORE).replace(old, new))

    with pytest.raises(RubricError) as caught:
        load_rubric(path)

    assert str(caught.value).startswith(f"{path}: {key}")


def test_rubric_schema_refuses_unknown_run_keys() -> None:
    validator = jsonschema.Draft202012Validator(json_schema())
    validator.validate(tomllib.loads(GOOD))
    for wrong in ("durtion", "seed"):
        assert not validator.is_valid(tomllib.loads(GOOD.replace("duration", wrong)))


def test_unknown_rubric_name_error_lists_known_names() -> None:
    with pytest.raises(InputError, match=r"'lab2'.*lab3") as caught:
        load_rubric("lab2")
    assert caught.value.kind == "unknown_rubric"


def test_judging_digest_ignores_wording(tmp_path: Path) -> None:
    first = load_rubric(written(tmp_path, GOOD))
    words = load_rubric(written(tmp_path, GOOD.replace("Which axis?", "Which sign?")))
    harder = load_rubric(written(tmp_path, GOOD.replace("tolerance = 1", "tolerance = 0.5")))

    assert words.digest != first.digest
    assert words.judging_digest == first.judging_digest
    assert harder.judging_digest != first.judging_digest


def test_digest_includes_scenario_beside_rubric(tmp_path: Path) -> None:
    scenario = tmp_path / "mine" / "still.toml"
    scenario.parent.mkdir()
    scenario.write_text('schema = 1\nquestion = "Still?"\nduration = "2s"\n', encoding="utf-8")
    path = written(scenario.parent, GOOD.replace('duration = "2s"', 'scenario = "still.toml"'))
    before = load_rubric(path).judging_digest
    scenario.write_text('schema = 1\nquestion = "Still?"\nduration = "3s"\n', encoding="utf-8")

    assert load_rubric(path).judging_digest != before


def test_seed_depends_on_student_program_and_salt(tmp_path: Path) -> None:
    rubric = load_rubric(written(tmp_path, GOOD))
    fixed = load_rubric(written(tmp_path, GOOD.replace('title = "A rubric"', 'title = "A rubric"\nseed = 5')))

    submissions = [("ada", b"one", b"salt"), ("bob", b"one", b"salt"), ("ada", b"two", b"salt")]
    submissions += [("ada", b"one", b"pepper"), ("ae", b"one", b"salt")]
    seeds = [rubric.seed_for(*one) for one in submissions]

    assert len(set(seeds)) == len(seeds)
    assert seeds == [rubric.seed_for(*one) for one in submissions]
    assert {fixed.seed_for(*one) for one in submissions} == {5}


EXPLAIN = """
[explain.inputs]
raw = {{ sensor = "LSM6DSL", register = 0x28 }}
[explain.formulas]
acc_x = "{formula}"
[[explain.alternative]]
formulas = {{ {alternative} }}
[explain.shows]
"{check}" = ["{shown}"]
"""
RIGHT = {"formula": "raw * 0.122", "alternative": 'acc_x = "raw / 8"', "check": "1.pitch", "shown": "acc_x"}


def explained_by(tmp_path: Path, **changed: str) -> Path:
    return written(tmp_path, GOOD + EXPLAIN.format(**{**RIGHT, **changed}))


def test_explained_rubric_has_its_formulas(tmp_path: Path) -> None:
    rubric = load_rubric(explained_by(tmp_path))

    assert rubric.explain is not None
    assert rubric.judging_digest == load_rubric(written(tmp_path, GOOD)).judging_digest
    arithmetic = rubric.explain.arithmetic()
    assert (list(arithmetic.inputs), list(arithmetic.formulas)) == (["raw"], ["acc_x"])
    assert [list(one.formulas) for one in arithmetic.alternatives] == [["acc_x"]]


@pytest.mark.parametrize(
    ("changed", "key"),
    [
        ({"formula": "raw * "}, "explain.formulas.acc_x"),
        ({"formula": "__import__('os')"}, "explain.formulas.acc_x"),
        ({"formula": "acc_y + raw"}, "explain"),
        ({"formula": "acc_x + raw"}, "explain"),
        ({"alternative": 'other = "raw"'}, "explain"),
        ({"alternative": 'acc_x = "nothing"'}, "explain"),
        ({"check": "1.nothing"}, "explain.shows"),
        ({"shown": "raw"}, "explain"),
    ],
)
def test_wrong_formula_of_rubric_is_refused(tmp_path: Path, changed: dict[str, str], key: str) -> None:
    with pytest.raises(RubricError) as caught:
        load_rubric(explained_by(tmp_path, **changed))

    assert caught.value.key == key
