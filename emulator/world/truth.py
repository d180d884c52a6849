"""The true values of all sensor signals, as functions of time from one state.

Decision: each signal has a separate track, whose usual piece is the physical law of the signal. A recording
replaces the law until the next motion or setter.

Decision: air pressure is P = P_floor (1 - L h / T)^(g M / (R L)). T is the temperature of the air, because the
standard 288.15 K is wrong for a room. Source: U.S. Standard Atmosphere 1976, equation 33a, table 2.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from functools import partial
from typing import Any

import numpy as np
import numpy.typing as npt

from fcu_emulator.emulator.errors import InputError
from fcu_emulator.emulator.world import limits
from fcu_emulator.emulator.world.air import Drift, PressureDisturbance, Wander
from fcu_emulator.emulator.world.attitude import Attitude, Held, matrix_to_euler, to_board
from fcu_emulator.emulator.world.hand import Grip
from fcu_emulator.emulator.world.magnetism import HeldMagnet, Magnet, Steel, ned_to_nwu_mgauss
from fcu_emulator.emulator.world.motors import Motors
from fcu_emulator.emulator.world.position import Coordinate, RestSegment, ShakeSegment
from fcu_emulator.emulator.world.track import Agitation, Array, Constant, Overlays, Spans, Track
from fcu_emulator.emulator.world.warmth import Warmth

# -- Air pressure over the room's floor ---------------------------------------------------------------------


SEA_LEVEL_HPA = 1013.25
SEA_LEVEL_K = 288.15
ZERO_CELSIUS_K = 273.15
LAPSE_K_M = 0.0065
EXPONENT = 9.80665 * 0.0289644 / (8.31432 * LAPSE_K_M)  # g M / (R L) = 5.25588; the lab rounds it to 5.257


def isa_pressure_hpa(altitude_m: float) -> float:
    """Return the pressure of the standard atmosphere at this altitude above the sea."""
    return float(SEA_LEVEL_HPA * (1.0 - LAPSE_K_M * altitude_m / SEA_LEVEL_K) ** EXPONENT)


def pressure_ratio(height_m: Array, temperature_degc: Array) -> Array:
    """Return the ratio of the pressure at ``height_m`` (N,) above the floor to the pressure at the floor."""
    return (1.0 - LAPSE_K_M * height_m / (temperature_degc + ZERO_CELSIUS_K)) ** EXPONENT


# -- The signals --------------------------------------------------------------------------------------------


STANDARD_GRAVITY = 9.80665  # m/s2 in one g
ZURICH_FIELD_UT = (21.5, 0.0, 43.0)  # the World Magnetic Model at Zurich, rounded, turned to north
ROOM_DEGC = 25.0
ROOM_PERCENT = 45.0
HISTORY_CHANGES = (
    65_536  # changes of one quantity, 1.2 kB each: 20 minutes of a hand with 50 commands per second
)
KEPT_S = 60.0  # seconds of history that are always kept, because the filters of the sensors need them
RECENT_S = 5.0  # changes within this time are searched one by one
UP = np.array([0.0, 0.0, 1.0])
NOTHING = np.zeros((1, 3))
HALF_TURN_DEG = 180.0

Signal = Callable[[Array], Array]
QUANTITIES = {
    "acceleration_g": "acc",
    "angular_rate_dps": "gyro",
    "magnetic_field_mgauss": "mag",
    "pressure_hpa": "pressure",
    "temperature_degc": "warmth",
    "relative_humidity_percent": "humidity",
}
"""The quantities that sensors declare, and their signals of the world."""
Disturbance = Constant | Magnet


class Truth:
    """The state over time and the derived signals; ``t_s`` is (N,) seconds, vectors are (N, 3) in board axes."""

    def __init__(self, floor_altitude_m: float) -> None:
        floor_hpa = isa_pressure_hpa(limits.ALTITUDE.check("floor_altitude_m", floor_altitude_m))
        self._attitude: Track[Attitude] = Track(Held(np.zeros(3)))
        self._north: Track[Coordinate] = Track(RestSegment(0.0))
        self._west: Track[Coordinate] = Track(RestSegment(0.0))
        self._height: Track[Coordinate] = Track(RestSegment(0.0))
        self._grip: Track[Grip | None] = Track(None)
        self._motors: Track[Motors | None] = Track(None)
        self._shakes: Overlays[ShakeSegment] = Overlays()
        self._gravity = Track(Constant(STANDARD_GRAVITY))
        self._earth = Track(Constant(ned_to_nwu_mgauss(*ZURICH_FIELD_UT)))
        self._disturbances: Overlays[Disturbance] = Overlays()
        self._steel: Track[tuple[Steel, ...]] = Track(())
        self._magnet: Track[HeldMagnet | None] = Track(None)
        self._hard_iron = Track(Constant(np.zeros(3)))
        self._soft_iron = Track(Constant(np.eye(3)))
        self._floor_pressure: Track[Constant | Drift] = Track(Constant(floor_hpa))
        self._pressure_disturbances: Overlays[PressureDisturbance] = Overlays(width=1)
        self._wander = Track(Wander(0.0, 0))
        self._temperature = Track(Constant(ROOM_DEGC))
        self._heating = Warmth()
        self._lag = Track(Warmth())
        self._humidity = Track(Constant(ROOM_PERCENT))
        self._laws: dict[str, Signal] = {
            "acc": self._force_g,
            "gyro": self._rate_dps,
            "mag": self._field_mgauss,
            "pressure": self._pressure_hpa,
            "temperature": self._temperature_degc,
            "warmth": self._board_degc,
            "humidity": self._humidity_percent,
        }
        self._signals = {name: Track(law) for name, law in self._laws.items()}
        self._agitation = {name: Agitation() for name in self._laws}
        self._forgotten_s = -math.inf

    def rotation(self, t_s: npt.ArrayLike) -> Array:
        """Return the rotation from board to world, (N, 3, 3)."""
        return _sampled(self._rotation, t_s)

    def attitude_deg(self, t_s: npt.ArrayLike) -> Array:
        """Return roll, pitch, yaw (N, 3): pitch within +-90, roll and yaw within +-180. Roll is 0 at pitch +-90."""
        return matrix_to_euler(self.rotation(t_s))

    def compass_deg(self, t_s: npt.ArrayLike) -> Array:
        """Return roll, pitch and yaw (N, 3) like `attitude_deg`, but with the yaw from magnetic north.

        Disturbances do not change magnetic north. For a vertical field, magnetic north is the world frame's north.
        """
        compass = self.attitude_deg(t_s)
        earth = _sampled(lambda t: self._earth.evaluate(t, Constant.value), t_s)
        yaw = compass[:, 2] - np.degrees(np.arctan2(earth[:, 1], earth[:, 0]))
        compass[:, 2] = np.where(np.abs(yaw) > HALF_TURN_DEG, (yaw + 180.0) % 360.0 - 180.0, yaw)
        return compass

    def specific_force_g(self, t_s: npt.ArrayLike) -> Array:
        """Return the signal of an ideal accelerometer in g of 9.80665 m/s2."""
        return self._signal("acc", t_s)

    def linear_acceleration_g(self, t_s: npt.ArrayLike) -> Array:
        """Return the modulus of the board's acceleration without gravity, (N,) in g.

        For a recording, the result is the difference between the moduli of specific force and gravity.
        """
        return _sampled(lambda t: self._signals["acc"].evaluate(t, self._linear_g), t_s)

    def angular_rate_dps(self, t_s: npt.ArrayLike) -> Array:
        """Return the signal of an ideal gyroscope."""
        return self._signal("gyro", t_s)

    def magnetic_field_mgauss(self, t_s: npt.ArrayLike) -> Array:
        """Return the signal of an ideal magnetometer: soft iron @ R^T field + the board's own fields."""
        return self._signal("mag", t_s)

    def pressure_hpa(self, t_s: npt.ArrayLike) -> Array:
        """Return the air pressure at the board."""
        return self._signal("pressure", t_s)

    def temperature_degc(self, t_s: npt.ArrayLike) -> Array:
        """Return the air temperature, the same at every height."""
        return self._signal("temperature", t_s)

    def board_temperature_degc(self, t_s: npt.ArrayLike) -> Array:
        """Return the signal of an ideal thermometer on the board."""
        return self._signal("warmth", t_s)

    def relative_humidity_percent(self, t_s: npt.ArrayLike) -> Array:
        return self._signal("humidity", t_s)

    def sensed(self, quantity: str, *, one_row: bool = False, heating: float = 0.0) -> Sensed:
        """Return a sensor's input, a quantity in :data:`QUANTITIES`, in board axes.

        ``one_row``: if all rows are equal, return a single row, which the caller must not change. ``heating``:
        share of the board's heating at the sensor. Raises InputError for an unknown quantity.
        """
        if quantity not in QUANTITIES:
            raise InputError(f"unknown quantity {quantity!r}; known: {', '.join(QUANTITIES)}")
        name = QUANTITIES[quantity]
        value_of = partial(self._warmed, heating) if heating and name == "warmth" else _of_signal
        return Sensed(self._signals[name], self._agitation[name], one_row, value_of)

    def altitude_m(self, t_s: npt.ArrayLike) -> Array:
        """Return the height above the room's floor."""
        return _sampled(self._altitude_m, t_s)

    def position_m(self, t_s: npt.ArrayLike) -> Array:
        """Return the position in metres north and east of the start and above the room's floor, (N, 3)."""
        north, west, up = _sampled(self._position_m, t_s).T
        return np.stack((north, 0.0 - west, up), axis=1)

    def magnet(self, t_s: float) -> tuple[float, float, float, float] | None:
        """Return the hand-held magnet, or None: moment in A m2, and metres north, west and up of the board."""
        magnet = self._magnet.at(t_s)
        if magnet is None:
            return None
        north, west, up = magnet.moving(np.array([t_s]))[0][0].tolist()
        return magnet.moment_am2, north, west, up

    def rests(self, from_s: float, to_s: float) -> bool:
        """Return whether the signals are constant between these times, except for a wandering pressure.

        Return False if the history of that time has been dropped.
        """
        return (
            from_s >= self._forgotten_s
            and self._heating.settled(from_s)
            and self._lag.at(to_s).settled(from_s)
            and all(agitation.rests(from_s, to_s) for agitation in self._agitation.values())
        )

    def hard_iron_mgauss(self, t_s: npt.ArrayLike) -> Array:
        """Return the board's own field at the magnetometer."""
        return _sampled(lambda t: self._hard_iron.evaluate(t, Constant.value), t_s)

    def _restore_laws(self, start_s: float, names: Iterable[str]) -> None:
        for name in names:
            if self._signals[name].last is not self._laws[name]:
                self._signals[name].plan(start_s, self._laws[name])

    def _bound_history(self, now_s: float) -> None:
        """Drop the older half of the history when one quantity has changed more than `HISTORY_CHANGES` times."""
        spans: tuple[Spans[Any], ...] = (
            self._shakes,
            self._pressure_disturbances,
            self._disturbances,
            *self._agitation.values(),
        )
        for events in spans:
            events.settle(now_s - RECENT_S)
        tracks: tuple[Track[Any], ...] = (
            self._attitude,
            self._north,
            self._west,
            self._height,
            self._grip,
            self._motors,
            self._gravity,
            self._earth,
            self._steel,
            self._magnet,
            self._hard_iron,
            self._soft_iron,
            self._floor_pressure,
            self._wander,
            self._temperature,
            self._lag,
            self._humidity,
            *self._signals.values(),
        )
        histories: tuple[Track[Any] | Spans[Any], ...] = (*tracks, *spans)
        longest = max(histories, key=len)
        before_s = min(longest.middle_s, now_s - KEPT_S)
        if len(longest) <= HISTORY_CHANGES or before_s <= self._forgotten_s:
            return
        self._forgotten_s = before_s
        for history in histories:
            history.forget(before_s)

    def _signal(self, name: str, t_s: npt.ArrayLike) -> Array:
        return _sampled(lambda t: self._signals[name].evaluate(t, _of_signal), t_s)

    def _rotation(self, t_s: Array) -> Array:
        return self._grip.evaluate(t_s, self._rotation_in)

    def _rotation_in(self, grip: Grip | None, t_s: Array) -> Array:
        steady = self._attitude.evaluate(t_s, lambda piece, t: piece.rotation(t))
        return steady if grip is None else grip.rotation(steady, t_s)

    def _rate_dps(self, t_s: Array) -> Array:
        return self._grip.evaluate(t_s, self._rate_in)

    def _rate_in(self, grip: Grip | None, t_s: Array) -> Array:
        steady = self._attitude.evaluate(t_s, lambda piece, t: piece.rate_dps(t))
        return steady if grip is None else grip.rate_dps(steady, t_s)

    def _motion_m_s2(self, t_s: Array) -> Array:
        moved = self._along(t_s, lambda piece, t: piece.acceleration_m_s2(t))
        total: Array = self._shakes.total(t_s, ShakeSegment.acceleration_m_s2) + moved
        return total

    def _along(self, t_s: Array, function: Callable[[Coordinate, Array], Array]) -> Array:
        """Return a quantity of the motion to the north, west and up, (N, 3), or (1, 3) if constant."""
        columns = [track.evaluate(t_s, function) for track in (self._north, self._west, self._height)]
        return np.stack(np.broadcast_arrays(*columns), axis=1)

    def _carried_in(self, grip: Grip | None, t_s: Array) -> Array:
        if grip is None:
            return NOTHING
        rate = self._attitude.evaluate(t_s, lambda piece, t: piece.rate_dps(t))
        faster = self._attitude.evaluate(t_s, lambda piece, t: piece.acceleration_dps2(t))
        return grip.carried_m_s2(rate, faster, t_s)

    def _on_board_m_s2(self, t_s: Array) -> Array:
        carried = self._grip.evaluate(t_s, self._carried_in)
        return carried + self._motors.evaluate(t_s, _shaken_by)

    def _force_g(self, t_s: Array) -> Array:
        force = self._motion_m_s2(t_s) + self._gravity.evaluate(t_s, Constant.value)[:, np.newaxis] * UP
        felt: Array = to_board(self._rotation(t_s), force) + self._on_board_m_s2(t_s)
        return felt / STANDARD_GRAVITY

    def _linear_g(self, signal: Signal, t_s: Array) -> Array:
        if signal == self._laws["acc"]:
            motion = to_board(self._rotation(t_s), self._motion_m_s2(t_s))
            motion = motion + self._on_board_m_s2(t_s)
            moving, resting = motion / STANDARD_GRAVITY, np.zeros(1)
        else:
            moving, resting = signal(t_s), self._gravity.evaluate(t_s, Constant.value) / STANDARD_GRAVITY
        linear: Array = np.abs(np.linalg.norm(moving, axis=1) - resting)
        return linear

    def _field_mgauss(self, t_s: Array) -> Array:
        disturbance = self._disturbances.total(t_s, lambda piece, t: piece.value(t))
        disturbance = disturbance + self._magnet.evaluate(t_s, _field_of)
        room = self._steel.evaluate(t_s, self._bent_in)
        field = to_board(self._rotation(t_s), room + disturbance)
        distorted: Array = np.einsum("nij,nj->ni", self._soft_iron.evaluate(t_s, Constant.value), field)
        own = self._hard_iron.evaluate(t_s, Constant.value) + self._motors.evaluate(t_s, _magnetised_by)
        return distorted + own

    def _bent_in(self, steel: tuple[Steel, ...], t_s: Array) -> Array:
        """Return the Earth's field, bent by steel in the room."""
        earth = self._earth.evaluate(t_s, Constant.value)
        if not steel:
            return earth
        position_m = self._position_m(t_s)
        bent: Array = earth + sum(one.value(position_m, earth) for one in steel)
        return bent

    def _position_m(self, t_s: Array) -> Array:
        """Return metres north, west and up, (N, 3), or (1, 3) at rest."""
        carried = self._along(t_s, lambda piece, t: piece.position_m(t))
        carried = carried + self._grip.evaluate(t_s, self._shift_in)
        total: Array = carried + self._shakes.total(t_s, ShakeSegment.displacement_m)
        return total

    def _altitude_m(self, t_s: Array) -> Array:
        return self._position_m(t_s)[:, 2]

    def _shift_in(self, grip: Grip | None, t_s: Array) -> Array:
        return NOTHING if grip is None else grip.shift_m(self._rotation_in(grip, t_s))

    def _pressure_hpa(self, t_s: Array) -> Array:
        floor_hpa = self._floor_pressure.evaluate(t_s, lambda piece, t: piece.value(t))
        floor_hpa = floor_hpa + self._pressure_disturbances.total(t_s, lambda one, t: one.value(t))[:, 0]
        floor_hpa = floor_hpa + self._wander.evaluate(t_s, Wander.value)
        return floor_hpa * pressure_ratio(self._altitude_m(t_s), self._temperature_degc(t_s))

    def _temperature_degc(self, t_s: Array) -> Array:
        return self._temperature.evaluate(t_s, Constant.value)

    def _board_degc(self, t_s: Array) -> Array:
        lag = self._lag.evaluate(t_s, lambda warmth, t: warmth.value(t))
        return self._temperature_degc(t_s) + self._heating.value(t_s) + lag

    def _warmed(self, more: float, signal: Signal, t_s: Array) -> Array:
        degc = signal(t_s)
        return degc + more * self._heating.value(t_s) if signal == self._laws["warmth"] else degc

    def _humidity_percent(self, t_s: Array) -> Array:
        return self._humidity.evaluate(t_s, Constant.value)


