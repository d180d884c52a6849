"""The native engine: a Cortex-M4F written in C (emulator/arm/native), called through ctypes.

It is there when the package was built where a C compiler was at hand (gcc or clang); ``available()`` tells.
The interpreter lock is held while it runs, as with the other engine, and runs are short for the same reason.
"""

from __future__ import annotations

import ctypes
import weakref
from collections.abc import Callable, Iterable
from functools import cache, partial
from importlib import import_module
from typing import Any, Final

from emulator.arm import native
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
from emulator.arm.cpu.registers import CORE, FLOATING_POINT, MASKS, RegisterCalls
from emulator.arm.cpu.stop import Stop

_pointer = ctypes.c_void_p
_READ = ctypes.CFUNCTYPE(ctypes.c_uint64, _pointer, ctypes.c_uint64, ctypes.c_uint, _pointer)
_WRITE = ctypes.CFUNCTYPE(None, _pointer, ctypes.c_uint64, ctypes.c_uint, ctypes.c_uint64, _pointer)
_LOOK = ctypes.CFUNCTYPE(ctypes.c_uint64, ctypes.c_int64, ctypes.c_uint32, ctypes.c_uint32)
_PUT = ctypes.CFUNCTYPE(None, ctypes.c_int64, ctypes.c_uint32, ctypes.c_uint32, ctypes.c_uint32)
_CODE_HOOK = ctypes.CFUNCTYPE(None, ctypes.c_uint32)
_MEMORY_HOOK = ctypes.CFUNCTYPE(None, ctypes.c_uint32, ctypes.c_uint, ctypes.c_bool)

_NUMBERS: Final = {
    name: number
    for number, name in enumerate(
        (*CORE[:16], "xpsr", "msp", "psp", *MASKS, "fpscr", *FLOATING_POINT[:32]),
    )
}
"""As in state.c."""

_FETCH, _REFUSED = 12, 15
_STOPS: Final = {
    0: Stop.SLICE,
    1: Stop.PLACE,
    2: Stop.WFI,
    3: Stop.WFE,
    4: Stop.SVC,
    5: Stop.BKPT,
    6: Stop.EXCEPTION_RETURN,
    7: Stop.UNDEFINED,
    8: Stop.INVALID_STATE,
    9: Stop.NO_COPROCESSOR,
    10: Stop.UNALIGNED,
    11: Stop.DIVIDE_BY_ZERO,
    13: Stop.READ,
    14: Stop.WRITE,
}
"""enum Stop of core.h."""


_FUNCTIONS: Final[tuple[tuple[Any, ...], ...]] = (
    ("core_create", _pointer),
    ("core_pages_stored", ctypes.c_bool),
    ("bus_create", _pointer),
    ("bus_nvic", _pointer),
    (
        "waiting_polled",
        ctypes.c_bool,
        _pointer,
        ctypes.c_int64,
        ctypes.c_uint32,
        ctypes.c_int64,
        ctypes.c_int64,
    ),
    ("i2c_create", _pointer),
    ("i2c_read_data", ctypes.c_int64),
)
"""Name and result of those that give more than an int, and what they take where it is called often."""


class _State(ctypes.Structure):
    """The beginning of struct Core."""

    _fields_ = (
        ("counter", ctypes.c_uint64),
        ("limit", ctypes.c_uint64),
        ("pc", ctypes.c_uint32),
        ("thumb", ctypes.c_uint32),
        ("stop", ctypes.c_uint32),
        ("fault_address", ctypes.c_uint32),
        ("passing", ctypes.c_uint32),
        ("ram_is_code", ctypes.c_uint32),
        ("must_stop", ctypes.c_uint32),
    )


@cache
def _load() -> ctypes.PyDLL | str:
    """The library; or why there is none."""
    try:
        module = import_module("emulator.arm.native._core")
        library = ctypes.PyDLL(str(module.__file__))
    except ModuleNotFoundError:
        return "was not built"
    except (ImportError, OSError) as error:
        return f"cannot be loaded ({error})"
    library.core_sources.restype = ctypes.c_char_p
    if native.digest() not in ("", library.core_sources().decode()):
        return "was built from other sources than those that are here"
    for name, gives, *takes in _FUNCTIONS:
        function = getattr(library, name)
        function.restype = gives
        if takes:
            function.argtypes = takes
    return library


def missing() -> str:
    """Why there is no native engine, in words that follow "the native engine"; "" if there is one."""
    library = _load()
    return library if isinstance(library, str) else ""


def available() -> bool:
    """Whether the native engine was built."""
    return not missing()


