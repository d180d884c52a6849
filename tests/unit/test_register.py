"""The declaration of registers: the statements of a class, and properties that are derived from them."""

from __future__ import annotations

import types
from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from fcu_emulator.sensors.register import ADDRESSES, Bits, Register, RegisterMap

BYTES = st.integers(0, 0xFF)


@st.composite
def one_field(draw: st.DrawFn) -> Bits:
    """Return a strategy for a field of a byte."""
    lsb = draw(st.integers(0, 7))
    return Bits(draw(st.integers(lsb, 7)), lsb)


@st.composite
def disjoint_fields(draw: st.DrawFn) -> list[Bits]:
    """Return a strategy for at least one field. Other bits are reserved, and a field may be declared without behaviour."""
    cuts = sorted(draw(st.sets(st.integers(0, 8), min_size=2, max_size=9)))
    pieces = [Bits(end - 1, start, modelled=draw(st.booleans())) for start, end in pairwise(cuts)]
    kept = draw(st.sets(st.sampled_from(range(len(pieces))), min_size=1))
    return [pieces[index] for index in sorted(kept)]


def declare(
    *fields: Bits,
    addr: int = 0,
    size: int = 1,
    access: str = "rw",
    reset: int = 0,
    modelled: bool = True,
    names: tuple[str, ...] = (),
) -> type[Register]:
    """Declare ``class EXAMPLE(Register, ...)`` with the fields F0, F1, ..."""
    options = {
        "addr": addr,
        "size": size,
        "access": access,
        "reset": reset,
        "modelled": modelled,
        "names": names or tuple(f"BYTE{byte}" for byte in range(size)),
    }
    body = {f"F{index}": bits for index, bits in enumerate(fields)}
    made = types.new_class("EXAMPLE", (Register,), options, lambda namespace: namespace.update(body))
    assert issubclass(made, Register)
    return made


@given(one_field(), BYTES, st.data())
def test_put_then_get_returns_field_and_keeps_neighbours(bits: Bits, value: int, data: st.DataObject) -> None:
    number = data.draw(st.integers(0, bits.mask >> bits.lsb))

    after = bits.put(value, number)

    assert bits.get(after) == number
    assert (after ^ value) & ~bits.mask == 0


@given(one_field(), BYTES, st.integers(0, 0xFFFF))
def test_too_wide_number_does_not_change_other_bits(bits: Bits, value: int, number: int) -> None:
    assert (bits.put(value, number) ^ value) & ~bits.mask == 0


@given(one_field())
def test_field_covers_msb_down_to_lsb(bits: Bits) -> None:
    assert [bit for bit in range(8) if bits.mask >> bit & 1] == list(range(bits.lsb, bits.msb + 1))


def test_field_of_one_bit_needs_one_number() -> None:
    assert (Bits(6).msb, Bits(6).lsb, Bits(6).mask) == (6, 6, 0x40)


def test_field_name_comes_from_class_or_argument() -> None:
    class CFG_REG_C(Register, addr=0x62):
        BDU = Bits(4)
        FOURWSPI = Bits(2, name="4WSPI")

    assert [bits.name for bits in CFG_REG_C.fields] == ["BDU", "4WSPI"]


@given(disjoint_fields())
def test_write_mask_is_union_of_fields(fields: list[Bits]) -> None:
    declared = {bit for bits in fields for bit in range(bits.lsb, bits.msb + 1)}

    mask = declare(*fields).write_mask

    assert {bit for bit in range(8) if mask >> bit & 1} == declared


@given(disjoint_fields(), st.integers(0, ADDRESSES - 1), st.booleans())
def test_unmodelled_bits_are_writable_and_reserved_are_not(
    fields: list[Bits], addr: int, modelled: bool
) -> None:
    bank = RegisterMap([declare(*fields, addr=addr, modelled=modelled)])
    reserved = 0xFF & ~sum(bits.mask for bits in fields)
    known_only = sum(bits.mask for bits in fields if not (modelled and bits.modelled))

    assert bank.write_mask[addr] & reserved == 0
    assert bank.unmodelled[addr] == known_only
    assert bank.unmodelled[addr] & ~bank.write_mask[addr] == 0
    assert not any(bank.write_mask[:addr] + bank.write_mask[addr + 1 :])


@given(disjoint_fields())
def test_no_bit_of_read_only_register_is_writable(fields: list[Bits]) -> None:
    bank = RegisterMap([declare(*fields, addr=0x1E, access="r")])

    assert not any(bank.write_mask)
    assert not any(bank.unmodelled)


@given(one_field(), st.data())
def test_overlapping_fields_are_refused(bits: Bits, data: st.DataObject) -> None:
    shared = data.draw(st.integers(bits.lsb, bits.msb))
    other = Bits(data.draw(st.integers(shared, 7)), data.draw(st.integers(0, shared)))

    with pytest.raises(TypeError, match=r"EXAMPLE.*overlap"):
        declare(bits, other)


@given(st.integers(0, 100), st.integers(1, 6), st.data())
def test_address_declared_twice_is_refused(addr: int, size: int, data: st.DataObject) -> None:
    shared = data.draw(st.integers(addr, addr + size - 1))
    block, byte = declare(addr=addr, size=size), declare(addr=shared)

    with pytest.raises(TypeError, match=f"0x{max(addr, shared):02X} .*twice"):
        RegisterMap([byte, block])


def test_register_of_several_bytes_needs_all_names() -> None:
    with pytest.raises(TypeError, match=r"EXAMPLE.*2 bytes"):
        declare(size=2, names=("OUT_TEMP_L",))


@given(st.integers(0, 0xFFFFFF), st.booleans())
def test_register_without_fields_is_little_endian(reset: int, modelled: bool) -> None:
    names = ("REF_P_XL", "REF_P_L", "REF_P_H")
    block = declare(addr=0x15, size=3, reset=reset, modelled=modelled, names=names)

    bank = RegisterMap([block])

    assert int.from_bytes(bank.reset[0x15:0x18], "little") == reset
    assert bank.write_mask[0x15:0x18] == b"\xff\xff\xff"
    assert bank.unmodelled[0x15:0x18] == (b"\x00\x00\x00" if modelled else b"\xff\xff\xff")
    assert tuple(bank.name(address) for address in (0x15, 0x16, 0x17)) == names
    assert bank.at[0x15] is bank.at[0x16] is bank.at[0x17] is block


def test_address_without_register_is_reserved() -> None:
    bank = RegisterMap([declare(addr=0x0F, reset=0x6A, names=("WHO_AM_I",))])

    assert bank.name(0x0F) == bank.name(0x0F + ADDRESSES) == "WHO_AM_I"
    assert bank.name(0x10) == "reserved"
    assert bank.at[0x10] is None
    assert bank.reset[0x10] == 0


def test_module_map_orders_registers_by_address() -> None:
    first, second = declare(addr=0x10), declare(addr=0x20)
    module = types.ModuleType("example")
    vars(module).update(SECOND=second, FIRST=first, Register=Register, Bits=Bits, NUMBER=7)

    assert RegisterMap.of(module).registers == (first, second)
