"""Notes of a sensor, (kind, text), for tests: their kinds are asserted on, their texts are golden words."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TypeAlias

Notes: TypeAlias = Iterable[tuple[str, str]]


def kinds(notes: Notes) -> list[str]:
    """Return the kinds of the notes, in their order."""
    return [kind for kind, _ in notes]


def texts(notes: Notes) -> str:
    """Return the texts of the notes, one a line, as ``words`` takes them."""
    return "\n".join(text for _, text in notes)
