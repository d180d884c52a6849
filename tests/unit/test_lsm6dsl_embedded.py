"""The LSM6DSL's embedded functions (datasheet DocID028475 Rev 7; application note AN5040 Rev 3, section 6).

ST does not publish the step algorithm. These tests check the behaviour that any valid algorithm must have with a
clear walk: a vertical bounce of 0.3 g, twice a second.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fcu_emulator.sensors.lsm6dsl import LSM6DSLErrors
from fcu_emulator.sensors.lsm6dsl.feature import FeatureContext as FeatureChip
from fcu_emulator.sensors.lsm6dsl.feature import Signals
from fcu_emulator.sensors.lsm6dsl.function_sources import STEP, TILT, WRIST_TILT, FunctionSources
from fcu_emulator.sensors.lsm6dsl.model import LSM6DSL
from fcu_emulator.sensors.pin import Pin
from fcu_emulator.sensors.register_file import RegisterFile
from fcu_emulator.sensors.sampling import SampleStream
from tests.support.notes import kinds, texts
from tests.support.sensor_fakes import PS_PER_MS, PS_PER_S, PS_PER_US, Array, Chip, Writes, constant
from tests.support.words import Words

FUNC_CFG_ACCESS, INT1_CTRL, INT2_CTRL, CTRL1_XL, CTRL3_C = 0x01, 0x0D, 0x0E, 0x10, 0x12
CTRL10_C, TIMESTAMP0, STEP_TIMESTAMP, STEP_COUNTER = 0x19, 0x40, 0x49, 0x4B
FUNC_SRC1, FUNC_SRC2, WRIST_TILT_IA, TAP_CFG, WAKE_UP_DUR, MD1_CFG = 0x53, 0x54, 0x55, 0x58, 0x5C, 0x5E
PEDO_THS, SM_THS, PEDO_DEB, STEP_COUNT_DELTA = 0x0F, 0x13, 0x14, 0x15
STEP_DELTA_IA, SIGN_MOTION_IA, TILT_IA, STEP_DETECTED, STEP_OVERFLOW = 0x80, 0x40, 0x20, 0x10, 0x08
FUNC_EN, PEDO_EN, TILT_EN, SIGN_MOTION_EN, WRIST_TILT_EN, TIMER_EN = 0x04, 0x10, 0x08, 0x01, 0x80, 0x20
XL_26_HZ = 0x20
BOUNCES_PER_S = 2


def bounce(count: int, at_s: float = 0.0, amplitude_g: float = 0.3) -> Callable[[Array], Array]:
    """Return the acceleration of a board at rest that bounces ``count`` times from ``at_s``."""

    def signal(t_s: Array) -> Array:
        walking = (t_s >= at_s) & (t_s < at_s + count / BOUNCES_PER_S)
        vertical = 1 + walking * amplitude_g * np.sin(2 * np.pi * BOUNCES_PER_S * (t_s - at_s))
        return np.column_stack((np.zeros_like(t_s), np.zeros_like(t_s), vertical))

    return signal


def turned(*times_and_angles: tuple[float, float]) -> Callable[[Array], Array]:
    """Return gravity in the Z-X plane, at an angle in degrees from each time in seconds."""

    def signal(t_s: Array) -> Array:
        angle = np.zeros_like(t_s)
        for at_s, degrees in times_and_angles:
            angle[t_s >= at_s] = math.radians(degrees)
        return np.column_stack((np.sin(angle), np.zeros_like(t_s), np.cos(angle)))

    return signal


def running(
    functions: int,
    signal: Callable[[Array], Array],
    xl: int = XL_26_HZ,
    bank_a: Writes = (),
    errors: LSM6DSLErrors | None = None,
) -> Chip:
    """Set up as in AN5040 6.1: bank A in power-down, the accelerometer, then the functions."""
    chip = Chip("LSM6DSL", errors)
    chip.world.signals["acceleration_g"] = signal
    if bank_a:
        chip.configure(((FUNC_CFG_ACCESS, 0x80), *bank_a, (FUNC_CFG_ACCESS, 0x00)))
    chip.configure(((CTRL1_XL, xl), (CTRL10_C, FUNC_EN | functions)))
    return chip


def steps(chip: Chip) -> int:
    return int.from_bytes(chip.read(STEP_COUNTER, 2), "little")


def events(
    chip: Chip, until_s: float, source: int = FUNC_SRC1, every_ps: int = 10 * PS_PER_MS
) -> list[float]:
    """Return the times in seconds at which a bit was newly set in a source register, polled every 10 ms."""
    found, before = [], 0
    while chip.t_ps < until_s * PS_PER_S:
        chip.wait(every_ps)
        now = chip.byte(source)
        if now & ~before:
            found.append(chip.t_ps / PS_PER_S)
        before = now
    return found


# -- pedometer ------------------------------------------------------------------------------------------


@pytest.mark.parametrize("bounces", [7, 8, 20, 120])
def test_every_bounce_is_step_after_debounce(bounces: int) -> None:
    chip = running(PEDO_EN, bounce(bounces, at_s=1.0))
    chip.wait((2 + bounces) * PS_PER_S)

    assert steps(chip) == bounces


def test_seventh_step_sets_counter_to_seven() -> None:
    """AN5040 6.1: with DEB_STEP = 6 counting starts at the seventh step."""
    chip = running(PEDO_EN, bounce(20))
    shown = []
    for _ in range(10):
        chip.wait(PS_PER_S // BOUNCES_PER_S)
        shown.append(steps(chip))

    assert shown == [0, 0, 0, 0, 0, 0, 7, 8, 9, 10]


@pytest.mark.parametrize(("deb_step", "counted"), [(0, 3), (2, 3), (3, 0), (7, 0)])
def test_counting_starts_after_number_of_debounce_steps(deb_step: int, counted: int) -> None:
    chip = running(PEDO_EN, bounce(3), bank_a=((PEDO_DEB, 0x68 | deb_step),))
    chip.wait(5 * PS_PER_S)

    assert steps(chip) == counted


@pytest.mark.parametrize(
    ("deb_time", "counted"),
    [(13, 8), (5, 0)],  # 1040 ms bridge the 500 ms between two steps, 400 ms do not
)
def test_pause_longer_than_debounce_time_restarts_debounce(deb_time: int, counted: int) -> None:
    """Datasheet 11.18: 80 ms per LSB. After a longer pause the debounce begins again."""
    chip = running(PEDO_EN, bounce(8), bank_a=((PEDO_DEB, deb_time << 3 | 6),))
    chip.wait(10 * PS_PER_S)

    assert steps(chip) == counted


def test_seven_more_steps_are_needed_after_pause() -> None:
    def signal(t_s: Array) -> Array:
        return np.where(t_s[:, np.newaxis] < 10, bounce(8)(t_s), bounce(7, at_s=12.0)(t_s))

    chip = running(PEDO_EN, signal)
    chip.wait(15 * PS_PER_S)
    assert steps(chip) == 8, "six of the second walk so far"
    chip.wait(3 * PS_PER_S)
    assert steps(chip) == 15


@pytest.mark.parametrize(
    ("threshold", "xl", "amplitude_g", "counted"),
    [
        (0x10, XL_26_HZ, 0.24, 0),  # 16 x 32 mg: a swing of 480 mg is too little
        (0x10, XL_26_HZ, 0.28, 10),
        (0x08, XL_26_HZ, 0.14, 10),
        (0x08, XL_26_HZ | 0x04, 0.14, 10),  # 32 mg whatever FS_XL says
        (0x88, XL_26_HZ | 0x08, 0.24, 0),  # PEDO_FS: 8 x 62.5 mg
        (0x88, XL_26_HZ | 0x08, 0.28, 10),
    ],
)
def test_pedometer_threshold_follows_its_register(
    threshold: int, xl: int, amplitude_g: float, counted: int
) -> None:
    """Datasheet 11.16: 32 mg or 62.5 mg per LSB."""
    chip = running(PEDO_EN, bounce(10, amplitude_g=amplitude_g), xl, ((PEDO_THS, threshold),))
    chip.wait(10 * PS_PER_S)

    assert steps(chip) == counted


@pytest.mark.parametrize("code", range(1, 12))
@pytest.mark.parametrize("percent", [0.0, -7.0, 7.0])
def test_all_rates_from_26_hz_count_equal_steps(code: int, percent: float, words: Words) -> None:
    """The rates have their nominal values; a sensor that is a little slow counts steps, too."""
    errors = LSM6DSLErrors(odr_percent=percent)
    chip = running(PEDO_EN, bounce(12), xl=code << 4, errors=errors)
    chip.wait(10 * PS_PER_S)

    assert steps(chip) == (12 if 2 <= code <= 10 else 0)
    assert kinds(chip.notes) == ([] if 2 <= code <= 10 else ["forbidden"])
    for _, text in chip.notes:
        words("sensors", text)


def test_step_counter_survives_disabling_and_clears_on_request() -> None:
    """AN5040 6.1: PEDO_RST_STEP keeps the counter at 0 until the bit is cleared."""
    chip = running(PEDO_EN, bounce(1000))
    chip.wait(10 * PS_PER_S)
    counted = steps(chip)
    assert counted == 20

    chip.write(CTRL10_C, 0x00)
    chip.wait(10 * PS_PER_S)
    chip.write(CTRL1_XL, 0x00)
    chip.wait(10 * PS_PER_S)
    assert steps(chip) == counted

    chip.configure(((CTRL1_XL, XL_26_HZ), (CTRL10_C, FUNC_EN | PEDO_EN | 0x02)))
    chip.wait(10 * PS_PER_S)
    assert (steps(chip), chip.byte(CTRL10_C) & 0x02) == (0, 0x02)
    chip.write(CTRL10_C, FUNC_EN | PEDO_EN)
    chip.wait(5 * PS_PER_S)
    assert steps(chip) == 10


@pytest.mark.parametrize("functions", [PEDO_EN, 0x00])
def test_nothing_counts_without_func_en_and_pedo_en(functions: int) -> None:
    chip = running(0x00, bounce(20))
    chip.write(CTRL10_C, functions)
    chip.wait(10 * PS_PER_S)

    assert steps(chip) == 0
    assert chip.byte(FUNC_SRC1) == 0


def test_soft_reset_clears_uncounted_steps() -> None:
    chip = running(PEDO_EN, bounce(20))
    chip.wait(10 * PS_PER_S)
    chip.write(CTRL3_C, 0x05)
    chip.wait(PS_PER_S)

    assert (steps(chip), chip.byte(FUNC_SRC1)) == (0, 0)


def test_step_counter_overflow_is_flagged() -> None:
    """The counter wraps after 65535. To avoid nine hours of walking, the test sets the counter."""
    chip = running(PEDO_EN, bounce(8), bank_a=((PEDO_DEB, 0x68),))
    chip.part.registers.mem[STEP_COUNTER : STEP_COUNTER + 2] = (65535 - 5).to_bytes(2, "little")
    seen, overflows = [], []
    for _ in range(100):
        chip.wait(50 * PS_PER_MS)
        seen.append(steps(chip))
        overflows.append(bool(chip.byte(FUNC_SRC1) & STEP_OVERFLOW))

    assert (max(seen), seen[-1]) == (65535, 2)
    assert sum(overflows) == 1
    assert seen[overflows.index(True)] == 0
    assert seen[overflows.index(True) - 1] == 65535


# -- source bits ----------------------------------------------------------------------------------------


def test_step_detected_lasts_one_period_of_26_hz() -> None:
    """AN5040 6.1, LIR = 0: reading does not clear the bit."""
    chip = running(PEDO_EN, bounce(20), bank_a=((PEDO_DEB, 0x68),))
    high = 0
    for _ in range(5000):
        chip.wait(PS_PER_MS)
        high += bool(chip.byte(FUNC_SRC1) & STEP_DETECTED)

    assert steps(chip) == 10
    assert 10 * 1000 / 26 - 10 <= high <= 10 * 1000 / 26 + 10


@pytest.mark.parametrize(("routed", "latched"), [(0x80, True), (0x00, False)])
def test_step_event_is_latched_only_if_routed(routed: int, latched: bool) -> None:
    """AN5040 6.1 and 5.1: LIR = 1 holds the signals that are routed to a pin."""
    chip = running(PEDO_EN, bounce(1), bank_a=((PEDO_DEB, 0x68),))
    chip.configure(((TAP_CFG, 0x01), (INT1_CTRL, routed)))
    chip.wait(5 * PS_PER_S)

    assert bool(chip.byte(FUNC_SRC1) & STEP_DETECTED) is latched
    assert chip.byte(FUNC_SRC1) == 0, "the first read has cleared it"


def test_event_is_pulse_or_latched_until_read() -> None:
    """The pulse is 150 us on the pin (AN5040 6.1). Latched, it lasts until the source register of the event is read."""
    registers = RegisterFile(LSM6DSL.MAP)
    signals, stream = Signals(), SampleStream(6, lambda number, t_s: bytes(6 * len(t_s)))
    chip = FeatureChip(
        registers, {}, stream, stream, stream, signals, Pin("INT1"), Pin("INT2"), lambda now_ps: None
    )
    sources = FunctionSources(chip)
    edges: list[tuple[bool, int]] = []
    signals.listen("TILT", lambda on, at_ps: edges.append((on, at_ps)))

    sources.happened(TILT, PS_PER_S)
    assert sources.next_event_ps() == PS_PER_S + 150 * PS_PER_US
    sources.catch_up(2 * PS_PER_S)
    assert edges == [(True, PS_PER_S), (False, PS_PER_S + 150 * PS_PER_US)]

    registers.mem[TAP_CFG], registers.mem[0x5F] = 0x01, 0x02
    sources.configure(2 * PS_PER_S)
    sources.happened(TILT, 3 * PS_PER_S)
    sources.happened(STEP, 3 * PS_PER_S)  # not routed
    registers.read(FUNC_SRC2, 1, 4 * PS_PER_S)
    assert signals["TILT"]
    registers.read(FUNC_SRC1, 1, 5 * PS_PER_S)
    assert edges[2:] == [(True, 3 * PS_PER_S), (False, 5 * PS_PER_S)]

    sources.happened(TILT, 6 * PS_PER_S)
    registers.mem[TAP_CFG] = 0x00
    sources.configure(7 * PS_PER_S)
    assert edges[4:] == [(True, 6 * PS_PER_S), (False, 7 * PS_PER_S)], "no longer latching"
    sources.happened(WRIST_TILT, 8 * PS_PER_S)
    sources.reset(8 * PS_PER_S)
    assert (signals["WRIST_TILT"], sources.active, registers.mem[FUNC_SRC2]) == (False, False, 0)


@pytest.mark.parametrize("every_event", [True, False])
def test_steps_and_tilts_share_pin(every_event: bool) -> None:
    """Pulses of 150 us on INT1 come in the order of time, with continuous reads or with one read at the end."""

    def signal(t_s: Array) -> Array:
        return bounce(10)(t_s)[:, 2:] * turned((1.3, 60.0), (3.6, 0.0))(t_s)

    chip = running(PEDO_EN | TILT_EN, signal, bank_a=((PEDO_DEB, 0x68),))
    chip.configure(((INT1_CTRL, 0x80), (MD1_CFG, 0x02)))
    edges: list[tuple[int, int]] = []
    chip.part.pins()[0].observe(lambda at_ps, level: edges.append((at_ps, level)))
    while every_event and (due_ps := chip.part.next_event_ps()) < 8 * PS_PER_S:
        chip.part.catch_up(due_ps)
    chip.part.catch_up(8 * PS_PER_S)
    times = [at_ps for at_ps, _ in edges]

    assert len(edges) == 2 * (10 + 2)
    assert times == sorted(times)
    assert {end - begin for begin, end in zip(times[::2], times[1::2], strict=True)} == {150 * PS_PER_US}


# -- timestamp and delta time ---------------------------------------------------------------------------


@pytest.mark.parametrize(("timer_hr", "tick_ps"), [(0x10, 25 * PS_PER_US), (0x00, 6400 * PS_PER_US)])
def test_step_timestamp_is_upper_part_of_step_time(timer_hr: int, tick_ps: int) -> None:
    """Datasheet 9.60: TIMESTAMP2 and TIMESTAMP1 at the last step, for any times of reads."""
    chip = running(PEDO_EN | TIMER_EN, bounce(1, at_s=5.0), bank_a=((PEDO_DEB, 0x68),))
    chip.write(WAKE_UP_DUR, timer_hr)
    chip.wait(60 * PS_PER_S)
    stamp = int.from_bytes(chip.read(STEP_TIMESTAMP, 2), "little")

    assert steps(chip) == 1
    assert stamp in {int(t_s * PS_PER_S / tick_ps) >> 8 for t_s in np.arange(5.2, 5.6, 0.001)}


def test_delta_time_reports_steps_within_that_time() -> None:
    """Datasheet 11.19: 1.6384 s per LSB."""
    chip = running(
        PEDO_EN | TIMER_EN, bounce(1, at_s=4.0), bank_a=((PEDO_DEB, 0x68), (STEP_COUNT_DELTA, 0x01))
    )
    found = []
    for _ in range(1000):
        chip.wait(10 * PS_PER_MS)
        if chip.byte(FUNC_SRC1) & STEP_DELTA_IA:
            found.append(chip.t_ps / PS_PER_S)

    assert found
    assert 3 * 1.6384 <= found[0] < 3 * 1.6384 + 0.01
    assert found[-1] <= 3 * 1.6384 + 1 / 26


def test_delta_time_needs_low_timer_resolution(words: Words) -> None:
    chip = running(PEDO_EN, bounce(100), bank_a=((PEDO_DEB, 0x68), (STEP_COUNT_DELTA, 0x01)))

    assert kinds(chip.notes) == ["forbidden"]
    words("sensors", texts(chip.notes))
    for _ in range(1000):
        chip.wait(10 * PS_PER_MS)
        assert not chip.byte(FUNC_SRC1) & STEP_DELTA_IA


# -- significant motion ---------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("threshold", "debounce", "steps_needed"),
    [(6, 6, 7), (10, 6, 11), (1, 6, 7), (1, 0, 2)],
)
def test_significant_motion_needs_more_steps_than_threshold(
    threshold: int, debounce: int, steps_needed: int
) -> None:
    """AN5040 6.2: more than SM_THS steps, and at least as many as the debounce needs."""
    chip = running(
        SIGN_MOTION_EN, bounce(steps_needed + 5), bank_a=((SM_THS, threshold), (PEDO_DEB, 0x68 | debounce))
    )
    (first, *_) = events(chip, 12.0)

    assert steps_needed - 1 < first * BOUNCES_PER_S <= steps_needed
    assert steps(chip) == 0, "the pedometer is off"


def test_significant_motion_restarts_after_each_event() -> None:
    chip = running(SIGN_MOTION_EN | PEDO_EN, bounce(28))
    seen, before = [], 0
    while chip.t_ps < 20 * PS_PER_S:
        chip.wait(10 * PS_PER_MS)
        now = chip.byte(FUNC_SRC1) & SIGN_MOTION_IA
        if now and not before:
            seen.append(steps(chip))
        before = now

    assert seen == [7, 14, 21, 28]


# -- tilt -----------------------------------------------------------------------------------------------


def test_first_tilt_waits_two_seconds() -> None:
    """AN5040 6.3: more than 35 degrees from the position at the previous event."""
    chip = running(TILT_EN, turned((5.0, 40.0), (10.0, 60.0), (12.0, 80.0), (15.0, 0.0)))

    assert events(chip, 20.0) == [
        pytest.approx(7.0, abs=0.1),  # 2 s after the turn
        pytest.approx(12.0, abs=0.06),  # 60 degrees were only 20 from 40
        pytest.approx(15.0, abs=0.06),
    ]


@pytest.mark.parametrize(("degrees", "count"), [(34.0, 0), (36.0, 1)])
def test_tilt_needs_more_than_35_degrees(degrees: float, count: int) -> None:
    chip = running(TILT_EN, turned((1.0, degrees)))

    assert len(events(chip, 5.0)) == count


def test_short_turn_is_not_first_tilt() -> None:
    chip = running(TILT_EN, turned((1.0, 60.0), (2.5, 0.0), (3.0, 60.0), (4.5, 0.0)))

    assert events(chip, 10.0) == []


def test_tilt_restarts_when_enabled_again() -> None:
    chip = running(TILT_EN, turned((1.0, 60.0), (10.0, 0.0)))
    chip.wait(5 * PS_PER_S)
    chip.write(CTRL10_C, 0x00)
    chip.write(CTRL10_C, FUNC_EN | TILT_EN)

    assert events(chip, 15.0) == [pytest.approx(12.0, abs=0.1)]


def test_free_fall_causes_no_tilt_event() -> None:
    chip = running(TILT_EN, constant(0.0, 0.0, 0.0))

    assert events(chip, 5.0) == []


# -- absolute wrist tilt --------------------------------------------------------------------------------


def test_wrist_tilt_with_reset_values_detects_new_positions() -> None:
    """Bank B, datasheet Table 224: 600 ms, 500 mg, X in both directions; one event for each new position."""
    chip = running(WRIST_TILT_EN, turned((1.0, 29.0), (3.0, 31.0), (5.0, -31.0), (5.4, 0.0), (6.0, -90.0)))

    assert events(chip, 10.0, FUNC_SRC2) == [
        pytest.approx(3.6, abs=0.1),
        pytest.approx(6.6, abs=0.1),  # the one at 5 s was too short
    ]


def test_wrist_tilt_reports_axis_and_direction() -> None:
    chip = running(WRIST_TILT_EN, turned((1.0, -90.0)))
    chip.write(TAP_CFG, 0x01)
    chip.write(0x0B, 0x01)  # INT2_WRIST_TILT: routed, so it latches
    chip.wait(5 * PS_PER_S)

    assert chip.byte(WRIST_TILT_IA) == 0x40
    assert chip.byte(FUNC_SRC1) == 0
    assert chip.byte(FUNC_SRC2) == 0x01
    assert (chip.byte(FUNC_SRC2), chip.byte(WRIST_TILT_IA)) == (0, 0)


def test_settings_of_bank_b_change_wrist_tilt() -> None:
    """40 ms and 15.625 mg per LSB; only the directions of the mask are detected."""
    chip = running(WRIST_TILT_EN, turned((2.0, 18.0), (4.0, -40.0)))
    chip.configure(((FUNC_CFG_ACCESS, 0xA0), (0x50, 0x05), (0x54, 0x10), (0x59, 0x80), (FUNC_CFG_ACCESS, 0)))

    assert events(chip, 6.0, FUNC_SRC2) == [pytest.approx(2.2, abs=0.1)]
    assert chip.notes == []


def test_bank_b_resets_when_accelerometer_leaves_power_down() -> None:
    """AN5040 6.4."""
    chip = running(WRIST_TILT_EN, turned((2.0, 18.0)))
    for ctrl1, kept in ((0x30, True), (0x00, True), (0x20, False)):
        chip.configure(((FUNC_CFG_ACCESS, 0xA0), (0x50, 0x05), (0x54, 0x10), (0x59, 0x80)))
        chip.write(FUNC_CFG_ACCESS, 0x00)
        chip.write(CTRL1_XL, ctrl1)
        chip.write(FUNC_CFG_ACCESS, 0xA0)
        found = chip.byte(0x50), chip.byte(0x54), chip.byte(0x59)
        chip.write(FUNC_CFG_ACCESS, 0x00)
        assert found == ((0x05, 0x10, 0x80) if kept else (0x0F, 0x20, 0xC0))


# -- impossible settings --------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("functions", "bank_a"),
    [
        (PEDO_EN, ((PEDO_THS, 0x90),)),
        (PEDO_EN, ((PEDO_DEB, 0x06),)),
    ],
)
def test_impossible_setting_is_noted_once(functions: int, bank_a: Writes, words: Words) -> None:
    chip = running(functions, bounce(3), bank_a=bank_a)
    chip.write(TAP_CFG, 0x01)
    chip.write(CTRL10_C, FUNC_EN | functions | SIGN_MOTION_EN)

    assert kinds(chip.notes) == ["forbidden"]
    words("sensors", texts(chip.notes))


def test_wrist_tilt_threshold_above_90_degrees_is_noted(words: Words) -> None:
    chip = running(WRIST_TILT_EN, turned((0.0, 90.0)))
    chip.configure(((FUNC_CFG_ACCESS, 0xA0), (0x54, 0x41), (FUNC_CFG_ACCESS, 0)))

    assert kinds(chip.notes) == ["forbidden"]
    words("sensors", texts(chip.notes))
    assert events(chip, 3.0, FUNC_SRC2) == []


def test_bank_a_write_outside_power_down_is_noted(words: Words) -> None:
    """AN5040 section 6. The write is noted and takes effect."""
    chip = running(PEDO_EN, bounce(3))
    chip.configure(((FUNC_CFG_ACCESS, 0x80), (PEDO_DEB, 0x68), (FUNC_CFG_ACCESS, 0x00)))
    chip.wait(3 * PS_PER_S)

    assert kinds(chip.notes) == ["forbidden"]
    words("sensors", texts(chip.notes))
    assert steps(chip) == 3


# -- laziness -------------------------------------------------------------------------------------------


@settings(max_examples=40)
@given(moments=st.lists(st.integers(0, 15 * PS_PER_S), max_size=15))
def test_embedded_functions_do_not_depend_on_reads(moments: list[int]) -> None:
    """All functions are on during a walk with turns. Registers are read at any times or only at the end."""

    def signal(t_s: Array) -> Array:
        return bounce(25, at_s=1.0)(t_s)[:, 2:] * turned((3.0, 50.0), (9.0, 0.0), (14.9, 40.0))(t_s)

    everything = PEDO_EN | TILT_EN | SIGN_MOTION_EN | WRIST_TILT_EN | TIMER_EN
    often, once = (running(everything, signal, 0x50, ((PEDO_DEB, 0x6A),)) for _ in range(2))
    for t_ps in sorted(moments):
        often.t_ps = t_ps
        often.read(0x28, 6)
        often.read(TIMESTAMP0, 0x20)
        often.part.catch_up(t_ps)
    often.t_ps = once.t_ps = 15 * PS_PER_S

    assert often.read(STEP_TIMESTAMP, 13) == once.read(STEP_TIMESTAMP, 13)
    assert steps(once) == 25


def test_disabled_functions_schedule_no_events() -> None:
    chip = Chip("LSM6DSL")
    chip.write(CTRL1_XL, XL_26_HZ)
    off = chip.part.next_event_ps()
    chip.write(CTRL10_C, FUNC_EN | PEDO_EN)

    assert chip.part.next_event_ps() <= PS_PER_S / 26 + 1 < off
