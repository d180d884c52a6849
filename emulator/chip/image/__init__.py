"""Firmware files: ELF, Intel HEX and raw binary, from untrusted sources.

Decision: the project has its own parsers, in which every loop is limited by the length of the file
or by a budget of work. With a forged file, pyelftools may never return.
"""

from fcu_emulator.emulator.chip.image.image import FirmwareImage, load_firmware, parse_firmware
from fcu_emulator.emulator.chip.image.segments import Segment
from fcu_emulator.emulator.chip.image.symbols import Symbols

__all__ = ["FirmwareImage", "Segment", "Symbols", "load_firmware", "parse_firmware"]
