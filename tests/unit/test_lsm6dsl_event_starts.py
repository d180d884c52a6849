"""The first samples of the LSM6DSL's event functions: reports of a board at rest, and their times.

AN5040 5.3: the slope filter begins with half of its first sample, so that switching the accelerometer on with wake-up
enabled causes a wake-up. ST says the same of the similar LIS2DW12, whose filter settles with one sample. There is no
other such event: a running filter continues, and a filter that is switched on later begins with its first sample.
"""

from __future__ import annotations

import pytest

from tests.support.motion_fakes import (
    CTRL1_XL,
    CTRL2_G,
    CTRL8_XL,
    FREE_FALL,
    INT_DUR2,
    MD1_CFG,
    RATE_HZ,
    TAP_CFG,
    TAP_THS_6D,
    WAKE_UP_THS,
)
from tests.support.sensor_fakes import PS_PER_S, Chip, Writes

CTRL6_C = 0x15
OFF, AT_104_HZ, AT_416_HZ, AT_1666_HZ = 0x00, 0x40, 0x60, 0x80
HPCF_100 = (CTRL8_XL, 0x20)
FUNCTIONS: dict[str, tuple[int, int, Writes]] = {  # MD1_CFG, TAP_CFG, what else
    "wake-up, slope": (0x20, 0x80, ()),
    "wake-up, high-pass": (0x20, 0x90, (HPCF_100,)),
    "tap": (0x40, 0x8E, ()),
    "free fall": (0x10, 0x80, ()),
    "6D": (0x04, 0x80, ()),
    "inactivity": (0x80, 0xA0, ()),
}
THRESHOLDS: Writes = ((WAKE_UP_THS, 2), (TAP_THS_6D, 3), (INT_DUR2, 0), (FREE_FALL, 1 << 3 | 3))
CHANGES: dict[str, tuple[int, Writes]] = {  # CTRL1_XL before, and what is written to a part that runs
    "another rate": (AT_104_HZ, ((CTRL1_XL, AT_416_HZ),)),
    "a lower rate": (AT_416_HZ, ((CTRL1_XL, AT_104_HZ),)),
    "4 g": (AT_416_HZ, ((CTRL1_XL, AT_416_HZ | 0x08),)),
    "16 g": (AT_416_HZ, ((CTRL1_XL, AT_416_HZ | 0x04),)),
    "normal mode": (AT_104_HZ, ((CTRL6_C, 0x10),)),
    "the narrow analog stage": (AT_1666_HZ, ((CTRL1_XL, AT_1666_HZ | 0x01),)),
    "LPF1 at ODR/4": (AT_416_HZ, ((CTRL8_XL, 0x08),)),
    "another high-pass": (AT_416_HZ, ((CTRL8_XL, 0x60),)),
    "6D behind LPF2": (AT_416_HZ, ((CTRL8_XL, 0x01),)),
    "the gyroscope": (AT_416_HZ, ((CTRL2_G, 0x60),)),
    "another threshold": (AT_416_HZ, ((WAKE_UP_THS, 1), (TAP_THS_6D, 2))),
}


class Pins(Chip):
    """A board that lies flat and at rest; ``rises`` returns the rising edges of INT1 since the last call."""

    def __init__(self, *writes: tuple[int, int]) -> None:
        super().__init__("LSM6DSL")
        self._rises: list[int] = []
        for pin in self.part.pins():
            pin.observe(lambda at_ps, level: self._rises.append(at_ps) if level else None)
        self.configure(writes)

    def rises(self, after_s: float = 0.4) -> list[float]:
        """Let time pass; return the times of INT1's rising edges, in periods of 416 Hz since the call."""
        begin_ps = self.t_ps
        self.wait(round(after_s * PS_PER_S))
        self.part.catch_up(self.t_ps)
        found = [(at_ps - begin_ps) / PS_PER_S * RATE_HZ for at_ps in self._rises]
        self._rises.clear()
        return found


@pytest.mark.parametrize(
    ("function", "expected"),
    [
        ("wake-up, slope", [1]),  # the first slope: half of gravity
        ("wake-up, high-pass", [1]),
        ("tap", [2]),  # it is over with the second
        ("free fall", []),
        ("6D", [2]),  # the first position, seen twice
        ("inactivity", [18]),  # 16 periods after the first slope within the threshold, the second one
    ],
)
def test_switching_on_raises_only_documented_events(function: str, expected: list[int]) -> None:
    md1, tap, others = FUNCTIONS[function]
    chip = Pins(*THRESHOLDS, *others, (MD1_CFG, md1), (TAP_CFG, tap), (CTRL1_XL, AT_416_HZ))
    assert chip.rises() == pytest.approx(expected, abs=1e-6)
    chip.configure(((CTRL1_XL, OFF),))
    chip.rises()
    chip.configure(((CTRL1_XL, AT_416_HZ),))
    assert chip.rises() == pytest.approx(expected, abs=1e-6), "after power-down as the first time"


@pytest.mark.parametrize("change", CHANGES)
@pytest.mark.parametrize("function", FUNCTIONS)
def test_configuration_change_while_running_raises_no_event(function: str, change: str) -> None:
    md1, tap, others = FUNCTIONS[function]
    before, writes = CHANGES[change]
    chip = Pins(*THRESHOLDS, *others, (MD1_CFG, md1), (TAP_CFG, tap), (CTRL1_XL, before))
    chip.rises(1.0)
    chip.configure(writes)
    assert chip.rises(1.0) == []


@pytest.mark.parametrize(
    ("function", "expected"),
    [
        ("wake-up, slope", []),
        ("wake-up, high-pass", []),
        ("tap", []),
        ("free fall", []),
        ("6D", [2]),
        ("inactivity", [17]),
    ],
)
def test_function_enabled_later_starts_with_its_first_sample(function: str, expected: list[int]) -> None:
    md1, tap, others = FUNCTIONS[function]
    chip = Pins(*THRESHOLDS, *others, (MD1_CFG, md1), (CTRL1_XL, AT_416_HZ))
    assert chip.rises(100.00001 / RATE_HZ) == []
    chip.configure(((TAP_CFG, tap),))
    assert chip.rises() == pytest.approx(expected, abs=1e-4)


@pytest.mark.parametrize("change", CHANGES)
def test_waking_from_inactivity_is_one_event(change: str) -> None:
    """Inactivity changes the rate automatically, to 12.5 Hz and back."""
    md1, tap, others = FUNCTIONS["inactivity"]
    before, writes = CHANGES[change]
    chip = Pins(*THRESHOLDS, *others, (MD1_CFG, md1 | 0x20), (TAP_CFG, tap), (CTRL1_XL, before))
    assert len(chip.rises(1.0)) == 2, "waking at the start, falling asleep"
    chip.configure(writes)
    assert chip.rises(1.0) == []
