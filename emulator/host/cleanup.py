"""Cleanup that must be done before the process ends, such as the removal of files that other programs read.

Decision: cleanup that must not be lost is also registered with :func:`before_exit`. A signal may raise an exception
between the creation of a file and its ``try``, and a second signal may interrupt a ``finally`` or an ExitStack.
:func:`clean_up` does the remaining actions, and the entry point repeats it until it is complete.
"""

from __future__ import annotations

from collections.abc import Callable

_actions: dict[Callable[[], None], None] = {}


def before_exit(action: Callable[[], None]) -> None:
    """Register an action for the end of the process, unless :func:`done` is called. It may be called twice."""
    _actions[action] = None


def done(action: Callable[[], None]) -> None:
    """Remove an action that was done from the register."""
    _actions.pop(action, None)


def clean_up() -> None:
    """Do the registered actions, the latest first. An interrupted call can be repeated."""
    while _actions:
        action = next(reversed(_actions))
        action()
        done(action)
