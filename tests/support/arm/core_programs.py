"""A program with many kinds of instructions, for laws of the core: divided or skipped runs must be equal."""

from __future__ import annotations

from fractions import Fraction

from tests.support.arm.core_bench import CoreBench, interrupts, store

STIRRING = f"""
reset: {store("CPACR", 0x00F0_0000)} {interrupts({0: 0x40, 1: 0x20, 2: 0x20})}
       {store("SHPR3", 0x6000_0000)} {store("SYST_RVR", 9_700)} {store("SYST_CVR", 0)} {store("SYST_CSR", 7)}
       movs r4, #0
       movs r5, #0
       mov32 r8, RAM+64
main:  adds r4, #1
       tst r4, #3
       itete eq              ; conditional code, with a register access in it
       addseq r5, #1
       ldrne r6, [r8]
       streq r5, [r8]
       addsne r5, #3
       vmov s1, r5
       vadd.f32 s2, s1, s2
       mov32 r0, FLAG
poll:  ldr r1, [r0]          ; a status register
       cmp r1, #0
       bne on
       mov32 r2, RAM
       ldr r3, [r2]          ; set by the handler of interrupt 0
       cmp r3, #0
       beq poll
on:    mov32 r2, RAM
       movs r3, #0
       str r3, [r2]
       cpsid i
       push {{r4, r5}}
       pop {{r6, r7}}
       svc #1
       cpsie i
wait:  ldr r3, [r2, #4]      ; counted up by SysTick
       cmp r3, r4
       bcc wait
       wfi
       movw r0, #3000
delay: subs r0, #1
       bne delay
       log r4
       b main

irq0:  mov32 r0, RAM
       movs r1, #1
       str r1, [r0]
       log 100
       bx lr
irq1:  vmov s1, r0
       vadd.f32 s1, s1, s1
       log 101
       bx lr
irq2:  log 102
       {store("ISPR", 2)}
       bx lr
svc:   mov32 r0, EFFECT
       ldr r1, [r0]
       log r1
       bx lr
hard_fault:                  ; SVC with PRIMASK set is one; the frame's PC is behind it
       log 103
       bx lr
sys_tick:
       mov32 r0, RAM
       ldr r1, [r0, #4]
       adds r1, #1
       str r1, [r0, #4]
       mov32 r0, CYCCNT
       ldr r2, [r0]
       bx lr
"""
"""Interrupts at four levels, SVC, a fault, IT blocks, floating point, polling, waiting, WFI and delays."""

State = tuple[object, ...]


def interrupted_core(
    pulses: list[tuple[float, int]],
    flag_us: float,
    *,
    cycles: Fraction = Fraction(1),
    skip: bool = True,
) -> CoreBench:
    """Return a core with ``STIRRING``, pulses (time in us, interrupt), and the time at which FLAG reads as 1."""
    core = CoreBench(STIRRING, cycles=cycles, skip=skip)
    core.probe.flag_ps = round(flag_us * 10**6)
    for time_us, number in pulses:
        core.pulse_at_us(time_us, number)
    return core


def state(core: CoreBench) -> State:
    """Return all state that can affect the program now or later."""
    return (
        core.probe.log,
        [core.register(number) for number in range(15)],
        core.core.pc,
        core.floating_point(),
        bytes(core.core.ram),
        (core.core.pending, core.core.active),
        core.probe.registers,
        core.core.retired,
        core.core.now_ps,
    )
