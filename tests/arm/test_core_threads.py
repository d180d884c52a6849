"""Threads on the process stack, which SVC starts and PendSV switches, as in FreeRTOS (ARM_CM4F port).

Stack pointers and modes: ARMv7-M ARM B1.4.1, B1.4.4; EXC_RETURN: table B1-8.
"""

from __future__ import annotations

import pytest

from fcu_emulator.emulator.chip.memory_map import RAM
from tests.support.arm.core_bench import STACK, CoreBench, interrupts, store

CURRENT = RAM  # which thread runs: 0 or 1
TOPS = RAM + 4  # its saved stack pointer, by thread
STACKS = (RAM + 0x1000, RAM + 0x2000)  # their upper ends

START = f"""
reset: {store("CPACR", 0x00F0_0000)} {store("SHPR3", 0x00F0_0000)}
       mov32 r4, {TOPS}
       mov32 r0, {STACKS[0]}
       mov32 r1, first+1
       bl prepare
       str r0, [r4]
       mov32 r0, {STACKS[1]}
       mov32 r1, second+1
       bl prepare
       str r0, [r4, #4]
       svc #0

prepare:                      ; r0 stack, r1 entry: R4 to R11, LR, and a frame that was never saved
       subs r0, #68
       mov32 r2, 0xFFFFFFFD
       str r2, [r0, #32]
       str r1, [r0, #60]
       mov32 r2, {1 << 24}
       str r2, [r0, #64]
       bx lr

svc:   mov32 r3, {TOPS}
       ldr r0, [r3]
       ldmia r0!, {{r4-r11, lr}}
       msr psp, r0
       isb
       movs r0, #0
       msr basepri, r0
       bx lr

pend_sv:
       mrs r0, psp
       isb
       tst lr, #0x10
       it eq
       vstmdbeq r0!, {{s16-s31}}
       stmdb r0!, {{r4-r11, lr}}
       mov32 r3, {CURRENT}
       ldr r2, [r3]
       lsls r1, r2, #2
       adds r1, r1, r3
       str r0, [r1, #4]
       movs r1, #1
       eors r2, r1
       str r2, [r3]
       lsls r1, r2, #2
       adds r1, r1, r3
       ldr r0, [r1, #4]
       ldmia r0!, {{r4-r11, lr}}
       tst lr, #0x10
       it eq
       vldmiaeq r0!, {{s16-s31}}
       msr psp, r0
       isb
       bx lr

sys_tick:
       mov32 r0, ICSR
       mov32 r1, {1 << 28}
       str r1, [r0]
       bx lr
"""

YIELD = "mov32 r0, ICSR\n mov32 r1, 0x10000000\n str r1, [r0]\n dsb\n isb\n"


def test_svc_starts_thread_on_its_stack() -> None:
    """Table B1-8: a return with 0xFFFFFFFD leads to Thread mode on the process stack, with CONTROL.SPSEL set."""
    core = CoreBench(
        START
        + """
first: mrs r4, control
       log r4
       mov r4, sp
       log r4
       mrs r4, ipsr
       log r4
       mrs r4, msp
       log r4
       b .
second: b .
"""
    )
    core.run_us(300)

    assert core.values == [2, STACKS[0], 0, STACK - 32]  # the start's own frame was never taken back


def test_threads_take_turns_and_keep_their_registers() -> None:
    core = CoreBench(
        START
        + f"""
first: movs r4, #10
       mov32 r11, 11
loop1: log r4
       log r11
       {YIELD} adds r4, #1
       b loop1
second: movs r4, #20
       mov32 r11, 22
loop2: log r4
       log r11
       {YIELD} adds r4, #1
       b loop2
"""
    )
    core.run_us(1000)

    assert core.values[:8] == [10, 11, 20, 22, 11, 11, 21, 22]


