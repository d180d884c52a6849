"""``busio.I2C`` of CircuitPython, on the virtual board's I2C2.

Shape and behaviour: CircuitPython's ``busio`` documentation. The bus has to be locked to be used, as on a
microcontroller (Blinka does not check that), so that a driver which forgets it is found out here.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Self

from emulator.adapters.os_errors import ENODEV, os_errors
from emulator.adapters.scan import scan
from emulator.buses.i2c_master import I2CMaster

if TYPE_CHECKING:
    from typing_extensions import Buffer  # in collections.abc from Python 3.12 on


class BusioI2C:
    """Give ``BusioI2C(board.i2c2)`` to a CircuitPython driver in place of ``board.I2C()``.

    Addresses have 7 bits; ``start`` and ``end`` select a slice of a buffer. A device that does not answer is
    OSError(ENODEV), a stuck bus OSError(ETIMEDOUT); a transfer without :meth:`try_lock` is a RuntimeError.
    """

    def __init__(self, master: I2CMaster) -> None:
        self._master = master
        self._locked = False

    def try_lock(self) -> bool:
        """Take the bus; False if it is taken."""
        taken, self._locked = self._locked, True
        return not taken

    def unlock(self) -> None:
        """Give the bus back."""
        self._locked = False

    def deinit(self) -> None:
        """Release the pins: nothing to do here."""

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *exc_info: object) -> None:
        self.deinit()

    def scan(self) -> list[int]:
        """Addresses at which a device answers."""
        with self._transfer():
            return scan(self._master)

    def writeto(self, address: int, buffer: Buffer, *, start: int = 0, end: int | None = None) -> None:
        """Write a slice of ``buffer``; of length 0 it only asks whether the device is there."""
        with self._transfer():
            self._master.write(address, bytes(memoryview(buffer)[start:end]))

    def readfrom_into(self, address: int, buffer: Buffer, *, start: int = 0, end: int | None = None) -> None:
        """Fill a slice of ``buffer``."""
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
        """Write a slice of ``out_buffer``, repeated start, fill a slice of ``in_buffer``."""
        source = bytes(memoryview(out_buffer)[out_start:out_end])
        target = memoryview(in_buffer)[in_start:in_end].cast("B")
        with self._transfer():
            target[:] = self._master.write_read(address, source, len(target))

    @contextmanager
    def _transfer(self) -> Iterator[None]:
        if not self._locked:
            raise RuntimeError("Function requires lock")  # CircuitPython's words
        with os_errors(ENODEV):
            yield
