"""CSV recordings: accepted files, and refusal of hostile files."""

from __future__ import annotations

import os
import re
import tracemalloc
from pathlib import Path

import numpy as np
import pytest

from fcu_emulator.emulator.errors import InputError, RecordingError
from fcu_emulator.emulator.world import World, load_recording
from tests.support.words import Words

FULL_HEADER = "t_s,ax_g,ay_g,az_g,gx_dps,gy_dps,gz_dps,mx_uT,my_uT,mz_uT,p_hPa,temp_C"
ATTITUDE_HEADER = "t_s,roll_deg,pitch_deg,yaw_deg"


def write(folder: Path, text: str | bytes) -> Path:
    path = folder / "data.csv"
    path.write_bytes(text.encode() if isinstance(text, str) else text)
    return path


def refusal(path: Path) -> RecordingError:
    with pytest.raises(RecordingError) as caught:
        load_recording(path)
    assert "\n" not in str(caught.value)
    assert str(path) in str(caught.value)
    assert len(str(caught.value)) < 400 + len(str(path))
    return caught.value


def test_all_signals_are_replayed_in_units_of_world(tmp_path: Path) -> None:
    rows = "0,0,0,1,1,2,3,20,0,-40,970,20\n2,0.5,0,0,3,2,1,10,0,-20,980,30\n"
    recording = load_recording(write(tmp_path, f"{FULL_HEADER}\n{rows}"))
    world = World()
    assert world.replay(recording, start_s=1) == 3.0
    t = [1.0, 2.0, 3.0, 9.0]
    np.testing.assert_allclose(world.specific_force_g(t)[:, 0], [0, 0.25, 0.5, 0.5])
    np.testing.assert_allclose(world.angular_rate_dps(t)[:, 2], [3, 2, 1, 1])
    np.testing.assert_allclose(world.magnetic_field_mgauss(t)[:, 2], [-400, -300, -200, -200])
    np.testing.assert_allclose(world.pressure_hpa(t), [970, 975, 980, 980])
    np.testing.assert_allclose(world.temperature_degc(t), [20, 25, 30, 30])


def test_recorded_attitude_is_followed_with_or_without_altitude(tmp_path: Path) -> None:
    world = World()
    world.replay(load_recording(write(tmp_path, f"{ATTITUDE_HEADER}\n0,0,0,0\n2,0,60,0\n")))
    np.testing.assert_allclose(world.attitude_deg([1.0, 5.0])[:, 1], [30, 60])
    assert world.altitude_m([1.0])[0] == 0
    world.replay(load_recording(write(tmp_path, f"{ATTITUDE_HEADER},alt_m\n0,0,0,0,1\n2,0,60,0,3\n")))
    np.testing.assert_allclose(world.altitude_m([1.0, 5.0]), [2, 3])


@pytest.mark.parametrize(
    "text",
    [
        "t_s,p_hPa\n0,970\n1,971\n",
        "t_s, p_hPa \r\n0 ,\t970\r\n1, 971\r\n",
        "\ufefft_s,p_hPa\n0.0,+9.7e2\n1,971",
        "p_hPa,t_s\n970,0\n971,1\n",
    ],
    ids=["plain", "spaces and CR LF", "Excel's mark, exponent, no last line feed", "another order"],
)
def test_alternative_spellings_are_accepted(tmp_path: Path, text: str) -> None:
    recording = load_recording(str(write(tmp_path, text)))
    assert list(recording.groups) == ["pressure"]
    np.testing.assert_array_equal(recording.t_s, [0, 1])
    np.testing.assert_array_equal(recording.groups["pressure"], [970, 971])


@pytest.mark.parametrize(
    ("header", "kind"),
    [
        ("", "no_header"),
        ("\n0,1", "no_header"),
        ("time,p_hPa", "unknown_column"),
        ("t_s,ax,ay,az", "unknown_column"),
        ("t_s,P_hPa", "unknown_column"),
        ("t_s;p_hPa", "unknown_column"),
        ("0,970", "unknown_column"),
        ("t_s,,p_hPa", "unknown_column"),
        ("t_s,p_hPa,p_hPa", "column_twice"),
        ("p_hPa,temp_C", "missing_column"),
        ("t_s", "no_column"),
        ("t_s,ax_g,az_g", "incomplete_group"),
        ("t_s,gz_dps", "incomplete_group"),
        ("t_s,yaw_deg", "incomplete_group"),
        ("t_s,north_m", "incomplete_group"),
        ("t_s,p_hPa,alt_m", "mixed_columns"),
        (f"{ATTITUDE_HEADER},temp_C", "mixed_columns"),
    ],
)
def test_wrong_header_is_reported(tmp_path: Path, header: str, kind: str, words: Words) -> None:
    error = refusal(write(tmp_path, f"{header}\n" if header else ""))
    assert (error.line, error.kind) == (1, kind)
    words("recording", error.problem)


