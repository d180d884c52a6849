"""A process of its own for firmware of strangers: what it may take of the machine, and how it ended.

``run_isolated("fcu_emulator", arguments)`` runs a module as a program in a worker process, under the limits of
:class:`WorkerLimits`, with the streams of this process. It tells apart a worker that has ended by itself, with its
exit code, and one that died: killed, crashed, out of memory or of processor time. That says nothing about the
firmware.

Decision: the worker adds a number of its own to its exit code. Without it, the 1 of a library that ends the
process where memory is short would be the verdict "wrong"; the road not taken, a pipe for the verdict, needs
a handle that is inherited, which is another thing on each system.

Decision: the worker stays in the process group of its parent, so that Ctrl-C reaches both and typing in the
terminal reaches the board. A request to end that only the parent gets is passed on as SIGTERM, of which fcu
in a worker heeds one: it may have had the same request itself, and is not to take it for a second.
A parent that is killed cannot pass anything on, so the worker waits on a pipe whose other end it has.

Decision: the limits are the worker's own, set before it loads anything. The road not taken, a function called
between fork and exec, is unsafe in programs with threads and unknown on Windows.
"""

from __future__ import annotations

import json
import math
import os
import platform
import runpy
import signal
import subprocess
import sys
import threading
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass, fields
from types import FrameType

from fcu_emulator.emulator.errors import InputError
from fcu_emulator.emulator.text import shown

# -- What a process may take --------------------------------------------------------------------------------

_LEAST_MEMORY = 256 << 20
_MOST = 1 << 60
"""The system keeps a limit in 64 bits, with a sign; processor time is added to the time used before."""
_ON_MACOS = ("memory_bytes",)
"""There the address space has a limit that can be set and is not kept."""


@dataclass(frozen=True)
class WorkerLimits:
    """What a process may take of its machine. Raises InputError for a limit that nothing can run with."""

    memory_bytes: int = 1 << 30
    """Of address space; Python, numpy and a board take about a third of the usual one."""
    cpu_s: int = 3600
    """Processor time from :meth:`apply` on."""
    file_bytes: int = 4 << 30
    """Of each file that is written: as much as a trace may have."""
    open_files: int = 128
    """At a time, pipes and sockets included."""

    def __post_init__(self) -> None:
        for field in fields(self):
            value = getattr(self, field.name)
            if not value > 0:
                raise InputError(f"limit {field.name} is {value!r}; give a number above 0")
            if value > _MOST:
                raise InputError(f"limit {field.name} must be at most {_MOST}, not {shown(value)}")
        if self.memory_bytes < _LEAST_MEMORY:
            problem = f"is {self.memory_bytes}; Python and numpy alone need {_LEAST_MEMORY}"
            raise InputError(f"limit memory_bytes {problem}")

    def apply(self) -> tuple[str, ...]:
        """Put this process, and those it will start, under the limits; what it had less of stays so.

        Returns the names of the limits that this system does not keep. Call it before what takes much is
        loaded. A process that does one task after the other may call it before each: processor time is
        counted from the latest call.
        """
        if sys.platform != "win32":
            import resource

            _lower(resource.RLIMIT_AS, self.memory_bytes)
            _lower(resource.RLIMIT_FSIZE, self.file_bytes)
            _lower(resource.RLIMIT_NOFILE, self.open_files)
            _lower(resource.RLIMIT_CORE, 0)
            used = resource.getrusage(resource.RUSAGE_SELF)
            _lower(resource.RLIMIT_CPU, math.ceil(used.ru_utime + used.ru_stime) + self.cpu_s, again=True)
        return not_limited()


def not_limited() -> tuple[str, ...]:
    """The names of the limits that this system does not keep."""
    if platform.system() == "Windows":
        return tuple(field.name for field in fields(WorkerLimits))
    return _ON_MACOS if platform.system() == "Darwin" else ()


def parse_limits(settings: Sequence[str]) -> tuple[WorkerLimits | None, tuple[str, ...]]:
    """The usual limits with some replaced, and the settings that name none of these.

    Each is ``name=number``. None if none of them was named. Raises InputError.
    """
    known = {field.name for field in fields(WorkerLimits)}
    chosen: dict[str, int] = {}
    others = []
    for setting in settings:
        name, _, number = setting.partition("=")
        if name not in known:
            others.append(setting)
            continue
        try:
            chosen[name] = int(number)
        except ValueError:
            problem = f"give a whole number, such as {name}={getattr(WorkerLimits, name)}"
            raise InputError(f"limit {setting}: {problem}") from None
    return WorkerLimits(**chosen) if chosen else None, tuple(others)


if sys.platform != "win32":

    def _lower(kind: int, value: int, *, again: bool = False) -> None:
        """``again``: leave the hard limit, so that the same can be done with a later value."""
        import resource

        _, hard = resource.getrlimit(kind)
        bound = value if hard == resource.RLIM_INFINITY else min(value, hard)
        resource.setrlimit(kind, (bound, hard if again else bound))


# -- The parent ---------------------------------------------------------------------------------------------

