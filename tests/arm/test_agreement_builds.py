"""The other builds in C agree with the Python model: the template, and both programs with the sensors on SPI2.

Python firmware cannot run with the sensors on SPI2. It can be replayed on the samples that the C program has read.
"""

from __future__ import annotations

from pathlib import Path

import pytest

from fcu_emulator.emulator.analysis.compare import Rules, compare
from fcu_emulator.emulator.analysis.observation import TERMINAL, Observation
from fcu_emulator.emulator.trace import RegisterWrite
from tests.support.arm.agreement import ran, replayed, text_of
from tests.support.scenario_files import HEAD, write

STILL = f"""{HEAD}
duration = "2.3s"
[world]
roll_deg = 12
pitch_deg = -31
yaw_deg = 77
hard_iron_mgauss = [60, -40, 25]
temperature_degc = 18
[sensors]
quality = "ideal"
"""


@pytest.mark.parametrize(("in_c", "in_python"), [("solution", "lab3"), ("template-arm", "template")])
def test_builds_without_noise_print_equal_bytes(tmp_path: Path, in_c: str, in_python: str) -> None:
    """Without noise, samples do not depend on their times. The board is tilted and has a hard iron; it runs twice."""
    scenario = write(tmp_path, STILL)
    _, one = ran(in_c, scenario, 2.3)
    _, other = ran(in_python, scenario, 2.3)

    assert text_of(one).count("Pre: ") == 2
    assert _complete(one) == _complete(other)
    assert not compare(one, other)


def _complete(observation: Observation) -> list[str]:
    """Return the lines up to the last pressure. Later lines depend on the time at which the run ended."""
    lines = [line.text for line in observation.sequences[TERMINAL]]
    last = max(number for number, text in enumerate(lines) if "Pre: " in text)
    return lines[:last]


def test_ideal_board_equals_model() -> None:
    """The shipped noisy scenario is run with ``ideal``, so that it has no noise, and the board does not move."""
    _, one = ran("solution", "flat", 1.2, ideal=True)
    _, other = ran("lab3", "flat", 1.2, ideal=True)

    assert not compare(one, other)


def test_template_prints_same_as_python_model() -> None:
    board, in_c = ran("template-arm", "flat", 2.4)
    on_its_samples = replayed(board, "template")
    _, in_python = ran("template", "flat", 2.4)

    assert text_of(on_its_samples) == text_of(in_c)
    assert not compare(on_its_samples, in_c)  # LEDs too: they toggle once a second
    assert not compare(in_python, in_c, Rules(ignore={"numbers"}))


@pytest.mark.parametrize(
    ("in_c", "in_python", "scenario", "seconds"),
    [("solution", "lab3", "tilt_sweep", 2.3), ("template-arm", "template", "flat", 1.2)],
)
def test_builds_for_spi2_agree(in_c: str, in_python: str, scenario: str, seconds: float) -> None:
    board, observation = ran(in_c, scenario, seconds, wiring="fcu001v1")
    on_its_samples = replayed(board, in_python)

    assert text_of(observation).count("ACC[") == int(seconds)
    assert text_of(on_its_samples) == text_of(observation)
    assert not compare(on_its_samples, observation)


def test_both_wirings_end_with_lab_settings() -> None:
    """The final registers are compared. Over SPI2 the firmware uses three wires, no I2C, and single bytes."""
    settings = {}
    for wiring in ("lab3", "fcu001v1"):
        board, _ = ran("solution", "flat", 1.06, wiring=wiring)
        writes = board.trace.of(RegisterWrite)
        settings[wiring] = {f"{event.device} {event.register}": event.new for event in writes}

    assert settings["lab3"] == {
        "LSM6DSL FIFO_CTRL5": 0x00,
        "LSM6DSL CTRL1_XL": 0xA8,
        "LSM6DSL CTRL2_G": 0x6C,
        "LSM6DSL CTRL3_C": 0x44,
        "LSM6DSL CTRL6_C": 0x01,
        "LSM6DSL CTRL8_XL": 0xE0,
        "LIS2MDL CFG_REG_A": 0x8C,
        "LIS2MDL CFG_REG_B": 0x02,
        "LIS2MDL CFG_REG_C": 0x10,
        "LPS22HB RES_CONF": 0x01,
        "LPS22HB CTRL_REG1": 0x32,
        "LPS22HB CTRL_REG2": 0x10,
    }
    assert settings["fcu001v1"] == settings["lab3"] | {
        "LSM6DSL CTRL3_C": 0x4C,  # SIM
        "LSM6DSL CTRL4_C": 0x04,  # I2C_disable
        "LPS22HB CTRL_REG1": 0x33,  # SIM
        "LPS22HB CTRL_REG2": 0x08,  # I2C_DIS, no IF_ADD_INC
    }
