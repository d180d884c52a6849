"""Put the four top-level folders into the package fcu_emulator, for wheels and type checkers.

``python building/namespace.py`` links them below build/types for mypy.
"""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Final

ROOT: Final = Path(__file__).parents[1]
FOLDERS: Final = ("emulator", "firmware_model", "sensors", "scenarios")
GUIDES: Final = ("llms.txt", "docs/*.md")
"""Guides that are installed, for ``fcu mcp``: their list and their pages, without pictures."""
TYPES: Final = ROOT / "build" / "types" / "fcu_emulator"
_NOT_SHIPPED: Final = ("emulator/chip/native/", "firmware_model/arm/solution/")
"""Files that wheels do not contain: C sources, and the lab's solution."""
_BUILT: Final = {".c", ".h", ".so", ".dylib", ".dll", ".pyd", ".pyc"}


def wheel_files() -> dict[str, str]:
    """Return the source path of each file, with its path in the wheel."""
    files = {str(path): path.name for path in (ROOT / "building" / "site").iterdir() if path.is_file()}
    for folder in FOLDERS:
        for path in sorted((ROOT / folder).rglob("*")):
            place = path.relative_to(ROOT).as_posix()
            if path.is_file() and "__pycache__" not in path.parts and not _left_out(place):
                files[str(path)] = f"fcu_emulator/{place}"
    for pattern in GUIDES:
        for path in sorted(ROOT.glob(pattern)):
            files[str(path)] = f"fcu_emulator/{path.relative_to(ROOT).as_posix()}"
    return files


def _left_out(place: str) -> bool:
    native, solution = _NOT_SHIPPED
    return place.startswith(solution) or (place.startswith(native) and Path(place).suffix in _BUILT)


def link_types() -> None:
    """Link or copy the folders. Correct links stay, because a type checker may be using them."""
    TYPES.mkdir(parents=True, exist_ok=True)
    for source in (*(ROOT / name for name in FOLDERS), *(ROOT / "fcu_emulator").iterdir()):
        place = TYPES / source.name
        if source.name == "__pycache__" or (place.is_symlink() and place.resolve() == source):
            continue
        if place.is_symlink() or place.is_file():
            place.unlink()
        try:
            place.symlink_to(source)
        except FileExistsError:  # another process has created the link, or a copy exists
            if not place.is_symlink():
                _copy(source, place)
        except OSError:  # Windows, without permission to create links
            _copy(source, place)


def _copy(source: Path, place: Path) -> None:
    if source.is_dir():
        shutil.copytree(source, place, dirs_exist_ok=True)
    else:
        shutil.copyfile(source, place)


if __name__ == "__main__":
    link_types()
