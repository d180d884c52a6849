"""The LIS2MDL's measurement: conversion of magnetic field to counts (datasheet Table 3; AN5069 sections 3, 8, 9).

A measurement is the mean field plus noise, plus the offset Hoff after a set pulse, or minus Hoff after a
reset pulse. OFF_CANC averages both kinds of measurement, so Hoff cancels. Without OFF_CANC there are only set
pulses: one every 63 samples and one when the sensor leaves idle.

Decisions: the filter LPF of the LIS2MDL is the mean of two measurements. This filter has -3 dB at exactly
ODR/4, and reduces noise as in Table 3. LPF has no effect on single measurements.

Decisions where the documents are silent: the 63 samples are counted from the pulse at which the sensor leaves
idle; set and reset pulses continue to alternate from the latest polarity. Offsets left by strong fields are not modelled.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from fractions import Fraction
from typing import Final

import numpy as np
from numpy.typing import NDArray

from fcu_emulator.sensors.front_end import Deviation, NoiseSource, averaged, noise_key
from fcu_emulator.sensors.lis2mdl.declaration import LIS2MDLErrors
from fcu_emulator.sensors.lis2mdl.interrupt import InterruptSettings
from fcu_emulator.sensors.lis2mdl.registers import CFG_REG_A, CFG_REG_B, CFG_REG_C, OFFSET_X_REG
from fcu_emulator.sensors.part import Signal
from fcu_emulator.sensors.sampling import PS_PER_S, Times, to_int16, words

SET: Final = 1
PULSE_EVERY: Final = 63


class Pulses:
    """Polarity of measurements: +1 after a set pulse, -1 after a reset pulse."""

    def __init__(self) -> None:
        self.first = 0
        """Number of the first measurement since leaving idle."""
        self._from = 0  # the settings below apply from this measurement on
        self._before = SET  # the polarity before measurement ``_from``
        self._alternating = False
        self._periodic = True

    def configure(self, number: int, *, alternating: bool, periodic: bool) -> None:
        self._before = int(self.polarity(np.array([number - 1]))[0])
        self._from = number
        self._alternating = alternating
        self._periodic = periodic

    def leave_idle(self, number: int) -> None:
        """Restart the count of measurements at ``number``, the first measurement after idle."""
        self.first = number

    def polarity(self, numbers: NDArray[np.int64]) -> NDArray[np.int64]:
        """Return the polarity (+1 or -1) of each measurement in ``numbers``; requires ``configure``."""
        since = numbers - self._from
        if self._alternating:
            return self._before * (1 - 2 * ((since + 1) % 2))
        since_first = numbers - self.first
        since_pulse = since_first % PULSE_EVERY if self._periodic else since_first
        return np.where((since >= 0) & (since_pulse <= since), SET, self._before)


MGAUSS_PER_LSB = 1.5
SELF_TEST_MGAUSS = 150.0  # Table 3 allows +15 to +500 mgauss
_CONTINUOUS: Final = 0  # CFG_REG_A.MD
_ODR_HZ = (10, 20, 50, 100)
_NOISE_FACTOR = {  # Table 3's RMS noise / 4.5 mgauss, by (low power, averaging)
    (False, False): 4.5 / 4.5,
    (False, True): 3.0 / 4.5,
    (True, False): 9.0 / 4.5,
    (True, True): 6.0 / 4.5,
}


@dataclass(frozen=True)
class MagnetometerSettings:
    """The measurement's settings in the registers."""

    rate: Fraction  # by the sensor's own clock, Hz
    turn_on_ps: int  # duration of one conversion, and of a single measurement (AN5069 Table 8)
    conversion_s: float  # conversion time of a measurement with one polarity
    averaging: bool  # OFF_CANC or LPF in continuous mode
    alternating: bool  # set and reset pulses in turn
    periodic_set: bool  # Set_FREQ = 0
    noise_factor: float
    self_test: bool
    offset_counts: tuple[int, int, int]

    @classmethod
    def decode(cls, mem: bytearray, rate_factor: Fraction = Fraction(1)) -> MagnetometerSettings:
        """Decode the registers; ``rate_factor``: true rate / nominal rate."""
        config, filters = mem[CFG_REG_A.addr], mem[CFG_REG_B.addr]
        low_power = bool(config & CFG_REG_A.LP.mask)
        continuous = CFG_REG_A.MD.get(config) == _CONTINUOUS
        cancelling = bool(filters & CFG_REG_B.OFF_CANC.mask)
        averaging = continuous and (cancelling or bool(filters & CFG_REG_B.LPF.mask))
        rate = _ODR_HZ[CFG_REG_A.ODR.get(config)] * rate_factor
        turn_on_us = 6400 if low_power else 9400
        offsets = np.frombuffer(mem, dtype="<i2", count=3, offset=OFFSET_X_REG.addr).tolist()
        return cls(
            rate=rate,
            conversion_s=turn_on_us / 1e6,
            turn_on_ps=turn_on_us * PS_PER_S // 10**6 + (int(PS_PER_S / rate) if cancelling else 0),
            averaging=averaging,
            alternating=cancelling and (continuous or bool(filters & CFG_REG_B.OFF_CANC_ONE_SHOT.mask)),
            periodic_set=not filters & CFG_REG_B.Set_FREQ.mask,
            noise_factor=_NOISE_FACTOR[low_power, averaging],
            self_test=bool(mem[CFG_REG_C.addr] & CFG_REG_C.Self_test.mask),
            offset_counts=(offsets[0], offsets[1], offsets[2]),
        )


