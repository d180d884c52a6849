"""An LPS22HB at 10 Hz that measures a list of pressures, one per sample, and a wire on its pin."""

from __future__ import annotations

import numpy as np

from tests.support.sensor_fakes import PS_PER_S, Array, Chip

INTERRUPT_CFG, THS_P_L, CTRL_REG1, CTRL_REG2, CTRL_REG3 = 0x0B, 0x0C, 0x10, 0x11, 0x12
FIFO_CTRL, REF_P_XL, RPDS_L = 0x14, 0x15, 0x18
INT_SOURCE, FIFO_STATUS, STATUS, PRESS_OUT_XL = 0x25, 0x26, 0x27, 0x28
AUTORIFP, RESET_ARP, AUTOZERO, RESET_AZ, DIFF_EN, LIR, PLE, PHE = (1 << bit for bit in range(7, -1, -1))
IA, PL, PH = 0x04, 0x02, 0x01
PERIOD_PS = PS_PER_S // 10
EITHER = DIFF_EN | PLE | PHE


def measuring(*pressures_hpa: float) -> Chip:
    """Return a sensor that measures these pressures at 10 Hz from t = 0; the last pressure stays."""

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


class Wire:
    """INT_DRDY as an interrupt controller sees it. As on a board, the sensor is evaluated at ``next_event_ps``."""

    def __init__(self, chip: Chip) -> None:
        self.chip = chip
        (self.pin,) = chip.part.pins()
        self.edges: list[tuple[float, int]] = []
        self.pin.observe(lambda at_ps, level: self.edges.append((at_ps / PERIOD_PS, level)))

    def run(self, periods: float) -> list[tuple[float, int]]:
        """Return the edges of this number of sample periods, in periods."""
        end_ps = self.chip.t_ps + int(periods * PERIOD_PS)
        while self.chip.part.next_event_ps() <= end_ps:
            self.chip.part.catch_up(self.chip.part.next_event_ps())
        self.chip.t_ps = end_ps
        edges, self.edges = self.edges, []
        return edges
