"""A small Thumb-2 assembler with the few dozen instructions that tests of the core use.

It has UAL syntax with one instruction or ``label:`` a line; ``;`` begins a comment. Loads, stores and conditional
branches out of reach have one encoding each, so the length of an instruction never depends on its operands. Inside an
IT block the suffix (``addseq``) is optional and not compared with the condition of the block. ``mov32 rd, value``
means MOVW and MOVT. Encodings follow ARMv7-M ARM A7.7, and test_thumb_assembler.py compares them with the GNU
assembler.
"""

from __future__ import annotations

import re
import struct

from tests.support.arm.thumb_encodings import CONDITIONS, Labels, Place, encode


def assemble(source: str, origin: int, labels: Labels | None = None) -> tuple[bytes, Labels]:
    """Return the code for the address ``origin``, and the address of every label (without the Thumb bit).

    ``labels`` are names that are known beforehand. In ``mov32`` and ``.word`` a label may be followed by ``+number``.
    """
    known = dict(labels or {})
    statements: list[tuple[int, str]] = []
    address = origin
    for line in source.splitlines():
        text = line.split(";")[0].strip()
        while match := re.match(r"(\w+):\s*", text):
            known[match[1]] = address
            text = text[match.end() :]
        if text:
            statements.append((address, text))
            address += 2 * len(_encode(text, address, None))
    words = [word for address, text in statements for word in _encode(text, address, known)]
    return struct.pack(f"<{len(words)}H", *words), known


def _encode(text: str, address: int, labels: Labels | None) -> tuple[int, ...]:
    """Return the half-words of one instruction; without ``labels`` only their number is valid."""
    name, _, rest = text.partition(" ")
    operands = _operands(rest)
    place = Place(address, labels)
    words = encode(name, operands, place)
    if words is None and name[-2:] in CONDITIONS:
        words = encode(name[:-2], operands, place)
    assert words is not None, f"not known to the test assembler: {text}"
    return words


def _operands(text: str) -> list[str]:
    """Return the operands, which commas outside of brackets and braces separate."""
    return [part.strip() for part in re.split(r",(?![^\[{]*[\]}])", text) if part.strip()]