class Magnetometer:
    """Producer of samples; ``magnetic_field_mgauss`` in the sensor's axes."""

    def __init__(
        self,
        magnetic_field_mgauss: Signal,
        temperature_degc: Signal,
        errors: LIS2MDLErrors,
        seed: int,
        mem: bytearray,
    ) -> None:
        self._field_mgauss = magnetic_field_mgauss
        self._temperature_degc = temperature_degc
        self._noise_mgauss = errors.noise_mgauss
        self._noise = NoiseSource(noise_key(seed, "LIS2MDL"), 3)
        self._deviation = Deviation(
            errors.bias_mgauss,
            errors.scale_percent,
            errors.bias_drift_mgauss_per_degc,
            errors.scale_drift_percent_per_degc,
            errors.cross_axis_percent,
        )
        self._set_reset_offset = np.array(errors.set_reset_offset_mgauss).reshape(3, 1)
        self.pulses = Pulses()
        self._rate_factor = errors.rate_factor
        self.settings = MagnetometerSettings.decode(mem, self._rate_factor)
        self.interrupt = InterruptSettings.decode(mem)

    def configure(self, mem: bytearray, number: int) -> None:
        """Decode the registers, from sample ``number`` on."""
        settings = self.settings = MagnetometerSettings.decode(mem, self._rate_factor)
        self.interrupt = InterruptSettings.decode(mem)
        self.pulses.configure(number, alternating=settings.alternating, periodic=settings.periodic_set)

    def produce(self, number: int, t_s: Times) -> bytes:
        """Return output samples, little-endian X, Y, Z int16."""
        return words(self._without_offset(self._measure(number, t_s)))

    def compare(self, number: int, t_s: Times) -> bytes:
        """Return one byte of INT_SOURCE_REG per sample, without bit INT."""
        measured = np.rint(self._measure(number, t_s))
        compared = self._without_offset(measured) if self.interrupt.after_offset else measured
        return self.interrupt.compare(to_int16(compared), measured)

    def _without_offset(self, counts: NDArray[np.float64]) -> NDArray[np.float64]:
        """Subtract the hard-iron offset (AN5069 section 9)."""
        if not any(self.settings.offset_counts):
            return counts
        return to_int16(counts) - np.array(self.settings.offset_counts, dtype=np.float64).reshape(3, 1)

    def _measure(self, number: int, t_s: Times) -> NDArray[np.float64]:
        """Return counts, not rounded or saturated, shape (3, n)."""
        settings = self.settings
        numbers = np.arange(number, number + len(t_s))
        signal, sign = (
            averaged(self._field_mgauss, t_s, settings.conversion_s),
            self.pulses.polarity(numbers).astype(np.float64),
        )
        if settings.averaging:
            earlier_s, earlier = t_s - float(1 / settings.rate), numbers - 1
            if (
                number == self.pulses.first and not settings.alternating
            ):  # the filter starts with its first measurement
                earlier_s[0], earlier[0] = t_s[0], number
            signal = (signal + averaged(self._field_mgauss, earlier_s, settings.conversion_s)) / 2
            sign = (sign + self.pulses.polarity(earlier)) / 2
        field = self._deviation.apply(signal, t_s, self._temperature_degc)
        if self._set_reset_offset.any():
            field += self._set_reset_offset * sign
        if self._noise_mgauss:
            field += self._noise_mgauss * settings.noise_factor * self._noise_of(number, len(t_s))
        if settings.self_test:
            field += SELF_TEST_MGAUSS
        return field / MGAUSS_PER_LSB

    def _noise_of(self, number: int, count: int) -> NDArray[np.float64]:
        """Return noise of unit variance; neighbouring averages share a measurement."""
        if not self.settings.averaging:
            return self._noise.block(number + 1, count)
        measured = self._noise.block(number, count + 1)
        return (measured[:, 1:] + measured[:, :-1]) / math.sqrt(2)


DEGC_PER_LSB = 1 / 8
ZERO_DEGC = 25.0  # the temperature at which the register reads 0
TEMPERATURE_COUNTS = 2048  # largest deviation from ZERO_DEGC, up and down


class MagnetometerTemperature:
    """Producer of temperatures; ``offset_degc`` is its error."""

    def __init__(self, temperature_degc: Signal, offset_degc: float) -> None:
        self._temperature_degc = temperature_degc
        self._offset_degc = offset_degc

    def produce(self, number: int, t_s: Times) -> bytes:
        del number
        counts = (self._temperature_degc(t_s) + self._offset_degc - ZERO_DEGC) / DEGC_PER_LSB
        return to_int16(counts.clip(-TEMPERATURE_COUNTS, TEMPERATURE_COUNTS - 1)).tobytes()
