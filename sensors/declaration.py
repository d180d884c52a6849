"""Declarations of a sensor: measured quantities, bus access, and fidelity of the model.

Scenario keys, diagnoses, register maps and the fidelity table are generated from these declarations.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, TypeAlias

Wires: TypeAlias = Literal[3, 4]
"""Number of SPI wires: 4 with a separate data output, 3 with one line for both directions."""

Mode: TypeAlias = Literal[0, 1, 2, 3]
"""SPI mode: CPOL (bit 1) and CPHA (bit 0)."""


@dataclass(frozen=True)
class Output:
    """Output registers of one measured quantity.

    ``address``: address of the first byte (X comes first); ``size``: bytes per axis, little endian; ``zero``:
    value of the quantity at which the registers read 0.
    """

    address: int
    size: int = 2
    zero: float = 0.0


@dataclass(frozen=True)
class Quantity:
    """Physical quantity that a sensor measures.

    ``axes``: 3 for shape (n, 3) in the sensor's axes, or 1 for (n,); ``one_row``: whether one row is enough for a
    constant signal.
    """

    name: str
    unit: str
    axes: Literal[1, 3]
    doc: str
    output: Output
    one_row: bool = False


@dataclass(frozen=True)
class Bus:
    """Access to a sensor over its buses.

    ``i2c_addresses``: 7-bit addresses by the level of the address pin; empty without I2C. ``spi_wires``: number of
    wires after reset; None without SPI. ``i2c_increment_bit``, ``spi_increment_bit``: sub-address bit that enables
    the increment; 0 if no bit is needed.
    """

    i2c_addresses: tuple[int, ...]
    spi_wires: Wires | None
    source: str
    i2c_highest_hz: int = 400_000
    spi_highest_hz: int = 10_000_000
    spi_modes: tuple[Mode, ...] = (0, 3)
    i2c_increment_bit: int = 0
    spi_increment_bit: int = 0


@dataclass(frozen=True)
class Function:
    """Fidelity of one sensor function.

    ``approximated``: differences from silicon, and assumptions; ``missing``: behaviour that the model lacks.
    """

    name: str
    source: str
    approximated: str = ""
    missing: str = ""

    @property
    def verdict(self) -> str:
        """Return ``modelled``, or the approximated and missing behaviour."""
        parts = []
        if self.approximated:
            parts.append(f"approximated: {self.approximated}")
        if self.missing:
            parts.append(f"not modelled: {self.missing}")
        return "; ".join(parts) or "modelled"
