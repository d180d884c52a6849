"""Output data rates have the error of the sensor's oscillator, if its errors include ``odr_percent``."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction

import pytest

from tests.support.sensor_fakes import CHANNELS, PS_PER_S, SENSORS, Channel, Chip

RATED = [
    channel
    for channel in CHANNELS
    if channel.ready is not None and "odr_percent" in SENSORS[channel.part].ERRORS.figures()
]
channels = pytest.mark.parametrize("channel", RATED, ids=str)


@channels
@pytest.mark.parametrize("percent", [-7.5, 2.5, 10.0])
def test_samples_come_at_rate_with_oscillator_error(channel: Channel, percent: float) -> None:
    """The thousandth sample shows that no time is rounded on the way."""
    chip = Chip(channel.part, SENSORS[channel.part].ERRORS(odr_percent=percent))
    own = replace(channel, rate_hz=channel.rate_hz * Fraction(1000 + int(10 * percent), 1000))
    chip.configure(channel.scales[0][0])
    chip.t_ps = own.sample_ps(999)
    chip.counts(channel)
    chip.t_ps = own.sample_ps(1000) - 1
    assert not chip.is_ready(channel)
    chip.wait(1)
    assert chip.is_ready(channel)


@channels
def test_typical_sensor_rate_differs_from_nominal_rate(channel: Channel) -> None:
    """The sensor is read at the datasheet's rate for ten seconds: sometimes a sample is missed or read twice."""
    errors = SENSORS[channel.part].ERRORS.of_quality("typical", 1)
    percent = float(vars(errors)["odr_percent"])
    chip = Chip(channel.part, errors, seed=1)
    chip.configure(channel.scales[0][0])
    chip.wait(PS_PER_S)
    begin_ps, reads = chip.t_ps, int(10 * channel.rate_hz)
    fresh = 0
    for read in range(reads):
        chip.t_ps = begin_ps + int(read * PS_PER_S / channel.rate_hz)
        fresh += chip.is_ready(channel)
        chip.counts(channel)
    assert 0.05 < abs(percent) <= 7.5
    assert fresh / reads == pytest.approx(min(1 + percent / 100, 1.0), abs=2.5 / reads)
