"""The LPS22HB's reference pressure, differential interrupt and INT_DRDY pin (datasheet 9.1, 9.7, 9.15).

The world goes through a list of pressures, one a sample, at 10 Hz.
"""

from __future__ import annotations

import numpy as np
import pytest

from tests.sensor_fakes import PS_PER_MS, PS_PER_S, PS_PER_US, Array, Chip, constant, ramp, step

INTERRUPT_CFG, THS_P_L, CTRL_REG1, CTRL_REG2, CTRL_REG3 = 0x0B, 0x0C, 0x10, 0x11, 0x12
FIFO_CTRL, REF_P_XL, RPDS_L = 0x14, 0x15, 0x18
INT_SOURCE, FIFO_STATUS, STATUS, PRESS_OUT_XL = 0x25, 0x26, 0x27, 0x28
AUTORIFP, RESET_ARP, AUTOZERO, RESET_AZ, DIFF_EN, LIR, PLE, PHE = (1 << bit for bit in range(7, -1, -1))
IA, PL, PH = 0x04, 0x02, 0x01
PERIOD_PS = PS_PER_S // 10
EITHER = DIFF_EN | PLE | PHE


def measuring(*pressures_hpa: float) -> Chip:
    """At 10 Hz from t = 0 on; the last pressure lasts."""

    def signal(t_s: Array) -> Array:
        number = np.rint(t_s * 10).astype(int) - 1
        read: Array = np.array(pressures_hpa)[np.clip(number, 0, len(pressures_hpa) - 1)]
        return read

    chip = Chip("LPS22HB")
    chip.world.signals["pressure_hpa"] = signal
    chip.write(CTRL_REG1, 0x20)
    return chip


def next_hpa(chip: Chip) -> float:
    chip.wait(PERIOD_PS)
    return int.from_bytes(chip.read(PRESS_OUT_XL, 3), "little", signed=True) / 4096


def next_source(chip: Chip) -> int:
    chip.wait(PERIOD_PS)
    return chip.byte(INT_SOURCE)


def ref_hpa(chip: Chip) -> float:
    return int.from_bytes(chip.read(REF_P_XL, 3), "little", signed=True) / 4096


def threshold(chip: Chip, hpa: float) -> None:
    chip.write(THS_P_L, *int(hpa * 16).to_bytes(2, "little"))


# -- reference ----------------------------------------------------------------------------------------------


def test_autozero_captures_the_next_pressure_and_subtracts_it() -> None:
    """Datasheet 9.1; LPS35HW drivers wait until the bit is 0 and then read."""
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


def test_autorifp_captures_but_leaves_the_output_alone() -> None:
    chip = measuring(1000.0, 1001.0)
    chip.write(INTERRUPT_CFG, AUTORIFP)
    assert next_hpa(chip) == 1000.0
    assert (chip.byte(INTERRUPT_CFG), ref_hpa(chip)) == (0x00, 1000.0)
    assert next_hpa(chip) == 1001.0
    chip.write(INTERRUPT_CFG, RESET_ARP)
    assert ref_hpa(chip) == 1000.0


def test_rpds_is_replaced_by_autozero_and_kept_by_autorifp() -> None:
    """Datasheet 9.1 and 9.12: PRESS_OUT = P - RPDS, under AUTOZERO P - REF_P."""
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


def test_a_request_waits_for_a_conversion_and_can_be_taken_back() -> None:
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


def test_firmware_may_set_the_reference_itself() -> None:
    chip = measuring(1000.0)
    chip.write(REF_P_XL, *(10 * 4096).to_bytes(3, "little"))
    assert next_hpa(chip) == 1000.0, "without AUTOZERO nothing is subtracted"
    chip.write(INTERRUPT_CFG, AUTOZERO)
    assert next_hpa(chip) == 0.0
    chip.write(REF_P_XL, *(10 * 4096).to_bytes(3, "little"))
    assert next_hpa(chip) == 990.0


@pytest.mark.parametrize("reset", [RESET_AZ, RESET_ARP, RESET_AZ | RESET_ARP])
def test_the_resets_clear_themselves(reset: int) -> None:
    chip = measuring(1000.0)
    chip.write(INTERRUPT_CFG, reset | LIR)
    assert chip.byte(INTERRUPT_CFG) == reset | LIR
    chip.wait(10 * PS_PER_US)
    assert chip.byte(INTERRUPT_CFG) == LIR


