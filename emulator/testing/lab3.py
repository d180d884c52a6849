"""Laws of the lab's arithmetic, as properties of every correct implementation.

This creates a test class for a student's firmware::

    from fcu_emulator.emulator.testing.lab3 import Compiled, lab3_properties

    TestMyLab = lab3_properties(Compiled("build/mylab.elf"))

pytest prints counter-examples, as scenarios if possible. Expected angles are computed from vectors,
not by the slides' formulas:

* pitch and roll are the inclinations of the X and the Y axis (mu = 1);
* yaw is the angle between the horizontal directions of the X axis and the field. If pitch and roll
  both differ from 0, the slides' roll is approximate, and only the range of the yaw is checked.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple, Protocol, TypeVar
from unittest import SkipTest

import numpy as np
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from fcu_emulator import Board
from fcu_emulator.emulator.errors import InputError, SymbolError
from fcu_emulator.emulator.testing.law_scenarios import (
    FILE,
    LEAST_DEG,
    LEAST_MGAUSS,
    RANGES_DEG,
    altitude_scenario,
    angle_tolerance_deg,
    calibration_scenario,
    command,
    least_m,
    pose_against_truth,
    pose_scenario,
    shows,
)
from fcu_emulator.emulator.testing.strategies import (
    MotionSample,
    Pose,
    Vector,
    attitudes,
    hard_irons,
    samples,
)
from fcu_emulator.firmware_model.ecompass import (
    MAG_MAX_START,
    MAG_MIN_START,
    MagCalibration,
    eCompass,
    getAltitude,
)
from fcu_emulator.firmware_model.sensor_data import AxesRaw_TypeDef

_Method = TypeVar("_Method", bound=Callable[..., None])

ANGLE_TOLERANCE_DEG = 0.01
"""Tolerance of an angle in degrees, for the difference between single and double precision."""
_LEAST_HORIZONTAL_MGAUSS = 50.0
_STARTED_S = 0.1


class Angles(NamedTuple):
    """The lab's three angles in degrees."""

    pitch: float
    roll: float
    yaw: float


class Subject(Protocol):
    """Interface to an implementation of the lab's arithmetic."""

    @property
    def name(self) -> str:
        """The firmware's name in the command that repeats a failure."""
        ...

    def missing(self, what: str) -> str:
        """The reason why "angles", "calibration" or "altitude" is missing, or ""."""
        ...

    def angles(self, acc: Vector, mag: Vector) -> Angles:
        """The angles for an acceleration in mg and a calibrated field in mgauss."""
        ...

    def calibrated(self, field_mgauss: Sequence[Vector]) -> list[Vector]:
        """The samples after hard-iron calibration, from power-on."""
        ...

    def altitude(self, press_hpa: float, temperature_degc: float, press_zero_level_hpa: float) -> float:
        """The altitude in m above the place where the pressure is ``press_zero_level_hpa``."""
        ...


class PythonModel:
    """The lab's arithmetic in Python (:mod:`fcu_emulator.firmware_model.ecompass`)."""

    name = "lab3"

    def missing(self, what: str) -> str:
        del what
        return ""

    def angles(self, acc: Vector, mag: Vector) -> Angles:
        return Angles(*eCompass(AxesRaw_TypeDef(*acc), AxesRaw_TypeDef(*mag), 1.0))

    def calibrated(self, field_mgauss: Sequence[Vector]) -> list[Vector]:
        low, high = (AxesRaw_TypeDef(start, start, start) for start in (MAG_MIN_START, MAG_MAX_START))
        done = []
        for sample in field_mgauss:
            mag = AxesRaw_TypeDef(*sample)
            MagCalibration(mag, low, high)
            done.append((mag.AXIS_X, mag.AXIS_Y, mag.AXIS_Z))
        return done

    def altitude(self, press_hpa: float, temperature_degc: float, press_zero_level_hpa: float) -> float:
        return getAltitude(press_hpa, temperature_degc, press_zero_level_hpa)


