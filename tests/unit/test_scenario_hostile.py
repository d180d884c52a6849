"""Invalid files are refused in bounded time, in one line that contains problem, place, and correct form."""

from __future__ import annotations

import os
import tracemalloc
from pathlib import Path

import pytest
import regex
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from pydantic import ValidationError

from fcu_emulator import Board, InputError, ScenarioError
from fcu_emulator.emulator.boards.fcu001v1 import FCU001V1
from fcu_emulator.emulator.scenario import load_scenario, run
from fcu_emulator.emulator.scenario.fields import Resources, TimeBudget
from fcu_emulator.emulator.scenario.loader import scenario_error
from fcu_emulator.emulator.scenario.schema import MOST_ENTRIES, scenario_file
from tests.support.scenario_files import HEAD, SHORT, play, refusal, write
from tests.support.words import Words

HOLD = '[[timeline]]\ndo = "hold"\nfor = "1s"\n'


def test_scenario_error_is_cut_at_400_characters(tmp_path: Path) -> None:
    path = write(tmp_path, HEAD + "[sensors.lsm6dsl]\nunknown = 1\n")  # it lists all keys of the sensor
    with pytest.raises(ScenarioError) as refused:
        load_scenario(path)

    assert len(refused.value.problem) == 400
    assert str(refused.value) == f"{path}: sensors.lsm6dsl.unknown: {refused.value.problem}"


