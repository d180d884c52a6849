"""Trial programs that do not solve a lab. If they earn points, the rubric gives these points without a solution.

The trial programs are the template, and programs that print nothing or only zeros.

Decision: the trial programs are generated for each rubric, because they print the lines of the
rubric. These programs are Python firmware, so that no compiler is needed.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from fcu_emulator.emulator.assembly.board import Board
from fcu_emulator.emulator.assembly.firmware import FirmwareFactory
from fcu_emulator.emulator.grading.judge import judge
from fcu_emulator.emulator.grading.rubric import Rubric
from fcu_emulator.emulator.grading.verdict import Verdict
from fcu_emulator.emulator.python_cpu.hal import VirtualHal
from fcu_emulator.emulator.scenario.expectations import (
    ExpectField,
    ExpectLine,
    ExpectPrinted,
    ExpectRegex,
    ExpectWithin,
)
from fcu_emulator.emulator.scenario.fields import TextPattern, TimeBudget
from fcu_emulator.emulator.scenario.following import ExpectLineFollows
from fcu_emulator.emulator.scenario.formats import printed_with_zeros

_EVERY_MS = 300
_TRANSMIT_MS = 1_000
_ANCHORS = re.compile(r"^\^|\$$")


@dataclass(frozen=True)
class Trial:
    """A trial program and its verdict."""

    program: str
    verdict: Verdict

    @property
    def earned(self) -> dict[str, float]:
        return {check.check: check.points for check in self.verdict.checks if check.points}


class _Constant:
    def __init__(self, hal: VirtualHal, lines: Sequence[str], lit: bool) -> None:
        self._hal = hal
        self._lines = lines
        self._lit = lit

    def main(self) -> None:
        for port, pin in Board.description.leds.values():
            self._hal.HAL_GPIO_Init(port, pin)
            self._hal.HAL_GPIO_WritePin(port, pin, 0 if self._lit else 1)
        while True:
            for line in self._lines:
                self._hal.HAL_UART_Transmit(f"{line}\n\r".encode("latin-1", "replace"), _TRANSMIT_MS)
            self._hal.HAL_Delay(_EVERY_MS)

    def HAL_TIM_PeriodElapsedCallback(self) -> None:
        """Do nothing: no timer runs."""


def _constant(lines: Sequence[str], lit: bool) -> FirmwareFactory:
    return lambda hal: _Constant(hal, lines, lit)


def trials(rubric: Rubric, template: str, seed: int = 0) -> Iterator[Trial]:
    """Judge the firmware ``template`` and the trial programs."""
    yield Trial("the template", judge(template, rubric, seed=seed))
    for printing, lines in (("prints nothing", []), ("prints each line continuously", lines_of(rubric))):
        for lit in (False, True):
            name = f"{printing}, LEDs {'on' if lit else 'off'}"
            yield Trial(name, judge(_constant(lines, lit), rubric, seed=seed))


def lines_of(rubric: Rubric) -> list[str]:
    """Return each expected line one time, with 0 for all numbers."""
    found: dict[str, None] = {}
    for exercise in rubric.exercises:
        for check in exercise.check:
            for one in check.expect:
                line = _line(one)
                if line:
                    found[line] = None
    return list(found)


def _line(expectation: object) -> str:
    if isinstance(expectation, ExpectLine):
        return expectation.text.strip()
    if isinstance(expectation, ExpectField | ExpectPrinted | ExpectWithin):
        if expectation.pattern is None:
            return printed_with_zeros(expectation.number_format().text)
        return _matching(expectation.pattern)
    if isinstance(expectation, ExpectLineFollows) and expectation.text is not None:
        return expectation.text.strip()
    if isinstance(expectation, ExpectRegex | ExpectLineFollows) and expectation.pattern is not None:
        return _matching(expectation.pattern)
    return ""


def _matching(pattern: TextPattern) -> str:
    plain = re.sub(r"\(\?P<\w+>", "(", _ANCHORS.sub("", pattern.text))
    plain = re.sub(r"\((?:[^()]*\\d[^()]*|[^()]*\[0-9\][^()]*)\)", "0", plain)
    plain = re.sub(r"(?:-\?)?(?:\\d|\[0-9\])[+*]?", "0", plain).replace("\\", "")
    try:
        return plain if pattern.found_in(plain, TimeBudget()) else ""
    except TimeoutError:
        return ""
