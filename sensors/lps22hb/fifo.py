"""The LPS22HB's FIFO: 32 levels of pressure and temperature (datasheet section 5, 9.8 and 9.16).

FIFO mode stops at the first sample that does not fit. Stream mode overwrites the oldest level. Reads of an
empty FIFO return the latest level again, except in dynamic stream mode.

Decisions where the datasheet is silent or contradicts itself: in FIFO mode, storing stops when the FIFO is full
(contrary to 5.2);
STOP_ON_FTH limits every mode to WTM + 1 levels; reading a level clears OVR; mode 101b is bypass. Reading TEMP_OUT_H
consumes a level.
"""

from __future__ import annotations

from collections import deque
from enum import Enum, auto

from fcu_emulator.sensors.lps22hb.registers import CTRL_REG2, CTRL_REG3, FIFO_CTRL, FIFO_STATUS

LEVELS = 32


class Behaviour(Enum):
    """Rule for storing a new sample."""

    BYPASS = auto()
    FIFO = auto()
    STREAM = auto()
    DYNAMIC_STREAM = auto()


_MODES = {  # by FIFO_CTRL.F_MODE: the modes without and with the interrupt
    0b000: (Behaviour.BYPASS, Behaviour.BYPASS),
    0b001: (Behaviour.FIFO, Behaviour.FIFO),
    0b010: (Behaviour.STREAM, Behaviour.STREAM),
    0b011: (Behaviour.STREAM, Behaviour.FIFO),
    0b100: (Behaviour.BYPASS, Behaviour.STREAM),
    0b110: (Behaviour.DYNAMIC_STREAM, Behaviour.DYNAMIC_STREAM),
    0b111: (Behaviour.BYPASS, Behaviour.FIFO),
}
_OFF = (Behaviour.BYPASS, Behaviour.BYPASS)


class PressureFifo:
    """The FIFO. ``on``: the mode is not bypass. ``active``: the FIFO is on, or a trigger can switch the FIFO on."""

    def __init__(self) -> None:
        self._levels: deque[bytes] = deque()  # unread, oldest first
        self.on = self.active = False
        self._mode = _OFF
        self._behaviour = Behaviour.BYPASS
        self._depth = LEVELS
        self._watermark = 0
        self._last_read: bytes | None = None
        self._stopped = self._overrun = False

    def configure(self, mem: bytearray, *, triggered: bool) -> None:
        """Decode the registers; ``triggered``: state of flag IA."""
        control = mem[FIFO_CTRL.addr]
        enabled = mem[CTRL_REG2.addr] & CTRL_REG2.FIFO_EN.mask
        self._mode = _MODES.get(FIFO_CTRL.F_MODE.get(control), _OFF) if enabled else _OFF
        self._watermark = FIFO_CTRL.WTM.get(control)
        limited = mem[CTRL_REG2.addr] & CTRL_REG2.STOP_ON_FTH.mask
        self._depth = self._watermark + 1 if limited else LEVELS
        self.active = self._mode != _OFF
        self.trigger(on=triggered)

    def trigger(self, *, on: bool) -> None:
        """Handle the state of flag IA, which triggers modes."""
        self._behaviour = self._mode[on]
        self.on = self._behaviour is not Behaviour.BYPASS
        if self._behaviour is not Behaviour.FIFO:
            self._stopped = False
        if not self.on:
            self._levels.clear()
            self._last_read = None
            self._overrun = False

    def push(self, level: bytes) -> None:
        if self._behaviour is Behaviour.FIFO:
            if len(self._levels) >= self._depth:
                self._stopped = self._overrun = True
            if not self._stopped:
                self._levels.append(level)
        elif self.on:
            if self._behaviour is Behaviour.STREAM and self._last_read is not None and not self._levels:
                self._levels.append(self._last_read)
            self._levels.append(level)
            while len(self._levels) > self._depth:
                self._levels.popleft()
                self._overrun = True

    def pop(self) -> None:
        if self._levels:
            self._last_read = self._levels.popleft()
            self._overrun = False

    @property
    def oldest(self) -> bytes | None:
        return self._levels[0] if self._levels else None

    def status(self) -> int:
        value = len(self._levels)
        if self._at_watermark():
            value |= FIFO_STATUS.FTH_FIFO.mask
        if self._overrun:
            value |= FIFO_STATUS.OVR.mask
        return value

    def signals(self) -> int:
        """Return the pin's signals, as bits of CTRL_REG3."""
        value = CTRL_REG3.F_FSS5.mask if len(self._levels) == LEVELS else 0
        if self._at_watermark():
            value |= CTRL_REG3.F_FTH.mask
        if self._overrun:
            value |= CTRL_REG3.F_OVR.mask
        return value

    def _at_watermark(self) -> bool:
        return len(self._levels) >= self._watermark > 0
