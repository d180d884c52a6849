"""Annotations of GitHub Actions: failed checks and diagnoses at their source lines.

Decision: the result is printed between two lines with a random word, and the runner ignores commands between these lines.
The result quotes text of the firmware, and the runner executes each line that begins with two colons ("Workflow
commands for GitHub Actions").
"""

from __future__ import annotations

import os
import re
import secrets
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Final

import click

from fcu_emulator.emulator.grading.causes import relevant_causes
from fcu_emulator.emulator.grading.verdict import CheckResult, Verdict
from fcu_emulator.emulator.text import visible

MOST: Final = 10
"""Maximum number of annotations; GitHub shows ten of each level for a step."""
_PLACE: Final = re.compile(r"([\w.+/\\-]+\.\w{1,4}):(\d{1,7})\b")
_LONGEST: Final = 400
_WRONG: Final = ("failed", "partial")


@contextmanager
def commands_ignored(wanted: bool) -> Iterator[None]:
    """Make the runner ignore the commands in the output of the block."""
    if not wanted:
        yield
        return
    word = secrets.token_hex(16)
    click.echo(f"::stop-commands::{word}")
    try:
        yield
    finally:
        click.echo(f"::{word}::")


def annotation_commands(verdict: Verdict, folder: Path) -> list[str]:
    """Return at most :data:`MOST` commands. ``folder``: the folder of the source files."""
    wrong = [check for check in verdict.checks if check.max_points > 0 and check.outcome in _WRONG]
    failed = {check.exercise for check in wrong}
    runs = (run for run in verdict.evidence if failed.intersection(run.exercises))
    found = [
        _command(
            "error" if cause.fatal else "warning",
            _place(f"{cause.data.get('file', '')}:{cause.data.get('line', '')}", folder),
            "diagnosis",
            cause.summary,
        )
        for cause in relevant_causes((cause for run in runs for cause in run.causes), wrong)
    ]
    found += [_command("error", _place(one.source, folder), one.title, _sentences(one)) for one in wrong]
    return list(dict.fromkeys(found))[:MOST]


def _sentences(check: CheckResult) -> str:
    told = (("expected", check.expected), ("seen", check.actual), ("hint", check.hint))
    return "\n".join(f"{word}: {text}" for word, text in told if text) or check.title


def _place(text: str, folder: Path) -> dict[str, str]:
    """Return file and line if the named file is in ``folder`` and in the repository, otherwise {}."""
    found = _PLACE.search(text)
    if not found:
        return {}
    root = Path(os.environ.get("GITHUB_WORKSPACE") or Path.cwd()).resolve()
    inside = folder.resolve()
    file = (inside / found[1]).resolve()
    if not file.is_relative_to(inside) or not file.is_relative_to(root) or not file.is_file():
        return {}
    return {"file": file.relative_to(root).as_posix(), "line": found[2]}


def _command(level: str, place: dict[str, str], title: str, message: str) -> str:
    values = {**place, "title": title}
    options = ",".join(f"{name}={_property(value)}" for name, value in values.items())
    return f"::{level} {options}::{_data(message)}"


def _data(text: str) -> str:
    shown = visible(text[:_LONGEST], lines=True)
    return shown.replace("%", "%25").replace("\r", "%0D").replace("\n", "%0A")


def _property(text: str) -> str:
    return _data(text).replace(":", "%3A").replace(",", "%2C")
