"""What may be chosen about the firmware; the defaults are the lab's."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

TIMER_REGISTER_MAX = 0xFFFF  # TIM9's prescaler and auto-reload registers have 16 bits


@dataclass(frozen=True, slots=True, kw_only=True)
class Settings:
    """Settings of a firmware. Raises ValueError, naming the setting and its range."""

    mu: float = 1.0
    """Weight of Gx in the slides' roll, 0.01..1."""
    led1_axis: Literal["pitch", "roll"] = "pitch"
    """The angle LED1 watches ("the x axis"); LED2 watches the other."""
    led_threshold_deg: float = 80.0
    """An LED is on while the absolute angle is above this."""
    banner: Literal["FH", "FW"] = "FH"
    """FH as on the slides, FW as in ST's source."""
    timer_prescaler: int = 83
    """TIM9's PSC; with the period, 84 MHz / 84 / 1250 = 800 Hz."""
    timer_period: int = 1249
    """TIM9's ARR."""

    def __post_init__(self) -> None:
        self._check("mu", 0.01 <= self.mu <= 1, "a number from 0.01 to 1")
        self._check("led1_axis", self.led1_axis in {"pitch", "roll"}, "'pitch' or 'roll'")
        self._check("led_threshold_deg", 0 <= self.led_threshold_deg <= 180, "a number from 0 to 180 degrees")
        self._check("banner", self.banner in {"FH", "FW"}, "'FH' or 'FW'")
        self._check("timer_prescaler", 0 <= self.timer_prescaler <= TIMER_REGISTER_MAX, "from 0 to 65535")
        self._check("timer_period", 0 <= self.timer_period <= TIMER_REGISTER_MAX, "from 0 to 65535")

    def _check(self, name: str, good: bool, right: str) -> None:
        if not good:
            raise ValueError(f"firmware setting {name} is {getattr(self, name)!r}; it must be {right}")
