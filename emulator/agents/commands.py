"""Commands of ``fcu`` in child processes, with bounded output and time.

Decision: the tools build, check and run start the commands that a user types, each in a process. So a tool returns the
same verdict as the command line, a crash does not end the server, and a command that takes too long can be ended.
"""

from __future__ import annotations

import os
import subprocess
import sys
import threading
import time
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from typing import IO, Final

from fcu_emulator.emulator.errors import InputError, NotJudgedError
from fcu_emulator.emulator.host.cleanup import before_exit, done
from fcu_emulator.emulator.host.process_group import kill_group, terminate_group

_LARGEST_OUTPUT: Final = 1 << 20  # bytes that are kept of each stream
_USAGE_ERROR: Final = 2
_ASK_AGAIN_S: Final = 0.05
_END_S: Final = 5.0  # time for an orderly end
_START: Final = (
    "import runpy, sys; sys.path[:] = {path!r}; runpy.run_module('fcu_emulator', run_name='__main__')"
)
_PREFIX, _USAGE, _ERROR = "fcu: ", "Usage: ", "Error: "
"""Beginnings of a message of fcu, and of the first and the last line of a usage error of click."""


class TimeLimit:
    """Limit of a call's wall time, counted from now or from the latest ``begin``. ``cancel`` ends the call early."""

    def __init__(self, wall_s: float) -> None:
        self.wall_s = wall_s
        self._cancelled = threading.Event()
        self.begin()

    def begin(self) -> None:
        """Restart the time, so that waiting for other calls does not count."""
        self._end_s = time.monotonic() + self.wall_s

    def cancel(self) -> None:
        """End the call soon. Any thread may call this."""
        self._cancelled.set()

    @property
    def over(self) -> bool:
        return self._cancelled.is_set() or time.monotonic() >= self._end_s


@dataclass(frozen=True)
class Finished:
    """A command that has ended. ``output`` and ``errors``: its streams; ``lost``: bytes of output not kept."""

    code: int
    output: str
    errors: str
    lost: int

    def raise_usage_error(self) -> None:
        """Raise InputError, with one line, if the command could not use its arguments."""
        lines = self.errors.strip().splitlines()
        if self.code == _USAGE_ERROR and lines and (len(lines) == 1 or lines[0].startswith(_USAGE)):
            raise InputError(lines[-1].removeprefix(_PREFIX).removeprefix(_ERROR))


def run_fcu(arguments: Sequence[str], limit: TimeLimit) -> Finished:
    """Run ``fcu`` with these arguments until it ends. Raises NotJudgedError if it takes too long."""
    command = [sys.executable, "-P", "-c", _START.format(path=sys.path), *arguments]
    try:
        process = subprocess.Popen(
            command,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            start_new_session=sys.platform != "win32",
        )
    except (OSError, ValueError) as error:
        raise InputError(
            f"cannot run fcu {arguments[0]}: {getattr(error, 'strerror', '') or error}"
        ) from error
    kill = partial(_kill, process)
    before_exit(kill)
    assert process.stdout is not None
    assert process.stderr is not None
    output, errors = _Drain(process.stdout), _Drain(process.stderr)
    try:
        while process.poll() is None:
            if limit.over:
                _end(process)
                raise NotJudgedError(f"fcu {arguments[0]} did not end within {limit.wall_s:g} s of wall time")
            output.wait(_ASK_AGAIN_S)
    finally:
        kill()
        done(kill)
        output.close()
        errors.close()
    return Finished(process.returncode, output.text, errors.text, output.lost)


class _Drain:
    """Reads a stream to its end, and keeps its first bytes."""

    def __init__(self, stream: IO[bytes]) -> None:
        self._stream = stream
        self._kept = bytearray()
        self.lost = 0
        self._thread = threading.Thread(target=self._read, daemon=True)
        self._thread.start()

    @property
    def text(self) -> str:
        return self._kept.decode("utf-8", "replace")

    def wait(self, seconds: float) -> None:
        """Wait for the end of the stream, at most for this time."""
        if self._thread.is_alive():
            self._thread.join(seconds)
        else:
            time.sleep(_ASK_AGAIN_S / 5)

    def close(self) -> None:
        """Read the rest. A grandchild may still have the stream open, so the wait is limited."""
        self._thread.join(_END_S)

    def _read(self) -> None:
        with self._stream:
            while data := os.read(self._stream.fileno(), 1 << 16):
                room = _LARGEST_OUTPUT - len(self._kept)
                self._kept += data[:room]
                self.lost += len(data[room:])


def _end(process: subprocess.Popen[bytes]) -> None:
    """Ask the command and its children to end, so that it removes its temporary files."""
    terminate_group(process)
    if sys.platform != "win32":
        with suppress(subprocess.TimeoutExpired):
            process.wait(_END_S)


def _kill(process: subprocess.Popen[bytes]) -> None:
    """End the command and its children immediately, unless the command has ended."""
    if process.poll() is None:
        kill_group(process)
        process.wait()
