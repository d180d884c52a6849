"""The guides: the pages of ``docs/`` and their list ``llms.txt``, in a clone and in an installed package.

``llms.txt`` has the form of https://llmstxt.org: headings, and for each page a link with a description.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Final

from fcu_emulator.emulator.errors import InputError

INDEX: Final = "llms.txt"
_ROOT: Final = Path(__file__).parents[2]
"""The folder that contains ``docs/``: the clone or, in a wheel, the package."""
_ENTRY: Final = re.compile(
    r"^- \[(?P<title>[^\]]+)\]\(docs/(?P<name>[\w-]+\.md)\): (?P<about>.+)$", re.MULTILINE
)


@dataclass(frozen=True)
class Guide:
    """A page by its file name, with a title and a description."""

    name: str
    title: str
    about: str


@cache
def guides() -> tuple[Guide, ...]:
    """Return the pages in the order of the list. Raises InputError if the list is not installed."""
    return tuple(Guide(one["name"], one["title"], one["about"]) for one in _ENTRY.finditer(guide_text(INDEX)))


def guide_text(name: str) -> str:
    """Return the text of a page, or of the list. Raises InputError for another name."""
    if name == INDEX:
        path = _ROOT / INDEX
    elif any(one.name == name for one in guides()):
        path = _ROOT / "docs" / name
    else:
        raise InputError(f"unknown guide {name[:40]!r}; {INDEX} lists the guides", kind="unknown_guide")
    try:
        return path.read_text(encoding="utf-8")
    except OSError as error:
        raise InputError(f"cannot read {path}: {error.strerror or error}") from error


def is_guide(name: str) -> bool:
    """Return whether a name is the list or one of its pages."""
    return name == INDEX or any(one.name == name for one in guides())
