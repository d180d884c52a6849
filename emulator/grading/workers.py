"""Workers that judge programs: local processes or a Dask cluster, behind one interface.

Decision: each job has one process and one pipe. If a submission exhausts the memory, only its
process ends, and the task is tried again. ``ProcessPoolExecutor`` was rejected: it breaks when one
process dies. Processes are started by "spawn", because the parent has threads.
"""

from __future__ import annotations

import multiprocessing
import queue
import signal
import threading
from collections.abc import Callable
from concurrent.futures import Executor, Future
from dataclasses import dataclass
from multiprocessing.connection import Connection
from typing import Any, Final

from fcu_emulator.emulator.errors import InputError, NotJudgedError
from fcu_emulator.emulator.text import one_line

_ATTEMPTS: Final = 2
_END_S: Final = 5.0  # maximum time for a process to end by itself


@dataclass(frozen=True)
class _Task:
    future: Future[Any]
    function: Callable[..., Any]
    arguments: tuple[Any, ...]


class LocalWorkers(Executor):
    """Executor with ``jobs`` processes on this machine.

    ``initializer``: called in each process. ``longest_s``: maximum wall time of one task.
    """

    def __init__(
        self, jobs: int, initializer: Callable[[], None] | None = None, longest_s: float = 1800.0
    ) -> None:
        if jobs < 1:
            raise InputError(f"jobs must be at least 1, not {jobs}")
        self._tasks: queue.SimpleQueue[_Task | None] = queue.SimpleQueue()
        self._initializer = initializer
        self._longest_s = longest_s
        self._workers: set[_Worker] = set()
        self._lock = threading.Lock()
        self._closed = self._cancelled = False
        self._threads = [threading.Thread(target=self._serve, daemon=True) for _ in range(jobs)]
        for thread in self._threads:
            thread.start()

    @property
    def slots(self) -> int:
        """Number of parallel tasks."""
        return len(self._threads)

    @property
    def pids(self) -> list[int]:
        with self._lock:
            return [worker.pid for worker in self._workers]

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        """Submit a task. The function and its arguments are pickled."""
        if kwargs:
            raise TypeError("arguments must be given by position")
        if self._closed:
            raise RuntimeError("cannot start a task: the workers have been shut down")
        future: Future[Any] = Future()
        self._tasks.put(_Task(future, fn, args))
        return future

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """End the processes after all tasks, or immediately with ``cancel_futures``."""
        self._closed = True
        if cancel_futures:
            while True:
                try:
                    task = self._tasks.get_nowait()
                except queue.Empty:
                    break
                if task is not None:
                    task.future.cancel()
            with self._lock:
                self._cancelled = True
                for worker in self._workers:
                    worker.kill()
        for _ in self._threads:
            self._tasks.put(None)
        if wait:
            for thread in self._threads:
                thread.join()

    def _serve(self) -> None:
        worker: _Worker | None = None
        while (task := self._tasks.get()) is not None:
            if not task.future.set_running_or_notify_cancel():
                continue
            try:
                worker = self._do(task, worker)
            except Exception as error:  # otherwise the caller would wait forever
                task.future.set_exception(error)
                worker = None
        if worker is not None:
            worker.close()
            self._end(worker)

    def _do(self, task: _Task, worker: _Worker | None) -> _Worker | None:
        kind = problem = ""
        for _ in range(_ATTEMPTS):
            try:
                worker = worker or self._new_worker()
            except Exception as error:  # no process or pipe
                reason = one_line(getattr(error, "strerror", None) or str(error))
                kind, problem = "no_worker", f"cannot start a worker process on this machine: {reason}"
                continue
            try:
                done, value = worker.call(task.function, task.arguments, self._longest_s)
            except _DiedError as error:
                kind, problem = "worker_died", str(error)
                self._end(worker)
                worker = None
                if self._closed or error.out_of_time:
                    break
            except TimeoutError:  # a second try would take as long
                kind, problem = "wall_time", f"took more than {self._longest_s:g} s of wall time"
                self._end(worker)
                break
            except Exception as error:  # arguments cannot be pickled
                task.future.set_exception(error)
                return worker
            else:
                if done:
                    task.future.set_result(value)
                    return worker
                task.future.set_exception(value)
                if not isinstance(value, MemoryError):
                    return worker
                self._end(worker)
                return None
        task.future.set_exception(NotJudgedError(problem, kind=kind))
        return None

    def _new_worker(self) -> _Worker:
        worker = _Worker(self._initializer)
        with self._lock:
            self._workers.add(worker)
            if self._cancelled:  # shutdown() was called meanwhile
                worker.kill()
        return worker

    def _end(self, worker: _Worker) -> None:
        worker.kill()
        with self._lock:
            self._workers.discard(worker)


