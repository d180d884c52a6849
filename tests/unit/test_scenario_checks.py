"""Each kind of expectation: the lab's firmware meets it, and a violation is found.

The board is ideal and flat, unless a case states something else. Printed texts are the lab's.
"""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import TypeAdapter

from fcu_emulator import Board
from fcu_emulator.emulator.errors import ScenarioError
from fcu_emulator.emulator.scenario import load_scenario, run
from fcu_emulator.emulator.scenario.expectations import ExpectField, RunView
from fcu_emulator.emulator.scenario.result import ExpectationResult, Result
from fcu_emulator.emulator.scenario.run_view import FORMATS, PrintedLine, deviation, same_banner
from fcu_emulator.emulator.scenario.schema import AnyExpectation
from tests.support.scenario_files import HEAD, IDEAL, SHORT, play, write
from tests.support.words import Words

MET = [
    ("line", "text = 'LAB3 Init...'\ncount = 1"),
    ("line", "text = 'STEVAL-FCU001V1 FW rev.1.0 - Sep 2017'"),  # either banner
    ("line", "text = 'ACC[x,y,z] 0 mg 0 mg 1000 mg'\nfrom = '1s'\nto = '1.5s'\ncount = 1"),
    ("regex", "pattern = '^Pre: 9\\d+\\.\\d{6} hPa$'\ncount = 2"),
    ("never", "pattern = '(?i)nan|inf(?!\\w)'"),
    ("field", "name = 'ACC.z'\nvalue = 1000\ntolerance = 1"),
    ("field", "name = 'Pre'\ntruth = true\ntolerance = 0.01"),
    ("within", "name = 'ACC.z'\nmin = 0\nmax = 1000\nmin_difference = 0"),
    ("led", "led = 'led1'\nstate = 'off'"),
    ("ticks", "late_max = 0\nlost_max = 0\nrate_hz = 800"),
    ("hard_iron", "within_mgauss = 1000"),
]
NOT_MET = [
    ("line", "text = 'LAB4 Init...'", "wrong value"),
    ("line", "text = 'lab3 init'", "wrong format"),
    ("line", "text = 'Hello, World'", "missing"),
    ("line", "text = 'LAB3 Init'", "wrong format"),  # no part of a line is a line
    ("line", "text = 'LAB3 Init...'\ncount = 2", "wrong value"),
    ("line", "text = 'LAB3 Init...'\nto = '0.5s'", "missing"),
    ("line", "text = 'ACC[x,y,z] 44 mg 23 mg 1008 mg'", "wrong value"),
    ("regex", "pattern = 'Pressure: '", "missing"),
    ("regex", "pattern = 'Pre: '\ncount = 3", "wrong value"),
    ("never", "pattern = 'MAG'", "wrong value"),
    ("field", "name = 'ACC.z'\nvalue = -999\ntolerance = 1", "wrong value"),  # the sign counts
    ("field", "name = 'ACC.z'\nvalue = 99\ntolerance = 0", "wrong value"),
    ("field", "name = 'Pitch'\nvalue = 3\ntolerance = 1", "wrong value"),
    ("field", "name = 'Pitch'\nvalue = 0\ntolerance = 1\nto = '0.9s'", "missing"),
    ("within", "name = 'ACC.z'\nmin = 0\nmax = 999", "wrong value"),
    ("within", "name = 'ACC.z'\nmin = 0\nmax = 1000\nmin_difference = 1", "wrong value"),
    ("within", "name = 'ACC.z'\nmin = 0\nmax = 1000\nto = '0.9s'", "missing"),
    ("led", "led = 'led2'\nstate = 'on'\nfrom = '1s'", "wrong value"),
    ("ticks", "late_min = 1", "wrong value"),
    ("ticks", "lost_min = 1", "wrong value"),
    ("ticks", "rate_hz = 807.692", "wrong value"),
    ("hard_iron", "within_mgauss = 1", "wrong value"),  # not turned: the centre is the field itself
]


