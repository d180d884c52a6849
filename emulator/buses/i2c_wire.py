"""An I2C bus whose master makes a call after each byte."""

from __future__ import annotations

from typing import Literal, TypeAlias

from fcu_emulator.emulator.buses.i2c import ARBITRATION_LOST, BUS_ERROR, I2CBus, I2CTarget
from fcu_emulator.emulator.errors import I2CBusError, I2CError, I2CNackError

Answer: TypeAlias = Literal["ack", "nack", "bus_error", "arbitration"]


class I2CWire:
    """The byte-level interface of one bus."""

    def __init__(self, bus: I2CBus) -> None:
        self.bus = bus
        self._open = False  # a message has begun and has not been recorded
        self._start_ps = 0
        self._address = 0
        self._reading = False
        self._target: I2CTarget | None = None
        self._nack_at: int | None = None
        self._written = bytearray()
        self._received = bytearray()
        self._error: I2CError | None = None

    def held(self) -> bool:
        return self.bus.has_faults and self.released_ps() > self.bus.now_ps

    def released_ps(self) -> int:
        """Return the time at which faults release the lines."""
        now_ps = self.bus.now_ps
        faults = self.bus.faults(now_ps)
        return max((fault.until_ps for fault in faults if fault.kind == "stuck"), default=now_ps)

    def start(self, address: int, *, read: bool, start_ps: int) -> Answer:
        """Send a start at ``start_ps`` and the address byte, which ends now."""
        if self._open and self._address == address and read and not self._reading and self._error is None:
            self._reading = True
        else:
            self.finish(start_ps)
            self._open, self._start_ps, self._address, self._reading = True, start_ps, address, read
            self._written, self._received, self._error = bytearray(), bytearray(), None
            self._target = self.bus.target(address)
            self._nack_at = None
            if self.bus.has_faults and (broken := self._broken(read=read)):
                return broken
        if self._target is not None and self._target.start(read=read):
            return "ack"
        self._error = I2CNackError(self._address, 0)
        return "nack"

    def write_byte(self, value: int) -> bool:
        assert self._target is not None, "a byte after an unacknowledged address"
        self._written.append(value)
        index = len(self._written)
        if index == self._nack_at or not self._target.write(bytes((value,))):
            self._error = I2CNackError(self._address, index)
            return False
        return True

    def read_byte(self) -> int:
        assert self._target is not None, "a byte after an unacknowledged address"
        value = self._target.read(1)[0]
        self._received.append(value)
        return value

    def resume(self, address: int, start_ps: int, written: bytes, received: bytes, *, reading: bool) -> None:
        """Continue a message that C began. The device has already handled ``received``."""
        self._open, self._start_ps, self._address, self._reading = True, start_ps, address, reading
        self._written, self._received, self._error = bytearray(written), bytearray(received), None
        self._target = target = self.bus.target(address)
        self._nack_at = None
        assert target is not None, "a device has acknowledged its address"
        if written or not reading:
            target.start(read=False)
            target.write(written)
        if reading:
            target.start(read=True)

    def were_read(self, data: bytes) -> None:
        """Add bytes that the device has already handled."""
        self._received += data

    def stop(self) -> None:
        self.finish(self.bus.now_ps)

    def abort(self) -> None:
        if self._open and self._error is None:
            self._error = I2CError(self._address, "abandoned by the master without a stop")
        self.finish(self.bus.now_ps)

    def _broken(self, *, read: bool) -> Answer | None:
        for fault in self.bus.faults(self._start_ps):
            if fault.address not in (None, self._address):
                continue
            if fault.kind == "bus_error":
                self._error = I2CBusError(self._address, BUS_ERROR)
                return "bus_error"
            if fault.kind == "arbitration":
                self._error = I2CBusError(self._address, ARBITRATION_LOST)
                return "arbitration"
            if fault.kind == "absent" or (fault.kind == "nack" and (read or fault.byte_index == 0)):
                self._error = I2CNackError(self._address, 0)
                return "nack"
            if fault.kind == "nack":
                self._nack_at = fault.byte_index
        return None

    def finish(self, end_ps: int) -> None:
        if not self._open:
            return
        self._open = False
        if self._target is not None:
            self._target.stop()
        bus, error = self.bus, self._error
        bus.end_ps = end_ps
        bus.recent.append((self._start_ps, end_ps, self._address, self._written, self._received, error))
        if error is not None or bus.detailed:
            result = "ok" if error is None else str(error)
            bus.record(self._start_ps, self._address, bytes(self._written), bytes(self._received), result)
