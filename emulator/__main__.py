"""``python -m emulator`` is the same as ``fcu``."""

from emulator.cli import main

main()
