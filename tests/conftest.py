"""Settings for every test: reproducible hypothesis runs, and helpers importable as ``tests.support.<name>``."""

from __future__ import annotations

import signal
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import pytest
from hypothesis import Phase, settings

if TYPE_CHECKING:
    from xdist.remote import Producer
    from xdist.scheduler import WorkStealingScheduling

    from tests.support.words import Words

# `pytest` and `python -m pytest` must find the same modules; only the second puts the root on the path.
ROOT = str(Path(__file__).parents[1])
if ROOT not in sys.path:
    sys.path.insert(0, ROOT)

# The same examples on every machine and no time limit per example: a test never fails for being run
# elsewhere.
settings.register_profile("reproducible", derandomize=True, deadline=None)
# Where a failure is one of C, the first example that shows it will do, and a smaller one would take minutes.
_PHASES = (Phase.explicit, Phase.generate)
settings.register_profile("unshrunk", derandomize=True, deadline=None, phases=_PHASES)
settings.load_profile("reproducible")


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add the option that accepts changed words; see tests/support/words.py."""
    parser.addoption(
        "--update-words", action="store_true", help="write the golden words of the tests that run"
    )


@pytest.fixture
def words(request: pytest.FixtureRequest) -> Words:
    """Compare output of the product with its golden words: ``words("grade", done.stderr)``."""
    from tests.support.words import Words  # not before the root is on the path

    return Words(request)


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Mark the tests that were measured to be slow."""
    from tests.slow import mark  # not before the root is on the path

    mark(items)


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config: pytest.Config, log: Producer) -> WorkStealingScheduling:
    """Schedule tests so that an idle process takes tests from another process.

    Slow tests are listed together. The default of pytest-xdist gives them all to one process: with two cores, one
    core was idle for half of a full run.
    """
    from xdist.scheduler import WorkStealingScheduling

    return WorkStealingScheduling(config, log)


@pytest.fixture
def interruptible() -> Iterator[None]:
    """Let programs that tests start receive Ctrl-C and hang-ups, even if the tests were started to ignore them.

    A shell's ``&`` and ``nohup`` ignore these signals, and programs inherit this setting.
    """
    usual = {signal.SIGINT: signal.default_int_handler}
    if sys.platform != "win32":
        usual[signal.SIGHUP] = signal.SIG_DFL
    before = {number: signal.signal(number, handler) for number, handler in usual.items()}
    yield
    for number, handler in before.items():
        signal.signal(number, handler)
