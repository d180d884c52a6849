"""World, variables, and load of a running board, read without side effects."""

from __future__ import annotations

import difflib
import re
from collections.abc import Iterator
from typing import Any

import numpy as np

from fcu_emulator.emulator.analysis.recorder import TruthRecorder
from fcu_emulator.emulator.assembly.board import Board
from fcu_emulator.emulator.buses.i2c import I2CBus
from fcu_emulator.emulator.clock import PS_PER_S
from fcu_emulator.emulator.live import gestures, messages, transfers
from fcu_emulator.emulator.scenario import scenario_names
from fcu_emulator.emulator.text import shown
from fcu_emulator.emulator.world.attitude import matrix_to_euler
from fcu_emulator.emulator.world.track import Array

_MOST_LEAVES = 16  # maximum number of values that are shown for one variable
_LOOKS_OF_LOAD = 400  # number of samples in two seconds of virtual time


def hello(board: Board, ways: list[str], exercises: list[dict[str, Any]]) -> messages.Hello:
    """Return the session's constant data. ``ways``: commands that open the board's serial line."""
    from importlib.metadata import version

    return messages.Hello(
        board=board.description.name,
        version=version("fcu-emulator"),
        leds=list(board.leds),
        firmware=dict(board.description.firmware),
        scenarios=scenario_names(),
        parts=[part.NAME for part in board.sensors],
        outputs=transfers.outputs(board),
        ways=ways,
        gestures=gestures.buttons(),
        exercises=exercises,
    )


# -- The world ----------------------------------------------------------------------------------------------


def truth(board: Board) -> dict[str, Any]:
    """Return the current state of the world, in board axes.

    ``rotation``: matrix from board to world, nine numbers by rows. ``magnet_m``: magnet position
    north, west and up of the board, or null.
    """
    world, now = board.world, instant(board)
    rotation = world.rotation(now)
    roll, pitch, yaw = matrix_to_euler(rotation)[0]
    return {
        "rotation": [round(float(one), 6) for one in rotation.flat],
        "roll_deg": _short(roll),
        "pitch_deg": _short(pitch),
        "yaw_deg": _short(yaw),
        "altitude_m": _short(world.altitude_m(now)[0]),
        "magnet_m": None if (magnet := world.magnet(board.now_s)) is None else _vector(magnet[1:]),
        "rate_dps": _vector(world.angular_rate_dps(now)[0]),
        "acc_mg": _vector(1000.0 * world.specific_force_g(now)[0]),
        "mag_mgauss": _vector(world.magnetic_field_mgauss(now)[0]),
        "pressure_hpa": _short(world.pressure_hpa(now)[0]),
        "temperature_degc": _short(world.temperature_degc(now)[0]),
        "humidity_percent": _short(world.relative_humidity_percent(now)[0]),
    }


def instant(board: Board) -> Array:
    """Return the current time in s, shape (1,)."""
    return np.array([board.now_s])


def _short(value: Any) -> float:
    return round(float(value), 4) + 0.0  # no negative zero


def _vector(values: Any) -> list[float]:
    return [_short(one) for one in values]


# -- Variables ----------------------------------------------------------------------------------------------


def variable_names(board: Board) -> list[str]:
    """Return the firmware's global variables, in alphabetical order."""
    if board.chip is not None:
        symbols = board.chip.image.symbols
        return sorted({one.name for one in symbols.variables() if one.size}) if symbols else []
    return [
        name
        for name in ("acc", "gyro", "mag", "press", "pitch", "roll", "yaw", "altitude")
        if _has(board, name)
    ]


def _has(board: Board, name: str) -> bool:
    try:
        board.variable(name)
    except KeyError:
        return False
    return True


def variable(board: Board, path: str) -> dict[str, float]:
    """Return the finite numbers at a path such as ``pitch``, ``acc.AXIS_X`` or ``a[0]``."""
    return {name: value for name, value in numbers(board, path).items() if np.isfinite(value)}


def can_be_watched(board: Board, path: str) -> bool:
    """Return whether a path names a numeric global variable."""
    return bool(numbers(board, path))


