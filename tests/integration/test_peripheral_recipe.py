"""The recipe for a peripheral in C (docs/recipes.md), followed exactly in a copy of a clone."""

from __future__ import annotations

import re
import textwrap
from pathlib import Path

from tests.integration.test_library import BUILD, copied_clone, run

PAGE = Path(__file__).parents[2] / "docs" / "recipes.md"
_FILE = re.compile(
    r"^   ```(?:python|c)\n(   (?:# |/\* )(emulator/\S+?\.(?:py|h|c)).*?)^   ```$", re.DOTALL | re.MULTILINE
)
USE = """
from fcu_emulator import Board
board = Board("solution")
countdown = board.chip.core.peripherals["COUNTDOWN"]
countdown.clocked = True
countdown.write(4, 99_999)
begun = countdown.read(0)
board.run_for(0.01)
print(begun, countdown.read(0), countdown.NAMES[4])
"""


def change(file: Path, old: str, new: str) -> None:
    text = file.read_text(encoding="utf-8")
    assert text.count(old) == 1
    file.write_text(text.replace(old, new), encoding="utf-8")


def test_recipe_makes_peripheral_that_firmware_can_use(tmp_path: Path) -> None:
    clone = copied_clone(tmp_path / "clone")
    chip = clone / "emulator" / "chip"
    for text, name in _FILE.findall(PAGE.read_text(encoding="utf-8")):
        (clone / name).write_text(textwrap.dedent(text), encoding="utf-8")
    lists = chip / "registers" / "__init__.py", chip / "native" / "peripherals" / "list.h"
    change(lists[0], "    adc,\n", "    adc,\n    countdown,\n")
    text = lists[0].read_text(encoding="utf-8")
    assert text.count("nvic, scb, dwt),") == 2  # KINDS and IN_C
    lists[0].write_text(text.replace("scb, dwt),", "scb, dwt, countdown),"), encoding="utf-8")
    change(
        lists[1],
        "  X(Spi, spi[SPIS], spi_create)",
        "  X(Spi, spi[SPIS], spi_create) X(Countdown, countdown, countdown_create)",
    )
    change(
        lists[1],
        '#include "peripherals/dma.h"',
        '#include "peripherals/countdown.h"\n#include "peripherals/dma.h"',
    )
    change(
        chip / "memory_map.py",
        "ADDRESSES: Final = {",
        'ADDRESSES: Final = {\n    "COUNTDOWN": (0x4000_6000, 0x400),',
    )
    built = run(clone, BUILD)
    used = run(clone, "-c", USE)
    listed = run(clone, "-m", "fcu_emulator", "registers", "COUNTDOWN")

    assert built.returncode == 0, built.stderr
    assert used.stdout.split() == ["34463", "24463", "START"]  # 99,999 needs 17 bits, FROM has 16
    assert "0x40006004" in listed.stdout
