"""The LPS22HB's FIFO, mode by mode (datasheet section 5, 9.6, 9.8, 9.16).

The pressure is 1 hPa per sample: sample k (1, 2 ...) of a run at 10 Hz reads k hPa, and k / 100 degC.
"""

from __future__ import annotations

import pytest

from tests.support.notes import kinds
from tests.support.sensor_fakes import PS_PER_S, Chip, ramp

INTERRUPT_CFG, THS_P_L, CTRL_REG1, CTRL_REG2, FIFO_CTRL = 0x0B, 0x0C, 0x10, 0x11, 0x14
INT_SOURCE, FIFO_STATUS, PRESS_OUT_XL, TEMP_OUT_L = 0x25, 0x26, 0x28, 0x2B
FIFO, STREAM, STREAM_TO_FIFO, BYPASS_TO_STREAM = 0x20, 0x40, 0x60, 0x80
DYNAMIC_STREAM, BYPASS_TO_FIFO = 0xC0, 0xE0
FTH_FIFO, OVR = 0x80, 0x40
LATCHED_ABOVE = 0x0D  # INTERRUPT_CFG: DIFF_EN, LIR, PHE
PERIOD_PS = PS_PER_S // 10


def collecting(fifo_ctrl: int, *, stop_on_fth: bool = False, interrupt_above: int | None = None) -> Chip:
    """Return a sensor that runs at 10 Hz. An interrupt comes at the first sample above this number of hPa."""
    chip = Chip("LPS22HB")
    chip.world.signals["pressure_hpa"] = ramp((0.0,), (10.0,))
    chip.world.signals["temperature_degc"] = ramp((0.0,), (0.1,))
    if interrupt_above is not None:
        chip.write(THS_P_L, *(16 * interrupt_above).to_bytes(2, "little"))
        chip.write(INTERRUPT_CFG, LATCHED_ABOVE)
    chip.write(CTRL_REG2, 0x70 if stop_on_fth else 0x50)
    chip.write(FIFO_CTRL, fifo_ctrl)
    chip.write(CTRL_REG1, 0x20)
    return chip


def level(sample: int) -> bytes:
    """Return the five bytes of sample ``sample``."""
    return (4096 * sample).to_bytes(3, "little") + sample.to_bytes(2, "little")


def levels(*samples: int) -> bytes:
    return b"".join(level(sample) for sample in samples)


def after(chip: Chip, samples: int) -> Chip:
    chip.wait(samples * PERIOD_PS)
    return chip


# -- bypass -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("fifo_ctrl", [0x00, 0x1F, 0xA0])
def test_output_in_bypass_is_latest_sample(fifo_ctrl: int) -> None:
    """Datasheet 5.1. The reserved mode 101b is treated as bypass."""
    chip = after(collecting(fifo_ctrl), 40)
    assert chip.byte(FIFO_STATUS) == 0x00
    assert chip.read(PRESS_OUT_XL, 10) == levels(40, 40)
    *forbidden, outside = chip.notes
    assert outside[0] == "out of range"
    assert kinds(forbidden) == (["forbidden"] if fifo_ctrl == 0xA0 else [])
    assert all("FIFO_CTRL.F_MODE" in text for _, text in forbidden)


def test_no_mode_stores_samples_without_fifo_en() -> None:
    chip = collecting(STREAM)
    chip.write(CTRL_REG2, 0x10)
    after(chip, 5)
    assert (chip.byte(FIFO_STATUS), chip.read(PRESS_OUT_XL, 5)) == (0x00, level(5))


@pytest.mark.parametrize("write", [(FIFO_CTRL, 0x00), (CTRL_REG2, 0x10), (CTRL_REG2, 0x54)])
def test_bypass_or_disabling_or_swreset_empties_fifo(write: tuple[int, int]) -> None:
    """Datasheet 5.2: FIFO mode is restarted by a change to bypass."""
    chip = after(collecting(FIFO), 40)
    assert chip.byte(FIFO_STATUS) == OVR | 32

    chip.write(*write)
    assert chip.byte(FIFO_STATUS) == 0
    assert chip.read(PRESS_OUT_XL, 5) == level(40)
    chip.write(CTRL_REG2, 0x50)
    chip.write(FIFO_CTRL, FIFO)
    chip.write(CTRL_REG1, 0x20)
    after(chip, 2)
    assert chip.byte(FIFO_STATUS) == 2
    assert chip.read(PRESS_OUT_XL, 5) == level(41)


