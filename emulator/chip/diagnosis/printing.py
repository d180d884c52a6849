"""Detection of numbers that printf could not print, with the help of format strings in flash.

Matching never backtracks, so hostile formats cannot slow it down.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import NamedTuple

from fcu_emulator.emulator.chip.cpu.thumb import decode
from fcu_emulator.emulator.chip.diagnosis.backtrace import Places
from fcu_emulator.emulator.chip.diagnosis.report import Diagnosis
from fcu_emulator.emulator.chip.image import FirmwareImage
from fcu_emulator.emulator.chip.memory_map import FLASH_MEMORY

_STRING = re.compile(rb"[\t\n\r\x20-\x7e]{3,255}\x00")
_CONVERSION = re.compile(r"%[-+ #0]*\d*(?:\.\d+)?(?:hh|h|ll|l)?([diuxXfFeEgGcsp%])")
LATEST_TEXT = 1 << 16
"""The number of bytes at the end of the output that are checked."""
_MAX_FORMATS, _MAX_LINES = 500, 400
_FLOATS, _INTEGERS = "fFeEgG", "diu"
_SHOWN = 60

_DOUBLE_STEP = 1 << 29
"""A float is passed to printf as a double (C17 6.5.2.2), whose lowest 29 bits are then 0."""


class Format(NamedTuple):
    """A format string in flash, split at its conversions."""

    address: int
    text: str
    between: tuple[str, ...]
    letters: str


class FormattedLine(NamedTuple):
    """A terminal line with its format and values."""

    line: str
    made_by: Format
    values: tuple[str, ...]


class PrintedLines:
    """The latest output lines with a known format."""

    def __init__(self, image: FirmwareImage, places: Places, text: bytes) -> None:
        self._image, self._places = image, places
        self.formats = list(_formats(image))
        lines = text[-LATEST_TEXT:].decode("latin-1").replace("\r", "\n").split("\n")
        distinct = list(dict.fromkeys(line.strip() for line in lines if line.strip()))[-_MAX_LINES:]
        self.lines = [printed for line in distinct if (printed := self._made_by(line)) is not None]

    def place(self, made_by: Format) -> str:
        address = self.address(made_by)
        return self._places.place(address) if address is not None else ""

    def address(self, made_by: Format) -> int | None:
        """Return the address of the instruction that loads a format; None if it is not found."""
        for literal in self._words(made_by.address):
            function = self._places.function(literal)
            if function is not None:
                for address in self._loads(function.start, literal):
                    return address
        return None

    def _made_by(self, line: str) -> FormattedLine | None:
        found = [
            FormattedLine(line, one, values)
            for one in self.formats
            if (values := _match(one, line)) is not None
        ]
        return max(found, key=lambda printed: len(printed.made_by.text), default=None)

    def _words(self, value: int) -> Iterator[int]:
        wanted = value.to_bytes(4, "little")
        for segment in self._image.segments:
            at = segment.data.find(wanted)
            while at >= 0:
                if (segment.address + at) % 4 == 0:
                    yield segment.address + at
                at = segment.data.find(wanted, at + 1)

    def _loads(self, start: int, literal: int) -> Iterator[int]:
        """Return the addresses of instructions that load the word at ``literal`` (ARMv7-M ARM A7.7.44)."""
        address = start
        while address < literal:
            code = self._image.code(address, 4) or bytes(4)
            first, second = code[0] | code[1] << 8, code[2] | code[3] << 8
            base = address + 4 & ~3
            if (first >> 11 == 0b01001 and base + 4 * (first & 0xFF) == literal) or (
                first == 0xF8DF and base + (second & 0xFFF) == literal
            ):
                yield address
            address += decode(address, first, second).size


def _formats(image: FirmwareImage) -> Iterator[Format]:
    count = 0
    for segment in image.segments:
        if not FLASH_MEMORY.holds(segment.address, segment.end):
            continue
        for match in _STRING.finditer(segment.data):
            text = match[0][:-1].decode("ascii")
            letters = "".join(found[1] for found in _CONVERSION.finditer(text))
            if count < _MAX_FORMATS and not set(letters).isdisjoint(_FLOATS + _INTEGERS):
                count += 1
                between = tuple(part.strip("\r\n") for part in _CONVERSION.sub("\0", text).split("\0"))
                yield Format(segment.address + match.start(), text, between, letters)


def _match(one: Format, line: str) -> tuple[str, ...] | None:
    first, *rest = one.between
    first = first.lstrip()
    if not line.startswith(first) or not "".join(one.between).strip():
        return None
    at, values = len(first), []
    for number, text in enumerate(rest, start=1):
        last = number == len(rest)
        wanted = text.rstrip() if last else text
        end = len(line) if last and not wanted else line.find(wanted, at)
        if end < 0:
            return None
        values.append(line[at:end].strip())
        at = end + len(wanted)
    return tuple(values) if at == len(line) else None


def misprinted(lines: PrintedLines, places: Places) -> Diagnosis | None:
    """Report the first line with a missing or wrong number."""
    for look in (_empty_float, _float_as_int):
        for printed in lines.lines:
            found = look(printed, places)
            if found is not None:
                summary, sentences = found
                where = lines.place(printed.made_by)
                head = f"{where}: " if where else ""
                shown = f'The terminal shows "{printed.line[:_SHOWN]}".'
                return Diagnosis("printing", head + summary, (shown, *sentences), fatal=False)
    return None


def _empty_float(printed: FormattedLine, places: Places) -> tuple[str, tuple[str, ...]] | None:
    empty = [
        letter
        for letter, value in zip(printed.made_by.letters, printed.values, strict=False)
        if letter in _FLOATS and not value
    ]
    if not empty or places.address_of("_printf_float") is not None:
        return None
    return (
        f"%{empty[0]} prints nothing: printf is linked without floating point",
        (
            "newlib-nano omits it by default: add -u _printf_float to the linker's flags.",
            'In CubeIDE: Properties, C/C++ Build, Settings, MCU Settings, tick "Use float with printf".',
        ),
    )


def _float_as_int(printed: FormattedLine, places: Places) -> tuple[str, tuple[str, ...]] | None:
    del places
    for letter, value in zip(printed.made_by.letters, printed.values, strict=False):
        if letter in _INTEGERS and re.fullmatch(r"-?\d{9,10}", value) and int(value) % _DOUBLE_STEP == 0:
            return (
                f"%{letter} for a float: {value} is half of a double, not your number",
                (
                    f"A float is passed to printf as a double of 64 bits; %{letter} prints 32 of them.",
                    "Print floats with %f; the compiler warns about it (-Wall, -Wformat).",
                ),
            )
    return None
