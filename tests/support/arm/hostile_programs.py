"""Hostile programs and boards that run them, written for :mod:`tests.support.arm.thumb_assembler`."""

from __future__ import annotations

import struct
from pathlib import Path

from fcu_emulator import Board
from tests.support.arm.thumb_assembler import assemble

FLASH, RAM, STACK = 0x0800_0000, 0x2000_0000, 0x2001_0000
VECTORS = 101  # 16 of the core, 85 of the chip (RM0368 table 38)
CODE = FLASH + 0x400
NAMES = {
    "RAM": RAM,
    "RCC_AHB1ENR": 0x4002_3830,
    "RCC_APB1ENR": 0x4002_3840,
    "RCC_APB2ENR": 0x4002_3844,
    "GPIOA_MODER": 0x4002_0000,
    "GPIOA_AFRH": 0x4002_0024,
    "USART1_DR": 0x4001_1004,
    "USART1_BRR": 0x4001_1008,
    "USART1_CR1": 0x4001_100C,
    "IWDG_KR": 0x4000_3000,
    "IWDG_PR": 0x4000_3004,
    "IWDG_RLR": 0x4000_3008,
    "TIM9_CR1": 0x4001_4000,
    "TIM9_DIER": 0x4001_400C,
    "TIM9_ARR": 0x4001_402C,
    "SYST_CSR": 0xE000_E010,
    "SYST_RVR": 0xE000_E014,
    "NVIC_ISER0": 0xE000_E100,
    "AIRCR": 0xE000_ED0C,
}
EVERY_CLOCK_AND_INTERRUPT = """
    movs r1, #0
    subs r1, #1
    mov32 r0, 0x40023830     ; RCC: AHB1ENR, AHB2ENR, APB1ENR, APB2ENR
    str r1, [r0]
    str r1, [r0, #4]
    str r1, [r0, #16]
    str r1, [r0, #20]
    mov32 r0, 0xE000E100     ; NVIC_ISER0 to 2
    str r1, [r0]
    str r1, [r0, #4]
    str r1, [r0, #8]
"""
LOOK_AWAY = """
interrupt: bx lr
fault:                       ; go on behind the instruction, of four bytes
    mrs r0, msp
    ldr r1, [r0, #24]
    adds r1, #4
    str r1, [r0, #24]
    bx lr
"""


def put(register: str, value: int) -> str:
    """Return the instructions that store to a register."""
    return f"mov32 r0, {register}\nmov32 r1, {value}\nstr r1, [r0]\n"


def program(source: str, behind: bytes = b"") -> bytes:
    """Return contents of flash. ``reset:`` is the start, and ``fault:`` and ``interrupt:`` are for exceptions.

    Labels that ``source`` does not have are endless loops. ``behind`` follows, aligned to words.
    """
    code, labels = assemble(source + "\nstuck: b .", CODE, NAMES)
    reset, fault, interrupt = (
        labels.get(name, labels["stuck"]) | 1 for name in ("reset", "fault", "interrupt")
    )
    table = [STACK, reset, *[fault] * 5, *[interrupt] * (VECTORS - 7)]
    data = struct.pack(f"<{VECTORS}I", *table).ljust(CODE - FLASH, b"\xff") + code
    return data.ljust(len(data) + 3 & ~3, b"\0") + behind


def board_with(data: bytes, folder: Path) -> Board:
    """Return a board with these contents of flash."""
    file = folder / "hostile.bin"
    file.write_bytes(data)
    return Board(firmware=file)


def word(board: Board, address: int) -> int:
    """Return a word of the chip's memory."""
    assert board.chip is not None
    content = board.chip.core.memory(address, 4)
    assert content is not None
    return int.from_bytes(content, "little")
