"""Records of the results of runs, which are kept in files and compared with the records of another build.

::

    python -m tests.support.arm.recording --list              the cases
    python -m tests.support.arm.recording NAME ...            compare these cases with their files; without names, all
    python -m tests.support.arm.recording --write NAME ...    record them again after a deliberate change
    python -m tests.support.arm.recording --write-timing ...  only times and final state, if the rest is the same
    python -m tests.support.arm.recording --all NAME          every entry as text, for ``diff`` between two builds

Each record that is written again needs a line in recorded/README.md, with the reason from the manual.

A record has two parts. ``exact`` has the results that do not depend on the duration of an instruction: bytes, text,
order of transfers, edges of pins, notes. Of long sequences it has only the first fifteen sixteenths, because events
near the end of a run may come before or after the end. ``timing`` has the other results: the times of all events, the
number of executed instructions, and registers and RAM at the end.

Long sequences are kept as their first entries and one digest for each 64 entries.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import re
import sys
import tempfile
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from fcu_emulator import Board
from fcu_emulator.emulator.buses.i2c import I2CFault
from fcu_emulator.emulator.clock import to_ps
from fcu_emulator.emulator.errors import FirmwareError
from fcu_emulator.emulator.trace import (
    BusTransfer,
    DeviceNote,
    Fault,
    GpioEdge,
    RegisterWrite,
    TerminalBytes,
    TickLate,
    TickLost,
    TraceEvent,
)

FOLDER = Path(__file__).parents[2] / "arm" / "recorded"
CHIP_SELECTS = {"PA8", "PB12", "PC13", "PB0"}
ALWAYS = ("edges", "notes")
DETAILED = ("transfers", "chip selects", "register writes")
"""Sequences that every trace has, but completely only if it is detailed."""
_CHUNK = 64
_DIGEST = 8  # hexadecimal digits for each chunk and each kilobyte
_PAGE = 1024
_RAM = 0x2000_0000

Record = dict[str, Any]


@dataclass(frozen=True)
class Case:
    """A board, the actions on it, and the duration of its run.

    ``firmware``: a name, a file, or the contents of flash. ``steady``: whether the sensors always measure the same
    values, so that the bytes do not depend on the time of a read. ``typed``: text by the time in seconds at which it
    is typed on the terminal. ``levels``: (time, port, pin, level) from outside.
    """

    name: str
    firmware: str | Path | bytes
    seconds: float
    wiring: str | None = None
    scenario: str | None = None
    ideal: bool = True
    steady: bool = True
    cold_start: bool = False
    typed: tuple[tuple[float, bytes], ...] = ()
    levels: tuple[tuple[float, str, int, int], ...] = ()
    broken_bus: tuple[I2CFault, ...] = field(default=())

    @property
    def file(self) -> Path:
        """Return the file of its record."""
        return FOLDER / f"{self.name}.json"


@dataclass(frozen=True)
class ChipState:
    """The chip after a run: registers by name, and the registers of each peripheral that are not 0."""

    retired: int
    registers: dict[str, int]
    ram: bytes
    blocks: dict[str, dict[str, str]]
    fault: str


def chip_state(board: Board) -> ChipState:
    """Return the state of the chip. Only this function depends on the way in which a build stores it."""
    from fcu_emulator.emulator.chip.cpu.core_registers import EVERYTHING, CoreRegisters

    assert board.chip is not None
    core, origin = board.chip.core, board.chip.faults.origin
    fault = ""
    if origin is not None:
        fault = f"at {origin.pc:08X}: CFSR {origin.cfsr:08X}, HFSR {origin.hfsr:08X}"
    named = zip(EVERYTHING, CoreRegisters(core, EVERYTHING).read(), strict=True)
    return ChipState(
        core.retired,
        {"pc": core.pc, **dict(named)},
        bytes(core.ram),
        _blocks(core.peek),
        fault,
    )


_BLOCKS = {
    **{f"TIM{number}": (base, 0x50) for number, base in ((2, 0x4000_0000), (3, 0x4000_0400))},
    **{f"TIM{number}": (base, 0x50) for number, base in ((4, 0x4000_0800), (5, 0x4000_0C00))},
    "RTC": (0x4000_2800, 0x50),
    "WWDG": (0x4000_2C00, 0xC),
    "IWDG": (0x4000_3000, 0x10),
    "SPI2": (0x4000_3800, 0x24),
    "SPI3": (0x4000_3C00, 0x24),
    "USART2": (0x4000_4400, 0x1C),
    "I2C1": (0x4000_5400, 0x28),
    "I2C2": (0x4000_5800, 0x28),
    "I2C3": (0x4000_5C00, 0x28),
    "PWR": (0x4000_7000, 8),
    "TIM1": (0x4001_0000, 0x50),
    "USART1": (0x4001_1000, 0x1C),
    "USART6": (0x4001_1400, 0x1C),
    "ADC1": (0x4001_2000, 0x50),
    "SPI1": (0x4001_3000, 0x24),
    "SYSCFG": (0x4001_3800, 0x24),
    "EXTI": (0x4001_3C00, 0x18),
    **{f"TIM{number}": (0x4001_4000 + 0x400 * (number - 9), 0x50) for number in (9, 10, 11)},
    **{f"GPIO{port}": (0x4002_0000 + 0x400 * "ABCDE".index(port), 0x28) for port in "ABCDE"},
    "CRC": (0x4002_3000, 0xC),
    "RCC": (0x4002_3800, 0x90),
    "FLASH": (0x4002_3C00, 0x18),
    "DMA1": (0x4002_6000, 0xD0),
    "DMA2": (0x4002_6400, 0xD0),
    "SysTick": (0xE000_E010, 0x10),
    "NVIC enabled": (0xE000_E100, 0xC),
    "NVIC pending": (0xE000_E200, 0xC),
    "NVIC active": (0xE000_E300, 0xC),
    "NVIC priorities": (0xE000_E400, 0x58),
    "SCB": (0xE000_ED00, 0x40),
    "FPU": (0xE000_EF34, 0xC),
}
"""Address and size of the registers (RM0368 table 1, ARMv7-M ARM B3.2)."""


def _blocks(peek: Callable[[int], int | None]) -> dict[str, dict[str, str]]:
    found = {}
    for name, (base, size) in _BLOCKS.items():
        words = {f"{offset:02X}": peek(base + offset) for offset in range(0, size, 4)}
        set_ones = {offset: f"{word:X}" for offset, word in words.items() if word}
        if set_ones:
            found[name] = set_ones
    return found


# -- a run --------------------------------------------------------------------------------------------------


def board_of(case: Case) -> Board:
    """Return the board at power-on."""
    settings = {name: getattr(case, name) for name in ("wiring", "scenario", "ideal", "cold_start")}
    if not isinstance(case.firmware, bytes):
        return Board(case.firmware, **settings)
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "program.bin"
        file.write_bytes(case.firmware)
        return Board(file, **settings)


def run(case: Case, *, traced: bool) -> tuple[Board, str]:
    """Run a case; return the board, and the end of the run."""
    board = board_of(case)
    if traced:
        board.trace.record_all()
    for fault in case.broken_bus:
        board.i2c2.inject(fault)

    def drive(port: str, pin: int, level: int) -> None:
        board.gpio.drive(port, pin, level)

    doings: list[tuple[float, Callable[..., None], tuple[Any, ...]]] = [
        *((at_s, board.terminal.write, (text,)) for at_s, text in case.typed),
        *((at_s, drive, (port, pin, level)) for at_s, port, pin, level in case.levels),
    ]
    ending = ""
    try:
        for at_s, act, arguments in sorted(doings, key=lambda doing: doing[0]):
            board.run_until_ps(to_ps(at_s))
            act(*arguments)
        board.run_until_ps(to_ps(case.seconds))
    except FirmwareError as error:
        ending = str(error)
    return board, ending


@dataclass
class Sequences:
    """Entries (text and time) by the name of their sequence. "samples" are the bytes read on the buses."""

    what: dict[str, list[str]]
    when: dict[str, list[str]]

    def add(self, name: str, what: str, when: str) -> None:
        """Add an entry, except to a sequence of which a trace that is not detailed has only a part."""
        if name in self.what:
            self.what[name].append(what)
            self.when[name].append(when)


def sequences_of(board: Board, *, steady: bool, traced: bool) -> Sequences:
    """Return the events of the run as sequences."""
    text = board.terminal.text
    lines = (text if steady else re.sub(r"-?\d+(\.\d+)?", "#", text)).split("\n")
    names = (*ALWAYS, *DETAILED) if traced else ALWAYS
    found = Sequences({name: [] for name in names} | {"text": lines}, {name: [] for name in names})
    if traced:
        found.when |= {"terminal": list(_bytes_on_the_line(board)), "samples": []}
    for event in board.trace:
        if isinstance(event, BusTransfer):
            read = event.read.hex() if steady else f"{len(event.read)} bytes"
            what = f"{event.bus} {event.address:02X} {event.register} sent {event.written.hex()} read {read}"
            found.add("transfers", f"{what} {event.result}", f"{event.t_ps} {event.end_ps}")
            if traced:
                found.when["samples"].append(event.read.hex())
        elif isinstance(event, GpioEdge):
            name = "chip selects" if event.pin in CHIP_SELECTS else "edges"
            found.add(name, f"{event.pin} {event.level}", str(event.t_ps))
        elif not isinstance(event, TerminalBytes | TickLate | TickLost):
            name = "register writes" if isinstance(event, RegisterWrite) else "notes"
            found.add(name, _words(event), str(event.t_ps))
    return found


def _words(event: TraceEvent) -> str:
    if isinstance(event, RegisterWrite):
        return f"{event.device} {event.register} {event.old:02X} to {event.new:02X}"
    if isinstance(event, DeviceNote):
        return f"{event.device}: {event.what}: {event.text}"
    if isinstance(event, Fault):
        return f"{event.where}: {event.text}"
    return str(event)


def _bytes_on_the_line(board: Board) -> Iterator[str]:
    """Yield (start, number of bytes) without gaps, for any number of bytes in an event of the trace."""
    start_ps, count, end_ps = 0, 0, -1
    for event in board.trace.of(TerminalBytes):
        if event.direction != "tx":
            yield f"{event.t_ps} {event.direction} {event.data.hex()}"
            continue
        if count and abs(event.t_ps - end_ps) > 2:
            yield f"{start_ps} {count}"
            count = 0
        if not count:
            start_ps = event.t_ps
        count += len(event.data)
        end_ps = start_ps + board.terminal.uart.frames_ps(count)
    if count:
        yield f"{start_ps} {count}"


# -- a record -----------------------------------------------------------------------------------------------


def _digest(data: bytes) -> str:
    return hashlib.sha256(data).hexdigest()[:_DIGEST]


def _kept(entries: Sequence[str], first: int) -> Record:
    chunks = (entries[at : at + _CHUNK] for at in range(0, len(entries), _CHUNK))
    digests = "".join(_digest("\n".join(chunk).encode()) for chunk in chunks)
    return {"count": len(entries), "first": list(entries[:first]), "digests": digests}


def record(case: Case, *, traced: bool = True, counts: dict[str, int] | None = None) -> Record:
    """Run a case and return its record. ``counts``: number of compared entries of each exact sequence (default: most).

    Without a detailed trace, the record does not have the data that need such a trace.
    """
    board, ending = run(case, traced=traced)
    found = sequences_of(board, steady=case.steady, traced=traced)
    wanted = counts or {name: len(entries) - len(entries) // 16 for name, entries in found.what.items()}
    exact = {name: _kept(entries[: wanted[name]], 24) for name, entries in found.what.items()}
    return {"exact": exact | {"ending": ending}, "timing": _timing(board, found)}


def _timing(board: Board, found: Sequences) -> Record:
    state = chip_state(board)
    pages = (state.ram[at : at + _PAGE] for at in range(0, len(state.ram), _PAGE))
    sequences = {name: _kept(entries, 8) for name, entries in found.when.items()}
    text = board.terminal.since(0)[0]
    timer = board.tim9
    return {
        "now_ps": board.clock.now_ps,
        "retired": state.retired,
        "sequences": sequences,
        "text": {"bytes": len(text), "digest": _digest(text)},
        "TIM9": {"ticks": timer.ticks, "late": timer.late, "lost": timer.lost},
        "fault": state.fault,
        "registers": {name: f"{value:X}" for name, value in state.registers.items() if value},
        "blocks": state.blocks,
        "RAM": "".join(_digest(page) for page in pages),
    }


def counts_of(recorded: Record) -> dict[str, int]:
    """Return the number of entries of each exact sequence in a record."""
    return {name: kept["count"] for name, kept in recorded["exact"].items() if name != "ending"}


# -- comparing ----------------------------------------------------------------------------------------------


def differences(recorded: Record, now: Record) -> list[str]:
    """Return the differences of two records, one line each: the first difference of each sequence.

    Data that ``now`` does not have, because its trace was not detailed, are not compared.
    """
    return [*_exact_differences(recorded["exact"], now["exact"]), *_timing_differences(recorded, now)]


def _exact_differences(recorded: Record, now: Record) -> Iterator[str]:
    if recorded["ending"] != now["ending"]:
        yield f"the run ended with {recorded['ending']!r}, now with {now['ending']!r}"
    for name in [name for name in now if name != "ending"]:
        yield from _sequence_difference(name, recorded[name], now[name])


def _timing_differences(recorded: Record, now: Record) -> Iterator[str]:
    old, new = recorded["timing"], now["timing"]
    for name, kept in new["sequences"].items():
        yield from _sequence_difference(f"time of {name}", old["sequences"][name], kept)
    for name in ("now_ps", "retired", "text", "TIM9", "fault"):
        if old[name] != new[name]:
            yield f"{name}: recorded {old[name]}, now {new[name]}"
    yield from _words_difference("register", old["registers"], new["registers"])
    for name in {**old["blocks"], **new["blocks"]}:
        yield from _words_difference(name, old["blocks"].get(name, {}), new["blocks"].get(name, {}))
    for number, (one, other) in enumerate(zip(_divided(old["RAM"]), _divided(new["RAM"]), strict=True)):
        if one != other:
            begin = _RAM + number * _PAGE
            yield f"RAM from 0x{begin:08X} to 0x{begin + _PAGE - 1:08X} has another content"
            break


def _words_difference(what: str, recorded: dict[str, str], now: dict[str, str]) -> Iterator[str]:
    for name in {**recorded, **now}:
        if recorded.get(name) != now.get(name):
            yield f"{what} {name}: recorded {recorded.get(name, '0')}, now {now.get(name, '0')}"


def _sequence_difference(name: str, recorded: Record, now: Record) -> Iterator[str]:
    """Return the first entry that differs, or its group of entries."""
    for number, (one, other) in enumerate(zip(recorded["first"], now["first"], strict=False)):
        if one != other:
            yield f"{name}, entry {number}: recorded {one!r}, now {other!r}"
            return
    for number, (one, other) in enumerate(
        zip(_divided(recorded["digests"]), _divided(now["digests"]), strict=False)
    ):
        short = min(recorded["count"], now["count"]) < (number + 1) * _CHUNK
        if one != other and not (short and recorded["count"] != now["count"]):
            first = number * _CHUNK
            yield f"{name}: the first difference is in entries {first} to {first + _CHUNK - 1}"
            return
    if recorded["count"] != now["count"]:
        yield f"{name}: recorded {recorded['count']} entries, now {now['count']}"


def _divided(digests: str) -> list[str]:
    return [digests[at : at + _DIGEST] for at in range(0, len(digests), _DIGEST)]


def load(case: Case) -> Record:
    """Load the record of a case."""
    recorded: Record = json.loads(case.file.read_text(encoding="utf-8"))
    return recorded


def save(case: Case, recorded: Record) -> None:
    """Save the record of a case."""
    FOLDER.mkdir(exist_ok=True)
    parts = {part: json.dumps(recorded[part], separators=(",", ":")) for part in ("exact", "timing")}
    lines = [f' "{part}": {content}' for part, content in parts.items()]
    case.file.write_text("{\n" + ",\n".join(lines) + "\n}\n", encoding="utf-8", newline="\n")


# -- command ------------------------------------------------------------------------------------------------


def main(arguments: Iterable[str] | None = None) -> int:
    """Record or compare; see the module's docstring."""
    from tests.support.arm.recorded_cases import CASES

    parser = argparse.ArgumentParser(prog="python -m tests.support.arm.recording")
    parser.add_argument("names", nargs="*", metavar="NAME")
    for option in ("--list", "--write", "--write-timing", "--all"):
        parser.add_argument(option, action="store_true")
    options = parser.parse_args(None if arguments is None else list(arguments))
    if unknown := set(options.names) - CASES.keys():
        parser.error(f"unknown: {', '.join(sorted(unknown))}; --list shows what is known")
    chosen = [CASES[name] for name in options.names or CASES]
    failed = 0
    for case in chosen:
        if options.list:
            _say(f"{case.name}: {case.seconds:g} s")
        elif options.all:
            _say_all(case)
        elif options.write:
            save(case, record(case))
        else:
            failed += not _compared(case, timing_anew=options.write_timing)
    return 1 if failed else 0


