"""Comparison of two runs: equal results, and the differences of real firmwares."""

from __future__ import annotations

import pytest

from fcu_emulator import Board, InputError, NotJudgedError
from fcu_emulator.emulator.analysis import observation
from fcu_emulator.emulator.analysis.compare import (
    Ignorable,
    Rules,
    compare,
    compared,
    largest_deviations,
    tolerances,
)
from fcu_emulator.emulator.analysis.observation import END, TERMINAL, Observation, ObservedItem, observe
from fcu_emulator.emulator.assembly.firmware import FirmwareFactory, Settings, python_firmware
from fcu_emulator.emulator.clock import PS_PER_MS, PS_PER_S
from fcu_emulator.emulator.python_cpu.hal import VirtualHal
from fcu_emulator.emulator.scenario import load_scenario, scenario_names
from fcu_emulator.emulator.scenario.run_view import FIELDS
from fcu_emulator.firmware_model.hal import HAL_OK
from tests.integration.test_cli import fcu, one_line_error
from tests.support.board_fakes import script
from tests.support.words import Words

END_PS = 10 * PS_PER_S
SHORT_PS = 3 * PS_PER_S  # boot takes 1 s: two blocks are printed


def run(*texts: str, sequence: str = TERMINAL, every_ps: int = PS_PER_S, end_ps: int = END_PS) -> Observation:
    """Return a run that did one action each second from 1 s on."""
    return Observation(
        end_ps,
        {sequence: [ObservedItem(number * every_ps, text) for number, text in enumerate(texts, start=1)]},
    )


def observed(
    scenario: str,
    firmware: str | FirmwareFactory = "lab3",
    end_ps: int = SHORT_PS,
    seed: int = 0,
) -> Observation:
    return observe(Board(firmware=firmware, scenario=scenario, seed=seed), end_ps)


def changed(**settings: float | str) -> FirmwareFactory:
    chosen: Settings = settings
    return python_firmware("lab3", chosen)


# -- what counts as the same --------------------------------------------------------------------------------


def test_sign_of_zero_is_not_reported_as_difference() -> None:
    assert compare(run("Pitch: -0.000000 deg\n"), run("Pitch: 0.000000 deg\n")) == []
    assert compare(run("Pitch: -0.000001 deg\n"), run("Pitch: 0.000001 deg\n")) != []
    assert compare(run("a -0 b\n"), run("a 0 b\n")) == []
    assert compare(run("a -0.5 b\n"), run("a 0.5 b\n")) != []


def test_inserted_line_is_one_difference() -> None:
    short = [f"line {n}\n" for n in range(6)]
    (difference,) = compare(run(*short), run(*short[:2], "hello\n", *short[2:]))

    assert difference.inserted
    assert difference.index == 2
    assert difference.first is None
    assert difference.second is not None
    assert difference.second.text == "hello\n"

    (difference,) = compare(run(*short), run(*short[:2], *short[3:]))
    assert difference.inserted
    assert difference.first is not None
    assert difference.first.text == "line 2\n"


def test_replaced_line_is_not_reported_as_inserted() -> None:
    (difference,) = compare(run("a\n", "b\n", "c\n", "d\n"), run("a\n", "x\n", "c\n", "d\n"))

    assert not difference.inserted
    assert difference.first is not None
    assert difference.second is not None


def test_timer_at_another_rate_is_difference() -> None:
    slower = changed(timer_prescaler=51, timer_period=1999)  # 807.7 Hz
    (difference,) = [
        one for one in compare(observed("flat"), observed("flat", slower)) if one.sequence == "timer"
    ]

    assert difference.first is not None
    assert difference.second is not None
    assert (difference.first.text, difference.second.text) == ("TIM9 at 800.000 Hz", "TIM9 at 807.692 Hz")


def test_lost_ticks_are_difference() -> None:
    def timed(ticks: int, lost: int) -> Observation:
        entries = [ObservedItem(0, "TIM9 at 800.000 Hz"), ObservedItem(END_PS, f"{ticks} ticks, {lost} lost")]
        return Observation(END_PS, {"timer": entries})

    assert compare(timed(7_200, 0), timed(7_150, 3)) == []
    assert compare(timed(7_200, 0), timed(7_200, 3_600)) != []
    assert compare(timed(7_200, 0), timed(3_600, 0)) != []


