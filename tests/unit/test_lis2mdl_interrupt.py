"""The LIS2MDL's threshold interrupt and its INT/DRDY pin (datasheet 8.7 to 8.12; AN5069 6.3 and 10)."""

from __future__ import annotations

import numpy as np
import pytest

from sensors import LIS2MDL
from sensors.lis2mdl import LIS2MDLErrors
from sensors.sampling import NEVER_PS
from tests.sensor_fakes import MAGNETOMETER, PS_PER_MS, PS_PER_S, Array, Chip, constant

OFFSET_X_REG_L, CFG_REG_A, CFG_REG_B, CFG_REG_C = 0x45, 0x60, 0x61, 0x62
INT_CRTL_REG, INT_SOURCE_REG, INT_THS_L_REG, OUTX_H_REG = 0x63, 0x64, 0x65, 0x69
XYZ, IEA, IEL, IEN = 0xE0, 0x04, 0x02, 0x01
INT_ON_PIN, FOURWSPI, DRDY_ON_PIN = 0x40, 0x04, 0x01
PERIOD_PS = 10 * PS_PER_MS


def played(*samples: tuple[float, float, float]) -> Chip:
    """The first samples at 100 Hz are these counts, the last one for ever."""
    chip = Chip("LIS2MDL")
    rows = 1.5 * np.array(samples)

    def field(t_s: Array) -> Array:
        number = np.rint((t_s - MAGNETOMETER.sample_ps(0) / PS_PER_S) * 100).astype(int)
        return rows[number.clip(0, len(rows) - 1)]

    chip.world.signals["magnetic_field_mgauss"] = field
    return chip


def x_counts(*counts: float) -> Chip:
    """Likewise, on X alone."""
    return played(*((count, 0.0, 0.0) for count in counts))


def threshold(chip: Chip, counts: int, control: int) -> None:
    """100 Hz from now on, the interrupt as ``control`` says."""
    chip.write(INT_THS_L_REG, *counts.to_bytes(2, "little"))
    chip.write(INT_CRTL_REG, control)
    chip.write(CFG_REG_A, 0x8C)


def sources(chip: Chip, samples: int) -> list[int]:
    """INT_SOURCE_REG, read once after each of the first samples."""
    found = []
    for number in range(samples):
        chip.t_ps = MAGNETOMETER.sample_ps(number)
        found.append(chip.byte(INT_SOURCE_REG))
    return found


def watched(chip: Chip, control: int) -> list[tuple[int, int]]:
    """The pin's edges as they are reported, CFG_REG_C being ``control``."""
    edges: list[tuple[int, int]] = []
    chip.part.pins()[0].listen(lambda at_ps, level: edges.append((at_ps, level)))
    chip.write(CFG_REG_C, control)
    return edges


def at(number: int) -> int:
    """When sample ``number`` comes."""
    return MAGNETOMETER.sample_ps(number)


# -- INT_SOURCE_REG -------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("field", "expected"),
    [
        ((101, 0, 0), 0x80),
        ((0, 101, 0), 0x40),
        ((0, 0, 101), 0x20),
        ((-101, 0, 0), 0x10),
        ((0, -101, 0), 0x08),
        ((0, 0, -101), 0x04),
        ((101, -101, 101), 0x80 | 0x08 | 0x20),
        ((100, -100, 0), 0x00),
    ],
)
def test_each_axis_is_compared_both_ways(field: tuple[float, float, float], expected: int) -> None:
    """Datasheet T36: over the positive threshold, under the negative one; INT (bit 0) with any."""
    chip = played(field)
    threshold(chip, 100, XYZ | IEA | IEN)

    assert sources(chip, 1) == [expected | (expected != 0)]


def test_axes_that_are_not_enabled_are_not_compared() -> None:
    chip = played((200, 200, 200))
    threshold(chip, 100, 0x40 | IEA | IEN)

    assert sources(chip, 1) == [0x41]


def test_without_latch_the_register_follows_the_latest_sample() -> None:
    chip = x_counts(0, 200, 200, 0, -200)
    threshold(chip, 100, XYZ | IEA | IEN)

    assert sources(chip, 5) == [0x00, 0x81, 0x81, 0x00, 0x11]


def test_a_latched_crossing_stays_until_the_register_is_read() -> None:
    """AN5069 10: reading clears all bits of the register."""
    chip = x_counts(0, 200, -200, 0, 0)
    threshold(chip, 100, XYZ | IEA | IEL | IEN)

    chip.t_ps = at(4)
    assert [chip.byte(INT_SOURCE_REG), chip.byte(INT_SOURCE_REG)] == [0x80 | 0x10 | 0x01, 0x00]


