"""The adapters alone: the properties that the documentation of the imitated objects promises to a driver."""

from __future__ import annotations

import errno
from array import array
from collections.abc import Callable, Iterator
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from fcu_emulator import Board, I2CBusError, I2CNackError, I2CStuckError, InputError
from fcu_emulator.emulator.adapters import BusioI2C, MachineI2C, SensirionI2C, SMBus
from fcu_emulator.emulator.buses.i2c import FaultKind, I2CFault
from fcu_emulator.emulator.trace import BusTransfer

WHO_AM_I = bytes((0x0F,))
SENSORS = [0x1E, 0x5D, 0x6B]
EREMOTEIO = 121  # Linux, include/uapi/asm-generic/errno.h


@pytest.fixture
def board() -> Board:
    return Board(ideal=True)


@pytest.fixture
def busio(board: Board) -> BusioI2C:
    i2c = BusioI2C(board.i2c2)
    assert i2c.try_lock()
    return i2c


class Message:
    """The interface of ``smbus2.i2c_msg``."""

    def __init__(self, addr: int, flags: int, data: bytes) -> None:
        self.addr, self.flags, self.len, self.buf = addr, flags, len(data), bytearray(data)

    def __iter__(self) -> Iterator[int]:
        return iter(self.buf)


def write(address: int, *data: int) -> Message:
    return Message(address, 0, bytes(data))


def read(address: int, count: int) -> Message:
    return Message(address, 1, bytes(count))


def fail(board: Board, kind: FaultKind) -> None:
    board.i2c2.inject(I2CFault(kind, address=0x6B))


# -- busio ----------------------------------------------------------------------------------------------


def test_busio_transfer_requires_lock(board: Board) -> None:
    i2c = BusioI2C(board.i2c2)
    transfers: list[Callable[[], object]] = [
        i2c.scan,
        lambda: i2c.writeto(0x6B, WHO_AM_I),
        lambda: i2c.readfrom_into(0x6B, bytearray(1)),
        lambda: i2c.writeto_then_readfrom(0x6B, WHO_AM_I, bytearray(1)),
    ]
    for transfer in transfers:
        with pytest.raises(RuntimeError, match="requires lock"):
            transfer()
    assert i2c.try_lock()
    assert not i2c.try_lock()
    i2c.unlock()
    assert i2c.try_lock()


def test_busio_scans_and_closes(board: Board) -> None:
    with BusioI2C(board.i2c2) as i2c:
        assert i2c.try_lock()
        assert i2c.scan() == SENSORS


def test_busio_start_and_end_limit_buffers(busio: BusioI2C) -> None:
    source, target = bytearray(b"??\x0f?"), bytearray(b"----")
    busio.writeto_then_readfrom(0x6B, source, target, out_start=2, out_end=3, in_start=1, in_end=2)
    assert target == b"-\x6a--"
    busio.writeto(0x6B, source, start=2, end=3)
    busio.readfrom_into(0x6B, target, start=3)
    assert target == b"-\x6a-\x6a"


def test_busio_reads_into_any_buffer_type(busio: BusioI2C) -> None:
    """CTRL3_C resets to 0x04, CTRL4_C to 0 (LSM6DSL datasheet T19)."""
    words = array("H", [0xFFFF, 0xFFFF])
    busio.writeto_then_readfrom(0x6B, b"\x12", words, in_end=1)
    assert (words.tobytes()[:2], words[1]) == (b"\x04\x00", 0xFFFF)


# -- machine --------------------------------------------------------------------------------------------


def test_machine_transfers_memory_and_plain_bytes(board: Board) -> None:
    i2c = MachineI2C(board.i2c2)
    assert i2c.scan() == SENSORS
    assert i2c.readfrom_mem(0x6B, 0x0F, 1) == b"\x6a"
    i2c.writeto_mem(0x6B, 0x10, b"\x48\x5c")
    buffer = bytearray(2)
    i2c.readfrom_mem_into(0x6B, 0x10, buffer)
    assert buffer == b"\x48\x5c"
    assert i2c.writeto(0x6B, b"\x11\x4c", stop=False) == 2
    assert i2c.writeto(0x6B, b"\x10", False) == 1
    i2c.readfrom_into(0x6B, buffer)
    assert buffer == b"\x48\x4c"
    assert i2c.writeto(0x1E, b"\x4f") == 1
    assert i2c.readfrom(0x1E, 1) == b"\x40"