def test_first_difference_is_earliest_of_all_sequences() -> None:
    first = Observation(
        END_PS,
        {
            TERMINAL: [ObservedItem(3 * PS_PER_S, "a\n")],
            "LED1": [ObservedItem(2 * PS_PER_S, "on")],
            "LED2": [],
        },
    )
    second = Observation(
        END_PS,
        {
            TERMINAL: [ObservedItem(3 * PS_PER_S, "b\n")],
            "LED1": [ObservedItem(2 * PS_PER_S, "off")],
            "LED2": [],
        },
    )

    assert [difference.sequence for difference in compare(first, second)] == ["LED1", TERMINAL]


def test_difference_has_place_both_values_and_context() -> None:
    (difference,) = compare(run("a\n", "b\n", "c\n"), run("a\n", "b\n", "d\n"))

    assert (difference.sequence, difference.index, difference.at_ps) == (TERMINAL, 2, 3 * PS_PER_S)
    assert difference.first == ObservedItem(3 * PS_PER_S, "c\n")
    assert difference.second == ObservedItem(3 * PS_PER_S, "d\n")
    assert [one.text for one, _ in difference.before] == ["a\n", "b\n"]
    assert not difference.only_time


def test_timing_within_tolerance_is_not_difference() -> None:
    on_time, late = run("a\n"), run("a\n", every_ps=PS_PER_S + 30 * PS_PER_MS)

    (difference,) = compare(on_time, late)
    assert difference.only_time
    assert difference.paces_ps() == (PS_PER_S, PS_PER_S + 30 * PS_PER_MS)
    assert not compare(on_time, late, Rules(timing_ps=30 * PS_PER_MS))
    assert not compare(on_time, late, Rules(ignore={"time"}))


def test_constant_delay_per_line_is_within_tolerance() -> None:
    """A delay of 15 ms in each pass is 120 ms after eight passes."""
    lines = [f"{number}\n" for number in range(8)]
    slower = run(*lines, every_ps=PS_PER_S + 15 * PS_PER_MS)

    assert not compare(run(*lines), slower)
    assert compare(run(*lines), slower, Rules(timing_ps=14 * PS_PER_MS))


def test_missing_entry_is_difference() -> None:
    (difference,) = compare(run("a\n", "b\n"), run("a\n"))

    assert (difference.first, difference.second) == (ObservedItem(2 * PS_PER_S, "b\n"), None)


def test_entry_cut_by_run_end_is_not_difference() -> None:
    end_ps = 2 * PS_PER_S + 10 * PS_PER_MS  # the other run may come to it 20 ms later
    begun = Observation(
        end_ps, {TERMINAL: [ObservedItem(PS_PER_S, "a\n"), ObservedItem(2 * PS_PER_S, "Pit", cut=True)]}
    )
    complete = run("a\n", "Pitch: 1\n", end_ps=end_ps)

    assert not compare(run("a\n", end_ps=end_ps), complete)
    assert not compare(begun, complete)
    assert compare(begun, run("a\n", "Roll: 1\n", end_ps=end_ps))


def test_truncated_line_is_compared_up_to_its_end() -> None:
    end_ps = 2 * PS_PER_S
    begun = Observation(end_ps, {TERMINAL: [ObservedItem(PS_PER_S, "Pre: 977.4", cut=True)]})
    other = run("Pre: 978.120000 hPa \n", end_ps=end_ps)

    assert compare(begun, other)
    assert not compare(begun, other, Rules(ignore={"numbers"}))
    assert not compare(begun, other, Rules(tolerance=tolerances([("Pre", 1)])))


def test_runs_are_compared_until_shorter_run_ends() -> None:
    assert not compare(run("a\n", "b\n", "c\n"), run("a\n", end_ps=PS_PER_S + 1))


def test_both_banner_spellings_are_equal() -> None:
    """The slides have FH and ST's source has FW. Every comparison accepts both."""
    banners = [f"STEVAL-FCU001V1 {word} rev.1.0 - Sep 2017\n" for word in ("FH", "FW", "FX")]

    assert not compare(run(banners[0]), run(banners[1]))
    assert compare(run(banners[0]), run(banners[2]))


@pytest.mark.parametrize(
    ("other", "same"),
    [
        ("Pitch: 1.000000 deg Roll: 2.000000 deg Yaw: -179.950000 deg \n", True),  # the short way round
        ("Pitch: 1.000000 deg Roll: 2.000000 deg Yaw: -179.850000 deg \n", False),
        ("Pitch: 1.000001 deg Roll: 2.000000 deg Yaw: 179.950000 deg \n", False),  # not tolerated
        ("\rPitch: 1.000000 deg Roll: 2.000000 deg Yaw: 179.950000 deg \n", False),
    ],
)
def test_numbers_may_differ_within_tolerance(other: str, same: bool) -> None:
    line = "Pitch: 1.000000 deg Roll: 2.000000 deg Yaw: 179.950000 deg \n"
    rules = Rules(tolerance=tolerances([("Yaw", 0.11)]))

    assert bool(compare(run(line), run(other), rules)) is not same


