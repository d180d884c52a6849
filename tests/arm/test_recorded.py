"""Whole runs equal their records, which another build made.

``python -m tests.support.arm.recording`` shows more about a difference, and records again after a deliberate change.
"""

from __future__ import annotations

import copy
from typing import Any

import pytest

from tests.support.arm import recording
from tests.support.arm.recorded_cases import CASES
from tests.support.arm.recording import FOLDER, Case, Record, counts_of, differences

ALL_RECORDS_BYTES = 600_000
PROGRAM = CASES["assembly-i2c-by-dma"]


@pytest.mark.parametrize("name", CASES)
@pytest.mark.parametrize("traced", [True, False], ids=["traced", "untraced"])
def test_run_equals_recorded_run(name: str, traced: bool) -> None:
    """Without a detailed trace a build may omit steps. Memory, registers and text do not depend on them."""
    recorded = recording.load(CASES[name])
    now = recording.record(CASES[name], traced=traced, counts=counts_of(recorded))
    found = differences(recorded, now)

    assert not found, "\n".join([*found, f"python -m tests.support.arm.recording {name} tells more"])


def test_each_case_has_record_and_records_are_small() -> None:
    files = sorted(FOLDER.glob("*.json"))

    assert {file.stem for file in files} == set(CASES)
    assert sum(file.stat().st_size for file in files) < ALL_RECORDS_BYTES


# -- what is said about a difference ------------------------------------------------------------------------


@pytest.fixture(scope="module")
def recorded() -> Record:
    return recording.load(PROGRAM)


def changed(recorded: Record, *path: str | int, to: Any) -> Record:
    """Return a copy with another value at this place."""
    copied = copy.deepcopy(recorded)
    place = copied
    for step in path[:-1]:
        place = place[step]
    place[path[-1]] = to
    return copied


def test_record_equals_its_copy(recorded: Record) -> None:
    assert differences(recorded, copy.deepcopy(recorded)) == []


def test_changed_early_entry_is_reported(recorded: Record) -> None:
    first = recorded["exact"]["transfers"]["first"][3]
    now = changed(recorded, "exact", "transfers", "first", 3, to="I2C2 6B OUT_TEMP_L sent 20 read  nack")

    assert differences(recorded, now) == [
        f"transfers, entry 3: recorded {first!r}, now 'I2C2 6B OUT_TEMP_L sent 20 read  nack'"
    ]


def test_changed_late_entry_is_located(recorded: Record) -> None:
    digests = recorded["exact"]["transfers"]["digests"]
    now = changed(recorded, "exact", "transfers", "digests", to=digests[:8] + "0" * 8 + digests[16:])

    assert differences(recorded, now) == ["transfers: the first difference is in entries 64 to 127"]


def test_missing_entry_is_counted(recorded: Record) -> None:
    entries = [f"entry {number}" for number in range(100)]
    whole, short = (
        changed(recorded, "exact", "transfers", to=recording._kept(entries[:count], 24))
        for count in (100, 99)
    )

    assert differences(whole, short) == ["transfers: recorded 100 entries, now 99"]


@pytest.mark.parametrize(
    ("path", "value", "told"),
    [
        (("exact", "ending"), "it has crashed", "the run ended with '', now with 'it has crashed'"),
        (("timing", "retired"), 5, "retired: recorded 232470, now 5"),
        (("timing", "registers", "r5"), "7", "register r5: recorded 20000000, now 7"),
        (("timing", "blocks", "I2C2", "04"), "0", "I2C2 04: recorded"),
        (("timing", "blocks", "I2C2"), {}, "I2C2 00: recorded"),
    ],
)
def test_other_differences_are_named(recorded: Record, path: tuple[str, ...], value: Any, told: str) -> None:
    found = differences(recorded, changed(recorded, *path, to=value))

    assert found[0].startswith(told)


def test_changed_memory_is_located_to_kilobyte(recorded: Record) -> None:
    pages = recorded["timing"]["RAM"]
    now = changed(recorded, "timing", "RAM", to=pages[:16] + "0" * 8 + pages[24:])

    assert differences(recorded, now) == ["RAM from 0x20000800 to 0x20000BFF has another content"]


def test_another_program_differs_from_record(recorded: Record) -> None:
    other: Case = CASES["assembly-i2c-by-interrupt"]
    now = recording.record(other, counts=counts_of(recorded))
    told = {line.split(":")[0] for line in differences(recorded, now)}

    assert {"retired", "RAM from 0x20000000 to 0x200003FF has another content", "DMA1 00"} <= told
