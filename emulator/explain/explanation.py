"""Explain wrong printed numbers: the line that computes another formula than the lab, and that formula.

::

    arithmetic = load_rubric("lab3").explain.arithmetic()
    for one in explain_numbers("lab3.elf", arithmetic, [Output("3.yaw", "yaw_deg", "Yaw", yaw)], Limits()):
        print(one.diagnosis)
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final, Protocol

import numpy as np

from fcu_emulator.emulator.chip.diagnosis.backtrace import Places
from fcu_emulator.emulator.chip.diagnosis.printing import PrintedLines
from fcu_emulator.emulator.chip.diagnosis.report import Diagnosis
from fcu_emulator.emulator.chip.firmware import Limits
from fcu_emulator.emulator.explain.alignment import Alignment, Formulas, Mistake, PrintedNumbers
from fcu_emulator.emulator.explain.expression import Name, Node, names, text
from fcu_emulator.emulator.explain.probe import POSES, Probed, Register, probe
from fcu_emulator.emulator.explain.search import ValueSearch

_MOST_LINES: Final = 200


class NumberFormat(Protocol):
    """Finds a number in a printed line."""

    def number(self, line: str) -> float | None:
        """Return the number; None if the line has another format."""
        ...


@dataclass(frozen=True)
class Arithmetic:
    """A lab's arithmetic as data: inputs, formulas in their order, and other formulas that are right as well."""

    inputs: Mapping[str, Register]
    formulas: Formulas
    alternatives: Sequence[Formulas] = ()


@dataclass(frozen=True)
class Output:
    """A printed number of a failed check, by its title such as ``Yaw``, and the step that it shows.

    ``alternatives``: whether the arithmetic's other formulas are right for this check.
    """

    check: str
    step: str
    title: str
    number_format: NumberFormat
    alternatives: bool = True


@dataclass(frozen=True)
class Explanation:
    """Why an output is wrong."""

    check: str
    mistake: Mistake
    diagnosis: Diagnosis


def explain_numbers(
    firmware: str | Path, arithmetic: Arithmetic, outputs: Iterable[Output], limits: Limits
) -> list[Explanation]:
    """Return explanations of wrong outputs, each mistake once, in the order of the formulas.

    Empty if no mistake explains them, or if the firmware fails in one of the poses.
    """
    probed = probe(firmware, arithmetic.inputs, limits)
    if probed is None:
        return []
    found: dict[tuple[str, Node], Explanation] = {}
    explainer = _Explainer(probed, arithmetic)
    for output in outputs:
        for one in explainer.explain(output):
            found.setdefault((one.mistake.step, one.mistake.computed), one)
    order = list(arithmetic.formulas)
    return sorted(found.values(), key=lambda one: order.index(one.mistake.step))


@dataclass
class _Explainer:
    probed: Probed
    arithmetic: Arithmetic
    search: ValueSearch = field(init=False)
    places: Places = field(init=False)

    def __post_init__(self) -> None:
        self.search = ValueSearch(self.probed.logs)
        self.places = Places(self.probed.image)
        main, *others = (
            self._alignment({**self.arithmetic.formulas, **changed})
            for changed in ({}, *self.arithmetic.alternatives)
        )
        self.main, self.others = main, others

    def _alignment(self, formulas: Formulas) -> Alignment:
        return Alignment(formulas, self.probed.inputs, self.search, len(POSES))

    def explain(self, output: Output) -> Iterator[Explanation]:
        """Yield the mistakes behind a wrong output; nothing if it is right, constant or not printed."""
        printed, line = self._printed(output)
        if printed is None:
            return
        allowed = [self.main, *(self.others if output.alternatives else ())]
        if any(one.agrees(output.step, printed) for one in allowed):
            return
        for other in self.others if not output.alternatives else ():
            if other.agrees(output.step, printed):
                mistake = self.main.difference(other, output.step)
                if mistake is not None:
                    yield self._explanation(output, mistake, line, about=())  # another hint may say more
                return
        for alignment in allowed:
            mistakes = alignment.mistakes(output.step, printed)
            if mistakes:
                yield from (self._explanation(output, one, line) for one in mistakes)
                return

    def _printed(self, output: Output) -> tuple[PrintedNumbers | None, str]:
        values, latest = [], ""
        for lines in self.probed.lines:
            number = None
            for line in lines[-_MOST_LINES:]:
                found = output.number_format.number(line)
                if found is not None:
                    number, latest = found, line
            if number is None:
                return None, ""
            values.append(number)
        if len(set(values)) == 1 or all(math.isnan(one) for one in values):
            return None, ""
        return PrintedNumbers(np.array(values), _resolution(latest)), latest

    # -- words ------------------------------------------------------------------------------------------

    def _explanation(
        self, output: Output, mistake: Mistake, line: str, about: tuple[str, ...] | None = None
    ) -> Explanation:
        step, computed = mistake.step, text(mistake.computed)
        place = self._place(mistake, output, line)
        if step == output.step and isinstance(mistake.computed, Name):
            summary = f"{place}{computed} is printed in place of {step}"
        elif isinstance(mistake.computed, Name) and mistake.computed.name not in names(mistake.formula):
            summary = f"{place}{computed} is used in place of {step}"
        else:
            summary = f"{place}{step} is computed as {computed}"
        pose = max(range(len(POSES)), key=lambda n: _apart(mistake, n))
        at = POSES[pose]
        attitude = f"roll {at.roll_deg:g}, pitch {at.pitch_deg:g} and yaw {at.yaw_deg:g} degrees"
        details = (
            f"The lab has {step} = {text(mistake.formula)}.",
            f"At {attitude} this gives {_number(mistake.actual[pose])} in place of {_number(mistake.expected[pose])}.",
        )
        about = (output.title,) if about is None else about
        diagnosis = Diagnosis("formula", summary, details, fatal=False, about=about)
        return Explanation(output.check, mistake, diagnosis)

    def _place(self, mistake: Mistake, output: Output, line: str) -> str:
        if mistake.step == output.step and isinstance(mistake.computed, Name):
            printed = PrintedLines(self.probed.image, self.places, line.encode("latin-1"))
            place = printed.place(printed.lines[0].made_by) if printed.lines else ""
            return f"{place}: " if place else ""
        return f"{self.places.place(mistake.addresses[-1])}: " if mistake.addresses else ""


def _apart(mistake: Mistake, pose: int) -> float:
    difference = abs(mistake.actual[pose] - mistake.expected[pose])
    return float(difference) if math.isfinite(difference) else math.inf


def _number(value: float) -> str:
    return f"{value:.4g}"


def _resolution(line: str) -> float:
    """Return a unit of the last digit of a line's most exact number."""
    digits = [
        len(one.partition(".")[2]) for one in line.split() if one.replace(".", "", 1).lstrip("-").isdigit()
    ]
    return float(10.0 ** -max(digits, default=0)) if max(digits, default=0) else 0.0
