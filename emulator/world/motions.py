"""Motions of the board and of magnets near it, planned on the world's tracks.

Common to all: ``start_s`` is virtual time (None: now) and not in the past; the motion starts from the state
in force then, and drops what was planned for the same quantity from then on, so plan in order of time. Each
returns the time at which it ends. Shakes and magnetic disturbances are the exception: they add up and drop
nothing.
"""

from __future__ import annotations

from typing import Literal

import numpy as np

from emulator.errors import InputError
from emulator.world import limits
from emulator.world.attitude import Held, Recorded, Sweep, Turn
from emulator.world.eights import figure_eights
from emulator.world.line import Lift, Parabola, Rest, Shake
from emulator.world.line import Recorded as RecordedLine
from emulator.world.magnetism import Magnet, ned_to_nwu_mgauss
from emulator.world.planner import Planner
from emulator.world.profile import Linear, MinimumJerk
from emulator.world.recording import MEASURED, Interpolation, Recording
from emulator.world.rotation import euler_to_matrix
from emulator.world.track import Constant
from emulator.world.truth import STANDARD_GRAVITY

EULER_AXES = ("roll", "pitch", "yaw")
SHAKE_DIRECTIONS = {"north": (1.0, 0.0, 0.0), "west": (0.0, 1.0, 0.0), "up": (0.0, 0.0, 1.0)}


