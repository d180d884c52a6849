"""Cleanup before the process ends, such as removal of files that other programs read.

Decision: if cleanup must always run, it is also registered with :func:`before_exit`. A signal may
arrive between a file's creation and its ``try``, or inside ``finally``. The entry point repeats
:func:`clean_up` until all actions are done.
"""

from __future__ import annotations

from collections.abc import Callable

_actions: dict[Callable[[], None], None] = {}


def before_exit(action: Callable[[], None]) -> None:
    """Run ``action`` before the process ends, unless :func:`done` removes it. The action may run twice."""
    _actions[action] = None


def done(action: Callable[[], None]) -> None:
    """Remove a completed action from the register."""
    _actions.pop(action, None)


def clean_up() -> None:
    """Run the registered actions, the latest first. After an interrupt, call this again."""
    while _actions:
        action = next(reversed(_actions))
        action()
        done(action)
