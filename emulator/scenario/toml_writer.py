"""Writer of scenarios as TOML text.

Decision: this module writes only the few forms of TOML that scenarios use, because a general writer
would be a further dependency.
"""

from __future__ import annotations

import datetime as dt
import json
import math
from collections.abc import Iterable, Mapping
from typing import Any

from pydantic import TypeAdapter, ValidationError

from fcu_emulator.emulator.boards.description import BoardDescription
from fcu_emulator.emulator.boards.fcu001v1 import FCU001V1
from fcu_emulator.emulator.clock import format_duration
from fcu_emulator.emulator.errors import InputError
from fcu_emulator.emulator.scenario.loader import scenario_error
from fcu_emulator.emulator.scenario.timeline import AnyEntry, Replay, TimelineAction

_ENTRY: TypeAdapter[TimelineAction] = TypeAdapter(AnyEntry)


def parse_entry(table: Mapping[str, Any], board: BoardDescription = FCU001V1) -> TimelineAction:
    """Check a timeline entry such as ``{"do": "lift", "metres": 2, "for": "1s"}``, without ``at``.

    Raises InputError, even for a valid entry that reads a file.
    """
    if isinstance(table, Mapping) and table.get("do") == "replay":
        raise InputError("cannot play a recording on a live board; put the replay into a scenario")
    if isinstance(table, Mapping) and "at" in table:
        raise InputError("a live entry must not have a time; leave out the key at")
    try:
        return _ENTRY.validate_python(dict(table), context={"board": board})
    except (ValidationError, TypeError, ValueError) as error:
        if isinstance(error, ValidationError):
            raise _of_entry(error) from error
        raise InputError(f"a timeline entry must be a table: {error}") from error


def _of_entry(error: ValidationError) -> InputError:
    """Return an error with a key path that omits the kind of the entry."""
    problem = scenario_error("", error)
    return InputError(f"{problem.key.partition('.')[2] or problem.key}: {problem.problem}")


def entry_line(entry: TimelineAction, at_ps: int, interrupts: bool = False) -> str:
    """Return the entry as one inline table, at ``at_ps``."""
    table = entry.model_dump(mode="json", by_alias=True, exclude_unset=True, exclude_none=True)
    table = {"do": table.pop("do"), "at": format_duration(at_ps), **table}
    if interrupts:
        table["interrupts"] = True
    return _value(table)


def timeline(entries: Iterable[tuple[int, TimelineAction]]) -> str:
    """Return ``timeline = [...]``, with one line for each (time in ps, entry).

    If an entry ends another motion early, it gets the key ``interrupts``.
    """
    busy_until: dict[str, int] = {}
    lines = []
    for at_ps, entry in sorted(entries, key=lambda one: one[0]):
        cuts = any(busy_until.get(quantity, 0) > at_ps for quantity in entry.moves)
        for quantity in entry.moves:
            busy_until[quantity] = at_ps + entry.length_ps
        lines.append(f"    {entry_line(entry, at_ps, cuts and not entry.interrupts)},\n")
    return f"timeline = [\n{''.join(lines)}]\n"


def scenario_text(table: Mapping[str, Any]) -> str:
    """Return the text of a scenario file. Each inner table has one line."""
    keys = {key: value for key, value in table.items() if not isinstance(value, Mapping)}
    tables = {key: value for key, value in table.items() if isinstance(value, Mapping)}
    return "".join((*map(_top_level, keys, keys.values()), *map(table_text, tables, tables.values())))


def _top_level(key: str, value: Any) -> str:
    if not isinstance(value, list) or not all(isinstance(one, Mapping) for one in value):
        return key_text(key, value)
    lines = "".join(f"    {_value(one)},\n" for one in value)
    return f"{_key(key)} = [\n{lines}]\n"


def names_files(entries: Iterable[TimelineAction]) -> bool:
    """Return whether any entry reads a file."""
    return any(isinstance(entry, Replay) for entry in entries)


def table_text(name: str, table: Mapping[str, Any]) -> str:
    """Return the table ``[name]`` with its inner tables in inline form."""
    return f"\n[{name}]\n" + "".join(f"{_key(key)} = {_value(value)}\n" for key, value in table.items())


def key_text(key: str, value: Any) -> str:
    """Return the line ``key = value``."""
    return f"{_key(key)} = {_value(value)}\n"


def _key(key: str) -> str:
    return key if key.replace("_", "").replace("-", "").isalnum() and key.isascii() else _string(key)


def _string(text: str) -> str:
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")


def _value(value: Any) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        return _string(value)
    if isinstance(value, int | dt.date):
        return str(value)
    if isinstance(value, float):
        if not math.isfinite(value):
            raise ValueError(f"a scenario cannot contain {value}")
        return repr(value)
    if isinstance(value, Mapping):
        return "{ " + ", ".join(f"{_key(key)} = {_value(one)}" for key, one in value.items()) + " }"
    return "[" + ", ".join(_value(one) for one in value) + "]"
