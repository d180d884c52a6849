"""Which firmware runs on the board: the one place where the emulator meets the Python firmware model.

A firmware is built from a HAL and has ``main()`` and ``HAL_TIM_PeriodElapsedCallback()``; it is named in the
registry, or given as a callable that takes the HAL (own firmware in course material and tests).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, Protocol, TypeAlias

from emulator.clock import Clock
from emulator.core import Core
from emulator.errors import InputError
from emulator.hal import Application, Hal

FirmwareFactory: TypeAlias = Callable[[Hal], Application]
Settings: TypeAlias = Mapping[str, Any]

NAMES = {
    "lab3": "all exercises: raw data, calibration, altitude, pitch, roll, yaw, LEDs",
    "template": "exercise 1 only: the raw data block once a second",
}
DEFAULT = "lab3"


class Backend(Protocol):
    """What executes the firmware; the seam for other processors."""

    def run_until(self, at_ps: int) -> None:
        """Run up to and including ``at_ps``."""
        ...

    def variable(self, name: str) -> Any:
        """A global variable of the firmware by its C name. Raises KeyError if there is none."""
        ...


class NoFirmware:
    """The processor is held in reset: time passes, the sensors measure, nobody asks them."""

    def __init__(self, clock: Clock) -> None:
        self._clock = clock

    def run_until(self, at_ps: int) -> None:
        """Let time pass."""
        self._clock.advance_to(at_ps)

    def variable(self, name: str) -> Any:
        """There is no firmware, so there are no variables."""
        raise KeyError(name)


class PythonFirmware:
    """Firmware written in Python, on the HAL."""

    def __init__(self, application: Application, core: Core, hal: Hal) -> None:
        self._application = application
        self._core = core
        hal.link(application)
        core.boot(application.main)

    def run_until(self, at_ps: int) -> None:
        """Run up to and including ``at_ps``."""
        self._core.run_until(at_ps)

    def variable(self, name: str) -> Any:
        """An attribute of the application."""
        try:
            return getattr(self._application, name)
        except AttributeError:
            raise KeyError(name) from None


def factory(name: str, settings: Settings | None = None) -> FirmwareFactory:
    """The firmware of that name. Raises InputError naming the known ones, or a setting that cannot be."""
    if name not in NAMES:
        raise InputError(f"unknown firmware {name!r}; known: {', '.join(NAMES)}")
    from firmware_model import FIRMWARES
    from firmware_model import Settings as FirmwareSettings

    try:
        chosen = FirmwareSettings(**dict(settings or {}))
    except (TypeError, ValueError) as error:
        raise InputError(f"firmware settings: {error}") from error
    return lambda hal: FIRMWARES[name](hal, chosen)
