"""Hostile firmware: the board continues, and the firmware cannot reach or exhaust the host."""

from __future__ import annotations

import struct
from pathlib import Path

import pytest

from fcu_emulator import Board
from fcu_emulator.emulator.chip.memory_map import CHIP_NAME
from fcu_emulator.emulator.clock import PS_PER_MS
from fcu_emulator.emulator.trace import DeviceNote, Fault
from tests.support.arm.hostile_programs import (
    EVERY_CLOCK_AND_INTERRUPT,
    FLASH,
    LOOK_AWAY,
    RAM,
    board_with,
    program,
    put,
    word,
)
from tests.support.words import Words

STEP = 0x000F_FF04  # 4112 places in 4 GB, at another offset each time


def status(board: Board) -> int:
    """Return CFSR, which shows the fault (ARMv7-M ARM B3.2.15)."""
    assert board.chip is not None
    return board.chip.core.peek(0xE000_ED28) or 0


def faults(board: Board) -> list[str]:
    return [event.text for event in board.trace.of(Fault)]


def test_endless_loop_does_not_slow_simulation(tmp_path: Path) -> None:
    board = board_with(program("reset: b ."), tmp_path)

    board.run_for(100)

    assert board.now_s == 100.0


@pytest.mark.parametrize("access", ["ldr r1, [r0]", "str r1, [r0]", "strb r1, [r0]", "ldrd r1, r3, [r0]"])
def test_every_address_may_be_accessed(access: str, tmp_path: Path) -> None:
    """Only RAM can be changed, and a note names each peripheral that was accessed."""
    source = f"""
    reset: movs r0, #0
           movs r4, #0
           mov32 r2, {STEP}
           movs r1, #0
    again: {access}
           adds r4, #1
           adds r0, r0, r2
           bcc again
           mov32 r0, RAM
           str r4, [r0]
           b .
    """
    data = program(source + LOOK_AWAY)
    board = board_with(data, tmp_path)

    board.run_for(0.02)

    assert word(board, RAM) == -(-(1 << 32) // STEP)
    assert word(board, FLASH) == struct.unpack_from("<I", data)[0]
    assert len(board.trace) < 100


def test_number_of_notes_about_registers_is_limited(tmp_path: Path, words: Words) -> None:
    """RM0368 table 1: 131072 words from 0x40000000, of which most are not registers."""
    source = f"""
    reset: {EVERY_CLOCK_AND_INTERRUPT}
           mov32 r0, 0x40000000
           mov32 r2, 0x40080000
    again: ldr r1, [r0]
           adds r0, #4
           cmp r0, r2
           bne again
           mov32 r1, RAM
           str r0, [r1]
           b .
    """
    board = board_with(program(source + LOOK_AWAY), tmp_path)

    board.run_for(0.06)

    assert word(board, RAM) == 0x4008_0000
    notes = board.trace.of(DeviceNote)
    (last, *_) = (note for note in notes if note.device == CHIP_NAME and "0x" not in note.text)
    words("chip", last.text)  # instead of the next address
    assert len(notes) < 45 * 256  # of each block its own page at most


def test_code_in_peripheral_space_is_not_executed(tmp_path: Path) -> None:
    """ARMv7-M ARM B3.1, table B3-1: Device memory is Execute Never, and CFSR has IACCVIOL."""
    board = board_with(program("reset: mov32 r0, 0x40011001\nbx r0"), tmp_path)

    board.run_for(1.0)

    assert status(board) & 1


def test_code_at_unmapped_address_faults(tmp_path: Path) -> None:
    """ARMv7-M ARM B1.5.14: a bus error of an instruction fetch, IBUSERR."""
    board = board_with(program("reset: mov32 r0, 0x10000001\nbx r0"), tmp_path)

    board.run_for(1.0)

    assert status(board) & 1 << 8


def test_fault_in_fault_handler_locks_up(tmp_path: Path) -> None:
    """ARMv7-M ARM B1.5.15."""
    board = board_with(program("reset: udf #0\nfault: udf #0"), tmp_path)

    board.run_for(1.0)

    assert board.now_s == 1.0
    assert [text.startswith("lock-up") for text in faults(board)] == [True]


@pytest.mark.parametrize("stack", [RAM, RAM + 8, 0x2001_0000, 0x0800_1000, 0x4000_0000, 0xFFFF_FFF8, 0])
def test_board_survives_interrupts_with_any_stack_pointer(stack: int, tmp_path: Path) -> None:
    """A frame that cannot be saved is a stacking error (STKERR). It becomes a HardFault, which causes a lock-up."""
    source = "reset:\n" + put("SYST_RVR", 100) + f"mov32 r2, {stack}\nmov sp, r2\n" + put("SYST_CSR", 7)
    board = board_with(program(source + "b .\ninterrupt: push {r0-r3, lr}\npop {r0-r3, pc}"), tmp_path)

    board.run_until_ps(PS_PER_MS)

    assert board.clock.now_ps == PS_PER_MS
    assert bool(status(board)) is (stack != 0x2001_0000)


@pytest.mark.parametrize("semihosting", ["bkpt #0xab", "svc #0xab"])
def test_semihosting_calls_do_not_reach_host(semihosting: str, tmp_path: Path) -> None:
    """SYS_OPEN would write a file on the host (Arm semihosting). Here the call is a breakpoint without a debugger."""
    target = tmp_path / "written"
    name = str(target).encode() + b"\0"
    source = f"reset: movs r0, #1\nmov32 r1, {RAM}\n{semihosting}\nb .\nfault: b ."
    board = board_with(program(source, behind=name), tmp_path)

    board.run_for(0.01)

    assert not target.exists()
    assert sorted(path.name for path in tmp_path.iterdir()) == ["hostile.bin"]


def test_skipped_loop_with_two_register_reads_ends(tmp_path: Path) -> None:
    """A polled register is read twice in one pass, as LDM does. The loop still ends."""
    source = f"""
    reset: {EVERY_CLOCK_AND_INTERRUPT}
           mov32 r0, 0x40020010    ; GPIOA_IDR, GPIOA_ODR
           mov32 r4, 100
    again: ldmia r0, {{r1, r2}}
           ldmia r0, {{r1, r2}}
           subs r4, #1
           bne again
    poll:  ldmia r0, {{r1, r2}}
           b poll
    """
    board = board_with(program(source), tmp_path)

    board.run_for(0.01)

    assert board.now_s == 0.01


@pytest.mark.parametrize("period", [0, 1, 2])
def test_time_advances_despite_fastest_interrupts(period: int, tmp_path: Path) -> None:
    """An update occurs every ``period`` + 1 cycles of 62.5 ns. With 0 the counter is blocked (RM0368 14.3.1)."""
    source = "reset:\n" + EVERY_CLOCK_AND_INTERRUPT + put("TIM9_ARR", period)
    source += put("TIM9_DIER", 1) + put("TIM9_CR1", 1) + "b .\ninterrupt: bx lr"
    board = board_with(program(source), tmp_path)

    board.run_until_ps(PS_PER_MS)

    assert board.clock.now_ps == PS_PER_MS


def test_self_modifying_code_runs_in_modified_form(tmp_path: Path) -> None:
    """Code in RAM changes ``movs r0, #1`` before itself to ``movs r0, #2``, and the loop ends."""
    source = f"""
    reset: mov32 r0, {RAM}
           mov32 r1, 0x47702001     ; movs r0, #1; bx lr
           str r1, [r0]
           mov32 r2, {RAM + 1}
           blx r2
           mov r5, r0
           mov32 r0, {RAM}
           mov32 r1, 0x47702002     ; movs r0, #2; bx lr
           str r1, [r0]
           blx r2
           mov32 r1, {RAM + 16}
           str r5, [r1]
           str r0, [r1, #4]
           b .
    """
    board = board_with(program(source), tmp_path)

    board.run_for(0.01)

    assert (word(board, RAM + 16), word(board, RAM + 20)) == (1, 2)