class NativeEngine(Engine):
    """``system_memory``: bytes by address, read-only. RuntimeError if the engine was not built."""

    def __init__(self, system_memory: Iterable[tuple[int, bytes]] = ()) -> None:
        super().__init__()
        library = _load()
        if isinstance(library, str):
            raise RuntimeError(f"the native engine {library}")
        self.library = library
        self.flash, self.ram = _memory(FLASH_SIZE, 0xFF), _memory(RAM_SIZE, 0)
        system = _memory(SYSTEM_MEMORY_SIZE, 0xFF)
        for address, data in system_memory:
            system[address - SYSTEM_MEMORY : address - SYSTEM_MEMORY + len(data)] = data
        self._memories = ((RAM, self.ram), (FLASH, self.flash), (0, self.flash), (SYSTEM_MEMORY, system))
        core = library.core_create(
            _address(self.flash),
            ctypes.c_uint32(FLASH_SIZE),
            _address(self.ram),
            _address(system),
            ctypes.c_uint32(SYSTEM_MEMORY_SIZE),
        )
        if core is None:
            raise MemoryError("the native engine")
        self.handle = _pointer(core)
        weakref.finalize(self, library.core_destroy, self.handle)
        self._state = _State.from_address(core)
        self.counter = ctypes.c_uint64.from_address(core + _State.counter.offset)
        self.limit = ctypes.c_uint64.from_address(core + _State.limit.offset)
        self.when_a_run_has_ended: list[Callable[[], None]] = []
        """For whoever has left something to C."""
        self._run = partial(library.core_run, self.handle)
        self._callbacks: list[object] = []  # what C holds pointers to
        self._windows: dict[int, int] = {}
        self._images: dict[int, object] = {}
        self._code_watches: dict[int, tuple[int, int, Callable[[int], None]]] = {}
        self._memory_watches: dict[int, tuple[int, int, Callable[[int, int, bool], None]]] = {}
        self._watches = 0
        self._code_hook, self._memory_hook = _CODE_HOOK(self._on_code), _MEMORY_HOOK(self._on_access)
        self._prepare_registers()

    def register_calls(self, names: tuple[str, ...]) -> RegisterCalls:
        """One call each."""
        count = len(names)
        numbers = (ctypes.c_int32 * count)(*(_NUMBERS[name] for name in names))
        values = (ctypes.c_uint32 * count)()
        call = self.handle, numbers, values, ctypes.c_int32(count)
        words = memoryview(values).cast("B").cast("I")
        fetch = partial(self.library.core_read_registers, *call)
        return words, fetch, partial(self.library.core_write_registers, *call)

    # -- memory -----------------------------------------------------------------------------------------

    def map_callbacks(self, base: int, size: int, read: ReadCallback, write: WriteCallback) -> None:
        """Accesses to a window of the address space call ``read`` and ``write``, which must not raise."""
        callbacks = _READ(read), _WRITE(write)
        self._callbacks.append(callbacks)
        index = self.library.core_map(self.handle, ctypes.c_uint32(base), ctypes.c_uint32(size), *callbacks)
        if index < 0:
            raise RuntimeError("the native engine has no more windows")
        self._windows[base] = index

    def access_by(
        self, base: int, look: Callable[[int, int, int], int], put: Callable[[int, int, int, int], None]
    ) -> None:
        """Where C has the time, accesses to the window at ``base`` call ``look(now_ps, offset, size)`` and
        ``put(now_ps, offset, size, value)`` instead.
        """
        callbacks = _LOOK(look), _PUT(put)
        self._callbacks.append(callbacks)
        self.library.core_access_by(self.handle, self._windows[base], *callbacks)

    def show_image(self, base: int, image: memoryview[int]) -> None:
        """Reads of the window at ``base`` come from ``image``, writes call as ever and end the run."""
        self._images[base] = image
        self.library.core_show_image(self.handle, self._windows[base], _address(image))

    def hide_image(self, base: int) -> None:
        """Reads call again."""
        self.library.core_show_image(self.handle, self._windows[base], None)
        del self._images[base]

    def forget_code(self) -> None:
        """The contents of flash or RAM were changed from outside: decode again what is executed there."""
        for base, content in self._memories:
            size = ctypes.c_uint32(len(content))
            self.library.core_forget_code(self.handle, ctypes.c_uint32(base), size)

    # -- running ----------------------------------------------------------------------------------------

    def run(self, instructions: int) -> Stop:
        """Execute up to so many instructions from ``pc`` on: why it ended. ``executed`` is their number."""
        state = self._state
        self.put_pc()
        state.counter, state.limit = 0, instructions
        self._stop = Stop.SLICE
        self.running = True
        self._run()
        self.running = False
        self.take_pc()
        self.executed = state.counter
        for told in self.when_a_run_has_ended:
            told()
        self._raise_error()
        if self.library.core_pages_stored(self.handle):
            self._note_stored_pages()
        stop = state.stop
        if not stop:
            return Stop.SLICE
        if stop == _REFUSED:
            if self._stop in (Stop.HALT, Stop.PLACE):
                self.executed -= 1  # the instruction is still to be executed
            return self._stop
        if stop == _FETCH:
            return self._nothing_there()
        self.fault_address = state.fault_address
        return _STOPS[stop]

    def put_pc(self) -> None:
        """For C to go on from there."""
        self._state.pc, self._state.thumb = self.pc, self.thumb

    def take_pc(self) -> None:
        """Where C has come to."""
        self.pc, self.thumb = self._state.pc, bool(self._state.thumb)

    def cut(self) -> None:
        """In a callback: end the run behind the instruction in flight."""
        super().cut()
        self._state.must_stop = 1

    def _nothing_there(self) -> Stop:
        if not RAM <= self.pc < RAM + RAM_SIZE:
            return fetch_fault(self.pc)
        self._state.ram_is_code = 1
        for begun in self.when_ram_is_executed:
            begun()
        return Stop.SLICE

    def _note_stored_pages(self) -> None:
        flags = (ctypes.c_uint8 * 64)()
        page = RAM_SIZE // len(flags)
        self.library.core_read_stored(self.handle, flags)
        stored = [0, *flags, 0]
        edges = [n for n in range(len(flags) + 1) if stored[n] != stored[n + 1]]
        pairs = zip(edges[::2], edges[1::2], strict=True)
        self._stored = [self.ram[page * begin : page * end] for begin, end in pairs]

    def run_past(self) -> Stop:
        """Execute one instruction, although it is a place to stop in front of."""
        self._state.passing = self.pc
        stop = self.run(1)
        self._state.passing = 1
        return stop

    def stop_in_front_of(self, places: frozenset[int]) -> None:
        """Runs end with PLACE in front of these instructions; between runs."""
        for changed, on in ((self._places - places, False), (places - self._places, True)):
            addresses = (ctypes.c_uint32 * len(changed))(*changed)
            self.library.core_set_places(self.handle, addresses, ctypes.c_uint32(len(changed)), on)
        self._places = places

    def refuse(self, reason: Stop) -> None:
        """In a watch: end the run in front of the instruction."""
        self._stop = reason
        self._state.stop = _REFUSED
        self.cut()

    # -- hooks ------------------------------------------------------------------------------------------

    def watch(self, begin: int, end: int, called: Callable[[int], None]) -> int:
        """Call ``called(address)`` in front of every instruction of a range; gives a handle."""
        self._watches += 1
        self._code_watches[self._watches] = begin, end, called
        self._set_hooks()
        return self._watches

    def watch_memory(self, begin: int, end: int, called: Callable[[int, int, bool], None]) -> int:
        """Call ``called(address, size, is_write)`` at every load and store that begins in a range."""
        self._watches += 1
        self._memory_watches[self._watches] = begin, end, called
        self._set_hooks()
        return self._watches

    def unwatch(self, handle: int) -> None:
        """No more calls; between runs."""
        self._code_watches.pop(handle, None)
        self._memory_watches.pop(handle, None)
        self._set_hooks()

    def _set_hooks(self) -> None:
        """C calls in one range, which covers all that are watched."""
        for watches, hook, set_hook in (
            (self._code_watches, self._code_hook, self.library.core_hook_code),
            (self._memory_watches, self._memory_hook, self.library.core_hook_memory),
        ):
            begin = min((begin for begin, *_ in watches.values()), default=0)
            end = max((end for _, end, _ in watches.values()), default=0)
            called = hook if watches else None
            set_hook(self.handle, called, ctypes.c_uint32(begin), ctypes.c_uint32(end))

    def _on_code(self, address: int) -> None:
        try:
            for begin, end, called in tuple(self._code_watches.values()):
                if begin <= address <= end:
                    called(address)
        except BaseException as error:
            self.keep_error(error)

    def _on_access(self, address: int, size: int, is_write: bool) -> None:
        try:
            for begin, end, called in tuple(self._memory_watches.values()):
                if begin <= address <= end:
                    called(address, size, is_write)
        except BaseException as error:
            self.keep_error(error)


def _memory(size: int, filled: int) -> memoryview[int]:
    buffer = (ctypes.c_uint8 * size)()
    ctypes.memset(buffer, filled, size)
    return memoryview(buffer).cast("B")


def _address(memory: memoryview[int]) -> ctypes.c_void_p:
    return _pointer(ctypes.addressof(ctypes.c_char.from_buffer(memory)))
