"""The STM32F401 in C: ``cpu``, ``peripherals`` and, generated from Python, ``generated``; ``fcu.h`` is the interface.

:mod:`fcu_emulator.emulator.chip.native.loader` loads the library that is built from it.

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
    """Return the library's file name on that system; it is in :data:`FOLDER`."""
    return {"win32": "fcu.dll", "darwin": "libfcu.dylib"}.get(platform, "libfcu.so")


def sources(folder: Path = FOLDER) -> list[Path]:
    """Return all C files and headers except the generated ones; none in an installed wheel."""
    return sorted(path for path in folder.rglob("*.[ch]") if path.parent.name != "generated")


def declarations(folder: Path = FOLDER) -> list[Path]:
    """Return the Python files that the generated headers depend on."""
    chip = folder.parent
    root = chip.parents[1]
    return [
        chip / "memory_map.py",
        *sorted((chip / "registers").glob("*.py")),
        root / "sensors" / "register.py",
    ]


def digest(folder: Path = FOLDER) -> str:
    """Return the digest of the C files; "" without them.

    The library contains the digest of its sources, because an outdated library would be misread.
    """
    files = sources(folder)
    if not files:
        return ""
    return sha256(b"".join(path.read_bytes() for path in (*files, *declarations(folder)))).hexdigest()[:16]


def built_from(file: Path) -> tuple[str, str, str]:
    """Return the digest of a library's sources, its compiler, and the compiler's version.

    All are "" if the file is missing or is not a library of this project.
    """
    found = _MARK.search(file.read_bytes()) if file.is_file() else None
    digest, compiler, version = (part.decode() for part in found.groups()) if found else ("", "", "")
    return digest, compiler, version
