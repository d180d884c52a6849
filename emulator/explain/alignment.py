"""Compare the formulas of a lab with the values in firmware, and find the formula that the firmware uses instead.

Decision: a mistake is reported only if it explains the printed numbers. A typical mistake in one
formula is proven if the later formulas give the printed numbers in every pose. A value in a
register alone proves nothing, because compilers fuse and move operations.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
import numpy.typing as npt

from fcu_emulator.emulator.explain.edits import constants, edits
from fcu_emulator.emulator.explain.expression import (
    REPEATS,
    Evaluator,
    Name,
    Negative,
    Node,
    Number,
    Operation,
    Samples,
    children,
    names,
    number,
    simplified,
    with_children,
)
from fcu_emulator.emulator.explain.search import ValueSearch

Formulas = Mapping[str, Node]
"""Steps in order. Each step uses inputs and earlier steps."""

_MOST_MISTAKES: Final = 2
_MOST_TRIED: Final = 5_000
"""Maximum number of formulas to try for one printed number. These trials take about a second."""
_LOOSE: Final = 1e-3
"""If the tolerance is above this share of the value, equality proves nothing (for example, for the sine of a
large number)."""
_FIRST: Final = 5
"""Maximum number of candidates for the first of two mistakes."""
_VALUE_FACTORS: Final = (2.0, 0.5, 10.0, 0.1, 100.0, 0.01, 1000.0, 0.001)
_DIGITS: Final = range(2, 8)
"""Possible numbers of digits of a constant. The fewest digits that give the printed numbers are used."""
_TYPICAL_DIGITS: Final = 3
"""Constants with fewer digits, such as 10, are logged for many reasons."""


@dataclass(frozen=True, eq=False)
class Mistake:
    """A step that the firmware computes by another formula."""

    step: str
    formula: Node
    """Formula of the lab."""
    computed: Node
    """Formula of the firmware."""
    addresses: tuple[int, ...]
    """Instructions that compute the wrong value or one of its operands. May be empty."""
    is_later: bool
    """Whether ``addresses`` are instead instructions that compute a later step from the wrong value."""
    part: Node
    """The part of ``computed`` that differs from ``formula``."""
    part_addresses: tuple[int, ...]
    """Instructions that compute the value of ``part``. Empty for a constant."""
    expected: npt.NDArray[np.float64]
    """Values of the lab's formula, by pose."""
    actual: npt.NDArray[np.float64]


@dataclass(frozen=True)
class PrintedNumbers:
    """The number of a printed field in each pose. ``resolution``: one unit of the last digit."""

    values: npt.NDArray[np.float64]
    resolution: float


