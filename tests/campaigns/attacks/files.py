"""Damaged untrusted files: scenarios, recordings, ELF, HEX. Each is refused in one line or runs."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from random import Random

from fcu_emulator import Board, FcuError, InputError
from fcu_emulator.emulator.chip.firmware import Limits
from fcu_emulator.emulator.scenario import load_scenario
from fcu_emulator.firmware_model.arm import prebuilt
from tests.support.arm.mutations import ANYWHERE, OF_ELF, mutated

_SCENARIOS = sorted((Path(__file__).parents[3] / "scenarios").glob("*.toml"))
_RUN_EVERY = 10  # of the files that are accepted one in ten is run, too
_NUMBER = re.compile(rb"-?\d+(?:\.\d+)?(?:e-?\d+)?")
_EXTREME = (
    *(b"nan", b"-nan", b"inf", b"-inf", b"1e308", b"-1e308", b"5e-324", b"-0.0", b"0", b"-1"),
    *(b"9" * 30, b"9" * 5000, b"0x7fffffffffffffff", b"1_000", b"true", b'"1s"', b"[]", b"{}", b""),
)
_PIECES = (
    *(b"[" * 2000, b"{a=" * 500, b"'''", b'"""', b"\\", b"\0", b"\xff\xfe", b"\r", b"# \x1b[31m\n"),
    *(b'pattern = "(a*)*$"\n', b'file = "../../../etc/passwd"\n', b"a.b.c.d = 1\n", b"\n" * 500),
    *(b"[[timeline]]\n" * 300, b"[[expect]]\nkind = 'regex'\npattern = '(?:(?:a{99}){99}){99}'\n"),
)


def scenarios(tries: int, random: Random, folder: Path) -> Iterator[str]:
    """Try the shipped scenarios with changed numbers, parts and bytes."""
    texts = [path.read_bytes() for path in _SCENARIOS]
    path = folder / "scenario.toml"
    for number in range(tries):
        path.write_bytes(_changed(random.choice(texts), random))
        yield _scenario(path, number)


def recordings(tries: int, random: Random, folder: Path) -> Iterator[str]:
    """Try a scenario that replays a changed CSV file."""
    path, csv = folder / "scenario.toml", folder / "recording.csv"
    path.write_text(
        'schema = 1\nquestion = "?"\nduration = "1s"\n[[timeline]]\ndo = "replay"\ncsv = "recording.csv"\n',
        encoding="utf-8",
    )
    head = b"t_s,ax_g,ay_g,az_g\n"
    rows = b"".join(b"%d.%02d,0.%03d,0.5,-0.8\n" % (n // 100, n % 100, n) for n in range(200))
    for number in range(tries):
        csv.write_bytes(_changed(head + rows, random))
        yield _scenario(path, number)


def _changed(text: bytes, random: Random) -> bytes:
    for _ in range(random.randrange(1, 4)):
        places = [match.span() for match in _NUMBER.finditer(text)]
        what = random.randrange(3)
        if what == 0 and places:
            start, end = random.choice(places)
            text = text[:start] + random.choice(_EXTREME) + text[end:]
        elif what == 1:
            at = random.choice([match.start() for match in re.finditer(rb"^", text, re.MULTILINE)])
            text = text[:at] + random.choice(_PIECES) + text[at:]
        else:
            text = mutated(text, random, ANYWHERE)
    return text


def _scenario(path: Path, number: int) -> str:
    try:
        plan = load_scenario(path)
        if number % _RUN_EVERY:
            return "accepted"
        board = Board("lab3", scenario=plan)
    except InputError as refused:
        _one_line(refused)
        return "refused in one line"
    try:
        board.run_for(0.05)
    except FcuError as failed:
        _one_line(failed)
    return "accepted and run"


def _one_line(error: FcuError) -> None:
    text = str(error)
    if "\n" in text or not text.isprintable() or len(text) > 1000:
        raise AssertionError(f"not one short printable line: {text[:200]!r}")


def elf_files(tries: int, random: Random, folder: Path) -> Iterator[str]:
    """Try damaged copies of the solution's file. An accepted file runs for a short time."""
    whole = prebuilt("solution").read_bytes()
    for number in range(tries):
        yield _firmware(mutated(whole, random, OF_ELF), folder / "damaged.elf", number)


def hex_files(tries: int, random: Random, folder: Path) -> Iterator[str]:
    """Try damaged HEX files in the same way."""
    from tests.arm.test_run_built_firmware import as_intel_hex, flash_contents

    whole = as_intel_hex(flash_contents("template")).encode()
    for number in range(tries):
        if random.random() < 0.5:  # nearly all of these are refused for a checksum
            damaged = mutated(whole, random, ANYWHERE)
        else:
            records = whole.split(b"\n")
            for _ in range(random.randrange(1, 4)):
                at = random.randrange(len(records))
                records[at] = _other_record(records[at], random)
            damaged = b"\n".join(records)
        yield _firmware(damaged, folder / "damaged.hex", number)


def _other_record(record: bytes, random: Random) -> bytes:
    """Return a record with a changed byte and a matching checksum, or no record, or two."""
    if random.random() < 0.2 or len(record) < 11:
        return random.choice((b"", record + b"\n" + record))
    data = bytearray.fromhex(record.strip()[1:-2].decode("ascii"))
    data[random.randrange(1, len(data))] = random.choice((0, 1, 4, 5, 0x7F, 0xFF, random.randrange(256)))
    return b":%s%02X" % (data.hex().upper().encode(), -sum(data) & 0xFF)


def _firmware(data: bytes, path: Path, number: int) -> str:
    from fcu_emulator.emulator.chip.image import parse_firmware

    try:
        image = parse_firmware(data, path.name)
        if image.symbols is not None:
            image.symbols.variables()
        if number % _RUN_EVERY:
            return "accepted"
        path.write_bytes(data)
        board = Board(path, wiring="lab3")
    except InputError as refused:
        _one_line(refused)
        return "refused in one line"
    assert board.chip is not None
    board.chip.limits = Limits(instructions=5_000_000, wall_s=20)
    try:
        board.run_for(0.02)
    except FcuError:
        return "accepted, stopped at a limit"
    board.chip.diagnosis()
    return "accepted and run"