def test_a_latched_interrupt_that_was_read_comes_again_with_the_next_sample() -> None:
    chip = x_counts(200)
    threshold(chip, 100, XYZ | IEA | IEL | IEN)

    chip.t_ps = at(0)
    assert [chip.byte(INT_SOURCE_REG), chip.byte(INT_SOURCE_REG)] == [0x81, 0x00]
    chip.t_ps = at(1)
    assert chip.byte(INT_SOURCE_REG) == 0x81


def test_with_iea_0_bit_int_is_0_while_it_signals() -> None:
    """Datasheet T35; sensor facts 2.5."""
    chip = x_counts(0, 200)
    threshold(chip, 100, XYZ | IEN)

    assert sources(chip, 2) == [0x01, 0x80]


@pytest.mark.parametrize("idle_level", [0, 1])
def test_bit_int_of_a_generator_that_is_off_is_a_setting(idle_level: int) -> None:
    """No document gives the value with IEN = 0 and IEA = 0; with IEA = 1 it is 0."""
    still = constant(0.0, 0.0, 0.0), constant(25.0)
    part = LIS2MDL(*still, int_idle_level=1 if idle_level else 0)

    assert part.read(INT_SOURCE_REG, 1, 0)[0] == idle_level
    part.write(INT_CRTL_REG, bytes([XYZ | IEA]), 0)
    assert part.read(INT_SOURCE_REG, 1, 0)[0] == 0


@pytest.mark.parametrize(
    ("after_offset", "expected"),
    [
        (0x00, 0x81),  # 300 measured
        (0x08, 0x00),  # 300 - 250 in the output
    ],
)
def test_the_hard_iron_offset_counts_with_int_on_dataoff_only(after_offset: int, expected: int) -> None:
    """Datasheet T28."""
    chip = x_counts(300)
    chip.write(OFFSET_X_REG_L, 250, 0)
    chip.write(CFG_REG_B, after_offset)
    threshold(chip, 100, XYZ | IEA | IEN)

    assert sources(chip, 1) == [expected]
    assert chip.counts(MAGNETOMETER) == (50, 0, 0)


@pytest.mark.parametrize(
    ("counts", "field", "expected"),
    [
        (0x7FFF, -32768, 0x11),
        (0x7FFF, 32767, 0x00),
        (0x8000, -32768, 0x00),
        (0xFFFF, 32767, 0x00),  # unsigned: not -1
        (0x0000, 1, 0x81),
        (0x0000, 0, 0x00),
    ],
)
def test_the_threshold_is_an_unsigned_number_of_16_bits(counts: int, field: int, expected: int) -> None:
    """Datasheet T38 shows TH15 to TH0."""
    chip = x_counts(field)
    threshold(chip, counts, XYZ | IEA | IEN)

    assert sources(chip, 1) == [expected]


@pytest.mark.parametrize("latch", [0, IEL])
def test_a_range_overflow_is_kept_until_it_is_read(latch: int) -> None:
    """MROI is latched in either mode; the crossing itself only with IEL."""
    chip = x_counts(0, 40000, 0, 0)
    threshold(chip, 100, XYZ | IEA | latch | IEN)

    chip.t_ps = at(2)
    assert chip.byte(INT_SOURCE_REG) == (0x83 if latch else 0x02)
    assert chip.byte(INT_SOURCE_REG) == 0x00
    chip.t_ps = at(3)
    assert chip.byte(INT_SOURCE_REG) == 0x00


def test_full_scale_itself_is_no_overflow() -> None:
    chip = played((32767, -32768, 0))
    threshold(chip, 0xFFFF, XYZ | IEA | IEN)

    assert sources(chip, 1) == [0x00]


def test_overflow_needs_ien() -> None:
    """AN5069 10.2; the datasheet calls it always enabled."""
    chip = x_counts(40000)
    threshold(chip, 100, XYZ | IEA)

    assert sources(chip, 1) == [0x00]


def test_samples_before_ien_are_not_compared() -> None:
    chip = x_counts(200, 200, 0)
    threshold(chip, 100, XYZ | IEA | IEL)
    chip.t_ps = at(1)
    chip.write(INT_CRTL_REG, XYZ | IEA | IEL | IEN)

    assert chip.byte(INT_SOURCE_REG) == 0x00
    chip.t_ps = at(5)
    assert chip.byte(INT_SOURCE_REG) == 0x00


