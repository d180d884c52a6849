"""``python -m fcu_emulator.emulator.chip.registers`` rewrites the C headers beside the blocks in C."""

from __future__ import annotations

from pathlib import Path

from fcu_emulator.emulator.chip.registers import IN_C
from fcu_emulator.emulator.chip.registers.c_header import file_name, header


def main() -> None:
    """Write all of them."""
    folder = Path(__file__).parents[1] / "native"
    for module in IN_C:
        (folder / file_name(module)).write_text(header(module), encoding="utf-8", newline="\n")


if __name__ == "__main__":
    main()
