"""Entry point of the command line ``fcu``; it reports every error in one line and an exit code.

Large modules are imported inside functions. So ``fcu --help`` answers at once, and a lack of memory for them
is reported like any other error (:mod:`fcu_emulator.emulator.cli.exit_codes`).
"""

from __future__ import annotations

import errno
import gc
import math
import os
import sys
import traceback
import warnings
from contextlib import suppress
from io import TextIOWrapper
from typing import TYPE_CHECKING, TextIO

from fcu_emulator.emulator.cli.signals import Terminated, ask_again, end_at_once, end_in_order

if TYPE_CHECKING:
    from collections.abc import Sequence

    from fcu_emulator.emulator.cli.exit_codes import ExitCode

_OUT_OF_RESOURCES = {errno.ENOMEM, errno.EMFILE, errno.ENFILE, errno.ENOSPC, errno.EDQUOT, errno.EAGAIN}
_COMPLETION = "_FCU_COMPLETE"
"""Variable by which a shell requests completions; click derives the name from the program's."""
_LEAST_ADDRESS_SPACE = 256 << 20
"""Minimum address space in bytes: with less, numpy's linear algebra ends the process at once with exit code 1."""
_NOT_JUDGED, _INTERRUPTED, _READER_GONE = 4, 130, 141
"""Copies of codes in emulator.cli.exit_codes, because the import of that module may fail."""


def main() -> None:
    """Run the command line and exit with its code."""
    _start_quickly()
    _write_what_can_be_written()
    sys.unraisablehook = ask_again
    end_in_order()
    try:
        code = int(execute(sys.argv[1:]))
    except Terminated:  # while another request to end was reported
        code = _INTERRUPTED
    end_at_once()
    for stream in (sys.stdout, sys.stderr):
        lost = None if stream is None else _lost(stream)
        if lost is not None and stream is sys.stdout and code in (0, 1):
            code = _READER_GONE if _is_broken_pipe(lost) else _NOT_JUDGED
    sys.exit(code)


def _start_quickly() -> None:
    """Change two default settings of libraries that take a sixth of each command's start without benefit."""
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # numpy's threads: matrices here are 3 x 3
    gc.set_threshold(20_000)  # new objects before the next garbage collection; loaded modules stay


def _write_what_can_be_written() -> None:
    """Replace characters that the system's encoding lacks by question marks, instead of failing.

    On Windows, files and pipes use the country's legacy encoding, which has no Greek, and a different code
    for the degree sign. Rejected alternative: UTF-8 on every system, which other programs on that system
    could not read.
    """
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, TextIOWrapper) and stream.errors == "strict":
            stream.reconfigure(errors="replace")


def execute(arguments: Sequence[str]) -> ExitCode | int:
    """Run the command line and return its exit code."""
    try:
        if _address_space() < _LEAST_ADDRESS_SPACE:
            raise MemoryError
        return _execute(arguments)
    except (KeyboardInterrupt, Terminated) as error:
        return _interrupted(error)
    except MemoryError:
        _complain(
            "cannot continue: not enough memory; close other programs, or raise the limit (ulimit -v,"
            " or with --isolate --limit memory_bytes=NUMBER)"
        )
    except OSError as error:
        if _was_printing(error) and _is_broken_pipe(error):
            return _READER_GONE
        if _was_printing(error):
            _complain(f"standard output: {error.strerror or error}; the output is incomplete")
        elif error.errno in _OUT_OF_RESOURCES:
            _complain(f"cannot continue: this machine has run out of a resource: {error}")
        else:
            _report_bug()
    except Exception as error:
        request = _request_inside(error)
        if request is not None:
            return _interrupted(request)
        _report_bug()
    return _NOT_JUDGED


def _interrupted(request: BaseException) -> int:
    """Report the signal that ended the command, unless it was Ctrl-C; return the exit code."""
    if isinstance(request, Terminated):
        _complain(f"ended by {request}")
    return _INTERRUPTED


