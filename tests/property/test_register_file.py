"""A register file with generated registers: laws for any map and any hooks."""

from __future__ import annotations

import types
from dataclasses import dataclass, field
from typing import ClassVar

import pytest
from hypothesis import given
from hypothesis import strategies as st

from fcu_emulator.sensors.declaration import Bus
from fcu_emulator.sensors.part import SubaddressTarget
from fcu_emulator.sensors.register import ADDRESSES, Bits, Register, RegisterMap
from fcu_emulator.sensors.register_file import RegisterFile

ADDRESS = st.integers(0, ADDRESSES - 1)
BYTE = st.integers(0, 0xFF)


@dataclass(frozen=True)
class Layout:
    """Registers by address and size, some with a hook before or after a read, and the jumps of bursts."""

    registers: tuple[type[Register], ...]
    before: frozenset[int]
    after: frozenset[int]
    wrap: dict[int, int] = field(default_factory=dict)
    increment: bool = True


@st.composite
def layouts(draw: st.DrawFn) -> Layout:
    """Return a strategy for layouts, from an empty map to a map without gaps."""
    registers, address = [], 0
    while address < ADDRESSES:
        size = draw(st.integers(1, 6))
        if draw(st.booleans()) and address + size <= ADDRESSES:
            registers.append(declare(address, size, draw(st.sampled_from(("r", "rw"))), draw(st.booleans())))
        address += size + draw(st.sampled_from((0, 0, 1, 20)))
    addresses = frozenset(register.addr for register in registers)
    some = st.frozensets(st.sampled_from(sorted(addresses))) if addresses else st.just(addresses)
    wrap = draw(st.dictionaries(ADDRESS, ADDRESS, max_size=3))
    return Layout(tuple(registers), draw(some), draw(some), wrap, draw(st.booleans()))


def declare(address: int, size: int, access: str, modelled: bool) -> type[Register]:
    options = {
        "addr": address,
        "size": size,
        "access": access,
        "modelled": modelled,
        "names": tuple(f"R{address + byte:02X}" for byte in range(size)),
    }
    made = types.new_class(f"R{address:02X}", (Register,), options)
    assert issubclass(made, Register)
    return made


def build(layout: Layout) -> RegisterFile:
    """Return a register file. Hooks change memory, so that a wrong call of a hook is visible.

    The hook before a read counts it in every byte that is read (output registers). The hook after a read clears a
    byte elsewhere (latched flags).
    """
    registers = RegisterFile(RegisterMap(layout.registers), layout.wrap)
    registers.mem[:] = bytes(range(ADDRESSES))

    def count_read(first: int, end: int, now_ps: int) -> None:
        for address in range(first, end):
            registers.mem[address] = (registers.mem[address] + 16) & 0xFF

    def add_up(first: int, end: int, now_ps: int) -> None:
        registers.mem[0] = (registers.mem[0] + sum(range(first, end))) & 0xFF

    for register in layout.registers:
        if register.addr in layout.before:
            registers.before_read(register, count_read)
        if register.addr in layout.after and register.addr:
            registers.after_read(register, add_up)
    registers.increment = layout.increment
    return registers


@given(layouts(), ADDRESS, st.integers(1, 300))
def test_burst_equals_single_byte_reads(layout: Layout, start: int, count: int) -> None:
    burst, bytewise = build(layout), build(layout)
    one_by_one, address = bytearray(), start

    for _ in range(count):
        one_by_one += bytewise.read(address, 1, 0)
        if layout.increment:
            address = layout.wrap.get(address, (address + 1) % ADDRESSES)

    assert burst.read(start, count, 0) == one_by_one
    assert burst.mem == bytewise.mem
    assert burst.advance(start, count) == address


@given(layouts(), ADDRESS, st.integers(1, 64))
def test_burst_does_not_use_earlier_plan(layout: Layout, start: int, count: int) -> None:
    """Bursts are planned once. After a change of the increment, an old plan must not be used."""
    used, fresh = build(layout), build(layout)
    used.read(start, count, 0)
    used.increment = not layout.increment
    used.read(start, count, 0)
    used.increment = layout.increment
    used.mem[:] = fresh.mem

    assert used.read(start, count, 0) == fresh.read(start, count, 0)


@given(layouts(), st.dictionaries(ADDRESS, ADDRESS, max_size=5), ADDRESS, st.integers(0, 40))
def test_burst_follows_latest_jumps(layout: Layout, jumps: dict[int, int], start: int, count: int) -> None:
    """The order of both settings has no effect (IF_INC and ROUNDING, LSM6DSL AN5040 4.7)."""
    jumps |= dict.fromkeys(sorted(layout.wrap)[:1], start)  # where a burst turns back anyway, too
    registers = build(layout)
    registers.set_jumps(dict.fromkeys(range(ADDRESSES), 0))
    registers.increment = False
    registers.set_jumps(jumps)
    assert registers.advance(start, count) == registers.advance(start, 1) == start
    registers.increment = True

    address = start
    for _ in range(count):
        following = (address + 1) % ADDRESSES
        address = jumps.get(address, layout.wrap.get(address, following))

    assert registers.advance(start, count) == address


@given(layouts(), st.lists(st.tuples(ADDRESS, BYTE), max_size=30))
def test_writes_change_and_log_writable_bytes_only(layout: Layout, writes: list[tuple[int, int]]) -> None:
    registers = RegisterFile(RegisterMap(layout.registers))
    expected, log = bytearray(ADDRESSES), []
    registers.write_log = lambda now_ps, name, old, new: log.append((now_ps, name, old, new))
    writable = {
        register.addr + byte
        for register in layout.registers
        if register.access == "rw"
        for byte in range(register.size)
    }

    expected_log = []
    for t_ps, (address, value) in enumerate(writes):
        registers.write(address, bytes([value]), t_ps)
        old = expected[address]
        if address in writable:
            expected[address] = value
        expected_log.append((t_ps, registers.map.name(address), old, expected[address]))

    assert registers.mem == expected
    assert log == expected_log


