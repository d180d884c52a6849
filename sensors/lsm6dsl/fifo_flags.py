"""The flags of FIFO_STATUS2 and their signals FTH, FULL_FLAG and FIFO_OVR (AN5040 Rev 3, 8.2.2)."""

from __future__ import annotations

from sensors.lsm6dsl.fifo_buffer import FifoBuffer
from sensors.lsm6dsl.registers import FIFO_STATUS2
from sensors.lsm6dsl.signals import Signals

_WATERMARK, _OVERRUN = FIFO_STATUS2.WaterM.mask, FIFO_STATUS2.OVER_RUN.mask
_FULL, _EMPTY = FIFO_STATUS2.FIFO_FULL_SMART.mask, FIFO_STATUS2.FIFO_EMPTY.mask


class FifoFlags:
    """``bits``: as in FIFO_STATUS2; ``watermark``: FTH, 0 for none."""

    def __init__(self, buffer: FifoBuffer, signals: Signals) -> None:
        self._buffer = buffer
        self._signals = signals
        self.watermark = 0
        self.bits = _EMPTY

    @property
    def full(self) -> bool:
        """FIFO_FULL_SMART."""
        return bool(self.bits & _FULL)

    def update(self, ahead: int | None, at_ps: int) -> None:
        """Something may have changed them; ``ahead``: words the next trigger writes, if one comes."""
        buffer, bits = self._buffer, 0
        fill = buffer.fill
        if not fill:
            bits |= _EMPTY
        if 0 < self.watermark <= fill:
            bits |= _WATERMARK
        if buffer.overrun:
            bits |= _OVERRUN
        if ahead is not None and fill + ahead >= buffer.depth:
            bits |= _FULL
        if bits != self.bits:
            self.bits = bits
            self._signals.set("FTH", bool(bits & _WATERMARK), at_ps)
            self._signals.set("FULL_FLAG", bool(bits & _FULL), at_ps)
            self._signals.set("FIFO_OVR", bool(bits & _OVERRUN), at_ps)

    def triggers_to_next(self, widest: int) -> int:
        """At least so many triggers come before a flag changes, the last included; 0: none changes.

        ``widest``: the most words that a trigger writes.
        """
        buffer = self._buffer
        if buffer.overrun or not widest:
            return 0
        levels = (self.watermark, buffer.depth - widest, buffer.depth, buffer.depth + 1)
        missing = min(level - buffer.fill for level in levels if level > buffer.fill)
        return -(-missing // widest)
