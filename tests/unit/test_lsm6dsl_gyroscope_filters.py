"""The LSM6DSL's gyroscope filters for a driver: cut-off, phase, high-pass (AN5040 Rev 3, 3.8)."""

from __future__ import annotations

import math

import pytest

from tests.support.filter_fakes import at_rate, measured
from tests.support.sensor_fakes import GYROSCOPE, Writes

CTRL2_G, CTRL4_C, CTRL6_C, CTRL7_G = 0x11, 0x13, 0x15, 0x16
HALF_POWER = math.sqrt(0.5)

CUTOFF_HZ = {
    6: (137, 138, 131, 121, 138),
    7: (312, 245, 195, 155, 293),
    8: (None, 315, 224, 168, 505),  # 988 Hz is above half the rate: samples cannot show it
    9: (1161, 343, 234, 172, 925),
    10: (1250, 351, 237, 173, 937),
}
LOW_RATES = {1: 4, 2: 8, 3: 17, 4: 33, 5: 67}
CUTOFFS = [
    *((code, 0, hz) for code, hz in LOW_RATES.items()),
    *((code, column, row[column]) for code, row in CUTOFF_HZ.items() for column in range(5) if row[column]),
]


def gyroscope(code: int, column: int) -> Writes:
    """Column 0: LPF1 off; 1 to 4: FTYPE 0 to 3."""
    lpf1: Writes = ((CTRL4_C, 0x02), (CTRL6_C, column - 1)) if column else ()
    return (*lpf1, (CTRL2_G, code << 4))


@pytest.mark.parametrize(("code", "column", "cutoff_hz"), CUTOFFS)
def test_gyroscope_power_is_half_at_cutoff(code: int, column: int, cutoff_hz: float) -> None:
    channel = at_rate(GYROSCOPE, code)
    gain = abs(measured(channel, gyroscope(code, column), cutoff_hz, skip=200, world=True))
    assert gain == pytest.approx(HALF_POWER, rel=0.005)


PHASE_DEG = {
    3: (144, 146, 149, 142),
    4: (75, 77, 79, 73),
    5: (40, 42, 45, 39),
    6: (23, 25, 28, 21),
    7: (14, 17, 19, 13),
    8: (10, 12, 15, 8),
    9: (8, 10, 12, 6),
    10: (7, 9, 11, 5),
}


@pytest.mark.parametrize(
    ("code", "ftype", "lag_deg"),
    [(code, ftype, lag) for code, row in PHASE_DEG.items() for ftype, lag in enumerate(row)],
)
def test_gyroscope_phase_at_20_hz_is_documented(code: int, ftype: int, lag_deg: float) -> None:
    found = measured(at_rate(GYROSCOPE, code), gyroscope(code, ftype + 1), 20.0, skip=300, world=True)
    assert -math.degrees(math.atan2(found.imag, found.real)) == pytest.approx(lag_deg, abs=0.1)


@pytest.mark.parametrize(("code", "corner_hz"), list(enumerate((0.016, 0.065, 0.260, 1.04))))
def test_gyroscope_high_pass_has_documented_cutoff(code: int, corner_hz: float) -> None:
    """The rate is 12.5 Hz, so that a few thousand samples are long enough."""
    channel = at_rate(GYROSCOPE, 1)
    skip = int(3 * 12.5 / corner_hz)
    gain = abs(measured(channel, ((CTRL7_G, 0x40 | code << 4), (CTRL2_G, 0x10)), corner_hz, skip, skip))
    low_pass_alone = abs(measured(channel, ((CTRL2_G, 0x10),), corner_hz, 200))
    assert gain / low_pass_alone == pytest.approx(HALF_POWER, rel=0.01)


def test_gyroscope_high_pass_and_lpf1_need_high_performance() -> None:
    writes = ((CTRL4_C, 0x02), (CTRL6_C, 0x02), (CTRL7_G, 0xF0), (CTRL2_G, 0x50))
    alone, both = (measured(at_rate(GYROSCOPE, 5), some, 0.5, 200) for some in (((CTRL2_G, 0x50),), writes))
    assert both == pytest.approx(alone, abs=1e-9)