@given(layouts(), st.lists(st.tuples(ADDRESS, BYTE), max_size=30), st.data())
def test_reset_restores_only_named_registers(
    layout: Layout, writes: list[tuple[int, int]], data: st.DataObject
) -> None:
    registers = RegisterFile(RegisterMap(layout.registers))
    for address, value in writes:
        registers.write(address, bytes([value]), 0)
    before = bytes(registers.mem)
    named = data.draw(st.lists(st.sampled_from(layout.registers))) if layout.registers else []

    registers.reset(*named)

    for register in layout.registers:
        place = slice(register.addr, register.addr + register.size)
        touched = register in named or not named
        assert registers.mem[place] == (bytes(register.size) if touched else before[place])


class CONTROL(Register, addr=0x10, reset=0x04):
    """A register in all three states."""

    USED = Bits(2, 0)
    KNOWN = Bits(6, modelled=False)


@given(BYTE)
def test_written_unmodelled_field_is_named_in_note(value: int) -> None:
    registers = RegisterFile(RegisterMap([CONTROL]))
    notes = []
    registers.note = lambda now_ps, what, problem, text, **data: notes.append((now_ps, problem, text, data))

    registers.write(0x10, bytes([value]), 7)

    written = {"register": "CONTROL", "value": value & 0x47}
    unmodelled = [(7, "unmodelled-write", "CONTROL.KNOWN written", written)] if value & 0x40 else []
    assert [note for note in notes if note[1] == "unmodelled-write"] == unmodelled
    assert registers.mem[0x10] == value & 0x47


@given(BYTE)
def test_written_reserved_bits_are_named_in_note(value: int) -> None:
    registers = RegisterFile(RegisterMap([CONTROL]))
    notes = []
    registers.note = lambda now_ps, what, problem, text, **data: notes.append((now_ps, problem, data))

    registers.write(0x10, bytes([value]), 7)

    refused = value & 0xB8
    ignored = [note for note in notes if note[1] == "read-only-bits"]
    assert ignored == ([(7, "read-only-bits", {"register": "CONTROL", "mask": refused})] if refused else [])


def test_write_hook_gets_old_and_masked_new_value() -> None:
    registers = RegisterFile(RegisterMap([CONTROL]))
    seen = []
    registers.on_write(CONTROL, lambda old, new, now_ps: seen.append((old, new, registers.mem[0x10], now_ps)))

    registers.write(0x10, b"\xff", 3)

    assert seen == [(0x04, 0x47, 0x47, 3)]


# -- the sub-address of the I2C protocol ------------------------------------------------------------


class Memory:
    """A device with 128 plain bytes."""

    NAME: ClassVar[str] = "MEMORY"
    BUS: ClassVar[Bus] = Bus(i2c_addresses=(0x50,), spi_wires=None, source="this test")
    i2c_off = False

    def __init__(self) -> None:
        self.registers = RegisterFile(RegisterMap([declare(0, ADDRESSES, "rw", True)]))
        self.read, self.write, self.advance = (
            self.registers.read,
            self.registers.write,
            self.registers.advance,
        )
        self.register_name = self.registers.map.name

    def accessible(self, now_ps: int) -> bool:
        return True

    def refuse(self, now_ps: int) -> None:
        raise AssertionError("it is accessible")


@given(st.binary(min_size=ADDRESSES, max_size=ADDRESSES), ADDRESS, st.lists(st.integers(1, 40), max_size=5))
def test_read_continues_at_next_register(content: bytes, start: int, counts: list[int]) -> None:
    """LSM6DSL datasheet 6.2, LIS2MDL 6.1, LPS22HB 7.2."""
    device = Memory()
    device.registers.mem[:] = content
    target = SubaddressTarget(device, lambda: 0)

    target.start(read=False)
    target.write(bytes([start]))
    found = b""
    for count in counts:
        target.start(read=True)
        found += target.read(count)
        target.stop()

    assert found == bytes(content[(start + index) % ADDRESSES] for index in range(sum(counts)))


@given(ADDRESS, st.booleans(), st.binary(min_size=1, max_size=40), st.data())
def test_write_may_be_split_into_pieces(start: int, bit_7: bool, data: bytes, draw: st.DataObject) -> None:
    """Bit 7 of the sub-address has no meaning. Written data are read back unchanged."""
    cut = draw.draw(st.integers(0, len(data)))
    device = Memory()
    target = SubaddressTarget(device, lambda: 0)

    assert target.start(read=False)
    assert target.write(bytes([start | bit_7 << 7])) == 1
    for piece in (data[:cut], data[cut:]):
        assert target.write(piece) == len(piece)
    target.stop()

    assert target.read_from(start, len(data), 0) == data
    assert (target.name(), target.register_name(start)) == ("MEMORY", f"R{start:02X}")


@pytest.mark.parametrize("first", ["read", "read_from"])
def test_plain_read_continues_after_transfer(first: str) -> None:
    device = Memory()
    device.registers.mem[:] = bytes(range(ADDRESSES))
    target = SubaddressTarget(device, lambda: 0)
    if first == "read_from":
        target.read_from(0x7E, 3, 0)
    else:
        target.start(read=False)
        target.write(b"\x7e")
        target.start(read=True)
        target.read(3)

    target.start(read=True)

    assert target.read(2) == b"\x01\x02"
