"""Source lines, found by address, from ``.debug_line`` (DWARF 2 to 5; DWARF 5 section 6.2)."""

from __future__ import annotations

from array import array
from bisect import bisect_right
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field
from typing import NamedTuple

from fcu_emulator.emulator.chip.image.dwarf import LINE_STRP, STRP, Budget, Cursor, Value, read_value
from fcu_emulator.emulator.chip.image.elf import DebugInfoError, Sections, printable

_LAST_LINE = 0x7FFF_FFFF  # a larger number is from a damaged table


class SourceLine(NamedTuple):
    """A source line, printed as ``main.c:12``."""

    path: str
    line: int

    @property
    def file(self) -> str:
        """The file's name without folders."""
        return self.path.replace("\\", "/").rpartition("/")[2]

    def data(self) -> dict[str, str]:
        """Return ``file`` and ``line`` for the data of a diagnosis."""
        return {"file": self.file, "line": str(self.line)}

    def __str__(self) -> str:
        return f"{self.file}:{self.line}"


class LineTable:
    """Finds the line of an address. Sequences at address 0 are ignored: the linker has removed their
    functions (``--gc-sections``).
    """

    def __init__(self, sequences: Iterable[Sequence]) -> None:
        found = [one for one in sequences if one.addresses and one.addresses[0] != 0]
        self._sequences = sorted(found, key=lambda one: one.addresses[0])
        self._starts = [one.addresses[0] for one in self._sequences]

    def line_at(self, address: int) -> SourceLine | None:
        """Return the line at ``address``; bit 0 is ignored."""
        address &= ~1
        index = bisect_right(self._starts, address) - 1
        if index < 0 or address >= self._sequences[index].end:
            return None
        sequence = self._sequences[index]
        row = bisect_right(sequence.addresses, address) - 1
        line, file = sequence.lines[row], sequence.files[row] - sequence.first_file
        if not 0 < line <= _LAST_LINE or not 0 <= file < len(sequence.paths):
            return None
        return SourceLine(sequence.paths[file], line)

    def ranges(self, is_wanted: Callable[[str], bool]) -> list[tuple[int, int]]:
        """Return (begin, end) of the code of files for which ``is_wanted`` is true; adjacent ranges are merged."""
        found: list[tuple[int, int]] = []
        for sequence in self._sequences:
            wanted = [is_wanted(path) for path in sequence.paths]
            ends = [*sequence.addresses[1:], sequence.end]
            for begin, end, number in zip(sequence.addresses, ends, sequence.files, strict=True):
                file = number - sequence.first_file
                if not (0 <= file < len(wanted) and wanted[file] and begin < end):
                    continue
                if found and found[-1][1] == begin:
                    found[-1] = found[-1][0], end
                else:
                    found.append((begin, end))
        return found


# -- line number programs -----------------------------------------------------------------------------------

_COPY, _ADVANCE_PC, _ADVANCE_LINE, _SET_FILE = 1, 2, 3, 4
_CONST_ADD_PC, _FIXED_ADVANCE_PC = 8, 9
_END_SEQUENCE, _SET_ADDRESS = 1, 2
_PATH, _DIRECTORY_INDEX = 1, 2  # content types DW_LNCT
_WORD = 0xFFFF_FFFF


def _words() -> array[int]:
    return array("I")


@dataclass
class Sequence:
    """Rows in the order of their addresses: row i belongs to line ``lines[i]`` of ``paths[files[i] - first_file]``."""

    paths: list[str]
    first_file: int
    addresses: array[int] = field(default_factory=_words)
    files: array[int] = field(default_factory=_words)
    lines: array[int] = field(default_factory=_words)
    end: int = 0


class _LineProgramHeader(NamedTuple):
    instruction_length: int
    line_base: int
    line_range: int
    lengths: bytes  # number of operands of each standard opcode, from opcode 1 on
    paths: list[str]
    first_file: int  # number of the first path: 1 before DWARF 5, else 0


def read_sequences(sections: Sections, budget: Budget) -> Iterator[Sequence]:
    """Return all sequences in file order. Raises DebugInfoError."""
    programs = Cursor(sections.get(".debug_line"))
    strings = {LINE_STRP: sections.get(".debug_line_str"), STRP: sections.get(".debug_str")}
    while programs.offset < programs.end:
        program = programs.unit()
        header = _header(program, strings, budget)
        yield from _Machine(program, header).run(budget)


def _header(program: Cursor, strings: dict[int, bytes], budget: Budget) -> _LineProgramHeader:
    version = program.unsigned(2)
    if not 2 <= version <= 5:
        raise DebugInfoError(f"the line table has DWARF version {version}; versions 2 to 5 are supported")
    if version == 5:
        program.skip(2)  # sizes of addresses and segment selectors
    size = program.unsigned(4)
    code = program.skip(0) + size
    instruction_length = program.byte()
    program.skip(2 if version >= 4 else 1)  # skip operations per instruction and default is_stmt
    line_base = (program.byte() ^ 0x80) - 0x80
    line_range = program.byte()
    if line_range == 0:
        raise DebugInfoError("line numbers have a line_range of 0")
    lengths = program.take(max(program.byte() - 1, 0))
    paths = _paths_5(program, strings, budget) if version == 5 else _paths_2(program, budget)
    program.skip(code - program.offset)
    return _LineProgramHeader(
        instruction_length, line_base, line_range, lengths, paths, 0 if version == 5 else 1
    )


