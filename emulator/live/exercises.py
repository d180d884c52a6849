"""Interface to what judges the exercises of a lab while a session runs.

The rubric and the judgement are above this package: ``fcu web`` hands them in
(:mod:`fcu_emulator.emulator.cli.exercises`), and a session works without them.
"""

from __future__ import annotations

from typing import Any, Protocol

from fcu_emulator.emulator.live.messages import Checked


class Exercises(Protocol):
    """The exercises of a lab, and a judge that works beside the session."""

    def offered(self) -> list[dict[str, Any]]:
        """Return ``id``, ``title``, ``question`` and ``next`` of each exercise, in the lab's order."""
        ...

    def start(self, exercise: str, firmware: str, seed: int) -> None:
        """Start to judge a firmware (a file, or a shipped one by name) and return at once.

        Raises InputError for an unknown exercise, or while another one is being judged.
        """
        ...

    def finished(self) -> list[Checked]:
        """Return the results that have come since the last call."""
        ...

    def close(self) -> None:
        """End a judgement that is still running."""
        ...
