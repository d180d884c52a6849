"""Wrong extremes: variables that should keep the largest or smallest value so far.

If a word of the RAM has the correct value of a step after every pose, it is the step's variable. The words
beside this word belong to the steps without a variable. A rule "if v > e then e = w" explains such a word
if the rule gives all values of the word.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
import numpy.typing as npt

from fcu_emulator.emulator.chip.image.symbols import Symbol, Symbols
from fcu_emulator.emulator.chip.memory_map import RAM_MEMORY
from fcu_emulator.emulator.explain.expression import FunctionCall, Name, Node

Values = npt.NDArray[np.float64]
_EXTREMES: Final = {"largest": ">", "smallest": "<"}
_TYPES: Final = ("<i4", "<f4")
_WORD: Final = 4


@dataclass(frozen=True)
class Rule:
    """``if compared operator limit then the variable is set to assigned``, starting with ``initial``."""

    compared: str
    operator: str
    limit: str
    assigned: str
    initial: float


@dataclass(frozen=True, eq=False)
class WrongState:
    """A variable that should keep the largest or smallest value of ``step``, but does not."""

    step: str
    variable: str
    address: int
    right: Rule
    rule: Rule | None
    """The rule that the program follows, if it is known."""
    expected: Values
    actual: Values


def extreme_of(formula: Node) -> tuple[str, str] | None:
    """Return the function and the name in a formula such as ``largest(mag_x)``, or None."""
    match formula:
        case FunctionCall(function="largest" | "smallest" as function, arguments=(Name(name=name),)):
            return function, name
    return None


class States:
    """Comparison of a lab's extremes with the variables of a program.

    ``memory``: the RAM at the start and after each pose. ``values``: the values of inputs and steps in each pose.
    """

    def __init__(
        self,
        formulas: Mapping[str, Node],
        memory: Sequence[bytes],
        values: Mapping[str, Values],
        symbols: Symbols,
    ) -> None:
        self._symbols = symbols
        self._values = values
        self._steps = {
            name: found for name, formula in formulas.items() if (found := extreme_of(formula)) is not None
        }
        self._words = [np.stack([np.frombuffer(one, kind) for one in memory]) for kind in _TYPES]

    def wrong(self) -> list[WrongState]:
        """Return the variables with wrong values, ordered by step, or [] if most steps have no variable."""
        right = {name: found for name in self._steps if (found := self._variables(name))}
        missing = [name for name in self._steps if name not in right]
        if not missing or len(right) < len(missing):
            return []
        states: list[WrongState] = []
        for function in _EXTREMES:
            steps = [name for name, one in self._steps.items() if one[0] == function]
            kinds = [right[name][0] for name in steps if name in right]
            words = self._words_of([index for name in steps if name in right for index in right[name][1]])
            if len(words) != len(steps) or not kinds:
                continue
            pairs = list(zip(steps, words, strict=True))
            if all(name in missing or index in right[name][1] for name, index in pairs):
                states += [self._wrong(name, kinds[0], index) for name, index in pairs if name in missing]
        return sorted(states, key=lambda one: list(self._steps).index(one.step))

    def _variables(self, step: str) -> tuple[int, list[int]] | None:
        """Return the type and the words of the step's variable, or None if the step has no variable."""
        for kind, words in enumerate(self._words):
            with np.errstate(invalid="ignore"):
                found = np.flatnonzero((words[1:] == self._values[step][:, None]).all(axis=0))
            if found.size:
                return kind, found.tolist()
        return None

    def _words_of(self, words: Iterable[int]) -> list[int]:
        """Return all words of the arrays and structures that contain these words, in ascending order."""
        objects = {one for index in words if (one := self._object(index)) is not None}
        every = {
            (address - RAM_MEMORY.start) // _WORD
            for one in objects
            for address in range(one.address, one.address + one.size - _WORD + 1, _WORD)
        }
        return sorted(every)

    def _object(self, index: int) -> Symbol | None:
        return self._symbols.object_at(RAM_MEMORY.start + _WORD * index)

    def _wrong(self, step: str, kind: int, index: int) -> WrongState:
        initial, *actual = self._words[kind][:, index].astype(np.float64).tolist()
        function, argument = self._steps[step]
        right = Rule(argument, _EXTREMES[function], step, argument, initial)
        address = RAM_MEMORY.start + _WORD * index
        values = np.array(actual)
        rule = self._rule(right, step, values)
        name = self._symbols.member_at(address)
        return WrongState(step, name, address, right, rule, self._values[step], values)

    def _rule(self, right: Rule, step: str, values: Values) -> Rule | None:
        """Return the rule that gives these values, or None if no rule or several equally likely rules give them."""
        for kind in self._rules(right):
            fitting = [one for one in kind if np.array_equal(self._simulated(one, step), values)]
            if fitting:
                return fitting[0] if len(fitting) == 1 else None
        return None

    def _rules(self, right: Rule) -> Iterator[list[Rule]]:
        """Yield lists of rules with one mistake, a list for each kind of mistake, likely kinds first."""
        reverse = next(one for one in _EXTREMES.values() if one != right.operator)
        same_axis = [
            name for name, one in self._steps.items() if one[1] == right.compared and name != right.limit
        ]
        others = [name for name in self._values if name != right.compared]
        yield [right]  # the correct rule, if only the initial value is wrong
        yield [replace(right, operator=reverse)]
        yield [replace(right, limit=limit) for limit in same_axis]
        yield [replace(right, limit=limit) for limit in self._steps if limit not in (right.limit, *same_axis)]
        yield [replace(right, assigned=other) for other in others]
        yield [replace(right, compared=other) for other in others]
        yield [replace(right, compared=other, assigned=other) for other in others]

    def _simulated(self, rule: Rule, step: str) -> Values:
        kept, result = rule.initial, []
        for pose, compared in enumerate(self._values[rule.compared]):
            for _ in range(2):  # each pose lasts for many samples
                limit = kept if rule.limit == step else self._values[rule.limit][pose]
                if compared > limit if rule.operator == ">" else compared < limit:
                    kept = self._values[rule.assigned][pose]
            result.append(kept)
        return np.array(result)
