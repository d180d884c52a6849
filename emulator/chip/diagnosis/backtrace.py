"""Function and source line of an address, and the calls that led to it.

Decision: callers are found by a search of the stack (ARMv7-M ARM B1.5.6, B1.5.8), because student
firmware rarely describes its stack frames. A word on the stack is a return address if it points to
the instruction after a BLX, or after a BL to the current function.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Container, Iterator
from typing import TYPE_CHECKING, NamedTuple

from fcu_emulator.emulator.chip.cpu.thumb import Flow, decode
from fcu_emulator.emulator.chip.image import FirmwareImage
from fcu_emulator.emulator.chip.image.symbols import FunctionAt
from fcu_emulator.emulator.chip.memory_map import FLASH_MEMORY, RAM_MEMORY

if TYPE_CHECKING:
    from fcu_emulator.emulator.chip.image.lines import SourceLine

ReadWord = Callable[[int], int | None]
ReadCode = Callable[[int, int], "memoryview[int] | None"]

CALLBACK = "HAL_TIM_PeriodElapsedCallback"
"""The HAL's callback of a timer, in which the lab reads the sensors."""
_MAX_FUNCTIONS = 500

# -- addresses as function and source line ------------------------------------------------------------------


class Places:
    """Converts an address to a name, or to a number if no name is known."""

    def __init__(self, image: FirmwareImage) -> None:
        self._symbols = image.symbols
        self.stack_top = image.stack_pointer

    def function(self, address: int) -> FunctionAt | None:
        return self._symbols.function_at(address) if self._symbols else None

    def function_name(self, address: int) -> str:
        found = self.function(address)
        return found.name if found else ""

    def place(self, address: int) -> str:
        """Return ``main(), main.c:42``, ``main() + 0x1C`` or the address."""
        function = self.function(address)
        line = self._symbols.line_at(address) if self._symbols else None
        if function is None:
            return f"{line}" if line else f"0x{address:08X}"
        if line is None:
            return f"{function.name}() + 0x{function.offset:X} (0x{address:08X})"
        return f"{function.name}(), {line}"

    def prefix(self, address: int | None) -> str:
        """Return the place with a colon, as the beginning of a summary; without an address, return an empty string."""
        return f"{self.place(address)}: " if address is not None else ""

    def line(self, address: int | None) -> dict[str, str]:
        """Return ``file`` and ``line`` of an instruction for a diagnosis' data; {} if they are unknown."""
        found = self._symbols.line_at(address) if self._symbols and address is not None else None
        return found.data() if found else {}

    def variable(self, address: int) -> str:
        symbol = self._symbols.object_at(address) if self._symbols else None
        return symbol.name if symbol else f"the variable at 0x{address:08X}"

    def definition(self, variable: int) -> SourceLine | None:
        """Return the line that defines the variable at an address."""
        return self._symbols.definition_of_variable(variable) if self._symbols else None

    def address_of(self, *names: str) -> int | None:
        """Return the address of the first known symbol in ``names``."""
        found = (name for name in names if self._symbols and name in self._symbols)
        name = next(found, None)
        return self._symbols.address_of(name) if self._symbols and name else None

    def end_of_variables(self) -> int | None:
        """Return the end of ``.bss`` from the usual linker symbols."""
        return self.address_of("_end", "end", "_ebss", "__bss_end__")

    def call_of(self, names: Container[str], start: int, code: ReadCode) -> tuple[int, str] | None:
        """Return the call in the function ``start`` that leads to one of ``names``, and this name.

        Calls by pointer are not followed.
        """
        waiting, seen = deque([(start, 0)]), {start}
        while waiting and len(seen) < _MAX_FUNCTIONS:
            address, first_site = waiting.popleft()
            function = self.function(address)
            if function is None:
                continue
            for site, target in calls_of(function, code):
                callee = self.function(target)
                if callee is None or callee.start in seen or callee.start != target & ~1:
                    continue
                if callee.name in names:
                    return first_site or site, callee.name
                seen.add(callee.start)
                waiting.append((callee.start, first_site or site))
        return None

    def file(self, address: int) -> str:
        line = self._symbols.line_at(address) if self._symbols else None
        return line.file if line else ""

    def largest_variables(self, count: int) -> list[tuple[str, int]]:
        objects = self._symbols.variables() if self._symbols else []
        largest = sorted(objects, key=lambda one: (-one.size, one.name))
        return [(one.name, one.size) for one in largest[:count]]

    def help(self) -> list[str]:
        if self._symbols is None:
            return ["The file has no symbols, so addresses are shown; run the ELF that was not stripped."]
        return []


def calls_of(function: FunctionAt, code: ReadCode) -> Iterator[tuple[int, int]]:
    """Yield the address and target of each call, and of each jump to another function."""
    address, end = function.start, function.start + function.size
    while address < end:
        content = code(address, 4)
        if content is None:
            return
        one = decode(address, content[0] | content[1] << 8, content[2] | content[3] << 8)
        leaves = one.flow in (Flow.JUMP, Flow.BRANCH) and not function.start <= one.target < end
        if one.flow is Flow.CALL or leaves:
            yield address, one.target
        address += one.size


# -- callers ------------------------------------------------------------------------------------------------

NOTE = "found by searching the stack; entries may be left over from earlier calls"

