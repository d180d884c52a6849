"""Which firmwares there are, and what executes them.

Firmware in Python is built from a HAL and has ``main()`` and ``HAL_TIM_PeriodElapsedCallback()``; it is named
in the registry, or given as a callable that takes the HAL (own firmware in course material and tests).
Firmware built for the chip is executed by :mod:`emulator.chip`; two programs of it are shipped.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, Protocol, TypeAlias

from emulator.boards.fcu001v1 import PYTHON
from emulator.errors import InputError
from emulator.python_cpu.core import Core
from emulator.python_cpu.hal import Application, Hal
from emulator.time.clock import Clock
from emulator.time.ticks import TickCounts

FirmwareFactory: TypeAlias = Callable[[Hal], Application]
Settings: TypeAlias = Mapping[str, Any]


class Backend(Protocol):
    """What executes the firmware; the seam for other processors."""

    @property
    def tim9(self) -> TickCounts:
        """The timer of the lab's callback."""
        ...

    def run_until_ps(self, at_ps: int) -> None:
        """Run up to and including ``at_ps``."""
        ...

    def variable(self, name: str) -> Any:
        """A global variable of the firmware by its C name. Raises KeyError if there is none."""
        ...


class NoFirmware:
    """The processor is held in reset: time passes, the sensors measure, nobody asks them."""

    def __init__(self, clock: Clock, hal: Hal) -> None:
        self._clock = clock
        self.tim9: TickCounts = hal.tim9

    def run_until_ps(self, at_ps: int) -> None:
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
        self.tim9: TickCounts = hal.tim9
        hal.link(application)
        core.boot(application.main)

    def run_until_ps(self, at_ps: int) -> None:
        """Run up to and including ``at_ps``."""
        self._core.run_until_ps(at_ps)

    def variable(self, name: str) -> Any:
        """An attribute of the application."""
        try:
            return getattr(self._application, name)
        except AttributeError:
            raise KeyError(name) from None


def python_firmware(name: str, settings: Settings | None = None) -> FirmwareFactory:
    """The firmware in Python of that name. Raises InputError naming the known ones, or the wrong setting."""
    if name not in PYTHON:
        raise InputError(f"unknown firmware {name!r}; known: {', '.join(PYTHON)}")
    from firmware_model import FIRMWARES
    from firmware_model import Settings as FirmwareSettings

    try:
        chosen = FirmwareSettings(**dict(settings or {}))
    except (TypeError, ValueError) as error:
        raise InputError(f"firmware settings: {error}") from error
    return lambda hal: FIRMWARES[name](hal, chosen)