# -- FIFO mode ----------------------------------------------------------------------------------------------


def test_fifo_mode_fills_and_stops() -> None:
    chip = after(collecting(FIFO), 31)
    assert chip.byte(FIFO_STATUS) == 31
    assert after(chip, 1).byte(FIFO_STATUS) == 32
    assert after(chip, 1).byte(FIFO_STATUS) == OVR | 32, "sample 33 is lost"
    after(chip, 10)
    assert chip.read(PRESS_OUT_XL, 160) == levels(*range(1, 33)), "datasheet 5.8: 160 bytes empty it"
    assert chip.byte(FIFO_STATUS) == 0
    assert after(chip, 10).byte(FIFO_STATUS) == 0, "stopped until bypass"
    assert chip.read(PRESS_OUT_XL, 5) == level(32), "the last level read stays in the registers"


def test_fifo_mode_continues_if_read_in_time() -> None:
    chip = after(collecting(FIFO), 32)
    chip.read(PRESS_OUT_XL, 5)
    after(chip, 1)
    assert chip.byte(FIFO_STATUS) == 32
    assert chip.read(PRESS_OUT_XL, 160) == levels(*range(2, 34))


@pytest.mark.parametrize("mode", [FIFO, STREAM, DYNAMIC_STREAM])
def test_stop_on_fth_limits_depth_to_watermark(mode: int) -> None:
    """Datasheet 5.2."""
    chip = after(collecting(mode | 9, stop_on_fth=True), 10)
    assert chip.byte(FIFO_STATUS) == FTH_FIFO | 10
    assert after(chip, 3).byte(FIFO_STATUS) == FTH_FIFO | OVR | 10
    expected = range(1, 11) if mode == FIFO else range(4, 14)
    assert chip.read(PRESS_OUT_XL, 50) == levels(*expected)


def test_watermark_flag_follows_fill() -> None:
    """Datasheet 9.16. With WTM = 0 the flag is never set."""
    chip = after(collecting(FIFO | 3), 2)
    assert chip.byte(FIFO_STATUS) == 2
    assert after(chip, 1).byte(FIFO_STATUS) == FTH_FIFO | 3
    chip.read(PRESS_OUT_XL, 5)
    assert chip.byte(FIFO_STATUS) == 2
    chip.write(FIFO_CTRL, FIFO | 2)
    assert chip.byte(FIFO_STATUS) == FTH_FIFO | 2
    chip.write(FIFO_CTRL, FIFO)
    assert chip.byte(FIFO_STATUS) == 2


# -- stream -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("mode", [STREAM, DYNAMIC_STREAM])
def test_stream_mode_overwrites_oldest_samples(mode: int) -> None:
    chip = after(collecting(mode), 32)
    assert chip.byte(FIFO_STATUS) == 32
    assert after(chip, 8).byte(FIFO_STATUS) == OVR | 32
    assert chip.read(PRESS_OUT_XL, 5) == level(9)
    assert chip.byte(FIFO_STATUS) == 31, "not full any more"
    assert chip.read(PRESS_OUT_XL, 155) == levels(*range(10, 41))


def test_emptied_stream_repeats_its_latest_level() -> None:
    """Datasheet 5.3: the fill level goes from 0 to 2 in one step."""
    chip = after(collecting(STREAM), 1)
    assert chip.byte(FIFO_STATUS) == 1, "nothing has been read before"
    assert chip.read(PRESS_OUT_XL, 5) == level(1)
    assert chip.byte(FIFO_STATUS) == 0
    assert after(chip, 1).byte(FIFO_STATUS) == 2
    assert after(chip, 1).byte(FIFO_STATUS) == 3
    assert chip.read(PRESS_OUT_XL, 15) == levels(1, 2, 3)


def test_emptied_dynamic_stream_does_not_repeat() -> None:
    chip = after(collecting(DYNAMIC_STREAM), 1)
    assert chip.read(PRESS_OUT_XL, 5) == level(1)
    assert after(chip, 1).byte(FIFO_STATUS) == 1
    assert chip.read(PRESS_OUT_XL, 5) == level(2)