class Compiled:
    """Functions of compiled firmware, called on the emulated processor.

    ``firmware``: an ELF file, or a name. ``names``: names that differ from the lab's names, such
    as ``{"yaw": "heading"}``. Functions without parameters use globals such as ``acc`` and
    ``pitch``.
    """

    USUAL: Mapping[str, str] = {
        **{name: name for name in ("eCompass", "MagCalibration", "getAltitude")},
        **{name: name for name in ("acc", "mag", "pitch", "roll", "press_zero_level")},
        "yaw": "azimuth",
    }

    def __init__(self, firmware: str | Path, names: Mapping[str, str] | None = None) -> None:
        unknown = set(names or {}) - set(self.USUAL)
        if unknown:
            raise InputError(
                f"unknown names {sorted(unknown)}; known: {', '.join(self.USUAL)}", kind="unknown_name"
            )
        self.name = str(firmware)
        self._names = {**self.USUAL, **(names or {})}
        self._board: Board | None = None
        self._missing: dict[str, str] = {}

    @property
    def board(self) -> Board:
        """The board after the start-up code has run."""
        if self._board is None:
            self._board = Board(firmware=self.name)
            self._board.run_for(_STARTED_S)
        return self._board

    def missing(self, what: str) -> str:
        """Return the missing function or variable, or ""."""
        if what not in self._missing:
            self._missing[what] = self._find_missing(what)
        return self._missing[what]

    def _find_missing(self, what: str) -> str:
        functions = {"angles": "eCompass", "calibration": "MagCalibration", "altitude": "getAltitude"}
        variables = {"angles": ("acc", "mag", "pitch", "roll", "yaw"), "calibration": ("mag",)}
        arm = self.board.chip
        symbols = None if arm is None else arm.image.symbols
        if symbols is None:
            return f"{self.name} must have symbols"
        for name, find in (
            (functions[what], symbols.function),
            *((variable, symbols.variable_type) for variable in variables.get(what, ("press_zero_level",))),
        ):
            try:
                find(self._names[name])
            except SymbolError as problem:
                if problem.kind != "unknown_name":
                    return str(problem)
                return (
                    f"{problem}; if the function has another name, use Compiled(..., names={{{name!r}: ...}})"
                )
        return ""

    def angles(self, acc: Vector, mag: Vector) -> Angles:
        of = self._names
        with self.board.scratch() as copy:
            copy.set_variable(of["acc"], acc)
            copy.set_variable(of["mag"], mag)
            copy.call(of["eCompass"])
            pitch, roll, yaw = (copy.variable(of[name]) for name in ("pitch", "roll", "yaw"))
        return Angles(_number(pitch), _number(roll), _number(yaw))

    def calibrated(self, field_mgauss: Sequence[Vector]) -> list[Vector]:
        of, done = self._names, []
        with self.board.scratch() as copy:
            for sample in field_mgauss:
                copy.set_variable(of["mag"], sample)
                copy.call(of["MagCalibration"])
                x, y, z = (int(value) for value in vars(copy.variable(of["mag"])).values())
                done.append((x, y, z))
        return done

    def altitude(self, press_hpa: float, temperature_degc: float, press_zero_level_hpa: float) -> float:
        with self.board.scratch() as copy:
            copy.set_variable(self._names["press_zero_level"], press_zero_level_hpa)
            return float(copy.call(self._names["getAltitude"], press_hpa, temperature_degc))


def lab3_properties(subject: Subject, **chosen: Any) -> type[Any]:
    """Return a test class for pytest. The name of the class's variable must begin with Test.

    ``chosen``: Hypothesis settings, such as ``max_examples=1000``.
    """
    body: dict[str, Any] = {"subject": subject}
    for name, method in vars(_Properties).items():
        if name.startswith("test_"):  # Hypothesis requires a separate function for each class
            wanted: tuple[st.SearchStrategy[Any], ...] = method.strategies
            law = settings(**{"deadline": None, "report_multiple_bugs": False, **chosen})
            body[name] = _told(law(given(*wanted)(method)))
    return type("TestLab3", (_Properties,), body)


