"""Labs with other lines, conditions and thresholds than LAB3: the findings of their runs."""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from pathlib import Path

import pytest

from fcu_emulator import Board
from fcu_emulator.emulator.scenario import Result, run
from fcu_emulator.firmware_model import LabFirmware
from fcu_emulator.firmware_model.hal import PRINTF, Hal
from tests.support.scenario_files import HEAD, refusal, write

IDEAL = f'{HEAD}[sensors]\nquality = "ideal"\n'
THRESHOLD = '[[threshold]]\nquantity = "roll"\nvalue = 45\nmargin = 1\n'
TURN = '[[timeline]]\ndo = "turn_over"\nfor = "1s"\n'
ALARM = (
    '[[expect]]\nkind = "line_follows"\ntext = "ALARM"\nmax_gap = "1.1s"\n'
    'when = { quantity = "roll", beyond = 45, margin = 0.5 }\n'
)
LED = (
    '[[expect]]\nkind = "led_follows"\nled = "led1"\n'
    'when = { quantity = "roll", beyond = 45, margin = 0.5 }\n'
)
LED_LINE = ALARM.replace('quantity = "roll", beyond = 45, margin = 0.5', 'led = "led1"')


class Tilt(LabFirmware):
    """A program that knows pitch and roll. A test determines ``lit`` and ``said``."""

    lit: Callable[[Tilt], bool] = staticmethod(lambda program: abs(program.roll) > 45)
    said: Callable[[Tilt], str] = staticmethod(lambda program: "ALARM" * (abs(program.roll) > 45))
    every_ms = 500
    prints = 0

    def HAL_TIM_PeriodElapsedCallback(self) -> None:
        """Update the angles and the LED."""
        self.ReadSensorRawData()
        x, y, z = self.acc.AXIS_X, self.acc.AXIS_Y, self.acc.AXIS_Z
        self.roll = math.degrees(math.atan2(y, math.hypot(x, z)))
        self.pitch = math.degrees(math.atan2(-x, math.hypot(y, z)))
        self.led1.switch(self.lit(self))

    def loop(self) -> None:
        """Print the text of ``said``."""
        text = self.said(self)
        if text:
            self.prints += 1
            PRINTF(self.hal, f"{text.replace('%', '%%')}\n\r")
        self.hal.HAL_Delay(self.every_ms)


def program(**changes: object) -> Callable[[Hal], LabFirmware]:
    """Return the correct program with changes."""
    changed = {name: staticmethod(one) if callable(one) else one for name, one in changes.items()}
    return type("Changed", (Tilt,), changed)


def played(folder: Path, text: str, firmware: Callable[[Hal], LabFirmware]) -> Result:
    return run(Board(firmware, scenario=write(folder, text)))


def faults(result: Result) -> list[tuple[str, str]]:
    return [(one.key, one.reason) for one in result.findings]


def test_correct_program_meets_conditions_with_every_seed(tmp_path: Path) -> None:
    for seed in range(3):
        text = IDEAL.replace("schema = 1", f"schema = 1\nseed = {seed}") + THRESHOLD + ALARM + LED + LED_LINE
        result = played(tmp_path, text, program())
        assert result.passed, result.lines


WRONG = {
    "threshold 40": (lambda one: abs(one.roll) > 40, ["threshold", "threshold"]),
    "threshold 48": (lambda one: abs(one.roll) > 48, ["threshold", "threshold"]),
    "positive side": (lambda one: one.roll > 45, ["one side", "one side"]),
    "negative side": (lambda one: one.roll < -45, ["one side", "one side"]),
    "pitch": (lambda one: abs(one.pitch) > 45, ["other axis", "other axis"]),
    "inverted": (lambda one: abs(one.roll) <= 45, ["inverted", "inverted"]),
    "always": (lambda one: True, ["wrong value", "never dark"]),
    "never": (lambda one: False, ["missing", "never lit"]),
}


@pytest.mark.parametrize("name", WRONG)
def test_wrong_condition_is_found_at_threshold(tmp_path: Path, name: str) -> None:
    condition, expected = WRONG[name]
    wrong = program(lit=condition, said=lambda one: "ALARM" * condition(one))
    line, led = faults(played(tmp_path, IDEAL + THRESHOLD + ALARM + LED, wrong))

    assert [line, led] == [("expect[0]", expected[0]), ("expect[1]", expected[1])]


