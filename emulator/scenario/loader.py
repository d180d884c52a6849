"""Loading of scenarios: read the file, draw random numbers, report errors.

Reading is bounded in bytes and time. Every number and duration in ``[world]``, ``[[timeline]]`` and
``[[threshold]]`` can be drawn at random::

    pitch_deg = { uniform = [20, 70], random_sign = true }   # 20 to 70, or -70 to -20
    metres = { one_of = [3, 4.5] }

When a scenario is read, it is also checked with the lowest and the highest possible numbers.

Decision: each drawn number is computed by SHA-512 from the seed, the scenario's name and the key
path, so that entries that are added later do not change it.
"""

from __future__ import annotations

import difflib
import os
import random
import re
import tomllib
from collections.abc import Callable, Mapping
from importlib.resources import files
from itertools import pairwise
from pathlib import Path
from typing import Any, TypeAlias

from pydantic import ValidationError

from fcu_emulator.emulator.boards.description import BoardDescription
from fcu_emulator.emulator.boards.fcu001v1 import FCU001V1
from fcu_emulator.emulator.clock import PS_PER_MS, format_duration, parse_duration, seconds
from fcu_emulator.emulator.errors import InputError, ScenarioError
from fcu_emulator.emulator.renamed import with_current_keys
from fcu_emulator.emulator.scenario.fields import Resources, read_bounded
from fcu_emulator.emulator.scenario.rules import with_rules
from fcu_emulator.emulator.scenario.scenario import Scenario
from fcu_emulator.emulator.scenario.schema import scenario_file
from fcu_emulator.emulator.scenario.thresholds import (
    ThresholdSection,
    ThresholdTable,
    parse_thresholds,
    put_in_place,
)
from fcu_emulator.emulator.text import shown


def load_scenario(
    name: str | os.PathLike[str], board: BoardDescription = FCU001V1, seed: int | None = None
) -> Scenario:
    """Load a shipped scenario by name, or a file by path (with a separator, or ending in ``.toml``).

    ``board`` defines the valid names. ``seed`` replaces the seed in the file. Raises ScenarioError,
    which names file and key path.
    """
    path = Path(name) if is_path(name) else _shipped(str(name))
    return scenario_of(read_toml(path, "a scenario file"), path, board, seed=seed)


def scenario_of(
    table: dict[str, Any],
    path: Path,
    board: BoardDescription = FCU001V1,
    name: str | None = None,
    seed: int | None = None,
) -> Scenario:
    """Create a scenario from the contents of a file, as :func:`load_scenario` does.

    ``name`` replaces the name of the file.
    """
    if "expect" in table:
        table = {**table, "expect": with_rules(table["expect"], str(path), "expect")}
    if not _has_draws(table):
        return _scenario(table, path, board, name)
    if seed is None:
        given = table.get("seed", 0)
        seed = given if isinstance(given, int) else 0  # other types are refused later
    for pick in (_lowest, _highest):
        _drawn_scenario(table, pick, path, board, name)
    return _drawn_scenario(table, _by_seed(seed, name or path.stem), path, board, name)


def _drawn_scenario(
    table: dict[str, Any], pick: Pick, path: Path, board: BoardDescription, name: str | None
) -> Scenario:
    table = drawn(table, pick, str(path))
    if "threshold" not in table:
        return _scenario(table, path, board, name)
    thresholds = _thresholds(table, str(path))
    table, parts = put_in_place(table, thresholds, pick, str(path))
    try:
        scenario = _scenario(table, path, board, name)
    except ScenarioError as error:
        entry = re.match(r"timeline\[(\d+)\]", error.key)
        of = [one.number for one in parts if entry is not None and int(entry[1]) in one.entries]
        if not of:
            raise
        raise ScenarioError(error.file, f"threshold[{of[0]}]", error.problem, kind=error.kind) from error
    for part in parts:
        _refuse_disturbed(part, scenario)
    return scenario


def thresholds_at_ends(table: Mapping[str, Any], file: str) -> list[tuple[ThresholdTable, ThresholdTable]]:
    """Return each threshold with the lowest and with the highest numbers. Raises ScenarioError."""
    low, high = (_thresholds(drawn(table, pick, file), file) for pick in (_lowest, _highest))
    return list(zip(low, high, strict=True))


