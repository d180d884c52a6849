"""The devices at the chip's SPI peripherals.

The chip in C reads most registers of the sensors itself
(:mod:`fcu_emulator.sensors.shared_registers`), and passes other messages to Python.

The board's Bluetooth module is not modelled. The module's pins are SPI1 (PA5 to PA7), chip select PB0, reset
PB2 and interrupt PA4. The interrupt line is low, because a high level would keep the loop in
HCI_Isr of ST's firmware running.
"""

from __future__ import annotations

import ctypes
from array import array
from collections.abc import Callable
from typing import Any, Final, get_args

from fcu_emulator.emulator.boards.description import AbsentPart
from fcu_emulator.emulator.buses.gpio import Gpio, parse_pin
from fcu_emulator.emulator.buses.spi import SpiBus
from fcu_emulator.emulator.chip.library import PERIPHERAL_CLASSES, FcuChip, NativePeripheral
from fcu_emulator.emulator.chip.peripherals.gpio import PORTS
from fcu_emulator.emulator.chip.registers import spi
from fcu_emulator.emulator.chip.registers.declaration import masks, offsets
from fcu_emulator.emulator.trace import DeviceNote
from fcu_emulator.sensors.declaration import Mode, Wires
from fcu_emulator.sensors.spi import SpiTarget

(_CR1,) = offsets(spi.CR1)
(_MSTR,) = masks(spi.CR1.MSTR)
_FASTEST_HZ = 10_000_000  # SPI clock frequency in the three datasheets
_MODES: Final[tuple[Mode, ...]] = get_args(Mode)
_RECEIVED = 256  # SPI_RECEIVED of spi.h
_SENSORS = 4  # SPI_SENSORS

_i32, _i64 = ctypes.c_int32, ctypes.c_int64


class Spi(NativePeripheral):
    """One SPI. A master clocks a byte only if firmware or DMA asks for it (RM0368 20.3.3)."""

    def next_change_ps(self) -> int:
        at_ps: int = self._chip.library.fcu_spi_next_change(self._chip.handle, self.index)
        return at_ps

    def quiet_since_ps(self) -> int | None:
        if not self.peek(_CR1) & _MSTR:
            return None
        at_ps: int = self._chip.library.fcu_spi_active_ps(self._chip.handle, self.index)
        return at_ps


PERIPHERAL_CLASSES["SPI"] = Spi


class _CachedMessage(ctypes.Structure):
    """struct SpiMessage of spi.h."""

    _fields_ = (
        ("start_ps", _i64),
        ("end_ps", _i64),
        ("sensor", _i32),
        ("command", _i32),
        ("count", _i32),
        ("received", ctypes.c_uint8 * _RECEIVED),
    )
    start_ps: int
    end_ps: int
    sensor: int
    command: int
    count: int
    received: ctypes.Array[ctypes.c_uint8]

    def bytes_written(self) -> bytearray:
        return bytearray([self.command]) if self.command >= 0 else bytearray()

    def bytes_read(self) -> bytearray:
        return bytearray(self.received[: self.count])


class _Unaddressed(ctypes.Structure):
    """struct SpiUnaddressed of spi.h."""

    _fields_ = (("at_ps", _i64), ("byte", _i32))
    at_ps: int
    byte: int


class _Calls(ctypes.Structure):
    """struct SpiCalls of spi.h."""

    _fields_ = (
        ("configure", ctypes.CFUNCTYPE(None, _i64, _i32, _i32, _i32)),
        ("open", ctypes.CFUNCTYPE(_i32, _i64, ctypes.POINTER(_CachedMessage))),
        ("send", ctypes.CFUNCTYPE(None, _i64, _i32, _i32)),
        ("receive", ctypes.CFUNCTYPE(_i32, _i64, _i32, _i32)),
        ("close", ctypes.CFUNCTYPE(None, _i64, _i32)),
        ("ended", ctypes.CFUNCTYPE(None, _i64)),
    )


class _SpiDevice:
    """A sensor with its chip select and its current message."""

    def __init__(self, wire: SpiWire, chip_select: str, target: SpiTarget) -> None:
        self.chip_select = chip_select
        self.target = target
        self.part = target.part
        self.version: array[int] = target.version
        self.increment_bit = target.increment_bit
        self.start_ps = 0
        self.written = bytearray()
        self.received = bytearray()
        self._wire = wire

    @property
    def position(self) -> int:
        return self.target.position

    def shared_bank(self) -> int | None:
        return self.target.shared_bank(self._wire.mode, self._wire.wires)

    def move_to(self, address: int) -> None:
        self.target.move_to(address)