@pytest.mark.parametrize(("kind", "keys"), MET)
def test_met_expectation_causes_no_finding(tmp_path: Path, kind: str, keys: str) -> None:
    result = play(tmp_path, f"{IDEAL}[[expect]]\nkind = '{kind}'\n{keys}\n")
    assert result.passed
    assert (result.passed_count, result.failed_count, len(result.lines)) == (1, 0, 1)


@pytest.mark.parametrize(("kind", "keys", "fault"), NOT_MET)
def test_broken_expectation_is_found(tmp_path: Path, kind: str, keys: str, fault: str) -> None:
    result = play(tmp_path, f"{IDEAL}[[expect]]\nkind = '{kind}'\n{keys}\n")
    (finding,) = result.findings
    assert (finding.key, finding.kind, finding.fault) == ("expect[0]", kind, fault)
    assert not result.passed
    assert (result.passed_count, result.failed_count) == (0, 1)
    assert result.lines[0].startswith(f"{fault}: expected ")
    assert all(line.isprintable() for line in result.lines)


@pytest.mark.parametrize(
    ("kind", "keys"),
    [
        ("line", "text = 'LAB3 Init...'\ncount = 1"),
        ("regex", "pattern = '^Pre'\nto = '2s'"),
        ("regex", "pattern = '^Pre'\ncount = 1"),
        ("regex", "pattern = '^\\w+: \\d'"),
        ("never", "pattern = 'nan'"),
        ("field", "name = 'Pitch'\ntruth = true\ntolerance = 0.5"),
        ("field", "name = 'GYR.z'\nvalue = 560\ntolerance = 70\nfrom = '1s'"),
        ("within", "name = 'Yaw'\nmin = -180\nmax = 180"),
        ("within", "name = 'Yaw'\nmin = -9\nmax = 9\nmin_difference = 4"),
        ("printed", "name = 'Pre'\nmax_gap = '1.5s'"),
        ("led", "led = 'led1'\nstate = 'off'"),
        ("ticks", "late_max = 0\nlost_min = 2\nrate_hz = 800"),
        ("hard_iron", "within_mgauss = 30"),
    ],
)
def test_open_expectation_describes_itself(tmp_path: Path, kind: str, keys: str, words: Words) -> None:
    plan = load_scenario(write(tmp_path, f"{IDEAL}[[expect]]\nkind = '{kind}'\n{keys}\n"))
    (verdict,) = plan.results(Board(scenario=plan))
    assert verdict.state == "open"
    words("scenario", verdict.says)


def test_differing_lines_are_shown(tmp_path: Path) -> None:
    keys = "kind = 'line'\ntext = 'ACC[x,y,z] 0 mg 0 mg 1008 mg'"
    (finding,) = play(tmp_path, f"{IDEAL}[[expect]]\n{keys}\n").findings
    assert finding.diff == ("-ACC[x,y,z] 0 mg 0 mg 1008 mg", "+ACC[x,y,z] 0 mg 0 mg 1000 mg")


def test_text_is_compared_byte_by_byte(tmp_path: Path) -> None:
    text = f"{IDEAL}[[expect]]\nkind = 'text'\nfile = 'golden.txt'\n"
    golden = tmp_path / "golden.txt"
    golden.write_bytes(b"")
    (finding,) = play(tmp_path, text).findings
    assert finding.fault == "wrong format"

    board = Board(scenario=tmp_path / "case.toml")
    board.run_for(2.5)
    printed = board.terminal.text.encode("latin-1")
    golden.write_bytes(printed.replace(b" FH ", b" FW "))
    assert play(tmp_path, text).passed

    golden.write_bytes(printed.replace(b"1000 mg \n\r", b"1008 mg \n\r"))
    (finding,) = play(tmp_path, text).findings
    assert finding.fault == "wrong value"
    assert finding.diff[0] == "@@ line 12 @@"
    assert "-ACC[x,y,z] 0 mg 0 mg 1008 mg " in finding.diff
    assert "+ACC[x,y,z] 0 mg 0 mg 1000 mg " in finding.diff

    golden.write_bytes(printed.replace(b" \n\r", b"\n\r"))  # blanks do count here
    (finding,) = play(tmp_path, text).findings
    assert finding.fault == "wrong format"

    golden.write_bytes(printed + b"more\n")
    assert play(tmp_path, text).failed_count == 1


