"""Instructions that the engine executes without telling: found in the code once, and stopped in front of.

* CPSIE and MSR of a mask register, while an interrupt is held off: it is taken behind the instruction, not
  later.
* WFE and SEV: the event register is not the engine's.
* Floating point while CPACR denies it, SDIV and UDIV while CCR.DIV_0_TRP is set, unaligned accesses while
  CCR.UNALIGN_TRP is set: the engine never traps these. They are looked for only as long as that lasts.
* LDM, LDRD, LDREX, VLDR and their kin, whose addresses must always be aligned (ARMv7-M ARM A3.2.1): watched
  only if asked for, because every load and store of the program then calls Python.

Code in flash is searched as half-words; data that looks like such an instruction is never executed. Code
in RAM may change, so each instruction executed there is looked at.

In an IT block a run stops in front of such an instruction whether its condition holds or not. WFE and SEV are
not expected there.
"""

from __future__ import annotations

from enum import Enum, auto
from functools import lru_cache, partial

import numpy as np
from numpy.typing import NDArray

from emulator.arm.cpu.engine import FLASH, RAM, RAM_SIZE, Engine
from emulator.arm.cpu.stop import Stop
from emulator.arm.peripherals.peripheral import WORD

_Words = NDArray[np.uint16]


class Special(Enum):
    """What an instruction needs."""

    UNMASKS = auto()
    WFE = auto()
    SEV = auto()
    FLOATING_POINT = auto()
    DIVIDES = auto()
    ACCESS = auto()  # any load or store at an unaligned address
    WORDS = auto()  # one that needs an aligned address in any case


def find(first: _Words, second: _Words) -> dict[Special, NDArray[np.bool_]]:
    """Which of the half-words ``first``, followed by ``second``, begin a special instruction."""
    mask_register = ((second & 0xF3FF) >= 0x8010) & ((second & 0xF3FF) <= 0x8013)
    return {
        Special.UNMASKS: np.isin(first, (0xB661, 0xB662, 0xB663))
        | (first & 0xFFF0 == 0xF380) & mask_register,
        Special.WFE: first == 0xBF20,
        Special.SEV: first == 0xBF40,
        Special.FLOATING_POINT: (first & 0xEC00 == 0xEC00) & (second & 0x0E00 == 0x0A00),
        Special.DIVIDES: np.isin(first & 0xFFF0, (0xFB90, 0xFBB0)) & (second & 0x00F0 == 0x00F0),
    }


class SpecialInstructions:
    """Finds them. Runs end with PLACE in front of those that are switched on, with UNALIGNED in an access."""

    def __init__(self, engine: Engine) -> None:
        self._engine = engine
        self._watches: dict[Special, int] = {}
        self._wanted = {Special.WFE, Special.SEV}
        self._set: set[Special] = set()
        self._places = self._search_flash()
        engine.when_ram_is_executed.append(self._watch_ram)
        self._passing = -1

    def switch(self, special: Special, on: bool) -> None:
        """Look for a kind, or do not, from the next instruction on: that is set between runs."""
        if (special in self._wanted) is not on:
            (self._wanted.add if on else self._wanted.discard)(special)
            self._engine.cut()

    @property
    def to_be_set(self) -> bool:
        """Whether something has been switched since the engine was told."""
        return self._set != self._wanted

    def search_again(self) -> None:
        """The code has changed; between runs."""
        self._places = self._search_flash()
        self._set = set()

    def between_runs(self) -> None:
        """Set what is looked for; the engine must not be running."""
        if not self.to_be_set:
            return
        self._set = set(self._wanted)
        places = (self._places.get(special, ()) for special in self._set)
        self._engine.stop_in_front_of(frozenset().union(*places))
        for special in (Special.ACCESS, Special.WORDS):
            if special in self._set and special not in self._watches:
                called = partial(self._accessed, special)
                self._watches[special] = self._engine.watch_memory(0, WORD, called)
            elif special not in self._set and special in self._watches:
                self._engine.unwatch(self._watches.pop(special))

    def here(self) -> Special | None:
        """What is looked for of the next instruction; between runs."""
        code = self._engine.memory(self._engine.pc, 4)
        kinds = () if code is None else _kinds(bytes(code))
        return next((special for special in kinds if special in self._set), None)

    def run_past(self) -> Stop:
        """Execute the next instruction, whatever it is."""
        self._passing = self._engine.pc
        stop = self._engine.run_past()
        self._passing = -1
        return stop

    def _accessed(self, special: Special, address: int, size: int, _written: bool) -> None:
        """A store that is refused has been made; nothing depends on that."""
        aligned = address % min(size, 4) == 0  # a double register is two words
        if not aligned and (special is Special.ACCESS or self._needs_words(self._engine.register(15))):
            self._engine.refuse(Stop.UNALIGNED)

    def _needs_words(self, instruction: int) -> bool:
        code = self._engine.memory(instruction, 4)
        return code is not None and needs_words(code[0] | code[1] << 8, code[2] | code[3] << 8)

    def _search_flash(self) -> dict[Special, list[int]]:
        words: _Words = np.frombuffer(self._engine.flash, dtype="<u2")
        found = find(words[:-1], words[1:])
        return {
            special: [FLASH + 2 * int(at) for at in np.flatnonzero(hit)] for special, hit in found.items()
        }

    def _watch_ram(self) -> None:
        self._engine.watch(RAM, RAM + RAM_SIZE - 1, self._in_ram)

    def _in_ram(self, address: int) -> None:
        code = self._engine.memory(address, 4)
        if code is not None and address != self._passing and self._set.intersection(_kinds(bytes(code))):
            self._engine.refuse(Stop.PLACE)


def needs_words(first: int, second: int) -> bool:
    """Whether an instruction faults at an unaligned address whatever CCR says (A3.2.1): load and store
    multiple, dual and exclusive (A5.2.6, A5.3.5, A5.3.6), and those of floating point (A6.5, A6.6).
    """
    floating = first & 0xEE00 == 0xEC00 and second & 0x0E00 == 0x0A00
    return floating or first & 0xFE00 == 0xE800 or first >> 12 == 0b1100


@lru_cache(maxsize=4096)
def _kinds(code: bytes) -> tuple[Special, ...]:
    """What an instruction in RAM needs; the search is made for arrays and takes 100 us for a single one."""
    words: _Words = np.frombuffer(code, dtype="<u2")
    return tuple(special for special, hit in find(words[:1], words[1:]).items() if hit[0])
