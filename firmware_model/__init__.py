"""The lab's firmware in Python, on HAL-like calls: what students write in C, as a reference.

``FIRMWARES`` names the programs; each takes a HAL (:mod:`firmware_model.hal`) and optional settings::

    firmware = FIRMWARES["lab3"](hal, Settings(mu=0.1))
    firmware.main()

Imports the standard library only; the scale tables are built when a firmware is created, so importing is
cheap.
"""

from __future__ import annotations

from firmware_model.lab import Lab3, LabFirmware, Settings, Template

FIRMWARES: dict[str, type[LabFirmware]] = {"lab3": Lab3, "template": Template}

__all__ = ["FIRMWARES", "Lab3", "LabFirmware", "Settings", "Template"]
