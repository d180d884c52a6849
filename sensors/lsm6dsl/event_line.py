"""One event's way out: its bits in a source register, and its signal to the pins; pulsed or latched."""

from __future__ import annotations

from sensors.lsm6dsl.signals import SignalName, Signals


class Line:
    """``bits``: what the source register shows. ``latched``: held until the source register is read.

    A latched event whose condition still holds when it is read comes back with the next sample.
    """

    __slots__ = ("_name", "_signals", "bits", "latched")

    def __init__(self, signals: Signals, name: SignalName) -> None:
        self._signals = signals
        self._name: SignalName = name
        self.bits = 0
        self.latched = False

    def update(self, bits: int, at_ps: int) -> None:
        """The event's bits as of the sample at ``at_ps``; 0 when it is over."""
        if bits == self.bits or (self.latched and not bits):
            return
        self.bits = bits
        self._signals.set(self._name, bits != 0, at_ps)

    def acknowledge(self, at_ps: int) -> None:
        """The source register has been read."""
        if self.latched:
            self.drop(at_ps)

    def drop(self, at_ps: int) -> None:
        """The event is over, latched or not."""
        self.bits = 0
        self._signals.set(self._name, False, at_ps)
