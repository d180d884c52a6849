"""The communication peripherals on a real board's buses, used register by register as by firmware.

A fake processor accesses them. Each access takes ``ACCESS_PS``, and all events that are due happen before it, as with
the core. ``delays`` are extra picoseconds before accesses, as if an interrupt handler had run.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator

from fcu_emulator import Board
from fcu_emulator.emulator.boards.fcu001v1 import FCU001V1
from fcu_emulator.emulator.buses.spi import SpiBus
from fcu_emulator.emulator.chip.peripherals.i2c import ConnectedI2c
from fcu_emulator.emulator.chip.peripherals.peripheral import Peripheral
from fcu_emulator.emulator.chip.peripherals.spi import SpiWire, connect_absent_part
from fcu_emulator.emulator.trace import DeviceNote, NoteValue
from tests.support.arm.chip_fakes import FakeClockTree, FakeInterrupts, NativeChip

ACCESS_PS = 100_000  # a few instructions at 84 MHz
RAM = 0x2000_0000  # of which ``CommBench.ram`` is a view
SPI2_CHIP_SELECTS = FCU001V1.wiring("fcu001v1").chip_selects
PINS = [("B", 10, 4), ("B", 3, 9), ("B", 13, 5), ("B", 15, 5)]
"""Pins that firmware must set to alternate functions: I2C2's SCL and SDA, SPI2's SCK and data."""


class FakeProcessor:
    """Accesses to the peripherals of ``chip``, each a few instructions after the previous one."""

    def __init__(self, chip: NativeChip, irq: FakeInterrupts, delays: Iterable[int]) -> None:
        self.chip, self.irq = chip, irq
        self._delays: Iterator[int] = iter(delays)

    def wait(self, duration_ps: int) -> None:
        """Let time pass while firmware does other work."""
        self.chip.run_for(duration_ps)

    def read(self, block: Peripheral, offset: int) -> int:
        """Return the word that firmware reads; a debugger must see the same word just before."""
        self.wait(ACCESS_PS + next(self._delays, 0))
        seen = block.peek(offset)
        value = block.read(offset)
        assert value == seen, f"{block.name}_{block.NAMES[offset]}"
        return value

    def write(self, block: Peripheral, offset: int, value: int, mask: int = 0xFFFF_FFFF) -> None:
        self.wait(ACCESS_PS + next(self._delays, 0))
        block.write(offset, value, mask)

    def modify(self, block: Peripheral, offset: int, set_bits: int = 0, clear: int = 0) -> None:
        """Read, change, write back: ``REG |= set_bits``, ``REG &= ~clear``."""
        self.write(block, offset, self.read(block, offset) & ~clear | set_bits)

    def poll(self, block: Peripheral, offset: int, bits: int, limit: int = 100_000) -> int:
        """Wait until one of ``bits`` is set."""
        for _ in range(limit):
            value = self.read(block, offset)
            if value & bits:
                return value
        raise AssertionError(f"{block.name}: bits {bits:#x} of {block.NAMES[offset]} never came")

    def poll_clear(self, block: Peripheral, offset: int, bits: int, limit: int = 100_000) -> None:
        """Wait until none of ``bits`` is set."""
        for _ in range(limit):
            if not self.read(block, offset) & bits:
                return
        raise AssertionError(f"{block.name}: bits {bits:#x} of {block.NAMES[offset]} stayed set")

    def serve(self, number: int, handler: Callable[[], None], until: Callable[[], bool]) -> None:
        """Run the interrupt handler whenever its line is active, until ``until()``."""
        for _ in range(1_000_000):
            if until():
                return
            self.wait(ACCESS_PS)
            if self.irq.level(number):
                handler()
        raise AssertionError(f"interrupt {number} has not finished")


class CommBench(FakeProcessor):
    """I2C2, SPI2 and both DMA controllers of one board, with their pins set up, and the sensors on both buses."""

    def __init__(self, delays: Iterable[int] = ()) -> None:
        self.board = board = Board(ideal=True)
        self.clock, self.trace = board.clock, board.trace
        self.clocks, irq = FakeClockTree(), FakeInterrupts(board.clock)
        self.spi_bus = SpiBus("SPI2", board.clock, board.trace)
        for part in board.sensors.parts:
            self.spi_bus.attach(SPI2_CHIP_SELECTS[part.NAME], part)
        chip = NativeChip(board.clock, board.trace, self.clocks, irq)
        super().__init__(chip, irq, delays)
        self.ram = chip.fcu.ram
        self.i2c2, self.spi1, self.spi2 = chip["I2C2"], chip["SPI1"], chip["SPI2"]
        self.dma1 = chip["DMA1"]
        ConnectedI2c(chip.fcu, "I2C2", board.i2c2.bus, (("B", 10, 4), ("B", 3, 9)))
        SpiWire(chip.fcu, "SPI2", self.spi_bus, chip.gpio)
        connect_absent_part(chip.fcu, FCU001V1.absent[0], chip.gpio)
        for port, pin, function in PINS:
            chip.fcu.set_alternate(port, pin, function)

    @property
    def next_ps(self) -> int:
        """Return the time of the earliest event of the chip or of the clock."""
        return self.chip.next_ps

    def notes(self) -> list[str]:
        """Return kind and text of every note so far, such as ``forbidden: TRISE is 2; ...``."""
        return [f"{note.what}: {note.text}" for note in self.trace.of(DeviceNote)]

    def problems(self) -> dict[str, dict[str, NoteValue]]:
        """Return the values of each problem that was noted, by its name."""
        return {note.problem: dict(note.data) for note in self.trace.of(DeviceNote)}
