"""The sections of an ELF file by name, unpacked where compressed, with bounds on everything.

A damaged section costs symbols only, never the run, so problems here are ``DebugInfoError``: an internal
error that ``Symbols`` turns into a note.
"""

from __future__ import annotations

import struct
import zlib
from typing import NamedTuple

_LARGEST = 64 << 20  # bytes of all sections unpacked, together
_LONGEST_NAME = 64
_HEADER = struct.Struct("<10I")
_COMPRESSION_HEADER = struct.Struct("<3I")
_NOBITS = 8
_COMPRESSED = 0x800  # SHF_COMPRESSED
_ZLIB = 1


class DebugInfoError(Exception):
    """Symbols or debug information are damaged, or of a kind that is not read."""


class _SectionHeader(NamedTuple):
    name: int
    type: int
    flags: int
    address: int
    offset: int
    size: int
    link: int
    info: int
    align: int
    entry_size: int


class Sections:
    """Sections of the ELF file ``data``, whose header table has ``count`` entries from ``offset`` on.

    The first section of a name counts. ``problem`` says why there is none at all, or is None.
    """

    def __init__(self, data: bytes, offset: int, count: int, names: int) -> None:
        self.problem: str | None = None
        self._data = data
        self._unpacked = 0
        self._headers: list[_SectionHeader] = []
        self._by_name: dict[bytes, _SectionHeader] = {}
        table = data[offset : offset + count * _HEADER.size]
        if len(table) == count * _HEADER.size:
            self._headers = [_SectionHeader(*fields) for fields in _HEADER.iter_unpack(table)]
        if names < len(self._headers):
            self._name_all(self._headers[names])
        elif count:
            self.problem = "the table of section names is missing"

    def __contains__(self, name: str) -> bool:
        return name.encode() in self._by_name

    def get(self, name: str) -> bytes:
        """Contents of a section, unpacked; empty if there is none. Raises DebugInfoError."""
        header = self._by_name.get(name.encode())
        if header is not None:
            raw = self._contents(header, name)
            return self._unpack(raw, name) if header.flags & _COMPRESSED else raw
        old_style = ".z" + name.removeprefix(".")  # GNU's own packing, before there was a flag for it
        header = self._by_name.get(old_style.encode())
        return b"" if header is None else self._unpack_old(self._contents(header, old_style), old_style)

    def linked(self, name: str) -> bytes:
        """Contents of the section that section ``name`` links to: the strings of a symbol table."""
        header = self._by_name[name.encode()]
        if header.link >= len(self._headers):
            raise DebugInfoError(f"{name} links to section {header.link}, which does not exist")
        return self._contents(self._headers[header.link], f"the strings of {name}")

    def _name_all(self, names: _SectionHeader) -> None:
        try:
            strings = self._contents(names, "the table of section names")
        except DebugInfoError as problem:
            self.problem = str(problem)
            return
        for header in self._headers:
            self._by_name.setdefault(string_at(strings, header.name, _LONGEST_NAME), header)

    def _contents(self, header: _SectionHeader, name: str) -> bytes:
        if header.type == _NOBITS:
            return b""
        if header.offset + header.size > len(self._data):
            raise DebugInfoError(f"{name} reaches beyond the end of the file")
        return self._data[header.offset : header.offset + header.size]

    def _unpack(self, raw: bytes, name: str) -> bytes:
        """A section with a compression header (ELF generic ABI, "Section Compression")."""
        if len(raw) < _COMPRESSION_HEADER.size:
            raise DebugInfoError(f"{name} is cut short")
        method, size, _ = _COMPRESSION_HEADER.unpack_from(raw)
        if method != _ZLIB:
            raise DebugInfoError(
                f"{name} is packed with method {method}; link with --compress-debug-sections=none"
            )
        return self._inflate(raw[_COMPRESSION_HEADER.size :], size, name)

    def _unpack_old(self, raw: bytes, name: str) -> bytes:
        if raw[:4] != b"ZLIB" or len(raw) < 12:
            raise DebugInfoError(f"{name} does not begin with ZLIB and its size")
        return self._inflate(raw[12:], int.from_bytes(raw[4:12], "big"), name)

    def _inflate(self, packed: bytes, size: int, name: str) -> bytes:
        self._unpacked += size
        if self._unpacked > _LARGEST:
            raise DebugInfoError(f"{name} unpacks to {size} bytes; {_LARGEST} are allowed in all")
        try:
            data = zlib.decompressobj().decompress(packed, max(size, 1))
        except zlib.error:
            raise DebugInfoError(f"{name} cannot be unpacked") from None
        if len(data) != size:
            raise DebugInfoError(f"{name} unpacks to another size than it says")
        return data


def string_at(strings: bytes, offset: int, longest: int) -> bytes:
    """The zero-terminated string at ``offset``, cut after ``longest`` bytes; empty outside the table."""
    end = strings.find(b"\0", offset, offset + longest)
    return strings[offset : end if end >= 0 else offset + longest]


def printable(raw: bytes) -> str:
    """A name as text that can be shown on one line: a forged file shall not steer the terminal."""
    text = raw.decode("utf-8", "replace")
    return text if text.isprintable() else "".join(sign if sign.isprintable() else "?" for sign in text)