def _compared(case: Case, *, timing_anew: bool) -> bool:
    recorded = load(case)
    now = record(case, counts=counts_of(recorded))
    found = (
        list(_exact_differences(recorded["exact"], now["exact"]))
        if timing_anew
        else differences(recorded, now)
    )
    for line in found:
        _say(f"{case.name}: {line}")
    if timing_anew and not found:
        save(case, recorded | {"timing": now["timing"]})
    return not found


def _say_all(case: Case) -> None:
    board, ending = run(case, traced=True)
    found = sequences_of(board, steady=True, traced=True)
    _say(f"ending: {ending}")
    for part, sequences in (("", found.what), ("time of ", found.when)):
        for name, entries in sequences.items():
            for number, entry in enumerate(entries):
                _say(f"{part}{name} {number}: {entry}")
    state = chip_state(board)
    _say(f"retired {state.retired}\nfault {state.fault}")
    for name, value in state.registers.items():
        _say(f"register {name}: {value:08X}")
    for block, words in state.blocks.items():
        _say(f"{block}: {words}")
    for at in range(0, len(state.ram), 16):
        if any(state.ram[at : at + 16]):
            _say(f"RAM {_RAM + at:08X}: {state.ram[at : at + 16].hex(' ', 4)}")


def _say(line: str) -> None:
    sys.stdout.write(f"{line}\n")


if __name__ == "__main__":
    sys.exit(main())
