"""How many files one has to read to follow something through the emulator: ``python -m tests.support.journeys``.

::

    --files    each file, with the first function in it that was entered

Four journeys are made on a real board while a profiler notes each function of ours that is entered:

- an attitude is set, and a byte of the accelerometer's output register is read over the bus;
- firmware on the chip prints, and the terminal has the byte;
- firmware on the chip reads a sensor over I2C, 800 times a second: one of these times;
- a scenario's file is read, played and judged.

A journey's number is the number of Python files; what the chip's C library does on the way is named in
``C_FILES``, function by function, as a debugger's backtrace shows it. A scenario drives the whole board, so
its journey counts the files of the scenarios' room, and those of other rooms that they call or are called by.

The test beside this file keeps the numbers from growing. The file needs nothing but the packages, so it also
measures another commit: ``python THIS/tests/support/journeys.py`` with that commit's interpreter.
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
SCENARIO_ROOM = "emulator/scenario/"
_INTO_THE_BANNER_S = 4e-3
"""The chip prints its first line, which goes on from 2.2 to 5.6 ms. At about 3 ms RCC looks at the clocks,
1 ms after they were set up: the journey comes after that, because nothing else is to go on meanwhile."""
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
        "read_cache.c": "target_read",
    },
}


class Entry(NamedTuple):
    """A function that was entered, and the file it was called from (empty where that is none of ours)."""

    file: str
    function: str
    caller: str


class Journey(NamedTuple):
    """Files as they were reached, with the function entered first; ``beyond`` are those outside the room."""

    name: str
    files: dict[str, str]
    beyond: dict[str, str]

    @property
    def count(self) -> str:
        """As the table shows it."""
        return f"{len(self.files)}+{len(self.beyond)}" if self.beyond else str(len(self.files))


def entered(run: Callable[[], object]) -> list[Entry]:
    """Every function of ours that ``run()`` enters, once for each caller's file."""
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
    """The path below the root, or nothing if it is not a file of the packages or of the scenarios."""
    for package in ("emulator", "sensors", "firmware_model", "scenarios"):
        if file.startswith(f"{ROOT / package}/"):
            return Path(file).relative_to(ROOT).as_posix()
    return ""


def _files(entries: list[Entry]) -> dict[str, str]:
    found: dict[str, str] = {}
    for entry in entries:
        found.setdefault(entry.file, entry.function)
    return found


def attitude_to_register() -> Journey:
    """The accelerometer measures at 6.66 kHz and +-4 g; the board is turned by 30 degrees."""
    board = emulator.Board(ideal=True)
    board.i2c2.write(0x6B, b"\x10\xa8")
    board.run_for(0.1)
    level = board.i2c2.write_read(0x6B, b"\x28", 6)
    seen = []

    def travel() -> None:
        board.world.set_attitude(roll_deg=0, pitch_deg=30, yaw_deg=0)
        board.run_for(0.1)
        seen.append(board.i2c2.write_read(0x6B, b"\x28", 6))

    entries = entered(travel)
    assert seen[0] != level, "the register shows the new attitude"
    return Journey("attitude set -> register byte", _files(entries), {})


def printf_to_terminal() -> Journey:
    """A millisecond of the first line, 11 bytes, while nothing else goes on."""
    board = emulator.Board(firmware="solution")
    board.run_for(_INTO_THE_BANNER_S)
    before = board.terminal.text
    seen = []

    def travel() -> None:
        board.run_for(_A_PIECE_OF_IT_S)
        seen.append(board.terminal.text)

    entries = entered(travel)
    assert len(seen[0]) > len(before) > 0, "bytes have arrived"
    return Journey("printf byte -> terminal", _files(entries), {})


def i2c_to_sensor() -> Journey:
    """One period of the timer, in which its callback reads four blocks of registers."""
    board = emulator.Board(firmware="solution")
    board.run_for(_TICKING_S)
    before = board.tim9.ticks
    entries = entered(lambda: board.run_for(_TICK_S))
    assert board.tim9.ticks == before + 1, "the callback has run once"
    return Journey("I2C read -> sensor", _files(entries), {})


def toml_to_verdict() -> Journey:
    """A scenario with motion, expectations and reports."""
    passed = []

    def travel() -> None:
        from fcu_emulator.emulator.scenario import run

        passed.append(run(emulator.Board(scenario="tilt_sweep")).passed)

    entries = entered(travel)
    assert passed == [True], "the scenario was judged"
    room = [entry for entry in entries if entry.file.startswith(SCENARIO_ROOM)]
    calling = {entry.caller for entry in room}
    beyond = [
        entry
        for entry in entries
        if not entry.file.startswith(SCENARIO_ROOM)
        and (entry.caller.startswith(SCENARIO_ROOM) or entry.file in calling)
    ]
    return Journey("TOML -> verdict", _files(room), _files(beyond))


JOURNEYS = (toml_to_verdict, attitude_to_register, printf_to_terminal, i2c_to_sensor)
"""The scenario's comes first: its room is counted from its imports on."""


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(prog="python -m tests.support.journeys")
    parser.add_argument("--files", action="store_true", help="name each file and its first function")
    options = parser.parse_args()
    for travel in JOURNEYS:
        journey = travel()
        in_c = C_FILES.get(journey.name, {}) if NATIVE.is_dir() else {}
        counted = f"{journey.count:>6} files in Python" + (f", {len(in_c)} in C" if in_c else "")
        sys.stdout.write(f"{journey.name:<30} {counted}\n")
        if options.files:
            for file, function in (journey.files | journey.beyond | in_c).items():
                sys.stdout.write(f"    {file:<45} {function}\n")


if __name__ == "__main__":
    main()
