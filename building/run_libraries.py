"""Run the libraries of the wheels: .venv/bin/python building/run_libraries.py [FOLDER]

The libraries run the kernels of tests/arm/kernels natively, under qemu-user, under wine and with musl. The
checksums must equal the checksums of QEMU's Cortex-M4, and all instruction counts must be equal. This needs the
packages of .ci/wheels, ``build/debian-*`` and ``build/venv``.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Final
from zipfile import ZipFile

from library import FOLDER, NATIVE
from targets import TARGETS, Target

ROOT: Final = Path(__file__).parents[1]
BUILD: Final = ROOT / "build"
QEMU: Final = ("qemu-aarch64-static", "-L", str(BUILD / "debian-arm64"))
RUN_BY: Final[dict[str, tuple[str, ...]]] = {
    "manylinux2014_x86_64": (),
    "manylinux2014_aarch64": QEMU,
    "musllinux_1_2_x86_64": (str(BUILD / "debian-amd64" / "lib" / "ld-musl-x86_64.so.1"),),
    "musllinux_1_2_aarch64": QEMU,
    "win_amd64": ("wine",),
}
"""By platform: the command that runs a program of this platform."""


def image(folder: Path) -> Path:
    """Return the contents of flash with the kernels."""
    sys.path.insert(0, str(ROOT))
    from tests.support.arm.conformance import build

    elf = build("O2", folder)
    subprocess.run(["arm-none-eabi-objcopy", "-O", "binary", elf, folder / "kernels.bin"], check=True)
    return folder / "kernels.bin"


def run(wheel: Path, target: Target, by: tuple[str, ...], program: Path, folder: Path) -> list[str]:
    """Return the output of a run with the library of a wheel."""
    name = NATIVE["library_name"](target.system)
    with ZipFile(wheel) as archive:
        (folder / name).write_bytes(archive.read(f"fcu_emulator/emulator/chip/native/{name}"))
    driver = folder / "run_library.exe"
    command = [str(BUILD / "venv" / "bin" / "python"), "-m", "ziglang", "cc", *target.flags]
    if "musl" in target.tag:
        command.append("-dynamic")
    source = Path(__file__).with_name("run_library.c")
    subprocess.run([*command, "-O2", "-s", f"-I{FOLDER}", source, "-o", driver], check=True)
    quiet = {"WINEDEBUG": "-all", "WINEPREFIX": str(BUILD / "wine")}
    done = subprocess.run(
        [*by, driver, folder / name, program],
        capture_output=True,
        text=True,
        check=True,
        env=os.environ | quiet,
    )
    return done.stdout.splitlines()


def main(dist: str = "dist") -> None:
    """Run the library of each wheel, and print a line for it."""
    expected = (ROOT / "tests" / "arm" / "kernels" / "results.txt").read_text(encoding="ascii").splitlines()
    counts = set()
    with tempfile.TemporaryDirectory() as folder:
        program = image(Path(folder))
        for name, by in RUN_BY.items():
            target = TARGETS[name]
            (wheel,) = Path(dist).glob(f"*-{target.tag}.whl")
            *sums, end, count = run(wheel, target, by, program, Path(folder))
            if sums != expected or end != "end":
                sys.exit(f"{name}: the checksums are others: {sums}")
            counts.add(count)
            sys.stdout.write(f"{name}: {len(sums)} checksums as expected, {count}\n")
    if len(counts) != 1:
        sys.exit(f"the numbers of instructions differ: {counts}")


if __name__ == "__main__":
    main(*sys.argv[1:])
