"""The bus matrix: accesses of the core, of bit-band aliases and of DMA, brought to the blocks (RM0368
section 2).

``Window.read`` and ``Window.write`` run some hundred thousand times a second and are written for speed:
one table of pages, plain attributes, no call that is not needed.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from copy import copy
from itertools import pairwise

from emulator.arm.cpu import memory_map
from emulator.arm.cpu.absent import Absent
from emulator.arm.cpu.engine import RAM, RAM_SIZE
from emulator.arm.cpu.images import Images
from emulator.arm.cpu.memory_map import PAGE_SHIFT
from emulator.arm.cpu.native_engine import NativeEngine
from emulator.arm.cpu.slice import Slice
from emulator.arm.cpu.waiting import Waiting
from emulator.arm.peripherals.peripheral import ALREADY_PS, WORD, Peripheral
from emulator.arm.peripherals.rcc_gates import ENABLE
from emulator.arm.soc import Soc
from emulator.clock import NEVER_PS
from emulator.trace import DeviceNote

_MASK = {1: 0xFF, 2: 0xFFFF, 4: WORD}
_ENABLE_REGISTER = {0x30: "AHB1ENR", 0x34: "AHB2ENR", 0x40: "APB1ENR", 0x44: "APB2ENR"}
GATES = {
    name: f"{name.replace('_', '')}EN in RCC_{_ENABLE_REGISTER[register]}"
    for register, names in ENABLE.items()
    for name in names.values()
}
"""Where each block's clock is switched on, by its name."""