# -- triggered modes ----------------------------------------------------------------------------------------


def test_stream_to_fifo_keeps_samples_before_interrupt() -> None:
    """Datasheet 5.5."""
    chip = after(collecting(STREAM_TO_FIFO, interrupt_above=50), 50)
    assert chip.byte(FIFO_STATUS) == OVR | 32
    after(chip, 30)  # sample 51 raises the interrupt: the FIFO is full and stops
    assert chip.read(PRESS_OUT_XL, 160) == levels(*range(19, 51))
    assert after(chip, 5).byte(FIFO_STATUS) == 0


def test_stream_to_fifo_resumes_when_interrupt_is_read() -> None:
    chip = after(collecting(STREAM_TO_FIFO, interrupt_above=50), 60)
    chip.write(THS_P_L, 0xFF, 0xFF)
    assert chip.byte(INT_SOURCE) == 0x05
    after(chip, 5)  # what came while it had stopped is lost
    assert chip.read(PRESS_OUT_XL, 160) == levels(*range(24, 51), *range(61, 66))


@pytest.mark.parametrize("mode", [BYPASS_TO_STREAM, BYPASS_TO_FIFO])
def test_bypass_modes_collect_after_interrupt(mode: int) -> None:
    """Datasheet 5.6, 5.7: the sample that raises the interrupt is the first collected sample."""
    chip = after(collecting(mode, interrupt_above=50), 50)
    assert (chip.byte(FIFO_STATUS), chip.read(PRESS_OUT_XL, 5)) == (0, level(50))
    assert after(chip, 40).byte(FIFO_STATUS) == OVR | 32
    first = 51 if mode == BYPASS_TO_FIFO else 59
    assert chip.read(PRESS_OUT_XL, 160) == levels(*range(first, first + 32))


@pytest.mark.parametrize("mode", [BYPASS_TO_STREAM, BYPASS_TO_FIFO])
def test_reading_interrupt_ends_collecting(mode: int) -> None:
    chip = after(collecting(mode, interrupt_above=50), 55)
    assert chip.byte(FIFO_STATUS) == 5
    chip.write(THS_P_L, 0xFF, 0xFF)
    assert chip.byte(INT_SOURCE) == 0x05
    assert (chip.byte(FIFO_STATUS), chip.read(PRESS_OUT_XL, 5)) == (0, level(55))


# -- reading ------------------------------------------------------------------------------------------------


def test_reading_final_byte_removes_fifo_level() -> None:
    """ST's example reads 3 bytes at 28h and then 2 at 2Bh; other drivers read a burst."""
    chip = after(collecting(FIFO), 4)
    assert chip.read(PRESS_OUT_XL, 3) + chip.read(PRESS_OUT_XL, 3) == 2 * level(1)[:3]
    assert chip.byte(TEMP_OUT_L) == 1
    assert chip.byte(FIFO_STATUS) == 4
    assert chip.byte(TEMP_OUT_L + 1) == 0
    assert chip.byte(FIFO_STATUS) == 3
    assert chip.read(PRESS_OUT_XL, 3) + chip.read(TEMP_OUT_L, 2) == level(2)
    assert chip.read(TEMP_OUT_L, 4) == level(3)[3:] + level(4)[:2]
    assert chip.byte(FIFO_STATUS) == 1


def test_partly_read_level_with_bdu_is_not_overwritten() -> None:
    """Datasheet 9.5, with a full stream that continues during the read."""
    chip = collecting(STREAM)
    chip.write(CTRL_REG1, 0x22)
    after(chip, 40)
    begun = chip.read(PRESS_OUT_XL)
    after(chip, 3)
    assert begun + chip.read(PRESS_OUT_XL + 1, 2) == level(9)[:3]
    assert chip.read(PRESS_OUT_XL, 5) == level(12)


def test_fifo_values_include_offset() -> None:
    """The FIFO has the values of PRESS_OUT; RPDS is in 1/16 hPa."""
    chip = collecting(FIFO)
    after(chip, 2)
    chip.write(0x18, 0x10)
    after(chip, 1)
    assert [chip.read(PRESS_OUT_XL, 5)[:3] for _ in range(3)] == [level(n)[:3] for n in (1, 2, 2)]
