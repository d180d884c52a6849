"""The communication blocks on a real board's buses, driven register by register as firmware does.

A fake processor: each access to a register takes ``ACCESS_PS``, and before it all that is due has happened,
as the core guarantees. ``delays`` are extra picoseconds before accesses, as if an interrupt handler had run.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator

from emulator import Board
from emulator.arm.cpu import engines
from emulator.arm.cpu.native_bus import NativeBus
from emulator.arm.cpu.native_engine import NativeEngine
from emulator.arm.cpu.native_exceptions import nvic_of
from emulator.arm.cpu.timeline import CYCLES_PER_INSTRUCTION
from emulator.arm.peripherals.comm_blocks import CommBlocks
from emulator.arm.peripherals.peripheral import Peripheral
from emulator.arm.soc import Soc
from emulator.spi import SpiBus
from emulator.trace import DeviceNote
from emulator.wiring import PROFILES
from tests.arm.chip_fakes import FakeClockTree, FakeInterrupts

ACCESS_PS = 100_000  # a few instructions at 84 MHz
RAM = 0x2000_0000
SPI2_CHIP_SELECTS = PROFILES["fcu001v1"].spi2
PINS = [("A", 9, 7), ("B", 10, 4), ("B", 3, 9), ("B", 13, 5), ("B", 15, 5)]
"""What firmware has to switch over: USART1's TX, I2C2's SCL and SDA, SPI2's SCK and data (board facts 2)."""


class FakeMemory:
    """64 KiB of RAM, and the blocks by their base address."""

    def __init__(self, blocks: Iterable[Peripheral]) -> None:
        self.ram = bytearray(0x1_0000)
        self._blocks = {block.base: block for block in blocks}

    def read(self, address: int, size: int) -> bytes | None:
        if RAM <= address < RAM + len(self.ram):
            return bytes(self.ram[address - RAM : address - RAM + size])
        block = self._blocks.get(address & ~0x3FF)
        return None if block is None else block.read(address & 0x3FC).to_bytes(4, "little")[:size]

    def write(self, address: int, data: bytes) -> bool:
        if RAM <= address < RAM + len(self.ram):
            self.ram[address - RAM : address - RAM + len(data)] = data
            return True
        block = self._blocks.get(address & ~0x3FF)
        if block is None:
            return False
        block.write(address & 0x3FC, int.from_bytes(data, "little"), (1 << 8 * len(data)) - 1)
        return True


class CommBench:
    """USART1, I2C2, SPI2 and both DMA controllers of one board, pins switched, the sensors on both buses."""

    def __init__(self, delays: Iterable[int] = ()) -> None:
        self.board = board = Board(ideal=True)
        self.clock, self.trace, self.gpio = board.clock, board.trace, board.gpio
        self.clocks, self.irq = FakeClockTree(), FakeInterrupts(board.clock)
        soc = Soc(board.clock, board.trace, board.gpio, lambda reason: None)
        soc.clocks, soc.irq = self.clocks, self.irq
        for port, pin, function in PINS:
            board.gpio.set_alternate(port, pin, function)
        self.spi_bus = SpiBus("SPI2", board.clock, board.trace)
        for part in board.sensors.parts:
            self.spi_bus.attach(SPI2_CHIP_SELECTS[part.NAME], part)
        self.blocks = blocks = CommBlocks(soc, board.uart, board.bus, self.spi_bus)
        self.usart1, self.i2c2, self.spi2 = blocks.usart1, blocks.i2c2, blocks.spi2
        if engines.default() == engines.NATIVE:
            self._go_native()
        self.dma1, self.dma2 = blocks.dma1, blocks.dma2
        self.memory = FakeMemory(blocks)
        soc.memory = self.memory
        self._delays: Iterator[int] = iter(delays)

    def _go_native(self) -> None:
        """The I2C block's sequence in C, as beside the native engine; registers are reached as here."""
        native = NativeBus(NativeEngine())
        timeline = native.timeline(self.clocks.hclk_hz, CYCLES_PER_INSTRUCTION)
        self.i2c2.go_native(native, native.slice(timeline, self.clock, nvic_of(native)))

    def wait(self, duration_ps: int) -> None:
        """Firmware is busy elsewhere."""
        self.clock.advance_to(self.clock.now_ps + duration_ps)

    def read(self, block: Peripheral, offset: int) -> int:
        self.wait(ACCESS_PS + next(self._delays, 0))
        return block.read(offset)

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

    def notes(self) -> list[str]:
        return [note.text for note in self.trace.of(DeviceNote)]
