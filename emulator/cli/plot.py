"""``fcu plot``: draw a run's record."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from fcu_emulator.emulator.cli.screen import ProgressLine, say
from fcu_emulator.emulator.errors import InputError

_LARGEST_RECORD = 64 << 20


def draw_record(record: Path, output: Path | None) -> None:
    """Draw a file of ``fcu run --json`` and print the picture's path. Raises InputError."""
    from fcu_emulator.emulator.analysis.plot import draw

    picture = output or record.with_suffix(".png")
    with ProgressLine(f"drawing {picture}"):
        draw(_read(record), picture)
    say(f"saved in {picture}")


def _read(record: Path) -> dict[str, Any]:
    try:
        with record.open("rb") as file:
            text = file.read(_LARGEST_RECORD + 1)
    except (OSError, ValueError) as error:
        raise InputError(f"{record}: {getattr(error, 'strerror', None) or error}") from error
    if len(text) > _LARGEST_RECORD:
        raise InputError(
            f"{record}: must be a file of fcu run --json with at most {_LARGEST_RECORD >> 20} MiB"
        )
    try:
        found = json.loads(text)
    except (ValueError, RecursionError) as error:
        problem = f"{record}: must be a file of fcu run --json: {error}"
        raise InputError(problem, kind="no_json") from error
    if not isinstance(found, dict) or not isinstance(found.get("printed"), list):
        problem = f"{record}: must be the record of a run, written by fcu run --json"
        raise InputError(problem, kind="no_record")
    return found
