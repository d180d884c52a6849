"""Damage to files: each mutator changes ``out`` in place, with a random generator that has a fixed seed."""

from __future__ import annotations

import struct
from collections.abc import Callable
from random import Random

from tests.support.arm.elf_builder import FLASH, RAM

EXTREMES = (0, 1, 2, 0x7F, 0x80, 0xFF, 0x7FFF_FFFF, 0x8000_0000, 0xFFFF_FFF0, 0xFFFF_FFFF, FLASH, RAM)
_ELF_HEADER, _PROGRAM_HEADER, _SECTION_HEADER = 52, 32, 40
_E_PHOFF, _E_SHOFF, _E_PHNUM, _E_SHNUM = 28, 32, 44, 48

Mutator = Callable[[bytearray, Random], None]


def flip(out: bytearray, random: Random) -> None:
    """Flip one bit."""
    if out:
        out[random.randrange(len(out))] ^= 1 << random.randrange(8)


def overwrite(out: bytearray, random: Random) -> None:
    """Overwrite a number of 1, 2 or 4 bytes with an extreme value."""
    size = random.choice((1, 2, 4))
    if len(out) > size:
        value = random.choice(EXTREMES).to_bytes(4, "little")
        at = random.randrange(len(out) - size) // size * size
        out[at : at + size] = value[:size]


def splice(out: bytearray, random: Random) -> None:
    """Copy a part of the file over another part."""
    source, target = random.randrange(len(out) + 1), random.randrange(len(out) + 1)
    piece = out[source : source + random.randrange(40)]
    out[target : target + len(piece)] = piece


def cut(out: bytearray, random: Random) -> None:
    """Remove bytes from the end or from the middle."""
    start = random.randrange(len(out) + 1)
    del out[start : random.choice((len(out), start + random.randrange(8)))]


def insert(out: bytearray, random: Random) -> None:
    """Insert some random bytes."""
    at = random.randrange(len(out) + 1)
    out[at:at] = random.randbytes(random.randrange(1, 8))


def flood(out: bytearray, random: Random) -> None:
    """Overwrite bytes with a LEB128 number that is long or has no end."""
    at, length = random.randrange(len(out) + 1), random.choice((4, 9, 10, 11, 200))
    end = min(at + length, len(out))
    out[at:end] = bytes([random.choice((0x80, 0xFF))]) * (end - at)
    if end > at and random.random() < 0.5:
        out[end - 1] &= 0x7F


def grow_table(out: bytearray, random: Random) -> None:
    """Declare more headers in the ELF header than exist, or repeat the same header many times."""
    place, count, size = random.choice(
        ((_E_PHOFF, _E_PHNUM, _PROGRAM_HEADER), (_E_SHOFF, _E_SHNUM, _SECTION_HEADER))
    )
    if len(out) < _ELF_HEADER:
        return
    number = random.choice((2, 3, 40, 300, 0xFFFF))
    struct.pack_into("<H", out, count, number)
    if random.random() < 0.7:
        (start,) = struct.unpack_from("<I", out, place)
        one = bytes(out[start : start + size])
        struct.pack_into("<I", out, place, len(out))
        out += one * min(number, 300)


def header_field(out: bytearray, random: Random) -> None:
    """Write an extreme number to a field of the ELF header or of a program or section header."""
    if len(out) < _ELF_HEADER:
        return
    section_headers = struct.unpack_from("<I", out, _E_SHOFF)[0]
    start = random.choice((16, _ELF_HEADER, section_headers))
    at = start + 4 * random.randrange(30)
    if at + 4 <= len(out):
        struct.pack_into("<I", out, at, random.choice((*EXTREMES, random.randrange(len(out)))))


ANYWHERE: tuple[Mutator, ...] = (flip, overwrite, overwrite, splice, cut, insert, flood)
OF_ELF: tuple[Mutator, ...] = (*ANYWHERE, grow_table, header_field, header_field)


def mutated(data: bytes, random: Random, mutators: tuple[Mutator, ...] = ANYWHERE) -> bytes:
    """Return the file with one to four changes."""
    out = bytearray(data)
    for _ in range(random.randint(1, 4)):
        random.choice(mutators)(out, random)
    return bytes(out)
