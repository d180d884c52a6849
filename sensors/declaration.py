"""Declarations of a sensor as data: measured quantities, bus access, and fidelity of the model.

The class of a sensor carries one of each, beside its name and its register map: ``SIGNALS``, ``BUS``,
``ERRORS`` (:class:`fcu_emulator.sensors.errors.PartErrors`) and ``FUNCTIONS``. Boards, the keys of scenario
files, diagnoses, printed register maps and the fidelity table are generated from them. A new sensor is
therefore one folder here and one line in the list of a board.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, TypeAlias

Wires: TypeAlias = Literal[3, 4]
"""Number of SPI wires: 4 with a separate line for data out, 3 with one line for both directions."""

Mode: TypeAlias = Literal[0, 1, 2, 3]
"""SPI mode: CPOL (bit 1) and CPHA (bit 0)."""


@dataclass(frozen=True)
class Output:
    """Location of a quantity in the registers.

    ``size`` bytes for each axis from sub-address ``address`` on, X first, little endian (after reset, if the
    sensor supports both); ``zero`` is the value that reads 0, in the quantity's unit. ``sample_range``
    returns the size of a step, which may depend on the full scale.
    """

    address: int
    size: int = 2
    zero: float = 0.0


@dataclass(frozen=True)
class Quantity:
    """A physical quantity that a sensor measures: one of the signals given to its constructor.

    ``name``: its name in the constructor and ``sample_range``;
    ``unit``: of its values;
    ``axes``: 3 for a vector in the sensor's own axes, an array of shape (n, 3), or 1 for a scalar, (n,);
    ``doc``: its description;
    ``output``: location of the result;
    ``one_row``: the sensor accepts a single row if the signal is the same at all requested times.
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

    ``i2c_addresses``: 7-bit addresses, by the level of the pin that selects one; empty: no I2C.
    ``spi_wires``: number of wires after reset; None: no SPI.
    ``spi_modes``: modes in which bits are received correctly.
    ``i2c_increment_bit``, ``spi_increment_bit``: the bit of the sub-address byte that makes a burst continue
    at the next register; 0 if bursts always do.
    ``source``: document and section.
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
    """Fidelity of one sensor function; registers and bits without behaviour are marked in the register map.

    ``source``: document and section;
    ``approximated``: differences from silicon and assumptions where the documents are silent, empty if there
    are none;
    ``missing``: behaviour that the model does not have.
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
