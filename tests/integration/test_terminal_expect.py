"""``terminal.expect``: the text that it searches, and the contents of its error."""

from __future__ import annotations

from pathlib import Path

import pytest

from fcu_emulator import Board, ExpectationError

BROKEN = Path(__file__).parents[1] / "arm" / "broken"


def test_text_before_call_does_not_match() -> None:
    board = Board("lab3", ideal=True)
    board.run_for(1.5)
    assert "Pitch: 0.000000 deg" in board.terminal.text

    board.world.set_attitude(roll_deg=0, pitch_deg=40, yaw_deg=0)
    with pytest.raises(ExpectationError):
        board.terminal.expect(r"Pitch: 0\.000000 deg", timeout_s=2.5)


def test_expect_from_start_matches_earlier_text() -> None:
    board = Board("lab3")
    board.run_for(1.5)

    assert board.terminal.expect("STEVAL", since=0).start() == 0
    assert board.now_s == 1.5


def test_since_argument_accepts_earlier_position() -> None:
    board = Board("lab3")
    board.run_for(1.04)
    noted = board.terminal.position
    board.run_for(0.3)

    assert board.terminal.expect(r"Altitude: \S+ m", since=noted)
    assert board.now_s == pytest.approx(1.34)


def test_consecutive_expects_match_within_one_transmission() -> None:
    board = Board("lab3")
    first = board.terminal.expect("STEVAL-")
    second = board.terminal.expect("FCU001V1")

    assert (first[0], second[0]) == ("STEVAL-", "FCU001V1")
    assert board.now_s < 0.05


def test_error_has_latest_lines_and_diagnosis() -> None:
    board = Board(BROKEN / "flag_never_set.elf")
    with pytest.raises(ExpectationError) as error:
        board.terminal.expect("Pitch", timeout_s=0.2)

    assert error.value.lines == ()
    assert error.value.diagnosis.startswith("stuck in waitForData(), flag_never_set.c:8")
    assert f":\n  {error.value.diagnosis.splitlines()[0]}" in str(error.value)


def test_error_of_working_firmware_has_no_diagnosis() -> None:
    board = Board("lab3", ideal=True)
    with pytest.raises(ExpectationError) as error:
        board.terminal.expect("never", timeout_s=1.5)

    assert error.value.lines[-1] == "*****"
    assert error.value.lines[-2] == "Altitude: 0.000000 m"
    assert error.value.diagnosis == ""
