"""The chip in C (emulator/chip/native), called through ctypes; ``fcu.h`` documents each function.

Decision: the structures are declared again for ctypes, and a test compares both declarations with
the help of the compiler. A callback takes 220 ns with ctypes and 440 ns with cffi in ABI mode.
"""

from __future__ import annotations

import ctypes
import weakref
from collections.abc import Callable
from functools import cache, partial
from typing import Any, Final

from fcu_emulator.emulator.chip.cpu.core_registers import (
    CORE,
    FLOATING_POINT,
    MASKS,
    CoreRegisters,
    RegisterCalls,
)
from fcu_emulator.emulator.chip.memory_map import (
    ADDRESSES,
    FLASH,
    FLASH_SIZE,
    RAM,
    RAM_SIZE,
    SYSTEM_MEMORY,
    SYSTEM_MEMORY_SIZE,
)
from fcu_emulator.emulator.chip.native import loader
from fcu_emulator.emulator.chip.peripherals.peripheral import WORD, ClockTree, Peripheral
from fcu_emulator.emulator.chip.registers import names_of
from fcu_emulator.emulator.chip.sensor_registers import Targets, TargetTable
from fcu_emulator.emulator.clock import Clock
from fcu_emulator.emulator.trace import DeviceNote, NoteValue, Trace

_i32, _u32, _i64, _pointer = ctypes.c_int32, ctypes.c_uint32, ctypes.c_int64, ctypes.c_void_p
_u64 = ctypes.c_uint64

WORK_OF_A_CALL: Final = 2_000
"""Work of a call from C into Python, in units of work.h."""


def split_note(text: str) -> tuple[str, dict[str, NoteValue], str]:
    """Split a note such as "scl-too-fast scl_khz=800 | SCL runs at 800 kHz" into problem, values
    and text.
    """
    head, _, words = text.partition(" | ")
    problem, *values = head.split()
    return problem, {name: _number(value) for name, value in (one.split("=", 1) for one in values)}, words


def _number(text: str) -> NoteValue:
    for read in int, float:
        try:
            return read(text)
        except ValueError:
            pass
    return text


DEEP_REFUSED, DEEP_WITH_CLOCKS, DEEP_STANDBY = -1, -2, -3
"""enum DeepSleep of run_loop.h."""
NOTE_KINDS: Final = ("forbidden", "not modelled", "refused")
"""In the order of enum NoteKind in peripheral.h."""
PERIPHERAL_CLASSES: Final[dict[str, type[NativePeripheral]]] = {}
"""Classes with more functions than :class:`NativePeripheral`, by the peripheral's name without its number."""


IRQ_CHANGED: Final = ctypes.CFUNCTYPE(None, _i64, _i32, _i32)
PIN_CHANGED: Final = ctypes.CFUNCTYPE(None, _i64, _i32, _i32, _i32)


_HOST_CALLS: Final[tuple[tuple[str, Any], ...]] = (
    ("advance", ctypes.CFUNCTYPE(None, _i64)),
    ("read", ctypes.CFUNCTYPE(_u32, _i64, _u32, _u32)),
    ("write", ctypes.CFUNCTYPE(None, _i64, _u32, _u32, _u32)),
    ("note", ctypes.CFUNCTYPE(None, _i64, _i32, _i32, ctypes.c_char_p)),
    ("ignored_access", ctypes.CFUNCTYPE(_i32, _i64, _i32, _u32, _i32, _u32)),
    ("fault", ctypes.CFUNCTYPE(None, _i64, _i32, _u32, _u32, _u32)),
    ("locked_up", ctypes.CFUNCTYPE(None, _i64, _u32)),
    ("reset", ctypes.CFUNCTYPE(None, _i64, _i32)),
    ("accessed", ctypes.CFUNCTYPE(None, _i64, _u32, _u32, _i32)),
    ("deep_sleep", ctypes.CFUNCTYPE(_i64, _i64)),
    ("stop_ended", ctypes.CFUNCTYPE(None, _i64)),
)


class HostTable(ctypes.Structure):
    """struct Host of chip.h."""

    _fields_ = _HOST_CALLS


class PinTable(ctypes.Structure):
    """struct PinCalls of gpio.h."""

    _fields_ = (("edge", PIN_CHANGED), ("changed", PIN_CHANGED))


