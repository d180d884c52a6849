"""Steel in the room: a magnetic field that depends on the position of the board."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from fcu_emulator import Board
from fcu_emulator.emulator.errors import InputError
from fcu_emulator.emulator.world import World
from fcu_emulator.emulator.world.track import Array

EARTH = np.array([215.0, 0.0, -430.0])  # north, west, up, in mgauss: the default field
RADIUS_M = 0.1


def field_at(place_m: Array, radius_m: float = RADIUS_M, moment_am2: tuple[float, ...] = (0, 0, 0)) -> Array:
    """Return the field NWU at positions (N, 3), north, east, up from a sphere of steel, to which the board is moved."""
    fields = []
    for north_m, east_m, up_m in place_m:
        world = World()
        world.put_steel(-north_m, -east_m, -up_m, radius_m, moment_am2)
        fields.append(world.magnetic_field_mgauss([0.0])[0])
    return np.array(fields)


def yaw_deg(world: World, t_s: float) -> float:
    x, y, _ = world.magnetic_field_mgauss([t_s])[0]
    return float(np.degrees(np.arctan2(-y, x)))


def test_soft_steel_is_permeable_sphere() -> None:
    """On the surface the field is normal: three times the normal part of the uniform field, without a tangential part."""
    directions = np.random.default_rng(1).normal(size=(50, 3))
    directions /= np.linalg.norm(directions, axis=1)[:, np.newaxis]
    fields = field_at(RADIUS_M * directions)
    outward = directions * [1.0, -1.0, 1.0]  # NWU
    normal = (outward @ EARTH)[:, np.newaxis]
    np.testing.assert_allclose(fields, 3 * normal * outward, atol=1e-9)


def test_steel_field_has_neither_divergence_nor_curl() -> None:
    h = 1e-4
    for at in np.random.default_rng(2).uniform(0.15, 0.4, size=(5, 3)):
        steps = h * np.eye(3)
        slopes = (field_at(at + steps) - field_at(at - steps)) / (2 * h) * [[1.0], [-1.0], [1.0]]
        assert abs(np.trace(slopes)) < 1e-4 * np.abs(slopes).max()
        np.testing.assert_allclose(slopes, slopes.T, atol=1e-4 * np.abs(slopes).max())


def test_magnetised_steel_adds_field_of_dipole() -> None:
    """Griffiths (5.88): 2 m / r^3 on the axis; 1 A m2 at 1 m is 1 mgauss in each term."""
    places = np.array([[0.5, 0, 0], [0, 0.5, 0], [0, 0, 0.5]])
    change = field_at(places, moment_am2=(2.0, 0.0, 0.0)) - field_at(places)
    np.testing.assert_allclose(change, np.array([[32, 0, 0], [-16, 0, 0], [-16, 0, 0]]), atol=1e-9)


def test_board_moved_by_ten_centimetres_turns_its_compass() -> None:
    """The yaw is the direction of a sphere's field, B + R^3 (3 (B.r) r / r^2 - B) / r^3."""
    world, other = World(), World()
    world.put_steel(north_m=0.2, east_m=0.2, up_m=-0.1, radius_m=0.12)
    for one in (world, other):
        one.move(north_m=-0.1, duration_s=1)
    expected = []
    for north_m in (0.0, -0.1):
        from_steel = np.array([north_m - 0.2, 0.2, 0.1])
        r = np.linalg.norm(from_steel)
        bent = EARTH + 0.12**3 * (3 * (EARTH @ from_steel) * from_steel / r**2 - EARTH) / r**3
        expected.append(np.degrees(np.arctan2(-bent[1], bent[0])))
    np.testing.assert_allclose([yaw_deg(world, 0.0), yaw_deg(world, 1.0)], expected, atol=1e-9)
    assert abs(expected[1] - expected[0]) > 3
    assert yaw_deg(other, 0.0) == yaw_deg(other, 1.0) == 0.0


def test_steel_follows_outer_field_until_removed() -> None:
    world = World()
    world.put_steel(0.0, 0.3, 0.0, RADIUS_M)
    world.put_steel(0.0, -0.3, 0.0, RADIUS_M)
    one = field_at(np.array([[0.0, 0.3, 0.0]]))[0]
    np.testing.assert_allclose(
        world.magnetic_field_mgauss([0.0])[0], 2 * one - EARTH
    )  # each by the Earth's field
    world.set_magnetic_field(0, 0, 0)
    np.testing.assert_array_equal(world.magnetic_field_mgauss([0.0]), np.zeros((1, 3)))
    world.set_magnetic_field(21.5, 0, 43)
    world.take_steel_away()
    np.testing.assert_allclose(world.magnetic_field_mgauss([0.0])[0], EARTH)


def test_magnetometer_shows_steel_of_scenario(tmp_path: Path) -> None:
    path = tmp_path / "desk.toml"
    path.write_text(
        'schema = 1\nquestion = "?"\nduration = "6s"\n[sensors]\nquality = "ideal"\n'
        "[[world.steel]]\nnorth_m = 0.2\neast_m = 0.2\nup_m = -0.1\nradius_m = 0.12\n"
        '[[timeline]]\ndo = "move"\nat = "2s"\nfor = "1s"\neast_m = 0.1\n',
        encoding="utf-8",
    )
    board = Board("lab3", scenario=path)
    shown = []
    for until_s in (2.0, 4.0):
        board.run_until(until_s)
        raw = board.i2c("I2C2").write_read(0x1E, b"\x68", 6)
        y, x, _ = np.frombuffer(raw, "<i2") * [-1.5, 1.5, 1.5]  # mgauss; raw is turned by 90 degrees
        true = board.world.magnetic_field_mgauss([until_s])[0]
        shown.append((float(np.hypot(x, y)), float(np.hypot(*true[:2]))))
    np.testing.assert_allclose(*np.array(shown).T, atol=2.5)
    assert abs(shown[0][1] - shown[1][1]) > 10


@pytest.mark.parametrize(
    ("more", "name"),
    [
        ({"radius_m": 0}, "radius_m"),
        ({"north_m": 1e6}, "north_m"),
        ({"east_m": "x"}, "east_m"),
        ({"east_m": 1e6}, "east_m must be .*, not 1000000.0"),
        ({"moment_am2": (1, 2)}, "moment_am2"),
        ({"moment_am2": (1, 2, float("nan"))}, "moment_am2"),
    ],
)
def test_impossible_steel_is_refused(more: dict[str, object], name: str) -> None:
    given: dict[str, object] = {"north_m": 0.1, "east_m": 0.0, "up_m": 0.0, "radius_m": 0.1}
    with pytest.raises(InputError, match=name):
        World().put_steel(**(given | more))  # type: ignore[arg-type]


def test_shake_beside_steel_is_sampled_densely_by_magnetometer() -> None:
    world = World()
    world.put_steel(0.15, 0.0, 0.0, 0.05)
    world.shake("north", 1.0, 20.0, 1.0)

    assert world.sensed("magnetic_field_mgauss").agitated(0.2, 0.3, 1.0)
