"""``fcu move``: move a running board."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import click

from fcu_emulator.emulator.cli.options import MoveOptions
from fcu_emulator.emulator.clock import parse_duration
from fcu_emulator.emulator.errors import InputError
from fcu_emulator.emulator.links.control import RunningBoard, the_running_board
from fcu_emulator.emulator.live.gestures import GESTURES, OLD_WORDS
from fcu_emulator.emulator.text import visible

_ANGLES = ("roll_deg", "pitch_deg", "yaw_deg")
_PUSHED_FOR = "1s"


def move(options: MoveOptions) -> None:
    """Move the running board and print the attitude that it had before. Raises InputError."""
    new_word = OLD_WORDS.get(options.gesture or "")
    if new_word is not None:
        click.echo(f"fcu: warning: {options.gesture} is now called {new_word}; use that word", err=True)
        options = replace(options, gesture=new_word)
    board = the_running_board(options.board)
    truth = _asked(board, {"type": "truth"})
    planned = entries(options, truth)
    for entry in planned:
        truth = _asked(board, {"type": "do", "entry": entry})
    click.echo(f"{visible(board.name)}: {'moves from' if planned else 'is at'} {_shown(truth)}")


def entries(options: MoveOptions, truth: dict[str, Any]) -> list[dict[str, Any]]:
    """Return timeline entries for the user's options. ``truth`` is the board's state."""
    if options.duration is not None:
        try:
            parse_duration(options.duration)
        except ValueError as error:
            raise InputError(f"--for {error}") from error
    angles = dict(zip(_ANGLES, (options.roll, options.pitch, options.yaw), strict=True))
    ways = {"north_m": options.north or 0.0, "east_m": options.east or 0.0, "up_m": options.up or 0.0}
    turned = any(angle is not None for angle in angles.values())
    pushed = any(ways.values())
    if options.gesture is None:
        if options.axis is not None:
            raise InputError("--axis must be used with a gesture: fcu move tap --axis up")
        if not turned and not pushed and options.duration:
            raise InputError(
                "give an angle such as --roll 30, a distance such as --up 0.5, or a gesture such as lift"
            )
        turns = [_turn(angles, options.duration, truth)] if turned else []
        return turns + [{"do": "move", "for": options.duration or _PUSHED_FOR, **ways}] * pushed
    if turned or pushed:
        other = "an angle" if turned else "a distance"
        raise InputError(f"{options.gesture} must be given without {other}; use two commands")
    gesture = GESTURES[options.gesture]
    if options.amount is not None and gesture.usual is None:
        raise InputError(f"{options.gesture} must be given without a number")
    if options.duration is not None and not gesture.takes_time:
        raise InputError(f"{options.gesture} must be given without --for")
    if options.axis is not None and not gesture.takes_axis:
        raise InputError(f"{options.gesture} must be given without --axis")
    amount = (gesture.usual or 0.0) if options.amount is None else options.amount
    if options.gesture == "figure_eight" and amount % 1:
        raise InputError(f"turns must be a whole number, not {amount:g}")
    return gesture.entries(amount, options.duration, options.axis)


def _turn(angles: dict[str, float | None], duration: str | None, truth: dict[str, Any]) -> dict[str, Any]:
    """Return a timeline entry that turns the board. None means that an angle does not change."""
    target = {name: truth[name] if angle is None else angle for name, angle in angles.items()}
    how = {"do": "follow_attitude"} if duration is None else {"do": "rotate_to", "for": duration}
    return how | target


def _asked(board: RunningBoard, message: dict[str, Any]) -> dict[str, Any]:
    """Send a message and return the board's new state. Raises InputError."""
    (answer,) = board.ask(message)
    if "error" in answer:
        raise InputError(str(answer["error"]))
    truth = answer.get("truth")
    if not isinstance(truth, dict):
        raise InputError(
            f"the board {board.name} answers {str(answer)[:80]}; use the same version of fcu for both"
        )
    return {"t_s": answer.get("t_s", 0.0)} | truth


def _shown(truth: dict[str, Any]) -> str:
    roll, pitch, yaw = (f"{name[:-4]} {truth[name]:.1f}" for name in _ANGLES)
    return f"{roll}, {pitch}, {yaw} deg, {truth['altitude_m']:.2f} m, at {truth['t_s']:.3f} s of the board's time"
