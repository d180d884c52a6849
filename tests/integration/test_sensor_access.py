"""No access by firmware is ignored without a note: the trace names every unmodelled register and bit.

Every bit of the register maps is accessed here. The contract tests compare these maps with the datasheets.
"""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from fcu_emulator import Board
from fcu_emulator.emulator.trace import DeviceNote
from fcu_emulator.sensors import SENSORS
from fcu_emulator.sensors.register import RegisterMap

ADDRESS = {"LSM6DSL": 0x6B, "LIS2MDL": 0x1E, "LPS22HB": 0x5D}
FUNC_CFG_ACCESS = 0x01
SELECT = (0x00, 0x80, 0xA0)  # LSM6DSL datasheet Table 22: main, bank A, bank B
BANKS = [
    pytest.param(name, select, bank, id=f"{name}-{select:02X}")
    for name, part in SENSORS.items()
    for select, bank in zip(SELECT, part.maps().values(), strict=False)
]
every_bank = pytest.mark.parametrize(("name", "select", "bank"), BANKS)


class Bench:
    """A sensor on the board's bus, with one of its banks open."""

    def __init__(self, name: str, select: int) -> None:
        self.board = Board(ideal=True)
        self.name, self.address = name, ADDRESS[name]
        if select:
            self.write(FUNC_CFG_ACCESS, select)

    def write(self, register: int, value: int) -> list[str]:
        """Write, and return the notes of the trace about it."""
        before = len(self.board.trace.of(DeviceNote))
        self.board.i2c2.write(self.address, bytes((register, value)))
        return self.notes(before)

    def read(self, register: int) -> list[str]:
        """Read a byte, and return the notes of the trace about it."""
        before = len(self.board.trace.of(DeviceNote))
        self.board.i2c2.write_read(self.address, bytes((register,)), 1)
        return self.notes(before)

    def notes(self, first: int) -> list[str]:
        new = self.board.trace.of(DeviceNote)[first:]
        assert all(note.device == self.name for note in new)
        return [f"{note.what}: {note.text}" for note in new]


def bits_of(mask: int) -> Iterator[int]:
    return (bit for bit in range(8) if mask >> bit & 1)


def field_name(bank: RegisterMap, address: int, bit: int) -> str:
    """Return ``REGISTER.FIELD``, or ``REGISTER`` if the whole register is not modelled and has no fields."""
    register = bank.at[address]
    assert register is not None
    fields = [bits.name for bits in register.fields if bits.mask >> bit & 1]
    return ".".join([bank.name(address), *fields])


@every_bank
def test_every_unmodelled_bit_is_reported_when_written(name: str, select: int, bank: RegisterMap) -> None:
    bench = Bench(name, select)
    for address in range(0x80):
        for bit in bits_of(bank.unmodelled[address]):
            notes = bench.write(address, bank.reset[address] ^ 1 << bit)
            assert f"not modelled: {field_name(bank, address, bit)} written" in notes
            bench.write(address, bank.reset[address])


@every_bank
def test_every_unmodelled_register_is_reported_when_read(name: str, select: int, bank: RegisterMap) -> None:
    bench = Bench(name, select)
    for register in bank.registers:
        for address in range(register.addr, register.addr + register.size):
            expected = [] if register.modelled else [f"not modelled: {bank.name(address)} read"]
            assert [note for note in bench.read(address) if note.startswith("not modelled")] == expected


@every_bank
def test_every_ignored_bit_of_write_is_reported(name: str, select: int, bank: RegisterMap) -> None:
    """Such bits are reserved, in read-only registers, or at addresses without a register."""
    bench = Bench(name, select)
    for address in range(0x80):
        mask = bank.write_mask[address]
        for bit in bits_of(~mask & 0xFF):
            notes = bench.write(address, bank.reset[address] ^ 1 << bit)
            where = f": bit {bit} " if mask else f" (0x{address:02X}) "
            ignored = f"write ignored: {bank.name(address)}{where}"
            assert [note for note in notes if note.startswith(ignored)]


@every_bank
def test_read_of_missing_register_is_noted(name: str, select: int, bank: RegisterMap) -> None:
    bench = Bench(name, select)
    for address in range(0x80):
        notes = [note.partition(";")[0] for note in bench.read(address) if note.startswith("reserved")]
        assert notes == ([f"reserved: 0x{address:02X} read"] if bank.at[address] is None else [])


@every_bank
def test_reset_values_written_back_raise_no_note(name: str, select: int, bank: RegisterMap) -> None:
    """Firmware that reads, changes one bit and writes back gets no note about the other bits."""
    bench = Bench(name, select)
    for address in range(0x80):
        if bank.write_mask[address]:
            assert bench.write(address, bank.reset[address]) == []