class Alignment:
    """Comparison of a lab's formulas with a firmware's values in several poses of the board.

    ``inputs``: value of each sensor output in each pose. ``search``: values that the firmware
    computes in the logged poses; ``poses`` is the number of these poses. The functions ``largest``,
    ``smallest`` and ``first`` also use earlier poses.
    """

    def __init__(
        self,
        formulas: Formulas,
        inputs: Mapping[str, npt.NDArray[np.float64]],
        search: ValueSearch,
        poses: int,
    ) -> None:
        self.formulas = dict(formulas)
        self._inputs = {name: np.tile(one, (REPEATS, 1)) for name, one in inputs.items()}
        self._search = search
        self._poses = poses
        self._evaluator = Evaluator({}, next(iter(inputs.values())).shape[0])
        self._first_pose: dict[str, float] = {}
        """Values of inputs and steps in the first logged pose."""
        self._tried = 0
        self._dependents: dict[tuple[int, str, str], tuple[Formulas, list[tuple[str, Node]]]] = {}

    def agrees(self, output: str, printed: PrintedNumbers, mistakes: Sequence[Mistake] = ()) -> bool:
        """Return whether the lab's formulas, with these mistakes, give the printed numbers."""
        values, computed = self._values(self.formulas), {one.step: one.computed for one in mistakes}
        if mistakes:
            self._evaluator.values = values
            for name, formula in self.formulas.items():
                values[name] = self._evaluator(computed.get(name, formula))
        return self._fits(values[output], printed)

    def computed_steps(self) -> int:
        """Return the number of steps that the firmware computes by these formulas."""
        values = self._values(self.formulas)
        return sum(bool(self._addresses(values[name])) for name in self.formulas)

    def needs(self, output: str, step: str) -> bool:
        """Return whether an output depends on a step."""
        return step in _in_order(self.formulas, output)

    def values(self) -> dict[str, npt.NDArray[np.float64]]:
        """Return the values of inputs and steps in all poses, with shape (repetitions, poses)."""
        return self._values(self.formulas)

    def computes(self, step: str) -> bool:
        """Return whether an instruction computes the values of a step."""
        return bool(self._addresses(self._values(self.formulas)[step]))

    def mistakes(self, output: str, printed: PrintedNumbers) -> list[Mistake]:
        """Return the mistakes that together give the printed numbers, or [] if none are found."""
        self._tried = 0
        self._dependents.clear()
        return self._explained(self.formulas, output, printed, _MOST_MISTAKES)

    def as_wrong_value(self, mistake: Mistake, output: str, printed: PrintedNumbers) -> Mistake | None:
        """Return the mistake of another output as one wrong value, if this value also gives the printed numbers.

        Return None if the mistake does not replace one value in a formula.
        """
        right, part = _differing_parts(mistake.formula, mistake.computed)
        if not isinstance(right, Name) or right.name not in _in_order(self.formulas, output):
            return None
        name = right.name
        others = set(names(part)) - {name}
        if name not in self.formulas or any(name in _in_order(self.formulas, one) for one in others):
            return None
        self._values(self.formulas)
        gives = self._gives(self.formulas, name, part, output, printed)
        return self._mistake(self.formulas, name, part, output) if gives else None

    def difference(self, other: Alignment, output: str) -> Mistake | None:
        """Return the first step with a different formula in ``other``, as a mistake."""
        for name in _in_order(self.formulas, output):
            if other.formulas[name] != self.formulas[name]:
                self._values(self.formulas)
                return self._mistake(self.formulas, name, other.formulas[name], output)
        return None

    # -- values -----------------------------------------------------------------------------------------

    def _values(self, formulas: Formulas) -> dict[str, Samples]:
        evaluator = self._evaluator
        evaluator.values = dict(self._inputs)
        for name, formula in formulas.items():
            evaluator.values[name] = evaluator(formula)
        self._first_pose = {name: float(one[0, -self._poses]) for name, one in evaluator.values.items()}
        return dict(evaluator.values)

    def _last(self, samples: Samples) -> Samples:
        return samples[:, -self._poses :]

    def _addresses(self, samples: Samples) -> list[int]:
        """Return the instructions that compute these values, or [] if equal values would prove nothing."""
        last = self._last(samples)
        tolerance = self._evaluator.tolerance(last)
        if (
            not np.isfinite(last).all()
            or np.ptp(last[0]) == 0
            or np.any(tolerance > _LOOSE * np.abs(last[0]) + _LOOSE / 100)
        ):
            return []
        return self._search.addresses(last[0], tolerance)

    def _fits(self, samples: Samples, printed: PrintedNumbers) -> bool:
        last = self._last(samples)
        tolerance, finite = self._evaluator.tolerance(last), np.isfinite(last[0])
        if not finite.any() or np.any(tolerance[finite] > _LOOSE * np.abs(last[0][finite]) + _LOOSE):
            return False
        with np.errstate(all="ignore"):
            near = np.abs(printed.values - last[0]) <= tolerance + printed.resolution
        return bool(np.where(finite, near, ~np.isfinite(printed.values)).all())

    def _may_fit(self, value: float, printed: PrintedNumbers) -> bool:
        """Return False if a value in the first logged pose shows that :meth:`_fits` would return False.

        The limit is twice the largest tolerance, because library functions differ in the last bits.
        """
        shown = float(printed.values[0])
        limit = 2 * (_LOOSE * abs(value) + _LOOSE) + printed.resolution
        return not math.isfinite(shown) or abs(value - shown) <= limit

    # -- the search -------------------------------------------------------------------------------------

    def _explained(
        self, formulas: Formulas, output: str, printed: PrintedNumbers, depth: int
    ) -> list[Mistake]:
        values = self._values(formulas)
        suspects = self._suspects(formulas, output, values)
        # many different mistakes can explain a number that is constant
        suspects.sort(key=lambda name: not self._differs(values[name]))
        if depth == _MOST_MISTAKES:
            exchanged = self._other_step(formulas, output, output, printed)
            if exchanged is not None:
                return [exchanged]
        chain = _in_order(formulas, output)[::-1]
        for find, steps in (
            (self._computed, suspects),
            (self._zero, chain),
            (self._other_step, chain),
            (self._edited, suspects),
            (self._with_constant, suspects),
            (self._changed_value, chain),
        ):
            for name in steps:
                mistake = find(formulas, name, output, printed)
                if mistake is not None:
                    return [mistake]
        for name in suspects if depth > 1 else ():
            for first in self._candidates_in_log(formulas, name):
                others = self._explained({**formulas, name: first.computed}, output, printed, depth - 1)
                if others:
                    return [first, *others]
        return []

    def _suspects(self, formulas: Formulas, output: str, values: Mapping[str, Samples]) -> list[str]:
        """Return the steps that the firmware does not seem to compute, in order.

        A step counts as computed if an instruction computes this step or a later step that depends on this step.
        """
        chain = _in_order(formulas, output)
        right: set[str] = set()
        for name in reversed(chain):
            if name != output and (name in right or self._addresses(values[name])):
                right |= set(_in_order(formulas, name))
        return [name for name in chain if name not in right]

    def _differs(self, samples: Samples) -> bool:
        """Return whether the values differ from pose to pose."""
        return bool(np.ptp(self._last(samples)[0]) != 0)

    def _varies(self, name: str) -> bool:
        last = self._last(self._evaluator.values[name])
        return bool(np.isfinite(last[0]).all() and np.ptp(last[0]) > 0) or name not in self._inputs

    def _other_step(
        self, formulas: Formulas, name: str, output: str, printed: PrintedNumbers
    ) -> Mistake | None:
        """Find another step or input that the firmware uses instead of a step."""
        for other in (*formulas, *self._inputs):
            depends = name != output and name in _in_order(formulas, other)
            if other == name or depends or not self._varies(other):
                continue
            if self._gives(formulas, name, Name(other), output, printed):
                return self._mistake(formulas, name, Name(other), output)
        return None

    def _zero(self, formulas: Formulas, name: str, output: str, printed: PrintedNumbers) -> Mistake | None:
        """Find out whether the firmware uses 0 instead of a step's value."""
        zero = Number(0.0)
        gives = self._gives(formulas, name, zero, output, printed)
        return self._mistake(formulas, name, zero, output) if gives else None

    def _changed_value(
        self, formulas: Formulas, name: str, output: str, printed: PrintedNumbers
    ) -> Mistake | None:
        """Find a sign or a factor by which the firmware's value differs from the step's value."""
        value = Name(name)
        changes: list[Node] = [Negative(value)]
        changes += [Operation("*", value, Number(factor)) for factor in _VALUE_FACTORS]
        for computed in changes:
            if self._gives(formulas, name, computed, output, printed):
                return self._mistake(formulas, name, computed, output)
        return None

    def _computed(
        self, formulas: Formulas, name: str, output: str, printed: PrintedNumbers
    ) -> Mistake | None:
        """Find a formula with one typical mistake that gives the printed numbers, and whose values an
        instruction computes."""
        for computed in edits(formulas[name], self._before(formulas, name)):
            samples = self._evaluator(computed)
            if (
                self._addresses(samples)
                and not self._is_known(samples)
                and self._gives(formulas, name, computed, output, printed)
            ):
                return self._mistake(formulas, name, computed, output)
        return None

    def _edited(self, formulas: Formulas, name: str, output: str, printed: PrintedNumbers) -> Mistake | None:
        """Find a formula with one typical mistake that gives the printed numbers."""
        for computed in edits(formulas[name], self._before(formulas, name)):
            if self._tried > _MOST_TRIED:
                return None
            if self._gives(formulas, name, computed, output, printed):
                return self._mistake(formulas, name, computed, output)
        return None

    def _with_constant(
        self, formulas: Formulas, name: str, output: str, printed: PrintedNumbers
    ) -> Mistake | None:
        """Find the constant, factor or summand that gives the printed numbers.

        Prefer a constant that is computed by an instruction, then the constant with the fewest digits.
        """
        for kind in constants(formulas[name]):
            found = [
                one
                for usual, formula in kind
                if (one := self._constant(formulas, name, usual, formula, output, printed)) is not None
            ]
            if found:
                _, computed = min(
                    found, key=lambda one: (not self._logs_constant(formulas[name], *one), one[0])
                )
                return self._mistake(formulas, name, computed, output)
        return None

    def _constant(
        self,
        formulas: Formulas,
        name: str,
        usual: float,
        formula: Callable[[float], Node],
        output: str,
        printed: PrintedNumbers,
    ) -> tuple[int, Node] | None:
        """Return the formula with a constant that gives the printed numbers, and the constant's number of digits."""
        wanted = float(printed.values[0])
        if self._tried > _MOST_TRIED or not math.isfinite(wanted):
            return None

        def off(value: float) -> float:
            self._tried += 1
            return self._in_first_pose(formulas, name, formula(value), output) - wanted

        value = _root(off, usual)
        if value is None or not self._gives(formulas, name, formula(value), output, printed):
            return None
        for digits in _DIGITS:
            rounded = formula(float(f"{value:.{digits}g}"))
            if self._gives(formulas, name, rounded, output, printed):
                return digits, rounded
        return _DIGITS.stop, formula(value)

    def _logs_constant(self, formula: Node, digits: int, computed: Node) -> bool:
        """Return whether an instruction computes a constant of several digits, or a part that contains it."""
        _, part = _differing_parts(formula, computed)
        around = [node for node in _nodes(computed) if part in children(node) and node != computed]
        samples = [self._last(self._evaluator(node)) for node in (part, *around)]
        return digits >= _TYPICAL_DIGITS and any(
            self._search.addresses(one[0], self._evaluator.tolerance(one)) for one in samples
        )

    def _candidates_in_log(self, formulas: Formulas, name: str) -> list[Mistake]:
        self._values(formulas)
        found: list[Mistake] = []
        for computed in edits(formulas[name], self._before(formulas, name)):
            self._tried += 1
            if len(found) == _FIRST or self._tried > _MOST_TRIED:
                break
            if self._addresses(self._evaluator(computed)):
                found.append(self._mistake(formulas, name, computed, name))
        return found

    def _before(self, formulas: Formulas, name: str) -> list[str]:
        """Return inputs and steps that vary and do not depend on a step."""
        every = (*self._inputs, *formulas)
        return [one for one in every if self._varies(one) and name not in _in_order(formulas, one)]

    def _gives(
        self, formulas: Formulas, name: str, computed: Node, output: str, printed: PrintedNumbers
    ) -> bool:
        self._tried += 1
        value = self._in_first_pose(formulas, name, computed, output)
        return self._may_fit(value, printed) and self._fits(
            self._changed(formulas, name, computed, output), printed
        )

    def _in_first_pose(self, formulas: Formulas, name: str, computed: Node, output: str) -> float:
        """Return an output's value in the first logged pose if one step has another formula."""
        values = dict(self._first_pose)
        for step, formula in ((name, computed), *self._later(formulas, name, output)):
            value = number(formula, values)
            if value is None:
                return float(self._changed(formulas, name, computed, output)[0, -self._poses])
            values[step] = value
        return values[output]

    def _changed(self, formulas: Formulas, name: str, computed: Node, output: str) -> Samples:
        """Return an output's values in all poses if one step has another formula."""
        evaluator = self._evaluator
        kept = dict(evaluator.values)
        evaluator.values[name] = evaluator(computed)
        for other, formula in self._later(formulas, name, output):
            evaluator.values[other] = evaluator(formula)
        result = evaluator.values[output]
        evaluator.values = kept
        return result

    def _later(self, formulas: Formulas, name: str, output: str) -> list[tuple[str, Node]]:
        """Return the steps of an output that depend on a step, in order, with their formulas."""
        key = id(formulas), name, output
        if key not in self._dependents:  # the entry keeps the formulas, so that no other object gets their id
            steps = _dependents(formulas, name, output)
            self._dependents[key] = formulas, [(one, formulas[one]) for one in steps]
        return self._dependents[key][1]

    def _is_known(self, samples: Samples) -> bool:
        """Return whether another step has these values."""
        wanted = self._last(samples)[0]
        return any(
            np.allclose(self._last(one)[0], wanted, rtol=1e-9) for one in self._evaluator.values.values()
        )

    def _mistake(self, formulas: Formulas, name: str, computed: Node, output: str) -> Mistake:
        samples, right = self._evaluator(computed), self._evaluator(formulas[name])
        addresses = self._of_operands(computed)
        if not addresses and not isinstance(computed, Name):
            addresses = self._addresses(samples)[:1]
        is_later = not addresses
        if is_later:
            addresses = self._after(formulas, name, computed, output)
        expected, actual = self._last(right)[0], self._last(samples)[0]
        part = _differing_parts(formulas[name], computed)[1]
        return Mistake(
            name,
            formulas[name],
            simplified(computed),
            tuple(addresses),
            is_later,
            part,
            tuple(self._addresses(self._evaluator(part))),
            expected,
            actual,
        )

    def _after(self, formulas: Formulas, name: str, computed: Node, output: str) -> list[int]:
        """Return the first instruction that computes a later step from the wrong step."""
        for other in _in_order(formulas, output):
            if name in _in_order(formulas, other) and other != name:
                found = self._addresses(self._changed(formulas, name, computed, other))
                if found:
                    return found[:1]
        return []

    def _of_operands(self, node: Node) -> list[int]:
        """Return the first instructions that compute the operands, because compilers fuse
        operations.
        """
        found = []
        for operand in children(node):
            if not isinstance(operand, Name | Number):
                found += self._addresses(self._evaluator(operand))[:1] or self._of_operands(operand)
        return found


