"""Interface to the judge of a lab's exercises during a session.

Rubrics and judges are in packages above this one: ``fcu web`` passes them in
(:mod:`fcu_emulator.emulator.cli.exercises`), and a session works without them.
"""

from __future__ import annotations

from typing import Any, Protocol

from fcu_emulator.emulator.live.messages import Checked


class Exercises(Protocol):
    """The exercises of a lab, with a judge that works in parallel to the session."""

    def offered(self) -> list[dict[str, Any]]:
        """Return ``id``, ``title``, ``question`` and ``next`` of each exercise, in the lab's order."""
        ...

    def start(self, exercise: str, firmware: str, seed: int) -> None:
        """Start to judge a firmware (a file, or a shipped one by name) and return at once.

        Raises InputError for an unknown exercise, or while another one is being judged.
        """
        ...

    def finished(self) -> list[Checked]:
        """Return the results since the last call."""
        ...

    def close(self) -> None:
        """Cancel a running judgement."""
        ...
