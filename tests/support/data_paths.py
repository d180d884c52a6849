"""The files that data passes through in the emulator: ``python -m tests.support.data_paths``.

::

    --files    each file, with the first function in it that was called

Four data paths are followed on a board. A profiler records each called function of the project:

- an attitude is set, and a byte of the accelerometer's output register is read over the bus;
- firmware on the chip prints, and the terminal receives the byte;
- firmware on the chip reads a sensor over I2C, which it does 800 times a second;
- a scenario file is read, run and judged.

The length of a data path is its number of Python files. ``C_FILES`` lists the files of the C library, with the
functions of a debugger's backtrace. A scenario uses the whole board. So its data path counts only the files of the
package ``scenario``, and the files of other packages that call them or that they call.

A test fails if the numbers increase. This file only needs the packages, so it can also measure another commit:
``python THIS/tests/support/data_paths.py`` with that commit's interpreter.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable
from pathlib import Path
from types import FrameType
from typing import NamedTuple

from fcu_emulator import emulator

ROOT = Path(emulator.__file__).parents[1]
NATIVE = ROOT / "emulator" / "chip" / "native"
SCENARIO_PACKAGE = "emulator/scenario/"
_INTO_THE_BANNER_S = 4e-3
"""The chip prints its first line from 2.2 to 5.6 ms. At about 3 ms RCC checks the clocks, 1 ms after they were set up.

The data path begins after that, because other work must not happen during it.
"""
_A_PIECE_OF_IT_S = 1e-3
_TICKING_S = 1.2
_TICK_S = 1.25e-3

C_FILES = {
    "printf byte -> terminal": {
        "run_loop.c": "fcu_run_until",
        "single.c": "str",
        "bus.c": "core_write",
        "chip.c": "peripheral_write",
        "usart.c": "usart_write",
    },
    "I2C read -> sensor": {
        "run_loop.c": "fcu_run_until",
        "single.c": "ldr",
        "bus.c": "core_read",
        "chip.c": "chip_advance",
        "i2c.c": "i2c_fire",
        "sensor_registers.c": "target_read",
    },
}


class Entry(NamedTuple):
    """A function that was called, and the file of its caller; empty if that is not a file of the project."""

    file: str
    function: str
    caller: str


class DataPath(NamedTuple):
    """Files in the order in which they were reached, with the first function. ``beyond``: files outside the package."""

    name: str
    files: dict[str, str]
    beyond: dict[str, str]

    @property
    def count(self) -> str:
        """Return the count as the table shows it."""
        return f"{len(self.files)}+{len(self.beyond)}" if self.beyond else str(len(self.files))


def entered(run: Callable[[], object]) -> list[Entry]:
    """Return every function of the project that ``run()`` calls, once for each file of a caller."""
    found: dict[tuple[str, str], Entry] = {}

    def note(frame: FrameType, event: str, _: object) -> None:
        if event != "call":
            return
        file = frame.f_code.co_filename
        caller = frame.f_back.f_code.co_filename if frame.f_back else ""
        if (file, caller) not in found:
            found[file, caller] = Entry(_ours(file), frame.f_code.co_qualname, _ours(caller))

    sys.setprofile(note)
    try:
        run()
    finally:
        sys.setprofile(None)
    return [entry for entry in found.values() if entry.file]


def _ours(file: str) -> str:
    """Return the path below the root, or an empty path for files outside of the packages and scenarios."""
    for package in ("emulator", "sensors", "firmware_model", "scenarios"):
        if file.startswith(f"{ROOT / package}/"):
            return Path(file).relative_to(ROOT).as_posix()
    return ""


def _files(entries: list[Entry]) -> dict[str, str]:
    found: dict[str, str] = {}
    for entry in entries:
        found.setdefault(entry.file, entry.function)
    return found


def attitude_to_register() -> DataPath:
    """Measure at 6.66 kHz and +-4 g with the accelerometer, and turn the board by 30 degrees."""
    board = emulator.Board(ideal=True)
    board.i2c2.write(0x6B, b"\x10\xa8")
    board.run_for(0.1)
    level = board.i2c2.write_read(0x6B, b"\x28", 6)
    seen = []

    def follow() -> None:
        board.world.set_attitude(roll_deg=0, pitch_deg=30, yaw_deg=0)
        board.run_for(0.1)
        seen.append(board.i2c2.write_read(0x6B, b"\x28", 6))

    entries = entered(follow)
    assert seen[0] != level, "the register shows the new attitude"
    return DataPath("attitude set -> register byte", _files(entries), {})


def printf_to_terminal() -> DataPath:
    """Run a millisecond of the first line, 11 bytes, without other work."""
    board = emulator.Board(firmware="solution")
    board.run_for(_INTO_THE_BANNER_S)
    before = board.terminal.text
    seen = []

    def follow() -> None:
        board.run_for(_A_PIECE_OF_IT_S)
        seen.append(board.terminal.text)

    entries = entered(follow)
    assert len(seen[0]) > len(before) > 0, "bytes have arrived"
    return DataPath("printf byte -> terminal", _files(entries), {})


def i2c_to_sensor() -> DataPath:
    """Run one period of the timer, whose callback reads four blocks of registers after new samples."""
    board = emulator.Board(firmware="solution")
    board.run_for(_TICKING_S)
    for part in board.sensors:
        part.registers.take_back()
    before = board.tim9.ticks
    entries = entered(lambda: board.run_for(_TICK_S))
    assert board.tim9.ticks == before + 1, "the callback has run once"
    return DataPath("I2C read -> sensor", _files(entries), {})


def toml_to_verdict() -> DataPath:
    """Judge a scenario with motion, expectations and reports."""
    passed = []

    def follow() -> None:
        from fcu_emulator.emulator.scenario import run

        passed.append(run(emulator.Board(scenario="tilt_sweep")).passed)

    entries = entered(follow)
    assert passed == [True], "the scenario was judged"
    inside = [entry for entry in entries if entry.file.startswith(SCENARIO_PACKAGE)]
    calling = {entry.caller for entry in inside}
    beyond = [
        entry
        for entry in entries
        if not entry.file.startswith(SCENARIO_PACKAGE)
        and (entry.caller.startswith(SCENARIO_PACKAGE) or entry.file in calling)
    ]
    return DataPath("TOML -> verdict", _files(inside), _files(beyond))


DATA_PATHS = (toml_to_verdict, attitude_to_register, printf_to_terminal, i2c_to_sensor)
"""The scenario's data path is first, because its files are counted from their imports."""


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(prog="python -m tests.support.data_paths")
    parser.add_argument("--files", action="store_true", help="name each file and its first function")
    options = parser.parse_args()
    for trace in DATA_PATHS:
        path = trace()
        in_c = C_FILES.get(path.name, {}) if NATIVE.is_dir() else {}
        counted = f"{path.count:>6} files in Python" + (f", {len(in_c)} in C" if in_c else "")
        sys.stdout.write(f"{path.name:<30} {counted}\n")
        if options.files:
            for file, function in (path.files | path.beyond | in_c).items():
                sys.stdout.write(f"    {file:<45} {function}\n")


if __name__ == "__main__":
    main()