def _thresholds(table: Mapping[str, Any], file: str) -> list[ThresholdTable]:
    try:
        return parse_thresholds(table.get("threshold", []))
    except ValidationError as error:
        problem = scenario_error(file, error)
        raise ScenarioError(
            problem.file, f"threshold{problem.key}", problem.problem, kind=problem.kind
        ) from error


def _refuse_disturbed(part: ThresholdSection, scenario: Scenario) -> None:
    """Refuse other motions during the section of a threshold. Raises ScenarioError."""
    for step in scenario.steps:
        if step.number in part.entries or not step.entry.moves & {"attitude", "altitude"}:
            continue
        if step.at_ps < part.end_ps and max(step.end_ps, step.at_ps + 1) > part.begin_ps:
            needs = f"needs a motionless board from {seconds(part.begin_ps)} to {seconds(part.end_ps)}"
            problem = f"{needs}, but {step.name} moves the board; start one of them later"
            raise ScenarioError(scenario.file, f"threshold[{part.number}]", problem, kind="disturbed")


def _scenario(table: dict[str, Any], path: Path, board: BoardDescription, name: str | None) -> Scenario:
    try:
        context = {"resources": Resources(path.parent), "board": board}
        contents = scenario_file(board).model_validate(table, context=context)
    except ValidationError as error:
        raise scenario_error(str(path), error) from error
    return Scenario(contents, path, name, table)


# -- Find the file ------------------------------------------------------------------------------------------


_SHOWN = 80  # characters of an unknown name


def scenario_names() -> dict[str, str]:
    """Return the questions of shipped scenarios, keyed and sorted by name."""
    names = {}
    for path in sorted(_folder().glob("*.toml")):
        names[path.stem] = str(_parse(path.read_bytes(), str(path))["question"])
    return names


def _folder() -> Path:
    return Path(str(files("fcu_emulator.scenarios")))


def is_path(name: str | os.PathLike[str]) -> bool:
    """Return whether this is a path, not a name."""
    text = os.fspath(name)
    return not isinstance(name, str) or text.endswith(".toml") or "/" in text or os.sep in text


def _shipped(name: str) -> Path:
    known = [path.stem for path in sorted(_folder().glob("*.toml"))]
    if name in known:
        return _folder() / f"{name}.toml"
    near = difflib.get_close_matches(name[:_SHOWN], known, n=1)
    hint = f"did you mean {near[0]}? " if near else ""
    raise InputError(
        f"unknown scenario {name[:_SHOWN]!r}; {hint}known: {', '.join(known)}; the name of a file must end in .toml",
        kind="unknown_scenario",
    )


# -- Read the file ------------------------------------------------------------------------------------------


_MOST_DOTS = 64  # for each line; the time of tomllib is cubic in the number of a key's parts
_MOST_LINES = 20_000


def read_toml(path: Path, what: str) -> dict[str, Any]:
    """Read a TOML file. ``what`` describes the file in errors. Raises ScenarioError."""
    file = str(path)
    try:
        data = read_bounded(path, file, what)
    except ValueError as error:  # the text already names the path
        raise ScenarioError(file, "", str(error).removeprefix(f"{file} "), kind="unusable_file") from error
    return _parse(data, file)


def _parse(data: bytes, file: str) -> dict[str, Any]:
    try:
        text = data.decode("utf-8")
    except UnicodeDecodeError as error:
        problem = f"must be UTF-8 text, unlike byte {error.start}; give a TOML file"
        raise ScenarioError(file, "", problem, kind="not_utf8") from error
    lines = text.split("\n")
    if len(lines) > _MOST_LINES:
        raise ScenarioError(file, "", f"must have at most {_MOST_LINES} lines", kind="too_many_lines")
    for number, line in enumerate(lines, start=1):
        if line.count(".") > _MOST_DOTS:
            raise ScenarioError(
                file, "", f"line {number} must have at most {_MOST_DOTS} dots", kind="too_many_dots"
            )
    try:
        return tomllib.loads(text)
    except RecursionError as error:
        raise ScenarioError(file, "", "must have at most four levels of tables", kind="too_deep") from error
    except ValueError as error:  # TOMLDecodeError, or ValueError for a number of thousands of digits
        problem = re.sub(r"\s+", " ", str(error))
        raise ScenarioError(file, "", f"must be valid TOML: {problem}", kind="invalid_toml") from error


