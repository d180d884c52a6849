"""Explain wrong printed numbers by the source line with a formula that differs from the lab's formula."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Final, NamedTuple

import numpy as np

from fcu_emulator.emulator.chip.diagnosis.backtrace import Places
from fcu_emulator.emulator.chip.diagnosis.printing import PrintedLines
from fcu_emulator.emulator.chip.diagnosis.report import Diagnosis
from fcu_emulator.emulator.explain.alignment import Alignment, Formulas, Mistake, PrintedNumbers
from fcu_emulator.emulator.explain.expression import Name, Number, names, text
from fcu_emulator.emulator.explain.probe import POSES, InputRegister, Probe, Probed, WordUse, own_code
from fcu_emulator.emulator.explain.search import ValueSearch
from fcu_emulator.emulator.explain.source_text import instruction_text, source_text
from fcu_emulator.emulator.explain.states import States, WrongState
from fcu_emulator.emulator.scenario.formats import NumberFormat

_MOST_LINES: Final = 200
_EXTREME: Final = {">": "largest", "<": "smallest"}


@dataclass(frozen=True)
class Alternative:
    """Other correct formulas, except for the checks ``not_for``."""

    formulas: Formulas
    not_for: frozenset[str] = frozenset()


@dataclass(frozen=True)
class Arithmetic:
    """A lab's arithmetic: inputs, formulas in order, and alternatives."""

    inputs: Mapping[str, InputRegister]
    formulas: Formulas
    alternatives: Sequence[Alternative] = ()


@dataclass(frozen=True)
class ShownNumber:
    """A printed number of a failed check, and its step. ``field``: name of the number, such as ``ACC.x``."""

    check: str
    step: str
    field: str
    number_format: NumberFormat


@dataclass(frozen=True)
class Explanation:
    """Explanation of one wrong output."""

    check: str
    mistake: Mistake | WrongState
    diagnosis: Diagnosis


def explain_numbers(
    probe: Probe, arithmetic: Arithmetic, outputs: Iterable[ShownNumber]
) -> list[Explanation]:
    """Return explanations of wrong outputs, in the order of the formulas. Each mistake appears one time.

    Return [] if no mistake is found, or if the firmware fails in a pose.
    """
    probed = probe.run(arithmetic.inputs)
    if probed is None:
        return []
    explainer = _Explainer(probe, probed, arithmetic)
    found = [one for output in outputs for one in explainer.explain(output)]
    different: dict[tuple[str, str], Explanation] = {}
    for one in found:
        if one.mistake not in explainer.merged:
            different.setdefault((one.mistake.step, one.diagnosis.summary), one)
    order = list(arithmetic.formulas)
    return sorted(different.values(), key=lambda one: order.index(one.mistake.step))


def first_of(explanations: Sequence[Explanation]) -> list[Diagnosis]:
    """Return the diagnosis of the first mistake. The diagnosis also names the other wrong steps."""
    if not explanations:
        return []
    first = explanations[0]
    details = first.diagnosis.details
    steps = dict.fromkeys(one.mistake.step for one in explanations if one.mistake.step != first.mistake.step)
    if steps:
        details = *details, f"Also different from the lab: {', '.join(steps)}."
    fields = dict.fromkeys(one.diagnosis.data["fields"] for one in explanations)
    data = {**first.diagnosis.data, "fields": ", ".join(fields)}
    return [replace(first.diagnosis, details=details, data=data)]


class _Mistaken(NamedTuple):
    """The mistakes in one output, and the formulas that they change."""

    alignment: Alignment
    mistakes: Sequence[Mistake]
    output: ShownNumber
    printed: PrintedNumbers


