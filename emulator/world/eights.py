"""The figure-of-eight by which a hand calibrates a compass.

Decision: the movement is laid out along the magnetic field in force when it begins. Seen from the board the
tip of the field's vector must touch both ends of all three axes, or the middle of minimum and maximum (brief,
"MagCalibration") is not the hard iron. Three twists about pairs of board axes do it: in each the tip draws
Viviani's curve, a figure-of-eight on the sphere, and together the three pass all six ends exactly, for any
field and starting attitude. Road not taken: a movement blind to the field. To come within 2 mgauss of 480
from anywhere it must pass within 7 degrees of every point of the sphere with each axis: some fifty turns,
which no wrist makes in 20 seconds.
"""

from __future__ import annotations

import numpy as np

from emulator.world.attitude import Attitude, Turn, Twist
from emulator.world.profile import MinimumJerk
from emulator.world.rotation import about
from emulator.world.track import Array

X, Y, Z = np.eye(3)
EIGHTS = ((Z, Y), (Y, Z), (Z, X))  # with the field along X: lobes to +-Y, to +-Z, and from +X to -X
APPROACH = 0.1  # the part of the time for reaching the field's direction, and again for coming back


def figure_eights(
    start_s: float, duration_s: float, turns: int, start: Array, field: Array
) -> list[tuple[float, Attitude]]:
    """Pieces (start in s, piece) from rotation ``start`` (3, 3) and back, in the NWU ``field`` (3,)."""
    aligned = _align(start, field)
    approach_s = APPROACH * duration_s
    eight_s = (duration_s - 2.0 * approach_s) / (turns * len(EIGHTS))
    pieces: list[tuple[float, Attitude]] = [
        (start_s, Turn.between(start, aligned, MinimumJerk(start_s, approach_s)))
    ]
    for number in range(turns * len(EIGHTS)):
        begin_s = start_s + approach_s + number * eight_s
        first, second = EIGHTS[number % len(EIGHTS)]
        pieces.append((begin_s, Twist(aligned, first, second, MinimumJerk(begin_s, eight_s))))
    back_s = start_s + duration_s - approach_s
    pieces.append((back_s, Turn.between(aligned, start, MinimumJerk(back_s, approach_s))))
    return pieces


def _align(start: Array, field: Array) -> Array:
    """``start`` turned by the shortest arc so that board X lies along ``field``; no field: as it is."""
    strength = np.linalg.norm(field)
    if strength == 0.0:
        return start
    seen = start.T @ field / strength  # in board axes
    normal = np.array([0.0, -seen[2], seen[1]])  # X cross seen
    sine = np.linalg.norm(normal)
    axis = normal / sine if sine > 0.0 else Z
    angle = np.arctan2(sine, seen[0])
    aligned: Array = start @ about(axis, np.array([angle]))[0]
    return aligned