@pytest.mark.parametrize("text", ["ALARM!", "alarm", "Alarm on"])
def test_nearly_correct_line_has_wrong_format(tmp_path: Path, text: str) -> None:
    nearly = program(said=lambda one: text * (abs(one.roll) > 45))

    assert faults(played(tmp_path, IDEAL + THRESHOLD + ALARM, nearly)) == [("expect[0]", "wrong format")]


PASSING = '[[timeline]]\ndo = "rotate_to"\nroll_deg = 60\nat = "2s"\nfor = "1s"\n'


def test_findings_show_angle_at_their_time(tmp_path: Path) -> None:
    """With the threshold 40, the program is in a motion from 0 to 60 degrees."""
    low = program(
        lit=lambda one: abs(one.roll) > 40, said=lambda one: "ALARM" * (abs(one.roll) > 40), every_ms=3
    )
    text = IDEAL.replace("schema = 1", 'schema = 1\nduration = "5s"') + PASSING + ALARM + LED
    findings = played(tmp_path, text, low).findings

    assert len(findings) == 2
    for finding in findings:
        at_s, roll = map(float, re.findall(r"at ([0-9.]+) s with a true roll of ([0-9.]+)", finding.seen)[0])
        share = at_s - 2  # of a turn with minimum jerk
        true = 60 * (10 * share**3 - 15 * share**4 + 6 * share**5)
        assert roll == pytest.approx(true, abs=0.15)


def test_wrong_threshold_is_reported_if_it_is_proven(tmp_path: Path) -> None:
    """A motion from 0 to 60 degrees proves that the threshold 30 is wrong: the finding has a range around 30."""
    text = IDEAL.replace("schema = 1", 'schema = 1\nduration = "5s"') + PASSING + LED
    (wrong,) = played(tmp_path, text, program(lit=lambda one: abs(one.roll) > 30)).findings
    low, high = map(float, re.findall(r"between ([0-9.]+) and ([0-9.]+)", wrong.seen)[0])

    assert wrong.reason == "threshold"
    assert low <= 30 <= high < 45


FALLING = (
    "[world]\npressure_hpa = 980\n"
    '[[timeline]]\ndo = "change_pressure"\nchange_hpa = -26\nat = "2s"\nfor = "1s"\n'
    '[[timeline]]\ndo = "change_pressure"\nchange_hpa = -8\nat = "6s"\nfor = "1s"\n'
    '[[timeline]]\ndo = "change_pressure"\nchange_hpa = -8\nat = "10s"\nfor = "1s"\n'
)
LOW = 'when = { quantity = "Pre", below = 950, margin = 0.5 }\n'


@pytest.mark.parametrize(
    ("limit", "found"), [(950, []), (960, ["threshold", "threshold"]), (942, ["threshold", "threshold"])]
)
def test_wrong_threshold_of_below_condition_is_found(tmp_path: Path, limit: int, found: list[str]) -> None:
    text = IDEAL.replace("schema = 1", 'schema = 1\nduration = "14s"') + FALLING
    text += f'[[expect]]\nkind = "led_follows"\nled = "led1"\n{LOW}'
    text += f'[[expect]]\nkind = "line_follows"\ntext = "ALARM"\nmax_gap = "1.1s"\n{LOW}'
    low = program(lit=lambda one: one.press < limit, said=lambda one: "ALARM" * (one.press < limit))

    assert [one.reason for one in played(tmp_path, text, low).findings] == found


@pytest.mark.parametrize(("limit", "found"), [(40, {"led_follows"}), (50, set()), (59, set())])
def test_motion_through_threshold_reveals_only_early_led(tmp_path: Path, limit: int, found: set[str]) -> None:
    text = IDEAL.replace("schema = 1", 'schema = 1\nduration = "5s"') + PASSING + ALARM + LED
    wrong = program(lit=lambda one: abs(one.roll) > limit, said=lambda one: "ALARM" * (abs(one.roll) > limit))

    assert {one.kind for one in played(tmp_path, text, wrong).findings} == found


def test_unrepeated_line_is_reported_as_missing(tmp_path: Path) -> None:
    once = program(said=lambda one: "ALARM" * (abs(one.roll) > 45 and one.prints == 0))

    assert faults(played(tmp_path, IDEAL + THRESHOLD + ALARM, once)) == [("expect[0]", "missing")]