def _of(*strategies: st.SearchStrategy[Any]) -> Callable[[_Method], _Method]:

    def noted(method: _Method) -> _Method:
        method.strategies = strategies  # type: ignore[attr-defined]
        return method

    return noted


def _told(test: Callable[[_Properties], None]) -> Callable[[_Properties], None]:

    @functools.wraps(test)
    def told(self: _Properties) -> None:
        try:
            test(self)
        except AssertionError as error:
            if self.on_board:
                error.add_note(_by_hand(self.subject.name, self.board_scenario(test)))
            raise

    return told


def _by_hand(firmware: str, scenario: str) -> str:
    if scenario:
        return f"On the board: save as {FILE}, then\n\n    {command(firmware)}\n\n{scenario}# end of {FILE}"
    return (
        "The error is not visible on the board: the sensors do not give the function such arguments, or the "
        "error is smaller than the sensors' resolution. Call the function itself (docs/ci.md, Single functions)."
    )


class _Properties:
    subject: Subject
    on_board = True
    """Whether a failed test runs boards to find a scenario that shows the failure."""
    coarse = False
    """Whether the tests ignore errors that the board's sensors cannot resolve."""
    _example: Callable[[], str] = str

    @property
    def counterexample(self) -> str:
        """The scenario of the latest example. This example may be a failure."""
        return self._example()

    def board_scenario(self, test: Callable[[_Properties], None]) -> str:
        """Return a scenario whose board shows the failure of ``test``, or "".

        The error of a minimised example may be too small for the sensors. Therefore a second search
        ignores such errors.
        """
        if not isinstance(self.subject, Compiled) or shows(self.subject.name, self.counterexample):
            return self.counterexample
        self.coarse = True
        try:
            test(self)
        except AssertionError:
            return self.counterexample if shows(self.subject.name, self.counterexample) else ""
        return ""

    @_of(samples())
    def test_pitch_is_the_inclination_of_the_x_axis(self, sample: MotionSample) -> None:
        """The formula is pitch = atan2(-Gx, sqrt(Gy^2 + Gz^2))."""
        self._compare("pitch", sample, _inclination(sample.acc, 0))

    @_of(samples())
    def test_roll_is_the_inclination_of_the_y_axis(self, sample: MotionSample) -> None:
        """Compare the roll only at pitch 0, where mu has no effect."""
        level = sample.acc[0] == 0
        self._compare("roll", sample, _inclination(sample.acc, 1) if level else None)

    @_of(samples(attitudes(max_roll_deg=89.0, max_pitch_deg=89.0, one_axis=True)))
    def test_yaw_is_the_direction_of_the_x_axis_against_magnetic_north(self, sample: MotionSample) -> None:
        """In this test, pitch or roll is 0. Yaw increases counter-clockwise, seen from above."""
        expected = _heading(sample)
        assume(expected is not None)
        self._compare("yaw", sample, expected)

    @_of(samples(noise_mg=30, noise_mgauss=30))
    def test_angles_stay_within_their_ranges(self, sample: MotionSample) -> None:
        found = self._angles(sample)
        self._example = functools.partial(pose_scenario, sample.pose, {})
        for name, limit_deg in (("pitch", 90.0), ("roll", 90.0), ("yaw", 180.0)):
            found_deg = getattr(found, name)
            right = abs(found_deg) <= limit_deg + ANGLE_TOLERANCE_DEG
            assert right, f"{name} is {found_deg:.3f}, outside of -{limit_deg:g} to {limit_deg:g} degrees"

    @_of(samples(attitudes(max_roll_deg=89.0, max_pitch_deg=89.0)), st.integers(2, 30), st.integers(2, 30))
    def test_angles_do_not_depend_on_the_vectors_lengths(
        self, sample: MotionSample, acc: int, mag: int
    ) -> None:
        longer = MotionSample(sample.pose, _times(sample.acc, acc), _times(sample.mag, mag))
        found, scaled = self._angles(sample), self._angles(longer)
        apart = {
            "Pitch": _apart(found.pitch, scaled.pitch),
            "Roll": _apart(found.roll, scaled.roll),
            "Yaw": _apart(found.yaw, scaled.yaw) if _heading(sample) is not None else 0.0,
        }
        wrong = {name: one for name, one in apart.items() if not one < self._angle_limit_deg(name)}
        law = {
            "Pitch": _inclination(sample.acc, 0),
            "Roll": _inclination(sample.acc, 1) if sample.acc[0] == 0 else None,
            "Yaw": _heading(sample) if sample.pose.is_about_one_axis else None,
        }
        expected = {}
        for name, error_deg in wrong.items():
            exact = law[name]
            value = getattr(found, name.lower()) if exact is None else exact
            if math.isfinite(value):  # the scenario rejects a NaN anyway
                expected[name] = value, angle_tolerance_deg(name, error_deg)
        self._example = functools.partial(pose_scenario, sample.pose, expected, gravity=acc, field=mag)
        for name in (name.lower() for name in wrong):
            one, other = getattr(found, name), getattr(scaled, name)
            raise AssertionError(
                f"{name} is {one:.3f} degrees, and {other:.3f} with longer vectors of the same direction"
            )

    @_of(hard_irons(), st.integers(100, 600), st.permutations(range(6)))
    def test_calibration_finds_any_offset(self, offset: Vector, field: int, order: list[int]) -> None:
        """After each axis has pointed in both directions of the field, only C's rounding error remains."""
        self._require("calibration")
        ends = [_axis(axis, sign * field) for axis in range(3) for sign in (1, -1)]
        turned = [_plus(ends[index], offset) for index in order]
        for end in ends:
            last = self.subject.calibrated([*turned, _plus(end, offset)])[-1]
            self._example = functools.partial(calibration_scenario, offset, field, order, end)
            limit = 2 * LEAST_MGAUSS if self.coarse else 1
            right = all(abs(found - true) <= limit for found, true in zip(last, end, strict=True))
            assert right, (
                f"with a field of {_axes(end)} mgauss and a hard iron of {_axes(offset)} mgauss, "
                f"the calibration leaves {_axes(last)}"
            )

    @_of(st.floats(300.0, 1100.0, width=32), st.floats(-20.0, 40.0, width=32))
    def test_altitude_is_0_where_it_was_zeroed(self, press_hpa: float, temperature_degc: float) -> None:
        self._require("altitude")
        found = self.subject.altitude(press_hpa, temperature_degc, press_hpa)
        self._example = functools.partial(
            altitude_scenario, press_hpa, press_hpa, temperature_degc, 0.0, abs(found)
        )
        limit = 2 * least_m(press_hpa, press_hpa, temperature_degc) if self.coarse else 0.01
        assert abs(found) < limit, (
            f"the altitude is {found:.3f} m at the floor, at {press_hpa:g} hPa and {temperature_degc:g} degC"
        )

    @_of(
        st.floats(300.0, 1099.0, width=32),
        st.floats(1 / 64, 100.0, width=32),
        st.floats(-20.0, 40.0, width=32),
    )
    def test_less_pressure_is_more_altitude(self, press_hpa: float, less: float, temperature: float) -> None:
        """The hypsometric formula (ISO 2533, 6.5 K/km)."""
        self._require("altitude")
        zero = np.float32(press_hpa + less)
        found = self.subject.altitude(press_hpa, temperature, float(zero))
        expected = ((float(zero) / press_hpa) ** (1 / 5.257) - 1) * (temperature + 273.15) / 0.0065
        error = abs(found - expected)
        self._example = functools.partial(
            altitude_scenario, float(zero), press_hpa, temperature, expected, error
        )
        right = found > 0 and math.isclose(found, expected, rel_tol=1e-4, abs_tol=0.02)
        if self.coarse:
            right = error < 2 * least_m(float(zero), press_hpa, temperature, expected)
        assert right, (
            f"the altitude is {found:.3f} and should be {expected:.3f} m, at {press_hpa:g} hPa and "
            f"{temperature:g} degC, with {float(zero):g} hPa at the floor"
        )

    # -- helpers ----------------------------------------------------------------------------------------

    def _require(self, what: str) -> None:
        missing = self.subject.missing(what)
        if missing:
            raise SkipTest(missing)  # without pytest, a grader can catch this error

    def _angles(self, sample: MotionSample) -> Angles:
        self._require("angles")
        return self.subject.angles(sample.acc, sample.mag)

    def _angle_limit_deg(self, field: str) -> float:
        return 2 * LEAST_DEG[field] if self.coarse else ANGLE_TOLERANCE_DEG

    def _compare(self, name: str, sample: MotionSample, expected_deg: float | None) -> None:
        found_deg = getattr(self._angles(sample), name)
        if expected_deg is None:
            return
        difference = _apart(found_deg, expected_deg) if name == "yaw" else abs(found_deg - expected_deg)
        field = name.capitalize()
        tolerance = angle_tolerance_deg(field, difference)
        self._example = functools.partial(pose_scenario, sample.pose, {field: (expected_deg, tolerance)})
        right = (
            difference < self._angle_limit_deg(field)
            and abs(found_deg) <= RANGES_DEG[field] + ANGLE_TOLERANCE_DEG
        )
        assert right, (
            f"{name} is {found_deg:.3f} and should be {expected_deg:.3f} degrees "
            f"(roll {sample.pose.roll_deg:g}, pitch {sample.pose.pitch_deg:g}, yaw {sample.pose.yaw_deg:g})"
        )


