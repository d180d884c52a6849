"""Input of the LSM6DSL's event functions: samples before LPF2 (AN5040 3.7; datasheet figure 8)."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import signal

from tests.support.motion_fakes import (
    CTRL8_XL,
    D6D_SRC,
    ENABLE,
    FREE_FALL,
    STILL,
    TAP_CFG,
    TAP_SRC,
    TAP_THS_6D,
    WAKE_UP_SRC,
    WAKE_UP_THS,
    Bench,
    Sample,
    played,
    source_bits,
)
from tests.support.sensor_fakes import Array, step

CTRL6_C, X_OFS_USR, OUT_XL = 0x15, 0x73, 0x28
LPF2_ODR_400, SLOPE, HIGH_PASS, INPUT_COMPOSITE, LOW_PASS_ON_6D = 0xE0, 0x04, 0x44, 0x08, 0x01
FLAT: Sample = (0.0, 0.0, 1000.0)
ON_X: Sample = (1000.0, 0.0, 0.0)
MOVING: list[Sample] = [FLAT] * 5 + [ON_X] + [FLAT] * 8 + [STILL] * 6 + [ON_X] * 10
EVERYTHING = ((WAKE_UP_THS, 8), (FREE_FALL, 2 << 3 | 3), (TAP_THS_6D, 0x44), (TAP_CFG, 0x0E))


def low_passed(samples: list[Sample], cutoff: float) -> Array:
    """Apply a second-order Butterworth, settled on the first sample, to (n, 3); ``cutoff`` over the sample rate."""
    b, a = signal.butter(2, 2 * cutoff)
    values = np.array(samples)
    passed: Array = signal.lfilter(b, a, values, axis=0, zi=np.outer(signal.lfilter_zi(b, a), values[0]))[0]
    return passed


@pytest.mark.parametrize("ctrl8", [LPF2_ODR_400, SLOPE, HIGH_PASS])
@pytest.mark.parametrize("register", [WAKE_UP_SRC, TAP_SRC, D6D_SRC])
def test_composite_filter_does_not_change_events(ctrl8: int, register: int) -> None:
    plain = source_bits(register, MOVING, *EVERYTHING)

    assert any(plain)
    assert source_bits(register, MOVING, *EVERYTHING, (CTRL8_XL, ctrl8)) == plain
    outputs = [Bench(MOVING, (CTRL8_XL, value)).at(24).read(OUT_XL, 6) for value in (0, ctrl8)]
    assert outputs[0] != outputs[1]


def test_user_offset_applies_only_to_outputs() -> None:
    """AN5040 4.6. Otherwise 127 * 2^-6 g would end any free fall."""
    offset = (CTRL6_C, 0x08), (X_OFS_USR, 127)

    assert source_bits(WAKE_UP_SRC, MOVING, *EVERYTHING, *offset) == source_bits(
        WAKE_UP_SRC, MOVING, *EVERYTHING
    )
    assert Bench(MOVING, *offset).at(3).read(OUT_XL, 2) != bytes(2)


@pytest.mark.parametrize(("hpcf", "divisor"), [(0x00, 50), (0x20, 100), (0x40, 9), (0x60, 400)])
def test_6d_can_use_output_of_lpf2(hpcf: int, divisor: int) -> None:
    """LOW_PASS_ON_6D: the board turns from flat onto its side, and LPF2 delays the angle of 50 degrees."""
    samples = [FLAT] * 10 + [ON_X] * 300
    tilted = low_passed(samples, 1 / divisor)
    over = np.abs(tilted) > 1000 * np.cos(np.radians(50))
    alone = over[:, 0] & ~over[:, 2]
    expected = next(n for n in range(1, 310) if alone[n] and alone[n - 1])

    bits = source_bits(D6D_SRC, samples, (TAP_THS_6D, 0x60), (CTRL8_XL, hpcf | LOW_PASS_ON_6D))

    changes = [number for number, value in enumerate(bits) if value & 0x40]
    assert changes == [1, expected]
    assert expected > 11, "two samples without LPF2"


def test_lpf1_filters_samples_of_events() -> None:
    """INPUT_COMPOSITE = 1: a bandwidth of ODR/4."""
    samples = [STILL] * 5 + [ON_X] + [STILL] * 10
    passed = low_passed(samples, 1 / 4)
    slopes = np.abs(np.diff(passed[:, 0], prepend=0.0)) / 2
    threshold = 8  # 250 mg

    bits = source_bits(WAKE_UP_SRC, samples, (WAKE_UP_THS, threshold), (CTRL8_XL, INPUT_COMPOSITE))

    woken = [number for number, value in enumerate(bits) if value & 0x08]
    assert woken == [number for number, slope in enumerate(slopes) if slope > 250]
    plain = source_bits(WAKE_UP_SRC, samples, (WAKE_UP_THS, threshold))
    assert plain != bits


@pytest.mark.parametrize("looks", [0, 1, 7])
@pytest.mark.parametrize("ctrl8", [0, INPUT_COMPOSITE, LPF2_ODR_400 | LOW_PASS_ON_6D])
def test_world_change_affects_later_event_samples_only(looks: int, ctrl8: int) -> None:
    """The times of earlier reads have no effect."""
    bench = Bench([FLAT], *EVERYTHING, (0x5E, 0xFC), (CTRL8_XL, ctrl8))
    bench.write(TAP_CFG, ENABLE | 0x0E)
    for look in range(looks):
        bench.at(look * 5).look()
    bench.at(40)
    changed_ps = bench.t_ps + 1
    before, after = bench.world.signals["acceleration_g"], played([ON_X])
    bench.world.signals["acceleration_g"] = step(before, after, changed_ps / 1e12)
    bench.part.world_changed(changed_ps)
    early = list(bench.at(40).look())
    late = bench.at(400).look()

    reference = Bench([FLAT] * 41 + [ON_X], *EVERYTHING, (0x5E, 0xFC), (CTRL8_XL, ctrl8))
    reference.write(TAP_CFG, ENABLE | 0x0E)
    assert late == reference.at(400).look()
    assert late[: len(early)] == early
    assert len(late) > len(early)


def test_disabled_functions_compute_no_samples() -> None:
    bench = Bench([FLAT], (CTRL8_XL, LPF2_ODR_400 | LOW_PASS_ON_6D))
    asked: list[float] = []

    def counted(t_s: Array) -> Array:
        asked.extend(t_s.tolist())
        return played([FLAT])(t_s)

    bench.world.signals["acceleration_g"] = counted
    bench.part.world_changed(0)
    bench.at(50).part.catch_up(bench.t_ps)
    assert asked == []
    bench.write(TAP_CFG, ENABLE)
    bench.at(60).look()
    assert asked
