"""Rules of the lab for scenarios, rubrics and the web page::

    [[expect]]
    rule = "Yaw"
    from = "12.1s"

The rule's table is in ``scenarios/rules/lab3.toml``. Further keys of the entry are added to this table.

Decision: a rule is a table that replaces the entry when a file is read, so that the lab's numbers
are in a file and not hidden in code.
"""

from __future__ import annotations

import tomllib
from collections.abc import Sequence
from functools import cache
from importlib.resources import files
from typing import Any

from fcu_emulator.emulator.errors import ScenarioError
from fcu_emulator.emulator.text import choices, shown


@cache
def _rules() -> dict[str, dict[str, Any]]:
    text = (files("fcu_emulator.scenarios") / "rules" / "lab3.toml").read_text(encoding="utf-8")
    return tomllib.loads(text)


def rule_names() -> list[str]:
    """Return the names of all rules."""
    return list(_rules())


def with_rules(entries: Any, file: str, key: str) -> Any:
    """Return ``expect`` with rules replaced by their tables. Raises ScenarioError."""
    if not isinstance(entries, Sequence) or isinstance(entries, str):
        return entries
    return [_resolved(entry, file, f"{key}[{number}]") for number, entry in enumerate(entries)]


def _resolved(entry: Any, file: str, key: str) -> Any:
    if not isinstance(entry, dict) or "rule" not in entry:
        return entry
    name = entry["rule"]
    if not isinstance(name, str) or name not in _rules():
        raise ScenarioError(file, f"{key}.rule", f"must be {choices(_rules())}, not {shown(name)}")
    if "kind" in entry:
        raise ScenarioError(file, f"{key}.kind", "must not be given together with a rule; leave it out")
    return _rules()[name] | {one: value for one, value in entry.items() if one != "rule"}