def test_tolerance_does_not_apply_to_other_lines() -> None:
    assert compare(run("Count: 1 \n"), run("Count: 2 \n"), Rules(tolerance=tolerances([("ACC", 5)])))


def test_tolerance_may_name_three_axes_together() -> None:
    assert tolerances([("ACC", 2), ("ACC.z", 3)]) == {"ACC.x": 2, "ACC.y": 2, "ACC.z": 3}


@pytest.mark.parametrize("given", [("acc", 1.0), ("ACC.w", 1.0), ("ACC", -1.0), ("ACC", float("nan"))])
def test_impossible_tolerance_is_refused(given: tuple[str, float]) -> None:
    with pytest.raises(InputError, match=r"known|must be a number"):
        tolerances([given])


@pytest.mark.parametrize(
    ("ignore", "sequences"),
    [
        ("time", {TERMINAL, "LSM6DSL registers", "LED1", END}),
        ("numbers", {TERMINAL, "LSM6DSL registers", "LED1", END}),
        ("registers", {TERMINAL, "LED1", END}),
        ("leds", {TERMINAL, "LSM6DSL registers", END}),
    ],
)
def test_ignored_sequences_are_not_compared(ignore: Ignorable, sequences: set[str]) -> None:
    one = Observation(END_PS, {name: [] for name in (TERMINAL, "LSM6DSL registers", "LED1", END)})

    assert set(compared(one, one, Rules(ignore={ignore}))) == sequences


def test_numbers_can_be_ignored_in_every_line() -> None:
    rules = Rules(ignore={"numbers"})

    assert not compare(run("Count: 1 of -inf \n"), run("Count: 22 of 3.5 \n"), rules)
    assert compare(run("Count: 1 \n"), run("Sum: 1 \n"), rules)


def test_sequence_in_only_one_run_is_not_compared() -> None:
    """A replayed firmware does not write registers."""
    assert not compare(run("a\n"), run("on", sequence="LED1"))


def test_largest_deviations_suggest_tolerance() -> None:
    first = run("ACC[x,y,z] 1 mg 2 mg 3 mg \n", "Pre: 977.100000 hPa \n", "Pre: 977.200000 hPa \n", "a\n")
    second = run("ACC[x,y,z] 1 mg 4 mg 0 mg \n", "Pre: 977.000000 hPa \n", "Pre: 977.200000 hPa \n", "b\n")

    apart = largest_deviations(first, second)
    assert apart == pytest.approx({"ACC.x": 0, "ACC.y": 2, "ACC.z": 3, "Pre": 0.1})
    assert not compare(first, second, Rules(tolerance=tolerances(apart.items())))[1:]


# -- what a run did -----------------------------------------------------------------------------------------


def test_time_of_line_is_that_of_first_byte() -> None:
    """A frame has ten bits of 729 / 84 MHz (RM0368 section 19.3.4). The CR belongs to the previous line."""

    def main(hal: VirtualHal) -> None:
        hal.HAL_UART_Transmit(b"one\n\r", 100)
        hal.HAL_Delay(10)
        hal.HAL_UART_Transmit(b"two\nthree", 100)

    lines = observed("flat", script(main)).sequences[TERMINAL]
    frame_ps = 10 * 729 * PS_PER_S / 84e6

    assert [(line.text, line.cut) for line in lines] == [
        ("one\n", False),
        ("\rtwo\n", False),
        ("three", True),
    ]
    assert lines[1].at_ps >= 10 * PS_PER_MS
    assert lines[2].at_ps - lines[1].at_ps == pytest.approx(4 * frame_ps, abs=1)


def test_register_writes_are_stored_per_sensor() -> None:
    def main(hal: VirtualHal) -> None:
        assert hal.HAL_I2C_Mem_Write(0xD6, 0x10, b"\xa8") == HAL_OK

    sequences = observed("flat", script(main)).sequences

    assert [entry.text for entry in sequences["LSM6DSL registers"]] == ["CTRL1_XL = 0xA8"]
    assert not sequences["LIS2MDL registers"]