def test_line_not_following_led_is_found(tmp_path: Path) -> None:
    dark = program(lit=lambda _: False)

    assert faults(played(tmp_path, IDEAL + THRESHOLD + LED_LINE, dark)) == [("expect[0]", "wrong value")]


@pytest.mark.parametrize(
    ("condition", "holds"),
    [('quantity = "Altitude", above = 3', True), ('quantity = "Altitude", below = 3', False)],
)
def test_line_condition_may_use_any_quantity(tmp_path: Path, condition: str, holds: bool) -> None:
    moved = IDEAL + '[[threshold]]\nquantity = "Altitude"\nvalue = 3\nmargin = 1\n'
    line = '[[expect]]\nkind = "line_follows"\npattern = "^HIGH"\nmax_gap = "2s"\n'
    line += f"when = {{ {condition} }}\n"
    text = moved + line.replace("3 }", "3, margin = 0.9 }")
    above = program(said=lambda one: "HIGH!" * (one.press_zero_level - one.press > 0.35))

    assert played(tmp_path, text, above).passed is holds


# -- Thresholds ---------------------------------------------------------------------------------------------


def test_threshold_gives_positions_on_both_sides_and_signs(tmp_path: Path) -> None:
    board = Board(program(), scenario=write(tmp_path, IDEAL + THRESHOLD), seed=3)
    board.run_for(1)
    assert board.scenario is not None
    rests = {(step.entry.roll_deg, step.entry.pitch_deg) for step in board.scenario.steps}

    assert rests == {(46.0, 0), (44.0, 0), (-46.0, 0), (-44.0, 0), (55.0, 0), (0, 46.0)}
    assert board.scenario.duration_s == 2 + 6 * 3.5


def test_seed_determines_order_of_positions(tmp_path: Path) -> None:
    def order(seed: int) -> tuple[float, ...]:
        scenario = Board(program(), scenario=write(tmp_path, IDEAL + THRESHOLD), seed=seed).scenario
        assert scenario is not None
        return tuple(step.entry.roll_deg for step in scenario.steps)

    assert order(1) == order(1)
    assert len({order(seed) for seed in range(8)}) > 3


def test_threshold_may_be_random(tmp_path: Path) -> None:
    text = IDEAL + THRESHOLD.replace("margin = 1", "margin = { uniform = [0.6, 2] }") + ALARM
    assert played(tmp_path, text, program()).passed


@pytest.mark.parametrize(
    ("old", "new", "key"),
    [
        ("margin = 1", "margin = 45", "threshold[0]"),
        ("margin = 1", "margin = 0", "threshold[0].margin"),
        ("value = 45", "value = 89.5", "threshold[0]"),
        ('"roll"', '"Roll"', "threshold[0].quantity"),
        ("margin = 1", f"margin = 1\nat = '20s'\n{THRESHOLD}at = '21s'", "threshold[0]"),
        ("margin = 1", f"margin = 1\nat = '8s'\n{TURN}at = '11s'", "threshold[0]"),
        ("margin = 1", f"margin = 1\nat = '8s'\n{TURN}at = '10s'", "threshold[0]"),
    ],
)
def test_unreachable_threshold_is_refused(tmp_path: Path, old: str, new: str, key: str) -> None:
    assert refusal(tmp_path, IDEAL + THRESHOLD.replace(old, new)).key == key


def test_run_that_ends_before_its_thresholds_is_refused(tmp_path: Path) -> None:
    short = IDEAL.replace("schema = 1", 'schema = 1\nduration = "5s"')
    assert refusal(tmp_path, short + THRESHOLD).key == "threshold[0]"


# -- Numbers in a format of the teacher's choice ------------------------------------------------------------


def number(format_key: str, rest: str = 'truth = "roll", scale = 100, tolerance = 60') -> str:
    head = f'{HEAD}world = {{ roll_deg = 30 }}\nduration = "3s"\n'
    return f'{head}expect = [{{ kind = "field", {format_key}, {rest} }}]\nsensors = {{ quality = "ideal" }}\n'


