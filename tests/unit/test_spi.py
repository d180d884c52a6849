"""SPI: framing, wires, clock modes; through ``board.spi2``, as in a test of a driver."""

from __future__ import annotations

import pytest

from fcu_emulator import Board, I2CNackError, InputError
from fcu_emulator.emulator.clock import PS_PER_S
from fcu_emulator.emulator.trace import BusTransfer
from tests.support.words import Words

READ = 0x80
CS = {"LSM6DSL": "PA8", "LIS2MDL": "PB12", "LPS22HB": "PC13"}  # ST's firmware: the chip selects
IDENTITY = {"LSM6DSL": (0x0F, 0x6A), "LIS2MDL": (0x4F, 0x40), "LPS22HB": (0x0F, 0xB1)}
TO_3_WIRE = {"LSM6DSL": b"\x12\x0c", "LIS2MDL": b"", "LPS22HB": b"\x10\x01"}  # LIS2MDL: 3-wire after reset
TO_4_WIRE = {"LSM6DSL": b"\x12\x04", "LIS2MDL": b"\x62\x04", "LPS22HB": b"\x10\x00"}


@pytest.mark.parametrize("part", CS)
def test_three_wire_host_writes_mode_before_first_read(part: str) -> None:
    """After reset LSM6DSL and LPS22HB are in 4-wire mode (SIM = 0), but the LIS2MDL is not (4WSPI = 0)."""
    board = Board(wiring="fcu001v1")
    register, identity = IDENTITY[part]
    before = board.spi2.write_read(CS[part], bytes([READ | register]), 1)
    assert before == (bytes([identity]) if part == "LIS2MDL" else b"\xff")
    if TO_3_WIRE[part]:
        board.spi2.write(CS[part], TO_3_WIRE[part])
    assert board.spi2.write_read(CS[part], bytes([READ | register]), 1) == bytes([identity])


@pytest.mark.parametrize("part", CS)
@pytest.mark.parametrize("mode", [0, 3])
def test_four_wire_host_reads_in_both_modes(part: str, mode: int) -> None:
    board = Board(wiring="fcu001v1")
    board.spi2.configure(mode=0 if mode == 0 else 3, wires=4)
    board.spi2.write(CS[part], TO_4_WIRE[part])
    register, identity = IDENTITY[part]
    assert board.spi2.write_read(CS[part], bytes([READ | register]), 1) == bytes([identity])


def test_other_clock_modes_give_no_valid_data() -> None:
    board = Board(wiring="fcu001v1")
    board.spi2.configure(mode=1, wires=4)
    board.spi2.write("PA8", b"\x10\xa8")
    assert board.spi2.write_read("PA8", b"\x8f", 1) == b"\xff"
    board.spi2.configure(mode=3, wires=4)
    assert board.spi2.write_read("PA8", b"\x90", 1) == b"\x00"


def test_burst_increments_and_writes_several_registers() -> None:
    board = Board(wiring="fcu001v1", ideal=True)
    board.spi2.write("PA8", b"\x12\x0c")
    board.spi2.write("PA8", b"\x73\x01\x02\x03")
    assert board.spi2.write_read("PA8", b"\xf3", 3) == b"\x01\x02\x03"


def test_barometer_increments_only_with_if_add_inc() -> None:
    """LPS22HB datasheet 7.3 and 9.6: the bit also applies to SPI, for reads and writes."""
    board = Board(wiring="fcu001v1", ideal=True)
    board.spi2.write("PC13", b"\x10\x01")
    board.spi2.write("PC13", b"\x15\x01\x02\x03")
    assert board.spi2.write_read("PC13", b"\x95", 3) == b"\x01\x02\x03"
    board.spi2.write("PC13", b"\x11\x00")
    board.spi2.write("PC13", b"\x15\x04\x05")
    assert board.spi2.write_read("PC13", b"\x95", 2) == b"\x05\x05"
    assert board.spi2.write_read("PC13", b"\x96", 1) == b"\x02"


def test_magnetometer_spi_accepts_driver_addresses() -> None:
    """Drivers also set bit 6, which every address has already."""
    board = Board(wiring="fcu001v1", ideal=True)
    board.spi2.write("PB12", bytes([0x40 | 0x45]) + bytes(range(1, 7)))
    assert board.spi2.write_read("PB12", bytes([0xC0 | 0x45]), 6) == bytes(range(1, 7))


def test_barometer_burst_wraps_on_spi() -> None:
    """LPS22HB datasheet 5.8."""
    board = Board(wiring="fcu001v1", ideal=True)
    board.spi2.write("PC13", b"\x10\x31")
    board.run_for(0.05)
    data = board.spi2.write_read("PC13", b"\xa8", 10)
    assert data[:5] == data[5:] != bytes(5)


def test_spi_byte_takes_eight_clock_periods() -> None:
    """Question 1 of the lab: 42 MHz / 16, as in ST's firmware."""
    board = Board(wiring="fcu001v1")
    board.spi2.write_read("PA8", b"\x8f", 3)
    assert board.spi2.speed_hz == 2_625_000
    assert board.clock.now_ps == 4 * 8 * PS_PER_S // 2_625_000


def test_spi_trace_omits_read_flag() -> None:
    board = Board(wiring="fcu001v1")
    board.trace.record_all()
    board.spi2.write_read("PB12", b"\xcf", 1)
    (event,) = board.trace.of(BusTransfer)
    assert (event.bus, event.device, event.register, event.read) == ("SPI2", "LIS2MDL", "WHO_AM_I", b"\x40")


@pytest.mark.parametrize(
    ("address", "disable"), [(0x6B, b"\x13\x04"), (0x1E, b"\x62\x20"), (0x5D, b"\x11\x18")]
)
def test_i2c_disable_silences_i2c(address: int, disable: bytes) -> None:
    """LSM6DSL CTRL4_C.I2C_disable, LIS2MDL CFG_REG_C.I2C_DIS, LPS22HB CTRL_REG2.I2C_DIS."""
    board = Board()
    board.i2c2.write(address, disable)
    with pytest.raises(I2CNackError):
        board.i2c2.write_read(address, b"\x0f", 1)
    with pytest.raises(I2CNackError):
        board.i2c2.bus.read_from(address, 0x0F, 1)


def test_error_for_unknown_chip_select_lists_known_ones(words: Words) -> None:
    with pytest.raises(InputError, match="PA8, PB12, PC13") as refused:
        Board(wiring="fcu001v1").spi2.write("PA4", b"\x00")
    assert refused.value.kind == "unknown_chip_select"
    with pytest.raises(InputError, match="PA8") as refused:
        Board().spi2.write("PA8", b"\x00")
    assert refused.value.kind == "unknown_chip_select"
    words("python", str(refused.value))
    with pytest.raises(InputError, match="I2C2") as refused:
        Board(wiring="fcu001v1", firmware="lab3")
    assert refused.value.kind == "wrong_wiring"


def test_speed_of_unused_peripheral_is_zero() -> None:
    """The solution for I2C2 does not enable SPI2. The solution for SPI2 sets 42 MHz / 16."""
    speeds = []
    for wiring in ("lab3", "fcu001v1"):
        board = Board(firmware="solution", wiring=wiring)
        board.run_for(0.1)
        speeds.append(board.spi2.speed_hz)
    assert speeds == [0, 2_625_000]