def _request_inside(error: BaseException) -> BaseException | None:
    """Return the request to end that ``error`` was raised from, if there is one.

    Before version 3.12 Python raises RuntimeError for a request during ``__set_name__``.
    """
    found: BaseException | None = error
    while found is not None and not isinstance(found, KeyboardInterrupt | Terminated):
        found = found.__cause__ or found.__context__
    return found


def _execute(arguments: Sequence[str]) -> ExitCode | int:
    import click

    from fcu_emulator.emulator.cli.commands import cli
    from fcu_emulator.emulator.cli.exit_codes import ExitCode, code_of
    from fcu_emulator.emulator.cli.screen import say
    from fcu_emulator.emulator.errors import FcuError, OutputError

    warnings.showwarning = _show_warning
    try:
        if sys.stdout is None and _prints(arguments):
            raise OutputError(
                f"cannot print: standard output is closed; redirect it, for example > {os.devnull}"
            )
        try:
            code = cli.main(list(arguments), prog_name="fcu", standalone_mode=False, obj=arguments)
        except SystemExit as error:
            if _COMPLETION in os.environ:  # a shell requests completions; click answers and exits
                return int(error.code or 0)
            return (
                ExitCode.READER_GONE
            )  # click's own reaction to a broken pipe: exit code 1 without a message
        return code if isinstance(code, int) else ExitCode.PASSED
    except click.ClickException as error:
        with suppress(OSError):
            error.show()
        return ExitCode.USAGE_ERROR
    except click.Abort:
        return ExitCode.INTERRUPTED
    except FcuError as error:
        summary, *details = str(error).splitlines() or [
            ""
        ]  # a diagnosis and a compiler's output have details
        say(summary, "fail")
        for line in details:
            say(line)
        return code_of(error)


def _show_warning(
    message: Warning | str,
    category: type[Warning],
    filename: str,
    lineno: int,
    file: TextIO | None = None,
    line: str | None = None,
) -> None:
    """Print a warning for users, such as a key's old name, in one line; ignore warnings for programmers."""
    del filename, lineno, file, line
    if issubclass(category, FutureWarning):
        from fcu_emulator.emulator.cli.screen import say

        say(f"warning: {message}", "warning")


def _address_space() -> float:
    """Return the number of bytes that this process may use, as far as the system reports a limit."""
    limit = math.inf
    if sys.platform != "win32":
        import resource

        soft, _ = resource.getrlimit(resource.RLIMIT_AS)
        limit = limit if soft == resource.RLIM_INFINITY else soft
    return limit


def _prints(arguments: Sequence[str]) -> bool:
    """Return whether a command needs standard output; ``run`` has an option for its text."""
    return arguments[:1] != ["run"] or not {"-h", "--help"}.isdisjoint(arguments)


def _was_printing(error: OSError) -> bool:
    """Return whether ``error`` occurred while writing to standard output; errors on stderr are ignored."""
    frames = traceback.walk_tb(error.__traceback__)
    return any(frame.f_globals.get("__name__") == "click.utils" for frame, _ in frames)


def _report_bug() -> None:
    with suppress(OSError):
        traceback.print_exc()
    _complain("this is a bug in fcu-emulator; please report the lines above")


def _complain(line: str) -> None:
    if sys.stderr is None:  # closed before this process started
        return
    from fcu_emulator.emulator.text import visible

    with suppress(OSError, ValueError):  # stderr may be full or closed
        sys.stderr.write(f"fcu: {visible(line)}\n")


def _is_broken_pipe(error: BaseException) -> bool:
    """Return whether the reader of standard output has closed it, which is not an error."""
    from fcu_emulator.emulator.links.writer import is_broken_pipe

    return is_broken_pipe(error)


def _lost(stream: TextIO) -> Exception | None:
    """Flush the stream; on failure redirect it, so that the interpreter does not try again, and return the error."""
    try:
        stream.flush()
    except (OSError, ValueError) as error:
        with suppress(OSError, ValueError):
            null = os.open(os.devnull, os.O_WRONLY)
            os.dup2(null, stream.fileno())
            os.close(null)
        return error
    return None
