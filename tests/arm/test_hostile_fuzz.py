"""Five hundred random programs run for five milliseconds each, without an exception, a hang, or an error of time.

The seeds are fixed, so that every run executes the same programs. The number of instructions limits a run: 5 ms at 84
MHz and 1.3 cycles each are 323,000. A PLL with too high a frequency gives up to 48 times as many.
"""

from __future__ import annotations

import struct
from collections.abc import Callable
from pathlib import Path
from random import Random

import pytest

from fcu_emulator.emulator.chip.memory_map import ADDRESSES
from fcu_emulator.emulator.clock import PS_PER_MS
from tests.support.arm.hostile_programs import (
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
HIGHEST_PLL = 49  # N = 511 of 16 MHz, divided by 2, instead of 84 MHz
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
    *(base for base, _ in ADDRESSES.values()),
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
RCC_CR, RCC_PLLCFGR, RCC_CFGR, RCC_DCKCFGR = (0x4002_3800 + offset for offset in (0, 4, 8, 0x8C))
LOADS_AND_STORES = (0x6000, 0x6800, 0x7000, 0x7800, 0x8000, 0x8800)


def noise(random: Random) -> bytes:
    """Return a valid vector table, followed by random bytes."""
    table = struct.pack("<16I", STACK, FLASH | 0x41, *(FLASH + random.randrange(0x1000) for _ in range(14)))
    return table + random.randbytes(0x1000)


def instructions(random: Random) -> bytes:
    """Return instructions in a hundred combinations, with registers that point at peripherals. Faults are skipped."""
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
    """Return writes of random values to registers of some peripherals, which all have clocks and enabled interrupts."""
    return _from_table([_write(random) for _ in range(random.choice((20, 100, 400)))])


def clock_settings(random: Random) -> bytes:
    """Return writes as above, and many changes of the clocks of core and buses. Most changes are not permitted."""
    entries = []
    for _ in range(random.choice((1, 2, 5))):
        entries += _clocks(random)
        entries += [_write(random) for _ in range(random.choice((5, 20, 60)))]
        entries.append(_entry(0, random.choice((10, 100, 1000)), _WAIT))
    return _from_table(entries)


def transfers(random: Random) -> bytes:
    """Return peripherals that are set up well enough to work, with DMA between any addresses, in any order."""
    makers = (_dma_stream, _dma_stream, _serial, _spi, _i2c, _timer)
    entries = [
        _entry(ADDRESSES[f"GPIO{port}"][0] + offset, value) for port in "ABC" for offset, value in _PINS
    ]
    for _ in range(random.choice((4, 12, 40))):
        entries += random.choice(makers)(random)
        if random.random() < 0.3:
            entries.append(_entry(0, random.choice((10, 100, 2_000)), _WAIT))
    return _from_table(entries)


_PINS = (0x00, 0xAAAA_AAAA), (0x20, 0x7755_9444), (0x24, 0x5555_4474)
"""MODER, AFRL, AFRH: all pins are alternate functions."""
_DATA = tuple(
    ADDRESSES[name][0] + offset
    for names, offset in ((("USART1", "USART2"), 4), (("SPI1", "SPI2"), 12), (("I2C1", "I2C2"), 16))
    for name in names
)


def _dma_stream(random: Random) -> list[bytes]:
    """RM0368 section 9.5: SxNDTR, SxPAR, SxM0AR, SxM1AR, SxFCR, then SxCR with EN."""
    base = ADDRESSES[random.choice(("DMA1", "DMA2"))][0] + 0x10 + 0x18 * random.randrange(8)
    memory = (RAM + 0x4000, RAM + random.getrandbits(16), STACK - random.randrange(8), random.choice(PLACES))
    ends = [random.choice((random.choice(memory), random.choice(_DATA))) for _ in range(3)]
    return [
        _entry(base, 0),
        _entry(base + 4, random.choice((0, 1, 3, 8, 100, 0xFFFF))),
        *(_entry(base + 8 + 4 * n, address) for n, address in enumerate(ends)),
        _entry(base + 20, random.getrandbits(8)),
        _entry(base, random.getrandbits(28) | (random.random() < 0.9)),
    ]


def _serial(random: Random) -> list[bytes]:
    base = ADDRESSES[random.choice(("USART1", "USART2", "USART6"))][0]
    return [
        _entry(base + 8, random.choice((16, 139, random.getrandbits(16)))),
        _entry(base + 12, 1 << 13 | random.getrandbits(13)),
        _entry(base + 20, random.getrandbits(12)),
        _entry(base + 4, random.getrandbits(9)),
    ]


def _spi(random: Random) -> list[bytes]:
    base = ADDRESSES[random.choice(("SPI1", "SPI2", "SPI3"))][0]
    return [
        _entry(base + 4, random.getrandbits(8)),
        _entry(base, random.choice((0x0344, 0xC344, random.getrandbits(16))) | 0x40),
        _entry(base + 12, random.getrandbits(16)),
    ]


def _i2c(random: Random) -> list[bytes]:
    base = ADDRESSES[random.choice(("I2C1", "I2C2", "I2C3"))][0]
    return [
        _entry(base, 0),
        _entry(base + 4, random.choice((16, 42, 2, random.getrandbits(6))) | random.getrandbits(5) << 8),
        _entry(base + 28, random.choice((80, 1 << 15 | 14, random.getrandbits(16)))),
        _entry(base + 32, random.getrandbits(6)),
        _entry(base, 1 | random.getrandbits(4) << 8),
        _entry(0, 100, _WAIT),
        _entry(base + 16, random.choice((0xD6, 0xD7, 0x3C, 0xBA, random.getrandbits(8)))),
        _entry(0, random.choice((10, 300)), _WAIT),
        _entry(base + 16, random.getrandbits(8)),
    ]


def _timer(random: Random) -> list[bytes]:
    base = ADDRESSES[f"TIM{random.choice((1, 2, 3, 4, 5, 9, 10, 11))}"][0]
    return [
        _entry(base + 0x28, random.choice((0, 1, 99, random.getrandbits(16)))),
        _entry(base + 0x2C, random.choice((0, 1, 2, 999, random.getrandbits(32)))),
        *(
            _entry(base + offset, random.getrandbits(16))
            for offset in (0x04, 0x08, 0x18, 0x1C, 0x20, 0x34, 0x44)
        ),
        _entry(base + 0x0C, random.getrandbits(15)),
        _entry(base, random.getrandbits(10) | 1),
    ]


_HALF, _BYTE, _WAIT = 1, 2, 3
"""Uses of an entry's value other than storing a word."""


def _from_table(entries: list[bytes]) -> bytes:
    """Return a program that carries out the entries in a loop, even after faults.

    Each interrupt is disabled by its handler until then. Otherwise the first interrupt that is not served would end
    the program.
    """
    source = f"""
    reset: {EVERY_CLOCK_AND_INTERRUPT}
           mov32 r0, table
           mov32 r4, {len(entries)}
    again: ldmia r0!, {{r1, r2, r3}}
           cmp r3, #{_HALF}
           beq half
           cmp r3, #{_BYTE}
           beq byte
           cmp r3, #{_WAIT}
           beq wait
           str r2, [r1]
           b next
    wait:  subs r2, #1
           bne wait
           b over
    half:  strh r2, [r1, #2]
           b next
    byte:  strb r2, [r1, #1]
    next:  ldr r2, [r1]
    over:  subs r4, #1
           bne again
           b reset
    fault: mrs r0, msp
           mov32 r1, again
           str r1, [r0, #24]
           bx lr
    interrupt:
           mrs r0, ipsr
           subs r0, #16               ; less is an exception of the core
           bcc none
           movs r3, #32
           udiv r1, r0, r3
           lsls r1, r1, #2
           mov32 r2, 0xE000E180       ; NVIC_ICER0; the 32 interrupts of its register
           adds r2, r2, r1
           movs r1, #0
           subs r1, #1
           str r1, [r2]
    none:  bx lr
    """
    end = FLASH + len(program(source.replace("table", "RAM")))
    return program(source.replace("table", str(end)), behind=b"".join(entries))


def _entry(address: int, value: int, kind: int = 0) -> bytes:
    return struct.pack("<3I", address, value, kind)


def _clocks(random: Random) -> list[bytes]:
    """Select HSI, then sometimes a PLL with any factors as SYSCLK, and any prescalers (RM0368 6.3.1 to 6.3.3)."""
    n = random.choice((0, 0, 1, 2, 50, 192, 336, 432, 511, random.randrange(512)))
    m = random.choice((0, 1, 2, 8, 16, 63, random.randrange(64)))
    pllcfgr = (
        random.getrandbits(4) << 24 | random.getrandbits(1) << 22 | random.getrandbits(2) << 16 | n << 6 | m
    )
    prescalers = random.choice((0, 0xF, random.getrandbits(4))) << 4 | random.getrandbits(6) << 10
    return [
        _entry(RCC_CFGR, 0),
        _entry(RCC_CR, 1 << 16 | 1),
        _entry(RCC_PLLCFGR, pllcfgr),
        _entry(RCC_CR, 1 << 26 | 1 << 24 | 1 << 16 | 1),
        _entry(0, random.choice((300, 1_000, 6_000)), _WAIT),
        _entry(RCC_DCKCFGR, random.getrandbits(1) << 24),
        _entry(RCC_CFGR, prescalers | random.choice((2, 2, 2, 0, 1, 3))),
    ]


def _write(random: Random) -> bytes:
    name, (base, _) = random.choice(tuple(ADDRESSES.items()))
    if name in {"IWDG", "WWDG"} and random.random() < 0.9:
        base = ADDRESSES["TIM2"][0]  # else nearly every program would end as a chain of resets
    value = random.choice(VALUES) if random.random() < 0.4 else random.getrandbits(random.choice((4, 16, 32)))
    return _entry(base + 4 * random.randrange(0x18), value, random.choice((0, 0, _HALF, _BYTE)))


def survives(data: bytes, folder: Path, most: int = MOST_INSTRUCTIONS) -> None:
    board = board_with(data, folder)
    assert board.chip is not None
    board.run_until_ps(END_PS)
    assert board.clock.now_ps == END_PS
    assert 0 < board.chip.core.retired <= most
    assert len(board.trace) < 50_000


@pytest.mark.parametrize("shard", range(5))
@pytest.mark.parametrize("made", [noise, instructions, register_writes, transfers])
def test_random_programs_do_not_break_board(
    made: Callable[[Random], bytes], shard: int, tmp_path: Path
) -> None:
    random = Random(f"{made.__name__} {shard}")
    for _ in range(20):
        survives(made(random), tmp_path)


@pytest.mark.parametrize("shard", range(5))
def test_random_clock_settings_do_not_break_board(shard: int, tmp_path: Path) -> None:
    random = Random(f"clocks {shard}")
    for _ in range(20):
        survives(clock_settings(random), tmp_path, HIGHEST_PLL * MOST_INSTRUCTIONS)


def test_random_programs_do_something(tmp_path: Path) -> None:
    """The programs are executed and not only refused: they access registers of many peripherals, and interrupts occur."""
    random = Random(0)
    kinds = (instructions, register_writes)
    boards = [board_with(made(random), tmp_path) for made in kinds for _ in range(5)]
    for board in boards:
        board.run_until_ps(END_PS)
    chips = [board.chip.core for board in boards if board.chip is not None]

    assert sum(chip.retired > 5_000 for chip in chips) > 5
    assert sum(chip.status().accesses > 200 for chip in chips) > 4
