"""Cleanup before the process ends, such as removal of files that other programs read.

Decision: cleanup that must not be lost is also registered with :func:`before_exit`. Signals may
interrupt the code between a file's creation and its ``try``, or a ``finally``. The entry point
repeats :func:`clean_up` until all actions are done.
"""

from __future__ import annotations

from collections.abc import Callable

_actions: dict[Callable[[], None], None] = {}


def before_exit(action: Callable[[], None]) -> None:
    """Register an action for the process' end, unless :func:`done` is called. It may run twice."""
    _actions[action] = None


def done(action: Callable[[], None]) -> None:
    """Remove a completed action from the register."""
    _actions.pop(action, None)


def clean_up() -> None:
    """Run the registered actions, the latest first. Repeat an interrupted call."""
    while _actions:
        action = next(reversed(_actions))
        action()
        done(action)
