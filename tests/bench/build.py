"""Description of the build to which a table of figures belongs."""

from __future__ import annotations

import platform
import runpy
import subprocess
from pathlib import Path

from fcu_emulator import emulator

_SOURCES = runpy.run_path(str(Path(__file__).parents[2] / "building" / "namespace.py"))["SOURCES"]


def describe() -> dict[str, str]:
    """Return sources and compiler of the C library, commit, Python and machine, as far as each is known."""
    library = _library()
    return {
        "commit": commit(Path(emulator.__file__).parents[1]),
        "library": library,
        "python": f"{platform.python_implementation()} {platform.python_version()}",
        "machine": f"{_processor()}, {platform.system()}",
    }


def _library() -> str:
    try:
        from fcu_emulator.emulator.chip.native import FOLDER, built_from, library_name
    except ImportError:  # a build from before there was the library
        return "unknown"
    sources, *compiler = built_from(FOLDER / library_name())
    return f"sources {sources}, compiler {' '.join(compiler)}"


def commit(folder: Path) -> str:
    """Return the commit of the repository at ``folder``, with a mark if sources of the build have changed since.

    Return "unknown" if ``folder`` is not the top of a repository: an installed package may be inside a clone.
    """
    place, name = _git(folder, "rev-parse", "--show-toplevel"), _git(folder, "rev-parse", "--short", "HEAD")
    changes = _git(folder, "status", "--porcelain", "--untracked-files", "--", *_SOURCES)
    if not (place and name) or changes is None or Path(place).resolve() != folder.resolve():
        return "unknown"
    return name + (" with changes" if changes else "")


def _git(folder: Path, *command: str) -> str | None:
    """Return the output of git, or None if git fails or is not installed."""
    try:
        done = subprocess.run(["git", "-C", folder, *command], capture_output=True, text=True, check=False)
    except OSError:
        return None
    return None if done.returncode else done.stdout.strip()


def _processor() -> str:
    information = Path("/proc/cpuinfo")
    if information.is_file():
        for line in information.read_text(encoding="utf-8").splitlines():
            if line.startswith("model name"):
                return line.partition(":")[2].strip()
    return platform.processor() or platform.machine()
