"""Exit codes of ``fcu``.

======  ==========================================================================================
0       all expectations are met; with ``diff``: no difference
1       an expectation failed; with ``diff``: the firmwares differ
2       usage error in the command, the scenario or the firmware's file
3       the firmware crashed, hung, or exceeded a limit that is the same on every machine
4       not judged: lost output, lack of resources or time, an early end, or a bug of fcu
130     Ctrl-C, SIGTERM or SIGHUP, before anything was judged
141     the reader of standard output has closed it, as in ``fcu ... | head``
======  ==========================================================================================

Decision: exit codes 1 and 3 always describe the firmware, and a failure outside of the firmware has code 4,
so that a grader can tell "wrong" from "try again".

Decision: ``fcu web`` reports its scenario's expectations but exits with 0, because the user may
have moved the board.
"""

from __future__ import annotations

from enum import IntEnum

from fcu_emulator.emulator.errors import ExpectationError, FcuError, InputError, LimitError, NotJudgedError


class ExitCode(IntEnum):
    """Exit codes, described in the module."""

    PASSED = 0
    FAILED = 1
    USAGE_ERROR = 2
    FIRMWARE_FAILED = 3
    NOT_JUDGED = 4
    INTERRUPTED = 130
    """The shell's code after Ctrl-C. Other requests to end have the same code."""
    READER_GONE = 141
    """The shell's code after SIGPIPE."""


def code_of(error: FcuError) -> ExitCode:
    """Return the code of a known error, or NOT_JUDGED for a bug."""
    if isinstance(error, NotJudgedError):
        return ExitCode.NOT_JUDGED
    if isinstance(error, LimitError) and error.limit == "wall_s":  # depends on the machine
        return ExitCode.NOT_JUDGED
    if isinstance(error, InputError):
        return ExitCode.USAGE_ERROR
    return ExitCode.FAILED if isinstance(error, ExpectationError) else ExitCode.FIRMWARE_FAILED


def with_losses(code: ExitCode, lost: int, reader_gone: bool = False) -> ExitCode:
    """Return ``code``, or the code of a loss if ``lost`` bytes of output did not arrive."""
    if not lost or code not in (ExitCode.PASSED, ExitCode.FAILED):
        return code
    return ExitCode.READER_GONE if reader_gone else ExitCode.NOT_JUDGED
