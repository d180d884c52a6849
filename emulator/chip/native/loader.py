"""The loader of the C library.

Decision: the library is loaded as ``PyDLL``, which keeps the interpreter lock while C runs, because
callbacks are frequent.
"""

from __future__ import annotations

import ctypes
import sys
from functools import cache
from pathlib import Path

from fcu_emulator.emulator.chip.native import FOLDER, built_from, digest, library_name
from fcu_emulator.emulator.errors import InputError

_BUILD = Path("building", "library.py")
_NAME = "fcu-emulator"


def problem(folder: Path = FOLDER) -> str:
    """Return the problem of the library and a remedy, or ""."""
    file = folder / library_name()
    if not file.is_file():
        return f"{file}: the C library is missing; {_remedy(folder)}"
    if digest(folder) not in ("", built_from(file)[0]):
        return f"{file}: the C library does not match its sources; {_remedy(folder)}"
    return ""


def _remedy(folder: Path) -> str:
    script = folder.parents[2] / _BUILD
    if script.is_file():
        return f"build it: {sys.executable} {script}"
    return (
        f"install it again: {sys.executable} -m pip install --force-reinstall --no-deps {_installed_from()}"
    )


def _installed_from() -> str:
    """Return the folder, wheel or package from which pip can install again."""
    import json

    # imported here, because the import takes 15 ms and the message is rare
    from importlib.metadata import PackageNotFoundError, distribution

    try:
        address = distribution(_NAME).read_text("direct_url.json")
    except PackageNotFoundError:
        address = None
    return str(json.loads(address)["url"]) if address else _NAME


@cache
def load() -> ctypes.PyDLL:
    """Return the library. Raises InputError if it is missing, outdated or unsuitable."""
    if wrong := problem():
        raise InputError(wrong)
    file = FOLDER / library_name()
    try:
        return ctypes.PyDLL(str(file))
    except OSError as error:
        raise InputError(f"{file}: the C library cannot be loaded ({error}); {_remedy(FOLDER)}") from error
