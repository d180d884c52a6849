"""The INT/DRDY pin: what it shows (datasheet 8.7; AN5069 6.3 and 10; sensor facts 2.5)."""

from __future__ import annotations

from typing import Literal, TypeAlias

from sensors.lis2mdl.registers import CFG_REG_C
from sensors.pin import Pin

Shown: TypeAlias = Literal["INT", "DRDY"]


class IntDrdyPin:
    """High impedance unless enabled; INT goes before DRDY; in 4-wire SPI the pin is SDO and shows neither."""

    def __init__(self) -> None:
        self.pin = Pin("INT/DRDY", level=None)
        self.shows: Shown | None = None

    def configure(self, control: int, now_ps: int) -> None:
        """CFG_REG_C may have changed; ``drive`` follows for both signals."""
        self.shows = None
        if not control & CFG_REG_C.FOURWSPI.mask:
            if control & CFG_REG_C.INT_on_PIN.mask:
                self.shows = "INT"
            elif control & CFG_REG_C.DRDY_on_PIN.mask:
                self.shows = "DRDY"
        if self.shows is None:
            self.pin.drive(None, now_ps)

    def drive(self, signal: Shown, level: int, at_ps: int) -> None:
        """``signal`` has ``level`` as of ``at_ps``; the pin follows if it shows it."""
        if self.shows == signal:
            self.pin.drive(level, at_ps)
