"""A few tries of each campaign of ``python -m tests.campaigns.attacks``, and a short soak."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from tests.campaigns.attacks.__main__ import ATTACKS, row
from tests.campaigns.attacks.attack import Attack, carry_out

linux = pytest.mark.skipif(sys.platform != "linux", reason="/proc, /dev/full and POSIX signals")
FEW = {
    "gdb connections": 20,
    "scenarios": 60,
    "recordings": 60,
    "ELF files": 40,
    "HEX files": 40,
    "page requests": 300,
    "page messages": 100,
}
SEED = 2  # the usual campaign has another


@linux
@pytest.mark.usefixtures("interruptible")
@pytest.mark.parametrize("attack", ATTACKS, ids=lambda attack: attack.name)
def test_attacks_cause_no_failure(attack: Attack, tmp_path: Path) -> None:
    tries = FEW.get(attack.name, 3)
    outcome = carry_out(attack, tries, SEED, tmp_path)
    assert outcome.broken == ()
    assert outcome.tries == tries == sum(outcome.outcomes.values())


def test_failure_caused_by_attack_is_reported(tmp_path: Path) -> None:
    def tries(number, random, folder):  # type: ignore[no-untyped-def]
        yield "held"
        raise KeyError("pitch")

    outcome = carry_out(Attack("one", 2, tries), 2, SEED, tmp_path)
    assert outcome.broken == ("KeyError: 'pitch'",)
    assert "| one | 1 | held 1; BROKEN KeyError: 'pitch' |" in row(outcome)


@linux
@pytest.mark.parametrize("firmware", ["lab3", "solution"])
def test_long_run_needs_constant_resources(firmware: str) -> None:
    """``python -m tests.campaigns.soak`` runs two hours. Here the middle of a minute is compared with its end."""
    from tests.campaigns.soak import soak

    first, *_, before, middle, last = soak(firmware, 40.0, every_s=10.0)
    assert first.ticks > 0
    assert last.virtual_s == 40.0
    # Where a row ends depends on how fast the machine is; how many ticks it has for its time does not.
    for earlier, sample in ((before, middle), (middle, last)):
        assert sample.ticks == pytest.approx(800 * (sample.virtual_s - earlier.virtual_s), abs=2)
    assert last.descriptors == middle.descriptors
    assert last.memory_mib - middle.memory_mib < 2
