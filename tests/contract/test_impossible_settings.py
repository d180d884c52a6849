"""Every setting that the documents forbid causes one note (list: ``tests.support.impossible_settings``).

Tests of each function check the behaviour of the sensor with such a setting.
"""

from __future__ import annotations

import pytest

from tests.support.impossible_settings import BANK_A, CASES, FIFO_BUS, FIFO_ON, FUNC_EN, MAIN, XL_104, Case
from tests.support.sensor_fakes import Chip
from tests.support.words import Words


def forbidden(chip: Chip) -> list[str]:
    return [text for kind, text in chip.notes if kind == "forbidden"]


@pytest.mark.parametrize("case", CASES, ids=str)
def test_forbidden_setting_is_reported_once(case: Case, words: Words) -> None:
    chip = Chip(case.part)
    chip.configure((*case.before, *case.writes[:-1]))
    allowed = forbidden(chip)

    chip.configure(case.writes[-1:])

    *before, note = forbidden(chip)
    assert before == allowed
    assert note not in allowed
    assert case.setting in note, case.source
    words("sensors", note)


@pytest.mark.parametrize("case", CASES, ids=str)
def test_settings_before_the_forbidden_one_leave_no_note(case: Case) -> None:
    chip = Chip(case.part)
    chip.configure(case.before)

    assert forbidden(chip) == []


def test_reads_of_hub_beyond_its_outputs_are_noted(words: Words) -> None:
    """AN5040 7.2: 18 bytes, or 12 with the correction on, which needs the other bytes (7.5)."""
    chip = Chip("LSM6DSL")
    chip.configure((BANK_A, (0x02, 0x3D), (0x04, 0x27), (0x05, 0x3D), (0x07, 0x07), (0x08, 0x3D), (0x0A, 7)))
    chip.configure((MAIN, FUNC_EN, XL_104, (0x1A, 0x01)))

    (note,) = forbidden(chip)
    assert "SLAVEx_CONFIG" in note
    words("sensors", note)


def test_empty_fifo_read_is_noted(words: Words) -> None:
    """AN5040 8."""
    chip = Chip("LSM6DSL")
    chip.configure((FIFO_BUS, XL_104, (0x08, 0x01), FIFO_ON))
    chip.read(0x3E, 2)

    (note,) = set(forbidden(chip))
    assert "FIFO_DATA_OUT" in note
    words("sensors", note)


def test_lps22hb_boot_with_swreset_is_allowed() -> None:
    """Two drivers, one of them the board's driver, write both bits; then the sensor works."""
    chip = Chip("LPS22HB")
    chip.write(0x11, 0x94)

    assert chip.notes == []
