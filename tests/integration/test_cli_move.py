"""``fcu move``: a running board is moved from another terminal."""

from __future__ import annotations

import contextlib
import json
import random
import socket
import subprocess
import sys
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import click
import numpy as np
import pytest

from fcu_emulator import Board
from fcu_emulator.emulator.cli.commands import cli
from fcu_emulator.emulator.cli.move import MoveOptions, entries, move
from fcu_emulator.emulator.errors import InputError
from fcu_emulator.emulator.links.control import ControlServer, running_boards
from fcu_emulator.emulator.links.runner import Runner
from fcu_emulator.emulator.live.control import ControlRequests
from fcu_emulator.emulator.live.gestures import GESTURES, OLD_WORDS, buttons
from tests.support.words import Words

DEADLINE_S = 30.0
FLAT = {"roll_deg": 1.0, "pitch_deg": 2.0, "yaw_deg": 3.0, "altitude_m": 0.0}


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Return a runtime folder for this test."""
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    monkeypatch.setenv("LOCALAPPDATA", str(tmp_path))


@contextlib.contextmanager
def running(board: Board) -> Iterator[Board]:
    """Run a board in real time, with a control server as in ``fcu run``."""
    with contextlib.closing(ControlServer("lab3", [], ControlRequests(board).answer)) as door:
        runner = Runner(board, [], None, 1.0)
        thread = threading.Thread(target=lambda: runner.run(lambda _: door.serve()))
        thread.start()
        try:
            yield board
        finally:
            runner.stop()
            thread.join(DEADLINE_S)


def attitude(board: Board, at_s: float) -> list[float]:
    return [round(float(one), 3) for one in board.world.attitude_deg(np.array([at_s]))[0]]


def options(gesture: str | None = None, amount: float | None = None, **more: Any) -> MoveOptions:
    return MoveOptions(gesture=gesture, amount=amount, **more)


# -- what the arguments mean --------------------------------------------------------------------------------


def test_single_angle_option_keeps_other_angles() -> None:
    assert entries(options(roll=30.0), FLAT) == [
        {"do": "follow_attitude", "roll_deg": 30.0, "pitch_deg": 2.0, "yaw_deg": 3.0}
    ]


def test_duration_option_sets_time_of_motion() -> None:
    (entry,) = entries(options(roll=30.0, yaw=-90.0, duration="1s"), FLAT)
    assert entry == {"do": "rotate_to", "for": "1s", "roll_deg": 30.0, "pitch_deg": 2.0, "yaw_deg": -90.0}


def test_north_east_and_up_options_push_board() -> None:
    (entry,) = entries(options(north=0.3, up=-0.1), FLAT)
    assert entry == {"do": "move", "for": "1s", "north_m": 0.3, "east_m": 0.0, "up_m": -0.1}
    turn, push = entries(options(yaw=90.0, east=0.2, duration="2s"), FLAT)
    assert (turn["do"], turn["for"], push["do"], push["for"]) == ("rotate_to", "2s", "move", "2s")
    board = Board()
    assert "truth" in ControlRequests(board).answer({"type": "do", "entry": entry})
    np.testing.assert_allclose(board.world.position_m([1.0]), [[0.3, 0.0, -0.1]], atol=1e-12)


def test_command_accepts_current_and_old_gestures() -> None:
    (argument,) = [one for one in cli.commands["move"].params if one.name == "gesture"]
    assert isinstance(argument.type, click.Choice)
    assert list(argument.type.choices) == [*GESTURES, *OLD_WORDS]


def test_gestures_have_same_names_as_in_scenarios() -> None:
    for word, gesture in GESTURES.items():
        done = {entry["do"] for entry in gesture.entries(gesture.usual or 0.0, None, None)}
        assert done == ({"follow_attitude", "follow_altitude"} if word == "flat" else {word})


def test_every_page_button_is_working_gesture() -> None:
    for one in buttons():
        assert one["word"] in GESTURES
        assert one["label"].lower().replace(" ", "_").startswith(one["word"])
        board = Board()
        for entry in one["entries"]:
            assert "truth" in ControlRequests(board).answer({"type": "do", "entry": entry})
        board.run_for(0.01)


def test_calibration_gesture_moves_like_hand() -> None:
    """The motion is not along the field.

    At the rates of a hand, the middle of the extremes is near the hard iron, but not equal to it.
    """
    board = Board(ideal=True)
    board.world.set_hard_iron(120, -80, 45)
    for entry in entries(options("figure_eight"), FLAT):
        assert "truth" in ControlRequests(board).answer({"type": "do", "entry": entry})
    t_s = np.linspace(0, 12, 2401)
    seen = board.world.magnetic_field_mgauss(t_s)
    error = np.abs((seen.max(axis=0) + seen.min(axis=0)) / 2 - [120, -80, 45])
    assert 2 < error.max() < 35
    assert np.abs(board.world.angular_rate_dps(t_s)).max() < 500


@pytest.mark.parametrize("word", GESTURES)
def test_every_gesture_is_executed_by_board(word: str) -> None:
    board = Board()
    for entry in entries(options(word), FLAT):
        assert "truth" in ControlRequests(board).answer({"type": "do", "entry": entry})
    board.run_for(0.01)


@pytest.mark.parametrize(
    "given",
    [
        options("free_fall", 3.0),
        options("flat", duration="1s"),
        options("lift", axis="up"),
        options("tap", roll=3.0),
        options("tap", east=3.0),
        options("figure_eight", 1.5),
        options(roll=3.0, duration="3"),
        options(duration="3s"),
        options(roll=3.0, axis="up"),
    ],
)
def test_unsuitable_options_are_refused_in_one_line(given: MoveOptions, words: Words) -> None:
    with pytest.raises(InputError) as caught:
        entries(given, FLAT)
    words("move", str(caught.value))


# -- a board that runs --------------------------------------------------------------------------------------


def test_move_command_turns_board_and_prints_attitude(capsys: pytest.CaptureFixture[str]) -> None:
    with running(Board(ideal=True)) as board:  # without firmware, which one thread runs
        move(options(pitch=30.0, duration="100ms"))
        move(options("lift", 2.0, duration="200ms"))
    board.run_for(1.0)
    assert attitude(board, board.now_s) == [0.0, 30.0, 0.0]
    assert board.world.altitude_m(np.array([board.now_s]))[0] == pytest.approx(2.0)
    first, second = capsys.readouterr().out.splitlines()
    assert first.startswith("lab3: moves from roll 0.0, pitch ")
    assert "roll 0.0, pitch " in second


@pytest.mark.parametrize("old", OLD_WORDS)
def test_old_gesture_works_with_warning(old: str, capsys: pytest.CaptureFixture[str]) -> None:
    with running(Board()):
        move(options(old))
    output = capsys.readouterr()
    (warning,) = output.err.splitlines()
    assert OLD_WORDS[old] in warning
    assert output.out.startswith("lab3: moves from")


def test_flat_command_restores_level_attitude(capsys: pytest.CaptureFixture[str]) -> None:
    board = Board()
    board.world.set_attitude(10, 20, 30)
    board.world.set_altitude(5)
    with running(board):
        move(options("flat"))
    board.run_for(2.0)
    assert attitude(board, board.now_s) == [0.0, 0.0, 0.0]
    assert board.world.altitude_m(np.array([board.now_s]))[0] == pytest.approx(0.0)


def test_impossible_move_is_refused_and_board_continues() -> None:
    with running(Board()):
        with pytest.raises(InputError, match="metres"):
            move(options("lift", 1e9))
        move(options("tap"))


def test_board_with_scenario_is_not_moved() -> None:
    board = Board(scenario="desk")
    with pytest.raises(InputError, match=r"\bdesk\b") as refused:
        ControlRequests(board).answer({"type": "do", "entry": {"do": "tap"}})
    assert refused.value.kind == "moved_by_scenario"
    assert ControlRequests(board).answer({"type": "truth"})["t_s"] == 0.0


@pytest.mark.parametrize(
    "message",
    [
        {},
        {"type": "reset"},
        {"type": "do"},
        {"type": "do", "entry": {}},
        {"type": "do", "entry": {"do": "tap", "for": "1h", "at": "3s"}},
        {"type": "do", "entry": {"do": "replay", "csv": "/etc/passwd"}},
        {"type": "do", "entry": {"do": "follow_attitude", "roll_deg": float("nan")}},
        {"type": ["do"], "entry": 3},
    ],
)
def test_invalid_message_is_refused_without_change(message: dict[str, Any]) -> None:
    board = Board()
    with pytest.raises(InputError) as caught:
        ControlRequests(board).answer(message)
    assert "\n" not in str(caught.value)
    assert attitude(board, 1.0) == [0.0, 0.0, 0.0]


def test_random_messages_do_not_stop_board() -> None:
    draw = random.Random(8)
    words = [
        "do",
        "type",
        "entry",
        "tap",
        "lift",
        "for",
        "1s",
        "roll_deg",
        1,
        -1e308,
        None,
        [],
        {},
        "truth",
        True,
    ]
    with running(Board()) as board:
        (found,) = running_boards()
        with socket.create_connection(("127.0.0.1", found.port), DEADLINE_S) as connection:
            connection.sendall(json.dumps({"token": found.token}).encode() + b"\n")
            lines = connection.makefile("rb")
            lines.readline()
            for _ in range(1000):
                entry = {str(draw.choice(words)): draw.choice(words) for _ in range(3)} | {
                    "do": draw.choice(words)
                }
                message = {"type": draw.choice(words), "entry": entry}
                connection.sendall(json.dumps(message).encode() + b"\n")
            answers = [json.loads(lines.readline()) for _ in range(1000)]
        assert all(answer.keys() <= {"error", "truth", "t_s"} for answer in answers)
        before_s = board.now_s
        move(options("tap"))
    assert board.now_s >= before_s


# -- the command --------------------------------------------------------------------------------------------


def fcu_move(*arguments: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "fcu_emulator", "move", *arguments]
    return subprocess.run(command, capture_output=True, text=True, check=False, timeout=60)


def test_move_command_moves_board_of_another_process(tmp_path: Path, words: Words) -> None:
    run = [
        sys.executable,
        "-m",
        "emulator",
        "run",
        "lab3",
        "--serial",
        f"file:{tmp_path / 'text'}",
        "--speed",
        "1",
    ]
    with subprocess.Popen(run, stderr=subprocess.PIPE) as board:
        assert board.stderr is not None
        while b"to the file" not in board.stderr.readline():
            pass
        while not running_boards():
            pass
        done = fcu_move("--roll", "-30", "--for", "50ms")
        assert (done.returncode, done.stderr) == (0, "")
        assert fcu_move("lift", "-0.5").returncode == 0
        assert fcu_move("lift", "much").returncode == 2
        assert fcu_move("dance").returncode == 2
        board.terminate()
    done = fcu_move("tap")
    assert done.returncode == 2
    words("move", done.stderr)
