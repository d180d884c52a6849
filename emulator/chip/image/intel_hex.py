"""Intel HEX ("Hexadecimal Object File Format Specification", Intel, revision A, 1988).

A record is ``:LLAAAATT<data>CC``, and the sum of its bytes is zero. Records of start addresses are
ignored.
"""

from __future__ import annotations

from typing import NamedTuple

from fcu_emulator.emulator.chip.image.segments import Segment, check_place, join
from fcu_emulator.emulator.chip.memory_map import CAPACITY
from fcu_emulator.emulator.errors import FirmwareFileError

_LONGEST_FILE = 16 * CAPACITY  # characters; a record with one data byte has 15
_DATA, _END, _SEGMENT_BASE, _SEGMENT_START, _LINEAR_BASE, _LINEAR_START = range(6)
_LENGTHS = {_END: 0, _SEGMENT_BASE: 2, _SEGMENT_START: 4, _LINEAR_BASE: 2, _LINEAR_START: 4}


class HexRecord(NamedTuple):
    """One line of the file."""

    kind: int
    address: int  # 16 bits, without the base
    data: bytes


def looks_like_hex(data: bytes) -> bool:
    """Return whether the data begins like a record."""
    head = data[:64].lstrip()[:9]
    return len(head) == 9 and head[:1] == b":" and all(byte in b"0123456789abcdefABCDEF" for byte in head[1:])


def read_hex(file: str, data: bytes) -> tuple[Segment, ...]:
    """Return the contents, sorted by address. Raises FirmwareFileError."""
    if len(data) > _LONGEST_FILE:
        raise FirmwareFileError(
            file,
            f"must have at most {_LONGEST_FILE} bytes as Intel HEX, not {len(data)}",
            kind="too_long",
        )
    pieces: list[Segment] = []
    base, wraps, ended = 0, False, False
    for number, line in enumerate(data.splitlines(), 1):
        text = line.strip()
        if not text:
            continue
        where = f"line {number}"
        if ended:
            raise FirmwareFileError(
                file,
                f"{where}: must not follow the end record; remove this line and those after it",
                kind="after_end",
            )
        record = _record(file, where, text)
        if record.kind == _DATA:
            pieces += _placed(file, record, base, wraps)
        elif record.kind in {_SEGMENT_BASE, _LINEAR_BASE}:
            wraps = record.kind == _SEGMENT_BASE
            base = int.from_bytes(record.data, "big") << (4 if wraps else 16)
        ended = record.kind == _END
    if not ended:
        raise FirmwareFileError(
            file,
            "must have an end record (:00000001FF); the file is cut short: build or copy it again",
            kind="no_end_record",
        )
    return join(file, pieces)


def _record(file: str, where: str, text: bytes) -> HexRecord:
    try:
        if text[:1] != b":":
            raise ValueError
        raw = bytes.fromhex(text[1:].decode("ascii"))
    except ValueError:
        problem = f"{where}: must be a colon and pairs of hexadecimal digits"
        raise FirmwareFileError(file, problem, kind="not_a_record") from None
    if len(raw) < 5 or len(raw) != raw[0] + 5:
        announced = raw[0] + 5 if raw else 5
        raise FirmwareFileError(
            file,
            f"{where}: must have {announced} bytes (its length byte), not {len(raw)}; the file is damaged",
            kind="record_length",
        )
    wrong = sum(raw) & 0xFF
    if wrong:
        expected = (raw[-1] - wrong) & 0xFF
        raise FirmwareFileError(
            file,
            f"{where}: checksum must be {expected:02X}, not {raw[-1]:02X}; the file is damaged",
            kind="checksum",
        )
    record = HexRecord(raw[3], int.from_bytes(raw[1:3], "big"), raw[4:-1])
    if record.kind != _DATA and _LENGTHS.get(record.kind) != len(record.data):
        problem = f"{where}: unknown record type {record.kind:02X} with {len(record.data)} bytes"
        raise FirmwareFileError(file, problem, kind="record_type")
    return record


def _placed(file: str, record: HexRecord, base: int, wraps: bool) -> list[Segment]:
    """Return a record's data with its address. ``wraps``: addresses wrap within the 64 KB from ``base``."""
    first = record.data[: 0x10000 - record.address] if wraps else record.data
    rest = record.data[len(first) :]
    pieces = [Segment(base + record.address, first), Segment(base, rest)]
    pieces = [piece for piece in pieces if piece.data]
    for piece in pieces:
        check_place(file, piece.address, piece.end)
    return pieces
