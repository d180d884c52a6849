"""What ``fcu`` tells whoever started it, in one number.

======  ==================================================================================================
0       everything that was expected was seen; with ``diff``: no difference
1       an expectation failed; with ``diff``: the firmwares differ
2       wrong use: the command, the scenario or the firmware's file cannot be used
3       the firmware failed: it crashed, hung, or went beyond a limit that is the same on every machine
4       it could not be judged: output was lost, the machine's resources or time ran out, the run ended
        before the expectations could be looked at, or fcu itself has a bug
130     Ctrl-C, SIGTERM or SIGHUP, before anything was judged
141     the reader of standard output has closed it, as in ``fcu ... | head``
======  ==================================================================================================

Decision: 1 and 3 speak of the firmware only, and are given only when the firmware is at fault; whatever goes
wrong around it is 4, so that a grader can tell "wrong" from "try again". Lost output turns a 0 or a 1 into a
4. The road not taken, 1 for every failure, is Python's own code for an error nobody caught.

Decision: a live board (``fcu web``) says at its end how its scenario's expectations stand, and ends with 0
all the same: a hand may have moved the board or held up its time, and then they say nothing of the firmware.
"""

from __future__ import annotations

from enum import IntEnum

from fcu_emulator.emulator.errors import ExpectationError, FcuError, InputError, LimitError, NotJudgedError


class ExitCode(IntEnum):
    """The codes; see the module."""

    PASSED = 0
    FAILED = 1
    USAGE_ERROR = 2
    FIRMWARE_FAILED = 3
    NOT_JUDGED = 4
    INTERRUPTED = 130
    """The shell's own code for a program that Ctrl-C ended; of other requests to end as well."""
    READER_GONE = 141
    """The shell's own code for a program that SIGPIPE ended."""


def code_of(error: FcuError) -> ExitCode:
    """The code of an error of ours; everything else that is raised is a bug, and NOT_JUDGED."""
    if isinstance(error, NotJudgedError):
        return ExitCode.NOT_JUDGED
    if isinstance(error, LimitError) and error.limit == "wall_s":  # says as much about the machine
        return ExitCode.NOT_JUDGED
    if isinstance(error, InputError):
        return ExitCode.USAGE_ERROR
    return ExitCode.FAILED if isinstance(error, ExpectationError) else ExitCode.FIRMWARE_FAILED


def with_losses(code: ExitCode, lost: int, reader_gone: bool = False) -> ExitCode:
    """``code`` of a run of which ``lost`` bytes of output did not arrive; the reader may have left."""
    if not lost or code not in (ExitCode.PASSED, ExitCode.FAILED):
        return code
    return ExitCode.READER_GONE if reader_gone else ExitCode.NOT_JUDGED
