"""Scenarios in which a board shows counter-examples of the lab's laws.

Decision: the scenario of a counter-example is shown only if it fails on the student's firmware
and passes on the lab's firmware. The sensors' finite
resolution may hide an error.
"""

from __future__ import annotations

import math
import tomllib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, TypeAlias

from fcu_emulator import Board
from fcu_emulator.emulator.host.install_hints import command_line
from fcu_emulator.emulator.scenario import run
from fcu_emulator.emulator.scenario.loader import scenario_of
from fcu_emulator.emulator.scenario.toml_writer import scenario_text
from fcu_emulator.emulator.testing.strategies import MGAUSS_PER_UT, Pose, Vector
from fcu_emulator.emulator.world.truth import ZURICH_FIELD_UT

FILE = "replay.toml"
REFERENCE = "lab3"
"""A correct firmware. If it fails in a scenario, the scenario is not used."""

Table: TypeAlias = dict[str, Any]

RANGES_DEG = {"Pitch": 90.0, "Roll": 90.0, "Yaw": 180.0}
LEAST_DEG = {"Pitch": 0.2, "Roll": 0.2, "Yaw": 1.0}
"""Smallest errors in degrees that ideal sensors resolve, because raw values are integers."""
_MOST_DEG = 2.0
LEAST_MGAUSS = 5.0
_LEAST_AT_ZERO_M = 0.01  # smallest error at the floor, where both pressures are equal
_LEAST_HPA = 0.02  # pressures are truncated to 0.01 hPa, twice
_LEAST_OF_HEIGHT = 5e-4  # temperatures are truncated to 0.1 K
_MOST_GRAVITY = 3.5  # full scale is 4 g


def angle_tolerance_deg(name: str, error_deg: float) -> float:
    """Return a tolerance that is small enough to detect an error of this size."""
    return min(max(error_deg / 2, LEAST_DEG[name]), _MOST_DEG) if math.isfinite(error_deg) else _MOST_DEG


def pose_scenario(
    pose: Pose, expected_deg: Mapping[str, tuple[float, float]], *, gravity: float = 1, field: float = 1
) -> str:
    """Return a scenario that sets the pose, with a calibrated compass.

    ``expected_deg``: value and tolerance of each field. ``gravity``, ``field``: multiples of the usual
    values.
    """
    expectations = [
        {"kind": "field", "name": name, "value": round(value, 3) + 0.0, "tolerance": tolerance, "from": "19s"}
        for name, (value, tolerance) in expected_deg.items()
    ]
    return scenario_text(_pose_table(pose, expectations, gravity, field))


def pose_against_truth(pose: Pose, names: Sequence[str]) -> str:
    """Return a scenario that sets the pose and compares fields with the truth."""
    expectations = [
        {"kind": "field", "name": name, "truth": True, "tolerance": _MOST_DEG, "from": "19s"}
        for name in names
    ]
    return scenario_text(_pose_table(pose, expectations, 1, 1))


def _pose_table(pose: Pose, expectations: list[Table], gravity: float, field: float) -> Table:
    angles = f"roll {pose.roll_deg:g}, pitch {pose.pitch_deg:g}, yaw {pose.yaw_deg:g} degrees"
    ranges = [
        {"kind": "within", "name": name, "min": -limit, "max": limit} for name, limit in RANGES_DEG.items()
    ]
    world: Table = {}
    if gravity != 1:
        world["gravity"] = 9.80665 * min(gravity, _MOST_GRAVITY)
    if field != 1:
        world["field"] = {
            f"{axis}_ut": field * ut
            for axis, ut in zip(("north", "east", "down"), ZURICH_FIELD_UT, strict=True)
        }
    return {
        "schema": 1,
        "question": f"Does the firmware print the correct angles at {angles}?",
        "duration": "22s",
        "timeline": [
            {"do": "figure_eight", "at": "2s", "for": "15s"},
            {"do": "set_attitude", "at": "17500ms", **vars(pose)},
        ],
        "expect": [*expectations, *ranges],
        "sensors": {"quality": "ideal"},
        **({"world": world} if world else {}),
    }


