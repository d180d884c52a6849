"""Requests to end: SIGTERM and SIGHUP raise :class:`Terminated`, so that every ``finally`` runs.

Decision: if a signal is ignored at the start, it stays ignored, because with ``nohup`` the command
must continue after the terminal is closed.
"""

from __future__ import annotations

import _thread
import signal
import sys
import threading
from types import FrameType

_NAMES = ("SIGTERM", "SIGHUP", "SIGBREAK")
_AGAIN_AFTER_S = 0.02
_raised: list[int] = []
"""Signals that have raised :class:`Terminated`."""


class Terminated(BaseException):
    """Signal ``number`` asked the process to end. ``except Exception`` does not catch this exception."""

    def __init__(self, number: int) -> None:
        self.number = number
        super().__init__(signal.Signals(number).name)


def end_in_order() -> None:
    """Let future requests raise :class:`Terminated` in the main thread."""
    for name in _NAMES:
        number = getattr(signal, name, None)
        if number is not None and signal.getsignal(number) is signal.SIG_DFL:
            signal.signal(number, _raise)


def end_at_once() -> None:
    """Let future requests end the process immediately."""
    for name in _NAMES:
        number = getattr(signal, name, None)
        if number is not None and signal.getsignal(number) is _raise:
            signal.signal(number, signal.SIG_DFL)


def ask_again(unraisable: sys.UnraisableHookArgs) -> None:
    """Repeat a termination request that Python could not raise as an exception.

    Another thread repeats the request, because Python would ignore the request in this thread.
    """
    error = unraisable.exc_value
    if isinstance(error, KeyboardInterrupt | Terminated):
        _raised.clear()
        number = error.number if isinstance(error, Terminated) else signal.SIGINT
        again = threading.Timer(_AGAIN_AFTER_S, _thread.interrupt_main, (number,))
        again.daemon = True
        again.start()
    else:
        sys.__unraisablehook__(unraisable)


def _raise(number: int, frame: FrameType | None) -> None:
    del frame
    if _raised and _is_worker():  # the parent has repeated its signal
        return
    _raised.append(number)
    raise Terminated(number)


def _is_worker() -> bool:
    """Return whether this is a worker of :mod:`fcu_emulator.emulator.host.isolation`.

    This function must not import that module, because a signal may come while the module is only partly loaded.
    """
    limits_of_worker = getattr(
        sys.modules.get("fcu_emulator.emulator.host.isolation"), "limits_of_worker", None
    )
    return limits_of_worker is not None and limits_of_worker() is not None
