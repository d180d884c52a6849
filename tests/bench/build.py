"""Which build a table of figures belongs to."""

from __future__ import annotations

import platform
import subprocess
from pathlib import Path

from fcu_emulator import emulator


def describe() -> dict[str, str]:
    """Sources and compiler of the C library, commit, Python and machine, as far as each is known."""
    library = _library()
    return {
        "commit": _commit(Path(emulator.__file__).parents[1]),
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


def _commit(folder: Path) -> str:
    """Of the tree that the package lies in; with a mark if something in it was changed since."""
    told = [
        subprocess.run(["git", "-C", str(folder), *command], capture_output=True, text=True, check=False)
        for command in (
            ["rev-parse", "--short", "HEAD"],
            ["status", "--porcelain", "--", "emulator", "registers", "sensors"],
        )
    ]
    if told[0].returncode:
        return "unknown"
    return told[0].stdout.strip() + (" with changes" if told[1].stdout else "")


def _processor() -> str:
    information = Path("/proc/cpuinfo")
    if information.is_file():
        for line in information.read_text(encoding="utf-8").splitlines():
            if line.startswith("model name"):
                return line.partition(":")[2].strip()
    return platform.processor() or platform.machine()