@pytest.mark.parametrize(
    ("rows", "line", "kind"),
    [
        ("", 1, "no_rows"),
        ("0,970,20\n1,970\n", 3, "cell_count"),
        ("0,970,20,1\n", 2, "cell_count"),
        ("0,970,20\n\n1,970,20\n", 3, "cell_count"),
        ("0,970,\n", 2, "not_a_number"),
        ("0,970,20\n1,97O,20\n", 3, "not_a_number"),
        ('0,"970",20\n', 2, "not_a_number"),
        ("0,1_000,20\n", 2, "not_a_number"),
        ("0,0x3E8,20\n", 2, "not_a_number"),
        ("0,\u0669\u0667\u0660,20\n", 2, "not_a_number"),
        ("0,nan,20\n", 2, "out_of_range"),
        ("0,970,20\n1,970,inf\n", 3, "out_of_range"),
        ("0,970,20\n1,970,1e999\n", 3, "out_of_range"),
        ("0,97000,20\n", 2, "out_of_range"),
        ("nan,970,20\n", 2, "out_of_range"),
        ("-1,970,20\n", 2, "out_of_range"),
        ("1760000000,970,20\n", 2, "out_of_range"),
        ("0,970,20\n1,970,20\n1,970,20\n", 4, "time_order"),
        ("0,970,20\n2,970,20\n1,970,20\n", 4, "time_order"),
    ],
)
def test_wrong_row_is_reported_with_its_line(
    tmp_path: Path, rows: str, line: int, kind: str, words: Words
) -> None:
    error = refusal(write(tmp_path, f"t_s,p_hPa,temp_C\n{rows}"))
    assert (error.line, error.kind) == (line, kind)
    words("recording", error.problem)


@pytest.mark.parametrize("group", ["ax_g,ay_g,az_g", "gx_dps,gy_dps,gz_dps", "mx_uT,my_uT,mz_uT"])
def test_absurd_vectors_are_refused(tmp_path: Path, group: str) -> None:
    error = refusal(write(tmp_path, f"t_s,{group}\n0,0,0,0\n1,0,0,1e300\n"))
    assert (error.line, error.kind) == (3, "out_of_range")
    assert re.search(rf"{group.split(',')[2]} must be from .*, not 1e\+300", str(error))


@pytest.mark.parametrize(
    ("text", "kind", "cell"),
    [
        ("t_s,ax_g,ay_g,az_g\n0,1,2,-0\x008\n", "not_a_number", r"-0\x008"),
        ("t_s,p_hPa\n0,\x1b[31m\n", "not_a_number", r"\x1b[31m"),
        ("t_s,p_\x07hPa\n0,1\n", "unknown_column", r"p_\x07hPa"),
        ("t_s,p_hPa\n0,\u00e9\n", "not_a_number", r"\xc3\xa9"),
    ],
)
def test_refused_cell_is_shown_without_control_characters(
    tmp_path: Path, text: str, kind: str, cell: str
) -> None:
    error = refusal(write(tmp_path, text))
    assert error.kind == kind
    assert f"'{cell}'" in str(error)
    assert str(error).isprintable()


def test_binary_file_is_refused(tmp_path: Path) -> None:
    assert refusal(write(tmp_path, bytes(range(256)) * 4)).line == 1
    assert refusal(write(tmp_path, b"t_s,p_hPa\n0,970\n\x00\xff\x1b[2J,1\n")).line == 3


def test_endless_line_is_refused_early(tmp_path: Path) -> None:
    path = tmp_path / "zeros.csv"
    with path.open("wb") as stream:
        stream.truncate(60 * 2**20)
    tracemalloc.start()
    try:
        error = refusal(path)
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert (error.line, error.kind) == (1, "long_line")
    assert "4096" in str(error)
    assert peak < 2**20


def test_huge_file_is_refused_before_reading(tmp_path: Path) -> None:
    path = tmp_path / "huge.csv"
    with path.open("wb") as stream:
        stream.truncate(64 * 2**20 + 1)
    error = refusal(path)
    assert error.kind == "too_large"
    assert "64 MiB" in error.problem


def test_too_many_rows_are_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(
        "fcu_emulator.emulator.world.recording.MAX_ROWS", 3
    )  # two million rows take seconds to write
    rows = "".join(f"{i},970\n" for i in range(4))
    error = refusal(write(tmp_path, f"t_s,p_hPa\n{rows}"))
    assert (error.line, error.kind) == (5, "too_many_rows")
    assert "3" in error.problem
    assert load_recording(write(tmp_path, f"t_s,p_hPa\n{rows[:-6]}")).t_s.size == 3


def test_non_file_is_refused(tmp_path: Path) -> None:
    assert refusal(tmp_path / "absent.csv").kind == "unreadable"
    assert refusal(tmp_path).kind == "not_a_file"
    with pytest.raises(InputError):
        load_recording(os.devnull)
