"""Formulas of a lab as text: ``atan2(-acc_x, sqrt(acc_y**2 + acc_z**2))``.

Formulas have names, numbers, ``+ - * / **``, and the functions of ``FUNCTIONS``. Repeated
evaluations with random rounding errors of single precision give the tolerance of comparisons.
"""

from __future__ import annotations

import ast
import math
import operator
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Final, NamedTuple, TypeAlias

import numpy as np
import numpy.typing as npt

Samples: TypeAlias = npt.NDArray[np.float64]
"""Values with shape (REPEATS, poses). Row 0 has no rounding errors."""

REPEATS: Final = 6
_SINGLE_PRECISION: Final = 2.0**-23
_TOLERANCE: Final = 4.0
"""The tolerance is this multiple of the largest deviation among the repetitions."""
_LONGEST: Final = 500
_MOST_NODES: Final = 100


class Function(NamedTuple):
    """A function of formulas."""

    of_samples: Callable[..., Any]
    of_numbers: Callable[..., float] | None
    """The same function for the numbers of one pose. None: the function uses earlier poses."""
    arguments: int = 1
    is_exact: bool = False
    """Whether the function adds no rounding error to the result."""


FUNCTIONS: Final[Mapping[str, Function]] = {
    "sin": Function(np.sin, math.sin),
    "cos": Function(np.cos, math.cos),
    "tan": Function(np.tan, math.tan),
    "asin": Function(np.arcsin, math.asin),
    "acos": Function(np.arccos, math.acos),
    "atan": Function(np.arctan, math.atan),
    "atan2": Function(np.arctan2, math.atan2, arguments=2),
    "sqrt": Function(np.sqrt, math.sqrt),
    "cbrt": Function(np.cbrt, math.cbrt),
    "abs": Function(np.abs, abs, is_exact=True),
    "log": Function(np.log, math.log),
    "exp": Function(np.exp, math.exp),
    "trunc": Function(np.trunc, math.trunc, is_exact=True),
    "min": Function(np.minimum, min, arguments=2, is_exact=True),
    "max": Function(np.maximum, max, arguments=2, is_exact=True),
    "largest": Function(lambda samples: np.maximum.accumulate(samples, axis=1), None, is_exact=True),
    "smallest": Function(lambda samples: np.minimum.accumulate(samples, axis=1), None, is_exact=True),
    "first": Function(
        lambda samples: np.repeat(samples[:, :1], samples.shape[1], axis=1), None, is_exact=True
    ),
}
"""Known functions. ``largest``, ``smallest`` and ``first`` use all values since the beginning."""
_SIGNS: Final = {ast.Add: "+", ast.Sub: "-", ast.Mult: "*", ast.Div: "/", ast.Pow: "**"}
_OPERATORS: Final[Mapping[str, Function]] = {
    "+": Function(np.add, operator.add),
    "-": Function(np.subtract, operator.sub),
    "*": Function(np.multiply, operator.mul),
    "/": Function(np.divide, operator.truediv),
    "**": Function(np.power, math.pow),
}
CONSTANTS: Final = {"pi": math.pi}


class FormulaError(ValueError):
    """An invalid formula. The message names the rule."""


Node: TypeAlias = "Name | Number | FunctionCall | Operation | Negative"


@dataclass(frozen=True)
class Name:
    """A value that is identified by its name."""

    name: str


@dataclass(frozen=True)
class Number:
    """A constant."""

    value: float


@dataclass(frozen=True)
class FunctionCall:
    """A function of ``FUNCTIONS``."""

    function: str
    arguments: tuple[Node, ...]


@dataclass(frozen=True)
class Operation:
    """``left operator right``."""

    operator: str
    left: Node
    right: Node


@dataclass(frozen=True)
class Negative:
    """``-operand``."""

    operand: Node


def parse(text: str) -> Node:
    """Return the formula's tree. Raises FormulaError."""
    if len(text) > _LONGEST:
        raise FormulaError(f"must have at most {_LONGEST} characters, not {len(text)}")
    try:
        tree = ast.parse(text.strip(), mode="eval")
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        raise FormulaError("must be a formula such as atan2(-x, sqrt(y**2 + z**2))") from None
    if sum(1 for _ in ast.walk(tree)) > 3 * _MOST_NODES:
        raise FormulaError(f"must have at most {_MOST_NODES} terms")
    return _node(tree.body)


def _node(node: ast.expr) -> Node:
    match node:
        case ast.Name(id=name):
            return Number(CONSTANTS[name]) if name in CONSTANTS else Name(name)
        case ast.Constant(value=bool()):
            pass
        case ast.Constant(value=int() | float() as value) if abs(value) < 1e15:
            return Number(float(value))
        case ast.UnaryOp(op=ast.USub(), operand=operand):
            return Negative(_node(operand))
        case ast.BinOp(left=left, op=op, right=right) if type(op) in _SIGNS:
            return Operation(_SIGNS[type(op)], _node(left), _node(right))
        case ast.Call(func=ast.Name(id=name), args=arguments, keywords=[]) if name in FUNCTIONS:
            count = FUNCTIONS[name].arguments
            if len(arguments) != count:
                raise FormulaError(f"{name}() must have {count} arguments, not {len(arguments)}")
            return FunctionCall(name, tuple(map(_node, arguments)))
        case ast.Call(func=ast.Name(id=name)):
            raise FormulaError(f"unknown function {name}(); known: {', '.join(FUNCTIONS)}")
    raise FormulaError("must have names, numbers, + - * / ** and functions only")


