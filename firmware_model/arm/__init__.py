"""The lab's firmware in C: sources, and ELF files for sensors on I2C2 and SPI2."""

from __future__ import annotations

from pathlib import Path

PROGRAMS = ("template", "solution")
BUSES = ("I2C2", "SPI2")


def sources() -> Path:
    """Return the folder with support/, template/, scaffold/, and (only in a clone) solution/."""
    return Path(__file__).parent  # packages are always installed unpacked


_HEADER = """\
/* {title}
 *
 * The template: it samples the sensors 800 times a second and prints them once a second. The places for your own code
 * are marked YOUR CODE HERE.
 */
"""
BOOT_LINE = "LAB3 Init..."
_OF_LAB3 = {
    " (pitch, roll, azimuth; getAltitude, eCompass, MagCalibration)": "",
    "altitude, pitch, roll and yaw in the format of the slides": "the lines that the exercises ask for",
}


def template_of(title: str, boot_line: str = "Init...") -> str:
    """Return the template's main.c for another lab."""
    _, text = (sources() / "template" / "main.c").read_text(encoding="utf-8").split("*/\n", 1)
    for of_lab3, general in {**_OF_LAB3, BOOT_LINE: boot_line}.items():
        text = text.replace(of_lab3, general)
    return _HEADER.format(title=title.replace("*/", "* /").replace("/*", "/ *")) + text


def prebuilt(program: str, bus: str = "I2C2") -> Path:
    """Return a program's ELF file for a bus. Raises ValueError."""
    if program not in PROGRAMS:
        raise ValueError(f"unknown firmware {program!r}; known: {', '.join(PROGRAMS)}")
    if bus not in BUSES:
        raise ValueError(f"unknown sensor bus {bus!r}; known: {', '.join(BUSES)}")
    return sources() / "prebuilt" / f"{program}-{bus.lower()}.elf"
