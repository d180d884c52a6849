"""Diagnoses that explain failed checks.

Decision: a diagnosis of a LED is omitted if no failed check is about this LED, because each run of
an exercise shows all LEDs.
"""

from __future__ import annotations

import re
from collections.abc import Iterable

from fcu_emulator.emulator.grading.verdict import CheckResult, DiagnosedCause

_LED = re.compile(r"\bLED\d*\b")


def relevant_causes(causes: Iterable[DiagnosedCause], failed: Iterable[CheckResult]) -> list[DiagnosedCause]:
    """Return the failed checks' distinct causes, fatal causes first."""
    about = {led for check in failed for led in _leds(f"{check.title} {check.expected} {check.actual}")}
    found: dict[str, DiagnosedCause] = {}
    for cause in causes:
        named = _leds(cause.summary)
        if cause.fatal or not named or named & about:
            found.setdefault(_without_numbers(cause.summary), cause)
    return sorted(found.values(), key=lambda cause: not cause.fatal)


def _leds(text: str) -> set[str]:
    return set(_LED.findall(text))


def _without_numbers(text: str) -> str:
    """Return the text without numbers. Keep the numbers of LEDs."""
    leds = sorted(_leds(text))
    return " ".join([*leds, "".join(char for char in text if not char.isdigit())])