@pytest.mark.parametrize(
    ("line", "format_key", "kind"),
    [
        (lambda one: f"tilt={one.roll * 100:.0f} cdeg", 'format = "tilt=%d cdeg"', None),
        (lambda one: f"tilt={one.roll * 100:.0f} cdeg", 'format = " tilt=%d cdeg \\n\\r"', None),
        (lambda one: f"tilt={one.roll * -100:.0f} cdeg", 'format = "tilt=%d cdeg"', "wrong value"),
        (lambda one: f"tilt={one.roll:.2f} deg", 'format = "tilt=%d cdeg"', "wrong format"),
        (lambda one: f"Tilt: {one.roll * 100:.0f}", 'format = "tilt=%d cdeg"', "wrong format"),
        (lambda one: "hello", 'format = "tilt=%d cdeg"', "missing"),
        (lambda one: f"{one.pitch:.1f} {one.roll * 100:7.1f}%", 'format = "%.1f %7.1f%%", number = 2', None),
        (lambda one: f"at 7: {one.roll * 100:.0f}", 'pattern = "at [0-9]+: (?P<number>-?[0-9]+)"', None),
        (lambda one: f"at 7: {one.pitch * 100:.0f}", 'pattern = ": (?P<number>-?[0-9]+)"', "wrong value"),
        (lambda one: f"0x{round(one.roll * 100):04X}", 'format = "0x%04X"', None),
        (lambda one: f"{one.roll * 100:e} %", 'format = "%e %%"', None),
        (lambda one: f"r {one.roll * 100:+.0f}", 'format = "r %+d"', None),
    ],
)  # fmt: skip
def test_number_in_custom_format_is_compared_with_truth(
    tmp_path: Path, line: Callable[[Tilt], str], format_key: str, kind: str | None
) -> None:
    result = played(tmp_path, number(format_key), program(said=line))
    late = [one for one in result.findings if one.reason]

    assert [one.reason for one in late] == ([kind] if kind else []), result.lines


@pytest.mark.parametrize("kind", ["printed", "within"])
def test_custom_format_works_for_every_number_expectation(tmp_path: Path, kind: str) -> None:
    keys = {
        "printed": 'max_gap = "1.2s", from = "1.5s"',
        "within": "min = 2900, max = 3100, from = '1.5s'",
    }
    text = number('format = "tilt=%d"', keys[kind]).replace('"field"', f'"{kind}"')

    good = played(tmp_path, text, program(said=lambda one: f"tilt={one.roll * 100:.0f}"))
    bad = played(tmp_path, text, program(said=lambda one: "x" * (one.prints < 2)))
    assert (good.lines, faults(bad)) == (["1 of 1 expectations met"], [("expect[0]", "missing")])


@pytest.mark.parametrize(
    ("format_key", "rest"),
    [
        ('format = "tilt"', "value = 1, tolerance = 1"),
        ('format = "tilt=%d"', "truth = true, tolerance = 1"),
        ('format = "tilt=%d"', 'truth = "rol", tolerance = 1'),
        ('format = "tilt=%d", number = 2', "value = 1, tolerance = 1"),
        ('format = "tilt=%q"', "value = 1, tolerance = 1"),
        ('format = "tilt=%999999999d"', "value = 1, tolerance = 1"),
        ('format = "tilt=%.999999999f"', "value = 1, tolerance = 1"),
        ('format = "tilt=%d", name = "Pitch"', "value = 1, tolerance = 1"),
        ('pattern = "tilt=(-?[0-9]+)"', "value = 1, tolerance = 1"),
        ('format = "tilt=%d"', 'truth = "roll", scale = 0, tolerance = 1'),
        ('format = "50%"', "value = 1, tolerance = 1"),
    ],
)
def test_format_without_usable_number_is_refused(tmp_path: Path, format_key: str, rest: str) -> None:
    assert refusal(tmp_path, number(format_key, rest)).key.startswith("expect[0]")


@pytest.mark.parametrize(
    "condition",
    [
        'quantity = "roll"',
        'quantity = "rol", beyond = 3',
        'quantity = "roll", beyond = 3, above = 3',
        'quantity = "roll", beyond = -3',
        'led = "led3"',
        'led = "led1", above = 3',
        'quantity = "roll", beyond = 3, led = "led1"',
    ],
)
def test_empty_condition_is_refused(tmp_path: Path, condition: str) -> None:
    line = f'[[expect]]\nkind = "line_follows"\ntext = "A"\nmax_gap = "1s"\nwhen = {{ {condition} }}\n'
    assert refusal(tmp_path, HEAD + line).key.startswith("expect[0].when")
