"""Set and reset pulses: the polarity each measurement is taken with (AN5069 section 8; sensor facts 2.4).

A set pulse leaves the bridge with the offset +Hoff, a reset pulse with -Hoff, and it stays so until the next
pulse. With offset cancellation pulses alternate, one a measurement. Without it there are set pulses only:
every 63 samples (Set_FREQ = 0) or only on leaving idle (Set_FREQ = 1).

Decisions where the documents are silent: the 63 samples are counted from leaving idle, which is a pulse of
its own; alternation goes on from the polarity the last pulse has left. So a part whose cancellation is
switched off while it measures may keep -Hoff for up to 63 samples, and with Set_FREQ = 1 until it has been
idle. Road not taken: offsets that strong fields leave behind until the next set pulse, for which no document
has a number.
"""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray

SET: Final = 1
PULSE_EVERY: Final = 63


class Pulses:
    """The polarity of each measurement by its number, +1 after a set pulse and -1 after a reset pulse."""

    def __init__(self) -> None:
        self.first = 0
        """Number of the first measurement since idle was left."""
        self._from = 0  # the settings below hold from this measurement on ...
        self._before = SET  # ... and this was the polarity until then
        self._alternating = False
        self._periodic = True

    def configure(self, number: int, *, alternating: bool, periodic: bool) -> None:
        """From measurement ``number`` on pulses alternate, or set pulses come ``periodic`` or not at all."""
        self._before = int(self.polarity(np.array([number - 1]))[0])
        self._from = number
        self._alternating = alternating
        self._periodic = periodic

    def leave_idle(self, number: int) -> None:
        """Measurement ``number`` is the first one after idle; ``configure`` was called with the same."""
        self.first = number

    def polarity(self, numbers: NDArray[np.int64]) -> NDArray[np.int64]:
        """+1 or -1 for each of ``numbers``, none of them earlier than the last one before ``configure``."""
        since = numbers - self._from
        if self._alternating:
            return self._before * (1 - 2 * ((since + 1) % 2))
        since_first = numbers - self.first
        since_pulse = since_first % PULSE_EVERY if self._periodic else since_first
        return np.where((since >= 0) & (since_pulse <= since), SET, self._before)
