"""Actions that must be done before the process ends, such as deleting files that other programs read.

Decision: normal cleanup is a ``finally`` or an ExitStack, but a signal may raise an exception between the creation
of a file and its ``try``, and a second signal may interrupt the cleanup itself. Actions registered here are done at
the latest by :func:`clean_up`, which the entry point repeats until it is complete.
"""

from __future__ import annotations

from collections.abc import Callable

_actions: dict[Callable[[], None], None] = {}


def before_exit(action: Callable[[], None]) -> None:
    """Do ``action`` before the process ends, unless :func:`done` is called; doing it twice must be harmless."""
    _actions[action] = None


def done(action: Callable[[], None]) -> None:
    """Forget ``action``: it was done."""
    _actions.pop(action, None)


def clean_up() -> None:
    """Do the actions, the latest first. An interrupted call can be repeated."""
    while _actions:
        action = next(reversed(_actions))
        action()
        done(action)
