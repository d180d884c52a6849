"""Check of one law of the lab's arithmetic on compiled firmware, without pytest.

Examples are the same in a clone and with an installed wheel.

Decision: only the first counter-example is reported, because Hypothesis raises several as an
exception group.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterator
from contextlib import contextmanager
from functools import lru_cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any
from unittest import SkipTest

from hypothesis import configuration

from fcu_emulator.emulator.errors import NotJudgedError
from fcu_emulator.emulator.testing.lab3 import Compiled, lab3_properties


def counterexample(firmware: str, law: str, examples: int) -> str | None:
    """Return one line about a violation of the property ``test_<law>``, or None.

    Raises NotJudgedError if a function is missing, and CallError if a call fails.
    """
    error = _failure(_laws(firmware, examples), law)
    return None if error is None else _in_a_line(error)


def counterexample_scenario(firmware: str, law: str, examples: int) -> str:
    """Return the counter-example as a scenario that fails on ``firmware``, or "".

    Raises the errors of :func:`counterexample`.
    """
    laws = _laws(firmware, examples)
    if _failure(laws, law) is None:
        return ""
    scenario: str = laws.board_scenario(getattr(type(laws), f"test_{law}").__wrapped__)
    return scenario


def _laws(firmware: str, examples: int) -> Any:
    file = Path(firmware)
    digest = hashlib.sha256(file.read_bytes()).digest() if file.is_file() else b""
    laws = lab3_properties(
        _compiled(firmware, digest), max_examples=examples, derandomize=True, database=None
    )()
    laws.on_board = False  # boards run only if a scenario is requested
    return laws


@lru_cache(maxsize=1)
def _compiled(firmware: str, digest: bytes) -> Compiled:
    """Return the firmware, cached for all laws. ``digest`` identifies the contents of the file."""
    del digest
    return Compiled(firmware)


def _failure(laws: Any, law: str) -> Exception | None:
    try:
        with _nothing_stored(), _no_constants_of_sources():
            getattr(laws, f"test_{law}")()
    except SkipTest as error:
        raise NotJudgedError(str(error)) from error
    except AssertionError as error:
        return error
    except ExceptionGroup as group:
        broken, _ = group.split(AssertionError)
        if broken is None:
            raise
        return next(_leaves(broken))
    return None


@contextmanager
def _nothing_stored() -> Iterator[None]:
    """Keep Hypothesis from creating its folder in the student's project."""
    before = vars(configuration).get("__hypothesis_home_directory")
    with TemporaryDirectory(prefix="fcu-hypothesis-") as folder:
        configuration.set_hypothesis_home_dir(folder)
        try:
            yield
        finally:
            configuration.set_hypothesis_home_dir(before)


@contextmanager
def _no_constants_of_sources() -> Iterator[None]:
    """Prevent Hypothesis from trying constants of local modules, because only a clone has these modules."""
    try:
        from hypothesis.internal.conjecture import providers
        from hypothesis.internal.constants_ast import Constants

        collect = vars(providers)["_get_local_constants"]
    except (ImportError, KeyError):  # a version of Hypothesis without this function
        yield
        return
    vars(providers)["_get_local_constants"] = Constants
    try:
        yield
    finally:
        vars(providers)["_get_local_constants"] = collect


def _leaves(group: ExceptionGroup[Exception]) -> Iterator[Exception]:
    for one in group.exceptions:
        if isinstance(one, ExceptionGroup):
            yield from _leaves(one)
        else:
            yield one


def _in_a_line(error: Exception) -> str:
    notes = [line.strip() for note in getattr(error, "__notes__", ()) for line in note.splitlines()]
    said = str(error).splitlines()
    return said[0] if said and said[0] else " ".join(notes)[:300] or "a counter-example was found"
