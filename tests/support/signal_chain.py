"""Response of the sensors to vibration and over time, compared with theory.

``python -m tests.support.signal_chain FOLDER`` writes two pictures to FOLDER and prints two tables.

The first is the frequency response of each sensor at five settings: a sine of the world, read through the registers,
compared with the analog stage, the filter before decimation and the digital filters of scipy, or the mean over a
conversion.

The second is the overlapping Allan deviation of every axis over 20 virtual minutes at rest, compared with the
datasheets' figures. Its five lines of code are here.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from dataclasses import replace
from fractions import Fraction
from pathlib import Path
from typing import NamedTuple

import click
import numpy as np
from numpy.typing import ArrayLike
from scipy import optimize, signal

from fcu_emulator.sensors.front_end import CONVERTER_HZ
from fcu_emulator.sensors.lis2mdl import LIS2MDLErrors
from fcu_emulator.sensors.lps22hb import LPS22HBErrors
from fcu_emulator.sensors.lsm6dsl import LSM6DSLErrors
from tests.support.sensor_fakes import (
    ACCELEROMETER,
    GYROSCOPE,
    MAGNETOMETER,
    PRESSURE,
    PS_PER_S,
    Array,
    Channel,
    Chip,
    Writes,
)

Gain = Callable[[Array], Array]
"""The theory: gain at frequencies in Hz."""

MINUTES = 20


class Setting(NamedTuple):
    """A setting. ``rate_hz``: rate of the output; ``sine``: amplitude of the world's sine, about ``middle``."""

    channel: Channel
    name: str
    writes: Writes
    rate_hz: float
    theory: Gain
    sine: float
    middle: float = 0.0


# -- theory -------------------------------------------------------------------------------------------------


def analog(cutoff_hz: float) -> Gain:
    """Return the gain of a second-order Butterworth low-pass."""
    b, a = signal.butter(2, 2 * np.pi * cutoff_hz, analog=True)
    return lambda hz: np.abs(signal.freqs(b, a, 2 * np.pi * hz)[1])


def digital(order: int, cutoff_hz: float, rate_hz: float) -> Gain:
    """Return the gain of a Butterworth low-pass on samples."""
    b, a = signal.butter(order, cutoff_hz, fs=rate_hz)
    return lambda hz: np.abs(signal.freqz(b, a, hz, fs=rate_hz)[1])


def decimated(rate_hz: float, cutoff: float = 0.5) -> Gain:
    """Return the gain of the filter before decimation; ``cutoff`` is relative to the output rate."""
    converter_hz = rate_hz * round(CONVERTER_HZ / rate_hz)
    return digital(4, cutoff * rate_hz, converter_hz) if converter_hz > rate_hz else np.ones_like


def phase_deg(order: int, cutoff_hz: float, rate_hz: float, hz: float) -> float:
    """Return the phase by which a Butterworth low-pass on samples delays a sine."""
    b, a = signal.butter(order, cutoff_hz, fs=rate_hz)
    return -float(np.degrees(np.angle(signal.freqz(b, a, [hz], fs=rate_hz)[1][0])))


def gyroscope(rate_hz: float, cutoff_hz: float, phase_at_20_hz_deg: float) -> Gain:
    """Return the gain of two low-passes with -3 dB at ``cutoff_hz`` together.

    At 20 Hz they delay by at most this phase (AN5040 3.8). The filter before decimation has its cut-off at half the
    output rate, or higher if its phase would be too large.
    """
    converter_hz = rate_hz * round(CONVERTER_HZ / rate_hz)

    def low_pass_hz(decimation: float) -> float:
        before = decimated(rate_hz, decimation)(np.array([cutoff_hz]))[0]

        def excess(hz: float) -> float:
            return float(before * digital(2, hz, rate_hz)(np.array([cutoff_hz]))[0]) - np.sqrt(0.5)

        return float(optimize.brentq(excess, cutoff_hz / 2, 0.499 * rate_hz))

    def too_much_deg(decimation: float) -> float:
        before = phase_deg(4, decimation * rate_hz, converter_hz, 20.0)
        return before + phase_deg(2, low_pass_hz(decimation), rate_hz, 20.0) - phase_at_20_hz_deg

    decimation = 0.5 if too_much_deg(0.5) <= 0 else float(optimize.brentq(too_much_deg, 0.5, 4.0))
    return all_of(decimated(rate_hz, decimation), digital(2, low_pass_hz(decimation), rate_hz))


