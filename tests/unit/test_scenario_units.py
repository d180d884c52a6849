"""Durations and bus speeds in the notation of scenario files."""

from __future__ import annotations

import re

import pytest
from hypothesis import given
from hypothesis import strategies as st

from fcu_emulator.emulator.clock import format_duration, parse_duration
from fcu_emulator.emulator.scenario.fields import parse_bus_speed, parse_length
from tests.support.words import Words

PS_PER_S = 10**12


@pytest.mark.parametrize(
    ("text", "picoseconds"),
    [
        ("50ms", 50 * 10**9),
        ("2s", 2 * PS_PER_S),
        ("1.5s", 1_500 * 10**9),
        ("10us", 10 * 10**6),
        ("1min", 60 * PS_PER_S),
        ("2 h", 7200 * PS_PER_S),
        ("0s", 0),
        ("0.1s", 10**11),  # exact: 0.1 is no binary fraction
    ],
)
def test_duration_is_exact_in_picoseconds(text: str, picoseconds: int) -> None:
    assert parse_duration(text) == picoseconds


@pytest.mark.parametrize("value", [5, 0.5, pytest.param(10**5000, id="huge")])
def test_bare_number_is_refused_with_units(value: object, words: Words) -> None:
    with pytest.raises(ValueError, match='"50ms"') as refused:
        parse_duration(value)
    words("scenario", str(refused.value))


@pytest.mark.parametrize(
    "value",
    [
        "",
        "s",
        "-1s",
        "1e3s",
        "nan s",
        "inf s",
        "1 S",
        "1s ",
        "1,5s",
        "1_0s",
        "\u0661s",
        "9" * 50 + "s",
        None,
        True,
    ],
)
def test_invalid_duration_is_refused_with_example(value: object) -> None:
    with pytest.raises(ValueError, match='"50ms"'):
        parse_duration(value)


def test_zero_duration_is_refused() -> None:
    with pytest.raises(ValueError, match='"1us"'):
        parse_length("0s")
    assert parse_length("1us") == 10**6


@pytest.mark.parametrize(("text", "hertz"), [("400kHz", 400_000), ("10kHz", 10_000), ("1MHz", 1_000_000)])
def test_bus_speeds_are_parsed(text: str, hertz: int) -> None:
    assert parse_bus_speed(text) == hertz


@pytest.mark.parametrize("value", [400_000, "400", "9.9kHz", "1.1MHz", "400khz", "fast"])
def test_invalid_bus_speed_is_refused_with_example(value: object) -> None:
    with pytest.raises(ValueError, match=re.compile("kHz")):
        parse_bus_speed(value)


@given(st.integers(0, 10**18))
def test_formatted_duration_can_be_read_back(duration_ps: int) -> None:
    assert parse_duration(format_duration(duration_ps)) == duration_ps
