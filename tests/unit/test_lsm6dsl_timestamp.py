"""The timestamp counter of the LSM6DSL (AN5040 Rev 3, 6.5; datasheet DocID028475 Rev 7, 9.57 to 9.59)."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from fcu_emulator.sensors.lsm6dsl import LSM6DSLErrors
from tests.support.sensor_fakes import PS_PER_MS, PS_PER_S, PS_PER_US, Chip

CTRL1_XL, CTRL2_G, CTRL3_C, CTRL4_C, CTRL10_C = 0x10, 0x11, 0x12, 0x13, 0x19
TIMESTAMP0_REG, TIMESTAMP2_REG, WAKE_UP_DUR, MD1_CFG = 0x40, 0x42, 0x5C, 0x5E
TIMER_EN, TIMER_HR, INT1_TIMER, RESTART = 0x20, 0x10, 0x01, 0xAA
SLOW_PS, FAST_PS = 6400 * PS_PER_US, 25 * PS_PER_US
resolutions = pytest.mark.parametrize(("wake_up_dur", "tick_ps"), [(0x00, SLOW_PS), (TIMER_HR, FAST_PS)])


def counting(wake_up_dur: int = TIMER_HR) -> Chip:
    """Return a sensor whose counter runs from 0 s."""
    chip = Chip("LSM6DSL")
    chip.configure(((WAKE_UP_DUR, wake_up_dur), (CTRL1_XL, 0x40), (CTRL10_C, TIMER_EN)))
    return chip


def count(chip: Chip) -> int:
    return int.from_bytes(chip.read(TIMESTAMP0_REG, 3), "little")


@resolutions
@given(ticks=st.integers(1, 2**24 - 1))
def test_tick_comes_exactly_when_it_is_due(wake_up_dur: int, tick_ps: int, ticks: int) -> None:
    chip = counting(wake_up_dur)
    chip.t_ps = ticks * tick_ps - 1
    assert count(chip) == ticks - 1
    chip.wait(1)
    assert count(chip) == ticks


@resolutions
@pytest.mark.parametrize("percent", [-5, 4])
def test_timestamp_follows_sensor_rate_error(wake_up_dur: int, tick_ps: int, percent: int) -> None:
    """The LSM6DSO has one figure for timestamp and rates. For the LSM6DSL no document gives a figure."""
    chip = Chip("LSM6DSL", LSM6DSLErrors(odr_percent=percent))
    chip.configure(((WAKE_UP_DUR, wake_up_dur), (CTRL1_XL, 0x40), (CTRL10_C, TIMER_EN)))
    chip.t_ps = -(-1000 * tick_ps * 100 // (100 + percent)) - 1
    assert count(chip) == 999
    chip.wait(1)
    assert count(chip) == 1000


def test_timer_warning_of_slow_sensor_follows_its_counter() -> None:
    chip = Chip("LSM6DSL", LSM6DSLErrors(odr_percent=-5))
    chip.configure(((MD1_CFG, INT1_TIMER), (WAKE_UP_DUR, TIMER_HR), (CTRL1_XL, 0x40), (CTRL10_C, TIMER_EN)))
    due_ps = -(-0xFF0000 * FAST_PS * 100 // 95)
    assert chip.part.next_event_ps() == due_ps
    chip.t_ps = due_ps
    assert count(chip) == 0xFF0000


@resolutions
def test_timestamp_wraps_at_24_bits(wake_up_dur: int, tick_ps: int) -> None:
    chip = counting(wake_up_dur)
    chip.t_ps = (2**24 + 5) * tick_ps

    assert count(chip) == 5


def test_timestamp_does_not_run_before_enable() -> None:
    chip = Chip("LSM6DSL")
    chip.write(CTRL1_XL, 0x40)
    chip.wait(PS_PER_S)

    assert count(chip) == 0


@pytest.mark.parametrize(
    ("xl", "g", "ctrl4", "runs"),
    [
        (0x40, 0x00, 0x00, True),
        (0x00, 0x40, 0x00, True),
        (0xB0, 0x00, 0x00, True),  # 1.6 or 12.5 Hz
        (0x00, 0x40, 0x40, True),  # a sleeping gyroscope is not in power-down
        (0x00, 0x00, 0x00, False),
        (0xC0, 0xB0, 0x00, False),  # reserved rates measure nothing
    ],
)
def test_timestamp_runs_while_sensor_is_on(xl: int, g: int, ctrl4: int, runs: bool) -> None:
    chip = Chip("LSM6DSL")
    chip.configure(((CTRL4_C, ctrl4), (WAKE_UP_DUR, TIMER_HR), (CTRL10_C, TIMER_EN)))
    chip.configure(((CTRL1_XL, xl), (CTRL2_G, g)))
    chip.wait(PS_PER_S)

    assert count(chip) == (40_000 if runs else 0)


def test_timestamp_stops_in_power_down_and_continues() -> None:
    chip = counting()
    chip.wait(PS_PER_S)
    chip.write(CTRL1_XL, 0x00)
    chip.wait(PS_PER_S)
    assert count(chip) == 40_000
    chip.write(CTRL1_XL, 0x40)
    chip.wait(PS_PER_S)

    assert count(chip) == 80_000


def test_disabled_timestamp_does_not_reset_its_count() -> None:
    chip = counting()
    chip.wait(PS_PER_S)
    chip.write(CTRL10_C, 0x00)
    chip.wait(PS_PER_S)

    assert count(chip) == 40_000


def test_resolution_change_continues_from_count() -> None:
    chip = counting()
    chip.wait(PS_PER_S)
    chip.write(WAKE_UP_DUR, 0x00)
    chip.wait(PS_PER_S)

    assert count(chip) == 40_000 + PS_PER_S // SLOW_PS


def test_writing_aa_restarts_timestamp() -> None:
    chip = counting()
    chip.wait(PS_PER_S)
    chip.write(TIMESTAMP2_REG, RESTART)
    assert count(chip) == 0
    chip.wait(PS_PER_S)

    assert count(chip) == 40_000


@given(value=st.integers(0, 0xFF).filter(lambda value: value != RESTART))
def test_writing_other_values_does_not_affect_timestamp(value: int) -> None:
    chip = counting()
    chip.wait(PS_PER_S)
    chip.write(TIMESTAMP2_REG, value)

    assert count(chip) == 40_000


def test_software_reset_clears_timestamp() -> None:
    chip = counting()
    chip.wait(PS_PER_S)
    chip.write(CTRL3_C, 0x01)
    chip.wait(PS_PER_S)

    assert count(chip) == 0


def test_other_writes_and_reads_do_not_affect_timestamp() -> None:
    chip = counting()
    for step in range(1, 100):
        chip.t_ps = step * 7 * PS_PER_MS + step
        chip.write(0x73, step)
        count(chip)

    assert count(chip) == chip.t_ps // FAST_PS


# -- INT1_TIMER -----------------------------------------------------------------------------------------


def watched(wake_up_dur: int) -> tuple[Chip, list[tuple[int, int]]]:
    chip = counting(wake_up_dur)
    edges: list[tuple[int, int]] = []
    chip.part.pins()[0].observe(lambda at_ps, level: edges.append((at_ps, level)))
    chip.write(MD1_CFG, INT1_TIMER)
    return chip, edges


@pytest.mark.parametrize(
    ("wake_up_dur", "first_ps"),
    [(0x00, 0xFFFF00 * SLOW_PS), (TIMER_HR, 0xFF0000 * FAST_PS)],
)
def test_int1_is_high_before_wrap_until_aa(wake_up_dur: int, first_ps: int) -> None:
    chip, edges = watched(wake_up_dur)
    assert chip.part.next_event_ps() == first_ps
    chip.t_ps = first_ps + 5 * PS_PER_S  # past the wrap, 1.6384 s later
    chip.part.catch_up(chip.t_ps)
    assert edges == [(first_ps, 1)]

    chip.write(TIMESTAMP2_REG, RESTART)

    assert edges == [(first_ps, 1), (chip.t_ps, 0)]
    assert chip.part.next_event_ps() == chip.t_ps + first_ps


def test_int1_falls_with_software_reset() -> None:
    chip, edges = watched(TIMER_HR)
    chip.t_ps = 0xFF0000 * FAST_PS
    chip.write(CTRL3_C, 0x01)

    assert [level for _, level in edges] == [1, 0]


def test_count_above_new_limit_warns_immediately() -> None:
    chip, edges = watched(0x00)
    chip.t_ps = 0xFF8000 * SLOW_PS
    chip.write(WAKE_UP_DUR, TIMER_HR)
    chip.part.catch_up(chip.t_ps)

    assert edges == [(chip.t_ps, 1)]
