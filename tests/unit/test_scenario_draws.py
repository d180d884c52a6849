"""Numbers drawn from the seed: within their limits, equal on all machines, and errors that name their key."""

from __future__ import annotations

from pathlib import Path

import jsonschema
import pytest

from fcu_emulator import Board
from fcu_emulator.emulator.errors import ScenarioError
from fcu_emulator.emulator.scenario import json_schema, load_scenario
from tests.support.words import Words

FILE = """\
schema = 1
question = "Where does the board turn to?"
duration = "9s"

[world]
pressure_hpa = { uniform = [950, 1030] }
hard_iron_mgauss = [{ uniform = [100, 200], random_sign = true }, 0, { one_of = [5, 6] }]

[[timeline]]
do = "rotate_to"
at = "1s"
for = { uniform = ["1s", "2s"] }
pitch_deg = { uniform = [20, 70], random_sign = true }
"""


def written(folder: Path, text: str = FILE) -> Path:
    path = folder / "turn.toml"
    path.write_text(text, encoding="utf-8")
    return path


def attitudes(path: Path, count: int) -> list[float]:
    """Return the pitch for each seed."""
    entries = (load_scenario(path, seed=seed).table["timeline"][0] for seed in range(count))
    return [float(entry["pitch_deg"]) for entry in entries]


def test_random_values_are_within_limits_and_differ(tmp_path: Path) -> None:
    drawn = attitudes(written(tmp_path), 40)

    assert all(20 <= abs(one) <= 70 for one in drawn)
    assert {one > 0 for one in drawn} == {True, False}
    assert len(set(drawn)) > 30


def test_random_value_does_not_depend_on_other_entries(tmp_path: Path) -> None:
    before = attitudes(written(tmp_path), 5)
    again = attitudes(written(tmp_path, f'{FILE}\n[[timeline]]\ndo = "hold"\nfor = "1s"\n'), 5)

    assert before == again
    assert before[0] == pytest.approx(PITCH_OF_SEED_0)


PITCH_OF_SEED_0 = -23.57
"""The value at the time of writing, so that a verdict of last year can be repeated."""


def test_seed_of_board_determines_random_values(tmp_path: Path) -> None:
    path = written(tmp_path)
    boards = [Board(scenario=path, seed=seed) for seed in (1, 1, 2)]
    for board in boards:
        board.run_for(5)
    pitches = [float(board.world.attitude_deg([5.0])[0, 1]) for board in boards]

    assert pitches[0] == pitches[1] != pitches[2]


@pytest.mark.parametrize(
    ("old", "new", "key", "kind"),
    [
        ("uniform = [20, 70]", "uniform = [70, 20]", "timeline[0].pitch_deg", "draw"),
        ("uniform = [20, 70]", "uniform = [20]", "timeline[0].pitch_deg", "draw"),
        ("uniform = [20, 70]", 'uniform = [20, "70"]', "timeline[0].pitch_deg", "draw"),
        ("uniform = [20, 70]", "uniform = [20, 70], of = 1", "timeline[0].pitch_deg", "draw"),
        ('uniform = ["1s", "2s"]', 'uniform = ["1s", 2]', "timeline[0].for", "draw"),
        ('uniform = ["1s", "2s"]', 'uniform = ["1", "2s"]', "timeline[0].for", "draw"),
        ("one_of = [5, 6]", "one_of = []", "world.hard_iron_mgauss[2]", "draw"),
        ("uniform = [950, 1030]", "uniform = [950, 10300]", "world.pressure_hpa", "less_than_equal"),
        ("uniform = [20, 70]", "uniform = [20, 700000]", "timeline[0].pitch_deg", "greater_than_equal"),
        ("random_sign = true", "random_sign = 1", "world.hard_iron_mgauss[0]", "draw"),
    ],
)
def test_wrong_random_value_is_refused_with_any_seed(
    tmp_path: Path, old: str, new: str, key: str, kind: str, words: Words
) -> None:
    path = written(tmp_path, FILE.replace(old, new, 1))

    with pytest.raises(ScenarioError) as caught:
        load_scenario(path, seed=3)

    assert (caught.value.file, caught.value.key, caught.value.kind) == (str(path), key, kind)
    words("scenario", caught.value.problem)


def test_schema_accepts_random_values(tmp_path: Path) -> None:
    import tomllib

    validator = jsonschema.Draft202012Validator(json_schema())
    validator.validate(tomllib.loads(FILE))
    with pytest.raises(jsonschema.ValidationError):
        validator.validate(tomllib.loads(FILE.replace("uniform = [20, 70]", "drawn = [20, 70]")))
