"""Bias instability: the slow wandering of an offset, which averaging does not take away.

Its power is the same in every octave of frequency (flicker noise, density proportional to 1/f). Here it is a
sum of twelve slow noises, one for each octave: normally distributed values 1 s, 2 s, 4 s ... 2048 s apart,
joined by straight lines. Values of standard deviation w that are T apart have the two-sided power density
w^2 T sinc^4(f T); over all octaves that adds up to w^2 / (3 ln 2 f). IEEE Std 952 calls B the bias
instability of a density B^2 / (2 pi f), whose Allan deviation is sqrt(2 ln 2 / pi) B = 0.664 B at every
averaging time, so w = sqrt(3 ln 2 / (2 pi)) B. Below 1 s and beyond half an hour there is less of it; there
white noise and drift with temperature hide that.

Decision: not the sum of first-order Gauss-Markov processes that simulations usually take: each of their
values needs the one before. This one is a function of time alone, as all noise here is, and costs one
interpolation of each channel for a block of samples.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from sensors.errors import NoiseSource, noise_key

_OCTAVES = 12
_DRAWN_AT_ONCE = 64  # values of an octave
_SECONDS_AT_ONCE = 64
_BEFORE_S = 1 << 20  # filters look back before time 0, and values are numbered from 0: 12 days are enough
_SIGMA = math.sqrt(3 * math.log(2) / (2 * math.pi))  # of an octave's values, w over B


class Flicker:
    """The wandering of ``channels`` independent offsets.

    ``bias_instability``: B of each, whose unit is that of the values. ``seed`` and ``names`` say which noise.
    """

    def __init__(self, seed: int, *names: str, channels: int, bias_instability: float) -> None:
        self._octaves = [
            NoiseSource(noise_key(seed, *names, "flicker", octave), channels, _DRAWN_AT_ONCE)
            for octave in range(_OCTAVES)
        ]
        self._sigma = _SIGMA * bias_instability
        self._first_s = self._end_s = 0
        self._at_seconds: NDArray[np.float64] = np.empty((channels, 0))  # of the seconds between these

    def block(self, t_s: NDArray[np.float64]) -> NDArray[np.float64]:
        """Values at ascending times (n,), shape (channels, n)."""
        first, end = math.floor(t_s[0]), math.floor(t_s[-1]) + 2
        if not self._first_s <= first < end <= self._end_s:
            self._first_s, self._end_s = first, max(end, first + _SECONDS_AT_ONCE)
            self._at_seconds = self._at(np.arange(self._first_s, self._end_s) + _BEFORE_S)
        values = self._at_seconds[:, first - self._first_s : end - self._first_s]
        return np.stack([np.interp(t_s, np.arange(first, end), row) for row in values])

    def _at(self, seconds: NDArray[np.int64]) -> NDArray[np.float64]:
        """Values at consecutive whole seconds, counted from ``_BEFORE_S`` before time 0; (channels, n)."""
        total = np.zeros((len(self._at_seconds), len(seconds)))
        for octave, source in enumerate(self._octaves):
            apart_s = 1 << octave
            shifted = seconds + apart_s * octave // _OCTAVES  # so that not all octaves bend at once
            before, part = shifted // apart_s, shifted % apart_s / apart_s
            drawn = source.block(int(before[0]), int(before[-1] - before[0]) + 2)
            index = before - before[0]
            total += drawn[:, index] * (1 - part) + drawn[:, index + 1] * part
        return self._sigma * total
