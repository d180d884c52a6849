"""Programs in assembly whose runs are recorded: sleep, watchdogs, interrupts, faults, IT blocks, memory.

They run from HSI, 16 MHz, and write their observations to a list in RAM at 0x2000 1000, to which R7 points.
"""

from __future__ import annotations

import re
import struct

from tests.support.arm.core_bench import _EXCEPTIONS, interrupts, store
from tests.support.arm.core_bench import SYMBOLS as CORE_SYMBOLS
from tests.support.arm.thumb_assembler import assemble

CODE, STACK, LIST = 0x0800_0200, 0x2001_0000, 0x2000_1000
_VECTORS = 102
_SYMBOLS = {
    **CORE_SYMBOLS,
    "LIST": LIST,
    "AHB1ENR": 0x4002_3830,
    "APB1ENR": 0x4002_3840,
    "APB2ENR": 0x4002_3844,
    "RCC_CSR": 0x4002_3874,
    "GPIOA": 0x4002_0000,
    "GPIOB": 0x4002_0400,
    "TIM2": 0x4000_0000,
    "TIM3": 0x4000_0400,
    "TIM4": 0x4000_0800,
    "IWDG": 0x4000_3000,
    "WWDG": 0x4000_2C00,
    "PWR_CR": 0x4000_7000,
    "EXTI": 0x4001_3C00,
    "SYSCFG_EXTICR1": 0x4001_3808,
}


def chip_program(source: str) -> bytes:
    """Return contents of flash. ``note N`` and ``note rN`` append to the list; they change R3 and the flags."""
    code, labels = assemble(_with_notes(source) + "\nunexpected: b .", CODE, _SYMBOLS)
    table = [STACK] + [labels["unexpected"] | 1] * (_VECTORS - 1)
    for name, number in _EXCEPTIONS.items():
        if name in labels:
            table[number] = labels[name] | 1
    return struct.pack(f"<{_VECTORS}I", *table).ljust(CODE & 0xFFFF, b"\xff") + code


def _with_notes(source: str) -> str:
    def write(match: re.Match[str]) -> str:
        value = match[2]
        load = "" if value.startswith("r") else f"movw r3, #{value}\n"
        register = value if value.startswith("r") else "r3"
        return f"{match[1]} {load} str {register}, [r7]\n adds r7, #4\n"

    return re.sub(r"^(\s*(?:\w+:)?)\s*note (\w+)", write, source, flags=re.MULTILINE)


def _timer(name: str, period: int) -> str:
    """Return the set-up of a timer that counts microseconds and interrupts."""
    return (
        store(f"{name}+40", 15)
        + store(f"{name}+44", period - 1)
        + store(f"{name}+20", 1)
        + store(f"{name}+16", 0)
        + store(f"{name}+12", 1)
        + store(name, 1)
    )


_TICK = store("SYST_RVR", 15_999) + store("SYST_CVR", 0) + store("SYST_CSR", 7)

SLEEP = f"""
reset: mov32 r7, LIST
       {store("APB1ENR", 3)} {_timer("TIM2", 700)} {interrupts({28: 0x40})} {_TICK}
       movs r4, #0
first: wfi
       adds r4, #1
       note r4
       cmp r4, #8
       bne first
       cpsid i                ; wakes, but is not handled before CPSIE
       wfi
       note 100
       cpsie i
       {store("SCR", 0x10)}   ; SEVONPEND
       cpsid i
       movs r4, #0
second: wfe
       adds r4, #1
       note r4
       cpsie i
       cpsid i
       cmp r4, #6
       bne second
       sev
       wfe                    ; the event is there
       note 200
       cpsie i
       {store("SCR", 2)}      ; SLEEPONEXIT: from here on only handlers
       wfi
       note 300
       b .
irq28: {store("TIM2+16", 0)} note 28
       bx lr
sys_tick: note 15
       bx lr
"""
"""WFI, WFI with PRIMASK, WFE with SEVONPEND and SEV, sleep on exit."""

