"""Requests to end: ``kill`` and a closed terminal window end a command as Ctrl-C does.

By default Python ends the process at once on SIGTERM and SIGHUP. Temporary folders and the files by which
other programs find a board would remain, without a message. Here both raise :class:`Terminated`, so every
``finally`` is executed, and the command ends with the exit code of an interruption. A command with its own
orderly end, such as ``fcu run``, replaces this handler while its board runs.

Decision: a signal that is ignored at the start stays ignored, because with ``nohup`` the user wants the
command to outlive the terminal.
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
"""Signals for which :class:`Terminated` has been raised."""


class Terminated(BaseException):
    """The process was asked to end by signal ``number``.

    It is not an Exception, so that code that handles any error does not handle it.
    """

    def __init__(self, number: int) -> None:
        self.number = number
        super().__init__(signal.Signals(number).name)


def end_in_order() -> None:
    """From now on raise :class:`Terminated` in the main thread on a request to end."""
    for name in _NAMES:
        number = getattr(signal, name, None)
        if number is not None and signal.getsignal(number) is signal.SIG_DFL:
            signal.signal(number, _raise)


def end_at_once() -> None:
    """From now on end the process at once on a request to end, because all work is done."""
    for name in _NAMES:
        number = getattr(signal, name, None)
        if number is not None and signal.getsignal(number) is _raise:
            signal.signal(number, signal.SIG_DFL)


def ask_again(unraisable: sys.UnraisableHookArgs) -> None:
    """Repeat a request to end that arrived while Python could not raise it, for example in a destructor.

    By default Python prints the exception and continues, so the program would not end. Another thread must
    repeat it: raised here, it would be dropped again.
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
    if _raised and _is_worker():  # the parent has passed on its signal, which the worker had already received
        return
    _raised.append(number)
    raise Terminated(number)


def _is_worker() -> bool:
    """Return whether this is a worker of :mod:`fcu_emulator.emulator.host.isolation`, which loads that module first.

    This function must not import: a signal may come while the import system has loaded that module only in
    part.
    """
    limits_of_worker = getattr(
        sys.modules.get("fcu_emulator.emulator.host.isolation"), "limits_of_worker", None
    )
    return limits_of_worker is not None and limits_of_worker() is not None
