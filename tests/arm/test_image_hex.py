"""Intel HEX: every record type, every line ending, and damage that is reported with its line.

Expectations are from the "Hexadecimal Object File Format Specification", Intel, revision A, 1988.
"""

from __future__ import annotations

from random import Random

import pytest
from hypothesis import given
from hypothesis import strategies as st

from fcu_emulator.emulator.chip.image import parse_firmware
from fcu_emulator.emulator.errors import FirmwareFileError
from tests.support.arm.elf_builder import FLASH, RAM, RESET, code
from tests.support.words import Words

END = ":00000001FF"


def record(kind: int, address: int, data: bytes) -> str:
    raw = bytes([len(data)]) + address.to_bytes(2, "big") + bytes([kind]) + data
    return ":" + (raw + bytes([-sum(raw) & 0xFF])).hex().upper()


def linear(address: int) -> str:
    return record(4, 0, (address >> 16).to_bytes(2, "big"))


def hex_lines(start: int, data: bytes, width: int = 16) -> list[str]:
    lines = []
    for offset in range(0, len(data), width):
        address = start + offset
        if offset == 0 or address & 0xFFFF < width:
            lines.append(linear(address))
        lines.append(record(0, address & 0xFFFF, data[offset : offset + width]))
    return lines


def hex_file(*lines: str, ending: str = "\n") -> bytes:
    return "".join(line + ending for line in [*hex_lines(FLASH, code()), *lines, END]).encode()


def refusal(data: bytes) -> FirmwareFileError:
    with pytest.raises(FirmwareFileError) as caught:
        parse_firmware(data, "lab3.hex")
    assert "\n" not in str(caught.value)
    return caught.value


@given(
    size=st.integers(0x44, 0x300),
    width=st.sampled_from([1, 4, 16, 32, 255]),
    ending=st.sampled_from(["\n", "\r\n", "\r", "\r\n\r\n", " \n"]),
    upper=st.booleans(),
    order=st.randoms(use_true_random=False),
)
def test_hex_spelling_does_not_change_contents(
    size: int, width: int, ending: str, upper: bool, order: Random
) -> None:
    lines = [
        linear(FLASH) + ending + record(0, offset, code(size=size)[offset : offset + width])
        for offset in range(0, size, width)
    ]
    order.shuffle(lines)
    text = ending.join([*lines, END]) + ending

    image = parse_firmware((text if upper else text.lower()).encode(), "lab3.hex")

    assert (image.kind, image.segments) == ("hex", ((FLASH, code(size=size)),))


def test_long_hex_file_crosses_64_kb() -> None:
    data = code(size=0x1_8000)

    image = parse_firmware("\n".join([*hex_lines(FLASH, data), END]).encode(), "lab3.hex")

    assert image.segments == ((FLASH, data),)


def test_final_line_needs_no_line_ending() -> None:
    assert parse_firmware(hex_file().rstrip(), "lab3.hex").segments == ((FLASH, code()),)


def test_start_addresses_are_accepted_and_not_used() -> None:
    """Types 03 and 05 tell a debugger the start address. A Cortex-M takes its start address from the vector table."""
    lines = [record(5, 0, bytes.fromhex("08001234")), record(3, 0, bytes.fromhex("00003800"))]

    assert parse_firmware(hex_file(*lines), "lab3.hex").reset_vector == RESET | 1


def test_segment_base_reaches_one_megabyte() -> None:
    error = refusal(hex_file(record(2, 0, bytes.fromhex("F000")), record(0, 0x0010, b"\1\2")))

    assert error.kind == "other_chip"
    assert "0x000F0010..0x000F0011" in error.problem


def test_segment_base_addresses_wrap_within_64_kb() -> None:
    """The address of byte i is base + (offset + i) mod 64 K. With a linear base the address does not wrap."""
    wrapped = refusal(hex_file(record(2, 0, bytes.fromhex("1000")), record(0, 0xFFFF, b"\1\2")))
    on = parse_firmware(hex_file(record(0, 0xFFFF, b"\1\2")), "lab3.hex")

    assert "0x0001FFFF..0x0001FFFF" in wrapped.problem
    assert on.segments[-1] == (FLASH + 0xFFFF, b"\1\2")


def test_records_for_ram_are_loaded() -> None:
    assert parse_firmware(hex_file(*hex_lines(RAM, b"\1\2")), "lab3.hex").segments[-1] == (RAM, b"\1\2")


@pytest.mark.parametrize(
    ("line", "kind", "where"),
    [
        ("hello", "not_a_record", "line 19"),
        ("00000001FF", "not_a_record", "line 19"),
        (":0000000", "not_a_record", "line 19"),
        (":00000G01FF", "not_a_record", "line 19"),
        (":", "record_length", "line 19"),
        (":0000", "record_length", "line 19"),
        (":04000000AABB96", "record_length", "line 19"),
        (":0100000000AABB55", "record_length", "line 19"),
        (":020000000102FA", "checksum", "line 19"),
        (record(6, 0, b""), "record_type", "line 19"),
        (record(4, 0, b"\0"), "record_type", "line 19"),
        (record(1, 0, b"\0"), "record_type", "line 19"),
        (END, "after_end", "line 20"),
        (record(0, 0x00F0, b"\0"), "overlap", "0x080000F0"),
        (linear(0x0804_0000) + "\n" + record(0, 0, b"\0"), "other_chip", "0x08040000..0x08040000"),
        (linear(0xFFFF_0000) + "\n" + record(0, 0xFFFF, b"\0\0"), "other_chip", "0xFFFFFFFF..0x100000000"),
    ],
)
def test_damage_is_reported_with_its_line(line: str, kind: str, where: str, words: Words) -> None:
    """code() fills lines 1 (linear base) to 17, so a line after ``:...`` of the base is line 19."""
    error = refusal(hex_file("", line))

    assert error.kind == kind
    assert where in error.problem
    words("firmware_file", error.problem)


@pytest.mark.parametrize(
    ("kept", "kind"),
    [(13, "record_length"), (60, "no_end_record"), (-13, "no_end_record"), (-2, "not_a_record")],
)
def test_file_cut_short_is_refused(kept: int, kind: str) -> None:
    assert refusal(hex_file()[:kept]).kind == kind


def test_file_cut_between_two_lines_is_refused(words: Words) -> None:
    error = refusal(hex_file().removesuffix(END.encode() + b"\n"))

    assert error.kind == "no_end_record"
    words("firmware_file", error.problem)


def test_too_long_hex_file_is_refused(words: Words) -> None:
    error = refusal(hex_file().rstrip() + b"\n" * (6 << 20))

    assert error.kind == "too_long"
    words("firmware_file", error.problem)