def test_swreset_ends_autozero() -> None:
    """The output is P - RPDS again; RPDS is not reset (datasheet 9.6)."""
    chip = measuring(1000.0)
    chip.write(RPDS_L, 32)
    chip.write(INTERRUPT_CFG, AUTOZERO)
    next_hpa(chip)
    chip.write(CTRL_REG2, 0x14)
    chip.write(CTRL_REG1, 0x20)
    assert next_hpa(chip) == 998.0
    assert ref_hpa(chip) == 0.0


@pytest.mark.parametrize("end", [(CTRL_REG2, 0x14), (INTERRUPT_CFG, RESET_ARP)])
def test_the_interrupt_compares_with_0_again_after_autorifp(end: tuple[int, int]) -> None:
    chip = measuring(1000.0)
    chip.write(INTERRUPT_CFG, AUTORIFP)
    next_hpa(chip)
    chip.write(*end)
    chip.write(REF_P_XL, *(1000 * 4096).to_bytes(3, "little"))
    chip.write(INTERRUPT_CFG, EITHER)
    chip.write(CTRL_REG1, 0x20)
    assert next_source(chip) == PH | IA


# -- interrupt ----------------------------------------------------------------------------------------------


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
def test_the_flags_follow_the_difference(enabled: int, expected: list[int]) -> None:
    """Datasheet 9.1, 9.2 and 9.15: +-THS_P in 1/16 hPa about the reference; exactly there is neither."""
    lsb = 1 / 4096
    chip = measuring(1000.0, 1002.0, 1002.0 + lsb, 998.0, 998.0 - lsb)
    threshold(chip, 2.0)
    chip.write(INTERRUPT_CFG, enabled | AUTORIFP)
    assert [next_source(chip) for _ in range(5)] == expected


@pytest.mark.parametrize("reference", [AUTOZERO, AUTORIFP])
def test_both_references_are_compared_with(reference: int) -> None:
    chip = measuring(1000.0, 1003.0)
    threshold(chip, 2.0)
    chip.write(RPDS_L, 0x00, 0x10)
    chip.write(INTERRUPT_CFG, EITHER | reference)
    assert [next_source(chip), next_source(chip)] == [0, PH | IA]


def test_without_a_reference_the_pressure_itself_is_compared() -> None:
    """Sensor facts 3.4: REF_P as written by firmware does not count."""
    chip = measuring(999.0, 1001.0)
    chip.write(REF_P_XL, *(900 * 4096).to_bytes(3, "little"))
    threshold(chip, 1000.0)
    chip.write(INTERRUPT_CFG, EITHER)
    assert [next_source(chip), next_source(chip)] == [0, PH | IA]


def test_a_latched_interrupt_waits_to_be_read() -> None:
    chip = measuring(1000.0, 1005.0, 995.0, 1000.0)
    threshold(chip, 2.0)
    chip.write(INTERRUPT_CFG, EITHER | LIR | AUTORIFP)
    chip.wait(10 * PERIOD_PS)
    assert chip.byte(INT_SOURCE) == PH | PL | IA
    assert chip.byte(INT_SOURCE) == 0
    assert next_source(chip) == 0


def test_a_latched_interrupt_comes_again_while_its_cause_lasts() -> None:
    chip = measuring(1000.0, 1005.0)
    threshold(chip, 2.0)
    chip.write(INTERRUPT_CFG, EITHER | LIR | AUTORIFP)
    next_source(chip)
    assert [next_source(chip), chip.byte(INT_SOURCE), next_source(chip)] == [PH | IA, 0, PH | IA]


def test_switching_the_comparison_off_ends_what_is_not_latched() -> None:
    for latch, left in ((0, 0), (LIR, PH | IA)):
        chip = measuring(1000.0)
        chip.write(INTERRUPT_CFG, DIFF_EN | PHE | latch)
        chip.wait(PERIOD_PS)
        chip.write(INTERRUPT_CFG, latch)
        assert chip.byte(INT_SOURCE) == left