# -- Draw random numbers ------------------------------------------------------------------------------------


_DRAWN_IN = ("world", "timeline", "threshold")
_DRAW_KEYS = {"uniform", "one_of", "random_sign"}
_RENAMED = {"draw": "uniform", "either_sign": "random_sign"}
_DRAWN_DIGITS = 2  # decimals of a drawn number, so that it is easy to read
_DRAW_RIGHT = "'uniform = [min, max]' with two numbers or durations, or 'one_of = [...]'"

Pick: TypeAlias = Callable[[str, int], float]
"""Function ``pick(path, purpose)``. It returns a position in a range, 0 to 1, for a key path."""


def _by_seed(seed: int, name: str) -> Pick:
    return lambda path, purpose: random.Random(f"{seed}/{name}/{path}/{purpose}").random()


def _lowest(path: str, purpose: int) -> float:
    del path, purpose
    return 0.0


def _highest(path: str, purpose: int) -> float:
    del path, purpose
    return 1.0 - 2**-53


def _has_draws(table: Mapping[str, Any]) -> bool:
    return "threshold" in table or any(_any_draw(table.get(place)) for place in _DRAWN_IN)


def drawn(table: Mapping[str, Any], pick: Pick, file: str) -> dict[str, Any]:
    """Replace each description of a random number by a number. Raises ScenarioError."""
    changed = dict(table)
    for place in _DRAWN_IN:
        if place in table:
            changed[place] = _replaced(table[place], pick, file, place)
    return changed


def _any_draw(value: Any) -> bool:
    if isinstance(value, list):
        return any(map(_any_draw, value))
    return isinstance(value, dict) and (_is_draw(value) or any(map(_any_draw, value.values())))


def _is_draw(value: Any) -> bool:
    return isinstance(value, dict) and bool(value.keys() & {*_DRAW_KEYS, *_RENAMED})


def _replaced(value: Any, pick: Pick, file: str, path: str) -> Any:
    if isinstance(value, list):
        return [_replaced(one, pick, file, f"{path}[{index}]") for index, one in enumerate(value)]
    if not isinstance(value, dict):
        return value
    if not _is_draw(value):
        return {key: _replaced(one, pick, file, f"{path}.{key}") for key, one in value.items()}
    try:
        return _draw(value, lambda purpose: pick(path, purpose))
    except ValueError as error:
        raise ScenarioError(file, path, str(error), kind="draw") from error


def _draw(value: dict[str, Any], pick: Callable[[int], float]) -> Any:
    if value.keys() & _RENAMED.keys():
        value = with_current_keys(value, _RENAMED)
    if len(value.keys() & {"uniform", "one_of"}) != 1 or not value.keys() <= _DRAW_KEYS:
        raise ValueError(f"must be {_DRAW_RIGHT}, not {shown(value)}")
    if not isinstance(value.get("random_sign", False), bool):
        raise ValueError(f"'random_sign' must be true or false, not {shown(value['random_sign'])}")
    if "one_of" in value:
        choices = value["one_of"]
        if not isinstance(choices, list) or not choices:
            raise ValueError(f"'one_of' must be an array with at least one value, not {shown(choices)}")
        result = choices[int(pick(0) * len(choices))]
    else:
        result = _between(value["uniform"], pick(0))
    if value.get("random_sign", False):
        if not _is_number(result):
            raise ValueError("must draw a number, because 'random_sign' is given")
        result = result if pick(1) < 0.5 else -result
    return result


