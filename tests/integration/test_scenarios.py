"""The shipped scenarios for a user, and the properties of runs: limits, faults, repeatability."""

from __future__ import annotations

import gc
import weakref
from pathlib import Path

import pytest

from fcu_emulator import Board, InputError
from fcu_emulator.emulator.errors import I2CNackError
from fcu_emulator.emulator.scenario import check, load_scenario, run, scenario_names
from fcu_emulator.emulator.trace import TerminalBytes
from fcu_emulator.emulator.world import World
from tests.support.scenario_files import HEAD, IDEAL, SHORT, play, write

GOLDEN = Path(__file__).parents[1] / "golden"
PLACE = """[world.place]
latitude_deg = 19.4
longitude_deg = -155.3
altitude_m = 1650
date = 2026-06-01
"""
BREAKS = {
    # What to change in a shipped file so that its expectations must fail: they do look at what they name.
    "askew": ("acc_cross_axis_percent = [1.5", "acc_cross_axis_percent = [0"),
    "clocks": ("odr_percent = 2.5", "odr_percent = 0"),
    "compass_turn": ('do = "figure_eight"', 'do = "hold"'),
    "desk": ("23.058", "24.3"),
    "drift": ("dph = 300", "dph = 3"),
    "figure_eight": ('do = "figure_eight"', 'do = "hold"'),
    "flat": ('quality = "typical"', 'quality = "typical"\n[sensors.lsm6dsl]\nacc_bias_mg = [150, 0, 0]'),
    "free_fall": ('do = "free_fall"', 'do = "hold"'),
    "hand": ('do = "take_in_hand"', 'do = "put_down"'),
    "iron": ('do = "figure_eight"', 'do = "hold"'),
    "exercise_1": ('quality = "ideal"', 'quality = "ideal"\n[sensors.lsm6dsl]\nacc_bias_mg = [180, 0, 0]'),
    "led_x": ('quality = "ideal"', 'quality = "ideal"\n[sensors.lsm6dsl]\nacc_bias_mg = [0, 0, 40]'),
    "led_y": ('quality = "ideal"', 'quality = "ideal"\n[sensors.lsm6dsl]\nacc_bias_mg = [0, 0, 40]'),
    "magnet_passes_by": ("moment_am2 = 8", "moment_am2 = 80"),
    "motors": ("throttle = 1", "throttle = 0.7"),
    "outside": ("thermal_s = 20", "thermal_s = 0"),
    "plugged_in": ("heating_percent = 30", "heating_percent = 0"),
    "slow_bus": ('"100kHz"', '"400kHz"'),
    "stairs": ('quality = "typical"', 'quality = "typical"\n[sensors.lps22hb]\npressure_noise_hpa = 0.15'),
    "weather": ("change_hpa = -0.6", "change_hpa = -0.2"),
    "tilt_sweep": ('quality = "ideal"', 'quality = "worst"'),
}


@pytest.mark.parametrize("name", scenario_names())
def test_shipped_scenario_passes(name: str) -> None:
    board = Board(scenario=name)
    result = run(board)
    assert result.passed, "\n".join(result.lines)
    assert result.passed_count == result.checks > 0
    assert board.now_s == load_scenario(name).duration_s <= 60


@pytest.mark.parametrize("name", scenario_names())
@pytest.mark.parametrize("firmware", [None, "template"])
def test_early_verdict_is_final(name: str, firmware: str | None) -> None:
    """For a correct program, no verdict fails during the run, for example because of a count that still increases."""
    board = Board(firmware, scenario=name)
    plan = board.scenario
    assert plan is not None
    fallen: dict[str, str] = {}
    for _ in range(8):
        board.run_for(plan.duration_s / 8)
        states = {one.key: one.state for one in plan.results(board)}
        assert states | fallen == states
        fallen = {key: state for key, state in states.items() if state != "open"}
    board.run_until(plan.duration_s)
    result = plan.check(board)
    states = {one.key: one.state for one in plan.results(board)}
    assert "open" not in (states | fallen).values()
    assert {key for key, state in states.items() if state == "failed"} == {one.key for one in result.findings}
    assert firmware == "template" or set(states.values()) == {"met"}