def test_longer_text_differs_in_its_next_line(tmp_path: Path) -> None:
    text = f"{IDEAL}[[expect]]\nkind = 'text'\nfile = 'golden.txt'\n"
    golden = write(tmp_path, text).with_name("golden.txt")
    golden.write_bytes(b"")
    board = Board(scenario=tmp_path / "case.toml")
    board.run_for(2.5)
    printed = board.terminal.text.encode("latin-1")
    lines = printed.split(b"\n")

    golden.write_bytes(printed + b"\nmore")
    (finding,) = play(tmp_path, text).findings
    assert finding.fault == "missing"
    assert finding.diff[0] == f"@@ line {len(lines) + 1} @@"
    assert finding.diff[-1] == "-more"
    golden.write_bytes(b"\n".join(lines[:5]))
    (finding,) = play(tmp_path, text).findings
    assert finding.diff[0] == "@@ line 6 @@"
    assert [line[0] for line in finding.diff[1:]] == [" "] * 3 + ["+"] * 6


def test_truth_is_taken_at_time_of_printing(tmp_path: Path) -> None:
    """The board sweeps at 20 degrees a second. With a settling time of 0, the delay of the sensors is visible."""
    turn = "[[timeline]]\ndo = 'sweep'\naxis = 'pitch'\nto_deg = 30\nat = '1s'\nfor = '1.5s'\n"
    field = "[[expect]]\nkind = 'field'\nname = 'Pitch'\ntruth = true\n"
    assert play(tmp_path, f"{IDEAL}{turn}{field}tolerance = 0.2\n").passed
    assert not play(tmp_path, f"{IDEAL}{turn}{field}tolerance = 0.001\nsettle = '0s'\n").passed


def test_truth_survives_jumps_of_world(tmp_path: Path) -> None:
    """The world drops history that is five seconds older than a jump. By then the recorder has noted the truth."""
    head = HEAD + 'duration = "12s"\n[sensors]\nquality = "ideal"\n'
    jumps = "".join(
        f"[[timeline]]\ndo = 'set_attitude'\npitch_deg = {second * 7 % 50}\nat = '{second}.7s'\n"
        for second in range(12)
    )
    field = "[[expect]]\nkind = 'field'\nname = 'Pitch'\ntruth = true\ntolerance = 0.2\n"
    assert play(tmp_path, head + jumps + field).passed


def test_motion_after_jump_starts_from_new_attitude(tmp_path: Path) -> None:
    """A jump discards later plans, so the sweep begins after the jump, from the angles at that time."""
    head = HEAD + 'duration = "8s"\n[sensors]\nquality = "ideal"\n'
    timeline = (
        "[[timeline]]\ndo = 'rotate_to'\npitch_deg = 50\nfor = '2s'\n"
        "[[timeline]]\ndo = 'set_attitude'\nroll_deg = 40\nat = '3s'\n"
        "[[timeline]]\ndo = 'sweep'\naxis = 'pitch'\nto_deg = 30\nat = '5s'\nfor = '1s'\n"
    )

    def field(name: str, value: float, start: str, end: str) -> str:
        window = f"from = '{start}'\nto = '{end}'\n"
        return f"[[expect]]\nkind = 'field'\nname = '{name}'\nvalue = {value}\ntolerance = 0.2\n{window}"

    checks = (
        field("Pitch", 50, "2.1s", "3s")
        + field("Pitch", 0, "3.1s", "5s")
        + field("Roll", 40, "3.1s", "5s")
        + field("Pitch", 30, "6.1s", "8s")
    )
    result = play(tmp_path, head + timeline + checks)
    assert result.passed, result.lines


