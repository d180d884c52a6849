"""The LPS22HB's pressure interrupt: a difference against two thresholds (datasheet 9.1, 9.2, 9.15).

Every sample is compared: above +THS_P is PH, below -THS_P is PL, either is IA. Without LIR the flags follow
the comparison; with LIR they stay until INT_SOURCE is read, and the next sample may set them again.

Decisions where the datasheet is silent: a difference equal to the threshold is neither; a comparison that is
switched off takes its flag with it, unless that is latched; switching LIR off leaves the flag to the next
sample.
"""

from __future__ import annotations

from sensors.lps22hb.registers import INT_SOURCE, INTERRUPT_CFG, THS_P

_COUNTS_PER_LSB = 256  # 1/16 hPa
_PH, _PL, _IA = INT_SOURCE.PH.mask, INT_SOURCE.PL.mask, INT_SOURCE.IA.mask


class PressureInterrupt:
    """``source``: PH, PL and IA as INT_SOURCE shows them; ``on``: whether samples are compared."""

    def __init__(self) -> None:
        self.source = 0
        self.on = False
        self._latched = False
        self._enabled = 0
        self._threshold = 0

    @property
    def raised(self) -> bool:
        """IA, which also triggers the FIFO."""
        return self.source != 0

    def configure(self, mem: bytearray) -> None:
        """The registers may have changed."""
        control = mem[INTERRUPT_CFG.addr]
        self._threshold = _COUNTS_PER_LSB * int.from_bytes(mem[THS_P.addr : THS_P.addr + 2], "little")
        self._latched = bool(control & INTERRUPT_CFG.LIR.mask)
        self._enabled = 0
        if control & INTERRUPT_CFG.DIFF_EN.mask:
            self._enabled |= _PH if control & INTERRUPT_CFG.PHE.mask else 0
            self._enabled |= _PL if control & INTERRUPT_CFG.PLE.mask else 0
        self.on = self._enabled != 0
        if not self._latched:
            self._show(self.source & self._enabled)

    def compare(self, difference: int) -> None:
        """A sample has come; ``difference`` in counts."""
        found = 0
        if difference > self._threshold:
            found = _PH
        elif difference < -self._threshold:
            found = _PL
        self._show(found & self._enabled | (self.source if self._latched else 0))

    def acknowledge(self) -> None:
        """INT_SOURCE has been read."""
        if self._latched:
            self.source = 0

    def _show(self, flags: int) -> None:
        flags &= _PH | _PL
        self.source = flags | _IA if flags else 0
