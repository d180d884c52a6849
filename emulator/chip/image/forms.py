"""How attribute values are encoded (DWARF 5 section 7.5.6, for 32-bit DWARF and 4-byte addresses).

Not read: forms that refer to tables of strings and addresses by index, which GCC writes for split debug
information only (``-gsplit-dwarf``); they are skipped at their right length, their values mean nothing here.
"""

from __future__ import annotations

from emulator.chip.image.cursor import Cursor
from emulator.chip.image.sections import DebugInfoError

STRING, STRP, LINE_STRP = 0x08, 0x0E, 0x1F
REF_ADDR, REF_SIGNATURE = 0x10, 0x20
REF_UNIT = frozenset({0x11, 0x12, 0x13, 0x14, 0x15})  # ref1, ref2, ref4, ref8, ref_udata
IMPLICIT_CONST = 0x21
_FLAG_PRESENT = 0x19
_BLOCK1, _BLOCK2, _BLOCK4, _BLOCK, _EXPRLOC = 0x0A, 0x03, 0x04, 0x09, 0x18
_BLOCK_LENGTHS = {_BLOCK1: 1, _BLOCK2: 2, _BLOCK4: 4}
_SDATA, _UDATA = 0x0D, 0x0F
_UNSIGNED_LEB128 = frozenset({_UDATA, 0x15, 0x1A, 0x1B, 0x22, 0x23})  # ref_udata, strx, addrx, lists' indices

FIXED_SIZES = {
    0x01: 4,  # addr
    0x05: 2,  # data2
    0x06: 4,  # data4
    0x07: 8,  # data8
    0x0B: 1,  # data1
    0x0C: 1,  # flag
    STRP: 4,
    REF_ADDR: 4,
    0x11: 1,  # ref1
    0x12: 2,  # ref2
    0x13: 4,  # ref4
    0x14: 8,  # ref8
    0x17: 4,  # sec_offset
    _FLAG_PRESENT: 0,
    0x1C: 4,  # ref_sup4
    0x1D: 4,  # strp_sup
    0x1E: 16,  # data16
    LINE_STRP: 4,
    REF_SIGNATURE: 8,
    IMPLICIT_CONST: 0,
    0x24: 8,  # ref_sup8
    0x25: 1,  # strx1
    0x26: 2,  # strx2
    0x27: 3,  # strx3
    0x28: 4,  # strx4
    0x29: 1,  # addrx1
    0x2A: 2,  # addrx2
    0x2B: 3,  # addrx3
    0x2C: 4,  # addrx4
}

Value = int | bytes
"""Numbers, offsets and references as they stand; bytes for blocks, expressions and inline strings."""


def read_value(cursor: Cursor, form: int) -> Value:
    """The value at the cursor; 0 where the abbreviation itself holds it. Raises DebugInfoError."""
    size = FIXED_SIZES.get(form)
    if size is not None:
        return cursor.unsigned(size)
    if form in _UNSIGNED_LEB128:
        return cursor.uleb128()
    if form == _SDATA:
        return cursor.sleb128()
    if form == STRING:
        return cursor.string()
    if form in _BLOCK_LENGTHS:
        return cursor.take(cursor.unsigned(_BLOCK_LENGTHS[form]))
    if form in {_BLOCK, _EXPRLOC}:
        return cursor.take(cursor.uleb128())
    raise DebugInfoError(f"debug information has a value of unknown form 0x{form:X}")
