"""Description of the build to which a table of figures belongs."""

from __future__ import annotations

import platform
from pathlib import Path

from fcu_emulator import emulator


def describe() -> dict[str, str]:
    """Return sources and compiler of the C library, commit, Python and machine, as far as each is known."""
    library = _library()
    return {
        "commit": _commit(),
        "library": library,
        "python": f"{platform.python_implementation()} {platform.python_version()}",
        "machine": f"{_processor()}, {platform.system()}",
    }


def _commit() -> str:
    try:
        from fcu_emulator.emulator.host.commit import commit
    except ImportError:  # a build that is older than the module
        return "unknown"
    return commit(Path(emulator.__file__).parents[1]) or "unknown"


def _library() -> str:
    try:
        from fcu_emulator.emulator.chip.native import FOLDER, built_from, library_name
    except ImportError:  # a build from before there was the library
        return "unknown"
    sources, *compiler = built_from(FOLDER / library_name())
    return f"sources {sources}, compiler {' '.join(compiler)}"


def _processor() -> str:
    information = Path("/proc/cpuinfo")
    if information.is_file():
        for line in information.read_text(encoding="utf-8").splitlines():
            if line.startswith("model name"):
                return line.partition(":")[2].strip()
    return platform.processor() or platform.machine()
