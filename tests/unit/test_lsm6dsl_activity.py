"""Inactivity of the LSM6DSL and its change of rates (AN5040 5.6)."""

from __future__ import annotations

from fractions import Fraction

import pytest

from tests.support.motion_fakes import (
    CTRL1_XL,
    CTRL2_G,
    CTRL4_C,
    DRDY_PULSE_CFG,
    ENABLE,
    INT1_CTRL,
    INT2_CTRL,
    LIR,
    MD1_CFG,
    ON,
    RATE_HZ,
    STILL,
    TAP_CFG,
    TAP_SRC,
    TAP_THS_6D,
    WAKE_UP_DUR,
    WAKE_UP_SRC,
    WAKE_UP_THS,
    Bench,
    Sample,
    sample_ps,
)
from tests.support.notes import kinds, texts
from tests.support.sensor_fakes import PS_PER_MS, PS_PER_S, ramp, step
from tests.support.words import Words

SLEEP_STATE_IA = 0x10
THRESHOLD = (WAKE_UP_THS, 2)  # 62.5 mg at 2 g
INACT_XL_ONLY, INACT_G_SLEEPS, INACT_G_OFF = 0x20, 0x40, 0x60
OUT_XL, OUT_G, STATUS = 0x28, 0x22, 0x1E
SLOW_PS = 80 * PS_PER_MS  # 12.5 Hz
ASLEEP = 16  # the sample at which SLEEP_DUR = 0 is over
MOVING: tuple[Sample, ...] = ((300.0, 0.0, 0.0), (-300.0, 0.0, 0.0))


def woken_at(at_s: float) -> Bench:
    """Return a sensor that is at rest from power-up (slope 0), and from ``at_s`` moves far above the threshold."""
    bench = Bench([STILL])
    bench.world.signals["acceleration_g"] = step(
        ramp((0.0, 0.0, 0.0), (0.0, 0.0, 0.0)), ramp((0.5, 0.0, 0.0), (0.0, 0.0, 0.0)), at_s
    )
    return bench


def samples_seen(bench: Bench, register: int, flag: int, until_ps: int, step_ps: int) -> int:
    """Return the number of new samples that a reader finds if it reads every ``step_ps``."""
    found = 0
    while bench.t_ps < until_ps:
        bench.wait(step_ps)
        found += bool(bench.byte(STATUS) & flag)
        bench.read(register, 6)
    return found


@pytest.mark.parametrize(("code", "samples"), [(0, 16), (1, 512), (2, 1024), (15, 7680)])
def test_sleep_starts_after_configured_inactivity(code: int, samples: int) -> None:
    """The duration is 16/ODR, or 512/ODR per LSB, from the first sample at rest."""
    bench = Bench([STILL], THRESHOLD, (WAKE_UP_DUR, code), (TAP_CFG, ENABLE | INACT_XL_ONLY))

    assert bench.at(samples - 1).byte(WAKE_UP_SRC) & SLEEP_STATE_IA == 0
    assert bench.at(samples).byte(WAKE_UP_SRC) & SLEEP_STATE_IA


def test_motion_restarts_sleep_count() -> None:
    samples = [STILL] * 10 + [MOVING[0]] + [STILL] * 40
    bench = Bench(samples, THRESHOLD, (TAP_CFG, ENABLE | INACT_XL_ONLY))

    first_still = 12  # sample 10 and 11 have a slope
    assert bench.at(first_still + 15).byte(WAKE_UP_SRC) & SLEEP_STATE_IA == 0
    assert bench.at(first_still + 16).byte(WAKE_UP_SRC) & SLEEP_STATE_IA


def test_inactive_accelerometer_runs_at_12_5_hz() -> None:
    bench = Bench([STILL], THRESHOLD, (TAP_CFG, ENABLE | INACT_XL_ONLY)).at(ASLEEP)
    bench.read(OUT_XL, 6)

    assert samples_seen(bench, OUT_XL, 0x01, sample_ps(ASLEEP) + PS_PER_S, PS_PER_MS) == 12
    assert bench.byte(CTRL1_XL) == ON


@pytest.mark.parametrize(
    ("inact", "g_samples"), [(INACT_XL_ONLY, 104), (INACT_G_SLEEPS, 0), (INACT_G_OFF, 0)]
)
def test_inactive_gyroscope_follows_its_setting(inact: int, g_samples: int) -> None:
    bench = Bench([STILL], THRESHOLD, (CTRL2_G, 0x40), xl=0)
    bench.wait(PS_PER_S)  # its drive has started
    bench.configure(((CTRL1_XL, ON), (TAP_CFG, ENABLE | inact)))
    bench.wait(sample_ps(ASLEEP))
    bench.read(OUT_G, 6)
    bench.byte(STATUS)
    bench.read(OUT_G, 6)

    found = samples_seen(bench, OUT_G, 0x02, bench.t_ps + PS_PER_S, PS_PER_MS)

    assert abs(found - g_samples) <= 1
    assert (bench.byte(CTRL2_G), bench.byte(CTRL4_C)) == (0x40, 0x00)


