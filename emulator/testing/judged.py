"""One law of the lab's arithmetic, asked of a compiled firmware by whoever grades it, outside pytest.

Unlike in a test, the examples are the same for everybody and every time, and nothing is kept in a database.
"""

from __future__ import annotations

import pytest

from emulator.errors import NotJudgedError
from emulator.testing.lab3 import Compiled, lab3_properties


def counterexample(firmware: str, law: str, examples: int) -> str | None:
    """What breaks the property ``test_<law>`` of ``lab3_properties``, in a line; None if nothing is found.

    Raises NotJudgedError for a firmware without the function, CallError where the call fails.
    """
    laws = lab3_properties(Compiled(firmware), max_examples=examples, derandomize=True, database=None)
    try:
        getattr(laws(), f"test_{law}")()
    except pytest.skip.Exception as error:
        raise NotJudgedError(str(error)) from error
    except AssertionError as error:
        notes = [line.strip() for note in getattr(error, "__notes__", ()) for line in note.splitlines()]
        said = str(error).splitlines()
        return said[0] if said and said[0] else " ".join(notes)[:300] or "a counter-example was found"
    return None