class ClocksTable(ctypes.Structure):
    """struct Clocks of chip.h."""

    _fields_ = tuple(
        (f"{name}_hz", _i64)
        for name in ("sysclk", "hclk", "pclk1", "pclk2", "timer1", "timer2", "nominal_pclk1", "lsi", "lse")
    )


class ChipStatus(ctypes.Structure):
    """struct Status of fcu.h."""

    now_ps: int
    retired: int
    skipped: int
    accesses: int
    thread_ps: int
    switched_ps: int
    execution_priority: int
    lowest_msp: int
    locked_up: int
    locked_up_pc: int
    asleep: int
    thread_frame: int

    _fields_ = (
        *((name, _i64) for name in ("now_ps", "retired", "skipped", "accesses", "thread_ps", "switched_ps")),
        *((name, ctypes.c_uint64 * 2) for name in ("pending", "enabled", "active")),
        ("execution_priority", _i64),
        *((name, _u32) for name in ("lowest_msp", "locked_up", "locked_up_pc", "asleep", "thread_frame")),
    )


class Costliest(ctypes.Structure):
    """struct Costliest of fcu.h."""

    times: int
    kind: int
    index: int

    _fields_ = (("times", _i64), ("kind", _i32), ("index", _i32))


_numbers, _words = ctypes.POINTER(_i32), ctypes.POINTER(_u32)

