"""The timers' registers: offsets, names, and which bits which timer has (RM0368 12.4, 13.4, 14.4, 14.5)."""

from __future__ import annotations

from emulator.arm.peripherals.tim_variants import Variant

CR1, CR2, SMCR, DIER, SR, EGR = 0x00, 0x04, 0x08, 0x0C, 0x10, 0x14
CCMR1, CCMR2, CCER, CNT, PSC, ARR, RCR, CCR1 = 0x18, 0x1C, 0x20, 0x24, 0x28, 0x2C, 0x30, 0x34
CCR2, CCR3, CCR4, BDTR, DCR, DMAR, OR = 0x38, 0x3C, 0x40, 0x44, 0x48, 0x4C, 0x50

NAMES = {
    CR1: "CR1",
    CR2: "CR2",
    SMCR: "SMCR",
    DIER: "DIER",
    SR: "SR",
    EGR: "EGR",
    CCMR1: "CCMR1",
    CCMR2: "CCMR2",
    CCER: "CCER",
    CNT: "CNT",
    PSC: "PSC",
    ARR: "ARR",
    RCR: "RCR",
    CCR1: "CCR1",
    CCR2: "CCR2",
    CCR3: "CCR3",
    CCR4: "CCR4",
    BDTR: "BDTR",
    DCR: "DCR",
    DMAR: "DMAR",
    OR: "OR",
}


def masks(variant: Variant) -> dict[int, int]:
    """The bits that exist, by offset; a register that a timer does not have is written in vain and reads 0.

    CR2 is given to TIM9 to TIM11 too: ST's HAL writes its MMS field without looking at the timer.
    """
    count = variant.channels
    compare = ((1 << count) - 1) << 1  # CC1IF to CC4IF
    value = (1 << variant.bits) - 1
    bits = {
        CR1: 0x38F if variant.up_only else 0x3FF,
        CR2: 0x7FF8 | variant.advanced * 0x07,
        SMCR: 0xFFF7,
        DIER: 0x41 | compare,
        SR: 0x41 | compare | compare << 8,
        EGR: 0x41 | compare,
        CCMR1: 0xFFFF if count > 1 else 0x00FF,
        CCMR2: 0xFFFF if count > 2 else 0,
        CCER: (0xFFFF if variant.advanced else 0xBBBB) & (1 << 4 * count) - 1,
        CNT: value,
        PSC: 0xFFFF,
        ARR: value,
        **dict.fromkeys(range(CCR1, CCR1 + 4 * count, 4), value),
        OR: 0x0CC3,
    }
    if not variant.up_only:
        bits[DIER] |= 0x4100 | compare << 8
        bits |= {DCR: 0x1F1F, DMAR: 0xFFFF}
    if variant.advanced:
        for offset in (DIER, SR, EGR):
            bits[offset] |= 0xA0  # COM and break
        bits[DIER] |= 0x2000
        bits |= {RCR: 0xFF, BDTR: 0xFFFF}
    return bits
