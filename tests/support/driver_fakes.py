"""Common parts of the tests of third-party drivers: attitudes, the truth in board axes, and counts of changes."""

from __future__ import annotations

import math
from collections.abc import Callable

from fcu_emulator import Board

ATTITUDES = [(0, 0, 0), (20, -30, 40), (-170, 60, -120), (90, 0, 15), (0, 85, 200)]
"""Roll, pitch, yaw in degrees."""

SETTLED_S = 2.0  # longer than every turn-on and filter at the rates used here, in virtual time

Vector = tuple[float, float, float]
G_M_S2 = 9.80665


def board_axes(raw: Vector) -> Vector:
    """Return a vector in the lab's axes: out.X = -raw.Y, out.Y = raw.X, out.Z = raw.Z."""
    return -raw[1], raw[0], raw[2]


def settled(attitude: Vector = (0, 0, 0)) -> Board:
    """Return an ideal board without firmware, held in an attitude."""
    board = Board(ideal=True)
    board.world.set_attitude(*attitude)
    return board


def acceleration_g(board: Board) -> Vector:
    """Return the present truth in g."""
    x, y, z = board.world.specific_force_g(board.now_s)[0]
    return float(x), float(y), float(z)


def rate_dps(board: Board) -> Vector:
    """Return the present truth in deg/s."""
    x, y, z = board.world.angular_rate_dps(board.now_s)[0]
    return float(x), float(y), float(z)


def field_ut(board: Board) -> Vector:
    """Return the present truth in microteslas."""
    x, y, z = board.world.magnetic_field_mgauss(board.now_s)[0] / 10
    return float(x), float(y), float(z)


def within(measured: Vector, truth: Vector, lsb: float) -> bool:
    """Return whether every axis is within one LSB."""
    return all(math.isclose(a, b, rel_tol=0, abs_tol=lsb) for a, b in zip(measured, truth, strict=True))


def changes(board: Board, read: Callable[[], object], seconds: float, every_s: float) -> int:
    """Return how often ``read()``, called ``every_s``, returns another value than before."""
    last, count = read(), 0
    end_s = board.now_s + seconds
    while board.now_s < end_s:
        board.run_for(every_s)
        now = read()
        count += now != last
        last = now
    return count