def test_machine_sends_wide_memory_addresses_high_byte_first(board: Board) -> None:
    """These sensors treat the second byte as data: CTRL1_XL."""
    i2c = MachineI2C(board.i2c2)
    i2c.writeto_mem(0x6B, 0x1048, b"", addrsize=16)
    assert i2c.readfrom_mem(0x6B, 0x10, 1) == b"\x48"


# -- smbus ----------------------------------------------------------------------------------------------


def test_smbus_transfers_bytes_words_and_blocks(board: Board) -> None:
    with SMBus(board.i2c2) as bus:
        bus.write_quick(0x6B)
        assert bus.read_byte_data(0x6B, 0x0F) == 0x6A
        bus.write_byte_data(0x6B, 0x10, 0x48)
        bus.write_word_data(0x6B, 0x11, 0x445C, force=True)
        assert bus.read_word_data(0x6B, 0x11) == 0x445C
        assert bus.read_i2c_block_data(0x6B, 0x10, 3) == [0x48, 0x5C, 0x44]
        bus.write_i2c_block_data(0x6B, 0x10, [0xA8, 0x6C])
        bus.write_byte(0x6B, 0x10)
        assert bus.read_byte(0x6B) == 0xA8
        assert bus.read_i2c_block_data(0x6B, 0x00, 32)[0x0F] == 0x6A


def test_smbus_block_over_32_bytes_is_refused(board: Board) -> None:
    bus = SMBus(board.i2c2)
    with pytest.raises(ValueError, match="over 32 bytes"):
        bus.read_i2c_block_data(0x6B, 0x00, 33)
    with pytest.raises(ValueError, match="cannot exceed 32 bytes"):
        bus.write_i2c_block_data(0x6B, 0x00, [0] * 33)


def test_smbus_combines_write_and_following_read(board: Board) -> None:
    board.trace.record_all()
    magnetometer, status, ctrl = read(0x1E, 1), read(0x6B, 1), read(0x6B, 2)
    SMBus(board.i2c2).i2c_rdwr(
        write(0x1E, 0x4F),
        magnetometer,
        write(0x6B, 0x10, 0x48),
        write(0x1E, 0x60),
        status,
        write(0x6B, 0x10),
        ctrl,
    )
    assert (magnetometer.buf, ctrl.buf) == (b"\x40", b"\x48\x00")
    assert [(event.address, event.written, len(event.read)) for event in board.trace.of(BusTransfer)] == [
        (0x1E, b"\x4f", 1),
        (0x6B, b"\x10\x48", 0),
        (0x1E, b"\x60", 0),
        (0x6B, b"", 1),
        (0x6B, b"\x10", 2),
    ]


def test_smbus_refuses_unknown_flags_before_sending(board: Board) -> None:
    board.trace.record_all()
    with pytest.raises(InputError, match="0x4001") as refused:
        SMBus(board.i2c2).i2c_rdwr(write(0x6B, 0x0F), Message(0x6B, 0x4001, b"\0"))
    assert refused.value.kind == "unknown_flags"
    assert not board.trace.of(BusTransfer)


# -- errors ---------------------------------------------------------------------------------------------

FAULTS: list[tuple[FaultKind, int, int]] = [
    ("absent", errno.ENODEV, EREMOTEIO),
    ("stuck", errno.ETIMEDOUT, errno.ETIMEDOUT),
    ("bus_error", errno.EIO, errno.EIO),
]


