"""The LPS22HB's reference pressure: AUTOZERO, AUTORIFP and RPDS (datasheet 9.1)."""

from __future__ import annotations

import pytest

from tests.support.lps22hb_fakes import (
    AUTORIFP,
    AUTOZERO,
    CTRL_REG1,
    CTRL_REG2,
    EITHER,
    IA,
    INTERRUPT_CFG,
    LIR,
    PH,
    PRESS_OUT_XL,
    REF_P_XL,
    RESET_ARP,
    RESET_AZ,
    RPDS_L,
    measuring,
    next_hpa,
    next_source,
    ref_hpa,
)
from tests.support.sensor_fakes import PS_PER_MS, PS_PER_S, PS_PER_US


def test_autozero_captures_next_pressure_and_subtracts_it() -> None:
    """Datasheet 9.1. LPS35HW drivers wait until the bit is 0 and then read."""
    chip = measuring(1000.0, 1001.0, 1003.5, 990.0, 1004.0)
    assert next_hpa(chip) == 1000.0

    chip.write(INTERRUPT_CFG, AUTOZERO)
    assert (chip.byte(INTERRUPT_CFG), ref_hpa(chip)) == (AUTOZERO, 0.0)
    assert next_hpa(chip) == 0.0
    assert (chip.byte(INTERRUPT_CFG), ref_hpa(chip)) == (0x00, 1001.0)
    assert [next_hpa(chip), next_hpa(chip)] == [2.5, -11.0]

    chip.write(INTERRUPT_CFG, RESET_AZ)
    assert ref_hpa(chip) == 0.0
    assert next_hpa(chip) == 1004.0


def test_autorifp_captures_without_change_of_output() -> None:
    chip = measuring(1000.0, 1001.0)
    chip.write(INTERRUPT_CFG, AUTORIFP)
    assert next_hpa(chip) == 1000.0
    assert (chip.byte(INTERRUPT_CFG), ref_hpa(chip)) == (0x00, 1000.0)
    assert next_hpa(chip) == 1001.0
    chip.write(INTERRUPT_CFG, RESET_ARP)
    assert ref_hpa(chip) == 1000.0


def test_autozero_replaces_rpds_and_autorifp_keeps_it() -> None:
    """Datasheet 9.1 and 9.12: PRESS_OUT = P - RPDS, and with AUTOZERO P - REF_P."""
    chip = measuring(1000.0)
    chip.write(RPDS_L, 32)
    assert next_hpa(chip) == 998.0
    chip.write(INTERRUPT_CFG, AUTORIFP)
    assert next_hpa(chip) == 998.0
    assert ref_hpa(chip) == 1000.0
    chip.write(INTERRUPT_CFG, AUTOZERO)
    assert next_hpa(chip) == 0.0
    chip.write(INTERRUPT_CFG, RESET_AZ)
    assert next_hpa(chip) == 998.0


def test_autozero_request_waits_and_can_be_cancelled() -> None:
    chip = measuring(1000.0, 1001.0)
    chip.write(CTRL_REG1, 0x00)
    chip.write(INTERRUPT_CFG, AUTOZERO)
    chip.wait(PS_PER_S)
    assert chip.byte(INTERRUPT_CFG) == AUTOZERO
    chip.write(CTRL_REG2, 0x11)
    chip.wait(13 * PS_PER_MS)
    assert (chip.byte(INTERRUPT_CFG), ref_hpa(chip)) == (0x00, 1001.0)

    chip.write(INTERRUPT_CFG, RESET_AZ | AUTOZERO)
    chip.write(INTERRUPT_CFG, 0x00)
    chip.write(CTRL_REG2, 0x11)
    chip.wait(13 * PS_PER_MS)
    assert chip.read(PRESS_OUT_XL, 3) == (1001 * 4096).to_bytes(3, "little")


def test_firmware_may_write_reference_directly() -> None:
    chip = measuring(1000.0)
    chip.write(REF_P_XL, *(10 * 4096).to_bytes(3, "little"))
    assert next_hpa(chip) == 1000.0, "without AUTOZERO nothing is subtracted"
    chip.write(INTERRUPT_CFG, AUTOZERO)
    assert next_hpa(chip) == 0.0
    chip.write(REF_P_XL, *(10 * 4096).to_bytes(3, "little"))
    assert next_hpa(chip) == 990.0


@pytest.mark.parametrize("reset", [RESET_AZ, RESET_ARP, RESET_AZ | RESET_ARP])
def test_reset_bits_clear_themselves(reset: int) -> None:
    chip = measuring(1000.0)
    chip.write(INTERRUPT_CFG, reset | LIR)
    assert chip.byte(INTERRUPT_CFG) == reset | LIR
    chip.wait(10 * PS_PER_US)
    assert chip.byte(INTERRUPT_CFG) == LIR


def test_swreset_ends_autozero() -> None:
    """The output is P - RPDS again, because RPDS is not reset (datasheet 9.6)."""
    chip = measuring(1000.0)
    chip.write(RPDS_L, 32)
    chip.write(INTERRUPT_CFG, AUTOZERO)
    next_hpa(chip)
    chip.write(CTRL_REG2, 0x14)
    chip.write(CTRL_REG1, 0x20)
    assert next_hpa(chip) == 998.0
    assert ref_hpa(chip) == 0.0


@pytest.mark.parametrize("end", [(CTRL_REG2, 0x14), (INTERRUPT_CFG, RESET_ARP)])
def test_interrupt_compares_with_0_again_after_autorifp(end: tuple[int, int]) -> None:
    chip = measuring(1000.0)
    chip.write(INTERRUPT_CFG, AUTORIFP)
    next_hpa(chip)
    chip.write(*end)
    chip.write(REF_P_XL, *(1000 * 4096).to_bytes(3, "little"))
    chip.write(INTERRUPT_CFG, EITHER)
    chip.write(CTRL_REG1, 0x20)
    assert next_source(chip) == PH | IA
