"""Peripherals in Python, and addresses without a peripheral."""

from __future__ import annotations

from collections.abc import Iterable

from fcu_emulator.emulator.chip import memory_map
from fcu_emulator.emulator.chip.memory_map import CHIP_NAME, PAGE_SHIFT
from fcu_emulator.emulator.chip.peripherals.peripheral import WORD, Peripheral, Soc
from fcu_emulator.emulator.chip.peripherals.rcc import ENABLE
from fcu_emulator.emulator.chip.registers import DECLARED
from fcu_emulator.emulator.clock import NEVER_PS
from fcu_emulator.emulator.trace import DeviceNote, NoteValue

# -- unmodelled addresses ----------------------------------------------------------------------------------------

_MAX_REPORTED = 100
NO_REGISTER_PS, EMPTY_PAGE_PS = -2, -3
"""Values of bus.h that tell C that an address, or its whole kilobyte, has no register."""


class Absent(Peripheral):
    """An unmodelled peripheral, or a reserved address."""

    def __init__(self, soc: Soc, name: str, base: int, size: int) -> None:
        super().__init__(soc, name, base, size)
        self._reported: set[int] = set()

    def read(self, offset: int) -> int:
        self._report(offset, "read as 0")
        return 0

    def write(self, offset: int, value: int, mask: int = WORD) -> None:
        self._report(offset, f"0x{value & mask:X} written without effect")

    def is_silent(self) -> bool:
        return len(self._reported) > _MAX_REPORTED

    def _report(self, offset: int, what: str) -> None:
        if offset in self._reported or len(self._reported) > _MAX_REPORTED:
            return
        self._reported.add(offset)
        problem, address = "no-peripheral", self.base + offset
        text = f"{self.name}, 0x{address:08X}: {what}"
        if len(self._reported) > _MAX_REPORTED:
            problem = "no-peripheral-often"
            text = f"{self.name}: more than {_MAX_REPORTED} addresses are used; only the first {_MAX_REPORTED} are reported"
        data: dict[str, NoteValue] = {"address": address}
        self.soc.trace.add(DeviceNote(self.soc.clock.now_ps, CHIP_NAME, "not modelled", text, problem, data))


# -- unmodelled peripherals (RM0368 table 1) ---------------------------------------------------------------------

NOT_MODELLED = {
    "I2S2ext": "audio is neither sent nor received",
    "I2S3ext": "audio is neither sent nor received",
    "SDIO": "no command to a card completes",
    "SPI4": "no transfer completes",
}
"""The consequence of each missing peripheral."""


class UnmodelledPeripheral(Peripheral):
    """A peripheral that has a name but no registers."""

    def read(self, offset: int) -> int:
        del offset
        self._note_absence()
        return 0

    def write(self, offset: int, value: int, mask: int = WORD) -> None:
        del offset, value, mask
        self._note_absence()

    def _note_absence(self) -> None:
        self.note(
            "not modelled", "peripheral-not-modelled", f"every register reads 0: {NOT_MODELLED[self.name]}"
        )


def unmodelled_peripherals(soc: Soc) -> list[UnmodelledPeripheral]:
    """Return all unmodelled peripherals."""
    return [UnmodelledPeripheral(soc, name, *memory_map.ADDRESSES[name]) for name in NOT_MODELLED]


# -- all peripherals by address ----------------------------------------------------------------------------------

_MASK = {1: 0xFF, 2: 0xFFFF, 4: WORD}
GATES = {
    name: f"{name.replace('_', '')}EN in RCC_{DECLARED['RCC'].names[register]}"
    for register, names in ENABLE.items()
    for name in names.values()
}
"""By peripheral: the bit that switches its clock on."""

_RANGES = (
    (memory_map.PERIPHERALS, memory_map.PERIPHERALS_SIZE),
    (memory_map.OTG, memory_map.OTG_SIZE),
    (memory_map.PRIVATE, memory_map.PRIVATE_SIZE),
)