@pytest.mark.parametrize(("kind", "number", "on_linux"), FAULTS)
def test_failed_transfer_raises_os_error(board: Board, kind: FaultKind, number: int, on_linux: int) -> None:
    fail(board, kind)
    busio, machine, bus = BusioI2C(board.i2c2), MachineI2C(board.i2c2), SMBus(board.i2c2)
    busio.try_lock()
    calls: list[tuple[Callable[[], Any], int]] = [
        (lambda: busio.writeto(0x6B, b"\0"), number),
        (lambda: busio.readfrom_into(0x6B, bytearray(1)), number),
        (lambda: busio.writeto_then_readfrom(0x6B, b"\0", bytearray(1)), number),
        (lambda: machine.writeto(0x6B, b"\0"), number),
        (lambda: machine.readfrom(0x6B, 1), number),
        (lambda: machine.writeto_mem(0x6B, 0, b"\0"), number),
        (lambda: machine.readfrom_mem(0x6B, 0, 1), number),
        (lambda: bus.read_byte(0x6B), on_linux),
        (lambda: bus.write_byte_data(0x6B, 0, 0), on_linux),
        (lambda: bus.read_i2c_block_data(0x6B, 0, 1), on_linux),
        (lambda: bus.i2c_rdwr(read(0x6B, 1)), on_linux),
    ]
    for call, expected in calls:
        with pytest.raises(OSError, match="I2C 0x6B") as caught:
            call()
        assert caught.value.errno == expected


def test_scan_omits_absent_devices_and_reports_stuck_bus(board: Board, busio: BusioI2C) -> None:
    fail(board, "absent")
    assert busio.scan() == [0x1E, 0x5D]
    board.i2c2.inject(I2CFault("stuck"))
    for scan in (busio.scan, MachineI2C(board.i2c2).scan):
        with pytest.raises(OSError, match="I2C") as caught:
            scan()
        assert caught.value.errno == errno.ETIMEDOUT


@pytest.mark.parametrize(
    ("kind", "status", "error"),
    [("absent", 2, I2CNackError), ("stuck", 3, I2CStuckError), ("bus_error", 4, I2CBusError)],
)
def test_sensirion_failure_returns_status_code(
    board: Board, kind: FaultKind, status: int, error: type
) -> None:
    """The codes of I2cTransceiverV1 in sensirion-i2c-driver 1.0."""
    fail(board, kind)
    answer = SensirionI2C(board.i2c2, board.run_for).transceive(0x6B, WHO_AM_I, 1, 0.0, 0.0)
    assert (answer[0], type(answer[1]), answer[2]) == (status, error, b"")


def test_sensirion_phases_are_optional_with_delay_between(board: Board) -> None:
    transceiver = SensirionI2C(board.i2c2, board.run_for)
    assert transceiver.channel_count is None
    assert transceiver.transceive(0x6B, WHO_AM_I, None, 0.5, 0.0) == (0, None, b"")
    assert board.now_s < 0.001
    assert transceiver.transceive(0x6B, None, 1, 0.5, 0.0) == (0, None, b"\x6a")
    assert board.now_s == pytest.approx(0.5, abs=0.001)


# -- all of them ----------------------------------------------------------------------------------------


@given(st.binary(min_size=1, max_size=6), st.integers(0x73, 0x78))
def test_every_adapter_reads_same_bytes_as_bus(data: bytes, register: int) -> None:
    """User offsets and reserved addresses: the sensor determines the stored bits, and all adapters show the same bytes."""
    board = Board(ideal=True)
    busio, machine, bus = BusioI2C(board.i2c2), MachineI2C(board.i2c2), SMBus(board.i2c2)
    busio.try_lock()
    machine.writeto_mem(0x6B, register, data)
    expected = board.i2c2.write_read(0x6B, bytes((register,)), len(data))
    buffer = bytearray(len(data))
    busio.writeto_then_readfrom(0x6B, bytes((register,)), buffer)
    sensirion = SensirionI2C(board.i2c2, board.run_for)
    assert buffer == expected
    assert machine.readfrom_mem(0x6B, register, len(data)) == expected
    assert bytes(bus.read_i2c_block_data(0x6B, register, len(data))) == expected
    assert sensirion.transceive(0x6B, bytes((register,)), len(data), 0.0, 0.0)[2] == expected
