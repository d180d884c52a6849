"""Faults caused by single instructions, and their names (ARMv7-M ARM B1.5.14)."""

from __future__ import annotations

import pytest

from fcu_emulator import Board
from fcu_emulator.emulator.chip.memory_map import FLASH
from fcu_emulator.emulator.trace import DeviceNote
from fcu_emulator.firmware_model.arm import prebuilt
from tests.support.arm.thumb_assembler import Labels, assemble
from tests.support.words import Words

NOP = 0xBF00
CODE = FLASH + 0x3_0000


def template() -> Board:
    return Board(firmware=prebuilt("template"))


def summary(board: Board) -> str:
    assert board.chip is not None
    diagnosis = board.chip.diagnosis()
    assert diagnosis is not None
    assert diagnosis.kind == "fault"
    return diagnosis.summary


def cause(board: Board) -> str:
    """Return the last part of the summary, after the fault, its time and its place."""
    return summary(board).partition(": ")[2]


def patch(board: Board, function: str, *code: int) -> int:
    """Write half-words over the beginning of a function, from a multiple of 4, and return their address."""
    assert board.chip is not None
    assert board.chip.image.symbols is not None
    address = board.chip.image.symbols.address_of(function)
    if address & 2:
        code = (NOP, *code)
    flash = board.chip.core.flash
    for place, value in enumerate(code):
        at = address - 0x0800_0000 + 2 * place
        flash[at : at + 2] = value.to_bytes(2, "little")
    board.chip.core.code_changed()
    return address + (address & 2)


@pytest.mark.parametrize(
    ("code", "named"),
    [
        ((0xBE00,), "BKPT"),  # BKPT #0
        ((0xDE00,), "0xDE00 at 0x{0:08X}"),  # UDF #0
        ((0xF7F0, 0xA000), "0xF7F0A000 at 0x{0:08X}"),  # UDF.W #0
        ((0xFFFF, 0xFFFF), "erased flash, 0x{0:08X}"),
        ((0x4800, 0x4700, 0x0001, 0x6000), "0x60000000"),  # execution
        ((0x4801, 0x6800, NOP, NOP, 0x0000, 0x6000), "0x60000000"),  # read
        ((0x4801, 0x6000, NOP, NOP, 0x0000, 0x2001), "0x20010000"),  # write
        ((0x2000, 0x4780), "NULL"),  # MOVS R0, #0; BLX R0
        ((0x4801, 0x4685, 0xB401, NOP, 0x0000, 0x2000), "stack"),  # MOV SP, R0; PUSH {R0}
        # CCR = UNALIGN_TRP; LDR R3, [R2] with R2 = 1
        ((0x4802, 0x2108, 0x6001, 0x2201, 0x6813, NOP, 0xED14, 0xE000), "unaligned"),
    ],
)
def test_cause_of_fault_is_named(code: tuple[int, ...], named: str, words: Words) -> None:
    board = template()
    address = patch(board, "main", *code)
    board.run_for(0.001)

    assert summary(board).startswith("HardFault at 0.000")
    assert named.format(address) in cause(board)
    words("diagnosis", cause(board).replace(f"0x{address:08X}", "ADDRESS"))


def test_floating_point_instruction_while_unit_disabled_is_named(words: Words) -> None:
    """ARMv7-M ARM B1.4.7: NOCP while CPACR denies access."""
    board = template()
    patch(board, "SystemInit", 0xEEB0, 0x0A60)  # VMOV.F32 S0, S1
    board.run_for(0.001)

    words("diagnosis", cause(board))


def test_unmapped_vector_table_locks_up(words: Words) -> None:
    """ARMv7-M ARM B1.5.15: the vector of the HardFault cannot be read either."""
    board = template()
    board.run_for(0.01)
    assert board.chip is not None
    board.chip.core.poke(0xE000_ED08, bytes.fromhex("00000010"))
    board.run_for(0.01)

    diagnosis = board.chip.diagnosis()
    assert board.chip.core.locked_up
    assert diagnosis is not None
    words("diagnosis", cause(board))
    words("diagnosis", "\n".join(line for line in diagnosis.details if not line.startswith(" ")))


# -- faults and the NMI (ARMv7-M ARM B1.5.2: priority -2, above every fault's handler) ---------------------

UNDEFINED = "udf #0"
RAISE_NMI = "mov32 r0, 0xE000ED04 \n mov32 r1, 0x80000000 \n str r1, [r0]"  # ICSR.NMIPENDSET
SKIP = "ldr r0, [sp, #24] \n adds r0, r0, #2 \n str r0, [sp, #24] \n bx lr"
"""A handler that returns to the address after the faulting instruction of two bytes."""


def with_handlers(thread: str, hard_fault: str, nmi: str) -> tuple[Board, Labels]:
    """Return a board that has executed these instructions for 10 ms. Each part ends in an endless loop."""
    board = template()
    assert board.chip is not None
    source = f"thread: {thread}\n b .\n hard_fault: {hard_fault}\n b .\n nmi: {nmi}\n loop: b .\n"
    code, labels = assemble(source, CODE)
    core = board.chip.core
    core.flash[CODE - FLASH : CODE - FLASH + len(code)] = code
    for number, name in ((2, "nmi"), (3, "hard_fault")):
        core.flash[4 * number : 4 * number + 4] = (labels[name] | 1).to_bytes(4, "little")
    core.code_changed()
    core.pc = labels["thread"]
    board.run_for(0.01)
    return board, labels


