"""The lab's properties hold for the model and the shipped program, and find mistakes in other programs."""

from __future__ import annotations

import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
import pytest
from hypothesis import Phase, given, settings

from fcu_emulator import Board, InputError
from fcu_emulator.emulator.scenario import load_scenario, run
from fcu_emulator.emulator.testing.lab3 import Angles, Compiled, PythonModel, Subject, lab3_properties, replay
from fcu_emulator.emulator.testing.strategies import (
    GeneratedMotion,
    Pose,
    attitudes,
    fields,
    hard_irons,
    motions,
    samples,
    soft_irons,
    zero_vectors,
)
from fcu_emulator.firmware_model import arm
from tests.support.arm.call_programs import FOLDER
from tests.support.words import Words

WRONG_YAW = FOLDER / "wrong_yaw.elf"
"""The solution with a wrong wrap: ``if (azimuth < 0) azimuth = 180 - azimuth;``."""

TestModel = lab3_properties(PythonModel())
TestShippedProgram = lab3_properties(Compiled("solution"))


class Turned(PythonModel):
    """A model with one mistake."""

    def __init__(self, wrong: str) -> None:
        self._wrong = wrong

    def angles(self, acc: Any, mag: Any) -> Angles:
        pitch, roll, yaw = super().angles(acc, mag)
        return {
            "pitch": Angles(-pitch, roll, yaw),
            "roll": Angles(pitch, roll * 0.99, yaw),
            "yaw": Angles(pitch, roll, -yaw),
            "radians": Angles(pitch, roll, yaw * 3.14159 / 180),
            "range": Angles(pitch, roll, yaw % 360),
            "scale": Angles(pitch + acc[2] / 1e4, roll, yaw),
            "nan": Angles(pitch, roll, float("nan") if mag[0] < 0 else yaw),
        }.get(self._wrong, Angles(pitch, roll, yaw))

    def calibrated(self, field_mgauss: Any) -> Any:
        found = super().calibrated(field_mgauss)
        return [(x + 2, y, z) for x, y, z in found] if self._wrong == "calibration" else found

    def altitude(self, press_hpa: float, temperature_degc: float, press_zero_level_hpa: float) -> float:
        found = super().altitude(press_hpa, temperature_degc, press_zero_level_hpa)
        return {"altitude": -found, "zero": found + 0.1}.get(self._wrong, found)


def found_by(subject: Subject) -> set[str]:
    """Return the names of the properties that do not hold."""
    tests = lab3_properties(subject)
    found = set()
    for name in [name for name in vars(tests) if name.startswith("test_")]:
        try:
            getattr(tests(), name)()
        except AssertionError:
            found.add(name)
    return found


def board_note(error: AssertionError) -> str:
    """Return the note that says how the board shows the failure; Hypothesis adds more notes in CI."""
    return next(note for note in error.__notes__ if "--scenario" in note)


@pytest.mark.parametrize(
    ("wrong", "properties"),
    [
        ("pitch", "pitch_is"),
        ("roll", "roll_is"),
        ("yaw", "yaw_is"),
        ("radians", "yaw_is"),
        ("range", "within_their_ranges"),
        ("scale", "vectors_lengths"),
        ("nan", "within_their_ranges"),
        ("calibration", "any_offset"),
        ("altitude", "less_pressure"),
        ("zero", "where_it_was_zeroed"),
    ],
)
def test_properties_find_wrong_model(wrong: str, properties: str) -> None:
    assert any(properties in name for name in found_by(Turned(wrong)))


def test_wrong_yaw_is_found_in_compiled_program(tmp_path: Path) -> None:
    tests = lab3_properties(Compiled(WRONG_YAW))
    with pytest.raises(AssertionError) as caught:
        tests().test_yaw_is_the_direction_of_the_x_axis_against_magnetic_north()
    command, scenario = board_note(caught.value).split("\n\n", maxsplit=2)[1:]
    path = tmp_path / "replay.toml"
    path.write_text(scenario.partition("# end of replay.toml")[0], encoding="utf-8")

    assert command.strip() == f"fcu run {WRONG_YAW} --scenario replay.toml --speed max"
    assert not run(Board(firmware=WRONG_YAW, scenario=path)).passed
    assert run(Board(firmware="solution", scenario=path)).passed