class SpiWire:
    """The bus of one of SPI1 to SPI3; ``gpio`` has the pins of the chip selects."""

    def __init__(self, chip: FcuChip, name: str, bus: SpiBus, gpio: Gpio) -> None:
        self._number = number = _number(name)
        self._chip, self._bus = chip, bus
        self._clock, self._trace = chip.clock, chip.trace
        self.mode: Mode = 3
        self.wires: Wires = 3
        """The host's clock mode, and the number of wires that it uses."""
        self._speed_hz = 0
        self._sensors = [_SpiDevice(self, name, bus.target(name)) for name in bus.chip_selects]
        called: tuple[Callable[..., Any], ...]
        called = self._configure, self._open, self._send, self._receive, self._close, self._ended
        table = _Calls(*(chip.callback(kind, called[n]) for n, (_, kind) in enumerate(_Calls._fields_)))
        chip.library.fcu_connect_spi(chip.handle, number, ctypes.byref(table))
        if len(self._sensors) > _SENSORS:
            raise ValueError(f"{bus.name} must have at most {_SENSORS} sensors, not {len(self._sensors)}")
        self._targets = [chip.targets.add(sensor) for sensor in self._sensors]
        for sensor, target in zip(self._sensors, self._targets, strict=True):
            port, pin = parse_pin(sensor.chip_select)
            gpio.frequent(port, pin)
            gpio.drive(port, pin, 1, by="pull-up of the part")
            chip.library.fcu_add_spi_sensor(chip.handle, number, PORTS.index(port), pin, target)
        bus.take_messages = self.take_messages
        bus.is_enabled = False

    def take_messages(self) -> None:
        """Pass on the chip's messages, and the bytes that were sent while no sensor was selected."""
        library, handle, bus = self._chip.library, self._chip.handle, self._bus
        message, unaddressed = _CachedMessage(), _Unaddressed()
        while library.fcu_take_spi_message(handle, self._number, ctypes.byref(message)):
            chip_select = self._sensors[message.sensor].chip_select
            written, received = message.bytes_written(), message.bytes_read()
            bus.recent.append((message.start_ps, message.end_ps, chip_select, written, received))
        while library.fcu_take_spi_unaddressed(handle, self._number, ctypes.byref(unaddressed)):
            bus.unaddressed.append((unaddressed.at_ps, None if unaddressed.byte < 0 else unaddressed.byte))

    # -- called by the chip -----------------------------------------------------------------------------

    def _configure(self, speed_hz: int, mode: int, wires: int) -> None:
        self.mode, self.wires = _MODES[mode], 3 if wires == 3 else 4
        self._bus.mode = self.mode
        if speed_hz > 0:  # the speed is 0 until SPE is set
            self._bus.is_enabled = True
        if speed_hz == self._speed_hz:
            return
        self._speed_hz = self._bus.speed_hz = speed_hz
        if speed_hz > _FASTEST_HZ:
            text = f"SCK runs at {speed_hz / 1e6:g} MHz; the sensors' limit is 10 MHz"
            self._trace.add(
                DeviceNote(
                    self._clock.now_ps,
                    self._bus.name,
                    "forbidden",
                    text,
                    "sck-too-fast",
                    {"sck_mhz": speed_hz / 1e6, "max_mhz": _FASTEST_HZ / 1e6},
                )
            )

    def _open(self, message: Any) -> bool:
        kept: _CachedMessage = message.contents
        sensor, target = self._sensors[kept.sensor], self._targets[kept.sensor]
        sensor.start_ps, sensor.written, sensor.received = (
            kept.start_ps,
            kept.bytes_written(),
            kept.bytes_read(),
        )
        if target >= 0 and not sensor.received:
            # take over the register address that an earlier message has left in C
            self._chip.targets.sync_position(target)
        sensor.target.select()
        sensor.target.write(bytes(sensor.written), self.mode)
        if target >= 0 and sensor.received:
            self._chip.targets.sync_position(target)
        return sensor.target.answers()

    def _send(self, number: int, byte: int) -> None:
        sensor = self._sensors[number]
        sensor.written.append(byte)
        sensor.target.write(bytes((byte,)), self.mode)

    def _receive(self, number: int, wires: int) -> int:
        sensor = self._sensors[number]
        (byte,) = sensor.target.read(1, self.mode, 3 if wires == 3 else 4)
        sensor.received.append(byte)
        return byte

    def _close(self, number: int) -> None:
        sensor = self._sensors[number]
        self.take_messages()  # earlier messages come first
        if sensor.written or sensor.received:
            now_ps = self._clock.now_ps
            self._bus.recent.append(
                (sensor.start_ps, now_ps, sensor.chip_select, sensor.written, sensor.received)
            )
            self._record()

    def _ended(self) -> None:
        self.take_messages()
        self._record()

    def _record(self) -> None:
        start_ps, self._bus.end_ps, chip_select, written, received = self._bus.recent[-1]
        self._bus.record(chip_select, start_ps, bytes(written), bytes(received))


def connect_absent_part(chip: FcuChip, part: AbsentPart, gpio: Gpio) -> None:
    """Connect a module that is not modelled. A note reports the first use of the module."""

    def tried() -> None:
        chip.trace.add(DeviceNote(chip.clock.now_ps, part.name, "not modelled", part.note, "absent-part"))

    port, pin = part.chip_select
    gpio.frequent(port, pin)
    for (held_port, held_pin), level in part.held.items():
        gpio.drive(held_port, held_pin, level, by=part.name)
    called = chip.callback(ctypes.CFUNCTYPE(None, _i64), tried)
    chip.library.fcu_add_absent_spi_device(chip.handle, _number(part.spi), PORTS.index(port), pin, called)


def _number(name: str) -> int:
    return int(name[-1]) - 1
