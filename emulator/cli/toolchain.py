"""Search for the compiler arm-none-eabi-gcc on the PATH and in the vendors' usual folders."""

from __future__ import annotations

import os
import re
import shutil
import sys
from collections.abc import Iterator, Mapping
from pathlib import Path

COMPILER = "arm-none-eabi-gcc"
_CUBE_IDE = "plugins/com.st.stm32cube.ide.mcu.externaltools.gnu-tools-for-stm32.*/tools/bin"
_XPACK = "xPacks/@xpack-dev-tools/arm-none-eabi-gcc/*/.content/bin"
_PLATFORMIO = ".platformio/packages/toolchain-gccarmnoneeabi*/bin"
_PLACES: Mapping[str, tuple[str, ...]] = {
    "linux": (
        f"/opt/st/stm32cubeide_*/{_CUBE_IDE}",
        f"~/st/stm32cubeide_*/{_CUBE_IDE}",
        "/opt/arm-gnu-toolchain*/bin",
        "/opt/gcc-arm-none-eabi*/bin",
        "/opt/xpack-arm-none-eabi-gcc*/bin",
        f"~/.local/{_XPACK}",
        f"~/{_PLATFORMIO}",
    ),
    "darwin": (
        f"/Applications/STM32CubeIDE.app/Contents/Eclipse/{_CUBE_IDE}",
        "/Applications/ArmGNUToolchain/*/arm-none-eabi/bin",
        "/opt/homebrew/bin",
        "/usr/local/bin",
        f"~/Library/{_XPACK}",
        f"~/{_PLATFORMIO}",
    ),
    "win32": (
        f"%SystemDrive%/ST/STM32CubeIDE_*/STM32CubeIDE/{_CUBE_IDE}",
        "%ProgramFiles%/Arm GNU Toolchain arm-none-eabi/*/bin",
        "%ProgramFiles(x86)%/Arm GNU Toolchain arm-none-eabi/*/bin",
        "%ProgramFiles%/Arm/GNU Toolchain*/bin",
        "%ProgramFiles(x86)%/GNU Arm Embedded Toolchain/*/bin",
        "%ProgramFiles(x86)%/GNU Tools ARM Embedded/*/bin",
        f"%APPDATA%/{_XPACK}",
        f"%USERPROFILE%/{_PLATFORMIO}",
        "%SystemDrive%/msys64/*/bin",
    ),
}


def find_compiler(
    environment: Mapping[str, str] = os.environ, system: str = sys.platform, root: Path = Path("/")
) -> Path | None:
    """Return the compiler's path, or None.

    ``environment`` has PATH, HOME and the variables of Windows. ``root`` replaces / on Linux and macOS.
    """
    name = COMPILER + (".exe" if system == "win32" else "")
    found = shutil.which(COMPILER, path=environment.get("PATH", os.defpath))
    if found:
        return Path(found)
    return next(
        (folder / name for folder in _folders(environment, system, root) if _is_file(folder / name)), None
    )


def _folders(environment: Mapping[str, str], system: str, root: Path) -> Iterator[Path]:
    for place in _PLACES.get(system, _PLACES["linux"]):
        start, _, pattern = place.partition("/")
        if start:
            variable = "HOME" if start == "~" else start.strip("%")
            value = environment.get(variable, "C:" if variable == "SystemDrive" else "")
            if not value:
                continue
            begin = Path(f"{value}/" if value.endswith(":") else value)
        else:
            begin = root
        try:
            yield from sorted(begin.glob(pattern), key=_version, reverse=True)
        except OSError:  # an unreadable folder
            continue


def _version(folder: Path) -> tuple[tuple[int, ...], str]:
    """Return a sort key from the numbers in the path (13.3 is after 9.3)."""
    return tuple(map(int, re.findall(r"\d+", str(folder)))), str(folder)


def _is_file(path: Path) -> bool:
    try:
        return path.is_file()
    except OSError:
        return False
