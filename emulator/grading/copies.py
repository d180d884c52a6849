"""Find copies: identical programs and sources in a class, and submitted programs of fcu.

Decision: each program has a digest of its loaded bytes or C tokens, so that a large class needs one
pass. A measure of similarity was rejected: it accuses students who happened to write a few similar
lines.
"""

from __future__ import annotations

import functools
import hashlib
import re
from collections.abc import Hashable, Iterable, Mapping
from typing import Final

from fcu_emulator.emulator.chip.image.image import parse_firmware
from fcu_emulator.emulator.errors import FcuError
from fcu_emulator.emulator.grading.results import Graded
from fcu_emulator.emulator.grading.submissions import SubmittedFirmware, SubmittedSource
from fcu_emulator.firmware_model import arm

_CONTINUED = re.compile(rb"\\\r?\n")
_TOKEN = re.compile(
    rb"(?P<comment>/\*.*?(?:\*/|\Z)|//[^\n]*)"
    rb'|"(?:\\.|[^"\\\n])*"'
    rb"|'(?:\\.|[^'\\\n])*'"
    rb"|[\w.$]+"
    rb"|<<=|>>=|->|\+\+|--|<<|>>|<=|>=|==|!=|&&|\|\||##|[-+*/%&|^]="
    rb"|\S",
    re.DOTALL,
)
_OF_SOLUTION: Final = arm.sources() / "prebuilt" / "solution-source.sha256"
"""Digest of the solution's source code. A wheel does not contain this code. A test checks the digest."""


def program_digest(firmware: SubmittedFirmware) -> str:
    """Return a digest of the bytes that are loaded into the chip, or "" for an invalid file."""
    try:
        image = parse_firmware(firmware.data, firmware.name)
    except FcuError:
        return ""
    digest = hashlib.sha256()
    for segment in image.segments:
        digest.update(f"{segment.address} {len(segment.data)} ".encode() + segment.data)
    return digest.hexdigest()


def source_digest(source: SubmittedSource) -> str:
    """Return a digest of all C tokens, without comments."""
    forms = sorted(filter(None, map(_normal_form, source.files.values())))
    return hashlib.sha256(b"\0".join(forms)).hexdigest()


def _normal_form(data: bytes) -> bytes:
    tokens = _TOKEN.finditer(_CONTINUED.sub(b"", data))
    return b"\n".join(token[0] for token in tokens if token["comment"] is None)


@functools.cache
def shipped_digests() -> Mapping[str, str]:
    """Return the digests of fcu's programs, each with "template" or "solution"."""
    found = {}
    for program in arm.PROGRAMS:
        for bus in arm.BUSES:
            file = arm.prebuilt(program, bus)
            found[program_digest(SubmittedFirmware(file.name, file.read_bytes()))] = program
    template = arm.sources() / "template" / "main.c"
    others = (arm.template_of(""), arm.template_of("", arm.BOOT_LINE))
    for text in (template.read_bytes(), *(one.encode() for one in others)):
        found[source_digest(SubmittedSource({"main.c": text}))] = "template"
    found[_OF_SOLUTION.read_text(encoding="ascii").strip()] = "solution"
    return found


def with_copies(graded: Iterable[tuple[Hashable, Graded]]) -> list[Graded]:
    """Add the ids of identical submissions to the results.

    Each pair has a key. Results with the same key belong to a team, and are not copies.
    """
    pairs = list(graded)
    sources: dict[str, list[tuple[Hashable, str]]] = {}
    programs: dict[str, list[tuple[Hashable, str]]] = {}
    for what, one in pairs:
        if one.source_digest:
            sources.setdefault(one.source_digest, []).append((what, one.id))
        if one.program_digest:
            programs.setdefault(one.program_digest, []).append((what, one.id))
    own = shipped_digests()
    found = []
    for what, one in pairs:
        shipped = own.get(one.source_digest) or own.get(one.program_digest) or ""
        source = (
            [] if shipped else [name for other, name in sources.get(one.source_digest, ()) if other != what]
        )
        program = (
            [] if shipped else [name for other, name in programs.get(one.program_digest, ()) if other != what]
        )
        changed = {
            "shipped": shipped,
            "same_source": tuple(source),
            "same_program": tuple(name for name in program if name not in source),
        }
        found.append(one.model_copy(update=changed))
    return found
