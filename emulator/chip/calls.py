"""Calls of single C functions of a firmware. Python passes the function's name, and values as arguments.

::

    board = Board(firmware="build/lab3.elf")
    board.run_for(0.1)
    board.call("getAltitude", 1013.25, 20.0)
    with board.scratch() as copy:
        copy.set_variable("acc", {"AXIS_X": 0, "AXIS_Y": 0, "AXIS_Z": 1000})
        copy.call("eCompass")
        copy.variable("pitch")

Arguments and results follow the AAPCS (IHI 0042).

Decision: a copy of the core and its memories executes a function that Python calls, so that the
board's registers, RAM and peripherals do not change. If a function needs peripherals or time, it runs
on the chip, and the chip is then restored. A snapshot around every call would be five times as slow.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager, nullcontext
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any, Final

from fcu_emulator.emulator.chip.cpu.bare_core import BareCore, Stop
from fcu_emulator.emulator.chip.cpu.core_registers import EVERYTHING, CoreRegisters
from fcu_emulator.emulator.chip.image.c_types import Array, Boolean, CType, CValue, Integer, Structure
from fcu_emulator.emulator.chip.image.c_values import alignment, floats_of, load_into, store
from fcu_emulator.emulator.chip.memory_map import RAM, RAM_SIZE
from fcu_emulator.emulator.clock import PS_PER_MS, PS_PER_S
from fcu_emulator.emulator.errors import CallError, InputError, SymbolError

if TYPE_CHECKING:
    from fcu_emulator.emulator.chip.cpu.core import Core
    from fcu_emulator.emulator.chip.image import FirmwareImage
    from fcu_emulator.emulator.chip.image.functions import Signature
    from fcu_emulator.emulator.chip.image.symbols import Symbols

INSTRUCTIONS: Final = 10_000_000
"""Default maximum number of instructions in a call: about 0.15 s of virtual time at 84 MHz."""
TIMEOUT_S: Final = 1.0
_RETURN: Final = 0x0FFF_FFFE
"""The return address of a call. No memory has this address, so the copy stops there."""
_THUMB_BIT: Final = 1 << 24
_EXCEPTION: Final = 0x1FF
_SLICE_PS: Final = PS_PER_MS // 10
_CORE: Final = ("r0", "r1", "r2", "r3", "sp", "lr", "xpsr")
_FLOATS: Final = tuple(f"s{number}" for number in range(16))
_SET: Final = _CORE + _FLOATS
_NEEDS_TIME: Final = frozenset({Stop.WFI, Stop.WFE, Stop.SVC, Stop.BKPT, Stop.EXCEPTION_RETURN, Stop.SLICE})
_WHY: Final = {
    Stop.UNDEFINED: "executed an undefined instruction",
    Stop.INVALID_STATE: "left Thumb state, likely through a function pointer that is not set",
    Stop.NO_COPROCESSOR: "used a coprocessor that this chip does not have",
    Stop.UNALIGNED: "made an unaligned access",
    Stop.DIVIDE_BY_ZERO: "divided by zero",
    Stop.FETCH: "executed code at an address without memory",
    Stop.EXECUTE_NEVER: "jumped to an address without code, likely through a function pointer that is not set",
    Stop.READ: "read an address without memory",
    Stop.WRITE: "wrote to an address that cannot be written",
}
_WITH_ADDRESS: Final = (Stop.UNALIGNED, Stop.READ, Stop.WRITE)


class _NeedsBoardError(Exception):
    """The function accesses a peripheral or waits."""


class Frame:
    """Registers and stack of a call (IHI 0042, 6.5 and 7.1)."""

    def __init__(self, signature: Signature, arguments: Sequence[Any], sp: int, hard_float: bool) -> None:
        self.sp = sp & ~7
        self.core = [0, 0, 0, 0]
        self.floats = [0] * 16
        self.writes: list[tuple[int, bytes]] = []
        self._free = [True] * 16
        self._floats_open = hard_float
        self._hard_float = hard_float
        self._next = 0
        self._stack = bytearray()
        self._result = signature.result
        self._passed: list[tuple[CType, Any, int]] = []
        self._result_at = self._hidden_result()
        for parameter, argument in zip(signature.parameters, arguments, strict=True):
            kind, raw = self._value(parameter.name or "an argument", parameter, argument)
            self._place(kind, raw)
        self.sp = self.sp - len(self._stack) & ~7
        self.writes.append((self.sp, bytes(self._stack)))

    def result(self, core: Sequence[int], floats: Sequence[int], read: Callable[[int, int], bytes]) -> Any:
        """Return the result, and update the objects that were passed by pointer."""
        for passed, value, address in self._passed:
            load_into(passed, value, read(address, passed.size), 0)
        kind = self._result
        if kind is None:
            return None
        if self._result_at is not None:
            return kind.value(read(self._result_at, kind.size), 0)
        words = floats if self._hard_float and floats_of(kind)[1] else core
        return kind.value(b"".join(word.to_bytes(4, "little") for word in words[:8]), 0)

    def _hidden_result(self) -> int | None:
        """Allocate memory for a result that is too large for registers, and return the address."""
        kind = self._result
        if not isinstance(kind, Structure | Array) or kind.size <= 4:
            return None
        if self._hard_float and floats_of(kind)[1]:
            return None
        address = self._allocate(bytes(kind.size))
        self.core[0], self._next = address, 1
        return address

    def _allocate(self, raw: bytes) -> int:
        self.sp = self.sp - len(raw) & ~7
        self.writes.append((self.sp, raw))
        return self.sp

    def _value(self, name: str, parameter: Any, argument: Any) -> tuple[CType, bytes]:
        kind = parameter.type
        if parameter.points_to is not None and not isinstance(argument, int):
            return kind, self._pointed(name, parameter.points_to(), argument).to_bytes(4, "little")
        raw = bytearray(kind.size)
        store(kind, argument, raw, 0, name)
        return kind, bytes(raw)

    def _pointed(self, name: str, target: CType | None, argument: Any) -> int:
        if argument is None:
            return 0
        if isinstance(argument, str):
            return self._allocate(argument.encode() + b"\0")
        if isinstance(argument, bytes | bytearray):
            target = Array(Integer(1, signed=False), len(argument))
        if target is None:
            raise InputError(
                f"{name!r} must be an address or bytes, because its type has no known target",
                kind="unknown_size",
            )
        if isinstance(argument, list | tuple) and not _is_one(target, argument):
            target = Array(target, len(argument))
        raw = bytearray(target.size)
        store(target, argument, raw, 0, name)
        address = self._allocate(bytes(raw))
        if isinstance(argument, list | dict | bytearray | SimpleNamespace):
            self._passed.append((target, argument, address))
        return address

    def _place(self, kind: CType, raw: bytes) -> None:
        size, count = floats_of(kind) if self._hard_float else (0, 0)
        if count:
            words, step = size * count // 4, size // 4
            starts = range(0, 17 - words, step)
            start = next((at for at in starts if all(self._free[at : at + words])), None)
            if self._floats_open and start is not None:
                self._free[start : start + words] = [False] * words
                self.floats[start : start + words] = _words(raw)
                return
            self._floats_open = False
            self._push(raw, alignment(kind))
            return
        if isinstance(kind, Integer | Boolean) and kind.size < 4:
            raw = kind.value(raw, 0).to_bytes(4, "little", signed=isinstance(kind, Integer) and kind.signed)
        words = (len(raw) + 3) // 4
        if alignment(kind) == 8:
            self._next += self._next & 1
        if self._next + words <= 4:
            self.core[self._next : self._next + words] = _words(raw)
            self._next += words
        elif self._next < 4 and not self._stack:
            here = 4 - self._next
            self.core[self._next :] = _words(raw[: 4 * here])
            self._next = 4
            self._push(raw[4 * here :], 4)
        else:
            self._next = 4
            self._push(raw, alignment(kind))

    def _push(self, raw: bytes, align: int) -> None:
        if align == 8:
            self._stack += bytes(-len(self._stack) % 8)
        self._stack += raw + bytes(-len(raw) % 4)


class Scratch:
    """A copy of the core and its memories. Calls in the copy do not affect the board."""

    def __init__(self, core: Core, image: FirmwareImage) -> None:
        self._core = core
        self._image = image
        self._copy = copy = BareCore()
        self._everything = CoreRegisters(copy, EVERYTHING)
        self._of_core = CoreRegisters(core, EVERYTHING)
        self._set = CoreRegisters(copy, _SET)
        self._flash_version = -1
        copy.read_python, copy.write_python = self._register_read, self._register_written

    def refresh(self) -> None:
        """Copy the chip's present state."""
        core, copy = self._core, self._copy
        if core.retired == 0:
            raise InputError(
                "cannot call functions before start-up; run the start-up code first: board.run_for(0.1)",
                kind="not_started",
            )
        copy.ram[:] = core.ram
        if self._flash_version != core.code_version:
            self._flash_version = core.code_version
            copy.flash[:] = core.flash
            copy.invalidate_code()
        self._everything.write(*self._of_core.read())

    def variable(self, name: str) -> CValue:
        """Return a global variable. Raises SymbolError."""
        return _symbols(self._image).read_variable(name, self._read)

    def set_variable(self, name: str, value: Any) -> None:
        """Set a variable. Raises SymbolError or InputError."""
        set_variable(self._image, name, value, self._read, self._write)

    def call(self, name: str, *arguments: Any, max_instructions: int = INSTRUCTIONS) -> Any:
        """Call a function. Raises InputError, CallError."""
        address, signature = find_function(self._image, name, arguments)
        try:
            return self.run(name, address, signature, arguments, max_instructions)
        except _NeedsBoardError as problem:
            raise CallError(
                f"{name}() {problem}; call it on the board: board.call({name!r}, ...)", kind="needs_board"
            ) from None

    def run(
        self, name: str, address: int, signature: Signature, arguments: Sequence[Any], max_instructions: int
    ) -> Any:
        """Call a function. Raises _NeedsBoardError or CallError."""
        copy = self._copy
        sp = copy.register(13)
        frame = Frame(signature, arguments, sp, self._image.hard_float)
        for at, raw in frame.writes:
            self._write(at, raw)
        xpsr = copy.register(16)
        self._set.write(*frame.core, frame.sp, _RETURN | 1, xpsr & _EXCEPTION | _THUMB_BIT, *frame.floats)
        copy.pc, copy.thumb = address, True
        if address >= RAM:
            copy.invalidate_code()
        stop = copy.run(max_instructions)
        if stop is not Stop.FETCH or copy.pc != _RETURN:
            raise self._problem(name, stop, max_instructions)
        words = list(self._set.read())
        result = frame.result(words[:4], words[len(_CORE) :], self._read)
        self._set.write(*words[:4], sp, *words[5:])
        return result

    def keep(self) -> None:
        """Copy the changed RAM to the chip."""
        self._core.ram[:] = self._copy.ram

    def _problem(self, name: str, stop: Stop, max_instructions: int) -> Exception:
        copy = self._copy
        if stop is Stop.SLICE:
            return _NeedsBoardError(f"has not returned after {max_instructions} instructions")
        if stop in _NEEDS_TIME:
            return _NeedsBoardError(f"waits, or calls an exception handler ({stop.name})")
        where = place(self._image, copy.pc)
        address = f" at 0x{copy.fault_address:08X}" if stop in _WITH_ADDRESS else ""
        return CallError(f"{name}() {_WHY.get(stop, stop.name)}{address}: in {where}", kind=stop.name.lower())

    def _read(self, address: int, size: int) -> bytes:
        content = self._copy.memory(address, size)
        if content is None:
            problem = f"{size} bytes at 0x{address:08X} are neither in flash nor in RAM"
            raise SymbolError(problem, kind="outside_memory")
        return bytes(content)

    def _write(self, address: int, raw: bytes) -> None:
        if not raw:
            return
        content = self._copy.memory(address, len(raw)) if address >= RAM else None
        if content is None:
            raise InputError(f"{len(raw)} bytes at 0x{address:08X} are not in RAM (the stack may be full)")
        content[:] = raw

    def _register_read(self, address: int, _size: int) -> int:
        raise _NeedsBoardError(f"reads a register at 0x{address:08X}")

    def _register_written(self, address: int, _size: int, _value: int) -> None:
        raise _NeedsBoardError(f"writes a register at 0x{address:08X}")


