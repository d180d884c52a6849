"""Margins of a rubric: margins that test nothing, and margins that fail correct programs on typical boards."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from fcu_emulator import Board
from fcu_emulator.emulator.boards.description import BoardErrors, SensorSettings
from fcu_emulator.emulator.clock import PS_PER_S
from fcu_emulator.emulator.grading.margins import margin_warnings, sensor_error
from fcu_emulator.emulator.grading.rubric import load_rubric

ALARM = """\
schema = 1
title = "An alarm"

[run.tilt]
sensors = SENSORS

[[run.tilt.threshold]]
quantity = "roll"
value = 45
margin = REST

[[exercise]]
id = "1"
title = "The alarm"
run = "tilt"

[[exercise.check]]
id = "led"
title = "LED1 shows it"
expect = [{ kind = "led_follows", led = "led1", when = { quantity = "roll", beyond = 45, margin = MARGIN } }]

[[exercise.check]]
id = "line"
title = "ALARM is printed"

[[exercise.check.expect]]
kind = "line_follows"
text = "ALARM"
max_gap = "1.2s"
when = { quantity = "roll", beyond = 45, margin = MARGIN }
"""
PRESSURE = """\
schema = 1
title = "A pressure"

[run.air]
duration = "2s"
sensors = SENSORS

[[exercise]]
id = "1"
title = "The LED"
run = "air"

[[exercise.check]]
id = "led"
title = "LED2 shows it"
expect = [{ kind = "led_follows", led = "led2", when = { quantity = "Pre", below = 950, margin = MARGIN } }]
"""
IDEAL, TYPICAL = '{ quality = "ideal" }', '{ quality = "typical" }'


def warnings(folder: Path, text: str, sensors: str, margin: str, rest: str = "1") -> list[str]:
    for name, value in (("SENSORS", sensors), ("MARGIN", margin), ("REST", rest)):
        text = text.replace(name, value)
    (folder / "mine.toml").write_text(text, encoding="utf-8")
    return list(margin_warnings(load_rubric(folder / "mine.toml")))


@pytest.mark.parametrize(
    ("margin", "rest", "warned"),
    [
        ("0.3", "{ uniform = [0.5, 1.5] }", False),
        ("0.5", "{ uniform = [0.5, 1.5] }", True),
        ("1", "{ uniform = [0.5, 1.5] }", True),
        ("1", "1", True),
        ("0.9", "1", False),
    ],
)
def test_margin_that_includes_stop_of_board_causes_warning(
    tmp_path: Path, margin: str, rest: str, warned: bool
) -> None:
    found = warnings(tmp_path, ALARM, IDEAL, margin, rest)

    assert [text.split()[0] for text in found] == (["1.led", "1.line"] if warned else [])
    assert all("run.tilt.threshold[0]" in text for text in found)


def test_condition_on_another_value_is_not_compared(tmp_path: Path) -> None:
    assert warnings(tmp_path, ALARM.replace("beyond = 45", "beyond = 30"), IDEAL, "2") == []


@pytest.mark.parametrize(
    ("text", "sensors", "margin", "warned"),
    [
        (ALARM, IDEAL, "0.3", False),
        (ALARM, TYPICAL, "5", True),
        (ALARM, TYPICAL, "8", False),
        (ALARM, '{ quality = "worst" }', "8", True),
        (ALARM, '{ quality = "ideal", lsm6dsl = { acc_bias_mg = [0.0, 0.0, 60.0] } }', "1", True),
        (PRESSURE, IDEAL, "0.1", False),
        (PRESSURE, TYPICAL, "1", True),
        (PRESSURE, TYPICAL, "4", False),
        (PRESSURE, '{ quality = "typical", lps22hb = { pressure_bias_hpa = 0.0 } }', "0.6", False),
    ],
)
def test_margin_below_error_of_sensor_causes_warning(
    tmp_path: Path, text: str, sensors: str, margin: str, warned: bool
) -> None:
    found = warnings(tmp_path, text, sensors, margin, rest="9")

    assert bool(found) is warned
    assert all("1.led" in one for one in found)


def test_offset_of_one_axis_causes_inclination_error() -> None:
    settings = SensorSettings("ideal", {"lsm6dsl": {"acc_bias_mg": (100.0, 0.0, 0.0)}})

    assert sensor_error("roll", 1.0, settings) == pytest.approx(5.7, abs=0.1)
    assert sensor_error("pitch", 1.0, settings) == pytest.approx(0.0, abs=0.05)
    assert sensor_error("Yaw", 1.0, settings) is None


@pytest.mark.parametrize("seed", [111, 76])  # of those with the largest errors
def test_calculated_error_agrees_with_board(seed: int, tmp_path: Path) -> None:
    errors = []
    for roll in (45.0, -45.0):
        table = f'schema = 1\nquestion = "?"\nduration = "5s"\n[world]\nroll_deg = {roll}\n'
        (tmp_path / "rest.toml").write_text(table, encoding="utf-8")
        board = Board("lab3", scenario=tmp_path / "rest.toml", seed=seed)
        board.run_until_ps(4 * PS_PER_S)
        errors.append(abs(board.variable("roll") - roll))

    largest = sensor_error("roll", 45.0, SensorSettings("typical"))
    assert largest is not None
    assert 6.5 < max(errors) < largest < 7


def test_page_has_errors_of_typical_boards() -> None:
    page = (Path(__file__).parents[2] / "docs" / "rubrics.md").read_text(encoding="utf-8")
    shown = re.findall(r"^\| `\w+`.* \| ([\d.]+) (?:degrees|hPa|m),", page, re.MULTILINE)
    quantities = (("roll", 45.0), ("Pre", 950.0), ("Altitude", 3.0))

    typical = [sensor_error(*one, SensorSettings("typical")) for one in quantities]
    assert shown == [f"{one:.1f}" for one in typical]


def test_altitude_error_excludes_constant_offset() -> None:
    settings = SensorSettings("ideal", {"lps22hb": {"pressure_bias_hpa": 2.0}})

    assert sensor_error("Altitude", 3.0, settings) == 0
    noise_hpa = np.hypot(0.0075 * 1.6, 0.02)  # of the barometer with the lab's settings, and of the room
    largest = sensor_error("Altitude", 3.0, SensorSettings("typical"))
    assert largest == pytest.approx(3 * np.sqrt(2) * 9.0 * noise_hpa, rel=0.01)
    still = sensor_error("Altitude", 3.0, SensorSettings("typical"), BoardErrors())
    assert still == pytest.approx(3 * np.sqrt(2) * 9.0 * 0.0075 * 1.6, rel=0.01)


def test_shipped_rubric_has_no_warning() -> None:
    assert list(margin_warnings(load_rubric("lab3"))) == []
