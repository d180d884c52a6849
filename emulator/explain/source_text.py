"""The text of source lines, from the files beside a firmware's ELF file, or else of instructions."""

from __future__ import annotations

from pathlib import Path
from typing import Final

from fcu_emulator.emulator.chip.image import FirmwareImage
from fcu_emulator.emulator.chip.image.lines import SourceLine
from fcu_emulator.emulator.text import visible

_LONGEST_INSTRUCTION: Final = 4  # bytes (ARMv7-M ARM A5.1)
_LARGEST: Final = 1 << 20
_LONGEST: Final = 90
SOURCE_SUFFIXES: Final = frozenset({".c", ".h", ".cc", ".cpp", ".cxx", ".hpp", ".s", ".S", ".inc"})


def source_text(image: FirmwareImage, line: SourceLine | None) -> str:
    """Return a source line, or a remark if the file is newer than the build, or "" without the file.

    Only files in the ELF file's folder are read, because debug information may name any file.
    """
    if line is None:
        return ""
    folder = image.path.parent.resolve()
    try:
        file = (folder / line.path.replace("\\", "/")).resolve()
        if not file.is_relative_to(folder) or file.suffix not in SOURCE_SUFFIXES or not file.is_file():
            return ""
        if file.stat().st_mtime > image.path.stat().st_mtime:
            return f"{line.file} has changed since {image.path.name} was built: build again."
        return _line(file, line.line)
    except (OSError, ValueError):
        return ""


def _line(file: Path, number: int) -> str:
    if file.stat().st_size > _LARGEST:
        return ""
    lines = file.read_text(encoding="utf-8", errors="replace").splitlines()
    text = lines[number - 1].strip() if 0 < number <= len(lines) else ""
    is_statement = any(map(str.isalnum, text))  # false for the brace at a function's end
    return f"{file.name}:{number}: {visible(text)[:_LONGEST]}" if is_statement else ""


def instruction_text(image: FirmwareImage, address: int) -> str:
    """Return the instruction at an address in flash, such as ``vmul.f32 s1, s0, s16``.

    Return "" without the package capstone (extra ``disassembly``), outside of the file's contents, and for
    undefined instructions.
    """
    try:
        import capstone
    except ImportError:
        return ""
    code = image.code(address, _LONGEST_INSTRUCTION) or image.code(address, _LONGEST_INSTRUCTION // 2)
    if code is None:
        return ""
    decoder = capstone.Cs(capstone.CS_ARCH_ARM, capstone.CS_MODE_THUMB | capstone.CS_MODE_MCLASS)
    found = next(decoder.disasm_lite(bytes(code), address, 1), None)
    return f"{found[2]} {found[3]}".rstrip() if found else ""
