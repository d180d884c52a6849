"""Significant motion: the user walks somewhere (AN5040 6.2).

It fires when more than SM_THS steps have been counted since it was switched on or last fired. Steps arrive
debounced, so nothing fires before DEB_STEP are exceeded either: 7 steps with the reset values.
"""

from __future__ import annotations


class SignificantMotion:
    """Counts the steps between two events."""

    def __init__(self) -> None:
        self._steps = 0

    def restart(self) -> None:
        """Count from here."""
        self._steps = 0

    def feed(self, steps: int, threshold: int) -> bool:
        """``steps`` more have been counted; whether that makes an event."""
        self._steps += steps
        if self._steps <= threshold:
            return False
        self._steps = 0
        return True
