"""Settings that cannot work, noted once when they come about."""

from __future__ import annotations

from collections.abc import Mapping

from sensors.lsm6dsl.feature import Chip


class Violations:
    """Remembers which are present, so that the next write to another register does not repeat the note."""

    def __init__(self, chip: Chip) -> None:
        self._chip = chip
        self._present: set[str] = set()

    def report(self, found: Mapping[str, bool], now_ps: int) -> None:
        """``found``: each violation's text, and whether it is present."""
        for text, present in found.items():
            if present and text not in self._present:
                self._chip.note(now_ps, "forbidden", text)
        self._present = {text for text, present in found.items() if present}
