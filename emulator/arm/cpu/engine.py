"""What executes instructions: a Cortex-M4F with its memory, without exceptions and without time.

There are two. :mod:`native_engine` is written for this board, in C, and is used where it has been built;
:mod:`unicorn_engine` is QEMU's translator, runs everywhere, and is the reference which the other one is
compared with. What is said here holds for both, to the instruction.

Decision: two engines. Unicorn alone runs the lab's firmware at half of real time: it counts instructions by a
hook in each of them, calls Python at each access to a register, and brings the core's state over one register
at a time. The native one does it ten times as fast, at the price that waiting, the usual exceptions and the
I2C block's sequence exist twice, in Python and in C; the tests run on both. The road not taken, the native
engine alone, would leave those without a C compiler with nothing, and ourselves without a witness.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable

from emulator.arm.cpu.counter import Cell
from emulator.arm.cpu.registers import CORE, FLOATING_POINT, MASKS, RegisterCalls, Registers
from emulator.arm.cpu.stop import Stop
from emulator.arm.image import memory_map

FLASH, FLASH_SIZE = memory_map.FLASH.start, memory_map.FLASH.end - memory_map.FLASH.start
RAM, RAM_SIZE = memory_map.RAM.start, memory_map.RAM.end - memory_map.RAM.start
SYSTEM_MEMORY, SYSTEM_MEMORY_SIZE = 0x1FFF_0000, 0x1_0000

ReadCallback = Callable[[int, int, int, int], int]
"""Called with (engine, offset in the window, size, 0)."""
WriteCallback = Callable[[int, int, int, int, int], None]
"""Called with (engine, offset in the window, size, value, 0)."""

_EXECUTE_NEVER = 1 << 2 | 1 << 5 | 1 << 6 | 1 << 7  # by 512 MB: what ARMv7-M ARM table B3-1 marks XN
_PC = 15


def fetch_fault(address: int) -> Stop:
    """Why nothing can be executed at an address without memory."""
    return Stop.EXECUTE_NEVER if _EXECUTE_NEVER >> (address >> 29) & 1 else Stop.FETCH


class Engine(ABC):
    """A Cortex-M4F in front of its first instruction.

    While it runs, ``counter`` counts the instructions begun, the one in flight included, and ``limit`` is
    the last one to be executed; both may be looked at in callbacks, and ``limit`` set. An IT block is
    executed as a whole: a run never ends inside one, but may end up to four instructions late.
    """

    counter: Cell
    limit: Cell
    flash: memoryview[int]
    ram: memoryview[int]

    def __init__(self) -> None:
        self.pc, self.thumb = 0, True
        self.running = False
        self.when_ram_is_executed: list[Callable[[], None]] = []
        """Called between runs in front of the first instruction in RAM."""
        self.executed = 0
        """Instructions of the latest run, one that has met a fault included."""
        self.fault_address = 0
        self._stop = Stop.SLICE
        self._error: BaseException | None = None
        self._memories: tuple[tuple[int, memoryview[int]], ...] = ()
        self._places: frozenset[int] = frozenset()
        self._stored: list[memoryview[int]] = []  # pages of RAM ever stored to, in one piece where they touch

    def _prepare_registers(self) -> None:
        self._core = Registers(self, CORE)
        self._whole = Registers(self, (*CORE, *MASKS, *FLOATING_POINT))
        self._fetch_whole, self._bytes_of_whole = self._whole.fetch, self._whole.words.tobytes

    # -- memory -----------------------------------------------------------------------------------------

    def memory(self, address: int, size: int) -> memoryview[int] | None:
        """``size`` bytes of RAM, flash (at 0 too) or system memory; None elsewhere."""
        for base, content in self._memories:
            offset = address - base
            if 0 <= offset <= len(content) - size:
                return content[offset : offset + size]
        return None

    @abstractmethod
    def map_callbacks(self, base: int, size: int, read: ReadCallback, write: WriteCallback) -> None:
        """Accesses to a window of the address space call ``read`` and ``write``, which must not raise."""

    @abstractmethod
    def show_image(self, base: int, image: memoryview[int]) -> None:
        """Reads of the window at ``base`` come from ``image``, writes call as ever and end the run.

        A write may leave its value in ``image``. Between runs, as is the end of it.
        """

    @abstractmethod
    def hide_image(self, base: int) -> None:
        """Reads call again."""

    @abstractmethod
    def forget_code(self) -> None:
        """The contents of flash or RAM were changed from outside: translate again what is executed there."""

    # -- running ----------------------------------------------------------------------------------------

    @abstractmethod
    def run(self, instructions: int) -> Stop:
        """Execute up to so many instructions from ``pc`` on: why it ended. ``executed`` is their number.

        What a callback raised is raised here, when the instruction has been completed.
        """

    @abstractmethod
    def run_past(self) -> Stop:
        """Execute one instruction, although it is a place to stop in front of."""

    @abstractmethod
    def stop_in_front_of(self, places: frozenset[int]) -> None:
        """Runs end with PLACE in front of these instructions; between runs."""

    def cut(self) -> None:
        """In a callback: end the run behind the instruction in flight."""
        self.limit.value = self.counter.value

    def keep_error(self, error: BaseException) -> None:
        """In a callback: end the run and raise ``error`` there; C cannot pass it on."""
        self._error = self._error or error
        self.cut()

    def _raise_error(self) -> None:
        if self._error is not None:
            error, self._error = self._error, None
            raise error

    @abstractmethod
    def refuse(self, reason: Stop) -> None:
        """In a watch: end the run in front of the instruction; inside of an IT block, behind the block."""

    # -- state ------------------------------------------------------------------------------------------

    @abstractmethod
    def register_calls(self, names: tuple[str, ...]) -> RegisterCalls:
        """How to read and write some registers."""

    def whole_state(self) -> tuple[bytes, list[bytes]]:
        """All registers, and all of RAM that was ever stored to; between runs or in a callback."""
        if self.running:
            return self.state_in_callback()
        words = self._whole.read()
        words[_PC] = self.pc
        return words.tobytes(), [part.tobytes() for part in self._stored]

    def state_in_callback(self) -> tuple[bytes, list[bytes]]:
        """The same, in a callback only."""
        self._fetch_whole()
        return self._bytes_of_whole(), [part.tobytes() for part in self._stored]

    def register(self, number: int) -> int:
        """R0 to R15, in a callback or between runs."""
        return self._core.read()[number]

    def state_at(self, address: int) -> bytes:
        """R0 to R12, SP, LR, PC and xPSR, between runs, where execution will go on at ``address``."""
        words = self._core.read()
        words[_PC] = address
        return words.tobytes()

    # -- hooks ------------------------------------------------------------------------------------------

    @abstractmethod
    def watch(self, begin: int, end: int, called: Callable[[int], None]) -> int:
        """Call ``called(address)`` in front of every instruction of a range; gives a handle."""

    @abstractmethod
    def watch_memory(self, begin: int, end: int, called: Callable[[int, int, bool], None]) -> int:
        """Call ``called(address, size, is_write)`` at every load and store that begins in a range, registers
        included; gives a handle. All loads and stores are slower as long as there is one.
        """

    @abstractmethod
    def unwatch(self, handle: int) -> None:
        """No more calls; between runs."""
