"""Temperature of the board: above the air by its power consumption, and slower than the air's changes.

A board that is switched on warms up, and one that is carried into a colder room cools down, both with one
time constant: temperature of the board = temperature of the air + heating + lag. The lag is positive while
the board is still warmer than a room that has become colder. A sensor at a warmer place of the board, near
its regulator, has a larger share of the heating (``heating_percent`` of each sensor, of either sign); the lag
is the same for all of them.

Decision: the figures of the board's heating are estimates for a board of 3 cm by 3 cm, because none of this
board are published.

* Heating: it draws some 25 mA from the 5 V of USB, 0.125 W. Its two faces, 18 cm2, emit 10 W/m2 per degree in
  still air, half by convection and half by radiation, which is 0.018 W per degree: 7 degrees. Moving air and
  the USB lead remove more heat, the table under it less; 5 degrees are assumed.
* Time constant: 1.6 mm of glass fibre and resin store 3 J per degree, the components 1 J. 4 J over 0.018 W
  are 220 s in still air, and 160 s if the board gets 5 degrees warmer; 200 s are assumed.
* Differences on the board: its regulator and its processor are assumed in the middle. Its two layers of
  copper, 35 um each and half of them etched away, conduct the heat to the surface. If it flows along one
  direction only, towards two edges, 0.027 W per degree over the 15 mm, the temperature drops by 1.1 degrees.
  Its standard deviation over the places is 0.34 degrees. If it flows all round from a source 6 mm wide, it
  drops by 1.8 degrees, with 0.38 degrees. That is 8 % of the heating; each sensor's share is drawn with this
  standard deviation, because this board's layout was not read.
* A sensor's own supply, 2 mW through the some 200 K/W of its package, makes it 0.4 degrees warmer within
  seconds, and is omitted.

The first two may be wrong by half, and the third by a factor of two. A charging battery heats the board much
more, and is not modelled.

A recorded temperature was measured by a sensor on some board, and is used unchanged.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from fcu_emulator.emulator.world.track import Array

_SETTLED_AFTER = 25.0  # time constants, after which 1e-11 of a difference remains


@dataclass(frozen=True)
class Warmth:
    """A temperature difference that approaches ``end_degc`` exponentially.

    ``excess_degc``: its excess over ``end_degc`` at ``start_s``; 1/e of that remains after each
    ``time_constant_s``.
    """

    end_degc: float = 0.0
    excess_degc: float = 0.0
    time_constant_s: float = 0.0
    start_s: float = 0.0

    def settled(self, from_s: float) -> bool:
        """Return whether nothing changes from ``from_s`` on."""
        return not self.excess_degc or from_s - self.start_s > _SETTLED_AFTER * self.time_constant_s

    def value(self, t_s: Array) -> Array:
        """Return the difference in degrees Celsius: (N,), or (1,) if constant."""
        if t_s.size == 0 or self.settled(t_s.min()):
            return np.array([self.end_degc])
        elapsed = (t_s - self.start_s) / self.time_constant_s
        difference: Array = self.end_degc + self.excess_degc * np.exp(-elapsed)
        return difference

    def after(self, change_degc: float, now_s: float) -> Warmth:
        """Return this lag from ``now_s`` on, when the air becomes warmer by ``change_degc`` at that moment."""
        if not self.time_constant_s:
            return self
        excess_degc = self.excess_degc * math.exp(-(now_s - self.start_s) / self.time_constant_s)
        return Warmth(self.end_degc, excess_degc - change_degc, self.time_constant_s, now_s)
