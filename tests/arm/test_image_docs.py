"""The page about firmware files has the messages of the loaders."""

from __future__ import annotations

import re
from dataclasses import fields
from pathlib import Path

import pytest

from fcu_emulator.emulator.chip.firmware import Limits
from fcu_emulator.emulator.chip.image import parse_firmware
from fcu_emulator.emulator.errors import FirmwareFileError
from tests.support.arm.elf_builder import FLASH, RESET, Load, code, debug_elf, elf, hex_text

PAGE = (Path(__file__).parents[2] / "docs" / "firmware-files.md").read_text(encoding="utf-8")
X86_64 = elf(machine=62, ident=b"\x7fELF\x02\x01\x01")
FILES = {
    "main.c": b"#include <stdio.h>\n",
    "main.o": elf(kind=1),
    "a.out": X86_64,
    "lab3.elf": b"",
    "lab3.elf (2)": debug_elf()[:300],
    "f407.elf": elf([Load(FLASH, code()), Load(0x1000_0000, b"", memory_size=16)]),
    "f401re.bin": code(stack=0x2001_8000),
    "noise.elf": b"nono\0\1\2\3" * 16,
    "app.elf": elf([Load(FLASH + 0x4000, code(reset=(FLASH + 0x4040) | 1))]),
    "own.bin": code(reset=RESET),
    "part.bin": code(reset=(FLASH + 0x8000) | 1),
    "two.elf": elf([Load(FLASH, code()), Load(FLASH + 0x80, b"12")]),
    "lab3.hex": hex_text(code()).replace(b"FF\n", b"FE\n"),
    "lab3.hex (2)": hex_text(code()).replace(b":00000001FF\n", b""),
    "whole.bin": code(size=0x4_0002),
}


def refusal(name: str) -> str:
    with pytest.raises(FirmwareFileError) as caught:
        parse_firmware(FILES[name], name.partition(" ")[0])
    return str(caught.value)


def test_documented_messages_equal_loader() -> None:
    shown = re.findall(r"^\| `([\w.]+: [^`]+)` \|", PAGE, re.MULTILINE)

    assert shown == [refusal(name) for name in FILES]


def test_documented_limits_equal_defaults() -> None:
    shown = re.findall(r"^\| `(\w+)=NUMBER` \| ([\d,]+) \|", PAGE, re.MULTILINE)

    assert [(name, int(number.replace(",", ""))) for name, number in shown] == [
        (field.name, field.default) for field in fields(Limits)
    ]
