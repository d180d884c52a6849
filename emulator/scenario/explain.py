"""What pydantic found wrong, as one line with a key path."""

from __future__ import annotations

from typing import Any

from pydantic import ValidationError

from emulator.errors import ScenarioError
from emulator.time.durations import shown

_TAGGED = {"timeline", "expect"}  # arrays whose entries pydantic's path names by index and tag

_WANTED = {
    "float_type": "give a number",
    "int_type": "give a whole number",
    "string_type": "give a text in quotes",
    "bool_type": "give true or false",
    "date_type": "give a date without quotes, such as 2026-03-01",
    "finite_number": "give a finite number",
    "list_type": "give an array of tables",
    "tuple_type": "give an array of numbers",
    "model_type": "give a table",
    "model_attributes_type": "give a table",
}


def scenario_error(file: str, error: ValidationError) -> ScenarioError:
    """The first problem; how many more there are stands behind it."""
    problems = error.errors(include_url=False)
    path, text = _explain(problems[0])
    more = f" (and {len(problems) - 1} more)" if len(problems) > 1 else ""
    return ScenarioError(file, key_path(path), text + more)


def key_path(path: list[str | int]) -> str:
    """``timeline[2].for`` from its parts."""
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
        return f"has more than {context['max_length']} entries"
    wanted = _WANTED.get(kind)
    if kind == "literal_error":
        wanted = f"give {context['expected']}"
    elif kind in ("greater_than_equal", "greater_than"):
        wanted = f"give {context.get('ge', context.get('gt'))} or more"
    elif kind in ("less_than_equal", "less_than"):
        wanted = f"give {context.get('le', context.get('lt'))} or less"
    elif wanted is None:
        wanted = problem["msg"][0].lower() + problem["msg"][1:]
    return f"is {shown(problem['input'])}; {wanted}"


def _tag_problem(problem: Any) -> str:
    context = problem["ctx"]
    if problem["type"] == "union_tag_not_found":
        return "is missing"
    known = context["expected_tags"].replace("'", "")
    return f"is {shown(context['tag'])}; known: {known}"


def _without_tags(path: list[str | int]) -> list[str | int]:
    if len(path) > 2 and path[0] in _TAGGED and isinstance(path[1], int):
        del path[2]
    return path


def _printable(part: str) -> str:
    """A key from the file: bounded, on one line."""
    return part if part.isidentifier() and len(part) <= 40 else shown(part)
