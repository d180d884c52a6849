"""The lab's firmware in C for the real chip: its sources, and the ELF files built from them.

``template`` is the students' starting point, ``solution`` all exercises; each is built for the sensors on
I2C2 and on SPI2. Nothing here compiles or runs anything.
"""

from __future__ import annotations

from pathlib import Path

PROGRAMS = ("template", "solution")
BUSES = ("I2C2", "SPI2")


def sources() -> Path:
    """The folder with support/, template/ and scaffold/, and in a clone solution/."""
    return Path(__file__).parent  # packages are always installed unpacked


def prebuilt(program: str, bus: str = "I2C2") -> Path:
    """The ELF file of one of ``PROGRAMS`` for one of ``BUSES``. Raises ValueError naming the known ones."""
    if program not in PROGRAMS:
        raise ValueError(f"unknown firmware {program!r}; known: {', '.join(PROGRAMS)}")
    if bus not in BUSES:
        raise ValueError(f"unknown sensor bus {bus!r}; known: {', '.join(BUSES)}")
    return sources() / "prebuilt" / f"{program}-{bus.lower()}.elf"
