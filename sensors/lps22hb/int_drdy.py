"""The LPS22HB's INT_DRDY pin (datasheet 9.7, Table 19, figure 22).

Decisions: with INT_S = 0 the pin shows the enabled data signals ORed together, as figure 22 draws it (Table
19 speaks of a priority, which gives the same level). Data-ready is P_DA: reading PRESS_OUT_H ends it, whether
or not firmware wants the temperature. An open-drain pin is let go where a push-pull one would be high.
"""

from __future__ import annotations

from sensors.lps22hb.registers import CTRL_REG3, INT_SOURCE, STATUS
from sensors.pin import Pin

_PH, _PL = INT_SOURCE.PH.mask, INT_SOURCE.PL.mask
_INTERRUPTS = (0, _PH, _PL, _PH | _PL)  # by INT_S
_DATA = CTRL_REG3.F_FSS5.mask | CTRL_REG3.F_FTH.mask | CTRL_REG3.F_OVR.mask | CTRL_REG3.DRDY.mask


class IntDrdy:
    """The pin and what is routed to it; ``routed``: whether anything is, so that its level can change."""

    def __init__(self) -> None:
        self.pin = Pin("INT_DRDY")
        self.routed = False
        self._control = 0

    def configure(self, mem: bytearray) -> None:
        """CTRL_REG3 may have changed; ``drive`` follows."""
        self._control = mem[CTRL_REG3.addr]
        self.routed = bool(self._control & (_DATA | CTRL_REG3.INT_S.mask))

    def drive(self, status: int, fifo_signals: int, int_source: int, at_ps: int) -> None:
        """Set the level from STATUS, the FIFO's signals and INT_SOURCE as of ``at_ps``."""
        interrupts = _INTERRUPTS[CTRL_REG3.INT_S.get(self._control)]
        if interrupts:
            active = bool(int_source & interrupts)
        else:
            ready = CTRL_REG3.DRDY.mask if status & STATUS.P_DA.mask else 0
            active = bool(self._control & _DATA & (fifo_signals | ready))
        high = active != bool(self._control & CTRL_REG3.INT_H_L.mask)
        if high and self._control & CTRL_REG3.PP_OD.mask:
            self.pin.drive(None, at_ps)
        else:
            self.pin.drive(int(high), at_ps)