def _nodes(node: Node) -> Iterator[Node]:
    yield node
    for operand in children(node):
        yield from _nodes(operand)


def _dependents(formulas: Formulas, name: str, output: str) -> list[str]:
    """Return the steps of an output that depend on a step, in order."""
    return [one for one in _in_order(formulas, output) if one != name and name in _in_order(formulas, one)]


def _differing_parts(formula: Node, computed: Node) -> tuple[Node, Node]:
    """Return the smallest parts of the two formulas that contain all differences."""
    before, after = children(formula), children(computed)
    if len(before) != len(after) or not before or with_children(formula, after) != computed:
        return formula, computed
    unlike = [(one, other) for one, other in zip(before, after, strict=True) if one != other]
    return _differing_parts(*unlike[0]) if len(unlike) == 1 else (formula, computed)


def _in_order(formulas: Formulas, output: str) -> list[str]:
    """Return an output and the steps that it needs, in order."""
    needed = {output}
    for name in reversed(list(formulas)):
        if name in needed:
            needed.update(names(formulas[name]))
    return [name for name in formulas if name in needed]


# -- an unknown constant ------------------------------------------------------------------------------------

_FACTORS: Final = (
    -100,
    -10,
    -2,
    -1,
    -0.5,
    0,
    0.001,
    0.01,
    0.1,
    0.5,
    0.9,
    0.99,
    1,
    1.01,
    1.1,
    2,
    10,
    60,
    1000,
)
_HALVINGS: Final = 40


def _root(off: Callable[[float], float], usual: float) -> float | None:
    """Return a root of ``off`` near ``usual`` times a typical factor, or None."""
    points = [abs(usual or 1000.0) * factor for factor in _FACTORS]
    values = [off(point) for point in points]
    for low, high, at_low, at_high in zip(points, points[1:], values, values[1:], strict=False):
        if at_low == 0:
            return low
        if np.isfinite(at_low) and np.isfinite(at_high) and (at_low < 0) != (at_high < 0):
            return _bisected(off, low, high, at_low)
    return None


def _bisected(off: Callable[[float], float], low: float, high: float, at_low: float) -> float:
    for _ in range(_HALVINGS):
        middle = (low + high) / 2
        value = off(middle)
        if value == 0:
            return middle
        low, high = (middle, high) if (value < 0) == (at_low < 0) else (low, middle)
    return (low + high) / 2
