"""``smbus2.SMBus``, on the virtual board's I2C2.

Shape and limits: smbus2's documentation and the kernel's ``i2c/smbus-protocol``. What the three parts have no
use for is left out: process calls, blocks with a length byte, packet error codes.

Decision: ``i2c_rdwr`` passes a write and the read after it on as one transfer, other messages one by one,
with a stop in place of the repeated start. The parts keep the sub-address over a stop, so the bytes are the
same.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any, Protocol, Self

from emulator.adapters.os_errors import EREMOTEIO, os_errors
from emulator.buses.i2c_master import I2CMaster
from emulator.errors import InputError

_BLOCK_MAX = 32  # I2C_SMBUS_BLOCK_MAX
_READ = 0x0001  # I2C_M_RD


class I2CMessage(Protocol):
    """``smbus2.i2c_msg``: ``buf`` points to ``len`` bytes, which iterating gives."""

    addr: int
    flags: int
    len: int
    buf: Any

    def __iter__(self) -> Iterator[int]: ...


class SMBus:
    """Give ``SMBus(board.i2c2)`` to a driver in place of ``smbus2.SMBus(1)``.

    Addresses have 7 bits; ``force`` is accepted and has no meaning. A device that does not answer is
    OSError(EREMOTEIO), a stuck bus OSError(ETIMEDOUT); a block over 32 bytes is a ValueError.
    """

    def __init__(self, master: I2CMaster) -> None:
        self._master = master

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *exc_info: object) -> None:
        self.close()

    def close(self) -> None:
        """Close the device file: there is none."""

    def write_quick(self, i2c_addr: int, force: bool | None = None) -> None:
        """Ask whether a device is there: its address and no byte."""
        del force
        self._write(i2c_addr, b"")

    def read_byte(self, i2c_addr: int, force: bool | None = None) -> int:
        """One byte, from the register address left behind."""
        del force
        with os_errors(EREMOTEIO):
            return self._master.read(i2c_addr, 1)[0]

    def write_byte(self, i2c_addr: int, value: int, force: bool | None = None) -> None:
        """One byte, which the parts take for a register address."""
        del force
        self._write(i2c_addr, bytes((value,)))

    def read_byte_data(self, i2c_addr: int, register: int, force: bool | None = None) -> int:
        """One register."""
        del force
        return self._read(i2c_addr, register, 1)[0]

    def write_byte_data(self, i2c_addr: int, register: int, value: int, force: bool | None = None) -> None:
        """Write one register."""
        del force
        self._write(i2c_addr, bytes((register, value)))

    def read_word_data(self, i2c_addr: int, register: int, force: bool | None = None) -> int:
        """Two registers as an unsigned number, the first one the low byte."""
        del force
        return int.from_bytes(self._read(i2c_addr, register, 2), "little")

    def write_word_data(self, i2c_addr: int, register: int, value: int, force: bool | None = None) -> None:
        """Write two registers, the low byte first."""
        del force
        self._write(i2c_addr, bytes((register,)) + value.to_bytes(2, "little"))

    def read_i2c_block_data(
        self, i2c_addr: int, register: int, length: int, force: bool | None = None
    ) -> list[int]:
        """``length`` registers, at most 32."""
        del force
        if length > _BLOCK_MAX:
            raise ValueError(f"Desired block length over {_BLOCK_MAX} bytes")
        return list(self._read(i2c_addr, register, length))

    def write_i2c_block_data(
        self, i2c_addr: int, register: int, data: Sequence[int], force: bool | None = None
    ) -> None:
        """Write registers from ``register`` on, at most 32."""
        del force
        if len(data) > _BLOCK_MAX:
            raise ValueError(f"Data length cannot exceed {_BLOCK_MAX} bytes")
        self._write(i2c_addr, bytes((register, *data)))

    def i2c_rdwr(self, *i2c_msgs: I2CMessage) -> None:
        """Messages in order; those that read are filled. Raises InputError for flags other than I2C_M_RD."""
        for message in i2c_msgs:
            if message.flags & ~_READ:
                raise InputError(f"i2c_rdwr: flags {message.flags:#x} in a message; only I2C_M_RD is known")
        with os_errors(EREMOTEIO):
            written = b""
            for message, following in zip(i2c_msgs, (*i2c_msgs[1:], None), strict=True):
                if message.flags & _READ:
                    _fill(message, self._master.write_read(message.addr, written, message.len))
                    written = b""
                elif following and following.flags & _READ and following.addr == message.addr:
                    written = bytes(message)
                else:
                    self._master.write(message.addr, bytes(message))

    def _read(self, address: int, register: int, count: int) -> bytes:
        with os_errors(EREMOTEIO):
            return self._master.write_read(address, bytes((register,)), count)

    def _write(self, address: int, data: bytes) -> None:
        with os_errors(EREMOTEIO):
            self._master.write(address, data)


def _fill(message: I2CMessage, data: bytes) -> None:
    for index, value in enumerate(data):
        message.buf[index] = value