def _paths_2(program: Cursor, budget: Budget) -> list[str]:
    """Return the paths in versions 2 to 4, whose tables omit directory 0."""
    folders = [b""]
    while folder := program.string():
        budget.spend(budget.OBJECT)
        folders.append(folder)
    paths = []
    while name := program.string():
        budget.spend(budget.OBJECT)
        index = program.uleb128()
        program.uleb128()  # time of modification
        program.uleb128()  # length
        paths.append(_joined(folders, index, name))
    return paths


def _paths_5(program: Cursor, strings: dict[int, bytes], budget: Budget) -> list[str]:
    folders = [name for name, _ in _entries(program, strings, budget)]
    return [_joined(folders, index, name) for name, index in _entries(program, strings, budget)]


def _entries(program: Cursor, strings: dict[int, bytes], budget: Budget) -> list[tuple[bytes, int]]:
    """Return pairs of a name and the number of its directory."""
    columns = [(program.uleb128(), program.uleb128()) for _ in range(program.byte())]
    count, room = program.uleb128(), program.end - program.offset
    if count > room:  # entries may be empty, so the end of the data does not limit their number
        raise DebugInfoError(f"a table of files announces {count} entries in {room} bytes")
    entries = []
    for _ in range(count):
        budget.spend(budget.OBJECT + len(columns))
        name, index = b"", 0
        for content, form in columns:
            value = read_value(program, form)
            if content == _PATH:
                name = _text(value, strings.get(form, b""))
            elif content == _DIRECTORY_INDEX and isinstance(value, int):
                index = value
        entries.append((name, index))
    return entries


def _text(value: Value, strings: bytes) -> bytes:
    return value if isinstance(value, bytes) else Cursor(strings, value).string()


def _joined(folders: list[bytes], index: int, name: bytes) -> str:
    if index >= len(folders):
        return printable(name)
    folder = folders[index]
    if index and not _absolute(folder):
        folder = _under(folders[0], folder)
    return printable(name if _absolute(name) else _under(folder, name))


def _under(folder: bytes, name: bytes) -> bytes:
    return folder.rstrip(b"/") + b"/" + name if folder else name


def _absolute(path: bytes) -> bool:
    return path[:1] in {b"/", b"\\"} or path[1:2] == b":"


class _Machine:
    """The state machine of section 6.2.2: address, file and line."""

    def __init__(self, program: Cursor, header: _LineProgramHeader) -> None:
        self._program = program
        self._header = header
        self._opcode_base = len(header.lengths) + 1
        self._begin()

    def _begin(self) -> None:
        self._address, self._file, self._line = 0, 1, 1
        self._sequence = Sequence(self._header.paths, self._header.first_file)

    def run(self, budget: Budget) -> Iterator[Sequence]:
        program = self._program
        while program.offset < program.end:
            budget.spend(1)
            opcode = program.byte()
            if opcode >= self._opcode_base:
                self._special(opcode - self._opcode_base)
            elif opcode:
                self._standard(opcode)
            elif self._extended():
                budget.spend(budget.OBJECT)
                self._sequence.end = self._address
                yield self._sequence
                self._begin()

    def _special(self, opcode: int) -> None:
        advance, line_advance = divmod(opcode, self._header.line_range)
        self._advance(advance * self._header.instruction_length)
        self._line += self._header.line_base + line_advance
        self._add_row()

    def _standard(self, opcode: int) -> None:
        program, step = self._program, self._header.instruction_length
        if opcode == _COPY:
            self._add_row()
        elif opcode == _ADVANCE_PC:
            self._advance(program.uleb128() * step)
        elif opcode == _ADVANCE_LINE:
            self._line += program.sleb128()
        elif opcode == _SET_FILE:
            self._file = program.uleb128()
        elif opcode == _CONST_ADD_PC:
            self._advance((255 - self._opcode_base) // self._header.line_range * step)
        elif opcode == _FIXED_ADVANCE_PC:
            self._advance(program.unsigned(2))
        else:
            for _ in range(self._header.lengths[opcode - 1]):
                program.uleb128()

    def _extended(self) -> bool:
        size = self._program.uleb128()
        start = self._program.skip(size)
        operands = Cursor(self._program.data, start, start + size)
        opcode = operands.byte()
        if opcode == _SET_ADDRESS:
            self._address = operands.unsigned(4)
        return opcode == _END_SEQUENCE

    def _advance(self, bytes_of_code: int) -> None:
        self._address = (self._address + bytes_of_code) & _WORD

    def _add_row(self) -> None:
        self._sequence.addresses.append(self._address)
        self._sequence.files.append(self._file & _WORD)
        self._sequence.lines.append(self._line & _WORD)
