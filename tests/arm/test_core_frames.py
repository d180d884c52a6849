"""Registers that are saved at exception entry and restored at return (ARMv7-M ARM B1.5.6 to B1.5.8)."""

from __future__ import annotations

import pytest

from tests.support.arm.core_bench import STACK, CoreBench, interrupts, store

T, PADDED = 1 << 24, 1 << 9
FPU_ON = store("CPACR", 0x00F0_0000)

SEVEN_REGISTERS = """
       movs r0, #100
       movs r1, #101
       movs r2, #102
       mov32 r3, 103
       mov32 r12, 112
       mov32 lr, 114
"""


def frame(core: CoreBench, at: int, words: int = 8) -> list[int]:
    return [core.word(at + 4 * n) for n in range(words)]


def test_basic_frame_has_eight_registers_in_order() -> None:
    """B1.5.6, figure B1-3: R0 to R3, R12, LR, return address and xPSR, in ascending order."""
    core = CoreBench(
        f"""
reset: {SEVEN_REGISTERS} cmp r0, #100
       svc #0
back:  b .
svc:   mov r4, sp
       mov r5, lr
       mrs r6, xpsr
       b .
"""
    )
    core.run_us(100)

    assert core.register(4) == STACK - 32
    assert frame(core, STACK - 32) == [100, 101, 102, 103, 112, 114, core.labels["back"], 0x6000_0000 | T]
    assert core.register(5) == 0xFFFF_FFF9  # EXC_RETURN: Thread mode, main stack, basic frame (table B1-8)
    assert core.register(6) & 0x1FF == 11


def test_handler_may_change_frame() -> None:
    """B1.5.8: all values are read back from the stack. System calls return their results in this way."""
    core = CoreBench(
        """
reset: svc #0
       log r0
       log r1
       b .
svc:   movs r0, #42
       str r0, [sp]
       movs r1, #43
       str r1, [sp, #4]
       bx lr
"""
    )
    core.run_us(100)

    assert core.values == [42, 43]


def test_flags_and_registers_survive_handler() -> None:
    """B1.5.6: hardware saves the registers that a C function may change (AAPCS)."""
    core = CoreBench(
        f"""
reset: {interrupts({0: 0})} movs r4, #4
       {SEVEN_REGISTERS} cmp r0, #100
wait:  beq wait              ; Z is set for ever
       log 0
       b .
irq0:  movs r0, #0
       movs r1, #0
       movs r2, #0
       movs r3, #1
       mov r12, r0
       bx lr
"""
    )
    for at_us in (100, 133, 161):
        core.pulse_at_us(at_us, 0)
    core.run_us(300)

    assert [core.register(n) for n in (0, 1, 2, 3, 4, 12, 14)] == [100, 101, 102, 103, 4, 112, 114]
    assert core.values == []


@pytest.mark.parametrize("odd_words", [0, 1])
def test_frames_are_aligned_to_eight_bytes(odd_words: int) -> None:
    """B1.5.7: with CCR.STKALIGN (set after reset) a word is skipped, and bit 9 of the saved xPSR records it."""
    core = CoreBench(
        f"""
reset: sub sp, sp, #{4 * odd_words}
       svc #0
       log r4
       mov r5, sp
       b .
svc:   mov r4, sp
       bx lr
"""
    )
    core.run_us(100)

    at = STACK - 32 - 8 * odd_words
    assert core.values == [at]
    assert frame(core, at)[7] == T | (PADDED if odd_words else 0)
    assert core.register(5) == STACK - 4 * odd_words  # put back at return


def test_frame_without_stkalign_has_no_padding() -> None:
    """B1.5.7, B3.2.8."""
    core = CoreBench(
        f"""
reset: {store("CCR", 0)} sub sp, sp, #4
       svc #0
       b .
svc:   log sp
       b .
""".replace("log sp", "mov r4, sp\n log r4")
    )
    core.run_us(100)

    assert core.values == [STACK - 36]
    assert frame(core, STACK - 36)[7] == T


def test_nested_handlers_return_to_their_own_mode() -> None:
    """Table B1-8: 0xFFFFFFF9 returns to Thread mode, 0xFFFFFFF1 to the interrupted handler."""
    core = CoreBench(
        f"""
reset: {interrupts({0: 0x40, 1: 0x20})} {store("ISPR", 1)} mrs r4, ipsr
       log r4
       b .
irq0:  push {{r4, lr}}
       log r14
       {store("ISPR", 2)} mrs r4, ipsr
       log r4
       pop {{r4, pc}}
irq1:  log r14
       mrs r2, ipsr
       log r2
       bx lr
""".replace("log r14", "mov r2, lr\n log r2")
    )
    core.run_us(300)

    assert core.values == [0xFFFF_FFF9, 0xFFFF_FFF1, 17, 16, 0]


# -- IT blocks ------------------------------------------------------------------------------------------


@pytest.mark.parametrize("condition", ["eq", "ne"])
def test_it_block_continues_after_svc(condition: str) -> None:
    """B1.4.2, B1.5.6: ITSTATE is part of the saved xPSR, so the rest of the block stays conditional."""
    other = "ne" if condition == "eq" else "eq"
    core = CoreBench(
        f"""
reset: movs r0, #0
       movs r1, #0
       cmp r0, #{0 if condition == "eq" else 1}
       itete {condition}
       svc{condition} #0
       adds{other} r1, #1
       adds{condition} r1, #2
       adds{other} r1, #4
       log r1
       b .
svc:   ldr r2, [sp, #28]
       log r2
       cmp r2, #0
       bx lr
"""
    )
    core.run_us(200)

    xpsr, result = core.values
    assert result == 2
    condition_bits = {"eq": 0b0000, "ne": 0b0001}[condition]
    it = (xpsr >> 25 & 3) | (xpsr >> 8 & 0xFC)
    assert it >> 4 == (
        condition_bits | 1 if condition == "eq" else 0b0000
    )  # the next one is an else (A7.3.3)
    assert it & 0xF != 0


def test_it_block_continues_after_fault() -> None:
    """B1.5.6: the handler removes the cause and returns to the instruction, which is still in its block."""
    core = CoreBench(
        """
reset: mov32 r4, 0x60000000
       movs r1, #0
       cmp r1, #0
       itete eq
       addseq r1, #1
       addsne r1, #2
       ldreq r2, [r4]
       addsne r1, #8
       log r1
       log r2
       b .
hard_fault:
       mov32 r4, RAM
       movs r0, #77
       str r0, [r4]
       bx lr
"""
    )
    core.run_us(200)

    assert core.values == [1, 77]


@pytest.mark.parametrize("start", range(20))
def test_interrupt_never_disturbs_it_block(start: int) -> None:
    """B1.4.2: at any time of the interrupt, the instructions of the block keep their conditions."""
    core = CoreBench(
        f"""
reset: {interrupts({0: 0})} movs r1, #0
       movs r2, #0
again: adds r2, #1
       tst r2, #1
       itete eq
       addseq r1, #1
       nopne
       addseq r1, #1
       addsne r1, #4
       cmp r2, #4
       bne again
       log r1
       b .
irq0:  movs r0, #1
       cmp r0, #0
       bx lr
"""
    )
    core.pulse_at_us(16 + start, 0)
    core.run_us(300)

    assert core.values == [2 * 2 + 2 * 4]