class PythonPeripherals:
    """All peripherals by address. If a wrong access to a register is repeated, only the first one is noted."""

    def __init__(self, soc: Soc, peripherals: Iterable[Peripheral]) -> None:
        self._soc = soc
        self._reported: set[tuple[str, str]] = set()
        self._pages: dict[int, Peripheral] = {}
        by_address = {
            first: Absent(soc, name, first, size) for name, (first, size) in memory_map.ADDRESSES.items()
        }
        for peripheral in [*by_address.values(), *peripherals]:
            for at in range(peripheral.base, peripheral.base + max(peripheral.size, 1), 1 << PAGE_SHIFT):
                self._pages[at >> PAGE_SHIFT] = peripheral
        self._reserved = [Absent(soc, "reserved", base, size) for base, size in _RANGES]

    def find(self, address: int) -> Peripheral | None:
        peripheral = self._pages.get(address >> PAGE_SHIFT)
        if peripheral is not None:
            return peripheral
        return next((one for one in self._reserved if one.base <= address < one.base + one.size), None)

    def read(self, address: int, size: int) -> tuple[int, int]:
        """Return a value and the time of its next change, or ``NO_REGISTER_PS`` or ``EMPTY_PAGE_PS``."""
        peripheral = self.find(address)
        assert peripheral is not None, f"0x{address:08X} is not on the bus"
        register = address - peripheral.base & 0xFFFF_FFFC
        if not peripheral.clocked:
            self.report_clock(peripheral, register, "read")
            return 0, NO_REGISTER_PS
        if not _has(peripheral, register):
            self.report_unknown(peripheral, register, "read")
            return 0, NO_REGISTER_PS
        value, until_ps = peripheral.read_with_validity(register)
        return value >> 8 * (address & 3) & _MASK[size], _validity(peripheral, until_ps)

    def write(self, address: int, size: int, value: int) -> int:
        peripheral = self.find(address)
        assert peripheral is not None, f"0x{address:08X} is not on the bus"
        register = address - peripheral.base & 0xFFFF_FFFC
        shift = 8 * (address & 3)
        if not peripheral.clocked:
            reported = self.report_write_without_clock(peripheral, register, value << shift)
            return NO_REGISTER_PS if reported else NEVER_PS
        if not _has(peripheral, register):
            self.report_unknown(peripheral, register, "written")
            return NO_REGISTER_PS
        peripheral.write(register, value << shift, _MASK[size] << shift)
        return _validity(peripheral, peripheral.same_write_until_ps(register, value << shift))

    def peek(self, address: int) -> int | None:
        """Return a word without side effects, even without clock."""
        peripheral = self.find(address)
        if peripheral is None:
            return None
        register = address - peripheral.base & 0xFFFF_FFFC
        return peripheral.peek(register) if _has(peripheral, register) else 0

    # -- notes about firmware ---------------------------------------------------------------------------

    def report_clock(self, peripheral: Peripheral, register: int, what: str) -> None:
        name = peripheral.NAMES.get(register, f"offset 0x{register:02X}")
        text = f"{name} {what} while the peripheral has no clock; set {GATES.get(peripheral.name, 'its bit in RCC')}"
        self._report(peripheral, "forbidden", f"{what}-without-clock", text, register)

    def report_write_without_clock(self, peripheral: Peripheral, register: int, value: int) -> bool:
        """Report a write if it would change the reset value. Return whether it was reported."""
        declared = DECLARED.get(peripheral.name)
        known = declared.by_offset.get(register) if declared else None
        changes = known is None or bool((value ^ known.reset) & known.stored)
        if changes:
            self.report_clock(peripheral, register, "written")
        return changes

    def report_unknown(self, peripheral: Peripheral, register: int, what: str) -> None:
        text = f"offset 0x{register:02X} {what}; no register has this offset"
        self._report(peripheral, "not modelled", "no-register", text, register)

    def _report(self, peripheral: Peripheral, what: str, problem: str, text: str, offset: int) -> None:
        if (peripheral.name, text) not in self._reported:
            self._reported.add((peripheral.name, text))
            note = DeviceNote(
                self._soc.clock.now_ps, peripheral.name, what, text, problem, {"offset": offset}
            )
            self._soc.trace.add(note)


def _validity(peripheral: Peripheral, until_ps: int) -> int:
    if isinstance(peripheral, UnmodelledPeripheral):
        return EMPTY_PAGE_PS
    if isinstance(peripheral, Absent):
        return EMPTY_PAGE_PS if peripheral.is_silent() else NO_REGISTER_PS
    return until_ps


def _has(peripheral: Peripheral, register: int) -> bool:
    known = peripheral.REGISTERS or peripheral.NAMES
    return not known or register in peripheral.REGISTERS or register in peripheral.NAMES