def test_switching_the_generator_off_clears_the_register() -> None:
    chip = x_counts(200, 0)
    threshold(chip, 100, XYZ | IEA | IEL | IEN)
    chip.t_ps = at(0)
    chip.write(INT_CRTL_REG, XYZ | IEA | IEL)
    assert chip.byte(INT_SOURCE_REG) == 0x00
    chip.t_ps = at(1)
    chip.write(INT_CRTL_REG, XYZ | IEA | IEL | IEN)

    assert chip.byte(INT_SOURCE_REG) == 0x00


def test_a_new_threshold_acts_from_the_next_sample_on() -> None:
    chip = x_counts(200)
    threshold(chip, 100, XYZ | IEA | IEN)
    chip.t_ps = at(3)
    chip.write(INT_THS_L_REG, 0x2C, 0x01)  # 300

    assert chip.byte(INT_SOURCE_REG) == 0x81
    chip.t_ps = at(4)
    assert chip.byte(INT_SOURCE_REG) == 0x00


@pytest.mark.parametrize("single", [False, True])
def test_what_is_compared_has_the_noise_of_the_output(single: bool) -> None:
    """Also after runs in which nobody looked at the interrupt: X is over 0 exactly when its output is."""
    chip = Chip("LIS2MDL", LIS2MDLErrors(noise_mgauss=30.0), seed=2)
    chip.set("magnetic_field_mgauss", 0.0, 0.0, 0.0)
    for _ in range(3):
        chip.write(CFG_REG_A, 0x8C)
        chip.wait(7 * PERIOD_PS)
        chip.write(CFG_REG_A, 0x8F)
    threshold(chip, 0, 0x80 | IEA | IEN)
    found = []
    for _ in range(50):
        if single:
            chip.write(CFG_REG_A, 0x81)
        chip.wait(PERIOD_PS)
        x = chip.counts(MAGNETOMETER)[0]
        found.append(chip.byte(INT_SOURCE_REG) == (0x81 if x > 0 else 0x11 if x < 0 else 0x00))

    assert all(found)


def test_a_single_measurement_is_compared_too() -> None:
    chip = x_counts(200)
    threshold(chip, 100, XYZ | IEA | IEL | IEN)
    chip.write(CFG_REG_A, 0x83)
    chip.write(CFG_REG_A, 0x81)

    chip.t_ps = at(0) - 1
    assert chip.byte(INT_SOURCE_REG) == 0x00
    chip.t_ps = at(0)
    assert chip.byte(INT_SOURCE_REG) == 0x81


def test_soft_reset_clears_a_latched_interrupt() -> None:
    chip = x_counts(200)
    threshold(chip, 100, XYZ | IEA | IEL | IEN)
    edges = watched(chip, INT_ON_PIN)
    chip.t_ps = at(0) + 1

    chip.write(CFG_REG_A, 0x20)

    assert chip.byte(INT_SOURCE_REG) == 0x00
    assert chip.part.pins()[0].level is None
    assert edges == [(0, 0), (at(0), 1)]


def test_the_field_of_a_moment_is_compared_though_the_world_has_changed_since() -> None:
    chip = x_counts(200)
    threshold(chip, 100, XYZ | IEA | IEL | IEN)
    chip.t_ps = at(3)
    chip.part.world_changed(chip.t_ps)
    chip.set("magnetic_field_mgauss", 0.0, 0.0, 0.0)

    assert chip.byte(INT_SOURCE_REG) == 0x81
    chip.t_ps = at(4)
    assert chip.byte(INT_SOURCE_REG) == 0x00


# -- the pin --------------------------------------------------------------------------------------------


def test_the_pin_is_high_impedance_unless_something_is_put_on_it() -> None:
    chip = x_counts(200)
    threshold(chip, 100, XYZ | IEA | IEN)
    edges = watched(chip, 0x00)

    chip.t_ps = at(9)
    chip.part.catch_up(chip.t_ps)

    (pin,) = chip.part.pins()
    assert (pin.name, pin.level, edges) == ("INT/DRDY", None, [])
    assert chip.part.next_event_ps() == NEVER_PS


@pytest.mark.parametrize(("polarity", "active"), [(IEA, 1), (0, 0)])
def test_int_follows_the_comparison_with_the_time_of_the_sample(polarity: int, active: int) -> None:
    """Edges are exact although nobody looks before the tenth sample."""
    chip = x_counts(0, 0, 200, 200, 0, -200, 0)
    threshold(chip, 100, XYZ | polarity | IEN)
    edges = watched(chip, INT_ON_PIN)

    chip.t_ps = at(10)
    chip.part.catch_up(chip.t_ps)

    idle = 1 - active
    assert edges == [(0, idle), (at(2), active), (at(4), idle), (at(5), active), (at(6), idle)]


