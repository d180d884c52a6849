"""Hypothesis strategies for attitudes, sensor samples, fields, iron and motions.

::

    from hypothesis import given
    from fcu_emulator.emulator.testing.strategies import motions, samples

    @given(samples())
    def test_pitch_stays_within_90_degrees(sample):
        ...  # sample.acc in mg, sample.mag in mgauss

    @given(motions(firmware="lab3.elf"))
    def test_altitude_is_printed_as_a_number(motion):
        board = Board("lab3.elf", scenario=motion.scenario)

The board's axes are X right, Y forward, Z up. At rest, the axis that points up measures +1000 mg. An attitude is
a turn by yaw, then by pitch, then by roll. Examples shrink towards a flat board that points north.
"""

from __future__ import annotations

import math
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
from hypothesis import note
from hypothesis import strategies as st

from fcu_emulator.emulator.host.install_hints import command_line
from fcu_emulator.emulator.scenario.loader import drawn, is_path, load_scenario, read_toml, scenario_of
from fcu_emulator.emulator.scenario.scenario import Scenario
from fcu_emulator.emulator.scenario.toml_writer import scenario_text
from fcu_emulator.emulator.world.attitude import euler_to_matrix
from fcu_emulator.emulator.world.truth import ZURICH_FIELD_UT

Vector: TypeAlias = tuple[int, int, int]

ONE_G_MG = 1000
MGAUSS_PER_UT = 10
_NEAR = 0.01  # distance from an edge case in degrees


@dataclass(frozen=True)
class Pose:
    """A board's attitude in degrees."""

    roll_deg: float
    pitch_deg: float
    yaw_deg: float

    @property
    def is_about_one_axis(self) -> bool:
        """Whether roll or pitch is 0, because then the lab's roll is exact."""
        return self.roll_deg == 0 or self.pitch_deg == 0


@dataclass(frozen=True)
class MotionSample:
    """Ideal sensor values at a pose: ``acc`` in mg, ``mag`` in mgauss."""

    pose: Pose
    acc: Vector
    mag: Vector


def attitudes(
    max_roll_deg: float = 180.0, max_pitch_deg: float = 90.0, *, one_axis: bool = False
) -> st.SearchStrategy[Pose]:
    """Strategy for poses. ``one_axis``: roll or pitch is always 0."""
    rolls, pitches, yaws = angles(max_roll_deg), angles(max_pitch_deg), angles(180.0)
    level = st.just(0.0)
    if one_axis:
        return st.builds(Pose, level, pitches, yaws) | st.builds(Pose, rolls, level, yaws)
    return st.builds(Pose, rolls, pitches, yaws)


def angles(limit_deg: float) -> st.SearchStrategy[float]:
    """Strategy for angles up to the limit. Many of the angles are near quarter turns."""
    quarters = [at * 90.0 + beside for at in range(-2, 3) for beside in (0.0, _NEAR, -_NEAR)]
    edges = sorted(
        {angle for angle in (*quarters, -limit_deg, limit_deg) if abs(angle) <= limit_deg}, key=abs
    )
    anywhere = st.floats(-limit_deg, limit_deg).map(lambda angle: round(angle, 3) + 0.0)
    return st.sampled_from(edges) | anywhere


def fields() -> st.SearchStrategy[tuple[float, float, float]]:
    """Strategy for the earth's field: north, east (0) and down in microtesla.

    The field's magnitude is 22 to 67 uT (World Magnetic Model), and its horizontal part is at least 10 uT.
    """
    return (
        st.tuples(st.floats(22.0, 67.0), st.floats(-80.0, 80.0))
        .map(
            lambda one: (
                one[0] * math.cos(math.radians(one[1])),
                0.0,
                one[0] * math.sin(math.radians(one[1])),
            )
        )
        .filter(lambda field: field[0] >= 10.0)
    )


def samples(
    poses: st.SearchStrategy[Pose] | None = None,
    field_ut: tuple[float, float, float] = ZURICH_FIELD_UT,
    *,
    noise_mg: int = 0,
    noise_mgauss: int = 0,
) -> st.SearchStrategy[MotionSample]:
    """Strategy for samples at ``poses`` (default: any).

    ``field_ut``: north, east, down. ``noise_mg``, ``noise_mgauss``: maximum noise by axis.
    """
    acc_noise, mag_noise = (st.tuples(*[st.integers(-most, most)] * 3) for most in (noise_mg, noise_mgauss))
    return st.builds(
        lambda pose, acc, mag: MotionSample(pose, *_shown(pose, field_ut, acc, mag)),
        attitudes() if poses is None else poses,
        acc_noise,
        mag_noise,
    )


def hard_irons(most_mgauss: int = 500) -> st.SearchStrategy[Vector]:
    """Strategy for hard iron in mgauss, in board axes."""
    return st.tuples(*[st.integers(-most_mgauss, most_mgauss)] * 3)


