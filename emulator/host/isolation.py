"""A worker process for untrusted firmware.

The exit code is not a verdict if the worker was killed, crashed, or exceeded memory or time.

Decision: the worker process adds a constant to its exit code. Without this constant, the exit code
1 of a library that runs out of memory would mean "wrong".

Decision: the worker process stays in the process group of its parent, so that Ctrl-C reaches both
processes and typed text reaches the board. A pipe ends the worker if the parent is killed.

Decision: the worker process sets its own limits before it loads other modules. The parent cannot
set them between fork and exec, because functions that run there are unsafe with threads.
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

# -- The limits of a process --------------------------------------------------------------------------------

_LEAST_MEMORY = 256 << 20
_MOST = 1 << 60
"""Largest limit. Systems store signed 64-bit numbers, and the used processor time is added to the limit."""
_ON_MACOS = ("memory_bytes",)
"""Limits without effect: macOS ignores the limit of the address space."""


@dataclass(frozen=True)
class WorkerLimits:
    """Limits of a process. Raises InputError for impossible limits."""

    memory_bytes: int = 1 << 30
    """Size of the address space. Python, numpy and a board need a third of the default."""
    cpu_s: int = 3600
    """Processor time after the call of :meth:`apply`."""
    file_bytes: int = 4 << 30
    """Size of each written file. The default is the maximum size of a trace."""
    open_files: int = 128
    """Number of files open at the same time, including pipes and sockets."""

    def __post_init__(self) -> None:
        for field in fields(self):
            value = getattr(self, field.name)
            if not value > 0:
                raise InputError(f"limit {field.name} must be above 0, not {value!r}")
            if value > _MOST:
                raise InputError(f"limit {field.name} must be at most {_MOST}, not {shown(value)}")
        if self.memory_bytes < _LEAST_MEMORY:
            problem = f"must be at least {_LEAST_MEMORY} for Python and numpy, not {self.memory_bytes}"
            raise InputError(f"limit memory_bytes {problem}")

    def apply(self) -> tuple[str, ...]:
        """Apply the limits, and return the limits that the system does not enforce.

        Lower existing limits remain. Processor time is counted from the latest call. Call this
        method before large imports.
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
    """Return the limits that the system does not enforce."""
    if platform.system() == "Windows":
        return tuple(field.name for field in fields(WorkerLimits))
    return _ON_MACOS if platform.system() == "Darwin" else ()


def parse_limits(settings: Sequence[str]) -> tuple[WorkerLimits | None, tuple[str, ...]]:
    """Return limits (or None) from settings ``name=number``, and the other settings.

    Raises InputError.
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
            problem = f"must be a whole number, such as {name}={getattr(WorkerLimits, name)}"
            raise InputError(f"limit {setting}: {problem}") from None
    return WorkerLimits(**chosen) if chosen else None, tuple(others)


if sys.platform != "win32":

    def _lower(kind: int, value: int, *, again: bool = False) -> None:
        import resource

        _, hard = resource.getrlimit(kind)
        bound = value if hard == resource.RLIM_INFINITY else min(value, hard)
        resource.setrlimit(kind, (bound, hard if again else bound))


# -- The parent ---------------------------------------------------------------------------------------------

_ENDED = 100
"""Number added to the exit code of a worker that has ended normally."""
_REQUESTS = ("SIGINT", "SIGTERM", "SIGHUP", "SIGBREAK")
_CAUSES = {
    "SIGKILL": "it was killed, usually by the system because of its memory use",
    "SIGTERM": "it was terminated (SIGTERM)",
}


@dataclass(frozen=True)
class WorkerExit:
    """A worker's result. ``code`` is None after an abnormal end by ``cause``."""

    code: int | None
    cause: str
    interrupted: bool
    """Whether the user or the system has requested the end."""


def run_isolated(module: str, arguments: Sequence[str], limits: WorkerLimits) -> WorkerExit:
    """Run ``module`` in a worker process as ``python -m`` does, with the streams of this process.

    Call it in the main thread. Raises OSError if no process can be started.
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
            if asked and sys.platform != "win32":  # the signal arrived before the worker was started
                process.terminate()
            process.wait()
    finally:
        for end in (read, write):
            if end is not None:
                os.close(end)
    return _ending(process.returncode, limits, bool(asked))


def _ending(status: int, limits: WorkerLimits, interrupted: bool) -> WorkerExit:
    code = status - _ENDED
    if 0 <= code <= 155 and status != 120:  # 120: Python could not write its output
        return WorkerExit(code, "", interrupted)
    return WorkerExit(None, _cause(status, limits), interrupted)


def _cause(status: int, limits: WorkerLimits) -> str:
    if status >= 0:
        return f"it exited with the unexpected status {status}, usually because memory or open files ran out"
    name = signal.Signals(-status).name if -status in set(signal.Signals) else f"signal {-status}"
    if name == "SIGXCPU":
        return f"it used more than {limits.cpu_s} s of processor time; raise --limit cpu_s=NUMBER"
    return _CAUSES.get(name, f"it crashed ({name})")


def _lifeline() -> tuple[int | None, int | None]:
    """Create the pipe that ends the worker, with file descriptors above the standard streams."""
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
    """Forward termination signals to the process in the yielded list. A second signal kills it.

    On Windows the worker receives Ctrl-C directly.
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
    """Return this worker's limits, or None outside of a worker."""
    return _working_under[0] if _working_under else None


def work() -> None:
    """Run the worker for :func:`run_isolated`."""
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
        os.read(lifeline, 1)  # no data is ever written
    os._exit(_ENDED - 1)  # the parent has ended and would not read a summary