@pytest.mark.parametrize(
    ("text", "key", "kind"),
    [
        ("", "schema", "missing"),
        ('schema = 2\nquestion = "?"', "schema", "literal_error"),
        ('schema = 1\nquestion = ""', "question", "string_too_short"),
        (HEAD + 'duraton = "1s"', "duraton", "unknown_key"),
        (HEAD + '"a b\\n" = 1', "'a b\\n'", "unknown_key"),
        (HEAD + "duration = '10s'\nuptime = '-1s'", "uptime", "value_error"),
        (HEAD + "duration = 10", "duration", "value_error"),
        (HEAD + 'duration = "-1s"', "duration", "value_error"),
        (HEAD + 'duration = "0s"', "duration", "value_error"),
        (HEAD + 'duration = "1h"', "duration", "too_long"),
        (HEAD + '[limits]\nduration = "25h"', "limits", "value_error"),
        (HEAD + 'firmware = "lab4"', "firmware", "value_error"),
        (HEAD + "seed = -1", "seed", "greater_than_equal"),
        (HEAD + 'seed = "1"', "seed", "int_type"),
        (HEAD + "[firmware_settings]\nmu = 0", "firmware_settings.mu", "greater_than_equal"),
        (HEAD + "[firmware_settings]\nmu = true", "firmware_settings.mu", "float_type"),
        (HEAD + '[bus]\nspeed = "5kHz"', "bus.speed", "value_error"),
        (HEAD + "[world]\nroll_deg = nan", "world.roll_deg", "finite_number"),
        (HEAD + "[world]\npressure_hpa = inf", "world.pressure_hpa", "finite_number"),
        (HEAD + "[world]\npressure_hpa = 97740", "world.pressure_hpa", "less_than_equal"),
        (HEAD + "[world]\nhard_iron_mgauss = [1, 2]", "world.hard_iron_mgauss[2]", "missing"),
        (HEAD + "[world]\nhard_iron_mgauss = [1e9, 0, 0]", "world", "out_of_range"),
        (HEAD + "[world]\nsoft_iron = [[1,0,0],[0,1,0],[0,0,'1']]", "world.soft_iron[2][2]", "float_type"),
        (HEAD + "[world]\npressure_hpa = 900\nfloor_altitude_m = 0", "world", "value_error"),
        (HEAD + "world = 3", "world", "model_type"),
        (HEAD + '[sensors]\nquality = "good"', "sensors.quality", "literal_error"),
        (HEAD + "[sensors.lsm6dsl]\nacc_bias = 1", "sensors.lsm6dsl.acc_bias", "unknown_key"),
        (HEAD + "[sensors.lis2mdl]\nnoise_mgauss = -1", "sensors.lis2mdl.noise_mgauss", "greater_than_equal"),
        (HEAD + "timeline = 1", "timeline", "list_type"),
        (HEAD + "timeline = [1]", "timeline[0]", "model_attributes_type"),
        (HEAD + "[[timeline]]\nfor = '1s'", "timeline[0].do", "union_tag_not_found"),
        (HEAD + HOLD + "[[timeline]]\ndo = 'dance'", "timeline[1].do", "union_tag_invalid"),
        (HEAD + HOLD + "[[timeline]]\ndo = 'hold'", "timeline[1].for", "missing"),
        (HEAD + HOLD + "[[timeline]]\ndo = 'hold'\nfor = 2", "timeline[1].for", "value_error"),
        (
            HEAD + "[[timeline]]\ndo = 'hold'\nfor = '1s'\nat = '11s'",
            "timeline[0].at",
            "after_end",
        ),
        (
            HEAD + "[[timeline]]\ndo = 'hold'\nfor = '1s'\nto = 3",
            "timeline[0].to",
            "unknown_key",
        ),
        (HEAD + "[[timeline]]\ndo = 'send'", "timeline[0]", "value_error"),
        (HEAD + "[[timeline]]\ndo = 'send'\ntext = '€'", "timeline[0]", "value_error"),
        (HEAD + "[[timeline]]\ndo = 'send'\nhex = '0x0d'", "timeline[0].hex", "value_error"),
        (HEAD + "[[timeline]]\ndo = 'inject_fault'\nkind = 'gone'", "timeline[0].kind", "literal_error"),
        (
            HEAD + "[[timeline]]\ndo = 'inject_fault'\nkind = 'nack'\naddress = 'LSM'",
            "timeline[0].address",
            "value_error",
        ),
        (
            HEAD + "[[timeline]]\ndo = 'inject_fault'\nkind = 'nack'\naddress = 0xD6",
            "timeline[0].address",
            "value_error",
        ),
        (HEAD + "[[timeline]]\ndo = 'replay'\ncsv = 'no.csv'", "timeline[0].csv", "value_error"),
        (HEAD + "[[timeline]]\ndo = 'replay'\ncsv = \"a\\u0000b\"", "timeline[0].csv", "value_error"),
        (
            HEAD + "[[timeline]]\ndo = 'shake'\naxis = 'up'\namplitude_g = 1\nfrequency_hz = 1\nfor = '0.5s'",
            "timeline[0]",
            "too_short",
        ),
        (
            HEAD + "[[timeline]]\ndo = 'pass_magnet'\nmoment_am2 = 1\ndistance_m = 0\nspeed_m_s = 1",
            "timeline[0].distance_m",
            "greater_than_equal",
        ),
        (
            SHORT + "[[expect]]\nkind = 'regex'\npattern = '('",
            "expect[0].pattern",
            "value_error",
        ),
        (
            HEAD + "[[expect]]\nkind = 'field'\nname = 'Jaw'\nvalue = 1\ntolerance = 1",
            "expect[0].name",
            "value_error",
        ),
        (HEAD + "[[expect]]\nkind = 'field'\nname = 'Yaw'\ntolerance = 1", "expect[0]", "value_error"),
        (HEAD + "[[expect]]\nkind = 'ticks'", "expect[0]", "value_error"),
        (SHORT + "[[expect]]\nkind = 'led'\nled = 'led3'\nstate = 'on'", "expect[0].led", "value_error"),
        (
            HEAD + "[[expect]]\nkind = 'never'\npattern = 'x'\nfrom = '2s'\nto = '1s'",
            "expect[0]",
            "value_error",
        ),
        (HEAD + "[[expect]]\nkind = 'text'\nfile = 'no.txt'", "expect[0].file", "value_error"),
    ],
)
def test_wrong_value_is_refused_with_key_path(
    tmp_path: Path, text: str, key: str, kind: str, words: Words
) -> None:
    error = refusal(tmp_path, text)
    assert (error.key, error.kind) == (key, kind)
    words("scenario", error.problem)


