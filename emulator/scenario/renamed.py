"""Renamed keys of scenarios and rubrics. The old name works for one release, with a warning."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from typing import Any


class RenamedWarning(FutureWarning):
    """A file uses a name of the previous release."""


def with_current_keys(table: Mapping[str, Any], renamed: Mapping[str, str]) -> dict[str, Any]:
    """Return the table with the current names of its keys; ``renamed`` maps old names to current ones.

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
    """Return the current name, and warn if ``name`` is the old one; return any other name unchanged."""
    new = renamed.get(name) if isinstance(name, str) else None
    if new is None:
        return name
    warnings.warn(f"{name} is now called {new}; use that name", RenamedWarning, stacklevel=2)
    return new


_ACTIONS = {
    "weather": "change_pressure",
    "wind": "blow_wind",
    "door": "slam_door",
    "fault": "inject_fault",
}


def with_current_action(entry: Any) -> Any:
    """Return a timeline entry with the current name of its action."""
    if isinstance(entry, dict) and str(entry.get("do")) in _ACTIONS:
        return {**entry, "do": current_name(entry["do"], _ACTIONS)}
    return entry