def why_not_watched(board: Board, path: str) -> str:
    """Return the reason why a variable cannot be watched, and similar names."""
    names = variable_names(board)
    name = re.split(r"[.\[]", path, maxsplit=1)[0]
    if name in names:
        members = list(numbers(board, name))
        if not members:
            return f"cannot show the variable {name}: it has no numbers"
        return f"variable {name} has no {shown(path)}; it has {', '.join(members[:_MOST_LEAVES])}"
    if not names:
        return f"cannot show {shown(path)}: the firmware has no symbols"
    near = difflib.get_close_matches(name, names, n=3) or names[:8]
    return f"unknown variable {shown(path)}; the firmware has {', '.join(near)}"


def numbers(board: Board, path: str) -> dict[str, float]:
    """Return the numbers at a path, also those that are not finite; {} for an unknown variable."""
    name = re.split(r"[.\[]", path, maxsplit=1)[0]
    try:
        value = board.variable(name)
    except KeyError:
        return {}
    within = (path + ".", path + "[")
    return {one: value for one, value in _leaves(name, value) if one == path or one.startswith(within)}


def _leaves(name: str, value: Any, depth: int = 3) -> Iterator[tuple[str, float]]:
    if isinstance(value, bool | int | float | np.number):
        yield name, float(value)
    elif depth and isinstance(value, tuple | list):
        for index, one in enumerate(value[:_MOST_LEAVES]):
            yield from _leaves(f"{name}[{index}]", one, depth - 1)
    elif depth and not isinstance(value, str | bytes):
        members = getattr(value, "__dict__", None) or {
            key: getattr(value, key) for key in getattr(value, "_fields", getattr(value, "__slots__", ()))
        }
        for key, one in list(members.items())[:_MOST_LEAVES]:
            if not key.startswith("_"):
                yield from _leaves(f"{name}.{key}", one, depth - 1)


# -- Load ---------------------------------------------------------------------------------------------------


class Load:
    """Load of callback and serial line over two virtual seconds, and bus and line speeds."""

    def __init__(self, board: Board, recorder: TruthRecorder) -> None:
        self._board = board
        self._recorder = recorder
        self._before = 0, 0
        self._share = 0.0
        self._printed = 0, 0
        self._line = 0.0

    def figures(self) -> dict[str, float]:
        """Return timer counts, callback duration in ms, and the share of time in which the line is busy."""
        board, timer = self._board, self._board.timer
        looks, seen = self._recorder.looks_at_callback, self._recorder.callback_seen
        if looks - self._before[0] >= _LOOKS_OF_LOAD:
            self._share = (seen - self._before[1]) / (looks - self._before[0])
            self._before = looks, seen
        elif self._before == (0, 0) and looks:
            self._share = seen / looks
        now_ps, count = board.clock.now_ps, board.terminal.uart.received_count()
        passed_ps = now_ps - self._printed[0]
        if passed_ps >= PS_PER_S:
            self._line = (count - self._printed[1]) * board.terminal.uart.frames_ps(1) / passed_ps
            self._printed = now_ps, count
        rate_hz = timer.rate_hz if timer.ticks else 0.0
        period_ms = 1000.0 / rate_hz if rate_hz else 0.0
        return {
            "rate_hz": round(rate_hz, 3),
            "ticks": timer.ticks,
            "late": timer.late,
            "lost": timer.lost,
            "longest_wait_ms": round(1000 * timer.longest_wait_s, 4),
            "period_ms": round(period_ms, 4),
            "callback_ms": round(self._share * period_ms, 3),
            "callback_share": round(self._share, 3),
            "line_share": round(self._line, 3),
            **_speeds(board),
        }


def _speeds(board: Board) -> dict[str, float]:
    found: dict[str, float] = {"baud": round(10 * PS_PER_S / board.terminal.uart.frames_ps(1))}
    buses: list[Any] = [*board.signals.i2c.values(), *board.signals.spi.values()]
    for bus in buses:
        in_python = board.chip is None and bus.name == board.booted.wiring.bus
        if in_python or bus.recent_transfers():
            found["bus_hz"] = bus.speed_hz
            found["bus_is_i2c"] = isinstance(bus, I2CBus)
    return found