def replay(pose: Pose) -> str:
    """Return a scenario that sets the pose and expects those angles that have an exact value."""
    fields = ["Pitch"]
    fields += ["Roll"] if pose.pitch_deg == 0 and abs(pose.roll_deg) < 90 else []
    fields += ["Yaw"] if pose.is_about_one_axis and max(abs(pose.roll_deg), abs(pose.pitch_deg)) < 80 else []
    return pose_against_truth(pose, fields)


def _inclination(acc: Vector, axis: int) -> float | None:
    """Return the inclination of an axis in degrees. It is positive if X points down, or Y points up."""
    length = math.sqrt(sum(component * component for component in acc))
    if length == 0:
        return None
    sign = -1 if axis == 0 else 1
    return math.degrees(math.asin(sign * acc[axis] / length))


def _heading(sample: MotionSample) -> float | None:
    """Return the heading of the X axis in degrees, or None if it is undefined."""
    up = np.array(sample.acc, dtype=float)
    field = np.array(sample.mag, dtype=float)
    if not up.any():
        return None
    up /= np.linalg.norm(up)
    north = field - (field @ up) * up
    ahead = np.array((1.0, 0.0, 0.0)) - up[0] * up
    if np.linalg.norm(north) < _LEAST_HORIZONTAL_MGAUSS or np.linalg.norm(ahead) < 0.01:
        return None
    west = np.cross(up, north)
    return math.degrees(math.atan2(ahead @ west, ahead @ north))


def _apart(one_deg: float, other_deg: float) -> float:
    """Return the angle between two directions, 0 to 180 degrees."""
    return abs((one_deg - other_deg + 180.0) % 360.0 - 180.0)


def _times(vector: Vector, factor: int) -> Vector:
    x, y, z = vector
    return x * factor, y * factor, z * factor


def _plus(one: Vector, other: Vector) -> Vector:
    return one[0] + other[0], one[1] + other[1], one[2] + other[2]


def _axis(axis: int, value: int) -> Vector:
    vector = [0, 0, 0]
    vector[axis] = value
    return vector[0], vector[1], vector[2]


def _axes(vector: Vector) -> str:
    return ", ".join(f"{name} {value}" for name, value in zip("xyz", vector, strict=True))


def _number(value: Any) -> float:
    return float(value)