def test_threads_keep_all_floating_point_registers() -> None:
    """The frame of 26 words has S0 to S15, and the switch saves S16 to S31 (0xFFFFFFED, bit 4 clear)."""
    fill = {
        thread: "\n".join(f"movs r0, #{100 * thread + n}\n vmov s{n}, r0" for n in range(32))
        for thread in (1, 2)
    }
    core = CoreBench(
        START
        + f"""
first: {fill[1]}
loop1: vmov r4, s0
       vmov r5, s15
       vmov r6, s16
       vmov r7, s31
       log r4
       log r5
       log r6
       log r7
       {YIELD} b loop1
second: {fill[2]}
loop2: vmov r4, s0
       log r4
       vmov r4, s31
       log r4
       {YIELD} b loop2
"""
    )
    core.run_us(1000)

    assert core.values[:12] == [100, 115, 116, 131, 200, 231] * 2


def test_threads_with_and_without_floating_point_run_together() -> None:
    """Each thread has its own kind of frame, because EXC_RETURN is saved with it."""
    core = CoreBench(
        START
        + f"""
first: movs r0, #7
       vmov s0, r0
       vmov s16, r0
loop1: {YIELD} vmov r4, s0
       vmov r5, s16
       log r4
       log r5
       b loop1
second: movs r4, #1
loop2: mrs r5, control
       log r5
       {YIELD} b loop2
"""
    )
    core.run_us(1000)

    assert core.values[:6] == [2, 7, 7, 2, 7, 7]


def test_preemption_by_systick_loses_nothing() -> None:
    """Two threads count without yielding. The switch may come anywhere, also in IT blocks and between flags."""
    body = """
       movs r5, #0
       movs r6, #0
{0}:   adds r5, #1
       tst r5, #1
       ite eq
       addseq r6, #1
       addsne r6, #3
       cmp r5, #200
       bne {0}
       log r6
       b .
"""
    core = CoreBench(
        START.replace(
            "svc #0", store("SYST_RVR", 96) + store("SYST_CVR", 0) + store("SYST_CSR", 7) + "svc #0", 1
        )
        + "first:"
        + body.format("loop1")
        + "second:"
        + body.format("loop2")
    )
    core.run_us(10_000)

    assert core.values == [400, 400]


def test_handlers_do_not_use_process_stack() -> None:
    """B1.4.1, B1.5.6: the frame is on the process stack, the handler on the main stack."""
    core = CoreBench(
        f"""
reset: mov32 r0, {STACKS[0]}
       msr psp, r0
       movs r0, #2
       msr control, r0
       isb
       mov r4, sp
       log r4
       svc #0
       mov r4, sp
       log r4
       b .
svc:   mov r4, sp
       log r4
       mrs r4, psp
       log r4
       mov r4, lr
       log r4
       bx lr
"""
    )
    core.run_us(100)

    assert core.values == [STACKS[0], STACK, STACKS[0] - 32, 0xFFFF_FFFD, STACKS[0]]


def test_odd_process_stack_is_aligned_and_restored() -> None:
    """B1.5.7 applies to both stacks."""
    core = CoreBench(
        f"""
reset: mov32 r0, {STACKS[0] - 4}
       msr psp, r0
       movs r0, #2
       msr control, r0
       isb
       svc #0
       mov r4, sp
       log r4
       b .
svc:   mrs r4, psp
       log r4
       bx lr
"""
    )
    core.run_us(100)

    assert core.values == [STACKS[0] - 40, STACKS[0] - 4]


@pytest.mark.parametrize("number", [0, 3, 255])
def test_svc_number_is_read_from_code(number: int) -> None:
    """Kernels find the number in the half-word before the return address (PM0214 3.10.10)."""
    core = CoreBench(
        f"""
reset: svc #{number}
       b .
svc:   ldr r0, [sp, #24]
       subs r0, #2
       ldrb r1, [r0]
       log r1
       bx lr
"""
    )
    core.run_us(100)

    assert core.values == [number]


def test_pendsv_waits_for_all_handlers_to_end() -> None:
    """This is the purpose of PendSV: at the lowest priority, it switches when no interrupt is active."""
    core = CoreBench(
        f"""
reset: {interrupts({0: 0x40, 1: 0x20})} {store("SHPR3", 0x00F0_0000)} {store("ISPR", 1)} log 1
       b .
irq0:  {store("ICSR", 1 << 28)} {store("ISPR", 2)} log 10
       bx lr
irq1:  {store("ICSR", 1 << 28)} log 20
       bx lr
pend_sv: log 99
       bx lr
"""
    )
    core.run_us(300)

    assert core.values == [20, 10, 99, 1]