_FUNCTIONS: Final[dict[str, tuple[Any, ...]]] = {
    "fcu_create": (_pointer, ctypes.POINTER(HostTable)),
    "fcu_destroy": (None, _pointer),
    "fcu_flash": (_pointer, _pointer),
    "fcu_ram": (_pointer, _pointer),
    "fcu_system_memory": (_pointer, _pointer),
    "fcu_invalidate_code": (None, _pointer),
    "fcu_flash_programmed": (None, _pointer, _u32, _u32),
    "fcu_read_registers": (None, _pointer, _numbers, _words, _i32),
    "fcu_write_registers": (None, _pointer, _numbers, _words, _i32),
    "fcu_thumb": (_i32, _pointer),
    "fcu_set_thumb": (None, _pointer, _i32),
    "fcu_configure": (None, _pointer, _i64, _i64, _i32),
    "fcu_start": (None, _pointer),
    "fcu_run_until": (_i32, _pointer, _i64),
    "fcu_execute": (_i32, _pointer, _i64, _i32),
    "fcu_end_run": (None, _pointer),
    "fcu_enter_exception": (_i32, _pointer, _i32, _u32),
    "fcu_is_pure": (_i32, _pointer, _i32, _u32),
    "fcu_executed": (_i64, _pointer),
    "fcu_fault_address": (_u32, _pointer),
    "fcu_request_reset": (None, _pointer, _i32),
    "fcu_reset_now": (None, _pointer, _i32),
    "fcu_halt": (None, _pointer),
    "fcu_resume": (None, _pointer, _i32),
    "fcu_is_halted": (_i32, _pointer),
    "fcu_wake": (None, _pointer),
    "fcu_debug": (None, _pointer, _i32),
    "fcu_halted_on_bkpt": (_i32, _pointer),
    "fcu_set_breakpoint": (None, _pointer, _u32, _i32),
    "fcu_watch_memory": (None, _pointer, _i32, _u32, _u32),
    "fcu_log_values": (None, _pointer, _pointer),
    "fcu_watch_values": (None, _pointer, _u32, _u32, _i32),
    "fcu_status": (None, _pointer, ctypes.POINTER(ChipStatus)),
    "fcu_costliest": (None, _pointer, ctypes.POINTER(Costliest)),
    "fcu_priority": (_i32, _pointer, _i32),
    "fcu_priority_group": (_i32, _pointer, _i32),
    "fcu_execution_priority": (_i32, _pointer, _i32, _i32, _i32),
    "fcu_load": (_i32, _pointer, _u32, _u32, _words),
    "fcu_store": (_i32, _pointer, _u32, _u32, _u32),
    "fcu_peripheral_at": (_i32, _pointer, _u32),
    "fcu_snapshot_size": (_i64,),
    "fcu_save": (None, _pointer, _pointer),
    "fcu_restore": (None, _pointer, _pointer),
    "fcu_advance": (None, _pointer, _i64),
    "fcu_settle": (None, _pointer),
    "fcu_next_event": (_i64, _pointer),
    "fcu_set_clocks": (None, _pointer, ctypes.POINTER(ClocksTable)),
    "fcu_peripheral_count": (_i32, _pointer),
    "fcu_peripheral_base": (_u32, _pointer, _i32),
    "fcu_gate_python": (None, _pointer, _u32, _i32),
    "fcu_gate": (None, _pointer, _u64, _u64),
    "fcu_is_clocked": (_i32, _pointer, _i32),
    "fcu_reset_peripherals": (None, _pointer, _u64),
    "fcu_read_peripheral": (_u32, _pointer, _i32, _u32),
    "fcu_peek_peripheral": (_u32, _pointer, _i32, _u32),
    "fcu_write_peripheral": (None, _pointer, _i32, _u32, _u32, _u32),
    "fcu_set_irq": (None, _pointer, _i32, _i32),
    "fcu_irq_level": (_i32, _pointer, _i32),
    "fcu_watch_irqs": (None, _pointer, IRQ_CHANGED),
    "fcu_set_alternate": (None, _pointer, _i32, _i32, _i32),
    "fcu_connect_timers": (None, _pointer, _pointer),
    "fcu_timer_counts": (_pointer, _pointer, _i32),
    "fcu_timer_rate": (ctypes.c_double, _pointer, _i32),
    "fcu_timer_next_change": (_i64, _pointer, _i32),
    "fcu_timer_pwm": (_i32, _pointer, _i32, _i32, _pointer, _pointer),
    "fcu_connect_usarts": (None, _pointer, _pointer),
    "fcu_usart_wire": (None, _pointer, _i32, _i32, _i32, _i32, _i32),
    "fcu_usart_flush": (None, _pointer, _i32),
    "fcu_usart_frame": (_i32, _pointer, _i32, _pointer, _pointer),
    "fcu_spi_next_change": (_i64, _pointer, _i32),
    "fcu_spi_active_ps": (_i64, _pointer, _i32),
    "fcu_usart_next_change": (_i64, _pointer, _i32),
    "fcu_usart_receive": (_i32, _pointer, _i32, _i32),
    "fcu_usart_line_idle": (None, _pointer, _i32),
    "fcu_connect_adc": (_pointer, _pointer, _pointer),
    "fcu_dma_request": (_i32, _pointer, _i32),
    "fcu_dma_remaining": (_u32, _pointer, _i32),
    "fcu_connect_pins": (None, _pointer, ctypes.POINTER(PinTable)),
    "fcu_pending_edges": (_i64, _pointer),
    "fcu_take_edges": (_i64, _pointer, _pointer, _i64, ctypes.POINTER(_i64)),
    "fcu_watch_pin": (None, _pointer, _i32, _i32),
    "fcu_frequent_pin": (None, _pointer, _i32, _i32),
    "fcu_drive_pin": (None, _pointer, _i32, _i32, _i32),
    "fcu_pin_output": (_i32, _pointer, _i32, _i32),
    "fcu_pin_pull": (_i32, _pointer, _i32, _i32),
    "fcu_pin_alternate": (_i32, _pointer, _i32, _i32),
    "fcu_set_exti_line": (None, _pointer, _i32, _i32),
    "fcu_connect_spi": (None, _pointer, _i32, _pointer),
    "fcu_add_spi_sensor": (None, _pointer, _i32, _i32, _i32, _i32),
    "fcu_add_absent_spi_device": (None, _pointer, _i32, _i32, _i32, _pointer),
    "fcu_take_spi_message": (_i32, _pointer, _i32, _pointer),
    "fcu_take_spi_unaddressed": (_i32, _pointer, _i32, _pointer),
    "fcu_connect_targets": (_pointer, _pointer, ctypes.POINTER(TargetTable)),
    "fcu_add_target": (_i32, _pointer, _pointer, _i32),
    "fcu_connect_i2c": (None, _pointer, _i32, _pointer, _i64, _i64),
    "fcu_i2c_pin": (None, _pointer, _i32, _i32, _i32, _i32, _i32),
    "fcu_i2c_wire": (_pointer, _pointer, _i32),
}
"""Types of the result and the arguments of each function in fcu.h."""


