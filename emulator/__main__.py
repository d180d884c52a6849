"""``python -m fcu_emulator`` is the same as ``fcu``."""

from fcu_emulator.emulator.cli import main

main()
