"""Shell quoting, and install hints. Only Debian's hints were tested."""

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
    """Return the hint for installing programs, in one command if possible."""
    ways = list(dict.fromkeys(map(how_to_install, programs)))
    packages = [way.removeprefix(_APT) for way in ways]
    return _APT + " ".join(packages) if all(map(str.__ne__, ways, packages)) else "; ".join(ways)


def quoted(word: str) -> str:
    """Return a word quoted for cmd and PowerShell on Windows, otherwise for sh."""
    return subprocess.list2cmdline([word]) if sys.platform == "win32" else shlex.quote(word)


def command_line(words: Iterable[str]) -> str:
    """Return a command as users type it."""
    return " ".join(map(quoted, words))


def how_to_install(program: str) -> str:
    """Return the hint for installing ``program``, by default Debian's."""
    ways = _INSTALL[program]
    return ways.get(sys.platform, ways["linux"])
