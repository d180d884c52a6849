"""Which wiring a firmware was built for, as far as its symbols tell.

CubeMX names a peripheral's handle after it (``hspi2``, ``hi2c2``), and a linker drops the handle of a bus
that is not used. ST's stock firmware for the board has ``SPI_Sensor_Handle``. A firmware with handles of both
buses, or of neither, does not say.
"""

from __future__ import annotations

from typing import NamedTuple

from emulator.chip.image import FirmwareImage, Symbols

_I2C2, _SPI2 = ("hi2c2",), ("hspi2", "SPI_Sensor_Handle")


class WantedProfile(NamedTuple):
    """A profile's name, and what in the firmware says so."""

    profile: str
    reason: str


def wanted_profile(image: FirmwareImage) -> WantedProfile | None:
    """The profile that the firmware needs; None where it cannot be told."""
    if image.symbols is None:
        return None
    i2c2, spi2 = (_first(image.symbols, names) for names in (_I2C2, _SPI2))
    if i2c2 and not spi2:
        return WantedProfile("lab3", f"it has {i2c2}, a handle of I2C2, and none of SPI2")
    if spi2 and not i2c2:
        return WantedProfile("fcu001v1", f"it has {spi2}, a handle of SPI2, and none of I2C2")
    return None


def _first(symbols: Symbols, names: tuple[str, ...]) -> str:
    for name in names:
        try:
            symbols.address_of(name)
        except KeyError:
            continue
        return name
    return ""
