"""Raw binary: the bytes of flash from its first address on, nothing else."""

from __future__ import annotations

from emulator.chip.image.memory_map import FLASH
from emulator.chip.image.segments import Segment
from emulator.errors import FirmwareFileError

_FOREIGN = {
    b"MZ": "a Windows program",
    b"PK\x03\x04": "a ZIP archive; unpack it and give the ELF, HEX or BIN inside",
    b"!<arch>\n": "a static library (.a); link it into an ELF",
    b"UF2\n": "a UF2 file; give the ELF, HEX or BIN of the same build",
    b"\xcf\xfa\xed\xfe": "a macOS program",
    b"\x1f\x8b": "a gzip archive; unpack it and give the ELF, HEX or BIN inside",
}
_S_RECORDS = (b"S0", b"S1", b"S2", b"S3")
_TEXT = frozenset(range(0x20, 0x7F)) | frozenset(b"\t\n\r\f")
_SAMPLE = 256  # bytes; a vector table with its zero and 0x08 bytes is never all text


def read_binary(file: str, data: bytes) -> tuple[Segment, ...]:
    """The file as contents of flash. Raises FirmwareFileError if it is something else or too long."""
    problem = _foreign(data)
    if problem:
        raise FirmwareFileError(file, problem)
    size = FLASH.end - FLASH.start
    if len(data) > size:
        raise FirmwareFileError(
            file, f"is {len(data)} bytes long; as raw contents of flash it can have {size} at most"
        )
    return (Segment(FLASH.start, data),)


def _foreign(data: bytes) -> str | None:
    for magic, what in _FOREIGN.items():
        if data.startswith(magic):
            return f"is {what}"
    if data.startswith(_S_RECORDS) and _TEXT.issuperset(data[:_SAMPLE]):
        return "holds Motorola S-records; convert it: arm-none-eabi-objcopy -I srec -O ihex"
    if _TEXT.issuperset(data[:_SAMPLE]):
        return "is a text; give the ELF, HEX or BIN file that the build made of it"
    return None
