"""A LIS2MDL at 100 Hz with a threshold, and a list of its measurements."""

from __future__ import annotations

import numpy as np

from tests.support.sensor_fakes import MAGNETOMETER, PS_PER_MS, PS_PER_S, Array, Chip

OFFSET_X_REG_L, CFG_REG_A, CFG_REG_B, CFG_REG_C = 0x45, 0x60, 0x61, 0x62
INT_CRTL_REG, INT_SOURCE_REG, INT_THS_L_REG, OUTX_H_REG = 0x63, 0x64, 0x65, 0x69
XYZ, IEA, IEL, IEN = 0xE0, 0x04, 0x02, 0x01
INT_ON_PIN, FOURWSPI, DRDY_ON_PIN = 0x40, 0x04, 0x01
PERIOD_PS = 10 * PS_PER_MS


def played(*samples: tuple[float, float, float]) -> Chip:
    """Return a sensor whose first samples at 100 Hz are these counts; later samples repeat the last counts."""
    chip = Chip("LIS2MDL")
    rows = 1.5 * np.array(samples)

    def field(t_s: Array) -> Array:
        number = np.rint((t_s - MAGNETOMETER.sample_ps(0) / PS_PER_S) * 100).astype(int)
        return rows[number.clip(0, len(rows) - 1)]

    chip.world.signals["magnetic_field_mgauss"] = field
    return chip


def x_counts(*counts: float) -> Chip:
    """Return a sensor whose first samples have these counts on X, and 0 on the other axes."""
    return played(*((count, 0.0, 0.0) for count in counts))


def threshold(chip: Chip, counts: int, control: int) -> None:
    """Set the threshold, the interrupt according to ``control``, and 100 Hz."""
    chip.write(INT_THS_L_REG, *counts.to_bytes(2, "little"))
    chip.write(INT_CRTL_REG, control)
    chip.write(CFG_REG_A, 0x8C)


def sources(chip: Chip, samples: int) -> list[int]:
    """Return INT_SOURCE_REG, read once after each of the first samples."""
    found = []
    for number in range(samples):
        chip.t_ps = MAGNETOMETER.sample_ps(number)
        found.append(chip.byte(INT_SOURCE_REG))
    return found


def watched(chip: Chip, control: int) -> list[tuple[int, int]]:
    """Return the pin's edges as they are reported, with CFG_REG_C set to ``control``."""
    edges: list[tuple[int, int]] = []
    chip.part.pins()[0].observe(lambda at_ps, level: edges.append((at_ps, level)))
    chip.write(CFG_REG_C, control)
    return edges


def at(number: int) -> int:
    """Return the time of sample ``number``."""
    return MAGNETOMETER.sample_ps(number)
