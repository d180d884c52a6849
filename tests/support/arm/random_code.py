"""Streams of random instructions: most of them are legal and reach only nearby addresses, some are arbitrary."""

from __future__ import annotations

import struct
from collections.abc import Callable
from random import Random

Draw = Callable[[Random], tuple[int, ...]]
"""The half-words of an instruction."""

_BASES = (8, 9, 10, 11)
"""Registers that :func:`tests.arm.test_native_division.setting` has point to memory and to the device."""


def _low(random: Random) -> int:
    return random.randrange(8)


def _any_register(random: Random) -> int:
    return random.choice((0, 1, 2, 3, 4, 5, 6, 7, 12, 14))


def _data16(random: Random) -> tuple[int, ...]:
    """Return shifts, immediates, or operations on two registers: all of 000x, 001x and 010000."""
    return (random.choice((random.randrange(0x4000), 0x4000 | random.randrange(0x400))),)


def _data32(random: Random) -> tuple[int, ...]:
    """Return operations with modified constants and shifted registers."""
    first = random.choice((0xF000, 0xEA00)) | random.choice((0, 1, 2, 3, 4, 8, 10, 11, 13, 14)) << 5
    constant = random.randrange(8) << 12 | random.randrange(0x100)
    return first | random.randrange(2) << 4 | _any_register(random), constant | _any_register(random) << 8


def _dsp(random: Random) -> tuple[int, ...]:
    first = random.choice((0xFA00, 0xFA80, 0xFB00, 0xFB80, 0xFBB0, 0xFB90)) | random.randrange(0x40) & 0x70
    second = random.randrange(0x10000) & 0xF0F0 | _any_register(random) << 8 | _any_register(random)
    return first | _any_register(random), second


def _single(random: Random) -> tuple[int, ...]:
    """Return loads and stores with an offset of 12 bits, of 8 bits, and with write-back."""
    operation = random.choice((0xF880, 0xF890, 0xF8A0, 0xF8B0, 0xF8C0, 0xF8D0, 0xF990, 0xF9B0))
    first = operation | random.choice(_BASES)
    if random.randrange(3):
        return first, _any_register(random) << 12 | random.randrange(0x200)
    form = random.choice((0x900, 0xB00, 0xC00, 0xD00, 0xE00, 0xF00))
    return first & ~0x80, _any_register(random) << 12 | form | random.randrange(0x100)


def _several(random: Random) -> tuple[int, ...]:
    """Return PUSH, POP, LDM, STM, LDRD or STRD."""
    kind = random.randrange(3)
    if kind == 0:
        return (random.choice((0xB400, 0xBC00)) | random.randrange(1, 0x100),)
    if kind == 1:
        first = random.choice((0xE880, 0xE890, 0xE900, 0xE910, 0xE8A0, 0xE8B0, 0xE920, 0xE930))
        return first | random.choice(_BASES), random.randrange(1, 0x100) | 1 << 12
    first = random.choice((0xE940, 0xE950, 0xE9C0, 0xE9D0, 0xE960, 0xE8F0)) | random.choice(_BASES)
    return first, _low(random) << 12 | 12 << 8 | random.randrange(0x40)


def _exclusive(random: Random) -> tuple[int, ...]:
    base = random.choice(_BASES)
    load = 0xE850 | base, _low(random) << 12 | 0xF00
    store = 0xE840 | base, _low(random) << 12 | _low(random) << 8
    return random.choice((load, store))


def _literal(random: Random) -> tuple[int, ...]:
    return (0x4800 | random.randrange(0x800),)


def _branch(random: Random) -> tuple[int, ...]:
    """Return a branch over a few instructions, forward or back."""
    distance = random.randrange(-12, 24)
    kind = random.randrange(5)
    if kind < 3:
        return (0xD000 | random.randrange(14) << 8 | distance & 0xFF,)
    if kind == 3:
        return (0xB100 | random.randrange(2) << 11 | (distance & 0x1F) << 3 | _low(random),)
    return (0xE000 | distance & 0x7FF,)


def _long_branch(random: Random) -> tuple[int, ...]:
    """Return BL over an even distance, or BX LR."""
    distance = random.randrange(-12, 24)
    bl = 0xF000 | (0x400 if distance < 0 else 0) | distance >> 11 & 0x3FF, 0xF800 | distance & 0x7FF
    return random.choice((bl, (0x4770,)))


def _it_block(random: Random) -> tuple[int, ...]:
    """Return IT and its instructions, with a branch only as the last one; some are not permitted there."""
    length = random.randrange(1, 5)
    mask = 1 << 4 - length | random.randrange(1 << 4) & -(1 << 5 - length) & 0xF
    words = [0xBF00 | random.randrange(14) << 4 | mask]
    for _ in range(length - 1):
        words += random.choice((_data16, _data32, _single, _high))(random)
    words += random.choice((_data16, _single, _branch, _long_branch, _several))(random)
    return tuple(words) if random.randrange(20) else (0xBF00 | random.randrange(0x100),)


def _high(random: Random) -> tuple[int, ...]:
    """Return ADD, CMP, MOV of any registers, including SP and PC, or BX, BLX."""
    return (0x4400 | random.randrange(0x400),)


def _system(random: Random) -> tuple[int, ...]:
    return random.choice(
        (
            (0xB672,),
            (0xB662,),
            (0xF3EF, 0x8000 | random.randrange(13) << 8),
            (0xDF00,),
            (0xBF30,),
            (0xF380, 0x8800),
        )
    )


def _float(random: Random) -> tuple[int, ...]:
    if random.randrange(2):
        first = random.choice((0xED80, 0xED90, 0xED00, 0xED10, 0xECA0, 0xECB0)) | random.choice(_BASES)
        return first, random.choice((0x0A00, 0x0B00)) | random.randrange(8) << 13 | random.randrange(1, 9)
    return 0xEE00 | random.randrange(0x100), 0x0A00 | random.randrange(0x10000) & 0xF1FF


def _anything(random: Random) -> tuple[int, ...]:
    return (random.randrange(0x10000),)


_KINDS: tuple[tuple[Draw, int], ...] = (
    (_data16, 20),
    (_data32, 12),
    (_dsp, 5),
    (_single, 14),
    (_several, 6),
    (_exclusive, 2),
    (_literal, 3),
    (_branch, 10),
    (_long_branch, 4),
    (_it_block, 10),
    (_high, 5),
    (_system, 2),
    (_float, 6),
    (_anything, 4),
)


def random_code(random: Random, size: int) -> bytes:
    """Return this number of bytes of code."""
    draws, weights = zip(*_KINDS, strict=True)
    words: list[int] = []
    while len(words) < size // 2:
        words += random.choices(draws, weights)[0](random)
    return struct.pack(f"<{size // 2}H", *words[: size // 2])