def test_malformed_line_is_not_reported_as_wrong_value() -> None:
    expectation = ExpectField.model_validate(
        {"kind": "field", "name": "Pitch", "value": 1.0, "tolerance": 0.1}
    )
    board = Board()
    for text, fault in (
        ("Pitch: 1.000000 deg Roll: 2.000000 deg Yaw: 3.000000 deg", None),
        ("Pitch: -1.000000 deg Roll: 2.000000 deg Yaw: 3.000000 deg", "wrong value"),
        ("Pitch: nan deg Roll: 2.000000 deg Yaw: 3.000000 deg", "wrong value"),
        ("Pitch: 1.00 deg Roll: 2.000000 deg Yaw: 3.000000 deg", "wrong format"),
        ("Pitch: 1.000000 deg Roll: 2.000000 deg", "wrong format"),
        ("Pitch: 1.000000", "wrong format"),
        ("The Pitch: 1.000000 deg Roll: 2.000000 deg Yaw: 3.000000 deg", "wrong format"),
        ("The pitch was not computed", "missing"),
    ):
        result = expectation.evaluate(RunView(board, [PrintedLine(1, text, 0)], 10**12))
        assert result.fault == fault, text


def test_non_number_is_not_described_as_deviation(words: Words) -> None:
    expectation = ExpectField.model_validate(
        {"kind": "field", "name": "Pitch", "value": 1.0, "tolerance": 0.1}
    )
    lines = [
        PrintedLine(at, f"Pitch: {pitch} deg Roll: 2.000000 deg Yaw: 3.000000 deg", at)
        for at, pitch in enumerate(("nan", "3.500000", "-inf", "1.000000", "2.000000"))
    ]
    board = Board()

    def seen(*chosen: PrintedLine) -> str:
        result = expectation.evaluate(RunView(board, list(chosen), 10**12))
        return result.seen

    words("scenario", seen(*lines))
    words("scenario", seen(lines[0], lines[3]))


@pytest.mark.parametrize(
    ("text", "difference"),
    [
        ("Pitch = 1.000000 deg Roll = 2.000000 deg Yaw = 3.000000 deg", '"=" in place of ":"'),
        ("Pitch: 1.0 deg Roll: 2.0 deg Yaw: 3.0 deg", "%.1f"),
        ("pitch: 1.000000 deg Roll: 2.000000 deg Yaw: 3.000000 deg", '"pitch" in place of "Pitch"'),
        ("Pitch: 1 deg Roll: 2 deg Yaw: 3 deg", "%d"),
        ("Pitch: 1.000000 Roll: 2.000000 Yaw: 3.000000", '"Roll" in place of "deg"'),
        ("Pitch: 1.000000 deg Roll: 2.000000 deg", '"Yaw" is missing'),
        ("Pitch:1.000000 deg Roll:2.000000 deg Yaw:3.000000 deg", "spaces"),
        ("Roll: 1.000000 deg", '"Roll" in place of "Pitch"'),
    ],
)
@pytest.mark.parametrize("kind", ["field", "printed", "within"])
def test_line_in_another_format_shows_difference(kind: str, text: str, difference: str) -> None:
    keys = {
        "field": {"value": 1.0, "tolerance": 0.1},
        "printed": {"max_gap": "1s"},
        "within": {"min": -90, "max": 90},
    }
    table = {"kind": kind, "name": "Pitch", **keys[kind]}
    expectation = TypeAdapter(AnyExpectation).validate_python(table)
    result = expectation.evaluate(RunView(Board(), [PrintedLine(1, text, 0)], 10**12))

    assert result.fault == "wrong format"
    assert difference in result.seen


@pytest.mark.parametrize("line_format", FORMATS, ids=lambda line_format: line_format.label)
@given(data=st.data())
def test_numbers_are_parsed_with_their_sign(line_format: object, data: st.DataObject) -> None:
    (chosen,) = (entry for entry in FORMATS if entry is line_format)
    numbers = [data.draw(st.integers(-99_999, 99_999)) for _ in chosen.fields]
    text = chosen.text
    for number in numbers:
        text = text.replace("%d", f"{number}", 1) if "%d" in text else text.replace("%f", f"{number:.6f}", 1)
    assert chosen.parse(text) == dict(zip(chosen.fields, map(float, numbers), strict=True))
    assert chosen.parse("x" + text) is None
    assert chosen.parse(text + "0") is None


@given(st.floats(-720, 720), st.floats(-720, 720))
def test_angle_difference_takes_shorter_way_round(printed: float, wanted: float) -> None:
    error = deviation("Yaw", printed, wanted)
    assert -180 <= error <= 180
    assert ((printed - wanted - error) / 360) == pytest.approx(round((printed - wanted - error) / 360))
    assert deviation("Altitude", printed, wanted) == printed - wanted


