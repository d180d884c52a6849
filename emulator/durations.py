"""Durations as people write them: a number with its unit."""

from __future__ import annotations

import math
import re

_UNITS_S = {"us": 1e-6, "ms": 1e-3, "s": 1.0, "min": 60.0, "h": 3600.0}
_PATTERN = re.compile(r"(\d+(?:\.\d*)?|\.\d+)\s*(us|ms|s|min|h)", re.ASCII)
_LONGEST_S = 1e6  # eleven days of virtual time


def seconds(text: str) -> float:
    """Seconds of ``"10s"``, ``"50ms"``, ``"10us"``, ``"2min"`` or ``"1h"``. Raises ValueError in one line."""
    match = _PATTERN.fullmatch(text.strip())
    if match is None:
        raise ValueError(
            f'{text!r} is not a duration; write a number with its unit (us, ms, s, min, h), such as "10s"'
        )
    value = float(match[1]) * _UNITS_S[match[2]]
    if not math.isfinite(value) or value > _LONGEST_S:
        raise ValueError(f"{text!r} is too long; the longest is {_LONGEST_S:g} s")
    return value