class Caller:
    """Calls functions of a board's firmware; ``restoring()`` restores the board afterwards."""

    def __init__(
        self,
        core: Core,
        image: FirmwareImage,
        run_until_ps: Callable[[int], None],
        restoring: Callable[[], AbstractContextManager[object]],
    ) -> None:
        self._core = core
        self._image = image
        self._run_until = run_until_ps
        self._restoring = restoring
        self._scratch = Scratch(core, image)

    @contextmanager
    def scratch(self) -> Iterator[Scratch]:
        self._scratch.refresh()
        yield self._scratch

    def call(
        self, name: str, arguments: Sequence[Any], keep: bool, max_instructions: int, timeout_s: float
    ) -> Any:
        """Call a function like :meth:`fcu_emulator.emulator.Board.call`."""
        address, signature = find_function(self._image, name, arguments)
        scratch = self._scratch
        scratch.refresh()
        try:
            result = scratch.run(name, address, signature, arguments, max_instructions)
        except _NeedsBoardError:
            with nullcontext() if keep else self._restoring():
                return self._on_board(name, address, signature, arguments, timeout_s)
        if keep:
            scratch.keep()
        return result

    def _on_board(
        self, name: str, address: int, signature: Signature, arguments: Sequence[Any], timeout_s: float
    ) -> Any:
        core = self._core
        if core.is_off:
            raise InputError(f"cannot call {name}(): the chip is in Standby", kind="chip_off")
        held = core.halted
        if held:
            raise InputError(
                f"{name}() accesses a peripheral, but a debugger has stopped the chip; continue the program first",
                kind="chip_held",
            )
        everything, pc, chosen = CoreRegisters(core, EVERYTHING), core.pc, CoreRegisters(core, _SET)
        saved = tuple(everything.read())
        sp, xpsr = core.register(13), core.register(16)
        frame = Frame(signature, arguments, sp, self._image.hard_float)
        for at, raw in frame.writes:
            self._store(at, raw)
        back = self._image.reset_vector & ~1
        core.wake()
        chosen.write(*frame.core, frame.sp, back | 1, xpsr & _EXCEPTION | _THUMB_BIT, *frame.floats)
        core.pc, core.thumb = address, True
        core.set_breakpoint(back, True)
        try:
            self._until_returned(name, frame.sp, back, timeout_s)
            words = list(chosen.read())
            return frame.result(words[:4], words[len(_CORE) :], self._load)
        finally:
            core.set_breakpoint(back, False)
            if core.halted:
                core.resume(False)
            everything.write(*saved)
            core.pc = pc

    def _until_returned(self, name: str, sp: int, back: int, timeout_s: float) -> None:
        core = self._core
        end_ps = core.clock.now_ps + round(timeout_s * PS_PER_S)
        while core.clock.now_ps < end_ps:
            self._run_until(min(core.clock.now_ps + _SLICE_PS, end_ps))
            if core.locked_up:
                raise CallError(f"{name}(): {core.locked_up}", kind="locked_up")
            if core.halted:
                if core.pc == back and core.register(13) == sp:
                    return
                core.resume(False)
        raise CallError(
            f"{name}() has not returned within {timeout_s:g} s of virtual time; the program is in "
            f"{place(self._image, core.pc)}; to allow more time: timeout_s=NUMBER",
            kind="timeout",
        )

    def _load(self, address: int, size: int) -> bytes:
        return bytes(self._core.memory(address, size) or bytes(size))

    def _store(self, address: int, raw: bytes) -> None:
        content = self._core.memory(address, len(raw)) if RAM <= address <= RAM + RAM_SIZE else None
        if content is None:
            raise InputError(f"{len(raw)} bytes at 0x{address:08X} are not in RAM (the stack may be full)")
        content[:] = raw


