"""Unicorn as the engine: QEMU's translator, which runs everywhere.

Only this module knows Unicorn.

Known of Unicorn 2.1 and relied upon (tests/arm/test_speed_engine.py has most as tests):

* An IT block is executed as a whole: a run never ends inside one, but may end up to four instructions late.
* Inside a callback the counter includes the instruction in flight. Setting the limit to the counter
  ends the run behind it; ``uc_emu_stop`` ends it in front of it, but is lost inside an IT block.
* An exception number reported to the interrupt hook and an error leave PC, xPSR with ITSTATE, and all
  registers as they were in front of the instruction (behind it for SVC).
* A store into a page whose TLB entry allows execution costs 50 ns, any other 3 ns. So RAM is not executable
  until something is executed there, and the TLB is filled here, by a hook: the engine's own fill makes all
  memory executable that ARM's default map does (ARMv7-M ARM B3.1). With that hook Unicorn 2.1 leaves ITSTATE
  behind when the access stands in an IT block, which has to be undone.
* A hook on an instruction, be it on one only, makes all others three times as slow, because the engine counts
  by a hook, too, and a single one is called directly. An exit costs nothing where it is not; it stops like
  WFI does.

Decision: the C functions are called through ctypes, not through the package's ``Uc`` methods, which
cost ten times as much a call; and with the interpreter lock held, which halves what is left. So runs
are kept short (a few million instructions) for the sake of other threads.

What the engine does not do, and nothing here adds: unaligned LDM, STM, LDRD and STRD are executed (the
architecture faults them, ARMv7-M ARM A3.2.1; :mod:`special` does so if asked to), floating point sets no
cumulative exception interrupt.
"""

from __future__ import annotations

import ctypes
import weakref
from collections.abc import Callable, Iterable, Iterator
from functools import partial
from typing import Final

from unicorn import arm_const
from unicorn import unicorn_const as uc
from unicorn.unicorn_py3.unicorn import uclib

from emulator.arm.cpu import counter as counting
from emulator.arm.cpu.engine import (
    FLASH,
    FLASH_SIZE,
    RAM,
    RAM_SIZE,
    SYSTEM_MEMORY,
    SYSTEM_MEMORY_SIZE,
    Engine,
    ReadCallback,
    WriteCallback,
    fetch_fault,
)
from emulator.arm.cpu.registers import IT_BITS, RegisterCalls, Registers
from emulator.arm.cpu.stop import Stop

_READS = (uc.UC_MEM_READ_UNMAPPED, uc.UC_MEM_READ_PROT)
_THUMB = 1 << 24
_READ_WRITE = uc.UC_PROT_READ | uc.UC_PROT_WRITE
_NOP = b"\x00\xbf"
_WFI = b"\x30\xbf"
_PAGE = 4096
_NEVER_REACHED = 0xFFFF_FFFF

_pointer = ctypes.c_void_p


class _TlbEntry(ctypes.Structure):
    _fields_ = (("address", ctypes.c_uint64), ("rights", ctypes.c_int))


_READ_CALLBACK = ctypes.CFUNCTYPE(ctypes.c_uint64, _pointer, ctypes.c_uint64, ctypes.c_uint, _pointer)
_WRITE_CALLBACK = ctypes.CFUNCTYPE(None, _pointer, ctypes.c_uint64, ctypes.c_uint, ctypes.c_uint64, _pointer)
_CODE_HOOK = ctypes.CFUNCTYPE(None, _pointer, ctypes.c_uint64, ctypes.c_uint32, _pointer)
_FILL_HOOK = ctypes.CFUNCTYPE(
    ctypes.c_bool, _pointer, ctypes.c_uint64, ctypes.c_int, ctypes.c_size_t, _pointer
)
_INTERRUPT_HOOK = ctypes.CFUNCTYPE(None, _pointer, ctypes.c_uint32, _pointer)
_MEMORY_HOOK = ctypes.CFUNCTYPE(
    ctypes.c_bool, _pointer, ctypes.c_int, ctypes.c_uint64, ctypes.c_int, ctypes.c_int64, _pointer
)

_Window = tuple[int, object, object, WriteCallback]

_INTERRUPTS = {
    1: Stop.UNDEFINED,
    2: Stop.SVC,
    3: Stop.EXECUTE_NEVER,
    4: Stop.UNALIGNED,
    7: Stop.BKPT,
    8: Stop.EXCEPTION_RETURN,
    17: Stop.NO_COPROCESSOR,
    18: Stop.INVALID_STATE,
}
"""QEMU's exception numbers (target/arm/cpu.h); only LDREX at an unaligned address meets 4, the data abort."""


