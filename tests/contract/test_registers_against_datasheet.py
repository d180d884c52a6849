"""The declared registers agree with a second, independent transcription of the three datasheets.

The tables in ``tests/fixtures/registers`` were written by another person from the datasheets (LSM6DSL DocID028475 Rev
7, LIS2MDL DocID030621 Rev 3, LPS22HB DocID027083 Rev 6), row by row with the source. Only this test reads the tables.
So an address is wrong without a failure only if both transcriptions have the same error.
"""

from __future__ import annotations

import csv
import re
from pathlib import Path
from typing import NamedTuple

import pytest

from fcu_emulator.sensors.lis2mdl import registers as lis2mdl
from fcu_emulator.sensors.lps22hb import registers as lps22hb
from fcu_emulator.sensors.lsm6dsl import registers as lsm6dsl
from fcu_emulator.sensors.lsm6dsl.banks import BankA, BankB
from fcu_emulator.sensors.register import ADDRESSES, Register, RegisterMap

TABLES = Path(__file__).parents[1] / "fixtures" / "registers"

DECLARED = {
    ("lsm6dsl", "main"): lsm6dsl,
    ("lsm6dsl", "A"): BankA,
    ("lsm6dsl", "B"): BankB,
    ("lis2mdl", "main"): lis2mdl,
    ("lps22hb", "main"): lps22hb,
}
MAPS = {bank: RegisterMap.of(module) for bank, module in DECLARED.items()}

ROWS_WITHOUT_A_REGISTER = {"RESERVED", "UNLISTED"}

RESET_OF_OUTPUTS = {
    # LSM6DSL datasheet 9.54: FIFO_EMPTY is set while the FIFO holds nothing, as after a reset.
    ("lsm6dsl", "FIFO_STATUS2"): 0x10,
}
"""Reset values of rows whose reset is ``output``, which give no number; the default is 0."""

MULTI_BYTE = {
    "lsm6dsl": {
        "OUT_TEMP": (0x20, 2),
        "OUT_G": (0x22, 6),
        "OUT_XL": (0x28, 6),
        "SENSORHUB": (0x2E, 12),
        "FIFO_DATA_OUT": (0x3E, 2),
        "STEP_TIMESTAMP": (0x49, 2),
        "STEP_COUNTER": (0x4B, 2),
        "SENSORHUB_EXT": (0x4D, 6),
        "OUT_MAG_RAW": (0x66, 6),
    },
    "lis2mdl": {
        "OFFSET_X_REG": (0x45, 2),
        "OFFSET_Y_REG": (0x47, 2),
        "OFFSET_Z_REG": (0x49, 2),
        "INT_THS": (0x65, 2),
        "OUT": (0x68, 6),
        "TEMP_OUT": (0x6E, 2),
    },
    "lps22hb": {
        "THS_P": (0x0C, 2),
        "REF_P": (0x15, 3),
        "RPDS": (0x18, 2),
        "PRESS_OUT": (0x28, 3),
        "TEMP_OUT": (0x2B, 2),
    },
}
"""Numbers wider than a byte are one register here, but a row for each byte in the datasheet.

The only field of such a row is the byte's share of the number ("D_7_0"). All other lists of fields are equal.
"""

LAB_SETUP = [
    # the registers as the lab's firmware leaves them on I2C
    ("lsm6dsl", 0x10, 0xA8),
    ("lsm6dsl", 0x17, 0xE0),
    ("lsm6dsl", 0x11, 0x6C),
    ("lsm6dsl", 0x12, 0x44),
    ("lis2mdl", 0x60, 0x8C),
    ("lis2mdl", 0x61, 0x02),
    ("lis2mdl", 0x62, 0x10),
    ("lps22hb", 0x10, 0x32),
    ("lps22hb", 0x11, 0x10),
]


class Row(NamedTuple):
    """One line of a table; ``fields`` has (name, msb, lsb)."""

    part: str
    bank: str
    address: int
    name: str
    access: str
    reset: str
    write_mask: str
    fields: tuple[tuple[str, int, int], ...]

    def __str__(self) -> str:
        return f"{self.part}-{self.bank}-{self.address:02X}-{self.name}"

    def register(self) -> type[Register] | None:
        return MAPS[self.part, self.bank].at[self.address]


def _fields(text: str) -> tuple[tuple[str, int, int], ...]:
    """Return ``ODR[6:4];SIM[0:0]`` as names and positions. A malformed entry raises an error."""
    fields = []
    for entry in filter(None, text.split(";")):
        ((name, msb, lsb),) = re.findall(r"^(\w+)\[(\d):(\d)\]$", entry)
        fields.append((name, int(msb), int(lsb)))
    return tuple(fields)


