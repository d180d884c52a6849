"""Exit codes of ``fcu`` for the calling program.

======  ==================================================================================================
0       all expectations are met; with ``diff``: no difference
1       an expectation failed; with ``diff``: the firmwares differ
2       usage error: the command, the scenario or the firmware's file cannot be used
3       the firmware failed: it crashed, hung, or exceeded a limit that is the same on every machine
4       it could not be judged: output was lost, the machine's resources or time ran out, the run ended
        before the expectations could be evaluated, or fcu itself has a bug
130     Ctrl-C, SIGTERM or SIGHUP, before anything was judged
141     the reader of standard output has closed it, as in ``fcu ... | head``
======  ==================================================================================================

Decision: exit codes 1 and 3 always describe the firmware, and every failure outside it is 4, so that a grader
can tell "wrong" from "try again". Lost output turns a 0 or a 1 into a 4. Rejected alternative: 1 for every
failure, which is Python's own code for an uncaught error.

Decision: a live board (``fcu web``) reports its scenario's expectations at the end, but exits with 0, because
the user may have moved the board or paused it. Then failed expectations do not describe the firmware.
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
    """The shell's code for a program ended by Ctrl-C; used for other requests to end as well."""
    READER_GONE = 141
    """The shell's code for a program ended by SIGPIPE."""


def code_of(error: FcuError) -> ExitCode:
    """Return the code of a known error; any other exception is a bug, and NOT_JUDGED."""
    if isinstance(error, NotJudgedError):
        return ExitCode.NOT_JUDGED
    if isinstance(error, LimitError) and error.limit == "wall_s":  # also describes the machine
        return ExitCode.NOT_JUDGED
    if isinstance(error, InputError):
        return ExitCode.USAGE_ERROR
    return ExitCode.FAILED if isinstance(error, ExpectationError) else ExitCode.FIRMWARE_FAILED


def with_losses(code: ExitCode, lost: int, reader_gone: bool = False) -> ExitCode:
    """Return ``code``, changed if ``lost`` bytes of output did not arrive or the reader has gone."""
    if not lost or code not in (ExitCode.PASSED, ExitCode.FAILED):
        return code
    return ExitCode.READER_GONE if reader_gone else ExitCode.NOT_JUDGED
