"""The kernels of tests/arm/kernels, built at five optimisation levels and run by QEMU and by the board.

The output of QEMU's Cortex-M4 machine is in kernels/results.txt: a checksum for each kernel, the same at every level.
``python -m tests.support.arm.conformance`` writes this file again, with QEMU and the cross compiler.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Final

from fcu_emulator import Board

KERNELS: Final = Path(__file__).parents[2] / "arm" / "kernels"
RESULTS: Final = KERNELS / "results.txt"
LEVELS: Final = ("O0", "O1", "O2", "O3", "Os")
COMPILER: Final = "arm-none-eabi-gcc"
QEMU: Final = "qemu-system-arm"
MACHINE: Final = "netduinoplus2"
"""An STM32F405. Its core, memories and USART1 have the same addresses as in the STM32F401."""
FLAGS: Final = (
    *("-mcpu=cortex-m4", "-mthumb", "-mfpu=fpv4-sp-d16", "-mfloat-abi=hard"),
    *("-std=gnu11", "-Wall", "-Wextra", "-ffp-contract=off"),
    *("-ffunction-sections", "-fdata-sections", "-nostartfiles", "--specs=nosys.specs"),
    *("-Wl,--gc-sections", "-Wl,--build-id=none", "-Wl,--no-warnings", "-T", str(KERNELS / "kernels.ld")),
)
LAST = b"end\n"
LONGEST_S = 20
"""Maximum virtual time; the slowest build takes 8 s."""


def build(level: str, folder: Path) -> Path:
    """Build the kernels at an optimisation level; return the ELF file."""
    elf = folder / f"kernels-{level}.elf"
    sources = sorted(map(str, KERNELS.glob("*.c")))
    subprocess.run([COMPILER, *FLAGS, f"-{level}", *sources, "-lm", "-o", str(elf)], check=True)
    return elf


def on_qemu(elf: Path) -> str:
    """Return the output of QEMU until the program requests a system reset."""
    machine = [QEMU, "-M", MACHINE, "-nographic", "-monitor", "none", "-serial", "stdio", "-no-reboot"]
    done = subprocess.run(
        [*machine, "-kernel", str(elf)],
        capture_output=True,
        stdin=subprocess.DEVNULL,
        timeout=60,
        check=True,
    )
    return _whole(done.stdout)


def on_board(elf: Path) -> str:
    """Return the output of the board until the program requests a system reset."""
    board = Board(firmware=elf, ideal=True)
    text = b""
    while LAST not in text and board.now_s < LONGEST_S:
        board.run_for(0.1)
        text += bytes(board.terminal.read())
    return _whole(text)


def _whole(text: bytes) -> str:
    results, last, _ = text.partition(LAST)
    assert last, f"the kernels did not come to their end: {text[-200:]!r}"
    return results.decode()


def main() -> None:
    """Write the results if all levels agree."""
    with tempfile.TemporaryDirectory() as folder:
        printed = {on_qemu(build(level, Path(folder))) for level in LEVELS}
    if len(printed) != 1:
        sys.exit("the levels of optimisation do not agree: a kernel leaves something to the compiler")
    RESULTS.write_text(printed.pop(), encoding="ascii")


if __name__ == "__main__":
    main()
