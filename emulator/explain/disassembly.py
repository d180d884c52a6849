"""The text of an instruction, for firmware without source lines. Needs the extra ``disassembly``."""

from __future__ import annotations

from fcu_emulator.emulator.chip.image import FirmwareImage

_LONGEST = 4  # bytes of a Thumb instruction (ARMv7-M ARM A5.1)


def instruction_text(image: FirmwareImage, address: int) -> str:
    """Return the instruction at an address in flash, such as ``vmul.f32 s1, s0, s16``.

    Return "" without the package capstone, outside of the file's contents, and for undefined instructions.
    """
    try:
        import capstone
    except ImportError:
        return ""
    code = image.code(address, _LONGEST) or image.code(address, _LONGEST // 2)
    if code is None:
        return ""
    decoder = capstone.Cs(capstone.CS_ARCH_ARM, capstone.CS_MODE_THUMB | capstone.CS_MODE_MCLASS)
    found = next(decoder.disasm_lite(bytes(code), address, 1), None)
    return f"{found[2]} {found[3]}".rstrip() if found else ""