STOP_MODE = f"""
reset: mov32 r7, LIST
       {store("APB1ENR", 1 << 28)} {store("APB2ENR", 1 << 14)} {store("AHB1ENR", 3)}
       {store("EXTI", 1)} {store("EXTI+8", 1)} {store("EXTI+12", 1)} {interrupts({6: 0x40})}
       {store("PWR_CR", 1)} {store("SCR", 4)}
       movs r4, #0
loop:  wfi
       adds r4, #1
       note r4
       b loop
irq6:  {store("EXTI+20", 1)} mov32 r0, GPIOA
       ldr r1, [r0, #16]
       note r1
       bx lr
"""
"""Deep sleep with stop mode chosen, left by both edges of PA0."""

IWDG = f"""
reset: mov32 r7, LIST
       mov32 r0, RAM
       ldr r4, [r0]
       adds r4, #1
       str r4, [r0]
       lsls r5, r4, #8
       adds r7, r7, r5        ; each boot has its own place in the list
       mov32 r0, RCC_CSR
       ldr r1, [r0]
       note r1
       {store("RCC_CSR", 1 << 24)} {store("IWDG", 0xCCCC)} {store("IWDG", 0x5555)} {store("IWDG+8", 24)}
       movs r6, #0
feed:  {store("IWDG", 0xAAAA)}
       movw r1, #4000
wait:  subs r1, #1
       bne wait
       adds r6, #1
       note r6
       cmp r6, r4
       bne feed
hang:  b hang
"""
"""Reloads as many times as it has been booted, then hangs, so that it is reset again and again."""

WWDG = f"""
reset: mov32 r7, LIST
       mov32 r0, RAM
       ldr r4, [r0]
       adds r4, #1
       str r4, [r0]
       lsls r5, r4, #8
       adds r7, r7, r5
       mov32 r0, RCC_CSR
       ldr r1, [r0]
       note r1
       {store("APB1ENR", 1 << 11)} {store("WWDG+4", 0x27F)} {interrupts({0: 0})} {store("WWDG", 0xC8)}
       cmp r4, #2
       bcs early
       b .
early: {store("WWDG+4", 0x244)}
       movs r6, #0
again: mov32 r0, WWDG
       ldr r1, [r0]
       movs r2, #0x7F
       ands r1, r2
       cmp r1, #0x44
       bcs again             ; until the window opens
       {store("WWDG", 0xC8)}
       adds r6, #1
       note r6
       cmp r6, #5
       bne again
       {store("WWDG", 0xC8)} ; too early
       b .
irq0:  note 41
       mov32 r0, RAM
       ldr r2, [r0, #4]
       adds r2, #1
       str r2, [r0, #4]
       {store("WWDG+8", 0)}
       cmp r2, #3
       bcs enough
       {store("WWDG", 0xC8)}
enough: bx lr
"""
"""Early wake-ups that reload three times, then a reset; then a reload before the window opens."""