_NUMBERS: Final[dict[str, int]] = {
    **{f"r{number}": arm_const.UC_ARM_REG_R0 + number for number in range(13)},
    "sp": arm_const.UC_ARM_REG_SP,
    "lr": arm_const.UC_ARM_REG_LR,
    "pc": arm_const.UC_ARM_REG_PC,
    "xpsr": arm_const.UC_ARM_REG_XPSR,
    "msp": arm_const.UC_ARM_REG_MSP,
    "psp": arm_const.UC_ARM_REG_PSP,
    "primask": arm_const.UC_ARM_REG_PRIMASK,
    "basepri": arm_const.UC_ARM_REG_BASEPRI,
    "faultmask": arm_const.UC_ARM_REG_FAULTMASK,
    "control": arm_const.UC_ARM_REG_CONTROL,
    **{f"s{number}": arm_const.UC_ARM_REG_S0 + number for number in range(32)},
    "fpscr": arm_const.UC_ARM_REG_FPSCR,
}


class UnicornEngine(Engine):
    """``system_memory``: bytes by address, read-only. ``native_counter`` False counts by a hook."""

    def __init__(self, system_memory: Iterable[tuple[int, bytes]] = (), native_counter: bool = True) -> None:
        super().__init__()
        self.library = ctypes.PyDLL(uclib._name)
        self.handle = self._open()
        self._kept: list[object] = []  # what C holds pointers to
        self._hooks: dict[int, object] = {}  # likewise, by handle
        self._windows: dict[int, _Window] = {}
        self._images: dict[int, object] = {}
        self.flash = self._map_own(FLASH, FLASH_SIZE, uc.UC_PROT_READ | uc.UC_PROT_EXEC, 0xFF, alias=0)
        self.ram = self._map_own(RAM, RAM_SIZE, _READ_WRITE, 0)
        self._stored_pages: set[int] = set()
        self._ram_is_code = False
        system = self._map_own(SYSTEM_MEMORY, SYSTEM_MEMORY_SIZE, uc.UC_PROT_READ | uc.UC_PROT_EXEC, 0xFF)
        self._memories = ((RAM, self.ram), (FLASH, self.flash), (0, self.flash), (SYSTEM_MEMORY, system))
        for address, data in system_memory:
            system[address - SYSTEM_MEMORY : address - SYSTEM_MEMORY + len(data)] = data
        self._start = self.library.uc_emu_start
        self._start.argtypes = [
            ctypes.c_void_p,
            ctypes.c_uint64,
            ctypes.c_uint64,
            ctypes.c_uint64,
            ctypes.c_size_t,
        ]
        self._page_size = self._query(uc.UC_QUERY_PAGE_SIZE)
        self._xpsr = Registers(self, ("xpsr",))
        self._hook(uc.UC_HOOK_TLB_FILL, _FILL_HOOK(self._on_tlb_fill))
        self.counter, self.limit, self.native_counter = self._find_counter(native_counter)
        self._prepare_registers()
        self._pc = Registers(self, ("pc",))
        self._hook(uc.UC_HOOK_INTR, _INTERRUPT_HOOK(self._on_interrupt))
        self._hook(uc.UC_HOOK_MEM_INVALID, _MEMORY_HOOK(self._on_invalid_access))

    def register_calls(self, names: tuple[str, ...]) -> RegisterCalls:
        """One call for several registers costs half of what one for each does by the package's methods."""
        count = len(names)
        numbers = (ctypes.c_int * count)(*(_NUMBERS[name] for name in names))
        values = (ctypes.c_uint32 * count)()
        places = (ctypes.c_void_p * count)(*(ctypes.addressof(values) + 4 * n for n in range(count)))
        call = (self.handle, ctypes.byref(numbers), ctypes.byref(places), ctypes.c_int(count))
        words = memoryview(values).cast("B").cast("I")
        fetch = partial(self.library.uc_reg_read_batch, *call)
        return words, fetch, partial(self.library.uc_reg_write_batch, *call)

    # -- memory -----------------------------------------------------------------------------------------

    def _map_own(
        self, address: int, size: int, rights: int, filled: int, alias: int | None = None
    ) -> memoryview[int]:
        buffer = ctypes.create_string_buffer(size + _PAGE)
        skipped = -ctypes.addressof(buffer) % _PAGE
        view = memoryview(buffer).cast("B")[skipped : skipped + size]
        view[:] = bytes((filled,)) * size
        self._kept.append(buffer)
        for place in (address,) if alias is None else (address, alias):
            self._check(
                self.library.uc_mem_map_ptr(
                    self.handle,
                    ctypes.c_uint64(place),
                    ctypes.c_size_t(size),
                    ctypes.c_uint32(rights),
                    ctypes.c_void_p(ctypes.addressof(buffer) + skipped),
                )
            )
        return view

    def map_callbacks(self, base: int, size: int, read: ReadCallback, write: WriteCallback) -> None:
        """Accesses to a window of the address space call ``read`` and ``write``, which must not raise."""
        self._windows[base] = size, _READ_CALLBACK(read), _WRITE_CALLBACK(write), write
        self._map_window(base)

    def _map_window(self, base: int) -> None:
        size, *callbacks, _ = self._windows[base]
        self._check(
            self.library.uc_mmio_map(
                self.handle,
                ctypes.c_uint64(base),
                ctypes.c_size_t(size),
                callbacks[0],
                None,
                callbacks[1],
                None,
            )
        )

    def show_image(self, base: int, image: memoryview[int]) -> None:
        """Reads of the window at ``base`` come from ``image``, writes call as ever and end the run.

        A write leaves its value in ``image``. Between runs, as is the end of it.
        """
        self._unmap_window(base)
        memory = (ctypes.c_char * image.nbytes).from_buffer(image)
        arguments = ctypes.c_uint64(base), ctypes.c_size_t(image.nbytes), ctypes.c_uint32(uc.UC_PROT_READ)
        self._check(self.library.uc_mem_map_ptr(self.handle, *arguments, ctypes.byref(memory)))
        self._images[base] = memory

    def hide_image(self, base: int) -> None:
        """Reads call again."""
        self._unmap_window(base)
        self._map_window(base)
        del self._images[base]

    def _unmap_window(self, base: int) -> None:
        size = ctypes.c_size_t(self._windows[base][0])
        self._check(self.library.uc_mem_unmap(self.handle, ctypes.c_uint64(base), size))
        self._control(uc.UC_CTL_TLB_FLUSH)

    def forget_code(self) -> None:
        """The contents of flash or RAM were changed from outside: translate again what is executed there."""
        self._control(uc.UC_CTL_TB_FLUSH)

    # -- running ----------------------------------------------------------------------------------------

    def run(self, instructions: int) -> Stop:
        """Execute up to so many instructions from ``pc`` on: why it ended. ``executed`` is their number.

        What a callback raised is raised here, when the instruction has been completed.
        """
        self._stop = Stop.SLICE
        self.running = True
        self.counter.value, self.limit.value = 0, instructions
        code = self._start(
            self.handle, self.pc | self.thumb, _NEVER_REACHED, 0, instructions if self.native_counter else 0
        )
        self.running = False
        self.pc = self._pc.read()[0]
        begun = self.executed = self.counter.value
        self._raise_error()
        if code != uc.UC_ERR_OK:
            return self._failed(code)
        if self._stop is not Stop.SLICE:
            if self._stop in (Stop.HALT, Stop.PLACE) or begun > self.limit.value:
                self.executed -= 1  # the instruction is still to be executed
            return self._stop
        if begun > self.limit.value:
            self.executed = begun - 1
            return Stop.SLICE
        return self._slept_or_at_place()

    def _slept_or_at_place(self) -> Stop:
        """WFI in front of a place is taken for the reason; if it was not, the next run does not get far."""
        before = self.memory(self.pc - 2, 2)
        if self.pc not in self._places or (self.executed and before is not None and bytes(before) == _WFI):
            return Stop.WFI
        return Stop.PLACE if self.executed < self.limit.value else Stop.SLICE

    def run_past(self) -> Stop:
        """Execute one instruction, although it is such a place."""
        places, here = self._places, self.pc
        self.stop_in_front_of(places - {here})
        stop = self.run(1)
        self.stop_in_front_of(places)
        return stop

    def stop_in_front_of(self, places: frozenset[int]) -> None:
        """Runs end with PLACE in front of these instructions; between runs."""
        values = (ctypes.c_uint64 * len(places))(*places)
        request = uc.UC_CTL_UC_EXITS | 2 << 26 | uc.UC_CTL_IO_WRITE << 30
        self._check(
            self.library.uc_ctl(self.handle, ctypes.c_uint32(request), values, ctypes.c_size_t(len(places)))
        )
        for place in places - self._places:
            self._forget_translation(place)
        self._places = places

    def _forget_translation(self, address: int) -> None:
        request = uc.UC_CTL_TB_REMOVE_CACHE | 2 << 26 | uc.UC_CTL_IO_WRITE << 30
        begin, end = ctypes.c_uint64(address), ctypes.c_uint64(address + 2)
        self._check(self.library.uc_ctl(self.handle, ctypes.c_uint32(request), begin, end))

    def refuse(self, reason: Stop) -> None:
        """In a watch: end the run in front of the instruction; inside of an IT block, behind the block."""
        self._stop = reason
        self.cut()
        self.library.uc_emu_stop(self.handle)

    def _failed(self, code: int) -> Stop:
        if self._stop is not Stop.SLICE:
            return self._stop  # WFE, or an access whose address has been noted
        if code == uc.UC_ERR_INSN_INVALID:
            return Stop.UNDEFINED if self._core.read()[16] & _THUMB else Stop.INVALID_STATE
        if code == uc.UC_ERR_FETCH_PROT and RAM <= self.pc < RAM + RAM_SIZE:
            return self._execute_in_ram()
        if code in (uc.UC_ERR_FETCH_UNMAPPED, uc.UC_ERR_FETCH_PROT):
            return fetch_fault(self.pc)
        raise RuntimeError(f"the instruction engine failed: Unicorn error {code}")

    def _execute_in_ram(self) -> Stop:
        """From now on stores into RAM may change code."""
        self._ram_is_code, self._stored = True, [self.ram]
        arguments = ctypes.c_uint64(RAM), ctypes.c_size_t(RAM_SIZE), ctypes.c_uint32(uc.UC_PROT_ALL)
        self._check(self.library.uc_mem_protect(self.handle, *arguments))
        self._control(uc.UC_CTL_TLB_FLUSH)
        for begun in self.when_ram_is_executed:
            begun()
        return Stop.SLICE

    # -- hooks ------------------------------------------------------------------------------------------

    def watch(self, begin: int, end: int, called: Callable[[int], None]) -> int:
        """Call ``called(address)`` in front of every instruction of a range; gives a handle."""

        def hook(_engine: int, address: int, _size: int, _data: int) -> None:
            try:
                called(address)
            except BaseException as error:
                self.keep_error(error)

        handle = self._hook(uc.UC_HOOK_CODE, _CODE_HOOK(hook), begin, end)
        self._control(uc.UC_CTL_TB_FLUSH)
        return handle

    def watch_memory(self, begin: int, end: int, called: Callable[[int, int, bool], None]) -> int:
        """Call ``called(address, size, is_write)`` at every load and store that begins in a range, registers
        included; gives a handle. All loads and stores are slower as long as there is one.
        """

        def hook(_engine: int, kind: int, address: int, size: int, _value: int, _data: int) -> bool:
            try:
                called(address, size, kind == uc.UC_MEM_WRITE)
                self._forget_it_state()
            except BaseException as error:
                self.keep_error(error)
            return True

        kinds = uc.UC_HOOK_MEM_READ | uc.UC_HOOK_MEM_WRITE
        handle = self._hook(kinds, _MEMORY_HOOK(hook), begin, end)
        self._control(uc.UC_CTL_TB_FLUSH)
        return handle

    def _forget_it_state(self) -> None:
        """An access that is told of leaves ITSTATE behind: what follows the block would be conditional."""
        xpsr = self._xpsr.read()[0]
        if xpsr & IT_BITS and self._stop is Stop.SLICE:
            self._xpsr.write(xpsr & ~IT_BITS)

    def unwatch(self, handle: int) -> None:
        """No more calls; between runs."""
        self._check(self.library.uc_hook_del(self.handle, ctypes.c_size_t(handle)))
        self._control(uc.UC_CTL_TB_FLUSH)
        del self._hooks[handle]

    def _hook(self, kind: int, callback: ctypes._FuncPointer, begin: int = 1, end: int = 0) -> int:
        handle = ctypes.c_size_t()
        self._check(
            self.library.uc_hook_add(
                self.handle,
                ctypes.byref(handle),
                ctypes.c_int(kind),
                callback,
                None,
                ctypes.c_uint64(begin),
                ctypes.c_uint64(end),
            )
        )
        self._hooks[handle.value] = callback
        return handle.value

    def _on_interrupt(self, _engine: int, number: int, _data: int) -> None:
        try:
            self.refuse(_INTERRUPTS[number])
        except BaseException as error:
            self.keep_error(error)
            self.library.uc_emu_stop(self.handle)

    def _on_tlb_fill(self, _engine: int, address: int, kind: int, place: int, _data: int) -> bool:
        entry = _TlbEntry.from_address(place)
        entry.address = address
        entry.rights = uc.UC_PROT_ALL
        if kind == uc.UC_MEM_FETCH:
            return True
        if RAM <= address < RAM + RAM_SIZE and not self._ram_is_code:
            entry.rights = self._rights_of_ram(address, kind)
        self._forget_it_state()
        return True

    def _rights_of_ram(self, address: int, kind: int) -> int:
        """A page may be stored to as soon as that has been noted."""
        if address not in self._stored_pages:
            if kind != uc.UC_MEM_WRITE:
                return uc.UC_PROT_READ
            self._stored_pages.add(address)
            self._stored = [self.ram[begin:end] for begin, end in self._stored_parts()]
        return _READ_WRITE

    def _stored_parts(self) -> Iterator[tuple[int, int]]:
        begin = end = 0
        for page in sorted(self._stored_pages):
            if page - RAM != end:
                yield begin, end
                begin = page - RAM
            end = page - RAM + self._page_size
        yield begin, end

    def _on_invalid_access(
        self, _engine: int, kind: int, address: int, size: int, value: int, _data: int
    ) -> bool:
        base = address & -self._page_size
        if base in self._images:
            self._windows[base][3](0, address - base, size, value & (1 << 8 * size) - 1, 0)
            self._forget_it_state()
            self.cut()
            return True
        self.fault_address = address
        if kind in (uc.UC_MEM_WRITE_UNMAPPED, uc.UC_MEM_WRITE_PROT):
            self._stop = Stop.WRITE
        elif kind in _READS:
            self._stop = Stop.READ
        return False

    # -- set-up -----------------------------------------------------------------------------------------

    def _open(self) -> ctypes.c_void_p:
        handle = ctypes.c_void_p()
        mode = uc.UC_MODE_THUMB | uc.UC_MODE_MCLASS
        self._check(
            self.library.uc_open(ctypes.c_int(uc.UC_ARCH_ARM), ctypes.c_int(mode), ctypes.byref(handle))
        )
        self.handle = handle
        self._control(uc.UC_CTL_UC_USE_EXITS, 1)
        self._control(uc.UC_CTL_CPU_MODEL, arm_const.UC_CPU_ARM_CORTEX_M4)
        self._control(uc.UC_CTL_TLB_TYPE, uc.UC_TLB_VIRTUAL)
        weakref.finalize(self, self.library.uc_close, handle)
        return handle

    def _control(self, kind: int, *arguments: int) -> None:
        request = kind | len(arguments) << 26 | uc.UC_CTL_IO_WRITE << 30
        values = (ctypes.c_int(argument) for argument in arguments)
        self._check(self.library.uc_ctl(self.handle, ctypes.c_uint32(request), *values))

    def _query(self, what: int) -> int:
        value = ctypes.c_size_t()
        self._check(self.library.uc_query(self.handle, ctypes.c_int(what), ctypes.byref(value)))
        return value.value

    def _find_counter(self, native: bool) -> tuple[counting.Cell, counting.Cell, bool]:
        if native:
            found = counting.find(self.handle.value or 0, self._run_nops)
            self.flash[: 2 * counting.LONGEST_TRIAL] = b"\xff" * 2 * counting.LONGEST_TRIAL
            self.forget_code()
            if found is not None:
                return (*found, True)
        counter, limit = counting.OwnCell(), counting.OwnCell()

        def count(_engine: int, _address: int, _size: int, _data: int) -> None:
            counter.value += 1
            if counter.value > limit.value:
                self.library.uc_emu_stop(self.handle)

        self._hook(uc.UC_HOOK_CODE, _CODE_HOOK(count))
        return counter, limit, False

    def _run_nops(self, count: int) -> None:
        self.flash[: 2 * counting.LONGEST_TRIAL] = _NOP * counting.LONGEST_TRIAL
        self._check(self._start(self.handle, FLASH | 1, _NEVER_REACHED, 0, count))

    @staticmethod
    def _check(code: int) -> None:
        if code != uc.UC_ERR_OK:
            raise RuntimeError(f"the instruction engine cannot be set up: Unicorn error {code}")
