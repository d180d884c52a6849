"""Write the C headers: ``python -m fcu_emulator.emulator.chip.registers FOLDER``"""

from __future__ import annotations

import sys
from pathlib import Path

from fcu_emulator.emulator.chip.registers.c_headers import write_headers

if __name__ == "__main__":
    write_headers(Path(sys.argv[1]))
