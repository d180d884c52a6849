"""Connection of an I2C peripheral in C to its bus."""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Iterator
from typing import Any, Final

from fcu_emulator.emulator.buses.i2c import I2CBus, Message
from fcu_emulator.emulator.buses.i2c_wire import Answer, I2CWire
from fcu_emulator.emulator.chip.library import FcuChip
from fcu_emulator.emulator.chip.peripherals.gpio import PinFunction
from fcu_emulator.sensors.part import SubaddressTarget

_i32, _i64 = ctypes.c_int32, ctypes.c_int64
_BYTES, _RECENT = 64, 8  # I2C_BYTES, I2C_RECENT
_ADDRESSES = 128
_ANSWERS: Final[tuple[Answer, ...]] = ("ack", "nack", "bus_error", "arbitration")  # enum Answer


class I2cTable(ctypes.Structure):
    """struct I2cCalls of i2c.h."""

    _fields_ = (
        ("start", ctypes.CFUNCTYPE(_i32, _i64, _i32, _i64)),
        ("write", ctypes.CFUNCTYPE(_i32, _i64, _i32)),
        ("read", ctypes.CFUNCTYPE(_i32, _i64)),
        ("stop", ctypes.CFUNCTYPE(None, _i64, _i64)),
        ("abort", ctypes.CFUNCTYPE(None, _i64)),
        ("ended", ctypes.CFUNCTYPE(None, _i64)),
        ("released_ps", ctypes.CFUNCTYPE(_i64, _i64)),
        ("set_speed", ctypes.CFUNCTYPE(None, _i64, _i64)),
    )


class _Message(ctypes.Structure):
    """struct I2cMessage."""

    _fields_ = (
        ("open", _i64),
        ("live", _i64),
        ("start_ps", _i64),
        ("end_ps", _i64),
        ("address", _i64),
        ("reading", _i64),
        ("target", _i64),
        ("written", _i64),
        ("subaddress", _i64),
        ("count", _i64),
        ("bytes", ctypes.c_uint8 * _BYTES),
    )

    def sent(self) -> bytes:
        return bytes((self.subaddress,)) if self.written else b""

    def received(self) -> bytes:
        return bytes(self.bytes[: self.count])


class _Wire(ctypes.Structure):
    """struct I2cWire."""

    _fields_ = (
        ("has_faults", _i64),
        ("ended", _i64),
        ("message", _Message),
        ("recent", _Message * _RECENT),
        ("target_index", ctypes.c_int8 * _ADDRESSES),
    )


I2C_NAMES = ("I2C1", "I2C2", "I2C3")


class ConnectedI2c:
    """Connects the peripheral to a bus while ``pins`` (SCL and SDA) are switched to the peripheral."""

    def __init__(self, chip: FcuChip, name: str, bus: I2CBus, pins: tuple[PinFunction, ...] = ()) -> None:
        self._bus, self._targets = bus, chip.targets
        self._wire = I2CWire(bus)
        number = int(name[-1]) - 1
        library, handle = chip.library, chip.handle
        called: tuple[Callable[..., Any], ...]
        called = self._start, self._write, self._read, self._stop, self._abort, self._ended
        called = *called, self._released_ps, bus.set_speed
        kinds = [kind for _, kind in I2cTable._fields_]
        table = I2cTable(*map(chip.callback, kinds, called))
        for n, (port, pin, function) in enumerate(pins):
            library.fcu_i2c_pin(handle, number, n, "ABCDEH".index(port), pin, function)
        self._shared = _Wire.from_address(library.fcu_i2c_wire(handle, number))
        library.fcu_connect_i2c(handle, number, ctypes.byref(table), bus.speed_hz, bus.shortest_ps)
        bus.when_changed.append(self._update)
        bus.elsewhere.append(self._recent)
        self._update()

    def _update(self) -> None:
        """Update the state in C after a change of faults or devices."""
        kept = {
            address: self._targets.add(target)
            for address, target in self._bus.targets.items()
            if isinstance(target, SubaddressTarget)
        }
        self._shared.has_faults = self._bus.has_faults
        self._shared.target_index[:] = [kept.get(address, -1) for address in range(_ADDRESSES)]

    # -- messages that C handled alone --------------------------------------------------------------------

    def _recent(self) -> Iterator[Message]:
        shared = self._shared
        for n in range(max(0, shared.ended - _RECENT), shared.ended):
            message = shared.recent[n % _RECENT]
            sent, received = bytearray(message.sent()), bytearray(message.received())
            yield message.start_ps, message.end_ps, message.address, sent, received, None

    def _ended(self) -> None:
        message = self._shared.recent[(self._shared.ended - 1) % _RECENT]
        self._bus.end_ps = message.end_ps
        self._bus.record(message.start_ps, message.address, message.sent(), message.received(), "ok")

    def _catch_up(self) -> None:
        message = self._shared.message
        if message.open:
            received = message.received()
            if not message.live:
                message.live = True
                reading, start_ps = bool(message.reading), message.start_ps
                self._wire.resume(message.address, start_ps, message.sent(), received, reading=reading)
            elif received:
                self._wire.were_read(received)
            message.count = 0
        if message.target >= 0:
            self._targets.sync_position(message.target)

    # -- bytes on the wire ----------------------------------------------------------------------------------

    def _start(self, byte: int, start_ps: int) -> int:
        self._catch_up()
        return _ANSWERS.index(self._wire.start(byte >> 1, read=bool(byte & 1), start_ps=start_ps))

    def _write(self, value: int) -> bool:
        self._catch_up()
        return self._wire.write_byte(value)

    def _read(self) -> int:
        self._catch_up()
        value = self._wire.read_byte()
        target = self._shared.message.target
        if target < 0 or self._bus.has_faults:
            return value
        return value | (1 + self._targets.position(target)) << 8

    def _stop(self, end_ps: int) -> None:
        self._catch_up()
        self._wire.finish(end_ps)

    def _abort(self) -> None:
        self._catch_up()
        self._wire.abort()

    def _released_ps(self) -> int:
        return self._wire.released_ps() if self._wire.held() else 0
