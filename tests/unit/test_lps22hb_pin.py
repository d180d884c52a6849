"""The LPS22HB's INT_DRDY pin (datasheet 9.7)."""

from __future__ import annotations

import pytest

from tests.support.lps22hb_fakes import (
    AUTORIFP,
    CTRL_REG1,
    CTRL_REG2,
    CTRL_REG3,
    EITHER,
    FIFO_CTRL,
    FIFO_STATUS,
    IA,
    INT_SOURCE,
    INTERRUPT_CFG,
    LIR,
    PERIOD_PS,
    PH,
    PRESS_OUT_XL,
    Wire,
    measuring,
    threshold,
)
from tests.support.sensor_fakes import PS_PER_S, Chip, constant, ramp, step


def test_data_ready_falls_with_press_out_h() -> None:
    chip = measuring(1000.0)
    wire = Wire(chip)
    chip.write(CTRL_REG3, 0x04)
    assert wire.run(1.5) == [(1.0, 1)]
    chip.read(PRESS_OUT_XL + 3, 2)
    chip.read(PRESS_OUT_XL, 2)
    assert wire.run(0) == []
    chip.read(PRESS_OUT_XL + 2)
    assert wire.run(0) == [(1.5, 0)]
    assert wire.run(3) == [(2.0, 1)]


@pytest.mark.parametrize(
    ("control3", "idle", "active"), [(0x04, 0, 1), (0x84, 1, 0), (0x44, 0, None), (0xC4, None, 0)]
)
def test_polarity_and_open_drain_determine_pin_level(
    control3: int, idle: int | None, active: int | None
) -> None:
    """INT_H_L and PP_OD: an open-drain pin never drives high."""
    chip = measuring(1000.0)
    (pin,) = chip.part.pins()
    chip.write(CTRL_REG3, control3)
    assert pin.level == idle
    chip.wait(PERIOD_PS)
    chip.part.catch_up(chip.t_ps)
    assert pin.level == active


@pytest.mark.parametrize(
    ("signal", "expected"),
    [
        (0x10, [(5.0, 1)]),  # F_FTH: watermark of 5
        (0x20, [(32.0, 1)]),  # F_FSS5: 32 levels
        (0x08, [(33.0, 1)]),  # F_OVR: the first sample that is lost
        (0x38, [(5.0, 1)]),  # ORed
        (0x00, []),
    ],
)
def test_fifo_signals_drive_pin(signal: int, expected: list[tuple[float, int]]) -> None:
    """Datasheet 9.7."""
    chip = measuring(1000.0)
    wire = Wire(chip)
    chip.write(CTRL_REG3, signal)
    chip.write(CTRL_REG2, 0x50)
    chip.write(FIFO_CTRL, 0x45)
    assert wire.run(40) == expected
    chip.read(PRESS_OUT_XL, 160)
    assert wire.run(0) == [(40.0, 0)] * len(expected)


def test_watermark_falls_with_final_byte_of_level() -> None:
    chip = measuring(1000.0)
    wire = Wire(chip)
    chip.write(CTRL_REG3, 0x10)
    chip.write(CTRL_REG2, 0x50)
    chip.write(FIFO_CTRL, 0xC1)
    assert wire.run(1.5) == [(1.0, 1)]
    chip.read(PRESS_OUT_XL, 4)
    assert wire.run(0) == []
    chip.read(PRESS_OUT_XL + 4)
    assert wire.run(0) == [(1.5, 0)]


@pytest.mark.parametrize(
    ("int_s", "expected"),
    [
        (1, [(2.0, 1), (3.0, 0)]),
        (2, [(4.0, 1), (5.0, 0)]),
        (3, [(2.0, 1), (3.0, 0), (4.0, 1), (5.0, 0)]),
    ],
)
def test_interrupts_replace_data_signals_on_pin(int_s: int, expected: list[tuple[float, int]]) -> None:
    """Datasheet Table 19. The data signals are enabled here, too, but have no effect."""
    chip = measuring(1000.0, 1005.0, 1000.0, 995.0, 1000.0)
    wire = Wire(chip)
    threshold(chip, 2.0)
    chip.write(INTERRUPT_CFG, EITHER | AUTORIFP)
    chip.write(CTRL_REG3, 0x3C | int_s)
    assert wire.run(8) == expected


def test_reading_int_source_releases_pin() -> None:
    chip = measuring(1000.0, 1005.0, 1000.0)
    wire = Wire(chip)
    threshold(chip, 2.0)
    chip.write(INTERRUPT_CFG, EITHER | LIR | AUTORIFP)
    chip.write(CTRL_REG3, 0x03)
    assert wire.run(3.5) == [(2.0, 1)]
    assert chip.byte(INT_SOURCE) == PH | IA
    assert wire.run(1) == [(3.5, 0)]


def test_unwired_pin_needs_no_events() -> None:
    chip = measuring(1000.0)
    chip.write(CTRL_REG3, 0x04)
    assert chip.part.next_event_ps() > 10**6 * PS_PER_S
    wire = Wire(chip)
    assert chip.part.next_event_ps() == PERIOD_PS
    assert wire.run(2.5) == [(1.0, 1)]
    chip.write(CTRL_REG3, 0x00)
    assert chip.part.next_event_ps() > 10**6 * PS_PER_S
    assert wire.run(5) == [(2.5, 0)]


def test_pin_edge_has_exact_time_after_late_read() -> None:
    chip = measuring(1000.0)
    wire = Wire(chip)
    chip.write(CTRL_REG3, 0x10)
    chip.write(CTRL_REG2, 0x50)
    chip.write(FIFO_CTRL, 0x47)
    chip.wait(25 * PERIOD_PS)
    assert chip.byte(FIFO_STATUS) == 0x80 | 25
    assert wire.edges == [(7.0, 1)]


def test_samples_before_world_change_stay_in_fifo() -> None:
    chip = Chip("LPS22HB")
    rising = chip.world.signals["pressure_hpa"] = ramp((0.0,), (10.0,))
    chip.write(CTRL_REG2, 0x50)
    chip.write(FIFO_CTRL, 0x20)
    chip.write(CTRL_REG1, 0x20)
    chip.wait(2 * PERIOD_PS)
    chip.world.signals["pressure_hpa"] = step(rising, constant(500.0), 0.25)
    chip.part.world_changed(chip.t_ps)
    chip.wait(PERIOD_PS)
    read = [int.from_bytes(chip.read(PRESS_OUT_XL, 5)[:3], "little") / 4096 for _ in range(3)]
    assert read == [1.0, 2.0, 500.0]
