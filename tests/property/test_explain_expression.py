"""Laws of the formulas in explanations."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from fcu_emulator.emulator.explain.edits import edits
from fcu_emulator.emulator.explain.expression import (
    FUNCTIONS,
    Evaluator,
    FormulaError,
    FunctionCall,
    Name,
    Negative,
    Node,
    Number,
    Operation,
    names,
    number,
    parse,
    simplified,
    text,
)

VALUES = {"a": 1.25, "b": -2.5, "c": 300.0}


def nodes() -> st.SearchStrategy[Node]:
    leaves: st.SearchStrategy[Node] = st.one_of(
        st.sampled_from(list(VALUES)).map(Name), st.sampled_from([1.0, 2.0, 0.5, 273.15]).map(Number)
    )
    return st.recursive(
        leaves,
        lambda inner: st.one_of(
            inner.map(Negative),
            st.builds(Operation, st.sampled_from("+-*/"), inner, inner),
            st.builds(lambda one: Operation("**", one, Number(2.0)), inner),
            st.builds(lambda one: FunctionCall("sin", (one,)), inner),
            st.builds(lambda one, other: FunctionCall("atan2", (one, other)), inner, inner),
        ),
        max_leaves=8,
    )


def value(node: Node) -> float:
    evaluator = Evaluator({name: np.full((6, 1), one) for name, one in VALUES.items()}, 1)
    return float(evaluator(node)[0, 0])


def python_value(source: str) -> float:
    functions = {"sin": np.sin, "atan2": np.arctan2, "pow": np.power}
    with np.errstate(all="ignore"):
        numbers = {name: np.float64(one) for name, one in VALUES.items()}
        return float(eval(source, {"__builtins__": {}}, {**functions, **numbers}))  # generated here


@given(nodes())
def test_printed_formula_has_same_value(node: Node) -> None:
    """Python, as a second implementation, evaluates the printed formula."""
    printed = text(node).replace("^2", "**2")
    try:
        expected = python_value(printed)
    except (ZeroDivisionError, OverflowError):
        return
    assert value(node) == pytest.approx(expected, nan_ok=True)


@given(nodes())
def test_value_for_one_pose_equals_that_of_evaluator(node: Node) -> None:
    """A formula that is undefined for the values has no number."""
    one = number(node, VALUES)
    if one is not None and math.isfinite(one):
        assert one == pytest.approx(value(node), rel=1e-9)
    elif one is None:
        assert not math.isfinite(value(node))


@pytest.mark.parametrize("name", FUNCTIONS)
def test_function_gives_same_value_for_pose_and_samples(name: str) -> None:
    arguments = tuple(map(Number, (0.75, -2.5)[: FUNCTIONS[name].arguments]))
    one = number(FunctionCall(name, arguments), {})

    assert (
        one is None
        if name in ("largest", "smallest", "first")
        else one == pytest.approx(value(FunctionCall(name, arguments)))
    )


@given(nodes())
@example(Operation("**", Operation("**", Name("a"), Number(2.0)), Number(2.0)))
def test_formula_can_be_parsed_from_its_text(node: Node) -> None:
    again = parse(text(node).replace("^2", "**2"))
    assert text(again) == text(node)


@given(nodes())
def test_simplified_formula_has_same_value(node: Node) -> None:
    assert value(simplified(node)) == pytest.approx(value(node), nan_ok=True)


@given(nodes())
def test_edits_use_known_names_only(node: Node) -> None:
    for edited in edits(node, ["a", "b", "c"]):
        assert set(names(edited)) <= set(VALUES)


@given(nodes())
def test_tolerance_covers_single_precision(node: Node) -> None:
    """A chain of float32 operations differs from the exact value by at most the tolerance."""
    evaluator = Evaluator({name: np.full((6, 1), one) for name, one in VALUES.items()}, 1)
    samples = evaluator(node)
    single = _in_single_precision(node)
    if math.isfinite(single) and abs(samples[0, 0]) < 1e30 and _is_conditioned(samples):
        assert abs(single - samples[0, 0]) <= 3 * evaluator.tolerance(samples)[0] + 1e-6


def _is_conditioned(samples: np.ndarray) -> bool:
    if not np.isfinite(samples).all():
        return False
    spread = float(np.ptp(samples[:, 0]))
    return math.isfinite(spread) and spread < 1e-4 * abs(samples[0, 0]) + 1e-9


def _in_single_precision(node: Node) -> float:
    with np.errstate(all="ignore"):
        return float(_single(node))


def _single(node: Node) -> np.float32:
    match node:
        case Name(name=name):
            return np.float32(VALUES[name])
        case Number(value=number):
            return np.float32(number)
        case Negative(operand=operand):
            return np.float32(-_single(operand))
        case FunctionCall(function="sin", arguments=(one,)):
            return np.sin(_single(one))
        case FunctionCall(arguments=(one, other)):
            return np.arctan2(_single(one), _single(other))
        case Operation(operator=operator, left=left, right=right):
            apply = {
                "+": np.add,
                "-": np.subtract,
                "*": np.multiply,
                "/": np.divide,
                "**": np.power,
            }[operator]
            return np.float32(apply(_single(left), _single(right)))
    raise AssertionError(node)


WRONG = (
    *("", "a +", "import os", "a.b", "a[0]", "lambda: a", "f(a)", "sin()", "sin(a, b)", "a if b else c"),
    *("'text'", "True", "a < b", "sin(x=a)", "1e400", "a" * 501, "(" * 200, "-" * 300 + "a"),
)


@pytest.mark.parametrize("wrong", WRONG)
def test_wrong_formula_is_refused(wrong: str) -> None:
    with pytest.raises(FormulaError):
        parse(wrong)
