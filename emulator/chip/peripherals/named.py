"""The blocks that exist on the chip and are not modelled (RM0368 table 1): told by name, read as 0.

The memory map is complete even though the model is not: firmware that touches one of these goes on as if
the block never answered, and the run's summary says which block it was.
"""

from __future__ import annotations

from emulator.chip.peripherals.peripheral import WORD, Peripheral
from emulator.chip.soc import Soc

NOT_MODELLED = {
    "I2S2ext": (0x4000_3400, 0x400),
    "I2S3ext": (0x4000_4000, 0x400),
    "SDIO": (0x4001_2C00, 0x400),
    "SPI4": (0x4001_3400, 0x400),
    "OTG_FS": (0x5000_0000, 0x4_0000),
}
"""Base address and size by the manual's name."""


class NamedBlock(Peripheral):
    """A block that only has a name."""

    def read(self, offset: int) -> int:
        """0, told."""
        del offset
        self.note("not modelled", "read; every register gives 0")
        return 0

    def write(self, offset: int, value: int, mask: int = WORD) -> None:
        """Forgotten, told."""
        del offset, value, mask
        self.note("not modelled", "written; nothing happens")


def named_blocks(soc: Soc) -> list[NamedBlock]:
    """One object for each."""
    return [NamedBlock(soc, name, base, size) for name, (base, size) in NOT_MODELLED.items()]