@pytest.mark.parametrize(("printed", "wanted", "error"), [(179, -179, -2), (-179, 179, 2), (5.5, -5.5, 11)])
def test_angles_wrap_and_keep_their_sign(printed: float, wanted: float, error: float) -> None:
    assert deviation("Yaw", printed, wanted) == pytest.approx(error)


def test_only_banner_has_two_accepted_spellings() -> None:
    assert same_banner("STEVAL-FCU001V1 FW rev.1.0") == "STEVAL-FCU001V1 FH rev.1.0"
    assert same_banner("FW rev.1.0") == "FW rev.1.0"


def test_report_compares_printed_values_with_truth(tmp_path: Path, words: Words) -> None:
    result = play(tmp_path, f"{IDEAL}[[report]]\nfield = 'Pitch'\nagainst = 'truth'\n")
    words("scenario", f"{result.reports[0]}\n{result.reports[-1]}")
    assert len(result.reports) == 5


def test_report_covers_part_of_run(tmp_path: Path, words: Words) -> None:
    report = "[[report]]\nfield = 'Pitch'\nagainst = 'truth'\nfrom = '{}'\n"
    result = play(tmp_path, f"{IDEAL}{report.format('1.5s')}")
    assert result.reports[-1].endswith(" 1 printed value")
    words("scenario", f"{result.reports[0]}\n{result.reports[-1]}")
    with pytest.raises(ScenarioError, match="60 s") as refused:
        play(tmp_path, f"{IDEAL}{report.format('60s')}")
    assert (refused.value.key, refused.value.kind) == ("report[0].from", "after_end")


def test_report_and_expectation_show_true_value(tmp_path: Path, words: Words) -> None:
    """The board sweeps at 20 degrees a second: printed values are a little old, and one print has two errors."""
    turn = "[[timeline]]\ndo = 'sweep'\naxis = 'pitch'\nto_deg = 30\nat = '1s'\nfor = '1.5s'\n"
    field = "[[expect]]\nkind = 'field'\nname = 'Pitch'\ntruth = true\ntolerance = 0.0001\n"
    report = "[[report]]\nfield = 'Pitch'\nagainst = 'truth'\n"
    result = play(tmp_path, f"{IDEAL}{turn}{field}{report}")
    (finding,) = result.findings
    *_, summary, counted = result.reports

    words("scenario", finding.expected)
    largest, taken = (
        float(re.findall(r"largest (?:error )?(\S+?)(?:,|$)", line)[0]) for line in (summary, counted)
    )
    words("scenario", counted.rpartition(": ")[0])
    assert abs(taken) < 0.05 < abs(largest)


def test_report_without_printed_values_is_explained(tmp_path: Path, words: Words) -> None:
    result = play(tmp_path, f"{SHORT}firmware = 'template'\n[[report]]\nfield = 'Yaw'\nagainst = 'truth'\n")
    (line,) = result.reports
    words("scenario", line)


def test_report_marks_angles_of_accelerated_board(tmp_path: Path) -> None:
    """Slides, "eCompass math": the tilt is valid only if the modulus is near g."""
    file = tmp_path / "shaken.toml"
    file.write_text(
        'schema = 1\nquestion = "?"\nduration = "4s"\n[[timeline]]\ndo = "shake"\nat = "2s"\nfor = "1s"\n'
        'axis = "up"\namplitude_g = 0.5\nfrequency_hz = 200\n'
        '[[report]]\nfield = "Pitch"\nagainst = "truth"\n'
    )
    rows = run(Board(scenario=file)).reports
    flagged = [row for row in rows if "tilt" in row]
    assert 0 < len(flagged) < len(rows) - 3


def test_unevaluated_expectation_is_neither_met_nor_failed() -> None:
    met, failed = ExpectationResult("a"), ExpectationResult("b", "wrong value")
    result = Result((met, failed, ExpectationResult("c", "stopped")))

    assert (result.passed_count, result.failed_count, result.checks) == (1, 1, 3)
    assert not result.judged
