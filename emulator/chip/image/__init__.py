"""Firmware files: ELF, Intel HEX and raw binary, from untrusted sources.

Decision: the project has its own readers, in which every loop consumes bytes of the file or a
budget of work. A forged file can keep pyelftools busy forever.
"""

from fcu_emulator.emulator.chip.image.image import FirmwareImage, load_firmware, parse_firmware
from fcu_emulator.emulator.chip.image.segments import Segment
from fcu_emulator.emulator.chip.image.symbols import Symbols

__all__ = ["FirmwareImage", "Segment", "Symbols", "load_firmware", "parse_firmware"]