_REGISTER_NUMBERS: Final = {
    name: number
    for number, name in enumerate(
        (*CORE[:16], "xpsr", "msp", "psp", *MASKS, "fpscr", *FLOATING_POINT[:32]),
    )
}
"""Numbers of registers, as in enum Register of state.c."""


@cache
def load() -> Any:
    """Return the library with the types of its functions. Raises InputError."""
    library = loader.load()
    for name, (gives, *takes) in _FUNCTIONS.items():
        function = getattr(library, name)
        function.restype, function.argtypes = gives, takes
    return library


class _ChipOwner:
    """An object that frees the chip in C when the object is deleted."""


class FcuChip:
    """One chip in C, which uses the board's clock. An exception in a callback ends the run."""

    def __init__(self, clock: Clock, trace: Trace) -> None:
        self.library = load()
        self.clock, self.trace = clock, trace
        self.closed = False
        self._error: BaseException | None = None
        self._references: list[object] = []
        self._noted: set[tuple[int, int, bytes]] = set()
        table = HostTable()
        called: tuple[Callable[..., Any], ...]
        called = (
            *(self._advance, self._read, self._write, self._note, self._ignored_access),
            *(self._fault, self._locked_up, self._reset, self._accessed),
            *(self._deep_sleep, self._stop_ended),
        )
        for n, (name, kind) in enumerate(_HOST_CALLS):
            work = (
                0 if name == "accessed" else WORK_OF_A_CALL
            )  # a debugger's watchpoints are no work of the firmware
            setattr(table, name, self.callback(kind, called[n], work))
        handle = self.library.fcu_create(table)
        if not handle:
            raise MemoryError("the chip in C")
        self.handle = _pointer(handle)
        self._owner = _ChipOwner()
        self._destroy = weakref.finalize(self._owner, self.library.fcu_destroy, self.handle)
        shared = (_i64 * 8).from_address(handle)
        self.shared = memoryview(shared).cast("B").cast("q")
        """First members of struct Chip: now_ps, host_next_ps, until_ps, must_stop, detailed, work, work_limit,
        observed.
        """
        self._references.append(shared)
        self.flash = self._memory(self.library.fcu_flash, FLASH_SIZE)
        self.ram = self._memory(self.library.fcu_ram, RAM_SIZE)
        self.system_memory = self._memory(self.library.fcu_system_memory, SYSTEM_MEMORY_SIZE)
        self._memories: tuple[tuple[int, memoryview[int]], ...] = (
            *((RAM, self.ram), (FLASH, self.flash)),
            *((0, self.flash), (SYSTEM_MEMORY, self.system_memory)),
        )
        self._core_registers = CoreRegisters(self, CORE)
        self._pc = CoreRegisters(self, ("pc",))
        self.targets = Targets(self)
        bases = [self.library.fcu_peripheral_base(self.handle, n) for n in range(self.peripheral_count)]
        names = {base: name for name, (base, _) in ADDRESSES.items()}
        self.peripherals = {
            names[base]: _peripheral(self, n, names[base], base) for n, base in enumerate(bases)
        }
        self._by_index = list(self.peripherals.values())
        self.read_python: Callable[[int, int], int] = lambda _address, _size: 0
        self.write_python: Callable[[int, int, int], None] = lambda _address, _size, _value: None
        """Called for writes to registers in Python with address, size and value."""
        self.on_ignored_access: Callable[[NativePeripheral, int, int], None] = (
            lambda _peripheral, _offset, _what: None
        )
        """Called when a peripheral ignores an access (enum IgnoredAccess of chip.h)."""

    @property
    def peripheral_count(self) -> int:
        count: int = self.library.fcu_peripheral_count(self.handle)
        return count

    def close(self) -> None:
        nothing = memoryview(b"")
        self.flash = self.ram = self.system_memory = self.shared = nothing
        self._memories = ()
        self.closed = True
        self._destroy()

    # -- memory and registers ---------------------------------------------------------------------------

    def _memory(self, place: Callable[[Any], int], size: int) -> memoryview[int]:
        buffer = (ctypes.c_uint8 * size).from_address(place(self.handle))
        vars(buffer)["owner"] = self._owner  # C's memory is kept as long as this view exists
        return memoryview(buffer).cast("B")

    def memory(self, address: int, size: int) -> memoryview[int] | None:
        """Return a view of RAM, flash or system memory; None for other addresses."""
        for base, content in self._memories:
            offset = address - base
            if 0 <= offset <= len(content) - size:
                return content[offset : offset + size]
        return None

    def invalidate_code(self) -> None:
        self.library.fcu_invalidate_code(self.handle)

    def register_calls(self, names: tuple[str, ...]) -> RegisterCalls:
        count = len(names)
        numbers = (_i32 * count)(*(_REGISTER_NUMBERS[name] for name in names))
        values = (_u32 * count)()
        call = self.handle, numbers, values, count
        words = memoryview(values).cast("B").cast("I")
        fetch = partial(self.library.fcu_read_registers, *call)
        return words, fetch, partial(self.library.fcu_write_registers, *call)

    def register(self, number: int) -> int:
        return self._core_registers.read()[number]

    def core_state(self) -> bytes:
        """Return R0 to R12, SP, LR, PC and xPSR."""
        return self._core_registers.read().tobytes()

    @property
    def pc(self) -> int:
        return self._pc.read()[0]

    @pc.setter
    def pc(self, address: int) -> None:
        self._pc.write(address)

    @property
    def thumb(self) -> bool:
        """EPSR.T, which must be set during execution."""
        return bool(self.library.fcu_thumb(self.handle))

    @thumb.setter
    def thumb(self, thumb: bool) -> None:
        self.library.fcu_set_thumb(self.handle, thumb)

    def peripheral_by_index(self, index: int) -> NativePeripheral:
        return self._by_index[index]

    # -- time -------------------------------------------------------------------------------------------

    def advance_to(self, at_ps: int) -> None:
        self.enter()
        self.library.fcu_advance(self.handle, at_ps)
        self.raise_error()
        self.clock.advance_to(at_ps)

    def enter(self) -> None:
        """Give C the time of Python's next event, and the settings of the trace."""
        shared, trace = self.shared, self.trace
        shared[1], shared[4], shared[7] = self.clock.next_ps, trace.detailed, trace.observed

    def settle(self) -> None:
        self.enter()
        self.library.fcu_settle(self.handle)
        self.raise_error()
        self.clock.settle()

    def set_clocks(self, tree: ClockTree) -> None:
        clocks = tree.sysclk_hz, tree.hclk_hz, tree.pclk1_hz, tree.pclk2_hz, tree.timer1_hz, tree.timer2_hz
        self.library.fcu_set_clocks(
            self.handle, ClocksTable(*clocks, tree.nominal_pclk1_hz, tree.lsi_hz, tree.lse_hz)
        )
        self.raise_error()

    def gate(self, peripherals: int, clocked: int) -> None:
        """Switch the clocks of ``peripherals`` on if they are in ``clocked``, else off.

        Bit n of both masks is the peripheral with index n.
        """
        self.library.fcu_gate(self.handle, peripherals, clocked)

    def gate_python(self, peripheral: Peripheral, clocked: bool) -> None:
        self.library.fcu_gate_python(self.handle, peripheral.base, clocked)

    def reset_peripherals(self, peripherals: int) -> None:
        self.library.fcu_reset_peripherals(self.handle, peripherals)
        self.raise_error()

    def set_irq(self, number: int, level: bool) -> None:
        self.library.fcu_set_irq(self.handle, number, level)

    def irq_level(self, number: int) -> bool:
        return bool(self.library.fcu_irq_level(self.handle, number))

    def set_alternate(self, port: str, pin: int, function: int | None) -> None:
        number = -1 if function is None else function
        self.library.fcu_set_alternate(self.handle, "ABCDEH".index(port), pin, number)

    def set_exti_line(self, line: int, level: bool) -> None:
        """Set line 16 or higher (RM0368 section 10.2.5)."""
        self.library.fcu_set_exti_line(self.handle, line, level)

    def watch_irqs(self, changed: Callable[[int, int], None]) -> None:
        self.library.fcu_watch_irqs(self.handle, self.callback(IRQ_CHANGED, changed))

    def raise_error(self) -> None:
        """Raise the exception that a callback has stored, if any."""
        if self._error is not None:
            error, self._error = self._error, None
            self.shared[3] = 0
            raise error

    def keep_error(self, error: BaseException) -> None:
        """End the run, then raise ``error``."""
        self._error = self._error or error
        self.shared[3] = 1

    def callback(self, kind: Any, function: Callable[..., Any], work: int = WORK_OF_A_CALL) -> Any:
        """Return a callback for C, which counts ``work``, sets the clock, and stores exceptions."""
        clock, enter = self.clock, self.enter
        nothing = 0 if kind._restype_ is not None else None

        def called(now_ps: int, *arguments: Any) -> Any:
            try:
                clock.now_ps = now_ps
                self.shared[5] += work
                return function(*arguments)
            except BaseException as error:
                self.keep_error(error)
                return nothing
            finally:
                enter()

        made = kind(called)
        self._references.append(made)
        return made

    # -- callbacks --------------------------------------------------------------------------------------

    def _advance(self) -> None:
        self.clock.advance_to(self.clock.now_ps)

    def _read(self, address: int, size: int) -> int:
        return self.read_python(address, size)

    def _write(self, address: int, size: int, value: int) -> None:
        self.write_python(address, size, value)

    def _note(self, peripheral: int, kind: int, text: bytes) -> None:
        key = peripheral, kind, text
        if key not in self._noted:
            self._noted.add(key)
            name = self._by_index[peripheral].name
            problem, data, words = split_note(text.decode())
            self.trace.add(DeviceNote(self.clock.now_ps, name, NOTE_KINDS[kind], words, problem, data))

    def _ignored_access(self, peripheral: int, offset: int, what: int, value: int) -> bool:
        """Report an access. If the result is True, C does not report this register and reason again."""
        del value
        self.on_ignored_access(self._by_index[peripheral], offset, what)
        return True

    def _fault(self, exception: int, cfsr: int, hfsr: int, address: int) -> None:
        """Do nothing; :class:`Core` overrides this method and the next three."""

    def _locked_up(self, pc: int) -> None:
        pass

    def _reset(self, reason: int) -> None:
        pass

    def _accessed(self, address: int, size: int, written: int) -> None:
        pass

    def _deep_sleep(self) -> int:
        return DEEP_WITH_CLOCKS

    def _stop_ended(self) -> None:
        pass


