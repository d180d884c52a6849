"""Entry point of ``fcu``. Every error becomes one line and an exit code.

Large modules are imported inside functions, so that ``fcu --help`` prints immediately.
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
_NAME_PROBLEMS = {errno.ENAMETOOLONG, errno.ELOOP}
_LONGEST_NAME = 60  # characters of a file's name in a message
_COMPLETION = "_FCU_COMPLETE"
"""Variable by which a shell requests completions. Click derives this name from ``fcu``."""
_LEAST_ADDRESS_SPACE = 256 << 20
"""Bytes of address space. With fewer bytes, numpy's linear algebra ends the process with code 1."""
_USAGE_ERROR, _NOT_JUDGED, _INTERRUPTED, _READER_GONE = 2, 4, 130, 141
"""Copies of exit codes, because importing exit_codes may fail."""


def main() -> None:
    """Run the command line and exit with its code."""
    _start_quickly()
    _write_what_can_be_written()
    sys.unraisablehook = ask_again
    end_in_order()
    code = _execute_and_clean_up(sys.argv[1:])
    for stream in (sys.stdout, sys.stderr):
        lost = None if stream is None else _lost(stream)
        if lost is not None and stream is sys.stdout and code in (0, 1):
            code = _READER_GONE if _is_broken_pipe(lost) else _NOT_JUDGED
    sys.exit(code)


def _execute_and_clean_up(arguments: Sequence[str]) -> int:
    """Run the command line and clean up, even if further signals interrupt the cleanup."""
    code = None
    while True:
        try:
            if code is None:
                code = int(execute(arguments))
            cleanup = sys.modules.get("fcu_emulator.emulator.host.cleanup")
            if cleanup is not None:
                cleanup.clean_up()
            end_at_once()
        except (KeyboardInterrupt, Terminated):
            code = _INTERRUPTED
        else:
            return code


def _start_quickly() -> None:
    """Change library defaults that take a sixth of the start-up time."""
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # matrices here are 3 x 3
    gc.set_threshold(20_000)  # fewer collections: loaded modules are never garbage


def _write_what_can_be_written() -> None:
    """Print question marks for characters that the system's encoding lacks."""
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
        elif error.errno in _NAME_PROBLEMS:
            _complain(f"cannot use {str(error.filename)[:_LONGEST_NAME]!r}: {error.strerror}")
            return _USAGE_ERROR
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
    if isinstance(request, Terminated):
        _complain(f"ended by {request}")
    return _INTERRUPTED


def _request_inside(error: BaseException) -> BaseException | None:
    """Return the termination request inside ``error``. Before Python 3.12, ``__set_name__`` wraps exceptions."""
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
            if _COMPLETION in os.environ:  # click prints the completions and exits
                return int(error.code or 0)
            return ExitCode.READER_GONE  # click exits with 1 on a broken pipe
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
    """Print warnings for users in one line. Ignore other warnings."""
    del filename, lineno, file, line
    if issubclass(category, FutureWarning):
        from fcu_emulator.emulator.cli.screen import say

        say(f"warning: {message}", "warning")


def _address_space() -> float:
    """Return the limit of the address space in bytes."""
    limit = math.inf
    if sys.platform != "win32":
        import resource

        soft, _ = resource.getrlimit(resource.RLIMIT_AS)
        limit = limit if soft == resource.RLIM_INFINITY else soft
    return limit


def _prints(arguments: Sequence[str]) -> bool:
    """Return whether a command needs standard output. ``run`` may write elsewhere."""
    return arguments[:1] != ["run"] or not {"-h", "--help"}.isdisjoint(arguments)


def _was_printing(error: OSError) -> bool:
    frames = traceback.walk_tb(error.__traceback__)
    return any(frame.f_globals.get("__name__") == "click.utils" for frame, _ in frames)


def _report_bug() -> None:
    with suppress(OSError):
        traceback.print_exc()
    _complain("this is a bug in fcu-emulator; please report the lines above")


def _complain(line: str) -> None:
    if sys.stderr is None:
        return
    from fcu_emulator.emulator.text import visible

    with suppress(OSError, ValueError):  # stderr may be full or closed
        sys.stderr.write(f"fcu: {visible(line)}\n")


def _is_broken_pipe(error: BaseException) -> bool:
    from fcu_emulator.emulator.links.writer import is_broken_pipe

    return is_broken_pipe(error)


def _lost(stream: TextIO) -> Exception | None:
    """Flush the stream and return the error, if any.

    After an error, redirect the stream to a null device, because Python flushes it again at exit.
    """
    try:
        stream.flush()
    except (OSError, ValueError) as error:
        with suppress(OSError, ValueError):
            null = os.open(os.devnull, os.O_WRONLY)
            os.dup2(null, stream.fileno())
            os.close(null)
        return error
    return None
