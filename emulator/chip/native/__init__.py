"""The STM32F401 in C; ``fcu.h`` is the interface.

This file imports only the standard library, because building/library.py runs it before the
installation.
"""

from __future__ import annotations

import re
import sys
from hashlib import sha256
from pathlib import Path
from typing import Final

FOLDER: Final = Path(__file__).parent
_MARK: Final = re.compile(rb"fcu library \[([^\]]*)\] built with \[([^\]]*)\] \[([^\]]*)\]")
"""The text that library.c puts into the library."""


def library_name(platform: str = sys.platform) -> str:
    """Return the file name of the library on a platform."""
    return {"win32": "fcu.dll", "darwin": "libfcu.dylib"}.get(platform, "libfcu.so")


def sources(folder: Path = FOLDER) -> list[Path]:
    """Return the C sources except generated sources. A wheel does not contain C sources."""
    return sorted(path for path in folder.rglob("*.[ch]") if path.parent.name != "generated")


def declarations(folder: Path = FOLDER) -> list[Path]:
    """Return the Python files that determine the generated headers."""
    chip = folder.parent
    root = chip.parents[1]
    return [
        chip / "memory_map.py",
        *sorted((chip / "registers").glob("*.py")),
        root / "sensors" / "register.py",
    ]


def digest(folder: Path = FOLDER) -> str:
    """Return the digest of the library's sources, or "" without C files."""
    files = sources(folder)
    if not files:
        return ""
    return sha256(b"".join(path.read_bytes() for path in (*files, *declarations(folder)))).hexdigest()[:16]


def built_from(file: Path) -> tuple[str, str, str]:
    """Return the digest of a library's sources, its compiler and the compiler's version; "" for another file."""
    found = _MARK.search(file.read_bytes()) if file.is_file() else None
    digest, compiler, version = (part.decode() for part in found.groups()) if found else ("", "", "")
    return digest, compiler, version
