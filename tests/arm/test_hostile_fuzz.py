"""Three hundred random programs, five milliseconds each: none raises, none hangs, time goes on exactly.

Fixed seeds, so that every run executes the same programs. What bounds a run is the number of instructions:
5 ms at 84 MHz and 1.3 cycles each are 323,000.
"""

from __future__ import annotations

import struct
from collections.abc import Callable
from pathlib import Path
from random import Random

import pytest

from emulator.arm.cpu.memory_map import BLOCKS
from emulator.clock import PS_PER_MS
from tests.arm.hostile_programs import (
    CODE,
    EVERY_CLOCK_AND_INTERRUPT,
    FLASH,
    RAM,
    STACK,
    board_with,
    program,
)

END_PS = 5 * PS_PER_MS
MOST_INSTRUCTIONS = 323_100
RANDOM_CODE = 0x800  # bytes

GO_ON_SOMEWHERE = f"""
fault:
interrupt:
    mrs r0, msp
    ldr r1, [r0, #24]          ; the instruction that could not be executed
    adds r1, #2
    mov32 r2, {RANDOM_CODE - 2}
    ands r1, r2
    mov32 r2, CODE_AT
    adds r1, r1, r2
    str r1, [r0, #24]
    movs r1, #1                ; xPSR: Thumb state, no IT block
    lsls r1, r1, #24
    str r1, [r0, #28]
    bx lr
"""
PLACES = (
    *(base for base, _ in BLOCKS.values()),
    0x0000_0000,
    FLASH,
    RAM,
    0x2000_8000,
    STACK - 16,
    0x1FFF_7A00,
    0x2200_0000,
    0x4247_0000,
    0xE000_ED00,
    0x6000_0000,
    0xFFFF_FFFC,
)
VALUES = (0, 1, 2, 3, 0x7F, 0xFFFF, 0x8000_0000, 0xFFFF_FFFF, 0x5555, 0xCCCC, 0xAAAA, 0x05FA_0004, RAM)
LOADS_AND_STORES = (0x6000, 0x6800, 0x7000, 0x7800, 0x8000, 0x8800)


def noise(random: Random) -> bytes:
    """A vector table that loads, and bytes."""
    table = struct.pack("<16I", STACK, FLASH | 0x41, *(FLASH + random.randrange(0x1000) for _ in range(14)))
    return table + random.randbytes(0x1000)


def instructions(random: Random) -> bytes:
    """Instructions in a hundred combinations, registers pointing at blocks; faults are stepped over."""
    registers = "".join(f"mov32 r{n}, {random.choice(PLACES) + 4 * random.randrange(64)}\n" for n in range(8))
    head = f"reset:\n{registers}b random\n{GO_ON_SOMEWHERE}random:\n"
    size = len(program(head.replace("CODE_AT", "RAM"))) - (CODE - FLASH)
    start = CODE + size - 2  # over ``stuck``, which ends the program
    code = b"".join(_instruction(random) for _ in range(RANDOM_CODE // 2))[:RANDOM_CODE]
    whole = program(head.replace("CODE_AT", str(start + 2)))
    return whole[: start - FLASH] + b"\x00\xbf" + code


def _instruction(random: Random) -> bytes:
    kind = random.random()
    if kind < 0.4:  # loads and stores with an offset
        return _half(random.choice(LOADS_AND_STORES) | random.randrange(0x800))
    if kind < 0.65:  # arithmetic
        return _half(random.randrange(0x2000, 0x4800))
    if kind < 0.75:  # branches
        return _half(0xD000 | random.randrange(0xE00))
    if kind < 0.8:  # CPS, WFI, WFE, SEV, SVC, BKPT, IT
        return _half(random.choice((0xB662, 0xB672, 0xB661, 0xBF30, 0xBF20, 0xBF40, 0xDF00, 0xBE00, 0xBF08)))
    if kind < 0.9:  # of four bytes: multiple loads, floating point, multiplication, division, MSR
        return _half(0xE800 | random.randrange(0x1800)) + random.randbytes(2)
    return random.randbytes(2)


def _half(word: int) -> bytes:
    return struct.pack("<H", word)


def register_writes(random: Random) -> bytes:
    """Any values to any registers of some blocks, all of them clocked and allowed to interrupt."""
    entries = b"".join(_write(random) for _ in range(random.choice((20, 100, 400))))
    source = f"""
    reset: {EVERY_CLOCK_AND_INTERRUPT}
    begin: mov32 r0, table
           mov32 r4, {len(entries) // 12}
    again: ldmia r0!, {{r1, r2, r3}}
           cmp r3, #1
           beq half
           cmp r3, #2
           beq byte
           str r2, [r1]
           b next
    half:  strh r2, [r1, #2]
           b next
    byte:  strb r2, [r1, #1]
    next:  ldr r2, [r1]
           subs r4, #1
           bne again
           b begin
    fault: mrs r0, msp
           mov32 r1, again
           str r1, [r0, #24]
           bx lr
    interrupt: bx lr
    """
    end = FLASH + len(program(source.replace("table", "RAM")))
    return program(source.replace("table", str(end)), behind=entries)


def _write(random: Random) -> bytes:
    name, (base, _) = random.choice(tuple(BLOCKS.items()))
    if name in {"IWDG", "WWDG"} and random.random() < 0.9:
        base = BLOCKS["TIM2"][0]  # else nearly every program would end as a chain of resets
    value = random.choice(VALUES) if random.random() < 0.4 else random.getrandbits(random.choice((4, 16, 32)))
    return struct.pack("<3I", base + 4 * random.randrange(0x18), value, random.choice((0, 0, 1, 2)))


def survives(data: bytes, folder: Path) -> None:
    board = board_with(data, folder)
    assert board.arm is not None
    board.run_until(END_PS)
    assert board.clock.now_ps == END_PS
    assert 0 < board.arm.chip.core.timeline.retired <= MOST_INSTRUCTIONS
    assert len(board.trace) < 50_000


@pytest.mark.parametrize("shard", range(5))
@pytest.mark.parametrize("made", [noise, instructions, register_writes])
def test_random_programs(made: Callable[[Random], bytes], shard: int, tmp_path: Path) -> None:
    random = Random(f"{made.__name__} {shard}")
    for _ in range(20):
        survives(made(random), tmp_path)


def test_the_random_programs_do_something(tmp_path: Path) -> None:
    """They are executed, not only refused: registers of many blocks are met, and interrupts come."""
    random = Random(0)
    kinds = (instructions, register_writes)
    boards = [board_with(made(random), tmp_path) for made in kinds for _ in range(5)]
    for board in boards:
        board.run_until(END_PS)
    chips = [board.arm.chip.core for board in boards if board.arm is not None]

    assert sum(chip.timeline.retired > 5_000 for chip in chips) > 5
    assert sum(chip.waiting.accesses > 200 for chip in chips) > 4
