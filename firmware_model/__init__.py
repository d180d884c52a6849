"""The lab's firmware in Python, a reference for the students' C programs.

A program takes a HAL (:mod:`fcu_emulator.firmware_model.hal`) and optional settings::

    firmware = FIRMWARES["lab3"](hal, Settings(mu=0.1))
    firmware.main()
"""

from __future__ import annotations

if not __name__.startswith("fcu_emulator."):  # the package was imported by its old name
    from fcu_emulator._old_names import redirect

    redirect(__name__)

from fcu_emulator.firmware_model.lab import Lab3, LabFirmware, Settings, Template

FIRMWARES: dict[str, type[LabFirmware]] = {"lab3": Lab3, "template": Template}

__all__ = ["FIRMWARES", "Lab3", "LabFirmware", "Settings", "Template"]