def _rows(part: str) -> list[Row]:
    with (TABLES / f"{part}.csv").open(encoding="utf-8", newline="") as table:
        return [
            Row(
                part,
                line["bank"],
                int(line["address"], 16),
                line["name"],
                line["access"],
                line["reset"],
                line["write_mask"],
                _fields(line["bitfields"]),
            )
            for line in csv.DictReader(table)
        ]


ROWS = [row for part in MULTI_BYTE for row in _rows(part)]
LISTED = [row for row in ROWS if row.name not in ROWS_WITHOUT_A_REGISTER]
REGISTERS = [
    pytest.param(part, bank, register, id=f"{part}-{bank}-{register.__name__}")
    for (part, bank), bank_map in MAPS.items()
    for register in bank_map.registers
]


@pytest.mark.parametrize("bank", MAPS, ids="-".join)
def test_same_addresses_are_declared_and_listed(bank: tuple[str, str]) -> None:
    declared = {address for address in range(ADDRESSES) if MAPS[bank].at[address]}
    listed = {row.address for row in LISTED if (row.part, row.bank) == bank}

    assert declared == listed


@pytest.mark.parametrize("part", MULTI_BYTE)
def test_each_table_lists_every_address_once(part: str) -> None:
    """Otherwise a register that both transcriptions omit would pass."""
    addresses = [row.address for row in ROWS if (row.part, row.bank) == (part, "main")]

    assert sorted(addresses) == list(range(ADDRESSES))


@pytest.mark.parametrize("row", LISTED, ids=str)
def test_attributes_of_byte_equal_those_in_table(row: Row) -> None:
    bank_map, register = MAPS[row.part, row.bank], row.register()
    given = RESET_OF_OUTPUTS.get((row.part, row.name), 0) if row.reset == "output" else int(row.reset, 16)

    assert register is not None
    assert bank_map.name(row.address) == row.name
    assert register.access == row.access.lower()
    assert bank_map.reset[row.address] == given
    assert bank_map.write_mask[row.address] == int(row.write_mask, 16)


@pytest.mark.parametrize("row", LISTED, ids=str)
def test_fields_of_byte_equal_those_in_table(row: Row) -> None:
    register = row.register()
    assert register is not None

    if register.__name__ in MULTI_BYTE[row.part]:
        ((_, msb, lsb),) = row.fields
        assert (msb, lsb) == (7, 0), "a block without fields would hide these"
        assert register.fields == ()
    else:
        assert tuple((bits.name, bits.msb, bits.lsb) for bits in register.fields) == row.fields


@pytest.mark.parametrize("part", MULTI_BYTE)
def test_only_listed_registers_are_wider_than_byte(part: str) -> None:
    wide = {
        register.__name__: (register.addr, register.size)
        for (owner, _), bank_map in MAPS.items()
        for register in bank_map.registers
        if owner == part and register.size > 1
    }

    assert wide == MULTI_BYTE[part]


@pytest.mark.parametrize("bank", DECLARED, ids="-".join)
def test_registers_are_declared_in_datasheet_order(bank: tuple[str, str]) -> None:
    registers = MAPS[bank].registers
    declared = [value.addr for value in vars(DECLARED[bank]).values() if value in registers]

    assert len(declared) == len(registers)
    assert declared == sorted(declared)


@pytest.mark.parametrize(("part", "bank", "register"), REGISTERS)
def test_registers_and_fields_have_descriptions(part: str, bank: str, register: type[Register]) -> None:
    """The register map that students print consists of these texts."""
    assert register.__doc__
    assert "\n" not in register.__doc__
    assert all(bits.doc and "\n" not in bits.doc for bits in register.fields)


@pytest.mark.parametrize(("part", "address", "value"), LAB_SETUP)
def test_lab_setup_changes_only_modelled_bits(part: str, address: int, value: int) -> None:
    bank_map = MAPS[part, "main"]

    assert value & bank_map.write_mask[address] == value
    assert (value ^ bank_map.reset[address]) & bank_map.unmodelled[address] == 0


@pytest.mark.parametrize("bank", [("lsm6dsl", "main"), ("lsm6dsl", "A"), ("lsm6dsl", "B")], ids="-".join)
def test_every_lsm6dsl_bank_can_be_closed_again(bank: tuple[str, str]) -> None:
    """LSM6DSL datasheet T22: 0x01 accepts 0x00 main, 0x80 bank A, 0xA0 bank B, whichever bank is open."""
    selected = {"main": 0x00, "A": 0x80, "B": 0xA0}

    assert MAPS[bank].name(0x01) == "FUNC_CFG_ACCESS"
    assert MAPS[bank].reset[0x01] == selected[bank[1]]
    assert MAPS[bank].write_mask[0x01] == 0xA0
