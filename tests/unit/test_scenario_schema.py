"""The schema: agreement with its description, JSON schema, and conversion in both directions."""

from __future__ import annotations

import dataclasses
import json
import tomllib
from importlib.resources import files
from pathlib import Path
from typing import Any

import jsonschema
import pytest

from fcu_emulator import InputError
from fcu_emulator.emulator.boards.fcu001v1 import FCU001V1
from fcu_emulator.emulator.scenario import json_schema, load_scenario, scenario_names
from fcu_emulator.emulator.scenario.fields import Resources
from fcu_emulator.emulator.scenario.run_view import FIELDS, MOVING_G, TRUTH
from fcu_emulator.emulator.scenario.schema import FirmwareTable, scenario_file
from fcu_emulator.firmware_model import Settings
from fcu_emulator.sensors.lis2mdl import LIS2MDLErrors
from fcu_emulator.sensors.lps22hb import LPS22HBErrors
from fcu_emulator.sensors.lsm6dsl import LSM6DSLErrors
from tests.support.scenario_files import HEAD, write

SHIPPED = Path(str(files("fcu_emulator.scenarios")))
NAMES = sorted(path.stem for path in SHIPPED.glob("*.toml"))
EVERYTHING = """
schema = 1
question = "Is every table taken?"
firmware = "lab3"
seed = 7
duration = "60s"
[firmware_settings]
mu = 0.5
led1_axis = "roll"
[bus]
speed = "100kHz"
[world]
yaw_deg = 10
temperature_degc = 20
floor_altitude_m = 500
field = { north_ut = 20, east_ut = 1, down_ut = 40 }
hard_iron_mgauss = [1, 2.5, 3]
soft_iron = [[1, 0, 0], [0, 1.1, 0], [0, 0, 1]]
gravity = 9.8
[sensors]
quality = "worst"
magnetometer_mounting = "left_handed"
[sensors.lsm6dsl]
acc_bias_mg = [1, 2, 3]
gyro_noise_mdps_rthz = 4.5
[[timeline]]
do = "hold"
for = "1s"
[[timeline]]
do = "rotate_to"
yaw_deg = 30
for = "1s"
[[timeline]]
do = "sweep"
axis = "yaw"
to_deg = 0
for = "500ms"
[[timeline]]
do = "figure_eight"
for = "5s"
[[timeline]]
do = "lift"
metres = 20
for = "5s"
[[timeline]]
do = "free_fall"
for = "1s"
[[timeline]]
do = "shake"
axis = "north"
amplitude_g = 0.1
frequency_hz = 10
for = "1s"
[[timeline]]
do = "disturb_field"
field = { north_ut = 20, east_ut = 1, down_ut = 40 }
for = "1s"
[[timeline]]
do = "pass_magnet"
moment_am2 = 1
distance_m = 0.2
speed_m_s = 1
[[timeline]]
do = "replay"
csv = "walk.csv"
[[timeline]]
do = "set_attitude"
roll_deg = 3
[[timeline]]
do = "follow_attitude"
pitch_deg = 30
time_constant = "200ms"
[[timeline]]
do = "follow_altitude"
metres = 1
[[timeline]]
do = "follow_magnet"
north_m = 0.1
moment_am2 = -1
[[timeline]]
do = "take_magnet_away"
[[timeline]]
do = "turn_over"
for = "1s"
interrupts = true
[[timeline]]
do = "tap"
axis = "up"
[[timeline]]
do = "set_pressure"
pressure_hpa = 950
[[timeline]]
do = "set_humidity"
humidity_percent = 80
[[timeline]]
do = "set_temperature"
temperature_degc = 30
[[timeline]]
do = "set_field"
field = { north_ut = 20, east_ut = 1, down_ut = 40 }
[[timeline]]
do = "inject_fault"
kind = "nack"
address = "LIS2MDL"
byte_index = 2
for = "1s"
[[timeline]]
do = "inject_fault"
kind = "stuck"
[[timeline]]
do = "send"
text = "p"
[[timeline]]
do = "send"
hex = "0d 0a"
[[expect]]
kind = "line"
text = "LAB3 Init..."
count = 1
[[expect]]
kind = "regex"
pattern = "^Pre: "
from = "1s"
[[expect]]
kind = "never"
pattern = "nan"
[[expect]]
kind = "field"
name = "Yaw"
truth = true
tolerance = 5
settle = "100ms"
[[expect]]
kind = "led"
led = "led1"
state = "off"
to = "3s"
[[expect]]
kind = "ticks"
rate_hz = 800
[[expect]]
kind = "hard_iron"
within_mgauss = 5
[[expect]]
kind = "text"
file = "golden.txt"
[[report]]
field = "Yaw"
against = "truth"
[limits]
duration = "2min"
wall = "30s"
"""