SOLUTION = arm.sources() / "solution" / "motion.c"
WRONG = {
    "yaw_is": {"azimuth = azimuth * DEGREES;": "azimuth *= DEGREES; if (fabsf(pitch) > 60) azimuth += 180;"},
    "pitch_is": {"pitch = pitch * DEGREES;": "pitch = -pitch * DEGREES;"},
    "roll_is": {"roll = roll * DEGREES;": "roll = roll * DEGREES * 0.99;"},
    "within_their_ranges": {
        "azimuth = azimuth * DEGREES;": "azimuth *= DEGREES; if (azimuth < 0) azimuth += 360;"
    },
    "vectors_lengths": {
        "azimuth = azimuth * DEGREES;": "azimuth *= DEGREES; if (mag.AXIS_Z < -1500) azimuth += 9;"
    },
    "any_offset": {"(mag_max.AXIS_X + mag_min.AXIS_X) / 2": "(mag_max.AXIS_X + mag_min.AXIS_X) / 3"},
    "it_was_zeroed": {"/ LAPSE_RATE;": "/ LAPSE_RATE + 0.3;"},
    "less_pressure": {"(1 / 5.257)": "(1 / 5)"},
}
"""Changes that break each law, by a part of the law's name: text of the solution, and its replacement."""


@pytest.fixture(scope="module")
def build(tmp_path_factory: pytest.TempPathFactory) -> Callable[[dict[str, str]], Path]:
    """Build the solution with changed text in its motion.c."""
    if shutil.which("arm-none-eabi-gcc") is None:
        pytest.skip("arm-none-eabi-gcc is not installed")
    folder, sources = tmp_path_factory.mktemp("wrong"), arm.sources()
    shutil.copytree(sources / "support", folder / "support")
    shutil.copytree(sources / "solution", folder / "solution")
    shutil.copy(sources / "Makefile", folder)

    def build(changes: dict[str, str]) -> Path:
        text = SOLUTION.read_text(encoding="utf-8")
        for right, wrong in changes.items():
            assert right in text
            text = text.replace(right, wrong)
        (folder / "solution" / "motion.c").write_text(text, encoding="utf-8")
        make = ["make", "-s", "-W", "solution/motion.c", "PROGRAM=solution", "OUT=out"]
        subprocess.run(make, cwd=folder, check=True, timeout=120)
        return folder / "out" / "solution-i2c2.elf"

    return build


@pytest.mark.parametrize("law", WRONG)
def test_scenario_of_each_property_finds_its_mistake(
    law: str, build: Callable[[dict[str, str]], Path], tmp_path: Path
) -> None:
    firmware = build(WRONG[law])
    tests = lab3_properties(Compiled(firmware), max_examples=60, derandomize=True, database=None)
    name = next(name for name in vars(tests) if law in name)
    with pytest.raises(AssertionError) as caught:
        getattr(tests(), name)()
    told = board_note(caught.value)
    path = tmp_path / "replay.toml"
    path.write_text(told.split("--speed max\n\n")[1].partition("# end of replay.toml")[0], encoding="utf-8")

    assert not run(Board(firmware, scenario=path)).passed
    assert run(Board("solution", scenario=path)).passed
    assert run(Board("lab3", scenario=path)).passed


def test_error_too_small_for_board_is_explained(
    build: Callable[[dict[str, str]], Path], words: Words
) -> None:
    firmware = build({"(mag_max.AXIS_X + mag_min.AXIS_X) / 2;": "(mag_max.AXIS_X + mag_min.AXIS_X) / 2 - 2;"})
    tests = lab3_properties(Compiled(firmware), max_examples=20, derandomize=True, database=None)
    with pytest.raises(AssertionError) as caught:
        tests().test_calibration_finds_any_offset()

    assert not any("replay.toml" in note for note in caught.value.__notes__)
    words("python", next(note for note in caught.value.__notes__ if "docs/" in note))


@pytest.mark.parametrize(
    "pose", [Pose(0, 0, 179), Pose(60, 0, -120), Pose(0, -75, 90), Pose(0, 90, 0), Pose(30, 40, 50)]
)
def test_replay_passes_with_firmware_of_lab(pose: Pose, tmp_path: Path) -> None:
    path = tmp_path / "replay.toml"
    path.write_text(replay(pose), encoding="utf-8")

    assert run(Board(firmware="lab3", scenario=path)).passed


@pytest.mark.skipif(shutil.which("arm-none-eabi-gcc") is None, reason="arm-none-eabi-gcc is not installed")
def test_stored_wrong_program_computes_same_as_changed_source(tmp_path: Path) -> None:
    sources = arm.sources()
    shutil.copytree(sources / "support", tmp_path / "support")
    shutil.copytree(sources / "solution", tmp_path / "wrong_yaw")
    shutil.copy(sources / "Makefile", tmp_path)
    motion = tmp_path / "wrong_yaw" / "motion.c"
    right = "  azimuth = azimuth * DEGREES;\n"
    wrong = right + "  if (azimuth < 0) {\n    azimuth = 180 - azimuth;\n  }\n"
    assert right in motion.read_text()
    motion.write_text(motion.read_text().replace(right, wrong))
    subprocess.run(["make", "-s", "PROGRAM=wrong_yaw", "OUT=out"], cwd=tmp_path, check=True, timeout=120)
    built, kept = Compiled(tmp_path / "out" / "wrong_yaw-i2c2.elf"), Compiled(WRONG_YAW)

    for mag in [(100, 50, -400), (100, -50, -400), (-100, -50, -400)]:
        assert built.angles((0, 0, 1000), mag) == kept.angles((0, 0, 1000), mag)


