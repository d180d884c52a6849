"""How warm the board is: above the air by what it draws itself, and behind it by the heat that it stores.

A board that is switched on warms up, and one that is carried into a colder room cools down, both with one
time constant: temperature of the board = that of the air + heating + a rest that decays. Its sensors have the
board's temperature, all of them the same.

Decision: figures of a board of 3 cm by 3 cm, for nobody has published any of this one. It draws some 25 mA
from the 5 V of USB, 0.13 W, and has 18 cm2 that give off 10 W/m2 for each degree by convection and radiation:
it is 7 degrees warmer than the air at most, and 5 where air passes. 1.6 mm of it store 3 J for each degree,
its parts another, which is 200 s. Both may be wrong by half. A sensor's own share, 2 mW, is half a degree
within a second, and is left out, and so is the slope of the temperature along the board.

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
    """By how much the board is warmer than the air from ``start_s`` on.

    ``heating_degc`` in the end; ``rest_degc`` more at first, of which a part 1/e is left after each
    ``time_constant_s``, 0 for a board that follows at once.
    """

    heating_degc: float = 0.0
    time_constant_s: float = 0.0
    start_s: float = 0.0
    rest_degc: float = 0.0

    def rests(self, from_s: float) -> bool:
        """Whether nothing changes any more from ``from_s`` on."""
        return not self.rest_degc or from_s - self.start_s > _GONE * self.time_constant_s

    def value(self, t_s: Array) -> Array:
        """In degC: (N,), or (1,) where it no longer changes."""
        if t_s.size == 0 or self.rests(t_s.min()):
            return np.array([self.heating_degc])
        passed = (t_s - self.start_s) / self.time_constant_s
        left: Array = self.heating_degc + self.rest_degc * np.exp(-passed)
        return left

    def after(self, change_degc: float, now_s: float) -> Warmth:
        """From ``now_s`` on, when the air has become warmer by ``change_degc`` at once."""
        if not self.time_constant_s:
            return self
        rest_degc = self.rest_degc * math.exp(-(now_s - self.start_s) / self.time_constant_s)
        return Warmth(self.heating_degc, self.time_constant_s, now_s, rest_degc - change_degc)
