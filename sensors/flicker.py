"""Bias instability: the slow wandering of an offset, which averaging does not take away.

Its power is the same in every octave of frequency (1/f, flicker). Here it is a sum of slow noises, one an
octave: normal numbers 1 s, 2 s, 4 s ... 2048 s apart, joined by straight lines. Numbers that are T apart
have the power density w^2 T sinc^4(f T), two-sided; over all octaves that is w^2 / (3 ln 2 f). IEEE Std 952
calls B the bias instability of a density B^2 / (2 pi f), whose Allan deviation is sqrt(2 ln 2 / pi) B =
0.664 B at every time, so w = sqrt(3 ln 2 / (2 pi)) B. Below 1 s and beyond an hour there is less, and white
noise and drift with temperature hide that.

Decision: not the sum of first-order Gauss-Markov processes that simulations usually take: each of their
values needs the one before. This one is a function of time alone, as all noise here is, and costs three
interpolations a block.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from sensors.errors import NoiseSource, noise_key

_OCTAVES = 12
_KNOTS = 64  # of an octave drawn at once, and seconds computed at once
_BEFORE_S = 1 << 20  # filters look back before time 0
_WEIGHT = math.sqrt(3 * math.log(2) / (2 * math.pi))


class Flicker:
    """The wandering of ``channels`` independent offsets, of the bias instability B, in its unit."""

    def __init__(self, seed: int, *names: str, channels: int, bias_instability: float) -> None:
        self._octaves = [
            NoiseSource(noise_key(seed, *names, "flicker", octave), channels, _KNOTS)
            for octave in range(_OCTAVES)
        ]
        self._weight = _WEIGHT * bias_instability
        self._first = self._end = 0
        self._seconds: NDArray[np.float64] = np.empty((channels, 0))

    def block(self, t_s: NDArray[np.float64]) -> NDArray[np.float64]:
        """Values at rising times (n,), shape (channels, n)."""
        first, end = math.floor(t_s[0]), math.floor(t_s[-1]) + 2
        if not self._first <= first < end <= self._end:
            self._first, self._end = first, max(end, first + _KNOTS)
            self._seconds = self._at(np.arange(self._first, self._end) + _BEFORE_S)
        values = self._seconds[:, first - self._first : end - self._first]
        return np.stack([np.interp(t_s, np.arange(first, end), row) for row in values])

    def _at(self, seconds: NDArray[np.int64]) -> NDArray[np.float64]:
        """Values at whole seconds that follow each other."""
        total = np.zeros((len(self._seconds), len(seconds)))
        for octave, source in enumerate(self._octaves):
            apart = 1 << octave
            shifted = seconds + apart * octave // _OCTAVES  # so that not all octaves have a number at once
            knots, part = shifted // apart, shifted % apart / apart
            drawn = source.block(int(knots[0]), int(knots[-1] - knots[0]) + 2)
            total += drawn[:, knots - knots[0]] * (1 - part) + drawn[:, knots - knots[0] + 1] * part
        return self._weight * total