def test_sample_over_threshold_wakes_sensor_immediately() -> None:
    bench = woken_at(0.2)
    bench.configure((THRESHOLD, (TAP_CFG, ENABLE | INACT_XL_ONLY)))
    awake_ps = sample_ps(ASLEEP) + 2 * SLOW_PS  # 40.9 ms + 160 ms: the first sample after 0.2 s

    bench.t_ps = awake_ps - 1
    assert bench.byte(WAKE_UP_SRC) & SLEEP_STATE_IA
    bench.wait(1)
    assert bench.byte(WAKE_UP_SRC) & SLEEP_STATE_IA == 0
    bench.read(OUT_XL, 6)
    assert samples_seen(bench, OUT_XL, 0x01, bench.t_ps + PS_PER_S // 100, PS_PER_MS // 10) == 4


def test_activity_pin_pulses_for_one_period_at_edges() -> None:
    bench = woken_at(0.2)
    bench.configure((THRESHOLD, (MD1_CFG, 0x80), (TAP_CFG, ENABLE | INACT_XL_ONLY)))
    bench.t_ps = PS_PER_S // 4

    asleep_ps = sample_ps(ASLEEP)
    awake_ps = asleep_ps + 2 * SLOW_PS
    assert bench.look()[:4] == [
        ("INT1", asleep_ps, 1),
        ("INT1", asleep_ps + SLOW_PS, 0),  # one period of the rate then in force
        ("INT1", awake_ps, 1),
        ("INT1", sample_ps(0, start_ps=awake_ps), 0),
    ]


def test_latched_activity_pin_stays_until_source_read() -> None:
    writes = THRESHOLD, (MD1_CFG, 0x80), (TAP_CFG, ENABLE | INACT_XL_ONLY | LIR)
    bench = Bench([STILL], *writes)
    bench.t_ps = PS_PER_S

    assert bench.byte(WAKE_UP_SRC) & SLEEP_STATE_IA
    assert bench.byte(WAKE_UP_SRC) & SLEEP_STATE_IA, "the state is not an event: it stays"
    assert bench.look() == [("INT1", sample_ps(ASLEEP), 1), ("INT1", PS_PER_S, 0)]


def test_tap_is_not_detected_while_inactive() -> None:
    bench = woken_at(0.2)
    tap = (TAP_THS_6D, 4), (TAP_CFG, ENABLE | INACT_XL_ONLY | 0x0E), (WAKE_UP_THS, 1)
    bench.configure(tap)
    bench.t_ps = sample_ps(ASLEEP) + 2 * SLOW_PS

    assert bench.byte(WAKE_UP_SRC) & SLEEP_STATE_IA == 0, "the tap has woken it"
    for _ in range(20):
        bench.wait(PS_PER_MS)
        assert bench.byte(TAP_SRC) == 0


@pytest.mark.parametrize("write", [(TAP_CFG, 0x00), (TAP_CFG, ENABLE), (CTRL1_XL, 0x00)])
def test_disabling_activity_restores_rate(write: tuple[int, int]) -> None:
    bench = Bench([STILL], THRESHOLD, (TAP_CFG, ENABLE | INACT_XL_ONLY))
    bench.t_ps = PS_PER_S
    assert bench.byte(WAKE_UP_SRC) & SLEEP_STATE_IA
    bench.write(*write)
    bench.configure(((TAP_CFG, 0x00), (CTRL1_XL, ON)))
    bench.read(OUT_XL, 6)

    assert bench.byte(WAKE_UP_SRC) == 0
    found = samples_seen(bench, OUT_XL, 0x01, bench.t_ps + PS_PER_S // 10, PS_PER_MS)
    assert abs(found - RATE_HZ // 10) <= 1


def test_data_ready_pin_shows_slow_rate() -> None:
    writes = THRESHOLD, (DRDY_PULSE_CFG, 0x80), (INT1_CTRL, 0x01), (TAP_CFG, ENABLE | INACT_XL_ONLY)
    bench = Bench([STILL], *writes)
    bench.t_ps = sample_ps(ASLEEP) + 3 * SLOW_PS

    rises = [at_ps for _, at_ps, level in bench.look() if level]
    fast = [sample_ps(number) for number in range(ASLEEP + 1)]
    assert rises == fast + [sample_ps(number, Fraction(25, 2), fast[-1]) for number in range(3)]


@pytest.mark.parametrize("step_ps", [PS_PER_MS // 3, 7 * PS_PER_MS, 250 * PS_PER_MS, PS_PER_S])
def test_activity_does_not_depend_on_reads(step_ps: int) -> None:
    bench = woken_at(0.2)
    routed = (MD1_CFG, 0xA0), (INT2_CTRL, 0x03), (DRDY_PULSE_CFG, 0x80)
    bench.configure((THRESHOLD, *routed, (CTRL2_G, 0x40), (TAP_CFG, ENABLE | INACT_G_SLEEPS)))
    alone = woken_at(0.2)
    alone.configure((THRESHOLD, *routed, (CTRL2_G, 0x40), (TAP_CFG, ENABLE | INACT_G_SLEEPS)))

    while bench.t_ps < PS_PER_S:
        bench.wait(min(step_ps, PS_PER_S - bench.t_ps))
        bench.read(OUT_G, 12)
        bench.byte(STATUS)
    alone.t_ps = PS_PER_S

    assert bench.look() == alone.look()
    assert bench.read(OUT_XL, 6) == alone.read(OUT_XL, 6)


def test_activity_at_6664_hz_is_noted(words: Words) -> None:
    """AN5040 5.6: at most 3.3 kHz is permitted."""
    bench = Bench([STILL], (TAP_CFG, ENABLE | INACT_XL_ONLY), xl=0x90)
    assert bench.notes == []

    bench.write(CTRL1_XL, 0xA0)
    assert kinds(bench.notes) == ["forbidden"]
    words("sensors", texts(bench.notes))