def set_variable(
    image: FirmwareImage,
    name: str,
    value: Any,
    read: Callable[[int, int], bytes],
    write: Callable[[int, bytes], None],
) -> None:
    """Set a variable. Raises SymbolError or InputError."""
    address, kind = _symbols(image).variable_type(name)
    if address < RAM:
        raise InputError(
            f"cannot change {name}: it is a constant in flash (0x{address:08X})", kind="constant"
        )
    raw = bytearray(read(address, kind.size))
    store(kind, value, raw, 0, name)
    write(address, bytes(raw))


def find_function(image: FirmwareImage, name: str, arguments: Sequence[Any]) -> tuple[int, Signature]:
    """Return address and signature. Raises InputError."""
    symbols = _symbols(image)
    try:
        address, signature = symbols.function(name)
    except SymbolError as problem:
        raise InputError(str(problem), kind="not_callable") from None
    if signature.is_variadic:
        raise InputError(
            f"cannot call {name}(): it takes a variable number of arguments",
            kind="variadic",
        )
    if len(arguments) != len(signature.parameters):
        names = ", ".join(parameter.name or "?" for parameter in signature.parameters)
        takes = (
            f"{len(signature.parameters)} argument{'s' * (len(signature.parameters) > 1)} ({names})"
            if names
            else "no arguments"
        )
        raise InputError(f"{name}() takes {takes}; {len(arguments)} given", kind="argument_count")
    return address, signature


def place(image: FirmwareImage, address: int) -> str:
    """Return function and source line of an address."""
    symbols = image.symbols
    function = symbols.function_at(address) if symbols else None
    line = symbols.line_at(address) if symbols else None
    known = [f"{function.name}()"] if function else []
    return ", ".join([*known, str(line)] if line else known) or f"0x{address:08X}"


def _symbols(image: FirmwareImage) -> Symbols:
    if image.symbols is None:
        raise InputError(
            f"{image.path} must have symbols; give the ELF that was not stripped", kind="no_symbols"
        )
    return image.symbols


def _is_one(target: CType, argument: Sequence[Any]) -> bool:
    if isinstance(target, Array):
        return True
    simple = not any(isinstance(item, list | tuple | dict | SimpleNamespace) for item in argument)
    return isinstance(target, Structure) and simple and len(argument) == len(target.members)


def _words(raw: bytes) -> list[int]:
    padded = raw + bytes(-len(raw) % 4)
    return [int.from_bytes(padded[at : at + 4], "little") for at in range(0, len(padded), 4)]