class _Explainer:
    def __init__(self, probe: Probe, probed: Probed, arithmetic: Arithmetic) -> None:
        self._probe = probe
        self._image = probe.image
        self._probed = probed
        self._arithmetic = arithmetic
        self._search = ValueSearch(probed.logs)
        self._places = Places(probe.image)
        self._best: dict[tuple[int, ...], Alignment] = {}
        self._mistaken: list[_Mistaken] = []
        self.merged: set[Mistake | WrongState] = set()
        """Mistakes that are explained by a wrong value, which was found later."""

    def explain(self, output: ShownNumber) -> Iterator[Explanation]:
        """Yield the mistakes in an output, except those that were found in earlier outputs.

        Yield nothing if the output is correct, constant or not printed.
        """
        printed, line = self._printed(output)
        if printed is None:
            return
        right = [one for one in self._arithmetic.alternatives if output.check not in one.not_for]
        used = self._used(right)
        main = self._alignment(self._arithmetic.formulas)
        if any(one.agrees(output.step, printed) for one in (used, main)):
            return
        if any(one.alignment.agrees(output.step, printed, one.mistakes) for one in self._mistaken):
            return
        states = [one for one in self._wrong_states if main.needs(output.step, one.step)]
        if states:
            yield from (self._state(output, one) for one in states)
            return
        wrong = self._used(self._arithmetic.alternatives)
        if wrong.agrees(output.step, printed):
            mistake = used.difference(wrong, output.step)
            if mistake is not None:
                yield self._explanation(output, mistake, line)
            return
        for alignment in (used, main) if used.formulas != main.formulas else (main,):
            mistakes = self._common(alignment, output, printed) or alignment.mistakes(output.step, printed)
            if mistakes:
                self._mistaken.append(_Mistaken(alignment, mistakes, output, printed))
                yield from (self._explanation(output, one, line) for one in mistakes)
                return

    def _common(self, alignment: Alignment, output: ShownNumber, printed: PrintedNumbers) -> list[Mistake]:
        """Return the wrong value that explains this output and an earlier output, or []."""
        for earlier in self._mistaken:
            if len(earlier.mistakes) == 1:
                mistake = alignment.as_wrong_value(earlier.mistakes[0], output.step, printed)
                if mistake is not None:
                    if alignment.agrees(earlier.output.step, earlier.printed, [mistake]):
                        self.merged.add(earlier.mistakes[0])
                    return [mistake]
        return []

    def _used(self, alternatives: Sequence[Alternative]) -> Alignment:
        """Return the formulas. Use an alternative if the firmware then computes more of the steps."""
        every = self._arithmetic.alternatives
        key = tuple(number for number, one in enumerate(every) if one in alternatives)
        if key not in self._best:
            self._best[key] = self._with_most_steps([every[number] for number in key])
        return self._best[key]

    def _with_most_steps(self, alternatives: Iterable[Alternative]) -> Alignment:
        best = self._alignment(self._arithmetic.formulas)
        for one in alternatives:
            other = self._alignment({**best.formulas, **one.formulas})
            values_are_inputs = all(isinstance(formula, Name) for formula in one.formulas.values())
            if values_are_inputs and any(map(best.computes, one.formulas)):
                continue  # every program computes the values of inputs
            if other.computed_steps() > best.computed_steps():
                best = other
        return best

    def _alignment(self, formulas: Formulas) -> Alignment:
        return Alignment(formulas, self._probed.inputs, self._search, len(POSES))

    def _printed(self, output: ShownNumber) -> tuple[PrintedNumbers | None, str]:
        values, latest = [], ""
        for lines in self._probed.lines:
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

    @cached_property
    def _wrong_states(self) -> list[WrongState]:
        symbols = self._image.symbols
        if symbols is None:
            return []
        formulas = self._arithmetic.formulas
        values = {name: one[0] for name, one in self._alignment(formulas).values().items()}
        return States(formulas, self._probed.memory, values, symbols).wrong()

    @cached_property
    def _uses(self) -> Mapping[int, WordUse]:
        return self._probe.uses_of([one.address for one in self._wrong_states])

    # -- words ------------------------------------------------------------------------------------------

    def _explanation(self, output: ShownNumber, mistake: Mistake, line: str) -> Explanation:
        step, computed = mistake.step, text(mistake.computed)
        site = self._site(mistake, output, line)
        place = self._places.prefix(site)
        if place and mistake.is_later and isinstance(mistake.computed, Number):
            place, site = f"before {place}", None
        is_printed = _is_printed(mistake, output)
        if is_printed:
            summary = f"{place}{computed} is printed in place of {step}"
        elif step != output.step and _is_other_value(mistake):
            summary = f"{place}{computed} is used in place of {step}"
        else:
            summary = f"{place}{step} is computed as {computed}"
        pose = max(range(len(POSES)), key=lambda n: _apart(mistake, n))
        at = POSES[pose]
        attitude = f"roll {at.roll_deg:g}, pitch {at.pitch_deg:g} and yaw {at.yaw_deg:g} degrees"
        details = (
            *self._quoted(site),
            f"The lab computes {step} = {text(mistake.formula)}.",
            *(() if is_printed else self._part(mistake, place)),
            (
                f"At {attitude} the program computes {_number(mistake.actual[pose])} in place of "
                f"{_number(mistake.expected[pose])}."
            ),
            *self._missing_line(site),
        )
        data = {
            "step": step,
            "computed": computed,
            "formula": text(mistake.formula),
            "fields": output.field,
            **self._where(site),
        }
        return Explanation(
            output.check, mistake, Diagnosis("formula", summary, details, fatal=False, data=data)
        )

    def _where(self, site: int | None) -> Mapping[str, str]:
        """Return, for the data of a diagnosis, the line of an instruction or, if it is unknown, the address."""
        if site is None:
            return {}
        return self._places.line(site) or {"address": f"0x{site:08X}"}

    def _quoted(self, site: int | None) -> Iterator[str]:
        """Yield the source line of an instruction, if its file is beside the ELF file.

        Yield the instruction itself if its line is unknown.
        """
        if site is None:
            return
        symbols = self._image.symbols
        line = symbols.line_at(site) if symbols is not None else None
        yield from filter(
            None, (source_text(self._image, line) if line else instruction_text(self._image, site),)
        )

    def _missing_line(self, site: int | None) -> Iterator[str]:
        if site is not None and not self._places.line(site):
            yield "The file has no source lines: build with -g and check the ELF file to see the line."

    def _part(self, mistake: Mistake, place: str) -> Iterator[str]:
        """Yield the line that first sets the wrong part's value in the same function, unless it is ``place``.

        If the firmware uses another value instead, yield the line that computes this value.
        """
        if isinstance(mistake.computed, Name):
            lines = sorted({self._places.place(one) for one in mistake.part_addresses}, key=_line_number)
            own = [one for one in lines if self._is_own(one) and f"{one}: " != place]
            if own and place:
                yield f"{own[0]} sets the value of {mistake.computed.name}."
            return
        if not mistake.addresses or mistake.part == mistake.computed:
            return
        inside = [
            one
            for one in mistake.part_addresses
            if _start(self._places, one) == _start(self._places, mistake.addresses[-1])
        ]
        lines = sorted({self._places.place(one) for one in inside}, key=_line_number)
        if lines and f"{lines[0]}: " != place:
            yield f"{lines[0]} sets the value of {text(mistake.part)}."

    def _is_own(self, place: str) -> bool:
        """Return whether a place is in the file of main()."""
        start = self._places.address_of("main")
        return start is not None and f", {self._places.file(start)}:" in place

    def _state(self, output: ShownNumber, state: WrongState) -> Explanation:
        right, rule = state.right, state.rule
        symbols, site = self._image.symbols, self._state_site(state)
        place = self._places.prefix(site)
        quoted = list(self._quoted(site))
        where = self._where(site)
        wanted = f"The lab sets {state.step} to {right.assigned} if {right.compared} {right.operator} {right.limit}."
        if rule == right:
            line = symbols.definition_of_variable(state.address) if symbols is not None else None
            place = f"{line}: " if line is not None else ""
            where = line.data() if line is not None else {}
            quoted = list(filter(None, (source_text(self._image, line),)))
            never, beyond = ("exceeds", "below") if right.operator == ">" else ("falls below", "above")
            summary = f"{place}{state.variable} begins at {_number(right.initial)}, which {right.compared} never {never}"
            wanted = f"Set {state.variable} to the first sample, or initialize it to a number {beyond} every sample."
        elif rule is None:
            summary = f"{place}{state.variable} is not the {_EXTREME[right.operator]} {right.compared} so far"
        else:
            summary = f"{place}{state.variable} is set to {rule.assigned} if {rule.compared} {rule.operator} {rule.limit}"
        details = (
            *quoted,
            wanted,
            f"After some motion {state.step} is {_number(state.actual[-1])} in place of {_number(state.expected[-1])}.",
        )
        data = {
            "step": state.step,
            "variable": state.variable,
            "fields": output.field,
            **where,
        }
        return Explanation(
            output.check, state, Diagnosis("formula", summary, details, fatal=False, data=data)
        )

    def _state_site(self, state: WrongState) -> int | None:
        """Return an instruction that stores the variable, or else the first instruction that loads it."""
        use = self._uses[state.address]
        own = self._own(site for site, _ in use.stores.most_common()) or self._own(sorted(use.loads))
        return own[0] if own else None

    def _own(self, sites: Iterable[int]) -> list[int]:
        """Return the instructions outside of libraries and drivers."""
        ranges = own_code(self._image)
        return [site for site in sites if any(begin <= site < end for begin, end in ranges)]

    def _site(self, mistake: Mistake, output: ShownNumber, line: str) -> int | None:
        """Return an instruction that belongs to the mistake: it prints, computes, or loads a wrong operand."""
        if _is_printed(mistake, output):
            printed = PrintedLines(self._image, self._places, line.encode("latin-1"))
            return printed.address(printed.lines[0].made_by) if printed.lines else None
        found = list(mistake.addresses) or self._own(mistake.part_addresses)
        if found and isinstance(mistake.computed, Name):
            first = _start(self._places, found[0])  # other functions only load the value
            found = [one for one in found if _start(self._places, one) == first]
        return found[-1] if found else None


