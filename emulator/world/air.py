"""Changes of the air pressure at a constant height: weather, wind, a door, and wandering.

Decision: a room's pressure wanders (changes slowly and at random) with the spectrum f^-2 from 0.0006 to 0.5
Hz, as measured over flat land (Acta Scientiarum Naturalium Universitatis Pekinensis, fast-response air
pressure sensor, 2019 campaign). The RMS of this change is assumed to be 0.02 hPa in a typical room. With this
RMS, the mean rate of change between 0.01 and 0.1 Hz is 0.074 Pa/s. The largest value measured outside in wind
is six times as large, 0.44 Pa/s (Mohr et al., Atmosphere 7, 2016, 125).

Decision: gusts are a sum of sinusoids from 0.05 to 1 Hz, whose amplitudes decrease with their frequency, as in
Sabatini and Genovese (Sensors 13, 2013). The RMS of the gusts is a quarter of the wind's pressure
rho v^2 / 2 (Bernoulli).
"""

from __future__ import annotations

import zlib
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from fcu_emulator.emulator.world.track import Array, MinimumJerk

DOOR_HPA = 0.1

_AIR_KG_M3 = 1.2
_PA_PER_HPA = 100.0
_DOOR_S = 0.15  # time from the start of the door's movement to the strongest push
DOOR_LASTS_S = 15 * _DOOR_S  # after this time 1e-5 of the push remains
_GUST_HZ = np.geomspace(0.05, 1.0, 12)
_GUST_SHARES = (
    1.0 / _GUST_HZ / np.sqrt((1.0 / _GUST_HZ**2).sum() / 2.0)
)  # amplitude of each sinusoid; their sum has an RMS of 1
_GUST_PHASES = 2.0 * np.pi * (np.arange(1.0, 13.0) * 0.6180339887498949 % 1.0)
_GUST_ENDS_S = 1.0  # duration of a wind's rise, and of its fall

_WANDER_HZ = np.geomspace(0.0006, 0.5, 23)  # limits of bands with one sinusoid each


class Wander:
    """Wandering of the pressure by ``rms_hpa``. It depends only on time and ``seed``."""

    def __init__(self, rms_hpa: float, seed: int) -> None:
        random = np.random.default_rng([seed & (2**63 - 1), zlib.crc32(b"pressure")])
        low, high = _WANDER_HZ[:-1], _WANDER_HZ[1:]
        power = 1.0 / low - 1.0 / high  # the integral of f^-2 over each band
        self._rms_hpa = rms_hpa
        self._amplitudes = rms_hpa * np.sqrt(2.0 * power / power.sum())
        self._w_rad_s = 2.0 * np.pi * low * (high / low) ** random.random(low.size)
        self._phases = 2.0 * np.pi * random.random(low.size)

    def value(self, t_s: Array) -> Array:
        """Return the added pressure in hPa, (N,), or (1,) if it is always 0."""
        if not self._rms_hpa:
            return np.zeros(1)
        lines = np.cos(t_s[:, np.newaxis] * self._w_rad_s + self._phases)
        lines *= self._amplitudes
        wandered: Array = lines.sum(axis=1)  # a matrix product's rounding would depend on N
        return wandered


@dataclass(frozen=True)
class Drift:
    """A smooth change of the pressure at the floor by ``change_hpa``."""

    from_hpa: float
    change_hpa: float
    profile: MinimumJerk

    @property
    def pace_s(self) -> float:
        return self.profile.duration_s

    def value(self, t_s: Array) -> Array:
        return self.from_hpa + self.change_hpa * self.profile.progress(t_s)


class PressureDisturbance(Protocol):
    """Interface of a temporary added pressure in hPa, (N, 1). ``pace_s``: duration of a change from rest to rest."""

    @property
    def pace_s(self) -> float: ...

    def value(self, t_s: Array) -> Array: ...


@dataclass(frozen=True)
class Wind:
    """Gusts of a wind with the speed ``speed_m_s``."""

    start_s: float
    end_s: float
    speed_m_s: float
    pace_s = 0.5 / _GUST_HZ[-1]

    def value(self, t_s: Array) -> Array:
        angle = 2.0 * np.pi * (t_s - self.start_s)[:, np.newaxis] * _GUST_HZ + _GUST_PHASES
        gusts = (np.cos(angle) * _GUST_SHARES).sum(axis=1)  # a matrix product's rounding would depend on N
        rms_hpa = 0.25 * 0.5 * _AIR_KG_M3 * self.speed_m_s**2 / _PA_PER_HPA
        ends_s = min(_GUST_ENDS_S, (self.end_s - self.start_s) / 2.0)
        rises = MinimumJerk(self.start_s, ends_s).progress(t_s)
        falls = MinimumJerk(self.end_s - ends_s, ends_s).progress(t_s)
        blown: Array = rms_hpa * gusts * (rises - falls)
        return blown[:, np.newaxis]


@dataclass(frozen=True)
class SlammedDoor:
    """Pressure of a door that is slammed at ``start_s``; it decays within about a second."""

    start_s: float
    push_hpa: float
    pace_s = _DOOR_S

    def value(self, t_s: Array) -> Array:
        part = (t_s - self.start_s) / _DOOR_S
        push: Array = self.push_hpa * part * np.exp(1.0 - part)
        return push[:, np.newaxis]
