"""Numbers that are drawn from the seed: motions that nobody can know before the board is made.

Wherever a scenario's ``[world]`` and ``[[timeline]]`` have a number or a duration, they may have a draw::

    pitch_deg = { draw = [20, 70], either_sign = true }   # 20 to 70, or -70 to -20
    for = { draw = ["1s", "3s"] }
    metres = { one_of = [3, 4.5] }

What is drawn is checked as if it stood in the file, and the world refuses what is not possible, so a scenario
with draws is also tried with the ends of all its draws when it is read.

Decision: each number comes from the seed, the scenario's name and its own key path, by SHA-512
(:class:`random.Random` with a text as seed), so that it is the same on every machine and version of Python,
and does not change when another entry is added after it. The road not taken, a motion of random poses as an
entry of its own, cannot say which of its numbers matter.
"""

from __future__ import annotations

import random
from collections.abc import Callable, Mapping
from typing import Any, TypeAlias

from emulator.errors import ScenarioError
from emulator.text import shown
from emulator.time.clock import PS_PER_MS, format_duration, parse_duration

_PLACES = ("world", "timeline")
_KEYS = {"draw", "one_of", "either_sign"}
_DIGITS = 2  # of a drawn number, after the point: it is read by people, too

Pick: TypeAlias = Callable[[str, int], float]
"""By a key path and a purpose, where in a range from 0 to 1."""


def by_seed(seed: int, name: str) -> Pick:
    """What the seed draws in the scenario ``name``."""
    return lambda path, purpose: random.Random(f"{seed}/{name}/{path}/{purpose}").random()


def lowest(path: str, purpose: int) -> float:
    """The least that each draw can give."""
    del path, purpose
    return 0.0


def highest(path: str, purpose: int) -> float:
    """The most that each draw can give."""
    del path, purpose
    return 1.0 - 2**-53


def has_draws(table: Mapping[str, Any]) -> bool:
    """Whether anything of a scenario's table depends on the seed."""
    return any(_any_draw(table.get(place)) for place in _PLACES)


def drawn(table: Mapping[str, Any], pick: Pick, file: str) -> dict[str, Any]:
    """A scenario's table with numbers instead of draws. Raises ScenarioError for a draw that is wrong."""
    changed = dict(table)
    for place in _PLACES:
        if place in table:
            changed[place] = _replaced(table[place], pick, file, place)
    return changed


def _any_draw(value: Any) -> bool:
    if isinstance(value, list):
        return any(map(_any_draw, value))
    return isinstance(value, dict) and (_is_draw(value) or any(map(_any_draw, value.values())))


def _is_draw(value: Any) -> bool:
    return isinstance(value, dict) and bool(value.keys() & _KEYS)


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
        raise ScenarioError(file, path, str(error)) from error


_HELP = "give draw = [least, most], two numbers or two durations, or one_of = [...]"


def _draw(value: dict[str, Any], pick: Callable[[int], float]) -> Any:
    if len(value.keys() & {"draw", "one_of"}) != 1 or not value.keys() <= _KEYS:
        raise ValueError(f"is {shown(value)}; {_HELP}")
    if not isinstance(value.get("either_sign", False), bool):
        raise ValueError(f"has either_sign = {shown(value['either_sign'])}; give true or false")
    if "one_of" in value:
        choices = value["one_of"]
        if not isinstance(choices, list) or not choices:
            raise ValueError(f"has one_of = {shown(choices)}; give an array of what may be chosen")
        result = choices[int(pick(0) * len(choices))]
    else:
        result = _between(value["draw"], pick(0))
    if value.get("either_sign", False):
        if not _is_number(result):
            raise ValueError("has either_sign, and what is drawn is no number")
        result = result if pick(1) < 0.5 else -result
    return result


def _between(ends: Any, share: float) -> Any:
    if not isinstance(ends, list) or len(ends) != 2:
        raise ValueError(f"has draw = {shown(ends)}; {_HELP}")
    low, high = ends
    if all(isinstance(end, str) for end in ends):
        least, most = (parse_duration(end) for end in ends)
        _refuse_order(least <= most, ends)
        step = PS_PER_MS if (most - least) >= PS_PER_MS else 1
        return format_duration(least + int(share * (most - least)) // step * step)
    if not all(map(_is_number, ends)):
        raise ValueError(f"has draw = {shown(ends)}; {_HELP}")
    _refuse_order(low <= high, ends)
    return min(max(round(low + share * (high - low), _DIGITS), low), high)


def _refuse_order(in_order: bool, ends: Any) -> None:
    if not in_order:
        raise ValueError(f"has draw = {shown(ends)}, the larger one first; give the least first")


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)
