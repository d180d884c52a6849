"""Firmware files: ELF, Intel HEX and raw binary, from untrusted sources.

Decision: the project has its own readers, in which every loop consumes bytes of the file or a budget of work.
The library pyelftools reads the same structures, but a forged file can keep it busy forever. For example, a
``.debug_line`` header of DWARF 5 that announces 2**60 directories without fields is one loop that reads no
bytes. A LEB128 number may be megabytes long. It is also five times slower, which would be noticeable in
``board.variable()``. It remains the independent reference in the tests.
"""

from fcu_emulator.emulator.chip.image.image import FirmwareImage, load_firmware, parse_firmware
from fcu_emulator.emulator.chip.image.segments import Segment
from fcu_emulator.emulator.chip.image.symbols import Symbols

__all__ = ["FirmwareImage", "Segment", "Symbols", "load_firmware", "parse_firmware"]