def mean(conversion_s: float) -> Gain:
    """Return the gain of a mean over a conversion."""
    return lambda hz: np.abs(np.sinc(hz * conversion_s))


def of_two(rate_hz: float) -> Gain:
    """Return the gain of the mean of two measurements."""
    return lambda hz: np.abs(np.cos(np.pi * hz / rate_hz))


def all_of(*gains: Gain) -> Gain:
    """Return the gain of several stages in series."""
    return lambda hz: np.prod([gain(hz) for gain in gains], axis=0)


def _accelerometer() -> list[Setting]:
    def setting(name: str, writes: Writes, rate_hz: float, theory: Gain) -> Setting:
        return Setting(ACCELEROMETER, f"accelerometer, {name}", writes, rate_hz, theory, 1.5)

    return [
        setting("104 Hz", ((0x10, 0x40),), 104, all_of(analog(400), decimated(104))),
        setting(
            "416 Hz, LPF2 at ODR/9",
            ((0x17, 0xC0), (0x10, 0x60)),
            416,
            all_of(analog(400), decimated(416), digital(2, 416 / 9, 416)),
        ),
        setting("833 Hz", ((0x10, 0x70),), 833, all_of(analog(400), decimated(833))),
        setting("1666 Hz", ((0x10, 0x80),), 1666, all_of(analog(1500), decimated(1666))),
        setting(
            "208 Hz, normal mode",
            ((0x15, 0x10), (0x10, 0x50)),
            208,
            digital(2, 740, 208 * round(CONVERTER_HZ / 208)),
        ),
    ]


def _gyroscope() -> list[Setting]:
    def setting(name: str, writes: Writes, rate_hz: float, cutoff_hz: float, phase: float) -> Setting:
        theory = gyroscope(rate_hz, cutoff_hz, phase)
        return Setting(GYROSCOPE, f"gyroscope, {name}", writes, rate_hz, theory, 200.0)

    return [  # cut-offs and phases: AN5040 3.8; without LPF1 the phase of FTYPE 3
        setting("104 Hz", ((0x11, 0x40),), 104, 33, 73),
        setting("208 Hz", ((0x11, 0x50),), 208, 67, 39),
        setting("416 Hz", ((0x11, 0x60),), 416, 137, 21),
        setting("833 Hz, LPF1 at FTYPE 0", ((0x13, 0x02), (0x11, 0x70)), 833, 245, 14),
        setting("1666 Hz, LPF1 at FTYPE 2", ((0x13, 0x02), (0x15, 0x02), (0x11, 0x80)), 1666, 168, 15),
    ]


def _magnetometer() -> list[Setting]:
    def setting(name: str, writes: Writes, rate_hz: float, theory: Gain) -> Setting:
        return Setting(MAGNETOMETER, f"magnetometer, {name}", writes, rate_hz, theory, 20_000.0)

    high, low = mean(9.4e-3), mean(6.4e-3)  # AN5069 Table 8
    return [
        setting("100 Hz", ((0x60, 0x8C),), 100, high),
        setting("50 Hz", ((0x60, 0x88),), 50, high),
        setting("20 Hz", ((0x60, 0x84),), 20, high),
        setting("100 Hz, LPF", ((0x61, 0x01), (0x60, 0x8C)), 100, all_of(high, of_two(100))),
        setting("100 Hz, low power", ((0x60, 0x9C),), 100, low),
    ]


def _barometer() -> list[Setting]:
    def setting(name: str, writes: Writes, rate_hz: float, theory: Gain) -> Setting:
        return Setting(PRESSURE, f"barometer, {name}", writes, rate_hz, theory, 20.0, 1000.0)

    quiet, low_current = mean(13e-3), mean(5e-3)
    return [
        setting("75 Hz", ((0x10, 0x50),), 75, quiet),
        setting("75 Hz, ODR/9", ((0x10, 0x58),), 75, all_of(quiet, digital(2, 75 / 9, 75))),
        setting("75 Hz, ODR/20", ((0x10, 0x5C),), 75, all_of(quiet, digital(2, 75 / 20, 75))),
        setting("25 Hz", ((0x10, 0x30),), 25, quiet),
        setting("25 Hz, low current: the lab's", ((0x1A, 0x01), (0x10, 0x30)), 25, low_current),
    ]


