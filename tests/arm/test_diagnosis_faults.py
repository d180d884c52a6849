"""Faults by single instructions: what each is called (ARMv7-M ARM B1.5.14)."""

from __future__ import annotations

import pytest

from emulator import Board
from firmware_model.arm import prebuilt

NOP = 0xBF00


def template() -> Board:
    return Board(firmware=prebuilt("template"))


def summary(board: Board) -> str:
    assert board.arm is not None
    diagnosis = board.arm.diagnosis()
    assert diagnosis is not None
    assert diagnosis.kind == "fault"
    return diagnosis.summary


def patch(board: Board, function: str, *code: int) -> int:
    """Half-words in place of a function's beginning, from a multiple of 4 on; the address of the first."""
    assert board.arm is not None
    assert board.arm.image.symbols is not None
    address = board.arm.image.symbols.address_of(function)
    if address & 2:
        code = (NOP, *code)
    flash = board.arm.chip.core.flash
    for place, value in enumerate(code):
        at = address - 0x0800_0000 + 2 * place
        flash[at : at + 2] = value.to_bytes(2, "little")
    board.arm.chip.core.code_changed()
    return address + (address & 2)


@pytest.mark.parametrize(
    ("code", "cause"),
    [
        ((0xBE00,), "BKPT without a debugger"),  # BKPT #0
        ((0xDE00,), "0xDE00 at 0x{0:08X} is no instruction"),  # UDF #0
        ((0xF7F0, 0xA000), "0xF7F0A000 at 0x{0:08X} is no instruction"),  # UDF.W #0
        ((0xFFFF, 0xFFFF), "execution went to erased flash, 0x{0:08X}"),
        ((0x4800, 0x4700, 0x0001, 0x6000), "execution went to 0x60000000, where no program is"),
        ((0x4801, 0x6800, NOP, NOP, 0x0000, 0x6000), "read of address 0x60000000, where nothing is"),
        ((0x4801, 0x6000, NOP, NOP, 0x0000, 0x2001), "write to address 0x20010000, after the end of RAM"),
        ((0x2000, 0x6040), "write through a NULL pointer"),  # MOVS R0, #0; STR R0, [R0, #4]
        ((0x2001, 0x0300, 0x6000), "write through a NULL pointer"),  # to 0x1000
        ((0x2000, 0x4780), "call through a NULL function pointer"),  # MOVS R0, #0; BLX R0
        ((0x4801, 0x4685, 0xB401, NOP, 0x0000, 0x2000), "stack overflow"),  # MOV SP, R0; PUSH {R0}
        # CCR = UNALIGN_TRP; LDR R3, [R2] with R2 = 1
        ((0x4802, 0x2108, 0x6001, 0x2201, 0x6813, NOP, 0xED14, 0xE000), "unaligned access"),
    ],
)
def test_the_cause_of_a_fault_is_named(code: tuple[int, ...], cause: str) -> None:
    board = template()
    address = patch(board, "main", *code)
    board.run_for(0.001)

    assert summary(board).startswith("HardFault at 0.000")
    assert summary(board).endswith(cause.format(address))


def test_floating_point_before_it_is_switched_on() -> None:
    """ARMv7-M ARM B1.4.7: NOCP while CPACR denies access."""
    board = template()
    patch(board, "SystemInit", 0xEEB0, 0x0A60)  # VMOV.F32 S0, S1
    board.run_for(0.001)

    assert summary(board).endswith("floating-point unit is off")


def test_a_vector_table_that_is_nowhere_locks_the_core_up() -> None:
    """ARMv7-M ARM B1.5.15: the HardFault's own vector cannot be read either."""
    board = template()
    board.run_for(0.01)
    assert board.arm is not None
    board.arm.chip.core.poke(0xE000_ED08, bytes.fromhex("00000010"))
    board.run_for(0.01)

    assert summary(board).endswith("the vector table cannot be read")
    assert "The core is locked up: only a reset helps." in str(board.arm.diagnosis())
