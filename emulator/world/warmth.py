"""How warm the board is: above the air by what it draws itself, and behind it by the heat that it stores.

A board that is switched on warms up, and one that is carried into a colder room cools down, both with one
time constant: temperature of the board = that of the air + heating + what it lags behind the air. A sensor
that sits where the board gets warmer, near its regulator, has a larger part of the heating than another
(``heating_percent`` of each part); all of them lag alike.

Decision: figures of a board of 3 cm by 3 cm, for nobody has published any of this one. It draws some 25 mA
from the 5 V of USB, 0.13 W, and has 18 cm2 that give off 10 W/m2 for each degree by convection and radiation:
it is 7 degrees warmer than the air at most, and 5 where air passes. 1.6 mm of it store 3 J for each degree,
its parts another, which is 200 s. Both may be wrong by half. A sensor's own share, 2 mW, is half a degree
within a second, and is left out. Its regulator and its processor are taken to be in the middle, from where
half of the heat sets out to either edge and a quarter passes on average. Two layers of copper, 35 um each
and half of them etched away, carry 0.027 W for a degree over that way: 1.2 degrees from the middle to the
edge. Over the places in between that is a standard deviation of 0.4 degrees, 8 % of the heating, from which
each sensor's share is drawn, because this board's layout was not read.

A recorded temperature is what a sensor measured on some board, and is taken as it is.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from emulator.world.track import Array

_GONE = 25.0  # time constants after which nothing is left: 1e-11


@dataclass(frozen=True)
class Warmth:
    """A temperature difference that comes to rest: ``end_degc``, and at ``start_s`` ``rest_degc`` more.

    Of the rest a part 1/e is left after each ``time_constant_s``.
    """

    end_degc: float = 0.0
    rest_degc: float = 0.0
    time_constant_s: float = 0.0
    start_s: float = 0.0

    def rests(self, from_s: float) -> bool:
        """Whether nothing changes any more from ``from_s`` on."""
        return not self.rest_degc or from_s - self.start_s > _GONE * self.time_constant_s

    def value(self, t_s: Array) -> Array:
        """In degC: (N,), or (1,) where it no longer changes."""
        if t_s.size == 0 or self.rests(t_s.min()):
            return np.array([self.end_degc])
        passed = (t_s - self.start_s) / self.time_constant_s
        left: Array = self.end_degc + self.rest_degc * np.exp(-passed)
        return left

    def after(self, change_degc: float, now_s: float) -> Warmth:
        """From ``now_s`` on, when what is lagged behind has become warmer by ``change_degc`` at once."""
        if not self.time_constant_s:
            return self
        rest_degc = self.rest_degc * math.exp(-(now_s - self.start_s) / self.time_constant_s)
        return Warmth(self.end_degc, rest_degc - change_degc, self.time_constant_s, now_s)