_EXC_RETURNS = (0xFFFF_FFE1, 0xFFFF_FFE9, 0xFFFF_FFED, 0xFFFF_FFF1, 0xFFFF_FFF9, 0xFFFF_FFFD)
_BLX, _BLX_MASK = 0x4780, 0xFF87  # BLX with any register (ARMv7-M ARM A7.7.19)
_TO_THREAD = 1 << 3  # bit of EXC_RETURN (ARMv7-M ARM table B1-8)
_BASIC_FRAME_BIT, _THUMB = 1 << 4, 1 << 24
_BASIC_WORDS, _FLOATING_WORDS = 8, 26
_FRAME_LR, _FRAME_PC, _FRAME_XPSR = 5, 6, 7
_INTO_CALL = 3  # a return address (with bit 0 set) minus this number is inside its BL or BLX
_LONGEST_SEARCH = 64  # words of stack searched for a saved frame
_MAX_CALLS = 12


class Call(NamedTuple):
    """The current instruction, or a caller's BL. ``times`` counts nested calls."""

    address: int
    interrupted: bool = False
    times: int = 1


class Backtrace:
    """Finds callers. The function ``word`` reads the stack, and the function ``code`` reads the flash."""

    def __init__(self, places: Places, word: ReadWord, code: ReadCode) -> None:
        self._places = places
        self._word = word
        self._code = code
        self._jumps: dict[int, frozenset[int]] = {}

    def calls(self, pc: int, lr: int, sp: int) -> list[Call]:
        """Return the calls, innermost first."""
        found: list[Call] = [Call(pc)]
        for call in self._outward(pc, lr, sp):
            last = found[-1]
            if call.address == last.address and not call.interrupted:
                found[-1] = last._replace(times=last.times + 1)
            elif len(found) < _MAX_CALLS:
                found.append(call)
        return found

    def lines(self, pc: int, lr: int, sp: int) -> list[str]:
        return [self.line(call) for call in self.calls(pc, lr, sp)[1:]]

    def line(self, call: Call) -> str:
        how = "interrupted" if call.interrupted else "called from"
        times = f", {call.times} nested calls" if call.times > 1 else ""
        return f"{how} {self._places.place(call.address)}{times}"

    def _outward(self, pc: int, lr: int, sp: int) -> Iterator[Call]:
        """Yield all callers. If a frame returns to Thread mode, ignore further frames: they are old data."""
        current, address = pc, max(sp & ~3, RAM_MEMORY.start)
        frame, exc_return = 0, 0
        if lr in _EXC_RETURNS:  # the handler has not yet saved LR
            frame, exc_return = self._find_frame(address), lr
        while True:
            if frame:
                current, lr = self._word(frame + 4 * _FRAME_PC) or 0, self._word(frame + 4 * _FRAME_LR) or 0
                if FLASH_MEMORY.holds(current, current):
                    yield Call(current, interrupted=True)
                address = frame + 4 * (_BASIC_WORDS if exc_return & _BASIC_FRAME_BIT else _FLOATING_WORDS)
                frame = 0
            if self._leads_to(lr, current):
                current = lr - _INTO_CALL
                yield Call(current)
            for place in range(address, min(self._places.stack_top, RAM_MEMORY.end), 4):
                word = self._word(place) or 0
                if not exc_return & _TO_THREAD and word in _EXC_RETURNS and self._is_frame(place + 4):
                    frame, exc_return = place + 4, word
                    break
                if self._leads_to(word, current):
                    current = word - _INTO_CALL
                    yield Call(current)
            else:
                return

    def _find_frame(self, sp: int) -> int:
        for address in range(sp, sp + 4 * _LONGEST_SEARCH, 4):
            if self._is_frame(address):
                return address
        return sp

    def _is_frame(self, address: int) -> bool:
        pc, xpsr = self._word(address + 4 * _FRAME_PC), self._word(address + 4 * _FRAME_XPSR)
        if pc is None or xpsr is None:
            return False
        return FLASH_MEMORY.holds(pc, pc + 2) and bool(xpsr & _THUMB)

    def _leads_to(self, word: int, current: int) -> bool:
        if not word & 1 or not FLASH_MEMORY.holds(word - 5, word - 1):
            return False
        code = self._code(word - 5, 4)
        if code is None:
            return False
        first, second = code[0] | code[1] << 8, code[2] | code[3] << 8
        callee = self._places.function(current)
        call = decode(word - 5, first, second)
        if call.flow is Flow.CALL:
            return callee is None or call.target == callee.start or self._ends_in(call.target, callee.start)
        caller = self._places.function(word - 5)
        elsewhere = callee is None or caller is None or caller.start != callee.start
        return second & _BLX_MASK == _BLX and elsewhere

    def _ends_in(self, function: int, target: int) -> bool:
        found = self._places.function(function)
        if found is None or found.start != function:
            return False
        if function not in self._jumps:
            self._jumps[function] = frozenset(self._jumps_of(function, function + found.size))
        return target in self._jumps[function]

    def _jumps_of(self, address: int, end: int) -> Iterator[int]:
        while address < end:
            code = self._code(address, 4)
            if code is None:
                return
            one = decode(address, code[0] | code[1] << 8, code[2] | code[3] << 8)
            if one.flow in (Flow.JUMP, Flow.BRANCH):
                yield one.target
            address += one.size