def _between(ends: Any, share: float) -> Any:
    if not isinstance(ends, list) or len(ends) != 2:
        raise ValueError(f"must be {_DRAW_RIGHT}, not uniform = {shown(ends)}")
    low, high = ends
    if all(isinstance(end, str) for end in ends):
        least, most = (parse_duration(end) for end in ends)
        _refuse_order(least <= most, ends)
        step = PS_PER_MS if (most - least) >= PS_PER_MS else 1
        return format_duration(least + int(share * (most - least)) // step * step)
    if not all(map(_is_number, ends)):
        raise ValueError(f"must be {_DRAW_RIGHT}, not uniform = {shown(ends)}")
    _refuse_order(low <= high, ends)
    return min(max(round(low + share * (high - low), _DRAWN_DIGITS), low), high)


def _refuse_order(in_order: bool, ends: Any) -> None:
    if not in_order:
        raise ValueError(f"'uniform' must have the smaller value first, not {shown(ends)}")


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


# -- Report errors: pydantic's errors as one line with a key path -------------------------------------------


_TAGGED = {"timeline", "expect"}  # for these tables, pydantic's path has an index and a tag

_WANTED = {
    "float_type": "a number",
    "int_type": "a whole number",
    "string_type": "text in quotes",
    "bool_type": "true or false",
    "date_type": "a date without quotes, such as 2026-03-01",
    "finite_number": "a finite number",
    "list_type": "an array of tables",
    "tuple_type": "an array of numbers",
    "model_type": "a table",
    "model_attributes_type": "a table",
}


def scenario_error(file: str, error: ValidationError) -> ScenarioError:
    """Return an error with the first problem and the number of other problems."""
    problems = error.errors(include_url=False)
    path, text = _explain(problems[0])
    others = len(problems) - 1
    more = f" ({others} more error{'s' if others > 1 else ''} in this file)" if others else ""
    return ScenarioError(file, _key_path(path), text + more, kind=problems[0]["type"])


def _key_path(path: list[str | int]) -> str:
    text = ""
    for part in path:
        if isinstance(part, int):
            text += f"[{part}]"
        else:
            text += f".{_printable(part)}" if text else _printable(part)
    return text


def _explain(problem: Any) -> tuple[list[str | int], str]:
    kind, context = problem["type"], problem.get("ctx", {})
    path = _without_tags(list(problem["loc"]))
    if kind == "unknown_key":
        return [*path, context["key"]], context["problem"]
    if kind in ("union_tag_invalid", "union_tag_not_found"):
        return [*path, context["discriminator"].strip("'")], _tag_problem(problem)
    return path, _value_problem(kind, context, problem)


def _value_problem(kind: str, context: dict[str, Any], problem: Any) -> str:
    if kind == "value_error":
        return str(context["error"])
    if kind == "missing":
        return "is missing"
    if kind == "too_long":
        return f"must have at most {context['max_length']} entries"
    wanted = _WANTED.get(kind)
    if kind == "literal_error":
        wanted = f"{context['expected']}"
    elif kind in ("greater_than_equal", "greater_than"):
        wanted = _bound(context, "ge", "at least", "gt", "above")
    elif kind in ("less_than_equal", "less_than"):
        wanted = _bound(context, "le", "at most", "lt", "below")
    elif kind == "string_pattern_mismatch":
        wanted = f"text that matches {context['pattern']}"
    elif kind in ("string_too_short", "string_too_long"):
        length = _bound(context, "min_length", "at least", "max_length", "at most")
        wanted = f"{length} character{'s' * (not length.endswith(' 1'))} long"
    elif wanted is None:
        return f"must not be {shown(problem['input'])}: {problem['msg']}"
    return f"must be {wanted}, not {shown(problem['input'])}"


def _bound(context: Mapping[str, Any], key: str, word: str, other_key: str, other_word: str) -> str:
    """Describe in words the limit that an error of pydantic contains."""
    return f"{word} {context[key]:.15g}" if key in context else f"{other_word} {context[other_key]:.15g}"


def _tag_problem(problem: Any) -> str:
    context = problem["ctx"]
    if problem["type"] == "union_tag_not_found":
        return "is missing"
    known = context["expected_tags"].replace("'", "")
    return f"unknown {shown(context['tag'])}; known: {known}"


def _without_tags(path: list[str | int]) -> list[str | int]:
    tags = {
        place + 2
        for place, (array, index) in enumerate(pairwise(path))
        if array in _TAGGED and isinstance(index, int)
    }
    return [part for place, part in enumerate(path) if place not in tags]


def _printable(part: str) -> str:
    return part if part.isidentifier() and len(part) <= 40 else shown(part)
