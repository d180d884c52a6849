"""Names of the previous release: each works with a warning, and is in the table of docs/renamed.md."""

from __future__ import annotations

import json
import re
from pathlib import Path
from types import ModuleType

import click
import pytest
import serial

import fcu_emulator
import fcu_emulator.emulator.adapters.protocol_fcu
import fcu_emulator.sensors.part
from fcu_emulator import Board, sensors
from fcu_emulator.emulator.boards import description
from fcu_emulator.emulator.cli import execute
from fcu_emulator.emulator.cli.commands import cli
from fcu_emulator.emulator.cli.declare import Command
from fcu_emulator.emulator.live.gestures import OLD_WORDS
from fcu_emulator.emulator.renamed import RenamedWarning
from fcu_emulator.emulator.scenario import load_scenario
from fcu_emulator.emulator.world.world import World
from fcu_emulator.sensors.lis2mdl import LIS2MDLErrors

PAGE = Path(__file__).parents[2] / "docs" / "renamed.md"
TEXT = PAGE.read_text(encoding="utf-8")
ROWS = re.findall(r"^\| `([^`]+)` \| `([^`]+)` \| (.+) \|$", TEXT, re.MULTILINE)
LINES = {
    "--notes": "run template --duration 1100ms --speed max --notes",
    "--timing": "diff template template --scenario desk --duration 1100ms --timing=5ms",
    "--profile": "run template --duration 1100ms --speed max --profile lab3",
    "--take": "grade nowhere --rubric lab3 --out out --take firmware",
}


def renamed_options() -> set[tuple[str, str, str]]:
    return {
        (old, new, f"`fcu {name}`")
        for name, command in cli.commands.items()
        if isinstance(command, Command)
        for old, new in command.renamed_options().items()
    }


def test_table_lists_each_renamed_option_and_gesture() -> None:
    moves = {(old, new, "`fcu move`") for old, new in OLD_WORDS.items()}

    assert set(ROWS) >= renamed_options() | moves
    assert {row for row in ROWS if row[0].startswith("--")} == renamed_options()


@pytest.mark.parametrize(("old", "new", "_where"), [row for row in ROWS if row[0].startswith("--")])
def test_old_option_works_like_new_one(
    old: str, new: str, _where: str, capsys: pytest.CaptureFixture[str]
) -> None:
    line = LINES[old].split()
    codes, outputs, errors = [], [], []
    for words in (line, [re.sub(f"^{old}", new, word) for word in line]):
        codes.append(execute(words))
        printed = capsys.readouterr()
        outputs.append(printed.out)
        errors.append(printed.err.splitlines())

    assert codes[0] == codes[1]
    assert outputs[0] == outputs[1]
    (warning,) = [one for one in errors[0] if old in one]
    assert new in warning
    assert not [one for one in errors[1] if old in one]


def test_words_after_two_dashes_are_not_options() -> None:
    seen: list[str] = []

    @click.command(cls=Command)
    @click.argument("words", nargs=-1)
    def command(words: tuple[str, ...]) -> None:
        seen.extend(words)

    command.main(["--", "--notes"], standalone_mode=False)

    assert seen == ["--notes"]


SCENARIO = """
schema = 1
question = "?"
duration = "2s"
{uptime} = "10s"

[world]
pitch_deg = {{ {uniform} = [20, 30], {random_sign} = true }}

[sensors]
{quality} = "typical"

[[timeline]]
do = "{change_pressure}"
change_hpa = -1
for = "1s"

[[timeline]]
do = "{blow_wind}"
speed_m_s = 3
for = "1s"

[[timeline]]
do = "{slam_door}"

[[timeline]]
do = "{inject_fault}"
kind = "nack"
for = "5ms"

[[expect]]
kind = "within"
name = "Pitch"
{min} = 10
{max} = 20
{min_difference} = 1

[[expect]]
kind = "printed"
name = "Pitch"
{max_gap} = "1.5s"

[[expect]]
kind = "line_follows"
text = "ALARM"
{max_gap} = "1.5s"
when = {{ quantity = "Roll", beyond = 45 }}

[[expect]]
kind = "reads"
sensor = "accelerometer"
{min_hz} = 760
{max_hz} = 840
"""
OLD_KEYS = {
    old: new
    for names, new_names, where in re.findall(
        r"^\| (`[^|]+) \| (`[^|]+) \| ([^`|]*(?:`[^|]*)?) \|$", TEXT, re.MULTILINE
    )
    if not where.startswith(("`fcu", "Python", "check"))
    for old, new in zip(re.findall("`([^`]+)`", names), re.findall("`([^`]+)`", new_names), strict=True)
}


