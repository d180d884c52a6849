"""The solution in C and the Python model agree on all shipped scenarios.

There are two tests. Arithmetic and text: on the samples that the C firmware has read, the Python firmware prints the
same bytes and switches the same LEDs. This includes noise and motion. Sampling: if each firmware runs
separately, both write the same registers and print the same lines. Each number is a value of the other firmware's
variable at about the same time, within the resolution. A stronger statement is not possible, because both read the
sensors at times up to a tick apart, with different noise and a moving board.

The runs are shortened, but include some motion, because the execution of ARM code is slow. ``fcu diff`` runs the
whole scenarios.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from fcu_emulator.emulator.analysis.compare import Rules, compare
from fcu_emulator.emulator.analysis.observation import TERMINAL, TIMER, Observation, ObservedItem
from fcu_emulator.emulator.scenario import scenario_names
from tests.support.arm.agreement import Track, numbers_of, ran, replayed, text_of

SECONDS = {
    "askew": 3.3,  # figure-of-eight from 1.5 s on
    "clocks": 4.4,  # the vibration has begun
    "compass_turn": 3.3,  # figure-of-eight from 2 s on
    "desk": 2.2,
    "exercise_1": 2.2,
    "drift": 2.3,
    "figure_eight": 2.3,
    "flat": 2.3,
    "free_fall": 2.3,  # on the way up
    "hand": 3.3,  # waved to and fro
    "iron": 2.3,
    "led_x": 4.6,  # LED1 comes on
    "led_y": 2.3,
    "magnet_passes_by": 2.3,
    "motors": 2.3,
    "outside": 6.4,  # the air has become colder
    "plugged_in": 4.3,  # 4 degrees warmer
    "slow_bus": 1.4,
    "stairs": 2.2,
    "tilt_sweep": 3.3,
    "weather": 2.3,
}

RESOLUTION = {
    # One LSB of the raw value as it is printed; for pitch and roll what 1 mg in 1000 mg
    # turns them by, for the yaw 2 mgauss in the 215 mgauss of the field's horizontal part.
    "ACC": 1.0,
    "GYR": 70.0,
    "MAG": 2.0,
    "Pre": 0.0101,
    "Pitch": 0.06,
    "Roll": 0.06,
    "Yaw": 0.6,
}
WITHIN_MS = 100  # some samples of the barometer, and longer than the C firmware takes to format a line


def _without_counts(observation: Observation) -> dict[str, Sequence[ObservedItem]]:
    """Return the observed sequences with only the rate of the timer, without its counts."""
    return {**observation.sequences, TIMER: observation.sequences[TIMER][:1]}


def test_every_scenario_is_tested() -> None:
    assert sorted(SECONDS) == sorted(scenario_names())


@pytest.mark.parametrize("name", scenario_names())
def test_solution_and_python_model_agree(name: str) -> None:
    board, in_c = ran("solution", name, SECONDS[name])
    _, in_python = ran("lab3", name, SECONDS[name])
    on_its_samples = replayed(board, "lab3")
    track = Track(name, SECONDS[name])

    assert text_of(on_its_samples) == text_of(in_c)
    assert not compare(on_its_samples, in_c)
    if name == "slow_bus":  # which ticks are lost depends on when each read ends; the rate does not
        in_python, in_c = (replace(one, sequences=_without_counts(one)) for one in (in_python, in_c))
    assert not compare(in_python, in_c, Rules(ignore={"numbers"}))
    far = [
        (at_ps, field, value)
        for at_ps, field, value in numbers_of(in_c.sequences[TERMINAL])
        if field != "Altitude"  # computed from Pre; the floor's is one noisy reading, and is in the replay
        and not _is_about(track.deviations(field, value, at_ps, WITHIN_MS), RESOLUTION[field.split(".")[0]])
    ]
    assert not far


def _is_about(deviations: NDArray[np.float64], resolution: float) -> bool:
    return bool(deviations.min() <= resolution and deviations.max() >= -resolution)
