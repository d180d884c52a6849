"""Typical mistakes in a formula. Each mistake is one edit of the formula's tree."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import Final

from fcu_emulator.emulator.explain.expression import (
    FunctionCall,
    Name,
    Negative,
    Node,
    Number,
    Operation,
    children,
    with_children,
)

_FUNCTIONS: Final = {
    "sin": ("cos", "tan"),
    "cos": ("sin", "tan"),
    "tan": ("sin", "cos"),
    "asin": ("acos", "atan"),
    "acos": ("asin", "atan"),
    "atan": ("asin", "tan"),
    "min": ("max",),
    "max": ("min",),
    "largest": ("smallest",),
    "smallest": ("largest",),
    "sqrt": ("cbrt", "abs"),
}
_USUAL: Final = (0.0, 1.0, 2.0, 3.0, 90.0, 100.0, 180.0, 273.0, 273.15, 360.0, 1000.0, 3.14, math.pi)
_FACTORS: Final = (2.0, 10.0, 100.0, 1000.0)
_ANGLE: Final = (Number(180.0), Number(math.pi))


def edits(formula: Node, known: Iterable[str]) -> Iterator[Node]:
    """Yield variants of the formula with one mistake, likely mistakes first. ``known``: other names."""
    names = tuple(known)
    yield from _everywhere(formula, lambda node: _operand(node, names))
    for edit in (_function, _operation, _sign, _number, _unit, _usual_factor):
        yield from _everywhere(formula, edit)
    yield from _exchanged_numbers(formula)


def _everywhere(formula: Node, edit: Callable[[Node], Iterator[Node]]) -> Iterator[Node]:
    """Yield the formula with each edit of each part, innermost parts first."""
    operands = children(formula)
    for index, operand in enumerate(operands):
        for edited in _everywhere(operand, edit):
            yield with_children(formula, (*operands[:index], edited, *operands[index + 1 :]))
    yield from edit(formula)


def _operand(node: Node, names: tuple[str, ...]) -> Iterator[Node]:
    if isinstance(node, Name):
        yield from (Name(name) for name in names if name != node.name)
    if isinstance(node, Operation) and node.operator == "**" and node.right == Number(2.0):
        yield from (Operation("*", node.left, Name(name)) for name in names if Name(name) != node.left)


def _function(node: Node) -> Iterator[Node]:
    if not isinstance(node, FunctionCall):
        return
    yield from (FunctionCall(name, node.arguments) for name in _FUNCTIONS.get(node.function, ()))
    if node.function == "atan2":
        first, second = node.arguments
        yield FunctionCall("atan2", (second, first))
        yield FunctionCall("atan", (Operation("/", first, second),))
    elif len(node.arguments) == 1:
        yield node.arguments[0]


def _sign(node: Node) -> Iterator[Node]:
    if isinstance(node, Negative):
        yield node.operand
    elif not isinstance(node, Number):
        yield Negative(node)


def _number(node: Node) -> Iterator[Node]:
    if isinstance(node, Number):
        value = node.value
        usual = (
            value + 1,
            value - 1,
            -value,
            2 * value,
            value / 2,
            10 * value,
            value / 10,
            1000 * value,
            value / 1000,
        )
        yield from (Number(other) for other in (*usual, *_USUAL) if other != value)


def _operation(node: Node) -> Iterator[Node]:
    if not isinstance(node, Operation):
        return
    left, right = node.left, node.right
    for operator in "+-*/":
        if node.operator not in (operator, "**"):
            yield Operation(operator, left, right)
    if node.operator in "-/":
        yield Operation(node.operator, right, left)
    yield from _inside(node)
    if node.operator == "/":
        yield FunctionCall("trunc", (node,))
    if node.operator == "**":
        yield from (Operation("**", left, Number(power)) for power in (1.0, 3.0, 0.5))
        yield Operation("*", left, right)


def _inside(node: Node) -> Iterator[Node]:
    for operand in children(node):
        yield operand
        if isinstance(operand, Operation):
            yield from _inside(operand)


def _exchanged_numbers(formula: Node) -> Iterator[Node]:
    """Yield the formula with two numbers exchanged, as in ``angle * pi / 180``."""
    numbers = list(dict.fromkeys(_numbers(formula)))
    for index, one in enumerate(numbers):
        for other in numbers[index + 1 :]:
            yield _replaced(formula, {one: other, other: one})


def _numbers(node: Node) -> Iterator[Number]:
    if isinstance(node, Number):
        yield node
    for operand in children(node):
        yield from _numbers(operand)


def _replaced(node: Node, others: Mapping[Node, Node]) -> Node:
    if node in others:
        return others[node]
    return with_children(node, tuple(_replaced(operand, others) for operand in children(node)))


def _unit(node: Node) -> Iterator[Node]:
    """Yield the node converted to degrees, to radians, to an integer and to its absolute value."""
    half_turn, pi = _ANGLE
    if isinstance(node, Name | FunctionCall):
        yield Operation("/", Operation("*", node, half_turn), pi)
        yield Operation("/", Operation("*", node, pi), half_turn)
        yield FunctionCall("trunc", (node,))
        yield FunctionCall("abs", (node,))


def _usual_factor(node: Node) -> Iterator[Node]:
    if isinstance(node, Name | FunctionCall):
        yield from (Operation("*", node, Number(factor)) for factor in _FACTORS)
        yield from (Operation("/", node, Number(factor)) for factor in _FACTORS)


def constants(formula: Node) -> Iterator[list[tuple[float, Callable[[float], Node]]]]:
    """For each kind of place that an unknown constant may have, yield usual values and the formulas; likely
    kinds come first.

    The unknown constant replaces a number, or it replaces, multiplies or increases an operand.
    """
    for edit in (_other_number, _a_number, _scaled):
        yield list(_places(formula, edit, lambda changed: changed))


_Edit = Callable[[Node], Iterator[tuple[float, Callable[[float], Node]]]]


def _places(
    node: Node, edit: _Edit, inside: Callable[[Node], Node]
) -> Iterator[tuple[float, Callable[[float], Node]]]:
    operands = children(node)
    for index, operand in enumerate(operands):

        def within(changed: Node, index: int = index) -> Node:
            return inside(with_children(node, (*operands[:index], changed, *operands[index + 1 :])))

        yield from _places(operand, edit, within)
    for usual, make in edit(node):
        yield usual, lambda value, make=make: inside(make(value))  # type: ignore[misc]


def _other_number(node: Node) -> Iterator[tuple[float, Callable[[float], Node]]]:
    if isinstance(node, Number):
        yield node.value, Number


def _a_number(node: Node) -> Iterator[tuple[float, Callable[[float], Node]]]:
    if not isinstance(node, Number):
        yield 0.0, Number


def _scaled(node: Node) -> Iterator[tuple[float, Callable[[float], Node]]]:
    if not isinstance(node, Number):
        yield 1.0, lambda value: Operation("*", node, Number(value))
        yield 0.0, lambda value: Operation("+", node, Number(value))
