"""Sines and steps through the LSM6DSL's filters, as its registers show them."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction

import numpy as np

from tests.support.sensor_fakes import PS_PER_S, Array, Channel, Chip, Signal, Writes

HZ = (0, 12.5, 26, 52, 104, 208, 416, 833, 1666, 3332, 6664)
"""Output data rates by their code (LSM6DSL datasheet, Tables 52 and 55)."""


def at_rate(channel: Channel, code: int) -> Channel:
    """Return the channel with the output data rate of an ODR code."""
    return replace(channel, rate_hz=Fraction(HZ[code]))


def sine(hz: float, amplitude: float) -> Signal:
    """Return a sine that is the same on all axes."""

    def signal(t_s: Array) -> Array:
        return np.outer(amplitude * np.sin(2 * np.pi * hz * t_s), (1.0, 1.0, 1.0))

    return signal


def measured(
    channel: Channel, writes: Writes, hz: float, skip: int, count: int = 600, *, world: bool = False
) -> complex:
    """Return gain and phase of a sine on X, from ``count`` samples after the first ``skip``.

    ``world``: the sine is a signal of the world, before the filters of the converter.
    """
    chip = Chip("LSM6DSL", agitated=world)
    amplitude = 25_000 * channel.scales[0][1]
    chip.world.signals[channel.name] = sine(hz, amplitude)
    chip.configure(writes)
    times_s = np.array([channel.sample_ps(number) for number in range(skip, skip + count)]) / PS_PER_S
    counts = []
    for number in range(skip, skip + count):
        chip.t_ps = channel.sample_ps(number)
        counts.append(chip.counts(channel)[0])
    angle = 2 * np.pi * hz * times_s
    basis = np.column_stack((np.sin(angle), np.cos(angle)))
    (real, imaginary), *_ = np.linalg.lstsq(basis, np.array(counts) / 25_000, rcond=None)
    return complex(real, imaginary)
