"""A timer's channels: compare and capture settings as CCMR and CCER hold them (RM0368 12.3.5 to 12.3.10).

Input filters (ICxF) are not modelled: the pins here have no glitches. Channels fed by the trigger (CCxS =
3) are not modelled either.
"""

from __future__ import annotations

from dataclasses import dataclass

from emulator.arm.peripherals.tim_counter import Counter, Mode

_PWM1, _PWM2, _FORCED_LOW, _FORCED_HIGH = 6, 7, 4, 5


@dataclass(frozen=True)
class Pwm:
    """What a channel's output pin carries: share of time it is high, cycles a second."""

    frequency_hz: float
    duty: float


class Channel:
    """Channel ``number`` (1 to 4); ``compare`` is the active compare value, or what was captured last."""

    def __init__(self, number: int) -> None:
        self.number = number
        self.flag = 1 << number  # CCxIF in SR, CCxIE in DIER, CCxG in EGR
        self.overcapture = 1 << 8 + number
        self.compare = 0
        self.settings = 0  # this channel's byte of CCMR
        self.enable = 0  # this channel's four bits of CCER: E, P, NE, NP
        self.positions: list[int] = []  # of the counter's cycle, where the compare flag is raised
        self._edges = 0  # since the last capture

    # -- which kind -------------------------------------------------------------------------------------

    @property
    def is_input(self) -> bool:
        """Whether it captures (CCxS is not 0)."""
        return bool(self.settings & 3)

    @property
    def preloaded(self) -> bool:
        """Whether a new compare value waits for the next update (OCxPE)."""
        return not self.is_input and bool(self.settings & 8)

    # -- output -----------------------------------------------------------------------------------------

    def find_positions(self, counter: Counter, centre_mode: int) -> None:
        """Where in the counter's cycle this channel's flag is raised; ``centre_mode`` is CR1.CMS."""
        if self.is_input:
            self.positions = []
        else:
            # CMS 1 raises the flags while counting down, 2 while counting up, 3 in both (12.4.1)
            self.positions = counter.matches(self.compare, rising=centre_mode != 1, falling=centre_mode != 2)

    def duty(self, counter: Counter) -> float | None:
        """Share of time the output is high; None where this channel puts out no PWM or constant level."""
        mode = self.settings >> 4 & 7
        if self.is_input or not self.enable & 1:
            return None
        if mode in {_FORCED_LOW, _FORCED_HIGH}:
            active = float(mode == _FORCED_HIGH)
        elif mode in {_PWM1, _PWM2} and counter.arr:
            active = self._below(counter)
            active = 1 - active if mode == _PWM2 else active
        else:
            return None
        return 1 - active if self.enable & 2 else active

    def _below(self, counter: Counter) -> float:
        """Share of a cycle in which PWM mode 1 is active: CNT < CCR, counting down CNT <= CCR (12.3.9)."""
        if counter.mode is Mode.CENTRE:
            return min(self.compare / counter.arr, 1.0)
        counts = self.compare + 1 if counter.mode is Mode.DOWN else self.compare
        return min(counts / (counter.arr + 1), 1.0)

    # -- input ------------------------------------------------------------------------------------------

    def listens_to(self, pin: int) -> bool:
        """Whether it captures from the pin of channel ``pin``: its own (CCxS = 1) or its neighbour's (2)."""
        source = self.settings & 3
        neighbour = (self.number - 1 ^ 1) + 1
        return (source == 1 and pin == self.number) or (source == 2 and pin == neighbour)

    def captures(self, level: int) -> bool:
        """Whether to capture at an edge to ``level``: polarity (CCxP, CCxNP) and prescaler (ICxPSC)."""
        if not self.enable & 1:
            return False
        both = self.enable & 0b1010 == 0b1010
        rising = not self.enable & 2
        if not both and bool(level) is not rising:
            return False
        self._edges += 1
        if self._edges < 1 << (self.settings >> 2 & 3):
            return False
        self._edges = 0
        return True
