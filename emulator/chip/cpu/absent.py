"""What stands where the model has no block: it reads as 0, forgets writes, and says so once a register.

After ``_MOST_NOTES`` registers it says no more: firmware that scans the address space meets 400,000.
"""

from __future__ import annotations

from emulator.chip.peripherals.peripheral import WORD, Peripheral
from emulator.chip.soc import CHIP, Soc
from emulator.trace import DeviceNote

_MOST_NOTES = 100


class Absent(Peripheral):
    """A block of the chip that is not built, or (named "reserved") an address where the chip has none."""

    def __init__(self, soc: Soc, name: str, base: int, size: int) -> None:
        super().__init__(soc, name, base, size)
        self._told: set[int] = set()

    def read(self, offset: int) -> int:
        """0, told."""
        self._tell(offset, "read, gives 0")
        return 0

    def write(self, offset: int, value: int, mask: int = WORD) -> None:
        """Forgotten, told."""
        self._tell(offset, f"0x{value & mask:X} written, forgotten")

    def _tell(self, offset: int, what: str) -> None:
        if offset in self._told or len(self._told) > _MOST_NOTES:
            return
        self._told.add(offset)
        text = f"{self.name}, 0x{self.base + offset:08X}: {what}"
        if len(self._told) > _MOST_NOTES:
            text = f"{self.name}: more than {_MOST_NOTES} of its addresses are used; no more are told"
        self.soc.trace.add(DeviceNote(self.soc.clock.now_ps, CHIP, "not modelled", text))
