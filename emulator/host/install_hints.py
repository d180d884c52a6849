"""Texts that differ between systems: a shell's quoting, and the installation of programs.

Hints for macOS and Windows come from the pages of their package managers and of the programs (docs/student.md
has the same); only Debian's were tested.
"""

from __future__ import annotations

import shlex
import subprocess
import sys
from collections.abc import Iterable, Mapping

_APT = "sudo apt install "
_DEBIAN = _APT + "{}"
_INSTALL: Mapping[str, Mapping[str, str]] = {
    "arm-none-eabi-gcc": {
        "linux": _DEBIAN.format("gcc-arm-none-eabi libnewlib-arm-none-eabi"),
        "darwin": "brew install --cask gcc-arm-embedded",
        "win32": '"Arm GNU Toolchain" for arm-none-eabi from developer.arm.com, with its path in PATH',
    },
    "make": {
        "linux": _DEBIAN.format("make"),
        "darwin": "xcode-select --install",
        "win32": "pacman -S make, in MSYS2",
    },
    "bwrap": {
        "linux": _DEBIAN.format("bubblewrap"),
        "darwin": "use a Linux container with bubblewrap",
        "win32": "use WSL with bubblewrap",
    },
    "gdb-multiarch": {
        "linux": _DEBIAN.format("gdb-multiarch"),
        "darwin": "brew install --cask gcc-arm-embedded, which has arm-none-eabi-gdb",
        "win32": '"Arm GNU Toolchain" from developer.arm.com, which has arm-none-eabi-gdb',
    },
}


def how_to_install_all(programs: Iterable[str]) -> str:
    """Return how to install these programs: one command if possible, else several steps."""
    ways = list(dict.fromkeys(map(how_to_install, programs)))
    packages = [way.removeprefix(_APT) for way in ways]
    return _APT + " ".join(packages) if all(map(str.__ne__, ways, packages)) else "; ".join(ways)


def quoted(word: str) -> str:
    """Return ``word`` as one word of the shell: of cmd and PowerShell on Windows, of sh elsewhere."""
    return subprocess.list2cmdline([word]) if sys.platform == "win32" else shlex.quote(word)


def command_line(words: Iterable[str]) -> str:
    """Return a command as the user types it."""
    return " ".join(map(quoted, words))


def how_to_install(program: str) -> str:
    """Return how to install ``program`` on this system; unknown systems get Debian's hint."""
    ways = _INSTALL[program]
    return ways.get(sys.platform, ways["linux"])