@pytest.mark.parametrize(
    ("thread", "hard_fault", "nmi", "origin"),
    [
        (RAISE_NMI, SKIP, UNDEFINED, "nmi"),
        (f"{UNDEFINED} \n {RAISE_NMI}", SKIP, UNDEFINED, "nmi"),  # the first fault was handled before
        (UNDEFINED, UNDEFINED, "bx lr", "thread"),
        (UNDEFINED, RAISE_NMI, UNDEFINED, "thread"),  # the NMI preempts the fault's handler
    ],
    ids=["in the NMI", "in the NMI after a handled one", "in the handler", "in the NMI in the handler"],
)
def test_lock_up_is_explained_by_its_first_fault(
    thread: str, hard_fault: str, nmi: str, origin: str, words: Words
) -> None:
    board, labels = with_handlers(thread, hard_fault, nmi)
    assert board.chip is not None
    assert board.chip.faults.origin is not None
    diagnosis = board.chip.diagnosis()

    assert board.chip.core.locked_up
    assert board.chip.faults.origin.pc == labels[origin]
    assert f"in 0x{labels[origin]:08X}" in summary(board)
    assert diagnosis is not None
    words("diagnosis", diagnosis.details[-2].partition(" at ")[0])  # how the core has come to lock up


@pytest.mark.parametrize("thread", [RAISE_NMI, f"{UNDEFINED} \n {RAISE_NMI}"], ids=["alone", "after a fault"])
def test_endless_nmi_is_reported_as_stuck(thread: str, words: Words) -> None:
    """The NMI is also reported if a fault was handled before. That fault is not the cause."""
    board, labels = with_handlers(thread, SKIP, "nop")
    assert board.chip is not None
    board.run_for(0.2)
    diagnosis = board.chip.diagnosis()

    assert diagnosis is not None
    assert diagnosis.kind == "stuck"
    assert f"0x{labels['loop']:08X}" in diagnosis.summary
    words("diagnosis", next(line for line in diagnosis.details if "NMI" in line))


# -- resets ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("reasons", "reported"),
    [
        (("SYSRESETREQ", "SYSRESETREQ"), ""),
        (("SYSRESETREQ", "SYSRESETREQ", "SYSRESETREQ"), "3 times, last by SYSRESETREQ at 0.06"),
        (("SYSRESETREQ", "IWDG"), "2 times, last by IWDG at 0.04"),
        (("IWDG", "SYSRESETREQ"), ""),
        (("IWDG", "SYSRESETREQ", "WWDG"), "3 times, last by WWDG at 0.06"),
        (("WWDG",), "once, by WWDG at 0.02"),
    ],
)
def test_latest_reset_is_reported_with_reason_and_time(reasons: tuple[str, ...], reported: str) -> None:
    board = Board(firmware="solution")
    assert board.chip is not None
    for reason in reasons:
        board.run_for(0.02)
        board.chip.core.request_reset(reason)
    board.run_for(1.0)
    diagnosis = board.chip.diagnosis()

    assert (diagnosis is None) is (not reported)
    assert diagnosis is None or diagnosis.kind == "reset"
    assert reported in str(diagnosis)


# -- stores that the flash refuses ------------------------------------------------------------------------

STORE_AT_4096 = (0x2001, 0x0300, 0x6000, 0xE7FE)  # MOVS R0, #1; LSLS R0, R0, #12; STR R0, [R0]; B .
FLASH_KEYR, FLASH_CR = 0x4002_3C04, 0x4002_3C10
KEYS = (0x4567_0123, 0xCDEF_89AB)


def lost_store(control: int | None) -> int | None:
    """Run a store to address 4096, and return the address of the lost store that was recorded.

    ``control`` is the value of CR of the unlocked flash; None: the flash stays locked.
    """
    board = template()
    patch(board, "main", *STORE_AT_4096)
    assert board.chip is not None
    for key in KEYS if control is not None else ():
        board.chip.core.poke(FLASH_KEYR, key.to_bytes(4, "little"))
    if control is not None:
        board.chip.core.poke(FLASH_CR, control.to_bytes(4, "little"))
    board.run_for(0.001)
    found = board.chip.faults.lost_store
    return None if found is None else found.address


def test_store_at_offset_from_null_pointer_is_recorded() -> None:
    assert lost_store(None) == 4096


def test_refused_flash_programming_is_not_called_null_store() -> None:
    """RM0368 3.6.4: a word with PSIZE 0 (bytes) sets PGPERR. The address is correct, so no pointer is NULL."""
    assert lost_store(control=1) is None


# -- writes to peripherals without clock ------------------------------------------------------------------


@pytest.mark.parametrize(("name", "register"), [("I2C2", 0x4000_5800), ("ADC1", 0x4001_2004)])
def test_harmless_write_does_not_hide_lost_write(name: str, register: int) -> None:
    """Writing the reset value changes nothing. The next write to the same register is lost without a clock."""
    board = template()
    assert board.chip is not None
    for value in (0, 0, 1):
        board.chip.core.poke(register, value.to_bytes(4, "little"))

    notes = [one for one in board.trace.of(DeviceNote) if one.device == name]
    assert [one.what for one in notes] == ["forbidden"]
