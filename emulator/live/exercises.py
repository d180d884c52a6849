"""Interface of the object that judges exercises for a session of ``fcu web``."""

from __future__ import annotations

from typing import Any, Protocol

from fcu_emulator.emulator.live.messages import Checked


class Exercises(Protocol):
    """A lab's exercises, judged in parallel to the session."""

    def offered(self) -> list[dict[str, Any]]:
        """Return ``id``, ``title``, ``question`` and ``next`` of each exercise."""
        ...

    def start(self, exercise: str, firmware: str, seed: int) -> None:
        """Start to judge firmware (a file or a shipped name), and return immediately.

        Raises InputError for an unknown exercise, or during another judgement.
        """
        ...

    def finished(self) -> list[Checked]: ...

    def close(self) -> None:
        """Cancel a running judgement."""
        ...
