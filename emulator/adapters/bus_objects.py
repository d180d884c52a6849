"""Bus objects of four I2C driver families, on a virtual board's I2C bus.

Decisions
    If a driver does not lock ``BusioI2C`` before use, it fails, as on a microcontroller.

    ``MachineI2C`` sends a stop even with ``stop=False``. ``i2c_rdwr`` of ``SMBus`` can combine only
    a write with the next read. Sensors keep the sub-address after a stop, so a driver gets the same
    bytes as after a repeated start.
"""

from __future__ import annotations

import errno
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from typing import TYPE_CHECKING, Any, ClassVar, Final, Protocol, Self, TypeAlias

from fcu_emulator.emulator.buses.i2c import I2CMaster
from fcu_emulator.emulator.errors import I2CError, I2CNackError, I2CStuckError, InputError

if TYPE_CHECKING:
    from typing_extensions import Buffer  # in collections.abc from Python 3.12 on


# -- common functions ---------------------------------------------------------------------------------------


# errno if no device acknowledges an address: ENODEV in CircuitPython and MicroPython, EREMOTEIO in Linux
# (i2c-bcm2835, Raspberry Pi). EREMOTEIO is written as a number, because Python defines the name only on Linux.
ENODEV: Final = errno.ENODEV
EREMOTEIO: Final = 121


@contextmanager
def os_errors(not_acknowledged: int) -> Iterator[None]:
    """Convert an I2CError to an OSError.

    The errno is ``not_acknowledged`` for a missing acknowledge, ETIMEDOUT for a stuck bus,
    otherwise EIO.
    """
    try:
        yield
    except I2CNackError as error:
        raise OSError(not_acknowledged, str(error)) from error
    except I2CStuckError as error:
        raise OSError(errno.ETIMEDOUT, str(error)) from error
    except I2CError as error:
        raise OSError(errno.EIO, str(error)) from error


_ADDRESSES = range(0x08, 0x78)  # the other addresses are reserved (NXP UM10204, Table 3)


def scan(master: I2CMaster) -> list[int]:
    """Return the 7-bit addresses that acknowledge empty writes. Raises I2CError."""
    found = []
    for address in _ADDRESSES:
        with suppress(I2CNackError):
            master.write(address, b"")
            found.append(address)
    return found


# -- CircuitPython ------------------------------------------------------------------------------------------


class BusioI2C:
    """Give ``BusioI2C(board.i2c2)`` to a CircuitPython driver instead of ``board.I2C()``.

    Addresses have 7 bits. Raises OSError(ENODEV) if no device answers, OSError(ETIMEDOUT) for a
    stuck bus, and RuntimeError if :meth:`try_lock` was not called.
    """

    def __init__(self, master: I2CMaster) -> None:
        self._master = master
        self._locked = False

    def try_lock(self) -> bool:
        taken, self._locked = self._locked, True
        return not taken

    def unlock(self) -> None:
        self._locked = False

    def deinit(self) -> None:
        """Do nothing: there are no pins."""

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *exc_info: object) -> None:
        self.deinit()

    def scan(self) -> list[int]:
        with self._transfer():
            return scan(self._master)

    def writeto(self, address: int, buffer: Buffer, *, start: int = 0, end: int | None = None) -> None:
        """Write a slice of ``buffer``. An empty slice only checks that the device answers."""
        with self._transfer():
            self._master.write(address, bytes(memoryview(buffer)[start:end]))

    def readfrom_into(self, address: int, buffer: Buffer, *, start: int = 0, end: int | None = None) -> None:
        target = memoryview(buffer)[start:end].cast("B")
        with self._transfer():
            target[:] = self._master.read(address, len(target))

    def writeto_then_readfrom(
        self,
        address: int,
        out_buffer: Buffer,
        in_buffer: Buffer,
        *,
        out_start: int = 0,
        out_end: int | None = None,
        in_start: int = 0,
        in_end: int | None = None,
    ) -> None:
        source = bytes(memoryview(out_buffer)[out_start:out_end])
        target = memoryview(in_buffer)[in_start:in_end].cast("B")
        with self._transfer():
            target[:] = self._master.write_read(address, source, len(target))

    @contextmanager
    def _transfer(self) -> Iterator[None]:
        if not self._locked:
            raise RuntimeError("Function requires lock")  # CircuitPython's message
        with os_errors(ENODEV):
            yield


