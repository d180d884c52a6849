"""Finding and reading scenario files: shipped ones by name, any by path.

A scenario file may come from anybody (a student, a download), so reading it is bounded in bytes and in time,
and whatever is wrong with it is a ScenarioError of one line.
"""

from __future__ import annotations

import difflib
import os
import re
import tomllib
from importlib.resources import files
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from emulator.errors import InputError, ScenarioError
from emulator.scenario.explain import scenario_error
from emulator.scenario.scenario import Scenario
from emulator.scenario.schema import ScenarioFile
from emulator.scenario.tables import read_bounded

_MOST_DOTS = 64  # in one line; tomllib takes cubic time for keys of thousands of dotted parts
_MOST_LINES = 20_000
_SHOWN = 80  # characters of an unknown name that a message repeats


def load_scenario(name: str | os.PathLike[str]) -> Scenario:
    """A shipped scenario by name, or a file by path: what ends in ``.toml`` or has a separator is a path.

    Raises ScenarioError naming file and key path.
    """
    path = Path(name) if _is_path(name) else _shipped(str(name))
    file = str(path)
    try:
        data = read_bounded(path, "a scenario file")
    except ValueError as error:  # the message already names the path
        raise ScenarioError(file, "", str(error).removeprefix(f"{path} ")) from error
    table = _parse(data, file)
    try:
        contents = ScenarioFile.model_validate(table, context={"folder": path.parent})
    except ValidationError as error:
        raise scenario_error(file, error) from error
    return Scenario(contents, path)


def scenario_names() -> dict[str, str]:
    """The shipped scenarios and the question each asks, in alphabetical order."""
    names = {}
    for path in sorted(_folder().glob("*.toml")):
        names[path.stem] = str(_parse(path.read_bytes(), str(path))["question"])
    return names


def _folder() -> Path:
    return Path(str(files("scenarios")))


def _is_path(name: str | os.PathLike[str]) -> bool:
    text = os.fspath(name)
    return not isinstance(name, str) or text.endswith(".toml") or "/" in text or os.sep in text


def _shipped(name: str) -> Path:
    known = [path.stem for path in sorted(_folder().glob("*.toml"))]
    if name in known:
        return _folder() / f"{name}.toml"
    near = difflib.get_close_matches(name[:_SHOWN], known, n=1)
    hint = f"did you mean {near[0]}? " if near else ""
    raise InputError(
        f"unknown scenario {name[:_SHOWN]!r}; {hint}known: {', '.join(known)}; a file's name ends in .toml"
    )


def _parse(data: bytes, file: str) -> dict[str, Any]:
    """TOML, in bounded time."""
    try:
        text = data.decode("utf-8")
    except UnicodeDecodeError as error:
        problem = f"is no text in UTF-8 (byte {error.start}); give a TOML file"
        raise ScenarioError(file, "", problem) from error
    lines = text.split("\n")
    if len(lines) > _MOST_LINES:
        raise ScenarioError(file, "", f"has more than {_MOST_LINES} lines; shorten it")
    for number, line in enumerate(lines, start=1):
        if line.count(".") > _MOST_DOTS:
            raise ScenarioError(file, "", f"line {number} has more than {_MOST_DOTS} dots; break it up")
    try:
        return tomllib.loads(text)
    except RecursionError as error:
        raise ScenarioError(file, "", "is nested too deeply; a scenario needs four levels") from error
    except ValueError as error:  # TOMLDecodeError, and a number of thousands of digits
        problem = re.sub(r"\s+", " ", str(error))
        raise ScenarioError(file, "", f"is not valid TOML: {problem}") from error