@pytest.mark.parametrize(
    ("place", "kind"),
    [
        ("latitude_deg = 91\nlongitude_deg = 8\ndate = 2026-03-01", "less_than_equal"),
        ("latitude_deg = 47\nlongitude_deg = 8\ndate = 1995-03-01", "outside_model"),
        ("latitude_deg = 47\nlongitude_deg = 8\ndate = '2026-03-01'", "date_type"),
        ("latitude_deg = 47\nlongitude_deg = 8\ndate = 2026-03-01\nnorth = 'up'", "literal_error"),
    ],
)
def test_place_outside_model_is_refused(tmp_path: Path, place: str, kind: str, words: Words) -> None:
    error = refusal(tmp_path, f"{HEAD}[world.place]\n{place}\n")
    assert error.key.startswith("world.place")
    assert error.kind == kind
    words("scenario", error.problem)


def test_overlapping_motions_are_both_reported(tmp_path: Path) -> None:
    sweep = "[[timeline]]\ndo = 'sweep'\naxis = 'yaw'\nto_deg = 9\nfor = '1s'\nat = '1s'\n"
    error = refusal(tmp_path, HEAD + "[[timeline]]\ndo = 'rotate_to'\nfor = '2s'\n" + HOLD + sweep)
    assert (error.key, error.kind) == ("timeline[2].at", "overlap")
    assert "timeline[0] (rotate_to)" in error.problem
    assert '"2s" or later' in error.problem


def test_motions_of_different_quantities_may_overlap(tmp_path: Path) -> None:
    lift = "[[timeline]]\ndo = 'lift'\nmetres = 1\nfor = '2s'\nat = '1s'\n"
    scenario = load_scenario(write(tmp_path, HEAD + "[[timeline]]\ndo = 'rotate_to'\nfor = '2s'\n" + lift))
    assert scenario.duration_s == 10.0


def test_further_problems_are_counted(tmp_path: Path) -> None:
    error = refusal(tmp_path, HEAD + "seed = -1\nduration = 3\n[world]\nroll_deg = 'flat'\n")
    assert error.problem.endswith("(2 more errors in this file)")


@pytest.mark.parametrize(
    ("data", "kind"),
    [
        (b"\xff\xfe\x00", "not_utf8"),
        (b"\x00\x01\x02", "invalid_toml"),
        (b"schema = ", "invalid_toml"),
        (b"schema = 1\nschema = 1", "invalid_toml"),
        (b"a = " + b"[" * 100_000, "too_deep"),
        (b"a = " + b"{a=" * 100_000, "too_deep"),
        (b"a" + b".a" * 400_000 + b" = 1", "too_many_dots"),
        (b"[" + b"a." * 400_000 + b"a]", "too_many_dots"),
        (b"\n" * 500_000, "too_many_lines"),
        (b"seed = " + b"9" * 5000, "invalid_toml"),
        (b"#" * (1 << 20) + b"\n", "unusable_file"),
    ],
    ids=lambda value: value if isinstance(value, str) else None,
)
def test_non_scenario_file_is_refused(tmp_path: Path, data: bytes, kind: str) -> None:
    assert refusal(tmp_path, data).kind == kind


def test_number_beyond_every_range_is_refused(tmp_path: Path) -> None:
    assert refusal(tmp_path, f"{HEAD}[world]\nroll_deg = {'9' * 4000}").key == "world.roll_deg"


def test_too_long_timeline_is_refused(tmp_path: Path) -> None:
    error = refusal(tmp_path, HEAD + "timeline=[" + "{do='hold'}," * (MOST_ENTRIES + 1) + "]")
    assert (error.key, error.kind) == ("timeline", "too_long")
    assert str(MOST_ENTRIES) in error.problem


