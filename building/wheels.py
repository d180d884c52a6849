"""Build the wheels of all systems with zig: python building/wheels.py [FOLDER [PLATFORM ...]]

FOLDER is ``dist`` by default; the platform ``sdist`` is the source archive. See docs/building.md.
"""

from __future__ import annotations

import os
import subprocess
import sys
import venv
from pathlib import Path
from typing import Final

from library import ZIG
from targets import TARGETS, VARIABLE

ROOT: Final = Path(__file__).parents[1]
_BUILD: Final = ROOT / "build"
_ARCHIVE: Final = "sdist"


def _python() -> Path:
    folder = _BUILD / "venv"
    python = folder / ("Scripts/python.exe" if os.name == "nt" else "bin/python")
    if not python.exists():
        venv.create(folder, with_pip=True)
    subprocess.run([python, "-m", "pip", "install", "-q", "hatchling>=1.27", ZIG], check=True)
    return python


def main(folder: str = "dist", *platforms: str) -> None:
    """Build the wheels one after the other."""
    if unknown := set(platforms) - {*TARGETS, _ARCHIVE}:
        sys.exit(
            f"building/wheels.py: {', '.join(sorted(unknown))}: unknown; known: {', '.join(TARGETS)}, {_ARCHIVE}"
        )
    python = _python()
    cache = str(_BUILD / "zig")
    for name in platforms or (*TARGETS, _ARCHIVE):
        environment = {VARIABLE: name, "ZIG_GLOBAL_CACHE_DIR": cache, "ZIG_LOCAL_CACHE_DIR": cache}
        kind = "sdist" if name == _ARCHIVE else "wheel"
        command = [str(python), "-m", "hatchling", "build", "-t", kind, "-d", str(Path(folder).resolve())]
        subprocess.run(command, cwd=ROOT, env=os.environ | environment, check=True)


if __name__ == "__main__":
    main(*sys.argv[1:])
