"""The commit from which this package was built or is imported.

A wheel and a source archive have the commit in a file. In a clone, git is asked. The build hook, which cannot import
the package, also runs this file, so it imports only the standard library.
"""

from __future__ import annotations

import re
import subprocess
from pathlib import Path
from typing import Final

FILE: Final = "commit.txt"
"""The file with the commit, in the package of a wheel and at the top of a source archive."""
SOURCES: Final = (
    "pyproject.toml",
    "building",
    "fcu_emulator",
    "emulator",
    "firmware_model",
    "sensors",
    "scenarios",
)
"""The files and folders on which the programs of a wheel depend."""
_LONGEST: Final = 200  # bytes of the file
_FORM: Final = re.compile(r"[0-9a-f]{7,64}( with changes)?")
_PATIENCE_S: Final = 10.0


def commit(folder: Path) -> str:
    """Return the commit of the repository at ``folder``, with a mark if sources of a wheel have changed since.

    Return "" if it is unknown, also if ``folder`` is not the top of a repository: an installed package may be inside
    a clone.
    """
    if not (folder / ".git").exists():
        return ""
    place, name = _git(folder, "rev-parse", "--show-toplevel"), _git(folder, "rev-parse", "--short", "HEAD")
    changes = _git(folder, "status", "--porcelain", "--untracked-files", "--", *SOURCES)
    if not (place and name) or changes is None or Path(place).resolve() != folder.resolve():
        return ""
    return name + (" with changes" if changes else "")


def stamped(folder: Path) -> str:
    """Return the commit in the file of ``folder``, or ""."""
    try:
        with (folder / FILE).open("rb") as file:
            text = file.read(_LONGEST).decode("ascii", "replace").strip()
    except OSError:
        return ""
    return text if _FORM.fullmatch(text) else ""


def commit_of_package(package: Path) -> str:
    """Return the commit of the package in a folder, from its file or its clone, or ""."""
    return stamped(package) or commit(package.parent) or stamped(package.parent)


def _git(folder: Path, *command: str) -> str | None:
    """Return the output of git, or None if git fails or is not installed."""
    try:
        done = subprocess.run(
            ["git", "-C", folder, *command],
            stdin=subprocess.DEVNULL,
            capture_output=True,
            encoding="utf-8",
            errors="replace",
            timeout=_PATIENCE_S,
            check=False,
        )
    except (OSError, subprocess.TimeoutExpired):
        return None
    return None if done.returncode else done.stdout.strip()