def test_too_large_golden_text_is_refused(tmp_path: Path, words: Words) -> None:
    (tmp_path / "golden.txt").write_bytes(b"x" * ((1 << 20) + 1))
    error = refusal(tmp_path, HEAD + "[[expect]]\nkind = 'text'\nfile = 'golden.txt'")
    assert error.key == "expect[0].file"
    words("scenario", error.problem)


def test_folder_is_not_scenario(tmp_path: Path, words: Words) -> None:
    with pytest.raises(ScenarioError) as refused:
        load_scenario(tmp_path)
    assert refused.value.kind == "unusable_file"
    words("scenario", refused.value.problem)


RECORDING = "t_s,p_hPa\n0,900\n1,901\n"


def expect_text(file: str) -> str:
    return f"{HEAD}[[expect]]\nkind = 'text'\nfile = '{file}'\n"


def replay(csv: str) -> str:
    return f"[[timeline]]\ndo = 'replay'\ncsv = '{csv}'\n"


@pytest.mark.parametrize(
    "name",
    [
        "../outside.txt",
        "below/../../outside.txt",
        "/etc/passwd",
        "below/../golden.txt",
        "..\\outside.txt",
        "\\\\server\\share",
        "C:\\outside.txt",
        "C:outside.txt",
        "\\outside.txt",
        "~/../..",
    ],
)
def test_file_outside_scenario_folder_is_refused(tmp_path: Path, name: str, words: Words) -> None:
    folder = tmp_path / "folder"
    (folder / "below").mkdir(parents=True)
    (tmp_path / "outside.txt").write_text("secret")
    for text in (expect_text(name), HEAD + replay(name)):
        error = refusal(folder, text)
        words("scenario", error.problem)
        assert "secret" not in str(error)


@pytest.mark.parametrize("name", ["to_file.csv", "to_folder/walk.csv", "chain.csv"])
def test_link_out_of_scenario_folder_is_refused(tmp_path: Path, name: str, words: Words) -> None:
    folder, outside = tmp_path / "folder", tmp_path / "outside"
    folder.mkdir()
    outside.mkdir()
    (outside / "walk.csv").write_text("secret,of,mine\n")
    (folder / "to_file.csv").symlink_to(outside / "walk.csv")
    (folder / "to_folder").symlink_to(outside)
    (folder / "chain.csv").symlink_to(folder / "to_file.csv")
    for text in (expect_text(name), HEAD + replay(name)):
        error = refusal(folder, text)
        words("scenario", error.problem)
        assert "secret" not in str(error)


def test_link_inside_folder_is_accepted(tmp_path: Path) -> None:
    (tmp_path / "below").mkdir()
    (tmp_path / "below" / "walk.csv").write_text(RECORDING)
    (tmp_path / "link.csv").symlink_to("below/walk.csv")
    load_scenario(write(tmp_path, HEAD + replay("link.csv") + replay("below/walk.csv")))


def test_link_to_itself_is_refused(tmp_path: Path) -> None:
    (tmp_path / "loop.csv").symlink_to("loop.csv")
    error = refusal(tmp_path, HEAD + replay("loop.csv"))
    assert error.key == "timeline[0].csv"
    assert "loop.csv" in error.problem


def test_recording_replayed_often_is_stored_only_once(tmp_path: Path) -> None:
    """Its rows are also stored once, for any start of a replay."""
    rows = "".join(f"{number}e-4,0,{number % 90},0,1\n" for number in range(20_000))
    (tmp_path / "walk.csv").write_text("t_s,roll_deg,pitch_deg,yaw_deg,alt_m\n" + rows)
    path = write(tmp_path, HEAD + 'duration = "300s"\n' + replay("walk.csv") * 100)
    tracemalloc.start()
    try:
        load_scenario(path)
        _, peak = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert peak < 10_000_000  # the recording has 0.8 MB, a hundred of them 80 MB


