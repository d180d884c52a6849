"""Interface of an object that judges a lab's exercises; ``fcu web`` passes the object to a session."""

from __future__ import annotations

from typing import Any, Protocol

from fcu_emulator.emulator.live.messages import Checked


class Exercises(Protocol):
    """The exercises of a lab, which are judged in parallel to the session."""

    def offered(self) -> list[dict[str, Any]]:
        """Return ``id``, ``title``, ``question`` and ``next`` of each exercise."""
        ...

    def start(self, exercise: str, firmware: str, seed: int) -> None:
        """Start to judge a firmware (a file, or a shipped one by name), and return at once.

        Raises InputError for an unknown exercise, or while another one is being judged.
        """
        ...

    def finished(self) -> list[Checked]: ...

    def close(self) -> None:
        """Cancel a running judgement."""
        ...
