"""How warm the board is: warmer than the air by what it draws, and late behind the air's changes.

A board that is switched on warms up, and one that is carried into a colder room cools down, both with one
time constant: temperature of the board = temperature of the air + heating + lag. The lag is positive while
the board is still warmer than a room that has become colder. A sensor that sits where the board gets warmer,
near its regulator, has a larger part of the heating than another (``heating_percent`` of each part, of either
sign); the lag is the same for all of them.

Decision: the figures are estimates for a board of 3 cm by 3 cm; no figures of this board have been published.

* Heating: it draws some 25 mA from the 5 V of USB, 0.125 W. Its two faces, 18 cm2, give off 10 W/m2 for each
  degree in still air, half by convection and half by radiation, which is 0.018 W for each degree: 7 degrees.
  Moving air and the USB lead carry off more, the table under it less; 5 degrees are taken.
* Time constant: 1.6 mm of glass fibre and resin store 3 J for each degree, the parts on it 1 J. 4 J over
  0.018 W are 220 s in still air, and 160 s where the board gets 5 degrees warmer; 200 s are taken.
* Differences on the board: its regulator and its processor are taken to be in the middle. Its two layers of
  copper, 35 um each and half of them etched away, conduct the heat to where it is given off. If it flows
  along one direction only, towards two edges, 0.027 W for each degree over the 15 mm, the temperature drops
  by 1.1 degrees and has a standard deviation of 0.34 degrees over the places. If it flows all round from a
  source 6 mm wide, it drops by 1.8 degrees, with 0.38 degrees. That is 8 % of the heating; each sensor's
  share is drawn with this standard deviation, because this board's layout was not read.
* A sensor's own supply, 2 mW through the some 200 K/W of its package, makes it 0.4 degrees warmer within
  seconds, and is left out.

The first two may be wrong by half, and the third by a factor of two. A battery that is being charged heats
the board much more, and is not modelled.

A recorded temperature is what a sensor measured on some board, and is taken as it is.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from fcu_emulator.emulator.world.track import Array

_SETTLED_AFTER = 25.0  # time constants, after which 1e-11 of a difference is left


@dataclass(frozen=True)
class Warmth:
    """A temperature difference on its way to ``end_degc``, which it approaches exponentially.

    ``excess_degc``: by how much it is above ``end_degc`` at ``start_s``; 1/e of that is left after each
    ``time_constant_s``.
    """

    end_degc: float = 0.0
    excess_degc: float = 0.0
    time_constant_s: float = 0.0
    start_s: float = 0.0

    def settled(self, from_s: float) -> bool:
        """Whether nothing changes any more from ``from_s`` on."""
        return not self.excess_degc or from_s - self.start_s > _SETTLED_AFTER * self.time_constant_s

    def value(self, t_s: Array) -> Array:
        """The difference in degrees Celsius: (N,), or (1,) where it no longer changes."""
        if t_s.size == 0 or self.settled(t_s.min()):
            return np.array([self.end_degc])
        elapsed = (t_s - self.start_s) / self.time_constant_s
        difference: Array = self.end_degc + self.excess_degc * np.exp(-elapsed)
        return difference

    def after(self, change_degc: float, now_s: float) -> Warmth:
        """This lag from ``now_s`` on, when the air becomes warmer by ``change_degc`` at that moment."""
        if not self.time_constant_s:
            return self
        excess_degc = self.excess_degc * math.exp(-(now_s - self.start_s) / self.time_constant_s)
        return Warmth(self.end_degc, excess_degc - change_degc, self.time_constant_s, now_s)
