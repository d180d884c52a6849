"""The registers of an I2C block and their bits (RM0368 section 18.6)."""

from __future__ import annotations

CR1, CR2, OAR1, OAR2, DR = 0x00, 0x04, 0x08, 0x0C, 0x10
SR1, SR2, CCR, TRISE, FLTR = 0x14, 0x18, 0x1C, 0x20, 0x24

PE, START, STOP, ACK, POS, SWRST = 1 << 0, 1 << 8, 1 << 9, 1 << 10, 1 << 11, 1 << 15
FREQ, ITERREN, ITEVTEN, ITBUFEN, DMAEN, LAST = 0x3F, 1 << 8, 1 << 9, 1 << 10, 1 << 11, 1 << 12
SB, ADDR, BTF, RXNE, TXE = 1 << 0, 1 << 1, 1 << 2, 1 << 6, 1 << 7
BERR, ARLO, AF = 1 << 8, 1 << 9, 1 << 10
MSL, BUSY, TRA = 1 << 0, 1 << 1, 1 << 2

NAMES = {
    CR1: "CR1",
    CR2: "CR2",
    OAR1: "OAR1",
    OAR2: "OAR2",
    DR: "DR",
    SR1: "SR1",
    SR2: "SR2",
    CCR: "CCR",
    TRISE: "TRISE",
    FLTR: "FLTR",
}
RESET = {**dict.fromkeys(NAMES, 0), TRISE: 2}
WRITABLE = {
    CR1: 0xBFFB,
    CR2: 0x1F3F,
    OAR1: 0xC3FF,
    OAR2: 0xFF,
    SR2: 0,
    CCR: 0xCFFF,
    TRISE: 0x3F,
    FLTR: 0x1F,
}
NOT_MODELLED = {
    CR1: {1 << 1: "SMBUS", 1 << 4: "ENARP", 1 << 5: "ENPEC (packet error check)", 1 << 12: "PEC"},
    OAR1: {0x3FF: "slave mode: an own address is set, but nobody on this board will address it"},
    OAR2: {1: "slave mode: a second own address is set, but nobody on this board will address it"},
}
