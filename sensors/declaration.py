"""What a part says about itself as data: what it measures, how a bus reaches it, and how true its model is.

The class of a part carries one of each, beside its name and its register map: ``SIGNALS``, ``BUS``,
``ERRORS`` (:class:`fcu_emulator.sensors.errors.PartErrors`) and ``FUNCTIONS``. Boards, the keys of scenario files,
diagnoses, printed register maps and the fidelity table are made from them, so that a new part is a folder
here and one line in the list of a board.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, TypeAlias

Wires: TypeAlias = Literal[3, 4]
"""Of SPI: data out on a line of its own, or on that of data in."""

Mode: TypeAlias = Literal[0, 1, 2, 3]
"""Of SPI: CPOL and CPHA."""


@dataclass(frozen=True)
class Output:
    """Where the registers of a part have a quantity.

    ``size`` bytes for each axis from sub-address ``address`` on, X first, little endian (after reset, where a
    part can do both); ``zero`` is the value that reads 0, in the quantity's unit. A step is as large as
    ``sample_range`` says, which may depend on the full scale.
    """

    address: int
    size: int = 2
    zero: float = 0.0


@dataclass(frozen=True)
class Quantity:
    """A physical quantity that a part measures: one of the signals it is built with.

    ``name``: as the constructor and ``sample_range`` call it; ``unit``: of its values; ``axes``: 3 for a
    vector in the sensor's own axes, an array of shape (n, 3), or 1 for a scalar, (n,); ``doc``: what it is;
    ``output``: where the result is read; ``one_row``: the part takes a single row where the signal is the
    same at all times asked for.
    """

    name: str
    unit: str
    axes: Literal[1, 3]
    doc: str
    output: Output
    one_row: bool = False


@dataclass(frozen=True)
class Bus:
    """How a part is reached.

    ``i2c_addresses``: 7-bit addresses, by the level of the pin that selects one; none: no I2C.
    ``spi_wires``: how many wires after reset; None: no SPI. ``spi_modes``: those in which bits are
    understood. ``i2c_increment_bit``, ``spi_increment_bit``: the bit of the sub-address byte that has to be
    set for a burst to go on to the next register; 0 where bursts do so by themselves. ``source``: where this
    is documented.
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
    """How true one function of a part is; a register or bit without behaviour says so in the register map.

    ``source``: where it is documented; ``approximated``: how the model differs from silicon or fills a gap
    in the documents, empty where it does what they say; ``missing``: what the model leaves out.
    """

    name: str
    source: str
    approximated: str = ""
    missing: str = ""

    @property
    def verdict(self) -> str:
        """``modelled``, or what is approximated and what is not modelled."""
        parts = []
        if self.approximated:
            parts.append(f"approximated: {self.approximated}")
        if self.missing:
            parts.append(f"not modelled: {self.missing}")
        return "; ".join(parts) or "modelled"
