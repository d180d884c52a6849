"""The programs of tests/arm/vendor, and their output on an ideal board at rest."""

from __future__ import annotations

import re
from collections.abc import Iterable
from pathlib import Path

VENDOR = Path(__file__).parents[2] / "arm" / "vendor"
BLOCK = (
    "ACC[x,y,z] 0 mg 0 mg 1000 mg \n\r"
    "GYR[x,y,z] 0 mdps 0 mdps 0 mdps \n\r"
    "MAG[x,y,z] 214 mg 0 mg -430 mg \n\r"
    "Pre: 965.179993 hPa \n\r"
)
"""A block of LAB3. The first block may differ, because it may come before the first sample."""
STATE = "roll 0.00 pitch 0.00 press 965.18 mag 214\nmotors 800 800 800 800\n"
"""Output of the flight controller."""
LAPS = 32
"""Passes of the program with all peripherals for one line."""


def file(name: str) -> Path:
    """Return the ELF file of the program."""
    return VENDOR / f"{name}.elf"


def numbers(name: str, text: str) -> list[int]:
    """Return the numbers after a name, from each time it was printed."""
    return [int(number) for number in re.findall(rf"{name}:? (\d+)", text)]


def laps_line(laps: int) -> str:
    """Return the line after this many passes: the CRC of the data that were copied in the last pass."""
    words = range((laps - 1) * LAPS, laps * LAPS)
    return f"laps {laps:04} crc {_crc(words):08X}\n"


def _crc(words: Iterable[int]) -> int:
    """Return the CRC of RM0368 section 4.2: polynomial 0x04C11DB7, each word from its highest bit."""
    remainder = 0xFFFF_FFFF
    for word in words:
        remainder ^= word
        for _ in range(32):
            remainder = remainder << 1 ^ (0x1_04C1_1DB7 if remainder >> 31 else 0)
    return remainder
