"""The LPS22HB's differential interrupt (datasheet 9.1, 9.2, 9.15)."""

from __future__ import annotations

import pytest

from tests.support.lps22hb_fakes import (
    AUTORIFP,
    AUTOZERO,
    CTRL_REG2,
    DIFF_EN,
    EITHER,
    IA,
    INT_SOURCE,
    INTERRUPT_CFG,
    LIR,
    PERIOD_PS,
    PH,
    PHE,
    PL,
    PLE,
    REF_P_XL,
    RPDS_L,
    measuring,
    next_source,
    threshold,
)


@pytest.mark.parametrize(
    ("enabled", "expected"),
    [
        (EITHER, [0, 0, PH | IA, 0, PL | IA]),
        (DIFF_EN | PHE, [0, 0, PH | IA, 0, 0]),
        (DIFF_EN | PLE, [0, 0, 0, 0, PL | IA]),
        (DIFF_EN, [0] * 5),
        (PLE | PHE, [0] * 5),
    ],
)
def test_flags_follow_difference_from_reference(enabled: int, expected: list[int]) -> None:
    """Datasheet 9.1, 9.2 and 9.15: +-THS_P in 1/16 hPa about the reference. At exactly this value no flag is set."""
    lsb = 1 / 4096
    chip = measuring(1000.0, 1002.0, 1002.0 + lsb, 998.0, 998.0 - lsb)
    threshold(chip, 2.0)
    chip.write(INTERRUPT_CFG, enabled | AUTORIFP)
    assert [next_source(chip) for _ in range(5)] == expected


@pytest.mark.parametrize("reference", [AUTOZERO, AUTORIFP])
def test_pressure_is_compared_with_either_reference(reference: int) -> None:
    chip = measuring(1000.0, 1003.0)
    threshold(chip, 2.0)
    chip.write(RPDS_L, 0x00, 0x10)
    chip.write(INTERRUPT_CFG, EITHER | reference)
    assert [next_source(chip), next_source(chip)] == [0, PH | IA]


def test_absolute_pressure_is_compared_without_reference() -> None:
    """A REF_P that firmware has written has no effect."""
    chip = measuring(999.0, 1001.0)
    chip.write(REF_P_XL, *(900 * 4096).to_bytes(3, "little"))
    threshold(chip, 1000.0)
    chip.write(INTERRUPT_CFG, EITHER)
    assert [next_source(chip), next_source(chip)] == [0, PH | IA]


def test_latched_interrupt_stays_until_it_is_read() -> None:
    chip = measuring(1000.0, 1005.0, 995.0, 1000.0)
    threshold(chip, 2.0)
    chip.write(INTERRUPT_CFG, EITHER | LIR | AUTORIFP)
    chip.wait(10 * PERIOD_PS)
    assert chip.byte(INT_SOURCE) == PH | PL | IA
    assert chip.byte(INT_SOURCE) == 0
    assert next_source(chip) == 0


def test_latched_interrupt_returns_while_cause_lasts() -> None:
    chip = measuring(1000.0, 1005.0)
    threshold(chip, 2.0)
    chip.write(INTERRUPT_CFG, EITHER | LIR | AUTORIFP)
    next_source(chip)
    assert [next_source(chip), chip.byte(INT_SOURCE), next_source(chip)] == [PH | IA, 0, PH | IA]


def test_disabled_comparison_ends_unlatched_interrupts() -> None:
    for latch, left in ((0, 0), (LIR, PH | IA)):
        chip = measuring(1000.0)
        chip.write(INTERRUPT_CFG, DIFF_EN | PHE | latch)
        chip.wait(PERIOD_PS)
        chip.write(INTERRUPT_CFG, latch)
        assert chip.byte(INT_SOURCE) == left


def test_swreset_ends_latched_interrupt() -> None:
    chip = measuring(1000.0)
    chip.write(INTERRUPT_CFG, DIFF_EN | PHE | LIR)
    chip.wait(PERIOD_PS)
    chip.write(CTRL_REG2, 0x14)
    assert chip.byte(INT_SOURCE) == 0