@pytest.mark.parametrize("name", scenario_names())
def test_shipped_scenario_fails_when_its_feature_breaks(tmp_path: Path, name: str) -> None:
    original = load_scenario(name).path.read_text(encoding="utf-8")
    old, new = BREAKS[name]
    assert old in original
    assert not play(tmp_path, original.replace(old, new)).passed


@pytest.mark.parametrize("wiring", ["lab3", "fcu001v1"])
def test_hand_scenario_passes_with_built_program(wiring: str) -> None:
    """This program prints at other times, and a student's program at other times again."""
    result = run(Board("solution", wiring=wiring, scenario="hand"))
    assert result.passed, "\n".join(result.lines)


@pytest.mark.parametrize("later_ms", range(0, 900, 100))
def test_hand_scenario_passes_for_any_start_of_motion(tmp_path: Path, later_ms: int) -> None:
    text = load_scenario("hand").path.read_text(encoding="utf-8")
    assert 'at = "3s"' in text
    later = text.replace('at = "3s"', f'at = "{3000 + later_ms}ms"').replace('"7s"', '"8s"')
    result = play(tmp_path, later)
    assert result.passed, "\n".join(result.lines)


def test_desk_scenario_prints_golden_text(tmp_path: Path) -> None:
    """The first four seconds of the slides' terminal are compared byte by byte."""
    text = load_scenario("desk").path.read_text(encoding="utf-8")
    (tmp_path / "desk.txt").write_bytes((GOLDEN / "desk.txt").read_bytes())
    result = play(tmp_path, f"{text}\n[[expect]]\nkind = 'text'\nfile = 'desk.txt'\n")
    assert result.passed, "\n".join(result.lines)


@pytest.mark.parametrize("pressure_raw", [4003431, 4003471])
def test_desk_scenario_passes_for_all_pressures_of_slides(tmp_path: Path, pressure_raw: int) -> None:
    text = load_scenario("desk").path.read_text(encoding="utf-8")
    assert play(tmp_path, text.replace("977.405 ", f"{pressure_raw / 4096!r} ")).passed


def test_splitting_run_does_not_change_scenario_output() -> None:
    plan = load_scenario("flat")
    first, second = Board(scenario=plan), Board(scenario=plan)
    first.run_for(4)
    for _ in range(400):
        second.run_for(0.01)
    assert first.terminal.text == second.terminal.text
    assert first.terminal.text.count("Pitch:") == 3


def test_seed_changes_noise() -> None:
    texts = {seed: Board(scenario="flat", seed=seed) for seed in (1, 2)}
    for board in texts.values():
        board.run_for(2.5)
    assert texts[1].terminal.text != texts[2].terminal.text


def test_checking_scenario_does_not_change_output_times(tmp_path: Path) -> None:
    """Each byte is on the wire at the same picosecond as without a scenario."""
    watched, alone = Board(scenario=write(tmp_path, SHORT)), Board(firmware="lab3")
    for board in (watched, alone):
        board.trace.record_all()
        board.run_for(2.5)
    assert watched.terminal.text == alone.terminal.text
    assert _byte_times_ps(watched) == _byte_times_ps(alone)


def _byte_times_ps(board: Board) -> list[int]:
    """Return the start of each byte. The first byte of a piece has its own time, within the rounding of the frames."""
    frame_ps = board.terminal.uart.frames_ps(1)
    return [
        round((event.t_ps + board.terminal.uart.frames_ps(number)) / frame_ps * 1000)
        for event in board.trace.of(TerminalBytes)
        for number in range(len(event.data))
    ]


def test_scenario_does_not_keep_its_board_alive() -> None:
    plan = load_scenario("flat")
    board = Board(scenario=plan)
    board.run_for(1.5)
    gone = weakref.ref(board)
    del board
    gc.collect()
    assert gone() is None


