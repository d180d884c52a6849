"""A transceiver of ``sensirion-i2c-driver`` (interface ``I2cTransceiverV1``), on the virtual board's I2C2.

The driver's time between writing and reading passes here, on the board's clock: this is the one bus object
that is told to wait instead of being waited for.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import ClassVar, TypeAlias

from emulator.buses.i2c_master import I2CMaster
from emulator.errors import I2CError, I2CNackError, I2CStuckError

Answer: TypeAlias = tuple[int, Exception | None, bytes]


class SensirionI2C:
    """Give ``I2cConnection(SensirionI2C(board.i2c2, board.run_for))`` to a Sensirion driver's channel.

    ``sleep(seconds)`` lets virtual time pass. A failed transfer is a status, as the interface asks for; the
    driver makes its I2cNackError or I2cTimeoutError of it.
    """

    API_VERSION: ClassVar[int] = 1
    STATUS_OK: ClassVar[int] = 0
    STATUS_NACK: ClassVar[int] = 2
    STATUS_TIMEOUT: ClassVar[int] = 3
    STATUS_UNSPECIFIED_ERROR: ClassVar[int] = 4
    channel_count: ClassVar[None] = None  # a single channel
    description: ClassVar[str] = "virtual STEVAL-FCU001V1, I2C2"

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
        """Write ``tx_data`` unless None, wait, read ``rx_length`` bytes unless None: status, error, bytes.

        The parts do not stretch the clock, so ``timeout`` seconds never pass.
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