def test_failed_firmware_differs_from_running_one() -> None:
    def main(hal: VirtualHal) -> None:
        hal.HAL_Delay(500)
        raise ZeroDivisionError

    failing, idle = (observed("flat", script(one)) for one in (main, lambda hal: hal.HAL_Delay(500)))

    (difference,) = compare(failing, idle)
    assert difference.sequence == END
    assert difference.first is not None
    assert "ZeroDivisionError" in difference.first.text


# -- firmwares ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", scenario_names())
def test_firmware_equals_itself_and_differs_from_faulty_one(name: str) -> None:
    """TIM9 runs at an eighth of its rate, which on a desk shows only in the duration of the text."""
    lab3 = observed(name)

    assert lab3.sequences[TERMINAL]
    assert not compare(lab3, observed(name))
    differences = compare(lab3, observed(name, changed(timer_period=9999)), Rules(timing_ps=PS_PER_MS))
    assert differences[0].sequence == "timer"
    assert TERMINAL in [one.sequence for one in differences]
    assert differences[1].at_ps > PS_PER_S  # the boot is the same


@pytest.mark.parametrize("name", ["figure_eight", "flat", "stairs"])
def test_another_board_of_class_prints_other_numbers(name: str) -> None:
    lab3, other = observed(name), observed(name, seed=99)

    assert [difference.sequence for difference in compare(lab3, other)] == [TERMINAL]
    everything = tolerances([(field, 1e6) for field in FIELDS])
    assert not compare(lab3, other, Rules(tolerance=everything))


def test_wrong_threshold_is_first_visible_at_led() -> None:
    """LED1 is on above 80 degrees of pitch, not 70. Later the scenario tilts the roll, which LED2 shows."""
    duration_ps = load_scenario("led_x").duration_ps
    differences = compare(
        observed("led_x", end_ps=duration_ps),
        observed("led_x", changed(led_threshold_deg=70.0), duration_ps),
    )

    assert [difference.sequence for difference in differences] == ["LED1", "LED2"]


# -- the command --------------------------------------------------------------------------------------------


def test_diff_of_equal_firmwares_exits_with_0() -> None:
    text = fcu("diff", "lab3", "lab3", "--scenario", "flat", "--duration", "2s").stdout.decode()

    assert "LSM6DSL registers: the same, 20 and 20 entries" in text
    assert "numbers are apart" not in text
    assert text.endswith("no difference in 2 s\n")


def test_diff_lists_sequences_that_are_not_compared(words: Words) -> None:
    command = ("diff", "lab3", "template", "--scenario", "desk", "--ignore", "numbers", "--ignore", "leds")
    text = fcu(*command, code=1).stdout.decode()
    equal = fcu("diff", "lab3", "lab3", "--scenario", "desk", *command[-4:]).stdout.decode()

    (numbers,) = [line for line in text.splitlines() if line.startswith("numbers (not compared)")]
    assert "MAG" in numbers
    words("diff", numbers)
    words("diff", equal.splitlines()[-1])


def test_diff_prints_first_difference_and_exits_1() -> None:
    text = fcu("diff", "lab3", "template", "--scenario", "desk", code=1).stdout.decode()

    assert "first difference, terminal, entry 14: different text" in text
    assert r"\rMAG[x,y,z] 0 mg 0 mg 0 mg \n" in text
    assert r"\rMAG[x,y,z] 214 mg 0 mg -430 mg \n" in text


@pytest.mark.parametrize(
    ("arguments", "problem"),
    [
        (["lab3", "lab4"], "lab4"),
        (["lab3", "lab3", "--time-tolerance", "5"], "--time-tolerance"),
        (["solution", "lab3", "--replay"], "A must be lab3 or template, not 'solution'"),
        (["lab3", "lab3", "--tolerance", "ACC"], "must be FIELD=NUMBER"),
        (["lab3", "lab3", "--tolerance", "Foo=1"], "unknown field 'Foo'"),
        (["lab3", "lab3", "--duration", "soon"], "--duration"),
    ],
)
def test_diff_refuses_wrong_arguments_in_one_line(arguments: list[str], problem: str) -> None:
    assert problem in one_line_error("diff", *arguments, "--scenario", "flat")


def test_run_with_too_many_events_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    """Firmware that toggles its pins very often cannot fill the memory: stored events are counted during the run."""
    monkeypatch.setattr(observation, "MOST_EVENTS", 30)
    board = Board("template", scenario="flat")

    with pytest.raises(NotJudgedError) as refused:
        observe(board, 5 * PS_PER_S)
    assert refused.value.kind == "too_many_events"
    assert board.now_s < 2.0