def test_missing_function_is_reported_with_hint(words: Words) -> None:
    template = Compiled("template-arm")
    assert "names={'eCompass': ...}" in template.missing("angles")
    words("python", template.missing("angles"))
    assert Compiled("solution", {"yaw": "roll"}).missing("angles") == ""
    with pytest.raises(InputError, match="'heading'") as caught:
        Compiled("solution", {"heading": "roll"})
    assert caught.value.kind == "unknown_name"


# -- strategies ---------------------------------------------------------------------------------------------


@settings(max_examples=200)
@given(attitudes(80.0, 70.0), samples(noise_mg=5), fields(), hard_irons(300), soft_irons(), zero_vectors())
def test_strategies_keep_within_their_bounds(
    pose: Pose, sample: Any, field: Any, hard: Any, soft: Any, zero: Any
) -> None:
    assert abs(pose.roll_deg) <= 80
    assert abs(pose.pitch_deg) <= 70
    assert abs(pose.yaw_deg) <= 180
    assert abs(sum(component**2 for component in sample.acc) ** 0.5 - 1000) < 12
    assert field[0] >= 10
    assert max(map(abs, hard)) <= 300
    assert all(abs(soft[i][j] - soft[j][i]) == 0 for i in range(3) for j in range(3))
    assert (0, 0, 0) in zero


@pytest.mark.parametrize("pose", [Pose(0, 0, 90), Pose(90, 0, 0), Pose(0, -90, 45), Pose(-30, 0, 200 - 360)])
def test_strategy_samples_equal_ideal_board(pose: Pose) -> None:
    board = Board(firmware="template", ideal=True)
    board.world.set_attitude(pose.roll_deg, pose.pitch_deg, pose.yaw_deg)
    board.run_for(1.3)
    sample = _sample_at(pose)

    for name, shown, step in (("acc", sample.acc, 1), ("mag", sample.mag, 2)):
        measured = board.variable(name)
        read = (measured.AXIS_X, measured.AXIS_Y, measured.AXIS_Z)
        assert all(abs(one - other) <= step for one, other in zip(read, shown, strict=True)), (read, shown)


def _sample_at(pose: Pose) -> Any:
    from hypothesis import find
    from hypothesis import strategies as st

    return find(samples(st.just(pose)), lambda _: True)


# -- motions ------------------------------------------------------------------------------------------------


@settings(max_examples=40)
@given(motions(expect=[{"kind": "printed", "name": "Pitch", "max_gap": "1.5s"}]))
def test_generated_motion_is_unchanged_after_saving_and_loading(motion: GeneratedMotion) -> None:
    world = Board("template", scenario=motion.scenario).world
    t_s = np.linspace(0.0, motion.scenario.duration_s, 200)
    with TemporaryDirectory() as folder:
        path = Path(folder) / "motion.toml"
        path.write_text(motion.text, encoding="utf-8")
        again = load_scenario(path)

    assert np.abs(world.angular_rate_dps(t_s)).max() < 1000
    assert again.contents == motion.scenario.contents
    assert again.table == motion.scenario.table


TURN = """\
schema = 1
question = "Is the yaw right after a short calibration?"
duration = "7s"
[sensors]
quality = "ideal"
[[timeline]]
do = "figure_eight"
at = "0.5s"
for = "3s"
[[timeline]]
do = "rotate_to"
yaw_deg = { uniform = [20, 170], random_sign = true }
for = "1s"
[[expect]]
kind = "field"
name = "Yaw"
truth = true
tolerance = 5
from = "4.6s"
"""


def test_motion_property_finds_wrong_yaw_and_prints_scenario(tmp_path: Path) -> None:
    (tmp_path / "turn.toml").write_text(TURN, encoding="utf-8")

    @settings(max_examples=12, phases=[Phase.generate], deadline=None, database=None, derandomize=True)
    @given(motions(tmp_path / "turn.toml", firmware=str(WRONG_YAW)))
    def law(motion: GeneratedMotion) -> None:
        assert run(Board(WRONG_YAW, scenario=motion.scenario)).passed

    with pytest.raises(AssertionError) as caught:
        law()
    command, scenario = board_note(caught.value).split("\n\n", maxsplit=2)[1:]
    path = tmp_path / "motion.toml"
    path.write_text(scenario.partition("# end of motion.toml")[0], encoding="utf-8")

    assert command.strip() == f"fcu run {WRONG_YAW} --scenario motion.toml --speed max"
    assert not run(Board(WRONG_YAW, scenario=path)).passed
    assert run(Board("solution", scenario=path)).passed
