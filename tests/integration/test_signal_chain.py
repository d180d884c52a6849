"""The responses and the noise that ``python -m tests.support.signal_chain`` draws, tested at a few points."""

from __future__ import annotations

import numpy as np
import pytest

from tests.support.signal_chain import Resting, Setting, allan_deviation, at_rest, gain, resting, settings


@pytest.mark.parametrize("setting", settings(), ids=lambda setting: setting.name)
def test_sensor_response_to_vibration_equals_theory(setting: Setting) -> None:
    for of_odr in (0.23, 0.63):
        hz = of_odr * setting.rate_hz
        expected = float(setting.theory(np.array([hz]))[0])
        assert gain(setting, hz, count=80) == pytest.approx(expected, abs=0.01 + 0.03 * expected)


@pytest.mark.parametrize("part", resting(), ids=lambda part: part.channel.name)
def test_averaged_noise_equals_calculated_deviation(part: Resting) -> None:
    """200 means over a second give the deviation to 5 %. There are three axes, and three such series."""
    values = at_rest(part, 200)
    found = allan_deviation(values, int(part.channel.rate_hz))
    assert found == pytest.approx(np.full(found.shape, part.deviation(1.0)), rel=0.25)
