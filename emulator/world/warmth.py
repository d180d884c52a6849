"""Temperature of the board: the air's temperature, heating by the board's power, and the lag behind changes of the air.

Decision: the figures of the board's heating are estimates for a board of 3 cm by 3 cm, because no figures are
published. The first two figures may be wrong by 50 %, the third by a factor of two.

* Heating: 0.125 W divided by 0.018 W per degree (18 cm2 at 10 W/m2) are 7 degrees in still air; 5 are assumed.
* Time constant: 4 J per degree divided by 0.018 W are 220 s; 200 s are assumed.
* Differences on the board: conduction in two half-etched copper layers of 35 um gives a standard deviation of
  8 %.
* Heating of a sensor by its own power: 2 mW at 200 K/W add 0.4 degrees, which are omitted.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from fcu_emulator.emulator.world.track import Array

_SETTLED_AFTER = 25.0  # number of time constants after which 1e-11 of a difference remains


@dataclass(frozen=True)
class Warmth:
    """A temperature difference that decays from ``end_degc`` + ``excess_degc`` to ``end_degc``."""

    end_degc: float = 0.0
    excess_degc: float = 0.0
    time_constant_s: float = 0.0
    start_s: float = 0.0

    def settled(self, from_s: float) -> bool:
        return not self.excess_degc or from_s - self.start_s > _SETTLED_AFTER * self.time_constant_s

    def value(self, t_s: Array) -> Array:
        if t_s.size == 0 or self.settled(t_s.min()):
            return np.array([self.end_degc])
        elapsed = (t_s - self.start_s) / self.time_constant_s
        difference: Array = self.end_degc + self.excess_degc * np.exp(-elapsed)
        return difference

    def after(self, change_degc: float, now_s: float) -> Warmth:
        """Return the temperature difference after a change of the air's temperature."""
        if not self.time_constant_s:
            return self
        excess_degc = self.excess_degc * math.exp(-(now_s - self.start_s) / self.time_constant_s)
        return Warmth(self.end_degc, excess_degc - change_degc, self.time_constant_s, now_s)