class Window:
    """A range of addresses with blocks in it; ``load`` and ``store`` take offsets from its first address."""

    def __init__(
        self, soc: Soc, run: Slice, waiting: Waiting, base: int, size: int, blocks: Iterable[Peripheral]
    ) -> None:
        self.base, self.size = base, size
        self._soc = soc
        self._slice = run
        self._timeline = run.timeline
        self._clock = run.clock
        self._nvic = run.nvic
        self._counter = run.counter
        self._waiting = waiting
        self._told: set[tuple[str, int]] = set()
        self._pages = _pages(soc, base, size, blocks)
        self._images: Images | None = None

    def pieces(self, images: Images) -> Iterator[Window]:
        """The same in pieces: each port that may be read from memory is one of its own."""
        self._images = images
        alone = {end - self.base for port in images.ports for end in (port.base, port.base + port.size)}
        for begin, end in pairwise(sorted({0, self.size, *(end for end in alone if 0 < end < self.size)})):
            piece = copy(self)
            piece.base, piece.size = self.base + begin, end - begin
            pages = self._pages[begin >> PAGE_SHIFT : end >> PAGE_SHIFT]
            piece._pages = [(block, start - begin, known) for block, start, known in pages]
            yield piece

    # -- the core's accesses ----------------------------------------------------------------------------

    def read(self, _engine: int, offset: int, size: int, _data: int) -> int:
        """The engine reads; nothing may be raised into it."""
        try:
            line = self._timeline
            begun = line.count + self._counter.value
            now_ps = line.origin_ps + ((begun - 1) * line.num + line.extra) // line.den
            value = self.look(now_ps, offset, size)
            until_ps = self._slice.until_ps
            if until_ps == ALREADY_PS:
                self._waiting.disturb()
            elif self._waiting.polled(begun, self.base + offset, now_ps, until_ps):
                self._slice.arrive()
                value = self.look(self._clock.now_ps, offset, size)
        except BaseException as error:
            self._slice.engine.keep_error(error)
            return 0
        return value

    def look(self, now_ps: int, offset: int, size: int) -> int:
        """The same for an engine that knows the time, and looks for loops by itself."""
        try:
            clock = self._clock
            clock.now_ps = now_ps
            if clock.next_ps <= now_ps:
                clock.advance_to(now_ps)
            block, start, known = self._pages[offset >> PAGE_SHIFT]
            register = offset - start & 0xFFFF_FFFC
            if block.clocked and register in known:
                value, self._slice.until_ps = block.look(register)
            else:
                value, self._slice.until_ps = self._look_in_vain(block, register)
            if clock.next_ps < self._slice.end_ps or self._nvic.changed:
                self._slice.end_in_time()
        except BaseException as error:
            self._slice.engine.keep_error(error)
            return 0
        return value if size == 4 else value >> 8 * (offset & 3) & _MASK[size]

    def _look_in_vain(self, block: Peripheral, register: int) -> tuple[int, int]:
        """A block without clock reads as 0 for as long as nobody does anything about it."""
        if block.clocked:
            return self._read_unknown(block, register), ALREADY_PS
        self._tell_clock(block, register, "read")
        return 0, NEVER_PS

    def write(self, _engine: int, offset: int, size: int, value: int, _data: int) -> None:
        """The engine writes; nothing may be raised into it."""
        try:
            if not self._waiting.comparing:
                self._waiting.disturb()
            self._slice.arrive()
            self.put(self._clock.now_ps, offset, size, value)
        except BaseException as error:
            self._slice.engine.keep_error(error)

    def put(self, now_ps: int, offset: int, size: int, value: int) -> None:
        """The same for an engine that knows the time, and has forgotten loops unless it compares."""
        try:
            if self._waiting.comparing and not self._changes_nothing(offset, size, value):
                self._waiting.disturb()
            clock = self._clock
            clock.now_ps = now_ps
            if clock.next_ps <= now_ps:
                clock.advance_to(now_ps)
            self.store(offset, size, value)
            if self._images is not None and self._images.shown:
                self._end_if_images_change(offset)
            if clock.next_ps < self._slice.end_ps or self._nvic.changed:
                self._slice.end_in_time()
        except BaseException as error:
            self._slice.engine.keep_error(error)

    def _end_if_images_change(self, offset: int) -> None:
        """A port may have lost its clock, or have been reset; a write to itself ends the run anyhow."""
        if self._pages[offset >> PAGE_SHIFT][0].name == "RCC":
            self._slice.engine.cut()

    def _changes_nothing(self, offset: int, size: int, value: int) -> bool:
        block, start, known = self._pages[offset >> PAGE_SHIFT]
        register = offset - start & 0xFFFF_FFFC
        shift = 8 * (offset & 3)
        usual = block.clocked and register in known
        return usual and block.changes_nothing(register, value << shift, _MASK[size] << shift)

    # -- anybody's accesses, now ------------------------------------------------------------------------

    def load(self, offset: int, size: int) -> int:
        """The value there, side effects included."""
        block, start, known = self._pages[offset >> PAGE_SHIFT]
        register = offset - start & 0xFFFF_FFFC
        if not block.clocked:
            self._tell_clock(block, register, "read")
            return 0
        if register not in known:
            return self._read_unknown(block, register)
        return block.read(register) >> 8 * (offset & 3) & _MASK[size]

    def store(self, offset: int, size: int, value: int) -> None:
        """Write ``size`` bytes there."""
        block, start, known = self._pages[offset >> PAGE_SHIFT]
        register = offset - start & 0xFFFF_FFFC
        shift = 8 * (offset & 3)
        if not block.clocked:
            self._tell_clock(block, register, "written")
            return
        if register not in known:
            self._tell_unknown(block, register, "written")
            return
        block.write(register, value << shift, _MASK[size] << shift)

    def peek(self, offset: int) -> int:
        """The word there without side effects, whether its clock runs or not."""
        block, start, known = self._pages[offset >> PAGE_SHIFT]
        register = offset - start & 0xFFFF_FFFC
        return block.peek(register) if register in known else 0

    def find(self, offset: int) -> tuple[Peripheral, int]:
        """The block there, and the register's offset in it."""
        block, start, _ = self._pages[offset >> PAGE_SHIFT]
        return block, offset - start & 0xFFFF_FFFC

    def _read_unknown(self, block: Peripheral, register: int) -> int:
        self._tell_unknown(block, register, "read")
        return 0

    # -- what firmware should know ----------------------------------------------------------------------

    def _tell_clock(self, block: Peripheral, register: int, what: str) -> None:
        if (f"{block.name} forbidden", register) in self._told:
            return  # a loop that polls comes here millions of times
        name = block.NAMES.get(register, f"offset 0x{register:02X}")
        text = f"{name} {what} while the block has no clock; set {GATES.get(block.name, 'its bit in RCC')}"
        self._tell(block, register, "forbidden", text)

    def _tell_unknown(self, block: Peripheral, register: int, what: str) -> None:
        text = f"offset 0x{register:02X} {what}; there is no such register"
        self._tell(block, register, "not modelled", text)

    def _tell(self, block: Peripheral, register: int, kind: str, text: str) -> None:
        key = f"{block.name} {kind}", register
        if key not in self._told:
            self._told.add(key)
            self._soc.trace.add(DeviceNote(self._clock.now_ps, block.name, kind, text))


_Page = tuple[Peripheral, int, "frozenset[int] | range"]


def _pages(soc: Soc, base: int, size: int, blocks: Iterable[Peripheral]) -> list[_Page]:
    """For each kilobyte its block, where the block begins, and which registers it has."""
    pages: list[_Page] = []
    by_address = {block.base: block for block in blocks if base <= block.base < base + size}
    for name, (first, length) in memory_map.BLOCKS.items():
        if base <= first < base + size and first not in by_address:
            by_address[first] = Absent(soc, name, first, length)
    reserved = Absent(soc, "reserved", base, size)
    pages = [(reserved, 0, range(size))] * (size >> PAGE_SHIFT)
    for first, block in by_address.items():
        registers = frozenset(block.REGISTERS) | frozenset(block.NAMES)
        page = block, first - base, registers or range(block.size)
        count = max(block.size >> PAGE_SHIFT, 1)
        at = first - base >> PAGE_SHIFT
        pages[at : at + count] = [page] * count
    return pages


