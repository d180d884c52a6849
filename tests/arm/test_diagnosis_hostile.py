"""For any damage that firmware causes, the diagnosis is fast and does not raise an error."""

from __future__ import annotations

import random
from dataclasses import replace

import pytest

from fcu_emulator import Board
from fcu_emulator.firmware_model.arm import prebuilt

ELF = prebuilt("template")
EXC_RETURN = 0xFFFF_FFF9


@pytest.mark.parametrize("seed", range(24))
def test_damaged_firmware_is_diagnosed_without_error(seed: int) -> None:
    """Some half-words of the template's code are replaced. A third of the files have no symbols."""
    board = Board(firmware=ELF)
    assert board.chip is not None
    chance = random.Random(seed)
    flash = board.chip.core.flash
    for _ in range(60):
        place = chance.randrange(0x1A0, len(board.chip.image.segments[0].data)) & ~1
        flash[place : place + 2] = chance.randbytes(2)
    board.chip.core.code_changed()
    if seed % 3 == 0:
        board.chip.image = replace(board.chip.image, symbols=None)

    board.run_for(0.004)
    diagnosis = board.chip.diagnosis()

    assert diagnosis is None or str(diagnosis)


def test_stack_full_of_frames_is_unwound_completely() -> None:
    board = Board(firmware=ELF)
    board.run_for(0.001)
    assert board.chip is not None
    ram = board.chip.core.ram
    frame = b"".join(
        word.to_bytes(4, "little") for word in (EXC_RETURN, 0, 0, 0, 0, 0, 1, 0x0800_0200, 1 << 24)
    )
    ram[:] = (frame * (len(ram) // len(frame) + 1))[: len(ram)]

    board.chip.diagnosis()