NESTED = f"""
reset: mov32 r7, LIST
       {store("CPACR", 0x00F0_0000)}
       {store("APB1ENR", 7)} {_timer("TIM2", 90)} {_timer("TIM3", 130)} {_timer("TIM4", 210)}
       {interrupts({28: 0x20, 29: 0x40, 30: 0x60, 80: 0x80, 79: 0x40})} {store("SHPR3", 0x50C0_0000)}
       {store("SYST_RVR", 2_999)} {store("SYST_CVR", 0)} {store("SYST_CSR", 7)}
       movs r4, #0
       movs r6, #0
       vmov s0, r6
loop:  adds r4, #1
       vmov s1, r4
       vadd.f32 s0, s0, s1
       movs r0, #0x40
       msr basepri, r0        ; only TIM2 and SysTick's like
       movw r1, #200
masked: subs r1, #1
       bne masked
       movs r0, #0
       msr basepri, r0
       cpsid i
       movw r1, #150
shut:  subs r1, #1
       bne shut
       cpsie i
       {store("ISPR+8", 0x18000)}
       {store("STIR", 80)}
       svc #7
       b loop
irq28: {store("TIM2+16", 0)} note 28
       bx lr
irq29: push {{r4, lr}}
       {store("TIM3+16", 0)} note 29
       vmov s2, r7
       vadd.f32 s3, s2, s2
       movw r1, #250
three: subs r1, #1
       bne three
       note 290
       pop {{r4, pc}}
irq30: push {{r4, lr}}
       {store("TIM4+16", 0)} note 30
       {store("ICSR", 1 << 28)}
       movw r1, #300
four:  subs r1, #1
       bne four
       mrs r1, ipsr
       note r1
       pop {{r4, pc}}
irq79: note 79
       bx lr
irq80: note 80
       vmov r1, s0
       bx lr
svc:   ldr r0, [sp, #24]
       subs r0, #2
       ldrb r1, [r0]
       note r1
       bx lr
pend_sv: note 14
       bx lr
sys_tick: push {{r4, lr}}
       mrs r0, msp
       movs r2, #0xFF
       ands r0, r2
       note r0                ; how deep
       pop {{r4, pc}}
"""
"""Timers, SysTick, PendSV, SVC, software interrupts on six priorities; floating point; masked at times."""

_SKIP = """
       mrs r0, msp
       ldr r1, [r0, #24]
       adds r1, #4
       str r1, [r0, #24]
       bx lr
"""

FAULTS = f"""
reset: mov32 r7, LIST
       {store("SHCSR", 0x0007_0000)} {store("CCR", 0x218)} {store("CPACR", 0)}
       movs r4, #0
       movs r5, #0
again: mov32 r0, 0x60000000
       ldr r1, [r0, #16]      ; where nothing is
       str r1, [r0, #16]
       mov32 r0, 0x08000000
       str r1, [r0, #16]      ; flash
       mov32 r0, RAM+1
       ldr r1, [r0, #16]      ; traps: CCR.UNALIGN_TRP
       sdiv r1, r0, r5
       udiv r1, r0, r5
       vmov r1, s0            ; CP10 is off
       ldrd r0, r1, [r0, #0]
       .word 0xA000F7F0       ; permanently undefined, four bytes
       adds r4, #1
       note r4
       cmp r4, #4
       bne again
       {store("CCR", 0x200)} {store("SHCSR", 0)}
       mov32 r0, 0x60000000
       ldr r1, [r0, #16]      ; escalates
       sdiv r1, r0, r5        ; is 0
       note r1
       mov32 r0, RAM+0x100
       bx r0                  ; no Thumb bit: never comes back
       b .
mem_manage: note 4
       {_SKIP}
bus_fault: mov32 r0, CFSR
       ldr r1, [r0]
       note r1
       str r1, [r0]
       mov32 r0, BFAR
       ldr r1, [r0]
       note r1
       {_SKIP}
usage_fault: mov32 r0, CFSR
       ldr r1, [r0]
       note r1
       str r1, [r0]
       {_SKIP}
hard_fault: mov32 r0, HFSR
       ldr r1, [r0]
       note r1
       str r1, [r0]
       mov32 r0, CFSR
       ldr r1, [r0]
       note r1
       str r1, [r0]
       mov32 r0, RAM
       ldr r1, [r0, #8]
       adds r1, #1
       str r1, [r0, #8]
       cmp r1, #2
       bcs give_up
       {_SKIP}
give_up: b .
"""
"""Each fault with its own handler, then escalated."""

LOCK_UP = """
reset: mov32 r7, LIST
       note 1
       mov32 r0, 0x60000000
       ldr r1, [r0]
       b .
hard_fault: note 3
       mov32 r0, 0x60000000
       ldr r1, [r0]
       b .
nmi:   note 2
       bx lr
"""
"""A fault in the handler of a fault causes a lock-up."""

