"""Comparison of two runs on the same scenario.

For each sequence, the n-th entries of both runs are compared: first the text, then the pace (time
since the previous entry).

Decision: comparisons use the pace, not the time since power-on, because compiled code runs 2 %
slower than the Python firmware.

Decision: entries are compared by position and not aligned by a diff algorithm, because the first
mistake causes all later mistakes.

Decision: both sequences are compared up to the same time, not up to the same number of entries.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import zip_longest
from typing import Literal, TypeAlias

from fcu_emulator.emulator.analysis.observation import (
    END,
    REGISTERS,
    TERMINAL,
    TIMER,
    Observation,
    ObservedItem,
    is_led,
)
from fcu_emulator.emulator.clock import PS_PER_MS, PS_PER_S
from fcu_emulator.emulator.errors import InputError
from fcu_emulator.emulator.scenario.run_view import FIELDS, FORMATS, deviation, same_banner

Ignorable: TypeAlias = Literal["time", "numbers", "registers", "leds"]

TIMING_PS = 20 * PS_PER_MS
"""Tolerance of the pace: a few callbacks, far below the lab's period of 1 s."""

_LOOP_PS = 2 * PS_PER_S  # one period of the lab's main loop, including text, with a margin
_DRIFT = 25  # a run may be late by 1/25 of its duration
_CONTEXT = 3
_SAME_AFTER = 8  # if one run has an additional entry, number of entries after it that must be equal
_COUNTS = re.compile(r"(\d+) ticks, (\d+) lost")
_NEGATIVE_ZERO = re.compile(r"-(?=0(?:\.0+)?(?![\d.]))")
"""The minus sign of a zero. Comparisons ignore it: -0.0f equals 0.0f, and -0 equals 0."""
_NUMBER = re.compile(r"-?(?:\d+(?:\.\d+)?|inf|nan)\b")


@dataclass(frozen=True)
class Rules:
    """Rules of equality.

    ``timing_ps``: tolerance of the pace. ``tolerance``: tolerance of the numbers of each field
    ("ACC.x", "Yaw"), in printed units. ``ignore``: properties not to compare.
    """

    timing_ps: int = TIMING_PS
    tolerance: Mapping[str, float] = field(default_factory=dict)
    ignore: Collection[Ignorable] = frozenset()


@dataclass(frozen=True)
class Difference:
    """A difference at entry ``index``.

    ``first`` and ``second`` are the runs' entries, or None if missing. ``before`` holds the pairs
    of equal entries before the difference.
    """

    sequence: str
    index: int
    first: ObservedItem | None
    second: ObservedItem | None
    before: Sequence[tuple[ObservedItem, ObservedItem]] = ()
    inserted: bool = False
    """Whether the following entries are equal again."""

    @property
    def at_ps(self) -> int:
        return min(entry.at_ps for entry in (self.first, self.second) if entry is not None)

    @property
    def only_time(self) -> bool:
        return self.first is not None and self.second is not None and self.first.text == self.second.text

    def paces_ps(self) -> tuple[int, int]:
        assert self.first is not None
        assert self.second is not None
        one, other = self.before[-1] if self.before else (_POWER_ON, _POWER_ON)
        return self.first.at_ps - one.at_ps, self.second.at_ps - other.at_ps


_POWER_ON = ObservedItem(0, "")


def compare(first: Observation, second: Observation, rules: Rules | None = None) -> list[Difference]:
    """Return the first difference of each common sequence, ordered by time."""
    rules = rules or Rules()
    end_ps = min(first.end_ps, second.end_ps)
    found = (
        _first_difference(name, first.sequences[name], second.sequences[name], rules, end_ps)
        for name in compared(first, second, rules)
    )
    return sorted((one for one in found if one is not None), key=lambda one: one.at_ps)


def compared(first: Observation, second: Observation, rules: Rules) -> list[str]:
    """Return the names of the sequences to compare."""
    return [
        name
        for name in first.sequences
        if name in second.sequences
        and not ("registers" in rules.ignore and name.endswith(REGISTERS))
        and not ("leds" in rules.ignore and is_led(name))
    ]


def tolerances(given: Iterable[tuple[str, float]]) -> dict[str, float]:
    """Return tolerances by field. The name "ACC" selects the three fields of the accelerometer. Raises InputError."""
    chosen: dict[str, float] = {}
    for name, value in given:
        fields = [one for one in FIELDS if name in (one, one.split(".")[0])]
        if not fields:
            raise InputError(f"unknown field {name!r}; known: {', '.join(FIELDS)}, or ACC, GYR, MAG")
        if not 0 <= value < float("inf"):
            raise InputError(f"tolerance of {name} must be a number of 0 or more, not {value}")
        chosen.update(dict.fromkeys(fields, value))
    return chosen


