"""Detection of a variable without ``volatile`` that is read once, before a loop.

A compiler may turn ``while (!ready) {}`` into one load and a loop without reads. Execution in a copy
of the core proves it: the variable's present value ends the loop, and another value does not.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

from fcu_emulator.emulator.chip.cpu.bare_core import BareCore, Stop
from fcu_emulator.emulator.chip.cpu.core import Core
from fcu_emulator.emulator.chip.cpu.core_registers import EVERYTHING, CoreRegisters
from fcu_emulator.emulator.chip.cpu.thumb import decode
from fcu_emulator.emulator.chip.diagnosis.backtrace import Places
from fcu_emulator.emulator.chip.diagnosis.report import Cause
from fcu_emulator.emulator.chip.memory_map import RAM, RAM_SIZE

_FARTHEST = 32  # bytes before the loop
_STEPS = 24
_OTHER_VALUES = (0, 1, 0xFFFF_FFFF, 0x7FFF_FFFF, 0x8000_0000)


def read_once(core: Core, places: Places, loop: frozenset[int]) -> Cause | None:
    """Report the variable whose earlier value is the reason for the loop."""
    condition = _Condition(core, max(loop))
    starts = _instructions(core, places, min(loop))
    seen = (condition.decided_by(start) for start in starts)
    # the first match is the farthest from the loop, so that execution also loads the variable's address
    variable = next(filter(None, seen), None)
    if variable is None:
        return None
    name, definition = places.variable(variable.address), places.definition(variable.address)
    where = f" in {definition}" if definition is not None else ""
    return Cause(
        f"{name} is read once, before the loop, and never again: it is not volatile",
        [
            f"{name} was read in {places.place(variable.load)}; the loop itself reads no memory.",
            f"Now {name} is {variable.value}, which would end the loop.",
            "The compiler may keep a variable in a register if this function does not change it.",
            f"If an interrupt changes {name}, declare it volatile{where}: volatile ... {name};",
            "Without optimisation (-O0) the same program happens to work.",
        ],
    )


def _instructions(core: Core, places: Places, begin: int) -> Iterator[int]:
    function = places.function(begin)
    address = function.start if function is not None else begin - _FARTHEST
    while address < begin:
        code = core.memory(address, 4)
        if code is None:
            return
        if address >= begin - _FARTHEST:
            yield address
        address += decode(address, code[0] | code[1] << 8, code[2] | code[3] << 8).size


class _Variable(NamedTuple):
    """A variable; ``load`` is the address of the instruction that reads it."""

    address: int
    load: int
    value: int


class _Load(NamedTuple):
    address: int
    size: int
    at: int


class _Condition:
    """The instructions around a loop, executed in a copy."""

    def __init__(self, core: Core, last: int) -> None:
        self._last = last
        self._ram = bytes(core.ram)
        self._registers = tuple(CoreRegisters(core, EVERYTHING).read())
        self._copy = copy = BareCore()
        copy.flash[:] = core.flash
        copy.read_python, copy.write_python = self._peripheral_read, self._peripheral_written
        copy.on_access = self._accessed
        copy.watch_memory(RAM, RAM + RAM_SIZE - 1)
        self._acts = False
        self._loads: list[_Load] = []
        self._at = 0

    def decided_by(self, start: int) -> _Variable | None:
        if self._stays(start) is not False:
            return None
        address, size, load = self._loads[0]
        for value in _OTHER_VALUES:
            if self._stays(start, (address, (value & (1 << 8 * size) - 1).to_bytes(size, "little"))):
                now = self._ram[address - RAM : address - RAM + size]
                return _Variable(address, load, int.from_bytes(now, "little"))
        return None

    def _stays(self, start: int, other: tuple[int, bytes] | None = None) -> bool | None:
        """Return whether execution stays in the loop; None if it loads nothing, loads twice or has other effects."""
        copy = self._copy
        copy.ram[:] = self._ram
        if other is not None:
            address, data = other
            copy.ram[address - RAM : address - RAM + len(data)] = data
        CoreRegisters(copy, EVERYTHING).write(*self._registers)
        copy.pc, copy.thumb = start, True
        self._acts = False
        self._loads.clear()
        for _ in range(_STEPS):
            self._at = copy.pc
            if not start <= self._at <= self._last:
                return False if self._loads else None
            if copy.run(1) is not Stop.SLICE or self._acts or len(self._loads) > 1:
                return None
        return True if self._loads else None

    def _accessed(self, address: int, size: int, written: bool) -> None:
        self._acts |= written
        self._loads.append(_Load(address, size, self._at))

    def _peripheral_read(self, _address: int, _size: int) -> int:
        self._acts = True
        return 0

    def _peripheral_written(self, _address: int, _size: int, _value: int) -> None:
        self._acts = True