IT_BLOCKS = f"""
reset: mov32 r7, LIST
       {store("SYST_RVR", 96)} {store("SYST_CVR", 0)} {store("SYST_CSR", 7)}
       mov32 r8, RAM+64
       movs r4, #0
       movs r5, #0
       movs r6, #0
loop:  adds r4, #1
       tst r4, #1
       itete eq
       addseq r5, #1
       addsne r6, #1
       streq r5, [r8]
       strne r6, [r8, #4]
       tst r4, #2
       ittt ne
       ldrne r0, [r8]
       ldrne r1, [r8, #4]
       addsne r6, r0, r1
       tst r4, #12
       itt eq
       addseq r5, #3
       beq loop
       cmp r4, r6
       ite hi
       movshi r2, #1
       movsls r2, #2
       str r2, [r8, #8]
       it al
       b loop
sys_tick: mov32 r0, RAM
       ldr r1, [r0]
       adds r1, #1
       str r1, [r0]
       mrs r2, xpsr
       str r2, [r0, #4]
       bx lr
""".replace("       it al\n", "")
"""Conditions that are true and false, with interrupts between any two instructions."""

MEMORY = f"""
reset: mov32 r7, LIST
       {store("AHB1ENR", 2)} {store("GPIOB", 1 << 10)}
       mov32 r4, 0x22008000          ; bits of 0x2000 0400
       mov32 r5, 0x42408294          ; PB5 in GPIOB's ODR: 0x42000000 + 0x20414 * 32 + 5 * 4
       mov32 r8, RAM+0x400
       movs r6, #0
loop:  adds r6, #1
       str r6, [r4]
       str r6, [r4, #124]
       strb r6, [r4, #8]
       ldr r0, [r8]
       note r0
       str r6, [r5]
       ldr r0, [r5]
       note r0
       mov32 r1, 0x80402010
       str r1, [r8, #5]              ; unaligned
       strh r6, [r8, #11]
       ldr r0, [r8, #6]
       note r0
       ldrh r0, [r8, #11]
       note r0
       strd r0, r1, [r8, #16]
       ldrd r1, r2, [r8, #16]
       ldrex r0, [r8, #16]
       adds r0, #1
       strex r2, r0, [r8, #16]
       note r2
       strex r2, r0, [r8, #16]       ; no longer exclusive
       note r2
       ldrex r0, [r8, #16]
       svc #0
       strex r2, r0, [r8, #16]       ; an exception came between
       note r2
       push {{r0-r2, r8-r11, lr}}
       pop {{r0-r2, r8-r11, lr}}
       cmp r6, #40
       bne loop
       b .
svc:   bx lr
"""
"""Bit-band, unaligned accesses, pairs, exclusive accesses, long lists."""

EDGES = f"""
reset: mov32 r7, LIST
       {store("AHB1ENR", 3)} {store("APB2ENR", 1 << 14)} {store("APB1ENR", 1)}
       {store("GPIOB", 1 << 10 | 1 << 8)} {store("GPIOA", 2)} {store("GPIOA+32", 1)}
       {store("EXTI", 1)} {store("EXTI+8", 1)} {store("EXTI+12", 1)} {interrupts({6: 0x40, 28: 0x20})}
       {store("TIM2+40", 15)} {store("TIM2+24", 1)} {store("TIM2+32", 1)} {store("TIM2+20", 1)}
       {store("TIM2+16", 0)} {store("TIM2+12", 2)} {store("TIM2", 1)}
loop:  b loop
irq6:  {store("EXTI+20", 1)} mov32 r0, GPIOA
       ldr r1, [r0, #16]
       note r1
       mov32 r0, GPIOB
       movs r2, #1
       ands r1, r2
       lsls r1, r1, #5
       str r1, [r0, #20]
       bx lr
irq28: mov32 r0, TIM2
       ldr r1, [r0, #52]     ; the capture
       note r1
       {store("TIM2+16", 0)}
       bx lr
"""
"""Both edges of PA0 interrupt, its rising edges are captured by TIM2; PB5 follows."""
