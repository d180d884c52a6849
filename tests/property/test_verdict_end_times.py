"""A verdict must not depend on the end of a run: correct programs have no failure at any time."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import Phase, given, settings
from hypothesis import strategies as st

from fcu_emulator import Board
from fcu_emulator.emulator.clock import PS_PER_MS, PS_PER_S, PS_PER_US
from fcu_emulator.firmware_model.arm import prebuilt
from tests.support.arm.broken_programs import FINE

ARM = Path(__file__).parents[1] / "arm"
PROGRAMS = [
    (prebuilt("solution", "I2C2"), "lab3"),
    (prebuilt("solution", "SPI2"), "fcu001v1"),
    (prebuilt("template", "I2C2"), "lab3"),
    (prebuilt("template", "SPI2"), "fcu001v1"),
    *((ARM / "broken" / f"{name}.elf", "lab3") for name in FINE),
    *((ARM / "vendor" / f"lab3_i2c_{style}.elf", "lab3") for style in ("polled", "it", "dma")),
    (ARM / "vendor" / "flight.elf", "fcu001v1"),
    (ARM / "vendor" / "threads.elf", "lab3"),
]


@pytest.mark.parametrize(("firmware", "wiring"), PROGRAMS, ids=lambda value: getattr(value, "stem", value))
@settings(max_examples=2, deadline=None, phases=[Phase.generate])  # shrinking takes minutes
@given(st.lists(st.integers(PS_PER_US, 40 * PS_PER_MS), min_size=20, max_size=80))
def test_correct_program_never_fails(firmware: Path, wiring: str, pauses_ps: list[int]) -> None:
    board = Board(firmware, wiring=wiring)
    for pause_ps in pauses_ps:
        board.run_for(pause_ps / PS_PER_S)
        assert board.chip is not None
        diagnosis = board.chip.diagnosis()
        assert diagnosis is None or not diagnosis.fatal, str(diagnosis)