def _of_signal(signal: Signal, t_s: Array) -> Array:
    return signal(t_s)


class Sensed:
    """One quantity at the input of a sensor. Before power-on, the quantity has its value at power-on."""

    def __init__(
        self,
        track: Track[Signal],
        agitation: Agitation,
        one_row: bool,
        value_of: Callable[[Signal, Array], Array] = _of_signal,
        turned: Array | None = None,
    ) -> None:
        self._track, self._agitation, self._one_row = track, agitation, one_row
        self._value_of, self._turned = value_of, turned

    def turned(self, mounting: npt.ArrayLike) -> Sensed:
        """Return this quantity in a sensor's axes; ``mounting`` is (3, 3)."""
        turned = np.asarray(mounting, dtype=np.float64).T
        return Sensed(self._track, self._agitation, self._one_row, self._value_of, turned)

    def __call__(self, t_s: Array) -> Array:
        values = self._track.evaluate(np.maximum(t_s, 0.0), self._value_of)
        if not self._one_row:
            values = _rows(values, t_s.size)
        return values if self._turned is None else values @ self._turned

    def agitated(self, from_s: float, to_s: float, pace_s: float) -> list[tuple[float, float]]:
        """Return the intervals in which the quantity jumps, or moves from rest to rest in less than ``pace_s``."""
        return self._agitation.faster(from_s, to_s, pace_s)


def _shaken_by(motors: Motors | None, t_s: Array) -> Array:
    return NOTHING if motors is None else motors.acceleration_m_s2(t_s)


def _magnetised_by(motors: Motors | None, _t_s: Array) -> Array:
    return NOTHING if motors is None else motors.field_mgauss()


def _field_of(magnet: HeldMagnet | None, t_s: Array) -> Array:
    return NOTHING if magnet is None else magnet.value(t_s)


def _sampled(signal: Signal, t_s: npt.ArrayLike) -> Array:
    """Return one row for each time, in a new array."""
    times = np.atleast_1d(np.asarray(t_s, dtype=np.float64))
    return _rows(signal(times), times.size)


def _rows(values: Array, count: int) -> Array:
    return values.repeat(count, axis=0) if len(values) == 1 else values.copy()