def test_all_files_of_scenario_share_one_limit(tmp_path: Path, words: Words) -> None:
    resources = Resources(tmp_path)
    for number in range(3):
        with (tmp_path / f"{number}.csv").open("wb") as stream:
            stream.write(RECORDING.encode())
            stream.truncate(25 << 20)  # the rest is zeros
    for number in range(2):
        with pytest.raises(ValueError, match=r"\.csv") as refused:
            resources.recording(f"{number}.csv")
        words("scenario", str(refused.value))
    with pytest.raises(ValueError, match=r"64 MiB") as refused:
        resources.recording("2.csv")
    words("scenario", str(refused.value))


@pytest.mark.parametrize("kind", ["regex", "never"])
@pytest.mark.parametrize(
    "pattern",
    [
        "(?:a?){9999999}",
        "a{9999999}",
        "(?:ab){9999999,}",
        "((a{300}){300}){300}",
        "(?<=(?:a?){999999})b",
        "(?:" * 60 + "a?" + "){2}" * 60,
        "(?x)((?:a{300}) {300}) {300}",
        "((?:a{300})(?#b){300})(?#c){300}",
        "(?ix:((?:a{300})#\n{300}) {300})",
        "a{" + "9" * 400 + "}",
    ],
)
def test_pattern_exceeding_memory_is_not_compiled(
    tmp_path: Path, pattern: str, kind: str, monkeypatch: pytest.MonkeyPatch, words: Words
) -> None:
    compiled: list[str] = []
    monkeypatch.setattr(regex, "compile", compiled.append)
    error = refusal(tmp_path, f"{HEAD}[[expect]]\nkind = '{kind}'\npattern = '''{pattern}'''\n")
    words("scenario", error.problem)
    assert not compiled


def test_many_patterns_share_one_limit(tmp_path: Path, words: Words) -> None:
    one = "[[expect]]\nkind = 'regex'\npattern = 'a{8000}'\n"
    load_scenario(write(tmp_path, HEAD + one * 10))
    words("scenario", refusal(tmp_path, HEAD + one * 20).problem)


@pytest.mark.parametrize(
    "pattern",
    [
        r"^ACC\[x,y,z\] (-?\d{1,5} mg ){3}$",
        r"\d{4}-\d{2}-\d{2} \d{2}:\d{2}:\d{2}\.\d{3} \d{3} \d{3} \d{3} \d{3}",
        r"(?i)^(\d{1,3}\.){3}\d{1,3}$",
        r"(?<!\{)x{0,99999}",
    ],
)
def test_usual_patterns_are_compiled(tmp_path: Path, pattern: str) -> None:
    load_scenario(write(tmp_path, f"{HEAD}[[expect]]\nkind = 'regex'\npattern = '{pattern}'\n"))


def test_all_searches_of_run_share_one_limit() -> None:
    clock = iter(range(1000))
    patience = TimeBudget(lambda: float(next(clock)))
    for _ in range(10):
        with patience.limited() as timeout_s:
            assert timeout_s <= 0.5
    with pytest.raises(TimeoutError), patience.limited():
        pass


def test_question_has_no_control_characters(tmp_path: Path) -> None:
    assert refusal(tmp_path, 'schema = 1\nquestion = "\\u001b]0;title\\u0007"').key == "question"


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="named pipes are POSIX")
def test_pipe_does_not_block_loader(tmp_path: Path) -> None:
    pipe = tmp_path / "pipe.toml"
    os.mkfifo(pipe)
    with pytest.raises(ScenarioError) as refused:
        load_scenario(pipe)
    assert refused.value.kind == "unusable_file"


def test_missing_file_is_refused(tmp_path: Path, words: Words) -> None:
    with pytest.raises(ScenarioError) as refused:
        load_scenario(str(tmp_path / "none.toml"))
    assert refused.value.kind == "unusable_file"
    words("scenario", refused.value.problem)