_ENDED = 100
"""What a worker adds to its exit code when it has ended by itself."""
_REQUESTS = ("SIGINT", "SIGTERM", "SIGHUP", "SIGBREAK")
_CAUSES = {
    "SIGKILL": "it was killed, as the system does with one that takes too much memory",
    "SIGTERM": "it was told to end (SIGTERM)",
}


@dataclass(frozen=True)
class WorkerExit:
    """How a worker ended. ``code``: its exit code, None if it died; ``cause``: of what it died, else ""."""

    code: int | None
    cause: str
    interrupted: bool
    """Whether somebody has asked for the end."""


def run_isolated(module: str, arguments: Sequence[str], limits: WorkerLimits) -> WorkerExit:
    """Run ``module`` as ``python -m`` would, in a worker process under ``limits``; return when it has ended.

    The worker has this process's streams. To be called in the main thread. Raises OSError if no process can
    be started.
    """
    read, write = _lifeline()
    start = f"import sys; sys.path[:] = {sys.path!r}; from fcu_emulator.emulator.host.isolation import work; work()"
    own = json.dumps({"limits": asdict(limits), "lifeline": read, "parent": os.getpid()})
    command = [sys.executable, "-P", "-c", start, own, module, *arguments]
    asked: list[int] = []
    try:
        with _passed_on(asked) as to:
            process = subprocess.Popen(command, pass_fds=() if read is None else (read,))
            to.append(process)
            if asked and sys.platform != "win32":  # before there was anybody to pass it on to
                process.terminate()
            process.wait()
    finally:
        for end in (read, write):
            if end is not None:
                os.close(end)
    return _ending(process.returncode, limits, bool(asked))


def _ending(status: int, limits: WorkerLimits, interrupted: bool) -> WorkerExit:
    code = status - _ENDED
    if 0 <= code <= 155 and status != 120:  # Python's own, when it cannot write its output at its end
        return WorkerExit(code, "", interrupted)
    return WorkerExit(None, _cause(status, limits), interrupted)


def _cause(status: int, limits: WorkerLimits) -> str:
    if status >= 0:
        return f"it ended with {status} and no verdict, as happens where memory or open files are too few"
    name = signal.Signals(-status).name if -status in set(signal.Signals) else f"signal {-status}"
    if name == "SIGXCPU":
        return f"it took more than {limits.cpu_s} s of processor time; to allow more: --limit cpu_s=NUMBER"
    return _CAUSES.get(name, f"it crashed ({name})")


def _lifeline() -> tuple[int | None, int | None]:
    """A pipe that the worker waits on; its ends are no standard streams, even where those are closed."""
    read: int | None = None
    write: int | None = None
    if sys.platform != "win32":
        import fcntl

        ends = os.pipe()
        read, write = (fcntl.fcntl(end, fcntl.F_DUPFD_CLOEXEC, 3) for end in ends)
        for end in ends:
            os.close(end)
    return read, write


@contextmanager
def _passed_on(asked: list[int]) -> Iterator[list[subprocess.Popen[bytes]]]:
    """While this lasts, requests to end are noted and go to the process in the list; a second one kills it.

    Windows sends Ctrl-C to the worker itself, and has no gentle way to pass on others. What is ignored stays
    so, as it does in the worker.
    """
    to: list[subprocess.Popen[bytes]] = []

    def request(number: int, frame: FrameType | None) -> None:
        del frame
        asked.append(number)
        if to and sys.platform != "win32":
            to[0].terminate() if len(asked) == 1 else to[0].kill()

    known = [getattr(signal, name) for name in _REQUESTS if hasattr(signal, name)]
    numbers = [number for number in known if signal.getsignal(number) is not signal.SIG_IGN]
    before = {number: signal.signal(number, request) for number in numbers}
    try:
        yield to
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


# -- The worker ---------------------------------------------------------------------------------------------

_working_under: list[WorkerLimits] = []


def limits_of_worker() -> WorkerLimits | None:
    """What this process is limited to if it is a worker of :func:`run_isolated`, else None."""
    return _working_under[0] if _working_under else None


def work() -> None:
    """What a worker does, from its start to its end; its arguments are those of :func:`run_isolated`."""
    own = json.loads(sys.argv[1])
    limits = WorkerLimits(**own["limits"])
    threading.Thread(target=_end_with_parent, args=(own["lifeline"], own["parent"]), daemon=True).start()
    limits.apply()
    _working_under.append(limits)
    module = sys.argv[2]
    sys.argv = [module, *sys.argv[3:]]
    code: object = None
    try:
        runpy.run_module(module, run_name="__main__", alter_sys=True)
    except SystemExit as ended:
        code = ended.code
    sys.exit(_ENDED + (code if isinstance(code, int) else 0 if code is None else 1))


def _end_with_parent(lifeline: int | None, parent: int) -> None:
    if sys.platform == "win32":
        import _winapi

        process = _winapi.OpenProcess(0x0010_0000, False, parent)  # SYNCHRONIZE: to wait for its end
        _winapi.WaitForSingleObject(process, _winapi.INFINITE)
    else:
        assert lifeline is not None
        os.read(lifeline, 1)  # nothing is ever written
    os._exit(_ENDED - 1)  # nobody is left who would read a summary