def names(node: Node) -> Iterator[str]:
    """Yield the names in a formula, in the order of the text."""
    if isinstance(node, Name):
        yield node.name
    for child in children(node):
        yield from names(child)


def children(node: Node) -> tuple[Node, ...]:
    """Return the operands of a node."""
    match node:
        case FunctionCall(arguments=arguments):
            return arguments
        case Operation(left=left, right=right):
            return left, right
        case Negative(operand=operand):
            return (operand,)
    return ()


def with_children(node: Node, operands: tuple[Node, ...]) -> Node:
    """Return the node with other operands."""
    match node:
        case FunctionCall(function=function):
            return FunctionCall(function, operands)
        case Operation(operator=operator):
            return Operation(operator, *operands)
        case Negative():
            return Negative(*operands)
    return node


def simplified(node: Node) -> Node:
    """Return a formula without double negations and factors of 1."""
    node = with_children(node, tuple(map(simplified, children(node))))
    match node:
        case Negative(operand=Negative(operand=operand)):
            return operand
        case Negative(operand=Number(value=value)):
            return Number(-value)
        case Operation(operator="*", left=Number(value=1.0), right=operand):
            return operand
        case Operation(operator="*" | "/" | "**", left=operand, right=Number(value=1.0)):
            return operand
        case FunctionCall(function="largest" | "smallest" | "first", arguments=(Number() as number,)):
            return number
    return node


_PRECEDENCE: Final = {"+": 1, "-": 1, "*": 2, "/": 2, "**": 4}
_OF_NEGATIVE: Final = 3


def text(node: Node, above: int = 0) -> str:
    """Return a formula in C notation, but with ``^2`` for a square."""
    match node:
        case Name(name=name):
            return name
        case Number(value=value):
            return "pi" if value == math.pi else f"{value:.10g}"
        case FunctionCall(function=function, arguments=arguments):
            return f"{function}({', '.join(map(text, arguments))})"
        case Negative(operand=operand):
            return (
                f"(-{text(operand, _OF_NEGATIVE)})"
                if above > _OF_NEGATIVE
                else f"-{text(operand, _OF_NEGATIVE)}"
            )
        case Operation():
            return _operation_text(node, above)


def _operation_text(node: Operation, above: int) -> str:
    own = _PRECEDENCE[node.operator]
    if node.operator != "**":
        sign = f" {node.operator} " if own == 1 else node.operator
        inner = f"{text(node.left, own)}{sign}{text(node.right, own + 1)}"
    elif node.right == Number(2.0):
        inner = f"{text(node.left, own + 1)}^2"
    else:
        return f"pow({text(node.left)}, {text(node.right)})"
    return f"({inner})" if own < above else inner


def number(node: Node, values: Mapping[str, float]) -> float | None:
    """Return a formula's value in one pose, without rounding errors. This is much faster than :class:`Evaluator`.

    Return None if the formula needs the values of other poses, or is undefined for these values.
    """
    try:
        return _number(node, values)
    except (ArithmeticError, ValueError, KeyError):
        return None


def _number(node: Node, values: Mapping[str, float]) -> float:
    match node:
        case Number(value=value):
            return value
        case Name(name=name):
            return values[name]
        case Negative(operand=operand):
            return -_number(operand, values)
        case FunctionCall(function=name):
            apply = FUNCTIONS[name].of_numbers
        case Operation(operator=sign):
            apply = _OPERATORS[sign].of_numbers
    if apply is None:
        raise ValueError("the formula needs the values of other poses")
    return float(apply(*(_number(one, values) for one in children(node))))


class Evaluator:
    """Evaluator of formulas on named samples, with single-precision rounding errors."""

    def __init__(self, values: Mapping[str, Samples], poses: int) -> None:
        self.values = dict(values)
        self._poses = poses
        random = np.random.default_rng(0)
        self._noise = 1 + _SINGLE_PRECISION * random.uniform(-1, 1, (64, REPEATS, poses))
        self._noise[:, 0] = 1
        self._next = 0

    def __call__(self, node: Node) -> Samples:
        """Return the values of a formula: nan for missing inputs or outside of a function's domain."""
        with np.errstate(all="ignore"):
            return self._value(node)

    def tolerance(self, samples: Samples) -> npt.NDArray[np.float64]:
        """Return, for each pose, the largest difference that single-precision rounding may cause."""
        with np.errstate(all="ignore"):
            spread: npt.NDArray[np.float64] = np.abs(samples - samples[0]).max(axis=0)
            least: npt.NDArray[np.float64] = 2 * _SINGLE_PRECISION * np.abs(samples[0])
            return _TOLERANCE * spread + least

    def _value(self, node: Node) -> Samples:
        match node:
            case Number(value=value):
                return self._rounded(np.full((REPEATS, self._poses), value))
            case Name(name=name):
                return self.values[name] if name in self.values else np.full((REPEATS, self._poses), np.nan)
            case Negative(operand=operand):
                return np.negative(self._value(operand))
            case FunctionCall(function=function, arguments=arguments):
                applied = FUNCTIONS[function]
                result: Samples = applied.of_samples(*map(self._value, arguments))
                return result if applied.is_exact else self._rounded(result)
            case Operation(operator=sign, left=left, right=right):
                return self._rounded(_OPERATORS[sign].of_samples(self._value(left), self._value(right)))

    def _rounded(self, samples: Samples) -> Samples:
        self._next = (self._next + 1) % len(self._noise)
        is_exact = samples.astype(np.float32) == samples  # no rounding error
        result: Samples = np.where(is_exact, samples, samples * self._noise[self._next])
        return result
