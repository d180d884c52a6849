"""A small Thumb-2 assembler: the few dozen instructions that tests of the core are written in.

UAL syntax, one instruction or ``label:`` a line, ``;`` begins a comment. Loads, stores and conditional
branches out of reach have one encoding each, so an instruction's length never depends on its operands.
Inside an IT block the suffix (``addseq``) is optional and not compared with the block's condition.
``mov32 rd, value`` stands for MOVW and MOVT. Encodings: ARMv7-M ARM A7.7; checked against the GNU
assembler's in test_thumb_assembler.py.
"""

from __future__ import annotations

import re
import struct

from tests.support.arm.thumb_encodings import CONDITIONS, Labels, Place, encode


def assemble(source: str, origin: int, labels: Labels | None = None) -> tuple[bytes, Labels]:
    """The code to be placed at ``origin``, and the address of every label (without the Thumb bit).

    ``labels`` are names known beforehand. In ``mov32`` and ``.word`` a label may have ``+number`` behind it.
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
    """The half-words of one instruction; without ``labels`` their number only counts."""
    name, _, rest = text.partition(" ")
    operands = _operands(rest)
    place = Place(address, labels)
    words = encode(name, operands, place)
    if words is None and name[-2:] in CONDITIONS:
        words = encode(name[:-2], operands, place)
    assert words is not None, f"not known to the test assembler: {text}"
    return words


def _operands(text: str) -> list[str]:
    """Divided at commas that are not inside of brackets or braces."""
    return [part.strip() for part in re.split(r",(?![^\[{]*[\]}])", text) if part.strip()]
