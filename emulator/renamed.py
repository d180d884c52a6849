"""Support for names of the previous release, with a warning (``docs/renamed.md``)."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from typing import Any

# -- in files and addresses ---------------------------------------------------------------------------


class RenamedWarning(FutureWarning):
    """A file uses an old name."""


def with_current_keys(table: Mapping[str, Any], renamed: Mapping[str, str]) -> dict[str, Any]:
    """Return the table with current keys; ``renamed`` maps old names to current names.

    Warns of each old name. Raises ValueError if the table has both.
    """
    changed = {}
    for key, value in table.items():
        name = current_name(key, renamed)
        if name in changed or (name != key and name in table):
            raise ValueError(f"must not have both {key} and {name}; leave out {key}")
        changed[name] = value
    return changed


def current_name(name: Any, renamed: Mapping[str, str]) -> Any:
    """Return the current name, with a warning if ``name`` is old."""
    new = renamed.get(name) if isinstance(name, str) else None
    if new is None:
        return name
    warnings.warn(f"{name} is now called {new}; use that name", RenamedWarning, stacklevel=2)
    return new


# -- in Python --------------------------------------------------------------------------------------------


def warn_renamed(old: str, new: str, stacklevel: int = 2) -> None:
    """Show a warning about a changed name at the place of the caller's caller."""
    problem = f"{old} is now called {new}; use that name"
    warnings.warn(problem, DeprecationWarning, stacklevel=stacklevel + 1)


class OldName:
    """Alias for an attribute's previous name, with a warning: ``arm = OldName("chip")``."""

    def __init__(self, new: str) -> None:
        self._new = new

    def __set_name__(self, owner: type, name: str) -> None:
        self._old = name

    def __get__(self, owner: object, kind: type | None = None) -> Any:
        if owner is None:
            return self
        warn_renamed(self._old, self._new)
        return getattr(owner, self._new)
