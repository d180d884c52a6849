"""Install each distribution and run an example: python building/check_installation.py [FOLDER]

FOLDER is ``dist`` by default. See docs/building.md.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import venv
from pathlib import Path
from typing import Final

NAME: Final = "fcu-emulator"
EXAMPLES: Final = (
    ("fcu", "--version"),
    ("fcu", "doctor"),
    ("fcu", "run", "solution", "--scenario", "desk", "--speed", "max"),
)
"""Commands that must succeed. The final command runs firmware for the chip, and its output is checked."""


def main(folder: str = "dist") -> None:
    """Check the wheel, then the source archive."""
    (archive,) = Path(folder).resolve().glob("fcu_emulator-*.tar.gz")
    check("--no-index", "--find-links", str(archive.parent), "--only-binary", ":all:", NAME)
    check(str(archive))


def check(*distribution: str) -> None:
    """Install a distribution and run the examples."""
    sys.stdout.write(f"== pip install {' '.join(distribution)}\n")
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as work:
        environment = Path(work, "environment")
        venv.create(environment, with_pip=True)
        programs = environment / ("Scripts" if os.name == "nt" else "bin")
        pip = (programs / "python", "-m", "pip", "-q")
        _run(work, *pip, "install", "--no-deps", *distribution)
        _run(work, *pip, "install", NAME)  # installs only the dependencies of the distribution
        for program, *arguments in EXAMPLES:
            _run(work, programs / program, *arguments)


def _run(folder: str, *command: str | Path) -> None:
    sys.stdout.flush()
    done = subprocess.run(command, cwd=folder, check=False)
    if done.returncode:
        sys.stderr.write(f"{' '.join(map(str, command))} exited with status {done.returncode}\n")
        sys.exit(done.returncode)


if __name__ == "__main__":
    main(*sys.argv[1:])
