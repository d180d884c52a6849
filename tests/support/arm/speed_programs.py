"""Programs for the whole chip in assembly: I2C2 with interrupts and with DMA, and loops that never idle.

They run from HSI, 16 MHz, with the sensors on wiring ``lab3``.
"""

from __future__ import annotations

import struct

from tests.support.arm.thumb_assembler import assemble

CODE = 0x0800_0200
STACK = 0x2001_0000
SYMBOLS = {
    "RCC_AHB1ENR": 0x4002_3830,
    "RCC_APB1ENR": 0x4002_3840,
    "GPIOA": 0x4002_0000,
    "GPIOB": 0x4002_0400,
    "I2C2": 0x4000_5800,
    "DMA1": 0x4002_6000,
    "ISER": 0xE000_E100,
    "RAM": 0x2000_0000,
}
_VECTORS = 102


def program(source: str) -> bytes:
    """Return contents of flash at 0x0800 0000. Execution begins at ``reset``; ``irqN`` handles interrupt N."""
    code, labels = assemble(source, CODE, SYMBOLS)
    table = [STACK, labels["reset"] | 1] + [labels["reset"] | 1] * (_VECTORS - 2)
    for name, address in labels.items():
        if name.startswith("irq"):
            table[16 + int(name[3:])] = address | 1
    return struct.pack(f"<{_VECTORS}I", *table).ljust(CODE & 0xFFFF, b"\xff") + code


def put(address: str, value: int) -> str:
    """Return the instructions that write a word to a register."""
    return f"mov32 r0, {address}\n mov32 r1, {value}\n str r1, [r0]\n"


_I2C2 = (
    put("RCC_AHB1ENR", 1 << 21 | 1 << 1)  # DMA1, GPIOB
    + put("RCC_APB1ENR", 1 << 22)
    + put("GPIOB+4", 1 << 10 | 1 << 3)  # open drain
    + put("GPIOB+32", 9 << 12)  # PB3 is SDA
    + put("GPIOB+36", 4 << 8)  # PB10 is SCL
    + put("GPIOB", 2 << 20 | 2 << 6)
    + put("I2C2+4", 1 << 9 | 16)  # events interrupt; PCLK1 is 16 MHz
    + put("I2C2+28", 1 << 15 | 14)  # 400 kHz at most
    + put("I2C2+32", 5)
    + put("I2C2", 1)
    + put("ISER+4", 1 << 1)  # interrupt 33
)

_REGISTER_NUMBER_SENT = """
irq33: mov32 r0, I2C2
       mov32 r3, RAM
       ldr r1, [r0, #20]
       tst r1, #1
       bne started
       tst r1, #2
       bne addressed
       tst r1, #4
       bne both
       bx lr
started: ldr r2, [r3]       ; 0 while the register's number is sent, 2 until the repeated start, then 1
       cmp r2, #0
       beq address
       movs r2, #1
       str r2, [r3]
address: adds r2, #0xD6
       str r2, [r0, #16]
       bx lr
"""

_COUNT_AND_ADD = """
       mov32 r5, RAM
again: movs r1, #0
       str r1, [r5]
       str r1, [r5, #4]
       mov32 r0, I2C2
       movw r1, #0x501       ; ACK, START, PE
       str r1, [r0]
wait:  ldr r1, [r5, #4]     ; set by the handler
       cmp r1, #0
       beq wait
       ldr r1, [r5, #8]
       ldr r2, [r5, #12]
       adds r2, r2, r1
       str r2, [r5, #12]
       b again
"""

I2C_BY_INTERRUPT = f"""
reset: {_I2C2} {_COUNT_AND_ADD} {_REGISTER_NUMBER_SENT}
addressed: ldr r2, [r3]
       cmp r2, #0
       bne receive
       ldr r2, [r0, #24]    ; clears ADDR
       movs r2, #0x20       ; OUT_TEMP_L
       str r2, [r0, #16]
       bx lr
receive: movw r2, #0x801     ; POS and no ACK: two bytes
       str r2, [r0]
       ldr r2, [r0, #24]
       bx lr
both:  ldr r2, [r3]
       cmp r2, #1
       beq received
       movs r2, #2          ; BTF stands until the repeated start
       str r2, [r3]
       movw r2, #0xD01       ; POS, ACK, START: a repeated one
       str r2, [r0]
       bx lr
received: movw r2, #0x201    ; STOP
       str r2, [r0]
       ldr r1, [r0, #16]
       ldr r2, [r0, #16]
       lsls r2, r2, #8
       adds r1, r1, r2
       str r1, [r3, #8]
       movs r2, #1
       str r2, [r3, #4]
       bx lr
"""
"""Reads the temperature repeatedly: RAM+8 has the latest value, RAM+12 the sum of all."""

