"""A Cortex-M4F in C: see core.h, and :mod:`fcu_emulator.emulator.chip.native.loader`, which loads what was built from it.

Only the standard library is imported here: building/library.py runs this file before anything is installed.
"""

from __future__ import annotations

import re
import sys
from hashlib import sha256
from pathlib import Path
from typing import Final

FOLDER: Final = Path(__file__).parent
_MARK: Final = re.compile(rb"fcu library \[([^\]]*)\] built with \[([^\]]*)\] \[([^\]]*)\]")
"""As in library.c."""


def library_name(platform: str = sys.platform) -> str:
    """What the file is called on that system; it lies in :data:`FOLDER`."""
    return {"win32": "fcu.dll", "darwin": "libfcu.dylib"}.get(platform, "libfcu.so")


def sources(folder: Path = FOLDER) -> list[Path]:
    """All C files and headers; none in an installed wheel."""
    return sorted(path for path in folder.rglob("*.[ch]") if path.is_file())


def digest(folder: Path = FOLDER) -> str:
    """What the C files are; "" where there are none.

    The library keeps what it was built from: one that is older than its sources would be read wrongly.
    """
    files = sources(folder)
    return sha256(b"".join(path.read_bytes() for path in files)).hexdigest()[:16] if files else ""


def built_from(file: Path) -> tuple[str, str, str]:
    """The digest of a library's sources, its compiler, and what that calls its version.

    All are "" where it is missing or not one of ours.
    """
    found = _MARK.search(file.read_bytes()) if file.is_file() else None
    digest, compiler, version = (part.decode() for part in found.groups()) if found else ("", "", "")
    return digest, compiler, version
