"""The LPS22HB's output registers and STATUS: data-ready, overrun, block data update (datasheet 9.5, 9.17).

Pressure and temperature are one sample: with BDU they are held together, from the first byte of the pressure
read until PRESS_OUT_H is. Decision, where the datasheet is silent: P_DA and T_DA are cleared by reading the
high byte of their output, as in the LPS25H.
"""

from __future__ import annotations

from sensors.lps22hb.registers import PRESS_OUT, STATUS, TEMP_OUT

_NEW, _OVERRUN_SHIFT = STATUS.P_DA.mask | STATUS.T_DA.mask, 4
_FIRST, _END = PRESS_OUT.addr, TEMP_OUT.addr + TEMP_OUT.size
P_READ = 0xFF & ~(STATUS.P_DA.mask | STATUS.P_OR.mask)
_T_READ = 0xFF & ~(STATUS.T_DA.mask | STATUS.T_OR.mask)
_PRESS_OUT_H, _TEMP_OUT_H = PRESS_OUT.addr + 2, TEMP_OUT.addr + 1


class Output:
    """Works on ``mem``, the part's registers.

    ``latest``: the latest sample, five bytes; ``stale``: the registers may not show what they should, so the
    next read has to look; ``held``: by BDU. They are plain attributes because every read looks at them.
    """

    def __init__(self, mem: bytearray, latest: bytes) -> None:
        self._mem = mem
        self.latest = latest
        self.stale = True
        self._bdu = False
        self.held = False

    def set_bdu(self, *, on: bool) -> None:
        """BDU as configured; switching it off releases the output."""
        self._bdu = on
        self.held = self.held and on
        self.stale = True

    def flag(self, fresh: int) -> None:
        """``fresh`` samples have come since the last call."""
        unread = _NEW if fresh > 1 else self._mem[STATUS.addr] & _NEW
        self._mem[STATUS.addr] |= _NEW | unread << _OVERRUN_SHIFT

    def show(self, sample: bytes | None) -> None:
        """Put ``sample`` into the registers unless they are held; None leaves what is there."""
        self.stale = self.held
        if sample is not None and not self.held:
            self._mem[_FIRST:_END] = sample

    def account(self, first: int, end: int) -> bool:
        """Bytes ``first`` to ``end - 1`` of one output are about to be read; whether that clears P_DA."""
        if first <= _PRESS_OUT_H < end:
            self._mem[STATUS.addr] &= P_READ
            self.held = False
            return True
        if first < _PRESS_OUT_H:
            self.held = self._bdu
        elif end > _TEMP_OUT_H:
            self._mem[STATUS.addr] &= _T_READ
        return False
