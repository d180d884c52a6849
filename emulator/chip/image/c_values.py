"""Conversion of Python values to bytes of a C type.

Each InputError names the member, such as ``acc.AXIS_X``. Integers are never truncated.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Mapping, Sequence
from numbers import Integral, Real
from types import SimpleNamespace
from typing import Any

from fcu_emulator.emulator.chip.image.c_types import (
    Array,
    BitField,
    Boolean,
    CType,
    Float,
    Integer,
    Structure,
)
from fcu_emulator.emulator.errors import InputError

_FLOATS = {2: "<e", 4: "<f", 8: "<d"}


def store(kind: CType, value: Any, raw: bytearray, offset: int, name: str) -> None:
    """Store ``value`` in ``raw``. Raises InputError.

    For an array, ``value`` is a sequence with the same number of elements. For a structure,
    ``value`` is a sequence of all members, or an object or mapping with some members.
    """
    if isinstance(kind, Float):
        raw[offset : offset + kind.size] = _float(kind, value, name)
    elif isinstance(kind, Boolean):
        raw[offset : offset + kind.size] = bool(value).to_bytes(kind.size, "little")
    elif isinstance(kind, Integer):
        number = _integer(value, 8 * kind.size, kind.signed, name)
        raw[offset : offset + kind.size] = number.to_bytes(kind.size, "little")
    elif isinstance(kind, BitField):
        _store_bits(kind, value, raw, offset, name)
    elif isinstance(kind, Array):
        _store_array(kind, value, raw, offset, name)
    elif isinstance(kind, Structure):
        _store_structure(kind, value, raw, offset, name)
    else:
        raise InputError(f"cannot write {name!r}: values of this type are not supported", kind="unknown_type")


def load_into(kind: CType, value: Any, raw: bytes, offset: int) -> None:
    """Update a mutable object from ``raw``."""
    now: Any = kind.value(raw, offset)
    if isinstance(value, bytearray):
        value[:] = raw[offset : offset + len(value)]
    elif isinstance(value, list):
        members = list(vars(now).values()) if isinstance(now, SimpleNamespace) else list(now)
        value[:] = members[: len(value)]
    elif isinstance(value, dict):
        value.update(vars(now))
    elif isinstance(value, SimpleNamespace):
        vars(value).update(vars(now))


def alignment(kind: CType) -> int:
    """Return the alignment in bytes (IHI 0042, 5.3)."""
    if isinstance(kind, Array):
        return alignment(kind.element)
    if isinstance(kind, Structure):
        return max((alignment(member.type) for member in kind.members), default=1)
    if isinstance(kind, BitField):
        return 1
    return min(kind.size, 8)


def floats_of(kind: CType) -> tuple[int, int]:
    """Return (size, count) of a homogeneous floating-point aggregate (IHI 0042, 4.3.5), or (0, 0)."""
    if isinstance(kind, Float):
        return (kind.size, 1) if kind.size in {4, 8} else (0, 0)
    if isinstance(kind, Array):
        size, count = floats_of(kind.element)
        count *= kind.count
    elif isinstance(kind, Structure) and kind.members:
        parts = [floats_of(member.type) for member in kind.members]
        size, count = parts[0][0], sum(part[1] for part in parts)
        if any(part[0] != size for part in parts) or size * count != kind.size:
            return 0, 0
    else:
        return 0, 0
    return (size, count) if size and 1 <= count <= 4 else (0, 0)


def _float(kind: Float, value: Any, name: str) -> bytes:
    if not isinstance(value, Real):
        raise InputError(f"{name!r} must be a number, not {value!r}", kind="not_a_number")
    try:
        return struct.pack(_FLOATS[kind.size], value)
    except OverflowError:  # the result is infinity, as in C
        return struct.pack(_FLOATS[kind.size], math.copysign(math.inf, value))


def _integer(value: Any, bits: int, signed: bool, name: str) -> int:
    if not isinstance(value, Integral):
        raise InputError(f"{name!r} must be an integer, not {value!r}", kind="not_an_integer")
    number = int(value)
    low, high = (-(1 << bits - 1), (1 << bits - 1) - 1) if signed else (0, (1 << bits) - 1)
    if not low <= number <= high:
        raise InputError(
            f"{name!r} must be an integer from {low} to {high}, not {number}", kind="out_of_range"
        )
    return number & (1 << bits) - 1


def _store_bits(kind: BitField, value: Any, raw: bytearray, offset: int, name: str) -> None:
    number = _integer(value, kind.bits, kind.signed, name) << kind.low
    mask = (1 << kind.bits) - 1 << kind.low
    old = int.from_bytes(raw[offset : offset + kind.size], "little")
    raw[offset : offset + kind.size] = (old & ~mask | number).to_bytes(kind.size, "little")


def _store_array(kind: Array, value: Any, raw: bytearray, offset: int, name: str) -> None:
    elements = _elements(value, name)
    if len(elements) != kind.count:
        raise InputError(
            f"{name!r} must have {kind.count} elements, not {len(elements)}", kind="element_count"
        )
    for index, element in enumerate(elements):
        store(kind.element, element, raw, offset + index * kind.element.size, f"{name}[{index}]")


def _store_structure(kind: Structure, value: Any, raw: bytearray, offset: int, name: str) -> None:
    members = {member.name: member for member in kind.members if member.name}
    if isinstance(value, Mapping):
        given = dict(value)
    elif hasattr(value, "__dict__"):
        given = {key: item for key, item in vars(value).items() if not key.startswith("_")}
    else:
        values = _elements(value, name)
        if len(values) != len(kind.members):
            raise InputError(
                f"{name!r} must have {len(kind.members)} members, not {len(values)}",
                kind="element_count",
            )
        for member, item in zip(kind.members, values, strict=True):
            store(member.type, item, raw, offset + member.offset, f"{name}.{member.name}")
        return
    for anonymous in (member for member in kind.members if not member.name):
        inner = {key: given.pop(key) for key in _names(anonymous.type) if key in given}
        store(anonymous.type, inner, raw, offset + anonymous.offset, name)
    for key, item in given.items():
        if key not in members:
            raise InputError(
                f"{name!r}: unknown member {key!r}; known: {', '.join(members)}", kind="unknown_member"
            )
        store(members[key].type, item, raw, offset + members[key].offset, f"{name}.{key}")


def _names(kind: CType) -> list[str]:
    """Return member names, including names in anonymous structures."""
    if not isinstance(kind, Structure):
        return []
    return [
        name for member in kind.members for name in ([member.name] if member.name else _names(member.type))
    ]


def _elements(value: Any, name: str) -> Sequence[Any]:
    if isinstance(value, str) or not hasattr(value, "__len__") or not hasattr(value, "__getitem__"):
        raise InputError(f"{name!r} must be a sequence of values, not {value!r}", kind="not_a_sequence")
    elements: Sequence[Any] = value
    return elements
