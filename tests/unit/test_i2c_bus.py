"""The bus through ``board.i2c2``, as in a test of a driver: time on the wire, acknowledges, faults, trace."""

from __future__ import annotations

import pytest

from fcu_emulator import Board, I2CBusError, I2CNackError, I2CStuckError, InputError
from fcu_emulator.emulator.buses.i2c import I2CFault
from fcu_emulator.emulator.clock import PS_PER_S
from fcu_emulator.emulator.trace import BusTransfer, DeviceNote, Fault, RegisterWrite

LSM6DSL, LIS2MDL, LPS22HB = 0x6B, 0x1E, 0x5D
FOREVER = 1 << 62


@pytest.mark.parametrize(
    ("address", "register", "identity"),
    [(LSM6DSL, 0x0F, 0x6A), (LIS2MDL, 0x4F, 0x40), (LPS22HB, 0x0F, 0xB1)],
)
def test_every_sensor_answers_at_its_address(address: int, register: int, identity: int) -> None:
    """0x6B, 0x1E and 0x5D: SA0 of LSM6DSL and LPS22HB is high."""
    assert Board().i2c2.write_read(address, bytes([register]), 1) == bytes([identity])


@pytest.mark.parametrize(
    ("written", "read", "bits"),
    [
        (1, 6, 1 + 9 + 9 + 1 + 9 + 54 + 1),  # start, address, register, restart, address, data, stop
        (2, 0, 1 + 9 + 18 + 1),
        (0, 4, 1 + 9 + 36 + 1),
        (0, 0, 1 + 9 + 1),  # a scan: only the address
    ],
)
def test_transfer_takes_time_of_bits_at_400_khz(written: int, read: int, bits: int) -> None:
    board = Board()
    if written and read:
        board.i2c2.write_read(LSM6DSL, bytes(written), read)
    elif read:
        board.i2c2.read(LSM6DSL, read)
    else:
        board.i2c2.write(LSM6DSL, bytes(written))
    assert board.clock.now_ps == bits * PS_PER_S // 400_000


def test_i2c_read_continues_at_next_register() -> None:
    board = Board()
    board.i2c2.write(LPS22HB, b"\x0f")
    assert board.i2c2.read(LPS22HB, 1) == b"\xb1"
    assert board.i2c2.read(LPS22HB, 2) == b"\x00\x10"  # CTRL_REG1, CTRL_REG2 at reset


def test_absent_address_causes_nack() -> None:
    board = Board()
    with pytest.raises(I2CNackError, match="0x42") as caught:
        board.i2c2.write_read(0x42, b"\x0f", 1)
    assert (caught.value.address, caught.value.byte_index) == (0x42, 0)
    assert board.clock.now_ps == (1 + 9 + 1) * PS_PER_S // 400_000


def test_device_answers_again_after_absent_fault() -> None:
    board = Board()
    board.i2c2.inject(I2CFault("absent", 0, 10e-3, address=LSM6DSL))
    with pytest.raises(I2CNackError):
        board.i2c2.write_read(LSM6DSL, b"\x0f", 1)
    assert board.i2c2.write_read(LIS2MDL, b"\x4f", 1) == b"\x40"
    board.run_for(0.01)
    assert board.i2c2.write_read(LSM6DSL, b"\x0f", 1) == b"\x6a"


def test_nack_at_byte_keeps_earlier_bytes() -> None:
    board = Board()
    board.i2c2.inject(I2CFault("nack", 0, 1e-3, address=LSM6DSL, byte_index=3))
    with pytest.raises(I2CNackError) as caught:
        board.i2c2.write(LSM6DSL, b"\x73\x11\x22\x33")  # X_OFS_USR arrives, Y_OFS_USR does not
    assert caught.value.byte_index == 3
    board.run_for(0.001)
    assert board.i2c2.write_read(LSM6DSL, b"\x73", 3) == b"\x11\x00\x00"


def test_stuck_line_times_out_as_in_hal() -> None:
    board = Board()
    board.i2c2.inject(I2CFault("stuck"))
    with pytest.raises(I2CStuckError):
        board.i2c2.read(LSM6DSL, 1)
    assert board.now_s == pytest.approx(0.025)


def test_bus_error_fault_raises_bus_error() -> None:
    board = Board()
    board.i2c2.inject(I2CFault("bus_error", address=LIS2MDL))
    with pytest.raises(I2CBusError):
        board.i2c2.read(LIS2MDL, 1)
    assert len(board.i2c2.read(LSM6DSL, 1)) == 1


@pytest.mark.parametrize("address", [-1, 0x80, 0xD6])
def test_8_bit_address_is_refused_with_reason(address: int) -> None:
    with pytest.raises(InputError, match="0x7F") as refused:
        Board().i2c2.read(address, 1)
    assert refused.value.kind == "i2c_address"


def test_impossible_length_is_refused() -> None:
    with pytest.raises(InputError, match="1 to 65535") as refused:
        Board().i2c2.read(LSM6DSL, 0)
    assert refused.value.kind == "read_length"


def test_trace_shows_names_of_registers_when_enabled() -> None:
    board = Board()
    board.i2c2.write(LSM6DSL, b"\x10\xa8")
    assert not board.trace.of(BusTransfer)
    board.trace.record_all()
    board.i2c2.write(LSM6DSL, b"\x11\x6c")
    board.i2c2.write_read(LIS2MDL, b"\x68", 6)
    write, read = board.trace.of(BusTransfer)
    assert (write.device, write.register, write.written, write.result) == (
        "LSM6DSL",
        "CTRL2_G",
        b"\x11\x6c",
        "ok",
    )
    assert (read.device, read.register, len(read.read)) == ("LIS2MDL", "OUTX_L_REG", 6)
    assert [(e.register, e.old, e.new) for e in board.trace.of(RegisterWrite)] == [("CTRL2_G", 0x00, 0x6C)]


def test_unmodelled_and_failed_access_is_always_traced() -> None:
    board = Board()
    board.i2c2.write(LSM6DSL, b"\x04\x01")  # SENSOR_SYNC_TIME_FRAME
    board.i2c2.inject(I2CFault("absent", address=LSM6DSL))
    with pytest.raises(I2CNackError):
        board.i2c2.read(LSM6DSL, 1)
    assert [(note.device, note.what) for note in board.trace.of(DeviceNote)] == [("LSM6DSL", "not modelled")]
    assert "SENSOR_SYNC_TIME_FRAME" in board.trace.of(DeviceNote)[0].text
    assert len(board.trace.of(Fault)) == 1
    assert f"0x{LSM6DSL:02X}" in board.trace.of(BusTransfer)[0].result
