"""Mistakes of a caller in Python: each raises an error that states the correct form."""

from __future__ import annotations

from typing import Any

import pytest

from fcu_emulator import Board, InputError
from fcu_emulator.emulator.buses.i2c import is_scan
from fcu_emulator.sensors import AccessError
from tests.support.sensor_fakes import SENSORS, Chip
from tests.support.words import Words

parts = pytest.mark.parametrize("part", SENSORS)


# -- a part itself ----------------------------------------------------------------------------------------


@parts
@pytest.mark.parametrize(("address", "count"), [(0x80, 1), (0x100, 6), (-1, 1), (0x0F, 0), (0x0F, -1)])
def test_read_of_impossible_burst_is_refused(part: str, address: int, count: int) -> None:
    chip = Chip(part)
    with pytest.raises(AccessError) as caught:
        chip.read(address, count)
    assert (caught.value.address, caught.value.count) == (address, count)
    assert "read" in str(caught.value)


@parts
def test_burst_refused_once_is_refused_every_time(part: str) -> None:
    chip = Chip(part)
    for _ in range(2):
        with pytest.raises(AccessError):
            chip.read(0x80, 1)


@parts
@pytest.mark.parametrize("address", [0x80, -1])
def test_write_of_impossible_burst_is_refused(part: str, address: int) -> None:
    chip = Chip(part)
    with pytest.raises(AccessError) as caught:
        chip.part.write(address, b"\x00\x00", 0)
    assert (caught.value.address, caught.value.count) == (address, 2)
    assert "write" in str(caught.value)
    with pytest.raises(AccessError) as caught:
        chip.part.write(0x10, b"", 0)
    assert (caught.value.address, caught.value.count) == (0x10, 0)
    assert "write" in str(caught.value)


def test_refused_burst_error_has_sub_addresses(words: Words) -> None:
    chip = Chip("LSM6DSL")
    with pytest.raises(AccessError) as reading:
        chip.read(0x80, 1)
    with pytest.raises(AccessError) as writing:
        chip.part.write(0x10, b"", 0)
    words("sensors", f"{reading.value}\n{writing.value}")


@parts
@pytest.mark.parametrize("data", [5, "\x05", [5], None])
def test_write_of_non_bytes_raises_type_error(part: str, data: Any) -> None:
    chip = Chip(part)
    with pytest.raises(TypeError, match="bytes"):
        chip.part.write(0x10, data, 0)
    assert chip.log == []


@parts
@pytest.mark.parametrize("address", ["0x0F", 15.0, None])
def test_address_must_be_integer(part: str, address: Any) -> None:
    chip = Chip(part)
    with pytest.raises(TypeError):
        chip.part.read(address, 1, 0)
    with pytest.raises(TypeError):
        chip.part.write(address, b"\x00", 0)


@parts
def test_very_long_burst_is_read_completely(part: str) -> None:
    """Bursts are cached by address and length, and neither may overflow into the other."""
    chip = Chip(part)
    chip.read(0x01, 1)
    assert len(chip.read(0x00, (1 << 16) + 1)) == (1 << 16) + 1


# -- the buses ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("data", [5, "\x0f", None, 1.5, [256], [-1], ["\x0f"], {15}])
def test_bus_send_of_non_bytes_is_refused(data: Any) -> None:
    """``bytes(5)`` would be five zeros, an unintended write."""
    board = Board()
    for send in (
        lambda: board.i2c2.write(0x6B, data),
        lambda: board.i2c2.write_read(0x6B, data, 1),
        lambda: Board(wiring="fcu001v1").spi2.write("PA8", data),
    ):
        with pytest.raises(InputError) as caught:
            send()
        assert caught.value.kind == "not_bytes"
        assert repr(data) in str(caught.value)
    assert board.clock.now_ps == 0


@pytest.mark.parametrize("data", [b"\x0f", bytearray(b"\x0f"), memoryview(b"\x0f"), [0x0F], (0x0F,)])
def test_bytes_like_values_are_accepted(data: Any) -> None:
    assert Board().i2c2.write_read(0x6B, data, 1) == b"\x6a"


@pytest.mark.parametrize("count", [0, -1, 65536, 1.0, "1", None])
def test_invalid_read_length_is_refused(count: Any) -> None:
    board = Board()
    for read in (
        lambda: board.i2c2.read(0x6B, count),
        lambda: board.i2c2.write_read(0x6B, b"\x0f", count),
    ):
        with pytest.raises(InputError, match="1 to 65535") as caught:
            read()
        assert caught.value.kind == "read_length"
    if count != 0:  # on SPI a write alone is a transfer too
        with pytest.raises(InputError, match="0 to 65535") as caught:
            Board(wiring="fcu001v1").spi2.write_read("PA8", b"\x8f", count)
        assert caught.value.kind == "read_length"


@pytest.mark.parametrize(
    "address",
    [
        0xD6,
        -1,
        "0x6B",
        1.0,
    ],
)
def test_i2c_address_has_7_bits(address: Any, words: Words) -> None:
    with pytest.raises(InputError) as caught:
        Board().i2c2.write(address, b"\x00")
    assert caught.value.kind == "i2c_address"
    words("python", str(caught.value))


@pytest.mark.parametrize(
    ("counts", "scan"),
    [
        ([1] * 8, True),
        ([3] * 120, True),
        ([1] * 7, False),
        ([800, *[1] * 119], False),  # a wrong address that is used besides a scan
        ([2, *[1] * 7], True),
    ],
)
def test_scan_is_recognised_by_equal_address_counts(counts: list[int], scan: bool) -> None:
    assert is_scan(counts) == scan
