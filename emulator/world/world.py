"""The world for scenarios, the web page and tests: truth, motions, and setters.

A motion starts at ``start_s`` of virtual time (None: now) and discards later motions of the same quantity. The
method returns the motion's end time. Shakes and magnetic disturbances are added to other motions and fields.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Literal

import numpy as np
import numpy.typing as npt

from fcu_emulator.emulator.errors import InputError
from fcu_emulator.emulator.renamed import OldName
from fcu_emulator.emulator.text import choices
from fcu_emulator.emulator.world import limits
from fcu_emulator.emulator.world.air import (
    DOOR_HPA,
    DOOR_LASTS_S,
    Drift,
    PressureDisturbance,
    SlammedDoor,
    Wander,
    Wind,
)
from fcu_emulator.emulator.world.attitude import (
    Held,
    RecordedAttitude,
    SweepSegment,
    Turn,
    WavedEight,
    X,
    euler_to_matrix,
    figure_eights,
    matrix_to_euler,
)
from fcu_emulator.emulator.world.changes import TURNED_SIGNALS, Changes, position_at
from fcu_emulator.emulator.world.follow import SETTLED, Approach, FollowedAttitude, FollowedHeight
from fcu_emulator.emulator.world.hand import TREMOR_HZ, TREMOR_MG, WRIST_M, Grip, Tremor, from_wrist_m
from fcu_emulator.emulator.world.magnetism import MOMENT_AM2, HeldMagnet, Magnet, Steel, ned_to_nwu_mgauss
from fcu_emulator.emulator.world.motors import MOTORS, Motors
from fcu_emulator.emulator.world.position import (
    Coordinate,
    LiftSegment,
    Parabola,
    RecordedCoordinate,
    RestSegment,
    ShakeSegment,
)
from fcu_emulator.emulator.world.recording import MEASURED, Interpolation, Recording
from fcu_emulator.emulator.world.track import Array, Constant, Linear, MinimumJerk, Track
from fcu_emulator.emulator.world.truth import STANDARD_GRAVITY, pressure_ratio
from fcu_emulator.emulator.world.warmth import Warmth

EULER_AXES = ("roll", "pitch", "yaw")
TIME_CONSTANT_S = 0.1  # lag behind a followed hand
SHAKE_DIRECTIONS = {"north": (1.0, 0.0, 0.0), "west": (0.0, 1.0, 0.0), "up": (0.0, 0.0, 1.0)}


class World(Changes):
    """The true state for all sensors. The present is the time of ``clock``, or power-on without a clock.

    At power-on the board lies flat on the floor without motion, X to the north, in the air and field of Zurich.
    A setter changes the value immediately. Invalid values raise `InputError`.
    """

    change_weather, blow, shut_door = map(OldName, ("change_pressure", "blow_wind", "slam_door"))

    # -- setters --------------------------------------------------------------------------------------------

    def set_attitude(self, roll_deg: float, pitch_deg: float, yaw_deg: float) -> None:
        """Set the attitude immediately, without an angular rate."""
        self._plan_attitude((self._clock.now_s, Held(limits.attitude(roll_deg, pitch_deg, yaw_deg))))

    def set_altitude(self, metres: float) -> None:
        """Set the board's height above the floor to ``metres`` immediately, without acceleration."""
        now = self._clock.now_s
        rest_m = limits.ALTITUDE.check("metres", metres) - self._shift_at(now)[2]
        self._plan_height((now, RestSegment(rest_m)))

    def set_pressure(self, hpa: float) -> None:
        """Set the pressure at the board's altitude, by changing the pressure at the floor."""
        here = limits.PRESSURE.check("hpa", hpa)
        now = np.array([self._clock.now_s])
        ratio = pressure_ratio(self._altitude_m(now), self._temperature_degc(now))[0]
        self._set(self._floor_pressure, here / ratio, "pressure")

    def set_temperature(self, degc: float) -> None:
        """Set the air temperature; the board's temperature follows slowly."""
        now_degc = limits.TEMPERATURE.check("degc", degc)
        now = self._clock.now_s
        if now > 0.0:  # at power-on the board already has the air's temperature
            change_degc = now_degc - float(self._temperature.at(now).value(np.array([now]))[0])
            self._lag.plan(now, self._lag.at(now).after(change_degc, now))
        self._set(self._temperature, now_degc, "temperature", "warmth")

    def warm_up(self, heating_degc: float, time_constant_s: float, powered_for_s: float = math.inf) -> None:
        """Set the board's heating (:mod:`fcu_emulator.emulator.world.warmth`) and the time since power-on."""
        excess_degc = -heating_degc if time_constant_s else 0.0
        self._heating = Warmth(heating_degc, excess_degc, time_constant_s, -powered_for_s)
        self._lag = Track(Warmth(time_constant_s=time_constant_s))

    def set_humidity(self, percent: float) -> None:
        """Set the relative humidity of the air."""
        self._set(self._humidity, limits.HUMIDITY.check("percent", percent), "humidity")

    def set_magnetic_field(self, north_ut: float, east_ut: float, down_ut: float) -> None:
        """Set the Earth's field, NED. Disturbances are added to this field."""
        self._set(self._earth, ned_to_nwu_mgauss(north_ut, east_ut, down_ut), "mag")

    def put_steel(
        self,
        north_m: float,
        east_m: float,
        up_m: float,
        radius_m: float,
        moment_am2: npt.ArrayLike = (0.0, 0.0, 0.0),
    ) -> None:
        """Put a sphere of steel into the room, north and east of the board's start and above the floor.

        ``moment_am2``: the sphere's permanent moment north, east and down; zeros for soft steel.
        """
        named = (("north_m", north_m), ("east_m", east_m), ("up_m", up_m))
        north, east, up = (limits.PLACE.check(name, value) for name, value in named)
        radius = limits.RADIUS.check("radius_m", radius_m)
        moment_nwu = limits.vector("moment_am2", moment_am2, limits.MOMENT) * (1.0, -1.0, -1.0)
        before = self._steel.at(self._clock.now_s)
        self._lay_steel((*before, Steel(np.array([north, -east, up]), radius, moment_nwu)))

    def take_steel_away(self) -> None:
        """Remove all steel from the room."""
        self._lay_steel(())

    def _lay_steel(self, steel: tuple[Steel, ...]) -> None:
        now = self._clock.now_s
        self._steel.plan(now, steel)
        self._agitation["mag"].add(now, now)
        self._changed(now, ("mag",))

    def set_hard_iron(self, x_mgauss: float, y_mgauss: float, z_mgauss: float) -> None:
        """Set the board's own magnetic field in board axes."""
        named = (("x_mgauss", x_mgauss), ("y_mgauss", y_mgauss), ("z_mgauss", z_mgauss))
        self._set(self._hard_iron, [limits.IRON.check(name, value) for name, value in named], "mag")

    def set_soft_iron(self, matrix: npt.ArrayLike) -> None:
        """Set the 3 x 3 matrix that distorts the outer field, in board axes."""
        # Without conversion, so that the check can name an entry that is not a number.
        rows = np.asarray(matrix, dtype=object)
        if rows.shape != (3, 3):
            raise InputError(
                f"soft iron must be 3 rows of 3 numbers, not of shape {rows.shape}", kind="shape"
            )
        checked = [[limits.SOFT_IRON.check("soft iron", value) for value in row] for row in rows]
        self._set(self._soft_iron, checked, "mag")

    def set_iron(self, hard_mgauss: npt.ArrayLike, soft: npt.ArrayLike) -> None:
        """Set hard iron (3,) and soft iron (3, 3) together."""
        self.set_hard_iron(*np.asarray(hard_mgauss).tolist())
        self.set_soft_iron(soft)

    def set_gravity(self, m_s2: float) -> None:
        """Set gravity. If a free fall has begun, it continues with the gravity at its start."""
        self._set(self._gravity, limits.GRAVITY.check("m_s2", m_s2), "acc")

    # -- following a hand -----------------------------------------------------------------------------------

    def follow_attitude(
        self,
        roll_deg: float,
        pitch_deg: float,
        yaw_deg: float,
        time_constant_s: float = TIME_CONSTANT_S,
        start_s: float | None = None,
    ) -> float:
        """Turn towards an attitude that may be replaced at any time, with a lag of ``time_constant_s``."""
        target_deg = limits.attitude(roll_deg, pitch_deg, yaw_deg)
        time_constant = limits.TIME_CONSTANT.check("time_constant_s", time_constant_s)
        start = self._start(start_s)
        now, before = np.array([start]), self._attitude.at(start)
        rate = np.radians(before.rate_dps(now)[0])
        acceleration = np.zeros(3)
        if isinstance(before, FollowedAttitude):
            acceleration = np.radians(before.acceleration_dps2(now)[0])
        hand = FollowedAttitude.begin(
            start, time_constant, target_deg, before.rotation(now)[0], rate, acceleration
        )
        return self._plan_attitude((start, hand), (start + SETTLED * time_constant, Held(target_deg)))

    def follow_altitude(
        self, metres: float, time_constant_s: float = TIME_CONSTANT_S, start_s: float | None = None
    ) -> float:
        """Rise or sink towards ``metres`` above the floor, like `follow_attitude`."""
        target_m = limits.ALTITUDE.check("metres", metres)
        time_constant = limits.TIME_CONSTANT.check("time_constant_s", time_constant_s)
        start = self._start(start_s)
        now, before = np.array([start]), self._height.at(start)
        laws = before.position_m, before.speed_m_s, before.acceleration_m_s2
        position, speed, acceleration = (float(law(now)[0]) for law in laws)
        hand = FollowedHeight.begin(start, time_constant, target_m, (position, speed, acceleration))
        return self._plan_height((start, hand), (start + SETTLED * time_constant, RestSegment(target_m)))

    def follow_magnet(
        self,
        north_m: float,
        west_m: float,
        up_m: float,
        moment_am2: float = MOMENT_AM2,
        time_constant_s: float = TIME_CONSTANT_S,
        start_s: float | None = None,
    ) -> float:
        """Move a hand-held magnet, which points west, to a place relative to the board; see `follow_attitude`."""
        named = (("north_m", north_m), ("west_m", west_m), ("up_m", up_m))
        place = np.array([limits.PLACE.check(name, value) for name, value in named])
        limits.DISTANCE.check("distance of the magnet from the board", float(np.linalg.norm(place)))
        moment = limits.MOMENT.check("moment_am2", moment_am2)
        time_constant = limits.TIME_CONSTANT.check("time_constant_s", time_constant_s)
        start = self._start(start_s)
        before, lies = self._magnet.at(start), HeldMagnet(moment, place)
        if before is None or before.moment_am2 != moment:
            return self._put_magnet(lies, start)
        position, speed, acceleration = (one[0] for one in before.moving(np.array([start])))
        approach = Approach.of(start, time_constant, position - place, speed, acceleration)
        end = start + SETTLED * time_constant
        self._magnet.plan(start, HeldMagnet(moment, place, approach))
        self._magnet.plan(end, lies)
        self._agitation["mag"].add(start, end, approach.pace_s)
        self._changed(start, ("mag",))
        return end

    def take_magnet_away(self, start_s: float | None = None) -> float:
        """Remove the hand-held magnet."""
        return self._put_magnet(None, self._start(start_s))

    def _put_magnet(self, magnet: HeldMagnet | None, start_s: float) -> float:
        self._magnet.plan(start_s, magnet)
        self._agitation["mag"].add(start_s, start_s)
        self._changed(start_s, ("mag",))
        return start_s

    # -- a hand that holds the board ------------------------------------------------------------------------

    def take_in_hand(
        self,
        wrist_m: npt.ArrayLike = WRIST_M,
        tremor_mg: float = TREMOR_MG,
        tremor_hz: float = TREMOR_HZ,
        start_s: float | None = None,
    ) -> float:
        """Hold the board in a hand: from now on, the board turns about the wrist, with a tremor.

        ``wrist_m`` (3,): position of the wrist or elbow in board axes. ``tremor_mg``: peak at the back of the
        hand; 0 for no tremor.
        """
        wrist = limits.vector("wrist_m", wrist_m, limits.ARM)
        peak = limits.TREMOR.check("tremor_mg", tremor_mg) / 1000.0 * STANDARD_GRAVITY
        frequency = limits.TREMOR_FREQUENCY.check("tremor_hz", tremor_hz)
        start = self._start(start_s)
        self._let_go(start)
        tremor = Tremor.of(start, wrist, peak, frequency) if peak else None
        taken = from_wrist_m(self._rotation_at(start)[np.newaxis], wrist)[0]
        self._grip.plan(start, Grip(wrist, tremor, taken))
        if tremor is not None:
            for signal in TURNED_SIGNALS:  # a tremor changes the height too little for a barometer
                self._agitation[signal].add(start, math.inf, tremor.pace_s)
        self._changed(start, (*TURNED_SIGNALS, "pressure"))
        return start

    def put_down(self, start_s: float | None = None) -> float:
        """Release the board from the hand; the board stays at its present height."""
        start = self._start(start_s)
        self._let_go(start)
        self._changed(start, (*TURNED_SIGNALS, "pressure"))
        return start

    def _let_go(self, start_s: float) -> None:
        shift_m, grip = self._shift_at(start_s).tolist(), self._grip.at(start_s)
        if grip is not None:
            for track, metres in zip((self._north, self._west, self._height), shift_m, strict=True):
                track.plan(start_s, RestSegment(position_at(track, start_s) + metres))
        self._grip.plan(start_s, None)
        for signal in TURNED_SIGNALS:
            if grip is not None and grip.tremor is not None:
                self._agitation[signal].end(start_s, grip.tremor.pace_s)
            self._agitation[signal].add(start_s, start_s)

    def _shift_at(self, t_s: float) -> Array:
        shift: Array = self._shift_in(self._grip.at(t_s), np.array([t_s]))[0]
        return shift

    # -- motors on the board --------------------------------------------------------------------------------

    @property
    def throttle(self) -> tuple[float, ...]:
        """Present fraction of the full voltage at each motor."""
        running = self._motors.at(self._clock.now_s)
        return (0.0,) * MOTORS if running is None else tuple(running.throttle.tolist())

    def run_motors(self, throttle: float | Sequence[float], start_s: float | None = None) -> float:
        """Run the motors at a fraction 0 to 1 of the full voltage: one value for all, or four values. 0 stops them."""
        each = [throttle] * MOTORS if isinstance(throttle, int | float) else list(throttle)
        if len(each) != MOTORS:
            raise InputError(f"throttle must be one number from 0 to 1, or {MOTORS}, not {throttle!r}")
        shares = [limits.THROTTLE.check("throttle", share) for share in each]
        start = self._start(start_s)
        before = self._motors.at(start)
        now = Motors.at(start, shares) if any(shares) else None
        if before is None and now is None:
            return start
        if before is not None:
            self._agitation["acc"].end(start, before.pace_s)
        if now is not None:
            self._agitation["acc"].add(start, math.inf, now.pace_s)
        self._agitation["mag"].add(start, start)
        self._motors.plan(start, now)
        self._changed(start, ("acc", "mag"))
        return start

    # -- motions, each of a few pieces on a track -----------------------------------------------------------

    def rotate_to(
        self,
        roll_deg: float,
        pitch_deg: float,
        yaw_deg: float,
        duration_s: float,
        start_s: float | None = None,
    ) -> float:
        """Turn to an attitude by the shortest arc, as a hand does (minimum jerk)."""
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
        """Change one Euler angle to ``to_deg``, which may be more than 180 degrees away."""
        if axis not in EULER_AXES:
            raise InputError(f"axis must be {choices(EULER_AXES)}, not {axis!r}", kind="choice")
        if profile not in ("linear", "minimum_jerk"):
            raise InputError(f"profile must be 'linear' or 'minimum_jerk', not {profile!r}", kind="choice")
        start, end = self._span(start_s, duration_s)
        pace = (Linear if profile == "linear" else MinimumJerk)(start, end - start)
        start_deg = self._euler_deg_at(start)
        end_deg = start_deg.copy()
        end_deg[EULER_AXES.index(axis)] = limits.ANGLE.check("to_deg", to_deg)
        return self._plan_attitude(
            (start, SweepSegment(start_deg, end_deg - start_deg, pace)), (end, Held(end_deg))
        )

    def figure_eight(
        self,
        duration_s: float,
        turns: int = 1,
        start_s: float | None = None,
        by: Literal["field", "hand"] = "field",
    ) -> float:
        """Turn the board ``turns`` times in the figure of eight for the calibration, and back to the start.

        With ``by`` "field", the calibration is exact; with "hand", it is nearly exact after two turns.
        """
        if limits.TURNS.check("turns", turns) % 1.0:
            raise InputError(f"turns must be a whole number, not {turns!r}", kind="not_whole")
        if by not in ("field", "hand"):
            raise InputError(f"'by' must be 'field' or 'hand', not {by!r}", kind="choice")
        start, end = self._span(start_s, duration_s)
        first, last = self._rotation_at(start), (end, Held(self._euler_deg_at(start)))
        if by == "hand":
            waved = WavedEight(first, int(turns), MinimumJerk(start, end - start))
            return self._plan_attitude((start, waved), last)
        field = self._earth.at(start).value(np.array([start]))[0]
        return self._plan_attitude(*figure_eights(start, end - start, int(turns), first, field), last)

    def turn_over(self, duration_s: float, start_s: float | None = None) -> float:
        """Turn the board by 180 degrees about its X axis (minimum jerk)."""
        start, end = self._span(start_s, duration_s)
        turn = Turn(self._rotation_at(start), X, np.pi, MinimumJerk(start, end - start))
        end_deg = matrix_to_euler(turn.rotation(np.array([end])))[0]
        return self._plan_attitude((start, turn), (end, Held(end_deg)))

    def lift(self, metres: float, duration_s: float, start_s: float | None = None) -> float:
        """Raise the board by ``metres`` (negative: lower), from rest to rest."""
        way_m = limits.ALTITUDE.check("metres", metres)
        start, end = self._span(start_s, duration_s)
        limits.ALTITUDE.check("altitude after the lift", position_at(self._height, start) + way_m)
        return self._push(self._height, way_m, start, end)

    def move(
        self,
        north_m: float = 0.0,
        east_m: float = 0.0,
        up_m: float = 0.0,
        duration_s: float = 1.0,
        start_s: float | None = None,
    ) -> float:
        """Push the board in a straight line, from rest to rest. With ``up_m`` 0 the height does not change."""
        north = limits.WAY.check("north_m", north_m)
        east = limits.WAY.check("east_m", east_m)
        start, end = self._span(start_s, duration_s)
        limits.WAY.check("position north after the move", position_at(self._north, start) + north)
        limits.WAY.check("position east after the move", east - position_at(self._west, start))
        if limits.ALTITUDE.check("up_m", up_m):
            self.lift(up_m, duration_s, start)
        self._push(self._north, north, start, end)
        return self._push(self._west, -east, start, end)

    def _push(self, track: Track[Coordinate], way_m: float, start_s: float, end_s: float) -> float:
        from_m = position_at(track, start_s)
        lift = LiftSegment(from_m, way_m, MinimumJerk(start_s, end_s - start_s))
        return self._plan_position(track, (start_s, lift), (end_s, RestSegment(from_m + way_m)))

    def free_fall(self, duration_s: float, catch_s: float = 0.05, start_s: float | None = None) -> float:
        """Drop the board from rest for ``duration_s``, then stop it within ``catch_s``.

        The board may end below the floor.
        """
        start, caught = self._span(start_s, duration_s)
        catch = limits.DURATION.check("catch_s", catch_s)
        gravity = float(self._gravity.at(start).value(np.array([start]))[0])
        from_m, speed = position_at(self._height, start), -gravity * (caught - start)
        caught_m = from_m + 0.5 * speed * (caught - start)
        rest_m = limits.ALTITUDE.check("altitude after the fall", caught_m + 0.5 * speed * catch)
        fall = Parabola(start, from_m, 0.0, -gravity)
        stop = Parabola(caught, caught_m, speed, -speed / catch)
        return self._plan_height((start, fall), (caught, stop), (caught + catch, RestSegment(rest_m)))

    def shake(
        self,
        axis: Literal["north", "west", "up"],
        amplitude_g: float,
        frequency_hz: float,
        duration_s: float,
        start_s: float | None = None,
    ) -> float:
        """Accelerate by ``amplitude_g`` cos(2 pi f t) along a world axis.

        The shaking ends after the last complete period within ``duration_s``.
        """
        if axis not in SHAKE_DIRECTIONS:
            raise InputError(f"axis must be {choices(SHAKE_DIRECTIONS)}, not {axis!r}", kind="choice")
        frequency = limits.FREQUENCY.check("frequency_hz", frequency_hz)
        amplitude = limits.AMPLITUDE.check("amplitude_g", amplitude_g) * STANDARD_GRAVITY
        start, end = self._span(start_s, duration_s)
        periods = int((end - start) * frequency + 1e-6)
        if periods < 1:
            least = f"at least one period, {1.0 / frequency:g} s"
            raise InputError(f"duration_s must be {least}, not {duration_s!r}", kind="too_short")
        angular = 2.0 * np.pi * frequency
        limits.EXCURSION.check(
            "distance of the shake (use a lower g or a higher Hz)", 2.0 * amplitude / angular**2
        )
        direction = np.array(SHAKE_DIRECTIONS[axis])
        end = start + periods / frequency
        self._shakes.add(start, end, ShakeSegment(start, direction, amplitude, angular))
        signals = ("acc", "pressure") if axis == "up" else ("acc",)
        for signal in (*signals, "mag"):  # near steel, the field depends on the position
            self._agitation[signal].add(start, end)
        self._changed(start, (*signals, "mag"))
        return end

    def tap(
        self,
        axis: Literal["north", "west", "up"] = "up",
        amplitude_g: float = 3.0,
        duration_s: float = 0.01,
        start_s: float | None = None,
    ) -> float:
        """Tap along a world axis: one period of a shake."""
        duration = limits.DURATION.check("duration_s", duration_s)
        return self.shake(axis, amplitude_g, 1.0 / duration, duration, start_s)

    def disturb_field(
        self, north_ut: float, east_ut: float, down_ut: float, duration_s: float, start_s: float | None = None
    ) -> float:
        """Add a constant field (NED) to the Earth's field for ``duration_s``."""
        disturbance = Constant(ned_to_nwu_mgauss(north_ut, east_ut, down_ut))
        start, end = self._span(start_s, duration_s)
        return self._disturb(start, end, disturbance)

    def pass_magnet(
        self, moment_am2: float, distance_m: float, speed_m_s: float, start_s: float | None = None
    ) -> float:
        """Move a magnet past the board on a straight horizontal line, ``distance_m`` east of the board."""
        moment = limits.MOMENT.check("moment_am2", moment_am2)
        distance = limits.DISTANCE.check("distance_m", distance_m)
        speed = limits.SPEED.check("speed_m_s", speed_m_s)
        start = self._start(start_s)
        magnet = Magnet.starting_at(start, moment, distance, speed)
        return self._disturb(start, 2.0 * magnet.closest_s - start, magnet)

    def replay(self, recording: Recording, start_s: float | None = None) -> float:
        """Replay the signals of a recording, or follow its attitude. ``start_s`` is the recording's time 0.

        The last row applies until the next motion or setter of the same signal.
        """
        start = self._start(start_s)
        row_s = recording.t_s
        end = start + float(row_s[-1])
        for group, values in recording.groups.items():
            if group in MEASURED:
                for signal in ("temperature", "warmth") if group == "temperature" else (group,):
                    self._signals[signal].plan(start, Interpolation(row_s, values, start))
                    self._agitation[signal].add(start, end)
            elif group == "attitude":
                turning = RecordedAttitude(row_s, values, start) if len(row_s) > 1 else Held(values[0])
                self._plan_attitude((start, turning), (end, Held(values[-1])))
        tracks = {"north": self._north, "west": self._west, "up": self._height}
        for name, (row_m, row_m_s2) in recording.coordinates.items():
            moving = RecordedCoordinate(row_s, row_m, row_m_s2, start)
            self._plan_position(tracks[name], (start, moving), (end, RestSegment(float(row_m[-1]))))
        self._changed(start, ())
        return end

    # -- the air --------------------------------------------------------------------------------------------

    def change_pressure(self, change_hpa: float, duration_s: float, start_s: float | None = None) -> float:
        """Change the pressure at the floor smoothly by ``change_hpa``."""
        change = limits.PRESSURE_CHANGE.check("change_hpa", change_hpa)
        start, end = self._span(start_s, duration_s)
        from_hpa = float(self._floor_pressure.at(start).value(np.array([start]))[0])
        to_hpa = limits.PRESSURE.check("pressure after the change", from_hpa + change)
        drift = Drift(from_hpa, change, MinimumJerk(start, end - start))
        self._floor_pressure.plan(start, drift)
        self._floor_pressure.plan(end, Constant(to_hpa))
        self._agitation["pressure"].add(start, end, drift.pace_s)
        self._changed(start, ("pressure",))
        return end

    def blow_wind(self, speed_m_s: float, duration_s: float, start_s: float | None = None) -> float:
        """Add the pressure of a gusty wind on the windows."""
        speed = limits.WIND.check("speed_m_s", speed_m_s)
        start, end = self._span(start_s, duration_s)
        return self._disturb_pressure(start, end, Wind(start, end, speed))

    def slam_door(self, push_hpa: float = DOOR_HPA, start_s: float | None = None) -> float:
        """Slam a door, which pushes air into the room for about a second. A negative value pulls the door open."""
        start, push = self._start(start_s), limits.PUSH.check("push_hpa", push_hpa)
        return self._disturb_pressure(start, start + DOOR_LASTS_S, SlammedDoor(start, push))

    def let_pressure_wander(self, rms_hpa: float, seed: int = 0) -> None:
        """Let the pressure of the room wander from now on; 0 stops it (:mod:`fcu_emulator.emulator.world.air`)."""
        now = self._clock.now_s
        self._wander.plan(now, Wander(limits.WANDER.check("rms_hpa", rms_hpa), seed))
        self._agitation["pressure"].add(now, now)
        self._changed(now, ("pressure",))

    def _disturb_pressure(self, start_s: float, end_s: float, disturbance: PressureDisturbance) -> float:
        self._pressure_disturbances.add(start_s, end_s, disturbance)
        self._agitation["pressure"].add(start_s, end_s, disturbance.pace_s)
        self._changed(start_s, ("pressure",))
        return end_s