def test_board_can_continue_after_end_of_scenario() -> None:
    board = Board(scenario="desk")
    before = run(board)
    board.world.set_pressure(900)
    board.run_for(3)
    assert check(board) == list(before.findings) == []


def test_unfinished_run_is_judged_up_to_its_end() -> None:
    board = Board(scenario="desk")
    board.run_for(2)
    findings = check(board)
    assert findings[0].fault == "stopped"
    assert "4 s" in findings[0].expected
    assert {finding.kind for finding in findings[1:]} == {"line"}


def test_check_refuses_board_of_another_scenario() -> None:
    with pytest.raises(InputError, match="no scenario"):
        check(Board())
    with pytest.raises(InputError, match=r"\bflat\b") as refused:
        load_scenario("flat").check(Board(scenario="desk"))
    assert refused.value.kind == "other_scenario"


def test_too_much_text_stops_run(tmp_path: Path) -> None:
    result = play(tmp_path, f"{IDEAL}[limits]\nterminal_bytes = 400\n")
    assert [finding.fault for finding in result.findings] == ["stopped"]
    assert "limits.terminal_bytes" in result.lines[0]
    assert (result.passed_count, result.failed_count, result.passed) == (0, 0, False)


def test_too_much_wall_time_stops_run(tmp_path: Path) -> None:
    clock = iter(range(0, 1000, 2))
    board = Board(scenario=write(tmp_path, f'{HEAD}[limits]\nwall = "5s"\n'))
    result = run(board, lambda: float(next(clock)))
    assert "limits.wall" in result.lines[0]
    assert 0 < board.now_s < 1


def test_fault_breaks_bus_during_its_time_window(tmp_path: Path) -> None:
    """While the magnetometer is absent, MAG keeps its old value, which each call corrects again."""
    fault = "[[timeline]]\ndo = 'inject_fault'\nkind = 'absent'\naddress = 'LIS2MDL'\nat = '1.5s'\nfor = '500ms'\n"
    board = Board(scenario=write(tmp_path, IDEAL + fault))
    board.run_for(2.5)
    failed = [event for event in board.trace if event.kind == "bus"]
    assert {event.result for event in failed} == {str(I2CNackError(0x1E, 0))}
    assert len(failed) == 400  # 500 ms at 800 Hz
    assert 1.5e12 <= failed[0].t_ps < failed[-1].t_ps < 2e12


def test_missing_sensor_ends_boot(tmp_path: Path) -> None:
    """The firmware hangs after the banner, as on the real board."""
    fault = "[[timeline]]\ndo = 'inject_fault'\nkind = 'absent'\naddress = 0x6B\n"
    only_banner = "[[expect]]\nkind = 'never'\npattern = 'LSM6DSL'\n"
    banner = "[[expect]]\nkind = 'line'\ntext = 'STEVAL-FCU001V1 FH rev.1.0 - Sep 2017'\n"
    no_timer = "[[expect]]\nkind = 'ticks'\nlate_max = 0\n"
    result = play(tmp_path, SHORT + fault + only_banner + banner + no_timer)
    assert [(finding.key, finding.fault) for finding in result.findings] == [("expect[2]", "missing")]


def test_sent_bytes_arrive_at_board(tmp_path: Path) -> None:
    send = "[[timeline]]\ndo = 'send'\ntext = 'ab'\nat = '1s'\n[[timeline]]\ndo = 'send'\nhex = 'ff 00'\n"
    board = Board(scenario=write(tmp_path, SHORT + send))
    board.trace.record_all()
    board.run_for(1.1)
    typed = [event for event in board.trace.of(TerminalBytes) if event.direction == "rx"]
    assert [(event.t_ps >= 10**12, event.data) for event in typed] == [(True, b"ab"), (True, b"\xff\x00")]