class _DiedError(Exception):
    """The process died. ``out_of_time``: whether the cause was its limit of processor time."""

    def __init__(self, cause: str) -> None:
        self.out_of_time = cause == "SIGXCPU"
        super().__init__(f"the worker process died ({cause})")


class _Worker:
    def __init__(self, initializer: Callable[[], None] | None) -> None:
        context = multiprocessing.get_context("spawn")
        self._pipe, theirs = context.Pipe()
        self._process = context.Process(target=_work, args=(theirs, initializer), daemon=True)
        self._process.start()
        theirs.close()

    @property
    def pid(self) -> int:
        assert self._process.pid is not None
        return self._process.pid

    def call(
        self, function: Callable[..., Any], arguments: tuple[Any, ...], longest_s: float
    ) -> tuple[bool, Any]:
        try:
            self._pipe.send((function, arguments))
            if not self._pipe.poll(longest_s):
                raise TimeoutError
            answer: tuple[bool, Any] = self._pipe.recv()
        except (EOFError, OSError) as error:
            if isinstance(error, TimeoutError):
                raise
            self._process.join(_END_S)
            raise _DiedError(_cause(self._process.exitcode)) from error
        return answer

    def close(self) -> None:
        self._pipe.close()
        self._process.join(_END_S)

    def kill(self) -> None:
        if self._process.is_alive():
            self._process.kill()
            self._process.join(_END_S)


def _work(pipe: Connection, initializer: Callable[[], None] | None) -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the parent handles Ctrl-C
    if initializer is not None:
        initializer()
    while True:
        try:
            function, arguments = pipe.recv()
        except (EOFError, OSError):
            return
        try:
            answer = (True, function(*arguments))
        except Exception as error:
            answer = (False, error)
        try:
            pipe.send(answer)
        except OSError:
            return
        except Exception as error:  # the answer cannot be pickled
            pipe.send((False, NotJudgedError(f"{type(error).__name__}: {error}")))


def _cause(code: int | None) -> str:
    if code is not None and code < 0:
        try:
            return signal.Signals(-code).name
        except ValueError:
            return f"signal {-code}"
    return f"exit code {code}"


# -- a cluster ----------------------------------------------------------------------------------------------


class DaskWorkers(Executor):
    """Workers of a Dask cluster at ``address`` ("tcp://host:8786"). Raises InputError."""

    def __init__(self, address: str, answer_s: float = 15.0) -> None:
        try:
            from distributed import Client
        except ImportError as error:
            raise InputError('--dask needs Dask; install it: pip install "fcu-emulator[cluster]"') from error
        try:
            self._client = Client(address, timeout=answer_s, set_as_default=False)
        except (OSError, ValueError, TimeoutError) as error:
            problem = f"no Dask scheduler answers ({type(error).__name__}); start one: dask scheduler"
            raise InputError(f"--dask {address}: {problem}", kind="no_answer") from error
        self._executor = self._client.get_executor(pure=False)

    @property
    def slots(self) -> int:
        """Number of parallel tasks of the current workers."""
        threads: dict[str, int] = self._client.nthreads()
        return max(1, sum(threads.values()))

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        future: Future[Any] = self._executor.submit(fn, *args, **kwargs)
        return future

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """Disconnect from the cluster, which continues to run."""
        self._executor.shutdown(wait=wait and not cancel_futures)
        self._client.close()