def settings() -> list[Setting]:
    """Return five settings for each sensor."""
    return [*_accelerometer(), *_gyroscope(), *_magnetometer(), *_barometer()]


# -- frequency response -------------------------------------------------------------------------------------

OF_ODR = (0.07, 0.23, 0.41, 0.63, 1.17)
"""Frequencies of the response relative to the output data rate. Samples alias from 0.5 on."""


def gain(setting: Setting, hz: float, count: int = 150) -> float:
    """Return the amplitude of a sine of ``hz`` in the registers, over its amplitude in the world."""
    chip = Chip(setting.channel.part, agitated=True)
    axes = setting.channel.axes

    def world(t_s: Array) -> Array:
        wave = setting.middle + setting.sine * np.sin(2 * np.pi * hz * t_s)
        return np.outer(wave, np.ones(3)) if axes == 3 else wave

    chip.world.signals[setting.channel.name] = world
    chip.configure(setting.writes)
    at = replace(setting.channel, rate_hz=Fraction(setting.rate_hz).limit_denominator(10))
    skip, lsb = 120, setting.channel.scales[0][1]
    times_ps = [at.sample_ps(number) for number in range(skip, skip + count)]
    values = []
    for t_ps in times_ps:
        chip.t_ps = t_ps
        values.append(chip.counts(setting.channel)[0] * lsb)
    angle = 2 * np.pi * hz * np.array(times_ps) / PS_PER_S
    basis = np.column_stack((np.sin(angle), np.cos(angle), np.ones(count)))
    (real, imaginary, _), *_ = np.linalg.lstsq(basis, np.array(values), rcond=None)
    return float(np.hypot(real, imaginary) / setting.sine)


