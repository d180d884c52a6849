"""A run of instructions gives the same result in one piece, in several pieces, and in single steps.

The C core executes blocks of instructions and counts them in advance. If a limit, a breakpoint or a debugger
interrupts a block, the result must be the same as if each instruction had been executed and counted separately. So
the same random code, which overwrites itself, branches into itself and accesses a device that ends runs, is run in
several ways.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from itertools import repeat
from random import Random

import pytest

from fcu_emulator.emulator.chip.cpu.bare_core import BareCore, Stop
from fcu_emulator.emulator.chip.cpu.core_registers import CORE, EVERYTHING, IT_BITS, CoreRegisters
from fcu_emulator.emulator.chip.memory_map import FLASH, RAM, RAM_SIZE
from tests.support.arm.random_code import random_code

INSTRUCTIONS = 400
SEEDS, EACH = 120, 20
CODE_SIZE = 0x400
DEVICE = 0x4002_0000
RAM_CODE = RAM + 0x800
THUMB = 1 << 24

Limits = Callable[[Random], Iterator[int]]
"""The maximum number of instructions of each run."""


@dataclass
class Outcome:
    """The results of a program. ``stops`` has, for each early end of a run, the instructions so far, PC and reason.

    ``seen`` has, for each access to the device, the access, the instructions so far, and the registers.
    """

    executed: int = 0
    stops: list[tuple[int, int, Stop]] = field(default_factory=list)
    registers: tuple[int, ...] = ()
    ram: bytes = b""
    seen: list[tuple[object, ...]] = field(default_factory=list)


class Program:
    """Random code in flash and in RAM, and a device; ``seed`` determines everything."""

    def __init__(self, seed: int) -> None:
        random = Random(seed)
        self.engine = engine = BareCore()
        self._everything = CoreRegisters(engine, (*EVERYTHING, "pc"))
        self._before = CoreRegisters(engine, EVERYTHING)
        self._visible = CoreRegisters(engine, CORE)
        engine.ram[:] = random.randbytes(RAM_SIZE)
        engine.ram[RAM_CODE - RAM : RAM_CODE - RAM + CODE_SIZE] = random_code(random, CODE_SIZE)
        engine.flash[0x200 : 0x200 + CODE_SIZE] = random_code(random, CODE_SIZE)
        engine.invalidate_code()
        self.base = RAM_CODE if seed % 3 == 0 else FLASH + 0x200 if seed % 3 == 1 else 0x200
        engine.pc, engine.thumb = self.base, True
        values = {name: random.getrandbits(32) for name in EVERYTHING if name[0] in "rs" and name != "sp"}
        values |= {
            "xpsr": THUMB | random.getrandbits(5) << 27,
            "msp": RAM + 0x2000,
            "r8": RAM + 0x4000,
            "r9": RAM_CODE + random.randrange(0, CODE_SIZE, 4),
            "r10": DEVICE,
            "r11": FLASH + 0x200,
            "sp": RAM + 0x2000,
            "lr": self.base + random.randrange(0, 0x80, 2) + 1,
        }
        self._before.write(*(values.get(name, 0) for name in EVERYTHING))
        engine.read_python, engine.write_python = self._read, self._write
        self.outcome = Outcome()
        self._cuts = seed % 5 < 3

    def _look(self, kind: str, offset: int, value: int) -> None:
        engine = self.engine
        at = self.outcome.executed + engine.count()
        self.outcome.seen.append((kind, at, offset, value, *self._visible.read()))
        if self._cuts and at % 7 == 0:
            engine.end_run()

    def _read(self, address: int, size: int) -> int:
        self._look("read", address, size)
        return (self.outcome.executed + self.engine.count()) * 0x0101_0101 & (1 << 8 * size) - 1

    def _write(self, address: int, _size: int, value: int) -> None:
        self._look("write", address, value)

    def run(self, limits: Iterator[int], places: frozenset[int] = frozenset()) -> Outcome:
        """Run this number of instructions. After an instruction that cannot be executed, continue elsewhere."""
        engine, outcome = self.engine, self.outcome
        for place in places:
            engine.stop_before(place)
        stop = Stop.SLICE
        while outcome.executed < INSTRUCTIONS or (stop is Stop.BREAKPOINT and self._in_it_block()):
            if stop is Stop.BREAKPOINT:
                assert engine.pc in places
                stop = engine.run(1, past=True)
            else:
                stop = engine.run(min(next(limits), INSTRUCTIONS - outcome.executed))
            outcome.executed += engine.executed
            if stop not in (Stop.SLICE, Stop.BREAKPOINT):
                self._recover(stop)
                stop = Stop.SLICE
        outcome.registers = (*self._everything.read()[:-1], engine.pc)
        outcome.ram = bytes(engine.ram)
        return outcome

    def _in_it_block(self) -> bool:
        return bool(self._visible.read()[CORE.index("xpsr")] & IT_BITS)

    def _recover(self, stop: Stop) -> None:
        """Continue two bytes after the instruction, or from the beginning. ITSTATE does not change."""
        engine, outcome = self.engine, self.outcome
        outcome.stops.append((outcome.executed, engine.pc, stop))
        outcome.executed += 1  # a fetch counts for nothing, and there may be many
        inside = self.base <= engine.pc < self.base + CODE_SIZE - 4
        engine.pc = (engine.pc + 2 if inside else self.base + 2 * (outcome.executed % 64)) & ~1
        engine.thumb = True


def at_once(_random: Random) -> Iterator[int]:
    return repeat(INSTRUCTIONS)


def one_by_one(_random: Random) -> Iterator[int]:
    return repeat(1)


def in_pieces(random: Random) -> Iterator[int]:
    while True:
        yield random.choice((1, 2, 3, 5, 8, 40))


def some_places(random: Random, program: Program) -> frozenset[int]:
    return frozenset(program.base + 2 * random.randrange(CODE_SIZE // 2) for _ in range(60))


@pytest.mark.parametrize("first_seed", range(0, SEEDS, EACH))
def test_split_run_equals_single_run(first_seed: int) -> None:
    for seed in range(first_seed, first_seed + EACH):
        whole = Program(seed).run(at_once(Random(seed)))
        for limits in (one_by_one, in_pieces):
            assert Program(seed).run(limits(Random(seed))) == whole, (seed, limits.__name__)


@pytest.mark.parametrize("first_seed", range(0, SEEDS, EACH))
def test_breakpoints_do_not_change_result(first_seed: int) -> None:
    for seed in range(first_seed, first_seed + EACH):
        whole = Program(seed).run(at_once(Random(seed)))
        for limits in (at_once, in_pieces):
            program = Program(seed)
            places = some_places(Random(seed), program)
            assert program.run(limits(Random(seed)), places) == whole, (seed, limits.__name__)


@pytest.mark.parametrize("first_seed", range(0, SEEDS, EACH))
def test_watching_memory_does_not_change_result(first_seed: int) -> None:
    seen: list[int] = []
    for seed in range(first_seed, first_seed + EACH):
        whole = Program(seed).run(at_once(Random(seed)))
        program = Program(seed)
        program.engine.on_access = lambda address, _size, _written, seen=seen: seen.append(address)
        program.engine.watch_memory(0, 0xFFFF_FFFF)
        outcome = program.run(at_once(Random(seed)))
        assert outcome == whole, seed
    assert seen


def test_random_programs_fault_rarely_and_access_devices() -> None:
    """Only a few instructions fault, and the programs access devices."""
    outcomes = [Program(seed).run(at_once(Random(seed))) for seed in range(SEEDS)]
    assert sum(len(outcome.stops) for outcome in outcomes) < SEEDS * INSTRUCTIONS // 4
    assert sum(len(outcome.seen) for outcome in outcomes) > SEEDS
