"""One judgement as a task: what travels to a worker process or a cluster, and what comes back."""

from __future__ import annotations

import functools
import gc
import hashlib
import tempfile
from dataclasses import dataclass, field
from importlib.metadata import version
from pathlib import Path
from tempfile import TemporaryDirectory

from fcu_emulator.emulator.errors import FirmwareFileError, InputError, NotJudgedError
from fcu_emulator.emulator.grading.rubric import Rubric, load_rubric
from fcu_emulator.emulator.grading.submissions import RejectedError
from fcu_emulator.emulator.host.isolation import WorkerLimits

_ROOT = Path(__file__).parents[2]
_DECIDING = ("emulator", "sensors", "firmware_model", "scenarios")
_CODE = {".py", ".toml", ".csv", ".so", ".dylib", ".dll"}
_SHOWING = ("emulator/cli", "emulator/links", "emulator/testing", "emulator/grading/reports")
"""Folders of the emulator whose code cannot change a verdict."""


@dataclass(frozen=True)
class Task:
    """A program and what it is judged by.

    ``rubric``: a shipped one's name, or a path that the worker has, too. ``code``: :func:`code_digest` of who
    sends it, so that no worker with another version answers.
    """

    firmware: bytes = field(repr=False)
    name: str
    rubric: str
    rubric_digest: str
    seed: int
    code: str
    build_log: str | None = None
    limits: WorkerLimits | None = None


def judge_task(task: Task) -> str:
    """The verdict, as JSON. Raises RejectedError for what is no firmware for this board, NotJudgedError."""
    if task.limits is not None:
        task.limits.apply()
    if task.code != code_digest():
        problem = "the worker has another version of fcu-emulator; install the same everywhere"
        raise NotJudgedError(problem, kind="version_differs")
    rubric = _rubric(task.rubric, task.rubric_digest)
    from fcu_emulator.emulator.grading.judge import judge

    try:
        with TemporaryDirectory(prefix="fcu-", ignore_cleanup_errors=True) as folder:
            path = Path(folder) / _file_name(task.name)
            path.write_bytes(task.firmware)
            try:
                return judge(path, rubric, seed=task.seed, build_log=task.build_log).to_json()
            except FirmwareFileError as error:
                if isinstance(error.__cause__, OSError):  # the file is our own and can be read
                    raise error.__cause__ from None
                raise RejectedError(str(error).replace(f"{path}", path.name)) from None
            except InputError as error:  # of this machine, such as a C library that is missing
                raise NotJudgedError(str(error), kind=error.kind) from error
    except OSError as error:
        raise NotJudgedError(f"this machine has run out of something: {error}") from error
    finally:
        gc.collect()  # boards refer to themselves; left to the collector's own time, their memory doubles


def use_temporary_folder(folder: str) -> None:
    """Let this process make its temporary files in ``folder``, which its parent removes."""
    tempfile.tempdir = folder


@functools.cache
def code_digest() -> str:
    """The version, and a digest of all that can change a verdict: code, scenarios, the chip's library."""
    digest = hashlib.sha256()
    for package in _DECIDING:
        for path in sorted((_ROOT / package).rglob("*")):
            name = path.relative_to(_ROOT).as_posix()
            if path.suffix in _CODE and not name.startswith(_SHOWING):
                digest.update(f"{name}\0".encode())
                digest.update(path.read_bytes())
    return f"{version('fcu-emulator')}+{digest.hexdigest()[:16]}"


@functools.lru_cache(maxsize=4)
def _rubric(name: str, digest: str) -> Rubric:
    rubric = load_rubric(name)
    if rubric.digest != digest:
        problem = f"the worker has another rubric {name}; give all workers the same file"
        raise NotJudgedError(problem, kind="rubric_differs")
    return rubric


def _file_name(name: str) -> str:
    """A name that is a file's on every system; what a message shows is close to what was handed in."""
    plain = "".join(sign if sign.isalnum() or sign in "._-" else "_" for sign in name)[-60:].lstrip(".-")
    return plain or "firmware"
