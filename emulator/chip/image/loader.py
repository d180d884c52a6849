"""From a path to a firmware image: what kind of file is it, and may it be read at all?

Decision: the kind is taken from the contents. A suffix is only what somebody called the file; a ``.bin`` that
is an ELF is a frequent slip, and harmless when the magic number decides.
"""

from __future__ import annotations

import stat
from pathlib import Path

from emulator.chip.image.binary import read_binary
from emulator.chip.image.elf import MAGIC, open_elf
from emulator.chip.image.image import FirmwareImage, checked
from emulator.chip.image.intel_hex import looks_like_hex, read_hex
from emulator.errors import FirmwareFileError

LONGEST_FILE = 64 << 20  # bytes; ST's stock firmware with all its debug information has 4 MB


def load_firmware(path: str | Path) -> FirmwareImage:
    """The firmware in an ELF, Intel HEX or raw binary file.

    Raises FirmwareFileError, and nothing else, when it is no firmware for this board: one line that says what
    is wrong with which file and what would be right.
    """
    return parse_firmware(_contents(Path(path)), path)


def parse_firmware(data: bytes, path: str | Path) -> FirmwareImage:
    """As ``load_firmware``, from the contents; ``path`` is only named in messages and in the result."""
    path = Path(path)
    file = str(path)
    if not data:
        raise FirmwareFileError(file, "is empty; give the ELF, HEX or BIN file that the build made")
    if len(data) > LONGEST_FILE:
        raise FirmwareFileError(
            file, f"is {len(data)} bytes long; firmware files have {LONGEST_FILE} at most"
        )
    if data.startswith(MAGIC):
        elf = open_elf(file, data)
        return checked(path, "elf", elf.segments, elf.symbols, elf.notes)
    if looks_like_hex(data):
        return checked(path, "hex", read_hex(file, data))
    return checked(path, "bin", read_binary(file, data))


def _contents(path: Path) -> bytes:
    """The whole file, once its kind and size are known to be harmless."""
    try:
        status = path.stat()
        if stat.S_ISDIR(status.st_mode):
            raise FirmwareFileError(str(path), "is a folder; give the ELF, HEX or BIN file in it")
        if not stat.S_ISREG(status.st_mode):
            raise FirmwareFileError(str(path), "is no ordinary file; give an ELF, HEX or BIN file")
        if status.st_size > LONGEST_FILE:
            problem = f"is {status.st_size} bytes long; firmware files have {LONGEST_FILE} at most"
            raise FirmwareFileError(str(path), problem)
        with path.open("rb") as file:
            return file.read(LONGEST_FILE + 1)
    except FileNotFoundError:
        raise FirmwareFileError(str(path), "does not exist; give the ELF, HEX or BIN file to run") from None
    except (OSError, ValueError) as problem:  # ValueError: a path with a zero byte in it
        reason = getattr(problem, "strerror", None) or problem
        raise FirmwareFileError(str(path), f"cannot be read: {reason}") from None