def largest_deviations(first: Observation, second: Observation) -> dict[str, float]:
    """Return the largest difference of each printed field, in printed units."""
    largest: dict[str, float] = {}
    for one, other in zip(first.sequences[TERMINAL], second.sequences[TERMINAL], strict=False):
        if one.cut or other.cut or _without_numbers(one.text) != _without_numbers(other.text):
            break
        for name, apart in _deviations(one.text, other.text):
            largest[name] = max(largest.get(name, 0.0), apart)
    return largest


SINGLE_PRECISION = {"Pitch": 1e-4, "Roll": 1e-4, "Yaw": 0.01, "Altitude": 0.02}
"""Largest difference between the lab's results in float and in double, on the same samples."""


# -- equality -----------------------------------------------------------------------------------------------


def _first_difference(
    name: str, first: Sequence[ObservedItem], second: Sequence[ObservedItem], rules: Rules, end_ps: int
) -> Difference | None:
    grace_ps = 0 if name == END else _grace_ps(rules, end_ps)
    before: list[tuple[ObservedItem, ObservedItem]] = []
    for index, (one, other) in enumerate(zip_longest(first, second)):
        difference = Difference(name, index, one, other, tuple(before[-_CONTEXT:]))
        if one is None or other is None:
            return difference if difference.at_ps <= end_ps - grace_ps else None
        if not _same_entry(name, one, other, rules, end_ps):
            return _inserted(difference, first[index:], second[index:], rules) or difference
        if name != TIMER and not _same_pace(difference, rules):
            return difference
        before.append((one, other))
    return None


def _inserted(
    difference: Difference, first: Sequence[ObservedItem], second: Sequence[ObservedItem], rules: Rules
) -> Difference | None:
    if _runs_on(first[1:], second, rules):
        return replace(difference, second=None, inserted=True)
    if _runs_on(first, second[1:], rules):
        return replace(difference, first=None, inserted=True)
    return None


def _runs_on(first: Sequence[ObservedItem], second: Sequence[ObservedItem], rules: Rules) -> bool:
    """Return whether so many equal entries follow that the match is not accidental."""
    pairs = list(zip(first[:_SAME_AFTER], second[:_SAME_AFTER], strict=False))
    texts = {one.text.strip() for one, _ in pairs}
    return len(pairs) >= 2 and len(texts) >= 2 and all(_same_text(one, other, rules) for one, other in pairs)


def _same_entry(name: str, one: ObservedItem, other: ObservedItem, rules: Rules, end_ps: int) -> bool:
    counts = _COUNTS.fullmatch(one.text), _COUNTS.fullmatch(other.text)
    if name != TIMER or counts[0] is None or counts[1] is None:
        return _same_text(one, other, rules)
    (ticks, lost), (other_ticks, other_lost) = (map(int, count.groups()) for count in counts if count)
    most = max(ticks, other_ticks)
    # maximum number of ticks between the starts of the two timers
    late = most * _grace_ps(rules, end_ps) / max(end_ps, 1)
    return abs(ticks - other_ticks) <= late + 1 and abs(lost - other_lost) <= most / 100


def _grace_ps(rules: Rules, end_ps: int) -> int:
    """Return the largest allowed lag between the runs at the end."""
    return _LOOP_PS if "time" in rules.ignore else rules.timing_ps + end_ps // _DRIFT


def _same_pace(pair: Difference, rules: Rules) -> bool:
    one_ps, other_ps = pair.paces_ps()
    return "time" in rules.ignore or abs(one_ps - other_ps) <= rules.timing_ps


def _same_text(one: ObservedItem, other: ObservedItem, rules: Rules) -> bool:
    text, wanted = (_NEGATIVE_ZERO.sub("", same_banner(entry.text)) for entry in (one, other))
    if one.cut or other.cut:
        return _same_beginning(text, wanted, rules)
    if "numbers" in rules.ignore:
        text, wanted = _without_numbers(text), _without_numbers(wanted)
    return text == wanted or _within(text, wanted, rules.tolerance)


def _same_beginning(text: str, wanted: str, rules: Rules) -> bool:
    """Compare a truncated line. The number at the end of this line may be incomplete."""
    if text.startswith(wanted) or wanted.startswith(text):
        return True
    if not rules.tolerance and "numbers" not in rules.ignore:
        return False
    short, long = sorted((_without_numbers(text).rstrip("#"), _without_numbers(wanted)), key=len)
    return long.startswith(short)


def _within(one: str, other: str, tolerance: Mapping[str, float]) -> bool:
    if not tolerance or _without_numbers(one) != _without_numbers(other):
        return False
    apart = dict(_deviations(one, other))
    return bool(apart) and all(value <= tolerance.get(name, 0.0) for name, value in apart.items())


def _deviations(one: str, other: str) -> Iterator[tuple[str, float]]:
    for line_format in FORMATS:
        fields, others = (line_format.parse(text.strip()) for text in (one, other))
        if fields is not None and others is not None:
            for name, value in fields.items():
                yield name, abs(deviation(name, value, others[name]))


def _without_numbers(text: str) -> str:
    return _NUMBER.sub("#", text)