def scenario(folder: Path, keys: dict[str, str]) -> Path:
    path = folder / "renamed.toml"
    path.write_text(SCENARIO.format(**{new: new for new in OLD_KEYS.values()} | keys), encoding="utf-8")
    return path


@pytest.mark.parametrize(("old", "new"), OLD_KEYS.items())
def test_old_key_works_like_new_one(old: str, new: str, tmp_path: Path) -> None:
    current = load_scenario(scenario(tmp_path, {}))
    with pytest.warns(RenamedWarning) as warned:
        former = load_scenario(scenario(tmp_path, {new: old}))

    assert former.contents == current.contents
    assert {str(one.message) for one in warned} == {f"{old} is now called {new}; use that name"}


def test_old_names_of_board_warn() -> None:
    with pytest.warns(DeprecationWarning, match="^profile is now called wiring;"):
        board = Board("solution", profile="fcu001v1")  # the previous name of wiring
    with pytest.warns(DeprecationWarning, match="^arm is now called chip;"):
        chip = board.arm

    assert board.booted.wiring.name == "fcu001v1"
    assert chip is board.chip


def test_old_option_of_address_warns() -> None:
    with pytest.warns(RenamedWarning), serial.serial_for_url("fcu://solution?profile=fcu001v1") as port:
        assert port.is_open


def test_record_of_run_has_old_and_new_names(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "run.json"
    execute(["run", "template", "--duration", "100ms", "--speed", "max", "--json", str(file)])
    capsys.readouterr()
    board = json.loads(file.read_text(encoding="utf-8"))["board"]

    assert board["profile"] == board["wiring"] == "lab3"


@pytest.mark.parametrize("name", ["Miss", "Failure", "Finding"])
def test_old_name_of_result_warns(name: str) -> None:
    with pytest.warns(DeprecationWarning, match="ExpectationResult"):
        old = getattr(fcu_emulator, name)

    assert old is fcu_emulator.ExpectationResult


def test_old_attribute_miss_warns() -> None:
    finding = fcu_emulator.ExpectationResult("a line", "missing")
    with pytest.warns(DeprecationWarning, match="leave out"):
        miss = finding.miss

    assert miss is finding


@pytest.mark.parametrize(
    ("old", "new"),
    [("change_weather", "change_pressure"), ("blow", "blow_wind"), ("shut_door", "slam_door")],
)
def test_old_method_of_world_warns(old: str, new: str) -> None:
    world = World()
    with pytest.warns(DeprecationWarning, match=new):
        method = getattr(world, old)

    assert method == getattr(world, new)
    assert f"world.{old}" in dict(row[:2] for row in ROWS)


def test_old_name_of_quality_warns() -> None:
    with pytest.warns(DeprecationWarning, match="of_quality"):
        old = LIS2MDLErrors.of_grade("typical", 1)

    assert old == LIS2MDLErrors.of_quality("typical", 1)


@pytest.mark.parametrize(
    ("module", "old", "new"),
    [
        (sensors, "Part", "Sensor"),
        (sensors, "PARTS", "SENSORS"),
        (sensors.part, "Part", "Sensor"),
        (description, "MountedPart", "MountedSensor"),
    ],
)
def test_old_name_of_sensor_warns(module: ModuleType, old: str, new: str) -> None:
    with pytest.warns(DeprecationWarning, match=new):
        former = getattr(module, old)

    assert former is getattr(module, new)


def test_old_path_of_strategies_warns() -> None:
    from fcu_emulator.emulator import strategies as old
    from fcu_emulator.emulator.testing import strategies as new

    with pytest.warns(DeprecationWarning, match="testing"):
        motions = old.motions

    assert motions is new.motions