class PeripheralBits:
    """The bit-band alias of the peripherals: a word for every bit (PM0214 2.2.5); writes read and modify."""

    def __init__(self, window: Window, run: Slice, waiting: Waiting) -> None:
        self._window = window
        self._slice = run
        self._waiting = waiting

    def read(self, _engine: int, offset: int, _size: int, _data: int) -> int:
        """The bit as 0 or 1."""
        try:
            self._waiting.disturb()
            self._slice.arrive()
            word, bit = _bit_place(offset)
            value = self._window.load(word, 4)
            self._slice.end_in_time()
            return value >> bit & 1
        except BaseException as error:
            self._slice.engine.keep_error(error)
            return 0

    def write(self, _engine: int, offset: int, _size: int, value: int, _data: int) -> None:
        """Set the bit to bit 0 of ``value``."""
        try:
            self._waiting.disturb()
            self._slice.arrive()
            word, bit = _bit_place(offset)
            old = self._window.load(word, 4)
            self._window.store(word, 4, old & ~(1 << bit) | (value & 1) << bit)
            self._slice.end_in_time()
        except BaseException as error:
            self._slice.engine.keep_error(error)


class RamBits:
    """The bit-band alias of the RAM."""

    def __init__(self, ram: memoryview[int], waiting: Waiting) -> None:
        self._ram = ram
        self._waiting = waiting

    def read(self, _engine: int, offset: int, _size: int, _data: int) -> int:
        """The bit as 0 or 1."""
        return self._ram[offset >> 5] >> (offset >> 2 & 7) & 1

    def write(self, _engine: int, offset: int, _size: int, value: int, _data: int) -> None:
        """Set the bit to bit 0 of ``value``."""
        self._waiting.disturb()
        bit = 1 << (offset >> 2 & 7)
        self._ram[offset >> 5] = self._ram[offset >> 5] & ~bit | (bit if value & 1 else 0)


def _bit_place(offset: int) -> tuple[int, int]:
    """The word's offset and the bit's number in it."""
    byte = offset >> 5
    return byte & ~3, (byte & 3) * 8 + (offset >> 2 & 7)


class Bus:
    """All of the address space outside of RAM and flash; and, for DMA and debuggers, those as well."""

    def __init__(self, soc: Soc, run: Slice, waiting: Waiting, blocks: Iterable[Peripheral]) -> None:
        engine = run.engine
        self._engine = engine
        blocks = tuple(blocks)
        ranges = (
            (memory_map.PERIPHERALS, memory_map.PERIPHERALS_SIZE),
            (memory_map.OTG, memory_map.OTG_SIZE),
            (memory_map.PRIVATE, memory_map.PRIVATE_SIZE),
        )
        self._windows = [Window(soc, run, waiting, base, size, blocks) for base, size in ranges]
        self.images = Images(engine, blocks)
        for window in self._windows:
            for piece in window.pieces(self.images):
                engine.map_callbacks(piece.base, piece.size, piece.read, piece.write)
                if isinstance(engine, NativeEngine):
                    engine.access_by(piece.base, piece.look, piece.put)
        bits = PeripheralBits(self._windows[0], run, waiting)
        size = 32 * memory_map.PERIPHERALS_SIZE
        engine.map_callbacks(memory_map.PERIPHERAL_BITS, size, bits.read, bits.write)
        ram_bits = RamBits(engine.ram, waiting)
        engine.map_callbacks(memory_map.RAM_BITS, 32 * RAM_SIZE, ram_bits.read, ram_bits.write)

    def read(self, address: int, size: int) -> bytes | None:
        """As the bus matrix answers DMA: memory, or a register with side effects; None is a bus error."""
        data = self.memory(address, size)
        if data is not None:
            return bytes(data)
        window = self._window(address, self._windows[:1])
        return None if window is None else window.load(address - window.base, size).to_bytes(size, "little")

    def write(self, address: int, data: bytes) -> bool:
        """Likewise; False is a bus error. The flash cannot be written this way."""
        if address >= RAM and address + len(data) <= RAM + RAM_SIZE:
            self._engine.ram[address - RAM : address - RAM + len(data)] = data
            return True
        window = self._window(address, self._windows[:1])
        if window is None:
            return False
        window.store(address - window.base, len(data), int.from_bytes(data, "little"))
        return True

    def poke(self, address: int, data: bytes) -> bool:
        """Write 1, 2 or 4 aligned bytes to a register with all effects; False if there is none."""
        window = self._window(address, self._windows)
        if window is not None:
            window.store(address - window.base, len(data), int.from_bytes(data, "little"))
        return window is not None

    def peek(self, address: int) -> int | None:
        """The word at an aligned address, without side effects; None where nothing answers."""
        data = self.memory(address, 4)
        if data is not None:
            return int.from_bytes(data, "little")
        window = self._window(address, self._windows)
        return None if window is None else window.peek(address - window.base)

    def find(self, address: int) -> tuple[Peripheral, int] | None:
        """The block at an address, and the register's offset in it; None where no block can be."""
        window = self._window(address, self._windows)
        return None if window is None else window.find(address - window.base)

    def memory(self, address: int, size: int) -> memoryview[int] | None:
        """``size`` bytes of RAM, flash or system memory; None elsewhere."""
        return self._engine.memory(address, size)

    @staticmethod
    def _window(address: int, windows: list[Window]) -> Window | None:
        for window in windows:
            if window.base <= address < window.base + window.size:
                return window
        return None