@pytest.mark.parametrize(("polarity", "active"), [(IEA, 1), (0, 0)])
def test_a_latched_int_ends_when_the_register_is_read(polarity: int, active: int) -> None:
    chip = x_counts(0, 200, 0)
    threshold(chip, 100, XYZ | polarity | IEL | IEN)
    edges = watched(chip, INT_ON_PIN)
    chip.t_ps = read_ps = at(7) + 12345
    chip.byte(INT_SOURCE_REG)

    assert edges == [(0, 1 - active), (at(1), active), (read_ps, 1 - active)]


def test_a_latched_int_stays_though_every_sample_is_looked_at_when_it_comes() -> None:
    chip = x_counts(0, 200, 0, 0)
    threshold(chip, 100, XYZ | IEA | IEL | IEN)
    edges = watched(chip, INT_ON_PIN)
    for number in range(4):
        chip.part.catch_up(at(number))

    assert edges == [(0, 0), (at(1), 1)]


def test_data_ready_rises_with_the_sample_and_falls_when_a_high_byte_is_read() -> None:
    """AN5069 6.3: it stays high while nobody reads."""
    chip = x_counts(1, 2, 3)
    chip.write(CFG_REG_A, 0x8C)
    edges = watched(chip, DRDY_ON_PIN)

    chip.t_ps = at(2) + 500
    chip.read(0x68)
    chip.read(OUTX_H_REG)
    chip.t_ps = at(5)
    chip.counts(MAGNETOMETER)

    assert edges == [(0, 0), (at(0), 1), (at(2) + 500, 0), (at(3), 1), (at(5), 0)]


def test_data_ready_of_a_single_measurement() -> None:
    chip = x_counts(1)
    edges = watched(chip, DRDY_ON_PIN)
    chip.write(CFG_REG_A, 0x81)

    assert chip.part.next_event_ps() == at(0)
    chip.t_ps = at(30)
    chip.part.catch_up(chip.t_ps)

    assert edges == [(0, 0), (at(0), 1)]
    assert chip.part.next_event_ps() == NEVER_PS


def test_data_ready_that_is_there_already_shows_when_the_pin_is_switched_on() -> None:
    chip = x_counts(1)
    chip.write(CFG_REG_A, 0x8C)
    chip.t_ps = at(0) + 1

    assert watched(chip, DRDY_ON_PIN) == [(at(0) + 1, 1)]


def test_int_goes_before_data_ready() -> None:
    """Datasheet T29: with both bits set the pin shows INT."""
    chip = x_counts(0, 200)
    threshold(chip, 100, XYZ | IEA | IEN)
    edges = watched(chip, INT_ON_PIN | DRDY_ON_PIN)

    chip.t_ps = at(3)
    chip.part.catch_up(chip.t_ps)
    chip.counts(MAGNETOMETER)

    assert edges == [(0, 0), (at(1), 1)]


def test_in_4_wire_spi_the_pin_is_sdo() -> None:
    chip = x_counts(200)
    threshold(chip, 100, XYZ | IEA | IEN)
    edges = watched(chip, FOURWSPI | INT_ON_PIN)

    chip.t_ps = at(1)
    chip.part.catch_up(chip.t_ps)

    assert (chip.part.pins()[0].level, edges) == (None, [])
    assert chip.notes == [("forbidden", "CFG_REG_C: INT/DRDY is SDO while 4WSPI = 1")]


def test_catching_up_at_each_event_gives_every_edge_in_time() -> None:
    """What a board does that has something wired to the pin."""
    chip = x_counts(0, 200, 0, 200, 0)
    threshold(chip, 100, XYZ | IEA | IEN)
    edges = watched(chip, INT_ON_PIN)
    seen_at = []
    for number in range(6):
        due_ps = chip.part.next_event_ps()
        assert due_ps == at(number)
        chip.part.catch_up(due_ps)
        if len(edges) > len(seen_at) + 1:
            seen_at.append(due_ps)

    assert edges == [(0, 0), (at(1), 1), (at(2), 0), (at(3), 1), (at(4), 0)]
    assert seen_at == [at(1), at(2), at(3), at(4)]


def test_a_pin_that_hangs_in_the_air_asks_for_nothing() -> None:
    chip = x_counts(200)
    threshold(chip, 100, XYZ | IEA | IEN)
    chip.write(CFG_REG_C, INT_ON_PIN)

    assert chip.part.next_event_ps() == NEVER_PS


def test_a_wired_pin_of_a_generator_that_is_off_asks_for_nothing() -> None:
    chip = x_counts(200)
    threshold(chip, 100, XYZ | IEA)
    watched(chip, INT_ON_PIN)

    assert chip.part.next_event_ps() == NEVER_PS