def calibration_scenario(offset: Vector, field_mgauss: int, order: Sequence[int], end: Vector) -> str:
    """Return a scenario that turns each axis into both directions of a horizontal field.

    The scenario expects that the final values of MAG are ``end``. ``order``: order of X, -X, Y, -Y, Z and -Z.
    """
    turns = [*(_ALONG[index] for index in order), _ALONG[_direction(end)]]
    steps = [
        {"do": "set_attitude", "at": f"{2000 + 500 * number}ms", **angles}
        for number, angles in enumerate(turns)
    ]
    values = zip("xyz", end, strict=True)
    expectations = [
        {"kind": "field", "name": f"MAG.{axis}", "value": value, "tolerance": LEAST_MGAUSS, "from": "6s"}
        for axis, value in values
    ]
    north_ut = field_mgauss / MGAUSS_PER_UT
    return scenario_text(
        {
            "schema": 1,
            "question": f"Does the calibration find a hard iron of {offset} mgauss?",
            "duration": "9s",
            "timeline": steps,
            "expect": expectations,
            "sensors": {"quality": "ideal"},
            "world": {
                "hard_iron_mgauss": list(offset),
                "field": {"north_ut": north_ut, "east_ut": 0, "down_ut": 0},
            },
        }
    )


def altitude_scenario(
    zero_hpa: float, press_hpa: float, temperature_degc: float, altitude_m: float, error_m: float
) -> str:
    """Return a scenario with the pressure of the floor, and later another pressure."""
    tolerance = least_m(zero_hpa, press_hpa, temperature_degc, altitude_m)
    if math.isfinite(error_m):
        tolerance = max(error_m / 2, tolerance)
    altitude = {"kind": "field", "name": "Altitude", "value": round(altitude_m, 3) + 0.0, "from": "5s"}
    return scenario_text(
        {
            "schema": 1,
            "question": f"Is {press_hpa:g} hPa the right altitude, with {zero_hpa:g} hPa at the floor?",
            "duration": "8s",
            "timeline": [{"do": "set_pressure", "at": "3s", "pressure_hpa": press_hpa}],
            "expect": [altitude | {"tolerance": tolerance}],
            "sensors": {"quality": "ideal"},
            "world": {"pressure_hpa": zero_hpa, "temperature_degc": temperature_degc},
        }
    )


def least_m(zero_hpa: float, press_hpa: float, temperature_degc: float, altitude_m: float = 0.0) -> float:
    """Return the smallest altitude error in m that ideal sensors resolve."""
    if zero_hpa == press_hpa:
        return _LEAST_AT_ZERO_M
    metres_per_hpa = 29.27 * (temperature_degc + 273.15) / press_hpa  # R / (M g), isothermal
    return _LEAST_HPA * metres_per_hpa + _LEAST_OF_HEIGHT * abs(altitude_m)


def command(firmware: str) -> str:
    """Return the command for the saved scenario."""
    return command_line(["fcu", "run", firmware, "--scenario", FILE, "--speed", "max"])


def shows(firmware: str, scenario: str) -> bool:
    """Return whether ``firmware`` fails and ``lab3`` passes in a scenario. Raises InputError."""
    return _passes(REFERENCE, scenario) and not _passes(firmware, scenario)


def _passes(firmware: str, scenario: str) -> bool:
    with Board(firmware, scenario=scenario_of(tomllib.loads(scenario), Path(FILE))) as board:
        return run(board).passed


_ALONG: tuple[Table, ...] = (
    {"yaw_deg": 0},
    {"yaw_deg": 180},
    {"yaw_deg": -90},
    {"yaw_deg": 90},
    {"pitch_deg": 90},
    {"pitch_deg": -90},
)
"""Attitudes in which X, -X, Y, -Y, Z or -Z points along a field to the north."""


def _direction(end: Vector) -> int:
    axis = next(index for index, component in enumerate(end) if component)
    return 2 * axis + (end[axis] < 0)