def _is_printed(mistake: Mistake, output: ShownNumber) -> bool:
    """Return whether the firmware prints another value, which is not an operand of the step's formula."""
    computed = mistake.computed
    return (
        mistake.step == output.step
        and isinstance(computed, Name)
        and computed.name not in names(mistake.formula)
    )


def _is_other_value(mistake: Mistake) -> bool:
    """Return whether the firmware uses another value instead of the step, and does not use another formula."""
    used = set(names(mistake.computed))
    is_name = isinstance(mistake.computed, Name) and used.isdisjoint(names(mistake.formula))
    return is_name or used <= {mistake.step}


def _start(places: Places, address: int) -> int:
    function = places.function(address)
    return function.start if function is not None else address


def _line_number(place: str) -> int:
    number = place.rpartition(":")[2]
    return int(number) if number.isdigit() else 0


def _apart(mistake: Mistake, pose: int) -> float:
    difference = abs(mistake.actual[pose] - mistake.expected[pose])
    return float(difference) if math.isfinite(difference) else math.inf


def _number(value: float) -> str:
    return f"{value:.5g}"


def _resolution(line: str) -> float:
    """Return one unit of the last digit in the number with the most decimals."""
    digits = [
        len(one.partition(".")[2]) for one in line.split() if one.replace(".", "", 1).lstrip("-").isdigit()
    ]
    return float(10.0 ** -max(digits, default=0)) if max(digits, default=0) else 0.0