I2C_BY_DMA = f"""
reset: {_I2C2} {put("ISER", 1 << 13)} {_COUNT_AND_ADD} {_REGISTER_NUMBER_SENT}
addressed: ldr r2, [r3]
       cmp r2, #0
       bne receive
       ldr r2, [r0, #24]
       movs r2, #0x20
       str r2, [r0, #16]
       bx lr
receive: mov32 r1, DMA1+64   ; stream 2, channel 7: I2C2_RX
       movs r2, #2
       str r2, [r1, #4]
       mov32 r2, I2C2+16
       str r2, [r1, #8]
       mov32 r2, RAM+8
       str r2, [r1, #12]
       mov32 r2, 0x0E000411  ; channel 7, memory increment, interrupt at the end, enabled
       str r2, [r1]
       movw r2, #0x1A10      ; LAST, DMAEN, events
       str r2, [r0, #4]
       ldr r2, [r0, #24]
       bx lr
both:  ldr r2, [r3]
       cmp r2, #1
       beq done
       movs r2, #2
       str r2, [r3]
       movw r2, #0x501
       str r2, [r0]
done:  bx lr
irq13: mov32 r0, DMA1+8      ; the stream has ended
       mov32 r1, 0x003D0000
       str r1, [r0]
       mov32 r0, I2C2
       movw r2, #0x201
       str r2, [r0]
       movw r2, #0x210
       str r2, [r0, #4]
       mov32 r3, RAM
       movs r2, #1
       str r2, [r3, #4]
       bx lr
"""

POLLS_A_PIN = f"""
reset: {put("RCC_AHB1ENR", 3)}
       mov32 r0, GPIOA
       movs r4, #0
       movs r5, #0
loop:  ldr r1, [r0, #16]
       tst r1, #1
       beq low
       adds r5, #1
low:   adds r4, #1           ; so no two laps are the same
       b loop
"""
"""Counts passes in R4, and passes with PA0 high in R5."""

SHOWS_A_PIN = f"""
reset: {put("RCC_AHB1ENR", 3)} {put("GPIOB", 1 << 10)}
       mov32 r0, GPIOA
       mov32 r2, GPIOB
       movs r6, #0x20        ; PB5
       lsls r7, r6, #16
loop:  ldr r1, [r0, #16]
       tst r1, #1
       ite eq
       streq r7, [r2, #24]
       strne r6, [r2, #24]
       b loop
"""
"""PB5 follows PA0, and every pass writes to BSRR."""

ARITHMETIC = """
reset: movs r0, #1
       movs r1, #2
       movs r2, #3
loop:  adds r0, r0, r1
       eors r1, r0
       adds r2, r2, r0
       lsls r3, r2, #3
       subs r2, r3, r1
       orrs r3, r0
       adds r4, #1
       b loop
"""
"""Counts passes of eight instructions in R4."""

COUNTS_IN_RAM = f"""
reset: {put("RCC_AHB1ENR", 1)}
       mov32 r0, GPIOA
       mov32 r2, RAM
       movs r1, #0
       str r1, [r2]
loop:  ldr r1, [r0, #16]
       ldr r4, [r2]
       adds r4, #1
       str r4, [r2]
       movs r4, #0           ; all registers recur, the word at RAM does not
       b loop
"""

LOSES_THE_CLOCK = f"""
reset: {put("RCC_AHB1ENR", 1)}
       mov32 r2, GPIOA
       movw r3, #5000
loop:  ldr r4, [r2, #16]
       subs r3, #1
       bne loop
       {put("RCC_AHB1ENR", 0)}
       ldr r5, [r2, #16]     ; while the peripheral has no clock
       {put("RCC_AHB1ENR", 1)}
       ldr r6, [r2, #16]
       b .
"""
"""R4, R5, R6: the pins of port A with its clock, without its clock, and with its clock again."""

READS_PARTS = f"""
reset: {put("RCC_AHB1ENR", 1)}
       mov32 r2, GPIOA
       movw r3, #5000
loop:  ldr r4, [r2]          ; MODER
       subs r3, #1
       bne loop
       ldrb r5, [r2, #3]
       ldrh r6, [r2, #2]
       ldr r7, [r2, #9]      ; three bytes of OSPEEDR and one of PUPDR
       b .
"""
"""R4 to R7: polled registers of port A, read as a word, a byte, a half-word and unaligned."""