def test_swreset_ends_a_latched_interrupt() -> None:
    chip = measuring(1000.0)
    chip.write(INTERRUPT_CFG, DIFF_EN | PHE | LIR)
    chip.wait(PERIOD_PS)
    chip.write(CTRL_REG2, 0x14)
    assert chip.byte(INT_SOURCE) == 0


# -- pin ----------------------------------------------------------------------------------------------------


class Wire:
    """What an interrupt controller sees of INT_DRDY: it is told when to look, as a board would."""

    def __init__(self, chip: Chip) -> None:
        self.chip = chip
        (self.pin,) = chip.part.pins()
        self.edges: list[tuple[float, int]] = []
        self.pin.listen(lambda at_ps, level: self.edges.append((at_ps / PERIOD_PS, level)))

    def run(self, periods: float) -> list[tuple[float, int]]:
        """The edges of so many sample periods, in periods."""
        end_ps = self.chip.t_ps + int(periods * PERIOD_PS)
        while self.chip.part.next_event_ps() <= end_ps:
            self.chip.part.catch_up(self.chip.part.next_event_ps())
        self.chip.t_ps = end_ps
        edges, self.edges = self.edges, []
        return edges


def test_data_ready_rises_with_a_sample_and_falls_with_press_out_h() -> None:
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
def test_polarity_and_open_drain(control3: int, idle: int | None, active: int | None) -> None:
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
def test_fifo_signals(signal: int, expected: list[tuple[float, int]]) -> None:
    """Datasheet 9.7."""
    chip = measuring(1000.0)
    wire = Wire(chip)
    chip.write(CTRL_REG3, signal)
    chip.write(CTRL_REG2, 0x50)
    chip.write(FIFO_CTRL, 0x45)
    assert wire.run(40) == expected
    chip.read(PRESS_OUT_XL, 160)
    assert wire.run(0) == [(40.0, 0)] * len(expected)


def test_the_watermark_falls_with_the_last_byte_of_a_level() -> None:
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
def test_interrupts_instead_of_data_signals(int_s: int, expected: list[tuple[float, int]]) -> None:
    """Datasheet Table 19; the data signals, enabled here too, are left out."""
    chip = measuring(1000.0, 1005.0, 1000.0, 995.0, 1000.0)
    wire = Wire(chip)
    threshold(chip, 2.0)
    chip.write(INTERRUPT_CFG, EITHER | AUTORIFP)
    chip.write(CTRL_REG3, 0x3C | int_s)
    assert wire.run(8) == expected


def test_reading_int_source_lets_the_pin_go() -> None:
    chip = measuring(1000.0, 1005.0, 1000.0)
    wire = Wire(chip)
    threshold(chip, 2.0)
    chip.write(INTERRUPT_CFG, EITHER | LIR | AUTORIFP)
    chip.write(CTRL_REG3, 0x03)
    assert wire.run(3.5) == [(2.0, 1)]
    assert chip.byte(INT_SOURCE) == PH | IA
    assert wire.run(1) == [(3.5, 0)]


def test_an_unwired_pin_asks_for_nothing() -> None:
    chip = measuring(1000.0)
    chip.write(CTRL_REG3, 0x04)
    assert chip.part.next_event_ps() > 10**6 * PS_PER_S
    wire = Wire(chip)
    assert chip.part.next_event_ps() == PERIOD_PS
    assert wire.run(2.5) == [(1.0, 1)]
    chip.write(CTRL_REG3, 0x00)
    assert chip.part.next_event_ps() > 10**6 * PS_PER_S
    assert wire.run(5) == [(2.5, 0)]


def test_an_edge_has_its_time_however_late_somebody_looks() -> None:
    chip = measuring(1000.0)
    wire = Wire(chip)
    chip.write(CTRL_REG3, 0x10)
    chip.write(CTRL_REG2, 0x50)
    chip.write(FIFO_CTRL, 0x47)
    chip.wait(25 * PERIOD_PS)
    assert chip.byte(FIFO_STATUS) == 0x80 | 25
    assert wire.edges == [(7.0, 1)]


def test_samples_before_a_change_of_the_world_are_in_the_fifo() -> None:
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