def soft_irons(most: float = 0.2) -> st.SearchStrategy[tuple[tuple[float, ...], ...]]:
    """Strategy for soft iron: the unit matrix with symmetric changes of up to ``most``."""
    six = st.tuples(*[st.floats(-most, most).map(lambda number: round(number, 3) + 0.0)] * 6)
    return six.map(lambda s: ((1 + s[0], s[1], s[2]), (s[1], 1 + s[3], s[4]), (s[2], s[4], 1 + s[5])))


def zero_vectors() -> st.SearchStrategy[tuple[Vector, Vector]]:
    """Strategy for pairs of acceleration and field. At least one vector is zero."""
    anything = st.tuples(*[st.integers(-2000, 2000)] * 3)
    zero = st.just((0, 0, 0))
    return st.tuples(zero, zero) | st.tuples(zero, anything) | st.tuples(anything, zero)


class GeneratedMotion:
    """A motion: ``scenario`` for ``Board(firmware, scenario=...)``, and the ``text`` of its file."""

    def __init__(self, scenario: Scenario, text: str) -> None:
        self.scenario = scenario
        self.text = text

    def __repr__(self) -> str:
        return f"Motion of {self.scenario.duration_s:g} s"


@st.composite
def motions(
    draw: st.DrawFn,
    scenario: str | os.PathLike[str] | None = None,
    *,
    firmware: str = "lab3",
    poses: st.SearchStrategy[Pose] | None = None,
    most_moves: int = 4,
    expect: Sequence[Mapping[str, Any]] = (),
) -> GeneratedMotion:
    """Strategy for motions that take a few seconds.

    If ``scenario`` is not given, a motion has up to ``most_moves`` turns to ``poses`` (default:
    any) and lifts, with a stop after each. Its scenario has ideal sensors and the expectations ``expect``.
    If ``scenario`` is given, Hypothesis chooses the scenario's random values. A failure prints the scenario
    and the command for ``firmware``. Raises ScenarioError, InputError.
    """
    if scenario is None:
        path = Path("motion.toml")
        timeline = draw(st.lists(_moves(attitudes() if poses is None else poses), max_size=most_moves))
        table = _table([entry for move in timeline for entry in move], expect)
    else:
        path = load_scenario(scenario).path
        share = st.floats(0.0, 1.0, exclude_max=True)
        table = drawn(read_toml(path, "a scenario file"), lambda *_: draw(share), str(path))
    text = scenario_text(table)
    beside = "" if scenario is None or not is_path(scenario) else f", beside {path.name}"
    run = command_line(["fcu", "run", firmware, "--scenario", "motion.toml", "--speed", "max"])
    note(f"On the board: save as motion.toml{beside}, then\n\n    {run}\n\n{text}# end of motion.toml")
    return GeneratedMotion(scenario_of(table, path), text)


def _moves(poses: st.SearchStrategy[Pose]) -> st.SearchStrategy[list[dict[str, Any]]]:
    lengths = st.integers(500, 2000).map(lambda ms: f"{ms}ms")
    turns = st.builds(lambda pose, length: {"do": "rotate_to", "for": length, **vars(pose)}, poses, lengths)
    metres = st.floats(-5.0, 5.0).map(lambda height: round(height, 2) + 0.0)
    lifts = st.builds(lambda height, length: {"do": "lift", "for": length, "metres": height}, metres, lengths)
    return (turns | lifts).map(lambda move: [move, {"do": "hold", "for": "1500ms"}])


def _table(timeline: list[dict[str, Any]], expect: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    start = {"do": "hold", "for": "2500ms"}  # start-up and the first second of output
    length_ms = sum(int(entry["for"].removesuffix("ms")) for entry in (start, *timeline))
    table = {
        "schema": 1,
        "question": "Is the output correct while the board moves?",
        "duration": f"{length_ms}ms",
        "timeline": [start, *timeline],
        "expect": [dict(one) for one in expect],
        "sensors": {"quality": "ideal"},
    }
    return {key: value for key, value in table.items() if value != []}


def _shown(
    pose: Pose, field_ut: tuple[float, float, float], acc_noise: Vector, mag_noise: Vector
) -> tuple[Vector, Vector]:
    to_world = euler_to_matrix(np.array([[pose.roll_deg, pose.pitch_deg, pose.yaw_deg]]))[0]
    north, east, down = field_ut
    acc = np.rint(to_world.T @ (0, 0, ONE_G_MG)).astype(int) + acc_noise
    mag = np.rint(to_world.T @ (north, -east, -down) * MGAUSS_PER_UT).astype(int) + mag_noise
    return _vector(acc), _vector(mag)


def _vector(values: np.ndarray[tuple[int], np.dtype[np.int64]]) -> Vector:
    x, y, z = (int(value) for value in values)
    return x, y, z
