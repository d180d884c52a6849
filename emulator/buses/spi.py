"""SPI with a chip select per sensor, and three or four wires.

The default is mode 3 at 42 MHz / 16, as in ST's firmware.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from typing import TypeAlias

from fcu_emulator.emulator.buses.i2c import checked_count, checked_data
from fcu_emulator.emulator.clock import PS_PER_S, Clock
from fcu_emulator.emulator.errors import InputError
from fcu_emulator.emulator.trace import BusTransfer, Trace
from fcu_emulator.sensors.declaration import Mode, Wires
from fcu_emulator.sensors.part import Sensor
from fcu_emulator.sensors.spi import READ, SpiTarget

USUAL_HZ = 2_625_000
_RECENT = 8

Message: TypeAlias = tuple[int, int, str, bytearray, bytearray]
"""A transfer: start and end in ps, chip select, bytes written, bytes read."""


class SpiBus:
    """One bus; ``end_ps`` is the end of the latest transfer."""

    def __init__(self, name: str, clock: Clock, trace: Trace, speed_hz: int = USUAL_HZ) -> None:
        self.name = name
        self.speed_hz = speed_hz
        self.is_enabled = True
        """Whether the SPI peripheral is enabled: False from the connection to a chip until firmware enables it."""
        self.mode: Mode = 3
        self.wires: Wires = 3
        self.end_ps = 0
        self.recent: deque[Message] = deque(maxlen=_RECENT)
        """Latest messages of a master that transfers single bytes."""
        self.unaddressed: deque[tuple[int, int | None]] = deque(maxlen=_RECENT)
        """Bytes transferred while no device was selected: (time in ps, byte sent, or None for a byte read)."""
        self.take_messages: Callable[[], None] = lambda: None
        """Function called before the lists are read, so that a master can add its recorded messages."""
        self._clock = clock
        self._trace = trace
        self._targets: dict[str, tuple[Sensor, SpiTarget]] = {}

    def attach(self, chip_select: str, part: Sensor) -> None:
        """Connect a sensor to a chip select (``"PA8"``)."""
        self._targets[chip_select] = part, SpiTarget(part, lambda: self._clock.now_ps)

    @property
    def chip_selects(self) -> tuple[str, ...]:
        return tuple(self._targets)

    def target(self, chip_select: str) -> SpiTarget:
        """Return the sensor's interface at a chip select."""
        return self._targets[chip_select][1]

    def transfer(self, chip_select: str, data: bytes, count: int = 0) -> bytes:
        """Select the device, write ``data``, read ``count`` bytes, and deselect it."""
        self._clock.inputs += 1
        target = self.target(chip_select)
        start_ps = self._clock.now_ps
        target.select()
        target.write(data, self.mode)
        received = target.read(count, self.mode, self.wires) if count else b""
        self.end_ps = start_ps + 8 * (len(data) + count) * PS_PER_S // self.speed_hz
        self.record(chip_select, start_ps, data, received)
        return received

    def record(self, chip_select: str, start_ps: int, written: bytes, received: bytes) -> None:
        if self._trace.detailed:
            self._trace.add_transfer(*self._fields(start_ps, self.end_ps, chip_select, written, received))

    def recent_transfers(self) -> list[BusTransfer]:
        """Return the messages of ``recent`` as trace events."""
        self.take_messages()
        return [
            BusTransfer(*self._fields(start_ps, end_ps, chip_select, bytes(written), bytes(received)))
            for start_ps, end_ps, chip_select, written, received in self.recent
        ]

    def _fields(
        self, start_ps: int, end_ps: int, chip_select: str, written: bytes, received: bytes
    ) -> tuple[int, int, str, int, str, str, bytes, bytes, str]:
        part, target = self._targets[chip_select]
        address = written[0] & ~READ if written else 0
        register = target.part.register_name(address)
        return start_ps, end_ps, self.name, address, part.NAME, register, written, received, "ok"


class SpiMaster:
    """Python as the master of an SPI bus: ``board.spi("SPI2")``."""

    def __init__(self, bus: SpiBus, run_until_ps: Callable[[int], None]) -> None:
        self.bus = bus
        """The bus, with its sensors and latest messages."""
        self._run_until = run_until_ps

    @property
    def speed_hz(self) -> int:
        """Clock rate; 0 while the SPI peripheral is disabled."""
        return self.bus.speed_hz if self.bus.is_enabled else 0

    def configure(self, mode: Mode, wires: Wires) -> None:
        """Set mode 0 to 3, and 3 or 4 wires."""
        if mode not in (0, 1, 2, 3) or wires not in (3, 4):
            raise InputError(
                f"SPI must have mode 0 to 3 and 3 or 4 wires, not mode {mode} with {wires} wires"
            )
        self.bus.mode, self.bus.wires = mode, wires

    def write(self, chip_select: str, data: bytes) -> None:
        """Select the device, send ``data``, and deselect it."""
        self.write_read(chip_select, data, 0)

    def write_read(self, chip_select: str, data: bytes, n: int) -> bytes:
        """Select the device, send ``data``, read ``n`` bytes, and deselect it. 0x80 is the read
        flag.
        """
        if chip_select not in self.bus.chip_selects:
            known = ", ".join(self.bus.chip_selects) or "none with this wiring"
            raise InputError(
                f"unknown chip select {chip_select!r}; known: {known}", kind="unknown_chip_select"
            )
        sent, count = checked_data(data), checked_count(n, 0)
        try:
            return self.bus.transfer(chip_select, sent, count)
        finally:
            self._run_until(self.bus.end_ps)