def test_unknown_name_error_lists_known_names() -> None:
    with pytest.raises(InputError, match=r"stars.*stairs.*askew, clocks, compass_turn, desk") as refused:
        load_scenario("stars")
    assert refused.value.kind == "unknown_scenario"


@given(st.binary(max_size=200) | st.text(max_size=200).map(str.encode))
@settings(max_examples=100, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_any_file_raises_only_scenario_errors(tmp_path: Path, data: bytes) -> None:
    refusal(tmp_path, data)


VALUES = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=8),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=5), inner, max_size=3),
    max_leaves=6,
)
KEYS = (
    "duration",
    "seed",
    "firmware",
    "world",
    "sensors",
    "timeline",
    "threshold",
    "expect",
    "report",
    "bus",
)


@given(st.sampled_from(KEYS), VALUES)
@settings(max_examples=200)
def test_any_table_is_accepted_or_refused(key: str, value: object) -> None:
    """The table does not go through the TOML parser, which would refuse some values. Every error has one line."""
    try:
        scenario_file(FCU001V1).model_validate({"schema": 1, "question": "?", key: value})
    except ValidationError as error:
        message = str(scenario_error("file", error))
        assert message.startswith(f"file: {key}")
        assert message.isprintable()


def test_endless_pattern_is_stopped_and_reported(tmp_path: Path) -> None:
    file = tmp_path / "slow.toml"
    file.write_text(SHORT + "[[expect]]\nkind = 'regex'\npattern = '^(.|..)+(?<!.)$'\n")
    (finding,) = run(Board(scenario=file)).findings
    assert finding.fault == "stopped"


def test_window_after_end_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "late.toml"
    file.write_text(SHORT + "[[expect]]\nkind = 'led'\nled = 'led1'\nstate = 'off'\nfrom = '1000s'\n")
    with pytest.raises(ScenarioError, match="1000 s") as refused:
        load_scenario(file)
    assert (refused.value.key, refused.value.kind) == ("expect[0].from", "after_end")


def test_lost_ticks_of_84_mhz_timer_cost_nothing(tmp_path: Path) -> None:
    file = tmp_path / "flood.toml"
    file.write_text(SHORT + "[firmware_settings]\ntimer_prescaler = 0\ntimer_period = 0\n")
    board = Board(scenario=file)
    assert run(board).passed
    assert board.tim9.lost > 80_000_000
    assert board.tim9.late < 4_000


def test_ambiguous_format_is_stopped_with_finding(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("fcu_emulator.emulator.scenario.fields._LINE_PATIENCE_S", 0.01)
    monkeypatch.setattr("fcu_emulator.emulator.scenario.fields._RUN_PATIENCE_S", 0.02)
    table = f"[[expect]]\nkind = 'printed'\nformat = '{'%s' * 40}%d'\nmax_gap = '1s'\n"
    (finding,) = play(tmp_path, SHORT + table).findings

    assert finding.fault == "stopped"


@pytest.mark.parametrize("kind", ["field", "line_follows"])
def test_slow_number_pattern_is_stopped_with_finding(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, kind: str
) -> None:
    monkeypatch.setattr("fcu_emulator.emulator.scenario.fields._LINE_PATIENCE_S", 0.01)
    monkeypatch.setattr("fcu_emulator.emulator.scenario.fields._RUN_PATIENCE_S", 0.02)
    keys = {
        "field": 'truth = "roll"\ntolerance = 1',
        "line_follows": 'max_gap = "1s"\nwhen = { quantity = "roll", beyond = 1 }',
    }
    table = f"[[expect]]\nkind = '{kind}'\npattern = '^(?P<number>.|..)+(?<!.)$'\n{keys[kind]}\n"
    (finding,) = play(tmp_path, SHORT + table).findings

    assert (finding.kind, finding.fault) == (kind, "stopped")