def test_recording_is_replayed(tmp_path: Path) -> None:
    (tmp_path / "tilt.csv").write_text("t_s,roll_deg,pitch_deg,yaw_deg\n0,0,0,0\n1,0,20,0\n9,0,20,0\n")
    replay = "[[timeline]]\ndo = 'replay'\ncsv = 'tilt.csv'\n"
    field = "[[expect]]\nkind = 'field'\nname = 'Pitch'\nvalue = 20\ntolerance = 0.2\n"
    assert play(tmp_path, IDEAL + replay + field).passed


@pytest.mark.parametrize(
    ("table", "field"),
    [
        ("set_pressure'\npressure_hpa = 950", "name = 'Pre'\nvalue = 950\ntolerance = 0.02"),
        ("set_temperature'\ntemperature_degc = 5", "name = 'Pre'\ntruth = true\ntolerance = 0.02"),
        (
            "set_field'\nfield = { north_ut = 10, east_ut = 0, down_ut = 0 }",
            "name = 'MAG.x'\nvalue = -57\ntolerance = 2",  # halfway from 215 mgauss to 100: (100 - 215) / 2
        ),
    ],
)
def test_values_after_jump_are_printed(tmp_path: Path, table: str, field: str) -> None:
    jump = f"[[timeline]]\ndo = '{table}\nat = '1.5s'\n"
    check_after = f"[[expect]]\nkind = 'field'\n{field}\nfrom = '2s'\n"
    result = play(tmp_path, IDEAL + jump + check_after)
    assert result.passed, result.lines


def test_world_starts_with_values_of_file(tmp_path: Path) -> None:
    text = f"""{HEAD}
[world]
roll_deg = 5
pitch_deg = -10
yaw_deg = 120
temperature_degc = 10
pressure_hpa = 940
gravity = 1.62
hard_iron_mgauss = [1, 2, 3]
soft_iron = [[2, 0, 0], [0, 1, 0], [0, 0, 1]]
[world.place]
latitude_deg = 47.4
longitude_deg = 8.5
altitude_m = 400
date = 2026-03-01
[board]
pressure_wander_hpa = 0
"""
    world = Board(scenario=write(tmp_path, text)).world
    assert world.attitude_deg(0)[0] == pytest.approx([5, -10, 120])
    assert world.temperature_degc(0)[0] == 10
    assert world.pressure_hpa(0)[0] == pytest.approx(940)
    assert abs(world.specific_force_g(0)[0]).max() < 0.17
    assert world.hard_iron_mgauss(0)[0] == pytest.approx([1, 2, 3])
    assert world.magnetic_field_mgauss(0)[0][2] < -350  # 43 uT down (World Magnetic Model), tilted


@pytest.mark.parametrize(
    "north",
    ["field = { north_ut = 21.5, east_ut = 3.0, down_ut = 43.0 }", PLACE + 'north = "true"', PLACE],
    ids=["a field with an east part", "a place's geographic north", "a place's magnetic north"],
)
def test_printed_yaw_is_compared_with_magnetic_yaw(tmp_path: Path, north: str) -> None:
    text = f"""{HEAD}duration = "16s"
[sensors]
quality = "ideal"
[[timeline]]
do = "figure_eight"
at = "2s"
for = "12s"
[[expect]]
kind = "field"
name = "Yaw"
truth = true
tolerance = 0.5
from = "14.5s"
[world]
yaw_deg = 40
"""
    result = play(tmp_path, text + north)
    assert result.passed, result.lines


STILL_AIR = "[board]\npressure_wander_hpa = 0\n"


def test_altitude_of_place_is_that_of_floor(tmp_path: Path) -> None:
    world = Board(scenario=write(tmp_path, f"{HEAD}\n[world]\n{PLACE}\n{STILL_AIR}")).world
    assert world.pressure_hpa(0)[0] == pytest.approx(World(floor_altitude_m=1650.0).pressure_hpa(0)[0])
    text = f"{HEAD}\n[world]\nfloor_altitude_m = 0\n{PLACE}\n{STILL_AIR}"
    lower = Board(scenario=write(tmp_path, text)).world
    assert lower.pressure_hpa(0)[0] == pytest.approx(1013.25)
