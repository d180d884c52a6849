"""Firmware files: ELF, Intel HEX and raw binary, read with suspicion.

Decision: the files are read by our own code, and every loop of it consumes bytes of the file or a budget of
work. pyelftools reads the same structures, but a forged file can keep it busy for ever: a ``.debug_line``
header of DWARF 5 that announces 2**60 directories without fields is one loop without reading a byte, and a
LEB128 number may be megabytes long. It also needs five times as long, which ``board.variable()`` would show.
It remains the independent witness in the tests.
"""

from fcu_emulator.emulator.chip.image.image import FirmwareImage, load_firmware, parse_firmware
from fcu_emulator.emulator.chip.image.segments import Segment
from fcu_emulator.emulator.chip.image.symbols import Symbols

__all__ = ["FirmwareImage", "Segment", "Symbols", "load_firmware", "parse_firmware"]