class Motions(Planner):
    """The motions, each a few pieces on a track."""

    def rotate_to(
        self,
        roll_deg: float,
        pitch_deg: float,
        yaw_deg: float,
        duration_s: float,
        start_s: float | None = None,
    ) -> float:
        """Turn by the shortest arc, about one fixed axis, as a hand does (minimum jerk)."""
        end_deg = limits.attitude(roll_deg, pitch_deg, yaw_deg)
        start, end = self._span(start_s, duration_s)
        target = euler_to_matrix(end_deg[np.newaxis])[0]
        turn = Turn.between(self._rotation_at(start), target, MinimumJerk(start, end - start))
        return self._plan_attitude((start, turn), (end, Held(end_deg)))

    def sweep(
        self,
        axis: Literal["roll", "pitch", "yaw"],
        to_deg: float,
        duration_s: float,
        start_s: float | None = None,
        profile: Literal["linear", "minimum_jerk"] = "linear",
    ) -> float:
        """Change one Euler angle, as last commanded, to ``to_deg``: for tilts, and turns of more than 180."""
        if axis not in EULER_AXES:
            raise InputError(f"axis is {axis!r}: give one of {', '.join(EULER_AXES)}")
        if profile not in ("linear", "minimum_jerk"):
            raise InputError(f"profile is {profile!r}: give one of linear, minimum_jerk")
        start, end = self._span(start_s, duration_s)
        pace = (Linear if profile == "linear" else MinimumJerk)(start, end - start)
        start_deg = self._euler_deg_at(start)
        end_deg = start_deg.copy()
        end_deg[EULER_AXES.index(axis)] = limits.ANGLE.check("to_deg", to_deg)
        return self._plan_attitude((start, Sweep(start_deg, end_deg - start_deg, pace)), (end, Held(end_deg)))

    def figure_eight(self, duration_s: float, turns: int = 1, start_s: float | None = None) -> float:
        """The calibration's figure-of-eight, ``turns`` times, back to where it began (see `eights`)."""
        if limits.TURNS.check("turns", turns) % 1.0:
            raise InputError(f"turns is {turns!r}: give a whole number")
        start, end = self._span(start_s, duration_s)
        field = self._earth.at(start).value(np.array([start]))[0]
        pieces = figure_eights(start, end - start, int(turns), self._rotation_at(start), field)
        return self._plan_attitude(*pieces, (end, Held(self._euler_deg_at(start))))

    def lift(self, metres: float, duration_s: float, start_s: float | None = None) -> float:
        """Raise the board by ``metres`` (negative: lower it), from rest to rest (minimum jerk)."""
        start, end = self._span(start_s, duration_s)
        from_m = self._height_at(start)
        way_m = limits.ALTITUDE.check("metres", metres)
        to_m = limits.ALTITUDE.check("altitude after the lift", from_m + way_m)
        lift = Lift(from_m, way_m, MinimumJerk(start, end - start))
        return self._plan_height((start, lift), (end, Rest(to_m)))

    def free_fall(self, duration_s: float, catch_s: float = 0.05, start_s: float | None = None) -> float:
        """Let go from rest for ``duration_s``, then stop with constant deceleration in ``catch_s``.

        The board ends lower, below the room's floor if it was not lifted before.
        """
        start, caught = self._span(start_s, duration_s)
        catch = limits.DURATION.check("catch_s", catch_s)
        gravity = float(self._gravity.at(start).value(np.array([start]))[0])
        from_m, speed = self._height_at(start), -gravity * (caught - start)
        caught_m = from_m + 0.5 * speed * (caught - start)
        rest_m = limits.ALTITUDE.check("altitude after the fall", caught_m + 0.5 * speed * catch)
        fall = Parabola(start, from_m, 0.0, -gravity)
        stop = Parabola(caught, caught_m, speed, -speed / catch)
        return self._plan_height((start, fall), (caught, stop), (caught + catch, Rest(rest_m)))

    def shake(
        self,
        axis: Literal["north", "west", "up"],
        amplitude_g: float,
        frequency_hz: float,
        duration_s: float,
        start_s: float | None = None,
    ) -> float:
        """Accelerate by ``amplitude_g`` cos(2 pi f t) along a world axis; "up" moves the altitude too.

        The shake stops after the last whole period within ``duration_s``, at rest where it began.
        """
        if axis not in SHAKE_DIRECTIONS:
            raise InputError(f"axis is {axis!r}: give one of {', '.join(SHAKE_DIRECTIONS)}")
        frequency = limits.FREQUENCY.check("frequency_hz", frequency_hz)
        amplitude = limits.AMPLITUDE.check("amplitude_g", amplitude_g) * STANDARD_GRAVITY
        start, end = self._span(start_s, duration_s)
        periods = int((end - start) * frequency + 1e-6)
        if periods < 1:
            raise InputError(f"duration_s is {duration_s!r}: give at least one period, {1.0 / frequency:g} s")
        angular = 2.0 * np.pi * frequency
        limits.EXCURSION.check("way of the shake (lower g or higher Hz)", 2.0 * amplitude / angular**2)
        direction = np.array(SHAKE_DIRECTIONS[axis])
        end = start + periods / frequency
        self._shakes.add(start, end, Shake(start, direction, amplitude, angular))
        self._changed(start, ("acc", "pressure") if axis == "up" else ("acc",))
        return end

    def disturb_field(
        self, north_ut: float, east_ut: float, down_ut: float, duration_s: float, start_s: float | None = None
    ) -> float:
        """Add a constant field (NED) to the Earth's, as of a loudspeaker or a steel desk nearby."""
        disturbance = Constant(ned_to_nwu_mgauss(north_ut, east_ut, down_ut))
        start, end = self._span(start_s, duration_s)
        return self._disturb(start, end, disturbance)

    def pass_magnet(
        self, moment_am2: float, distance_m: float, speed_m_s: float, start_s: float | None = None
    ) -> float:
        """Move a magnet past the board on a straight level line, ``distance_m`` to its east (see `Magnet`).

        It comes and goes from beyond the reach of its field; the closest point is half way in time.
        """
        moment = limits.MOMENT.check("moment_am2", moment_am2)
        distance = limits.DISTANCE.check("distance_m", distance_m)
        speed = limits.SPEED.check("speed_m_s", speed_m_s)
        start = self._start(start_s)
        magnet = Magnet.starting_at(start, moment, distance, speed)
        return self._disturb(start, 2.0 * magnet.closest_s - start, magnet)

    def replay(self, recording: Recording, start_s: float | None = None) -> float:
        """Give a recording's signals, or follow its attitude, its time 0 being ``start_s``.

        The last row holds on until the next motion or setter that bears on the same signal.
        """
        start = self._start(start_s)
        row_s = start + recording.t_s
        end = float(row_s[-1])
        for group, values in recording.groups.items():
            if group in MEASURED:
                self._signals[group].plan(start, Interpolation(row_s, values))
            elif group == "altitude":
                self._plan_height((start, RecordedLine(row_s, values)), (end, Rest(float(values[-1]))))
            else:
                moving = Recorded(row_s, values) if len(row_s) > 1 else Held(values[0])
                self._plan_attitude((start, moving), (end, Held(values[-1])))
        self._changed(start, ())
        return end