# -- MicroPython --------------------------------------------------------------------------------------------


class MachineI2C:
    """Give ``MachineI2C(board.i2c2)`` to a MicroPython driver instead of ``machine.I2C(...)``.

    Device addresses have 7 bits. Memory addresses have ``addrsize`` bits and are big-endian. Raises
    OSError(ENODEV) if no device answers, OSError(ETIMEDOUT) for a stuck bus.
    """

    def __init__(self, master: I2CMaster) -> None:
        self._master = master

    def scan(self) -> list[int]:
        with os_errors(ENODEV):
            return scan(self._master)

    def writeto(self, addr: int, buf: Buffer, stop: bool = True) -> int:
        """Write ``buf`` and return the number of its bytes."""
        del stop
        data = bytes(buf)
        with os_errors(ENODEV):
            self._master.write(addr, data)
        return len(data)

    def readfrom(self, addr: int, nbytes: int, stop: bool = True) -> bytes:
        del stop
        with os_errors(ENODEV):
            return self._master.read(addr, nbytes)

    def readfrom_into(self, addr: int, buf: Buffer, stop: bool = True) -> None:
        target = memoryview(buf).cast("B")
        target[:] = self.readfrom(addr, len(target), stop)

    def writeto_mem(self, addr: int, memaddr: int, buf: Buffer, *, addrsize: int = 8) -> None:
        with os_errors(ENODEV):
            self._master.write(addr, memaddr.to_bytes(addrsize // 8, "big") + bytes(buf))

    def readfrom_mem(self, addr: int, memaddr: int, nbytes: int, *, addrsize: int = 8) -> bytes:
        with os_errors(ENODEV):
            return self._master.write_read(addr, memaddr.to_bytes(addrsize // 8, "big"), nbytes)

    def readfrom_mem_into(self, addr: int, memaddr: int, buf: Buffer, *, addrsize: int = 8) -> None:
        target = memoryview(buf).cast("B")
        target[:] = self.readfrom_mem(addr, memaddr, len(target), addrsize=addrsize)


# -- smbus2 -------------------------------------------------------------------------------------------------


_BLOCK_MAX = 32  # I2C_SMBUS_BLOCK_MAX
_READ = 0x0001  # I2C_M_RD


class I2CMessage(Protocol):
    """Interface of ``smbus2.i2c_msg``. ``buf`` points to ``len`` bytes. Iteration yields these bytes."""

    addr: int
    flags: int
    len: int
    buf: Any

    def __iter__(self) -> Iterator[int]: ...


class SMBus:
    """Give ``SMBus(board.i2c2)`` to a driver instead of ``smbus2.SMBus(1)``.

    Addresses have 7 bits. ``force`` is ignored. Raises OSError(EREMOTEIO) if no device answers,
    OSError(ETIMEDOUT) for a stuck bus, and ValueError for more than 32 bytes.
    """

    def __init__(self, master: I2CMaster) -> None:
        self._master = master

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *exc_info: object) -> None:
        self.close()

    def close(self) -> None:
        """Do nothing: there is no device file."""

    def write_quick(self, i2c_addr: int, force: bool | None = None) -> None:
        del force
        self._write(i2c_addr, b"")

    def read_byte(self, i2c_addr: int, force: bool | None = None) -> int:
        del force
        with os_errors(EREMOTEIO):
            return self._master.read(i2c_addr, 1)[0]

    def write_byte(self, i2c_addr: int, value: int, force: bool | None = None) -> None:
        del force
        self._write(i2c_addr, bytes((value,)))

    def read_byte_data(self, i2c_addr: int, register: int, force: bool | None = None) -> int:
        del force
        return self._read(i2c_addr, register, 1)[0]

    def write_byte_data(self, i2c_addr: int, register: int, value: int, force: bool | None = None) -> None:
        del force
        self._write(i2c_addr, bytes((register, value)))

    def read_word_data(self, i2c_addr: int, register: int, force: bool | None = None) -> int:
        del force
        return int.from_bytes(self._read(i2c_addr, register, 2), "little")

    def write_word_data(self, i2c_addr: int, register: int, value: int, force: bool | None = None) -> None:
        del force
        self._write(i2c_addr, bytes((register,)) + value.to_bytes(2, "little"))

    def read_i2c_block_data(
        self, i2c_addr: int, register: int, length: int, force: bool | None = None
    ) -> list[int]:
        """Read ``length`` registers, at most 32."""
        del force
        if length > _BLOCK_MAX:
            raise ValueError(f"Desired block length over {_BLOCK_MAX} bytes")
        return list(self._read(i2c_addr, register, length))

    def write_i2c_block_data(
        self, i2c_addr: int, register: int, data: Sequence[int], force: bool | None = None
    ) -> None:
        """Write at most 32 bytes, starting at ``register``."""
        del force
        if len(data) > _BLOCK_MAX:
            raise ValueError(f"Data length cannot exceed {_BLOCK_MAX} bytes")
        self._write(i2c_addr, bytes((register, *data)))

    def i2c_rdwr(self, *i2c_msgs: I2CMessage) -> None:
        """Transfer messages and fill read buffers. Raises InputError for all flags except I2C_M_RD."""
        for message in i2c_msgs:
            if message.flags & ~_READ:
                raise InputError(
                    f"i2c_rdwr: flags {message.flags:#x} in a message; only I2C_M_RD is known",
                    kind="unknown_flags",
                )
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


# -- Sensirion ----------------------------------------------------------------------------------------------


Answer: TypeAlias = tuple[int, Exception | None, bytes]


class SensirionI2C:
    """Give ``I2cConnection(SensirionI2C(board.i2c2, board.run_for))`` to a Sensirion channel.

    ``sleep(seconds)`` lets virtual time pass. If the status says that a transfer failed, the driver
    raises its own exception.
    """

    API_VERSION: ClassVar[int] = 1
    STATUS_OK: ClassVar[int] = 0
    STATUS_NACK: ClassVar[int] = 2
    STATUS_TIMEOUT: ClassVar[int] = 3
    STATUS_UNSPECIFIED_ERROR: ClassVar[int] = 4
    channel_count: ClassVar[None] = None  # a single channel
    description: ClassVar[str] = "an I2C bus of the virtual board"

    def __init__(self, master: I2CMaster, sleep: Callable[[float], None]) -> None:
        self._master = master
        self._sleep = sleep

    def transceive(
        self,
        slave_address: int,
        tx_data: bytes | None,
        rx_length: int | None,
        read_delay: float,
        timeout: float,
    ) -> Answer:
        """Write ``tx_data``, wait, and read ``rx_length`` bytes. Return status, error and bytes.

        ``tx_data=None`` omits the write, ``rx_length=None`` omits the wait and the read.
        ``timeout`` is ignored.
        """
        del timeout
        try:
            if tx_data is not None:
                self._master.write(slave_address, tx_data)
            if rx_length is None:
                return self.STATUS_OK, None, b""
            self._sleep(read_delay)
            return self.STATUS_OK, None, self._master.read(slave_address, rx_length)
        except I2CError as error:
            return self._status(error), error, b""

    def _status(self, error: I2CError) -> int:
        if isinstance(error, I2CNackError):
            return self.STATUS_NACK
        return self.STATUS_TIMEOUT if isinstance(error, I2CStuckError) else self.STATUS_UNSPECIFIED_ERROR