class NativePeripheral(Peripheral):
    """A peripheral in C. Its registers are accessed by their offsets."""

    index: int

    def __init__(self, chip: FcuChip, index: int, name: str, base: int) -> None:
        self._chip, self.index = chip, index
        self.name, self.base, self.size = name, base, 0x400
        self.NAMES = names_of(name)

    @property
    def clocked(self) -> bool:
        return bool(self._chip.library.fcu_is_clocked(self._chip.handle, self.index))

    @clocked.setter
    def clocked(self, clocked: bool) -> None:
        self._chip.gate(1 << self.index, clocked << self.index)

    def reset(self) -> None:
        self._chip.reset_peripherals(1 << self.index)

    def read(self, offset: int) -> int:
        self._chip.enter()
        value: int = self._chip.library.fcu_read_peripheral(self._chip.handle, self.index, offset)
        self._chip.raise_error()
        return value

    def read_with_validity(self, offset: int) -> tuple[int, int]:
        value = self.read(offset)
        return value, self._chip.shared[2]

    def peek(self, offset: int) -> int:
        value: int = self._chip.library.fcu_peek_peripheral(self._chip.handle, self.index, offset)
        return value

    def pure_read(self, offset: int) -> bool:
        return bool(self._chip.library.fcu_is_pure(self._chip.handle, self.index, offset))

    def write(self, offset: int, value: int, mask: int = WORD) -> None:
        self._chip.enter()
        self._chip.library.fcu_write_peripheral(self._chip.handle, self.index, offset, value & WORD, mask)
        self._chip.raise_error()


def _kind(name: str) -> str:
    return name.rstrip("0123456789")


def _peripheral(chip: FcuChip, index: int, name: str, base: int) -> NativePeripheral:
    return PERIPHERAL_CLASSES.get(_kind(name), NativePeripheral)(chip, index, name, base)
