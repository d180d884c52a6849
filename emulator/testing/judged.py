"""One law of the lab's arithmetic, asked of a compiled firmware by whoever grades it, outside pytest.

Unlike in a test, the examples are the same for everybody and every time, and nothing is kept in a database.
"""

from __future__ import annotations

from typing import Any

import pytest

from emulator.errors import NotJudgedError
from emulator.testing.lab3 import Compiled, lab3_properties


def counterexample(firmware: str, law: str, examples: int) -> str | None:
    """What breaks the property ``test_<law>`` of ``lab3_properties``, in a line; None if nothing is found.

    Raises NotJudgedError for a firmware without the function, CallError where the call fails.
    """
    error = _failure(_laws(firmware, examples), law)
    if error is None:
        return None
    notes = [line.strip() for note in getattr(error, "__notes__", ()) for line in note.splitlines()]
    said = str(error).splitlines()
    return said[0] if said and said[0] else " ".join(notes)[:300] or "a counter-example was found"


def counterexample_scenario(firmware: str, law: str, examples: int) -> str:
    """The same counter-example as a scenario that fails on ``firmware``; "" if no board shows it.

    Raises as :func:`counterexample` does.
    """
    laws = _laws(firmware, examples)
    if _failure(laws, law) is None:
        return ""
    scenario: str = laws.board_scenario(getattr(type(laws), f"test_{law}").__wrapped__)
    return scenario


def _laws(firmware: str, examples: int) -> Any:
    laws = lab3_properties(Compiled(firmware), max_examples=examples, derandomize=True, database=None)()
    laws.on_board = False  # boards run only when their scenario is wanted
    return laws


def _failure(laws: Any, law: str) -> AssertionError | None:
    try:
        getattr(laws, f"test_{law}")()
    except pytest.skip.Exception as error:
        raise NotJudgedError(str(error)) from error
    except AssertionError as error:
        return error
    return None
