"""What a board boots: which firmware, and the profile that it was built for.

A firmware is a name of the registry, a file for the chip (anything with a suffix or a path separator in it,
and every existing file), or a callable that takes the HAL. Names come first, so that a stray file called
``lab3`` changes nothing.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from emulator.board import firmwares
from emulator.board.firmwares import FirmwareFactory
from emulator.boards.description import Profile
from emulator.boards.fcu001v1 import ARM, ARM_PROGRAM, FIRMWARES, PYTHON
from emulator.boards.fcu001v1 import profile as find_profile
from emulator.errors import InputError

if TYPE_CHECKING:
    from emulator.chip.image import FirmwareImage

_USUAL_PROFILE = "lab3"
_SETTINGS_IGNORED = "the scenario's [firmware_settings] are for firmware in Python and not used here"


@dataclass(frozen=True)
class Choice:
    """One of ``factory`` (Python) and ``image`` (ARM), or neither: the processor is held in reset."""

    profile: Profile
    name: str = ""
    """The firmware as a user names it."""
    reason: str = ""
    """Why this profile, when nobody asked for it and it is not the usual one."""
    notes: tuple[str, ...] = ()
    """What a user should know about it though it is no error, one line each."""
    factory: FirmwareFactory | None = None
    image: FirmwareImage | None = None


def choose(
    firmware: str | Path | FirmwareFactory | None,
    profile: str | None,
    settings: Mapping[str, Any] | None = None,
) -> Choice:
    """The firmware and the wiring for it. Raises InputError saying what is known, or what is wrong.

    ``profile`` None: the one the firmware was built for where that can be seen, else ``lab3``. ``settings``
    are for the Python firmware model; built firmware has none.
    """
    wiring = find_profile(profile or _USUAL_PROFILE)
    if firmware is None:
        return Choice(wiring)
    if isinstance(firmware, str) and firmware in PYTHON:
        return _python(firmwares.python_firmware(firmware, settings), firmware, wiring)
    if isinstance(firmware, str | Path):
        choice = _built(firmware, profile, wiring)
        return replace(choice, notes=(*choice.notes, _SETTINGS_IGNORED)) if settings else choice
    if not callable(firmware):
        raise InputError(f"firmware is {firmware!r}; give a name, a file, or a callable that takes the HAL")
    return _python(firmware, getattr(firmware, "__name__", "own firmware"), wiring)


def _python(factory: FirmwareFactory, name: str, wiring: Profile) -> Choice:
    if not wiring.i2c2:
        raise InputError(
            "firmware in Python talks to the sensors on I2C2, where they are not with profile "
            f'{wiring.name!r}; use profile "lab3", or no firmware'
        )
    return Choice(wiring, name, factory=factory)


def _built(firmware: str | Path, profile: str | None, wiring: Profile) -> Choice:
    from emulator.chip.image import load_firmware
    from emulator.chip.wanted_profile import wanted_profile

    if isinstance(firmware, str) and firmware in ARM:
        from firmware_model.arm import prebuilt

        file = prebuilt(ARM_PROGRAM[firmware], "I2C2" if wiring.i2c2 else "SPI2")
        return Choice(wiring, firmware, image=load_firmware(file))
    if not _is_file(firmware):
        known = ", ".join(FIRMWARES)
        raise InputError(
            f"unknown firmware {str(firmware)!r}; known: {known}; or give an ELF, HEX or BIN file"
        )
    image, reason = load_firmware(firmware), ""
    if profile is None:
        wanted = wanted_profile(image)
        if wanted is not None and wanted.profile != wiring.name:
            wiring, reason = find_profile(wanted.profile), wanted.reason
    return Choice(wiring, str(firmware), reason, image.notes, image=image)


def _is_file(firmware: str | Path) -> bool:
    if isinstance(firmware, Path):
        return True
    return any(mark in firmware for mark in "./\\") or Path(firmware).exists()
