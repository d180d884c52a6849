"""The command line, ``fcu``: starts it, and turns whatever goes wrong into one line and an exit code.

Everything heavy is imported inside, so that ``fcu --help`` answers at once, and so that a machine without
memory for it is reported like everything else (:mod:`fcu_emulator.emulator.cli.exit_codes`).
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
"""The variable by which a shell asks for completions; click makes its name from the program's."""
_LEAST_ADDRESS_SPACE = 256 << 20
"""Bytes below which numpy's linear algebra ends the process at once, with an exit code of its own, 1."""
_NOT_JUDGED, _INTERRUPTED, _READER_GONE = 4, 130, 141
"""As in emulator.cli.exit_codes, which may itself be what cannot be imported."""


def main() -> None:
    """Run the command line and exit with its code."""
    _start_quickly()
    _write_what_can_be_written()
    sys.unraisablehook = ask_again
    end_in_order()
    try:
        code = int(execute(sys.argv[1:]))
    except Terminated:  # while another end was being reported
        code = _INTERRUPTED
    end_at_once()
    for stream in (sys.stdout, sys.stderr):
        lost = None if stream is None else _lost(stream)
        if lost is not None and stream is sys.stdout and code in (0, 1):
            code = _READER_GONE if _is_broken_pipe(lost) else _NOT_JUDGED
    sys.exit(code)


def _start_quickly() -> None:
    """Two habits of the libraries that would be a sixth of each command's start, and help none of ours."""
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # numpy's threads: matrices here are 3 x 3
    gc.set_threshold(20_000)  # new objects before the next search for garbage; modules, when loaded, stay


def _write_what_can_be_written() -> None:
    """A character that the system's encoding does not have becomes a question mark, and no error.

    On Windows, what goes into a file or a pipe is in the old encoding of the country, which has no Greek, and
    a degree sign at another place. The road not taken, UTF-8 whatever the system says, is what its own
    programs could not read.
    """
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, TextIOWrapper) and stream.errors == "strict":
            stream.reconfigure(errors="replace")


def execute(arguments: Sequence[str]) -> ExitCode | int:
    """Run the command line; its exit code."""
    try:
        if _address_space() < _LEAST_ADDRESS_SPACE:
            raise MemoryError
        return _execute(arguments)
    except (KeyboardInterrupt, Terminated) as error:
        return _interrupted(error)
    except MemoryError:
        _complain(
            "there is not enough memory for this; close other programs, or raise the limit (ulimit -v,"
            " or with --isolate --limit memory_bytes=NUMBER)"
        )
    except OSError as error:
        if _was_printing(error) and _is_broken_pipe(error):
            return _READER_GONE
        if _was_printing(error):
            _complain(f"standard output: {error.strerror or error}; what was printed is not complete")
        elif error.errno in _OUT_OF_RESOURCES:
            _complain(f"this machine has run out of something: {error}")
        else:
            _report_bug()
    except Exception as error:
        request = _request_inside(error)
        if request is not None:
            return _interrupted(request)
        _report_bug()
    return _NOT_JUDGED


def _interrupted(request: BaseException) -> int:
    """Say by which signal the command was ended, if not by Ctrl-C; the exit code."""
    if isinstance(request, Terminated):
        _complain(f"ended by {request}")
    return _INTERRUPTED


def _request_inside(error: BaseException) -> BaseException | None:
    """Return the request to end that ``error`` was raised from, if there is one.

    Until version 3.11 Python raises RuntimeError for a request that comes in ``__set_name__``.
    """
    found: BaseException | None = error
    while found is not None and not isinstance(found, KeyboardInterrupt | Terminated):
        found = found.__cause__ or found.__context__
    return found


def _execute(arguments: Sequence[str]) -> ExitCode | int:
    import click

    from fcu_emulator.emulator.cli.commands import cli
    from fcu_emulator.emulator.cli.exit_codes import ExitCode, code_of
    from fcu_emulator.emulator.errors import FcuError, OutputError

    warnings.showwarning = _show_warning
    try:
        if sys.stdout is None and _prints(arguments):
            raise OutputError(f"standard output is closed; give it somewhere to go, such as > {os.devnull}")
        try:
            code = cli.main(list(arguments), prog_name="fcu", standalone_mode=False, obj=arguments)
        except SystemExit as error:
            if _COMPLETION in os.environ:  # a shell asks for completions, which click answers, and exits
                return int(error.code or 0)
            return ExitCode.READER_GONE  # click's own answer to a broken pipe: 1, without a word
        return code if isinstance(code, int) else ExitCode.PASSED
    except click.ClickException as error:
        with suppress(OSError):
            error.show()
        return ExitCode.USAGE_ERROR
    except click.Abort:
        return ExitCode.INTERRUPTED
    except FcuError as error:
        for line in str(error).splitlines():  # most have one; a diagnosis has more
            _complain(line)
        return code_of(error)


def _show_warning(
    message: Warning | str,
    category: type[Warning],
    filename: str,
    lineno: int,
    file: TextIO | None = None,
    line: str | None = None,
) -> None:
    """Print a warning for users, such as a key's old name, in one line; others are for programmers."""
    del filename, lineno, file, line
    if issubclass(category, FutureWarning):
        _complain(f"warning: {message}")


def _address_space() -> float:
    """How many bytes this process may use, as far as the system limits and tells it."""
    limit = math.inf
    if sys.platform != "win32":
        import resource

        soft, _ = resource.getrlimit(resource.RLIMIT_AS)
        limit = limit if soft == resource.RLIM_INFINITY else soft
    return limit


def _prints(arguments: Sequence[str]) -> bool:
    """Whether a command needs standard output; ``run`` says itself where its text goes."""
    return arguments[:1] != ["run"] or not {"-h", "--help"}.isdisjoint(arguments)


def _was_printing(error: OSError) -> bool:
    """Whether ``error`` came from writing to standard output; what we write to stderr may fail unseen."""
    frames = traceback.walk_tb(error.__traceback__)
    return any(frame.f_globals.get("__name__") == "click.utils" for frame, _ in frames)


def _report_bug() -> None:
    with suppress(OSError):
        traceback.print_exc()
    _complain("the lines above are a bug in fcu-emulator; please report them")


def _complain(line: str) -> None:
    if sys.stderr is None:  # closed before we were started
        return
    from fcu_emulator.emulator.text import visible

    with suppress(OSError, ValueError):  # stderr may be full or gone
        sys.stderr.write(f"fcu: {visible(line)}\n")


def _is_broken_pipe(error: BaseException) -> bool:
    """Whether the reader of standard output has closed it, which is no fault."""
    from fcu_emulator.emulator.links.writer import is_broken_pipe

    return is_broken_pipe(error)


def _lost(stream: TextIO) -> Exception | None:
    """Write out what is left; if that fails, let the interpreter not try it again at its end, and say why."""
    try:
        stream.flush()
    except (OSError, ValueError) as error:
        with suppress(OSError, ValueError):
            null = os.open(os.devnull, os.O_WRONLY)
            os.dup2(null, stream.fileno())
            os.close(null)
        return error
    return None