def _responses(folder: Path) -> None:
    from matplotlib.figure import Figure

    figure = Figure(figsize=(10, 7), layout="constrained")
    plots = figure.subplots(2, 2).ravel()
    click.echo(f"| setting | {' | '.join(f'{part:g} of ODR' for part in OF_ODR)} |")
    click.echo("|---" * (len(OF_ODR) + 1) + "|")
    for index, setting in enumerate(settings()):
        axes, colour = plots[index // 5], f"C{index % 5}"
        looked = np.array(OF_ODR) * setting.rate_hz
        found = np.array([gain(setting, hz) for hz in looked])
        theory = setting.theory(looked)
        cells = [f"{ours:.3f} ({said:.3f})" for ours, said in zip(found, theory, strict=True)]
        click.echo(f"| {setting.name} | {' | '.join(cells)} |")
        fine = np.geomspace(0.03 * setting.rate_hz, 1.3 * setting.rate_hz, 300)
        _, _, label = setting.name.partition(", ")
        axes.plot(fine, 20 * np.log10(np.maximum(setting.theory(fine), 1e-4)), color=colour, label=label)
        axes.plot(looked, 20 * np.log10(np.maximum(found, 1e-4)), "o", color=colour)
        axes.set(title=setting.name.partition(",")[0], xscale="log", ylim=(-45, 5))
        axes.set(xlabel="Hz", ylabel="dB")
        axes.grid(which="both", alpha=0.3)
        axes.legend(fontsize=8)
    figure.suptitle("Gain from the world to the registers; lines: theory, points: measured")
    figure.savefig(folder / "responses.png", dpi=70)


# -- Allan deviation ----------------------------------------------------------------------------------------


class Resting(NamedTuple):
    """Expected values of a sensor at rest.

    ``density``: of white noise in the middle of the band, by the datasheet, in ``unit`` per sqrt(Hz);
    ``instability``: of the bias, in ``unit``.
    """

    channel: Channel
    writes: Writes
    errors: object
    density: float
    unit: str
    scale: float
    instability: float = 0.0

    def deviation(self, seconds: ArrayLike) -> Array:
        """Return the Allan deviation for these figures, of means over this number of seconds (IEEE Std 952)."""
        white = self.density / np.sqrt(2 * np.asarray(seconds, dtype=np.float64))
        return np.hypot(white, np.sqrt(2 * np.log(2) / np.pi) * self.instability)


def resting() -> list[Resting]:
    """Return a sensor that only has noise, at rates below thousands of samples a second."""
    acceleration = LSM6DSLErrors(acc_noise_ug_rthz=80.0, acc_bias_instability_ug=40.0)
    rate = LSM6DSLErrors(gyro_noise_mdps_rthz=4.0, gyro_bias_instability_dph=3.0)
    return [
        Resting(ACCELEROMETER, ((0x10, 0x40),), acceleration, 80.0, "ug", 1e6, 40.0),
        Resting(GYROSCOPE, ((0x11, 0x40),), rate, 4.0, "mdps", 1e3, 3.0 / 3.6),
        # RMS of white noise up to half the rate
        Resting(
            MAGNETOMETER, ((0x60, 0x8C),), LIS2MDLErrors(noise_mgauss=4.5), 4.5 / np.sqrt(50), "mgauss", 1.0
        ),
        Resting(
            replace(PRESSURE, rate_hz=Fraction(25)),
            ((0x1A, 0x01), (0x10, 0x30)),
            LPS22HBErrors(pressure_noise_hpa=0.0075),
            12.0 / np.sqrt(12.5),
            "ubar",
            1e3,
        ),
    ]


def allan_deviation(values: Array, m: int) -> Array:
    """Return the overlapping Allan deviation of ``values`` (n, axes), averaged over ``m`` samples each."""
    total = np.vstack((np.zeros(values.shape[1]), np.cumsum(values - values[0], axis=0)))
    steps = total[2 * m :] - 2 * total[m:-m] + total[: -2 * m]
    deviation: Array = np.sqrt(np.mean((steps / m) ** 2, axis=0) / 2)
    return deviation


def at_rest(part: Resting, seconds: float) -> Array:
    """Return readings (n, axes) of a board at rest, in the sensor's unit."""
    channel = part.channel
    chip = Chip(channel.part, part.errors, seed=1)
    chip.configure(part.writes)
    readings = []
    for number in range(50, 50 + int(seconds * channel.rate_hz)):
        chip.t_ps = channel.sample_ps(number)
        readings.append(chip.counts(channel))
    return np.array(readings) * channel.scales[0][1] * part.scale


def _allan(folder: Path) -> None:
    from matplotlib.figure import Figure

    figure = Figure(figsize=(10, 7), layout="constrained")
    plots = figure.subplots(2, 2).ravel()
    click.echo("\n| channel | after 1 s | after 10 s | after 100 s |\n|---|---|---|---|")
    for axes, part in zip(plots, resting(), strict=True):
        values, rate_hz = at_rest(part, MINUTES * 60), float(part.channel.rate_hz)
        lengths = np.unique(np.geomspace(1, len(values) // 5, 40).astype(int))
        found = np.array([allan_deviation(values, int(m)) for m in lengths])
        tau_s = lengths / rate_hz
        axes.loglog(tau_s, found, "o", markersize=3)
        axes.loglog(tau_s, part.deviation(tau_s), "k-", label="by the figures")
        axes.set(title=part.channel.name, xlabel="averaged over, s", ylabel=part.unit)
        axes.grid(which="both", alpha=0.3)
        axes.legend(fontsize=8)
        cells = []
        for seconds in (1, 10, 100):
            ours = allan_deviation(values, int(seconds * rate_hz)).mean()
            cells.append(f"{ours:.3g} ({float(part.deviation(seconds)):.3g})")
        click.echo(f"| {part.channel.name}, {part.unit} | {' | '.join(cells)} |")
    figure.suptitle(f"Allan deviation at rest, {MINUTES} virtual minutes, each axis")
    figure.savefig(folder / "allan.png", dpi=70)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path)
    folder = parser.parse_args().folder
    folder.mkdir(parents=True, exist_ok=True)
    _responses(folder)
    _allan(folder)