def validate(table: dict[str, Any]) -> None:
    """Validate with an independent library; dates are text in JSON."""
    schema = json_schema()
    jsonschema.Draft202012Validator.check_schema(schema)
    jsonschema.validate(json.loads(json.dumps(table, default=str)), schema)


@pytest.mark.parametrize("name", NAMES)
def test_json_schema_accepts_shipped_files(name: str) -> None:
    validate(tomllib.loads((SHIPPED / f"{name}.toml").read_text(encoding="utf-8")))


def test_json_schema_accepts_every_table() -> None:
    validate(tomllib.loads(EVERYTHING))


@pytest.mark.parametrize(
    "wrong",
    [
        "duraton = '1s'",
        "duration = 1",
        "duration = '1 minute'",
        "[world]\nroll = 1",
        "[sensors.lsm6dsl]\nacc_bias = [0, 0, 0]",
        "[[timeline]]\ndo = 'dance'",
        "[[expect]]\nkind = 'field'\nname = 'Jaw'\nvalue = 1\ntolerance = 1",
    ],
)
def test_json_schema_refuses_what_loader_refuses(tmp_path: Path, wrong: str) -> None:
    with pytest.raises(jsonschema.ValidationError):
        validate(tomllib.loads(HEAD + wrong))
    with pytest.raises(InputError):
        load_scenario(write(tmp_path, HEAD + wrong))


def test_file_with_every_key_survives_round_trip(tmp_path: Path) -> None:
    (tmp_path / "walk.csv").write_text("t_s,roll_deg,pitch_deg,yaw_deg\n0,0,0,0\n2,10,0,0\n")
    (tmp_path / "golden.txt").write_bytes(b"text\n\r")
    context = {"resources": Resources(tmp_path)}
    first = scenario_file(FCU001V1).model_validate(tomllib.loads(EVERYTHING), context=context)
    dumped = first.model_dump(by_alias=True, exclude_none=True)
    assert dumped["timeline"][0] == {"do": "hold", "for": "1s", "interrupts": False}
    assert dumped["sensors"]["lsm6dsl"] == {"acc_bias_mg": (1, 2, 3), "gyro_noise_mdps_rthz": 4.5}
    again = scenario_file(FCU001V1).model_validate(dumped, context=context)
    assert again.model_dump(by_alias=True, exclude_none=True) == dumped
    load_scenario(write(tmp_path, EVERYTHING))  # and it can be played


def test_schema_settings_equal_firmware() -> None:
    settings = {field.name: field.default for field in dataclasses.fields(Settings)}
    assert {name: field.default for name, field in FirmwareTable.model_fields.items()} == settings


@pytest.mark.parametrize(
    ("part", "errors"),
    [("lsm6dsl", LSM6DSLErrors), ("lis2mdl", LIS2MDLErrors), ("lps22hb", LPS22HBErrors)],
)
def test_every_figure_of_sensor_can_be_set(tmp_path: Path, part: str, errors: type[Any]) -> None:
    values = {
        field.name: [1.0, 2.0, 3.0] if isinstance(field.default, tuple) else 0.5
        for field in dataclasses.fields(errors)
    }
    lines = "".join(f"{name} = {value}\n" for name, value in values.items())
    settings = load_scenario(write(tmp_path, f"{HEAD}[sensors.{part}]\n{lines}")).sensor_settings()
    given = {name: tuple(value) if isinstance(value, list) else value for name, value in values.items()}
    assert settings.figures[part] == given


def test_every_printed_field_has_truth() -> None:
    assert set(TRUTH) == {*FIELDS, MOVING_G}


def test_shipped_scenarios_are_listed_with_their_questions() -> None:
    names = scenario_names()
    assert list(names) == NAMES
    assert all(question.endswith("?") for question in names.values())


@pytest.mark.parametrize("name", NAMES)
def test_shipped_file_begins_with_question(name: str) -> None:
    first = (SHIPPED / f"{name}.toml").read_text(encoding="utf-8").splitlines()[0]
    assert first.startswith("# ")
    assert first.endswith("?")


def test_schema_defaults_are_in_file_notation() -> None:
    """The loader must accept the text that an editor inserts."""
    bus = json_schema()["$defs"]["BusTable"]["properties"]["speed"]
    assert bus["default"] == "400kHz"
    limits = json_schema()["$defs"]["LimitsTable"]["properties"]
    assert all(isinstance(limits[name]["default"], str) for name in ("duration", "wall"))


def test_schema_describes_sensor_figures() -> None:
    keys = json_schema()["$defs"]["LPS22HBErrors"]["properties"]
    meaning = "offset before calibration, hPa; +-1 (typ.) (datasheet Table 3)"

    assert keys["pressure_bias_hpa"]["description"] == meaning
