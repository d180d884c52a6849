"""One judgement as a task for a worker process or a cluster."""

from __future__ import annotations

import functools
import gc
import hashlib
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass, field
from importlib.metadata import version
from pathlib import Path
from tempfile import TemporaryDirectory

from fcu_emulator.emulator.errors import FirmwareFileError, InputError, NotJudgedError
from fcu_emulator.emulator.grading.rubric import Rubric, load_rubric
from fcu_emulator.emulator.grading.submissions import RejectedError, SubmittedSource
from fcu_emulator.emulator.host.isolation import WorkerLimits

_ROOT = Path(__file__).parents[2]
_DECIDING = ("emulator", "sensors", "firmware_model", "scenarios")
_CODE = {".py", ".toml", ".csv", ".so", ".dylib", ".dll"}
_SHOWING = ("emulator/cli", "emulator/links", "emulator/testing", "emulator/grading/reports")
"""Folders whose code cannot change a verdict."""


@dataclass(frozen=True)
class Task:
    """A program and the data for judging it.

    ``rubric``: a name, or a path on the worker. ``code``: :func:`code_digest`, which must be the
    same on the worker.
    """

    firmware: bytes = field(repr=False)
    name: str
    rubric: str
    rubric_digest: str
    seed: int
    code: str
    build_log: str | None = None
    limits: WorkerLimits | None = None
    sources: Mapping[str, bytes] = field(default_factory=dict, repr=False)
    """Source files by name. Explanations quote them."""

    @property
    def sources_digest(self) -> str:
        return SubmittedSource(self.sources).digest if self.sources else ""


def judge_task(task: Task) -> str:
    """Return the verdict as JSON. Raises RejectedError, NotJudgedError."""
    if task.limits is not None:
        task.limits.apply()
    if task.code != code_digest():
        problem = "the worker has another version of fcu-emulator; install the same version everywhere"
        raise NotJudgedError(problem, kind="version_differs")
    rubric = _rubric(task.rubric, task.rubric_digest)
    from fcu_emulator.emulator.grading.judge import judge

    try:
        with TemporaryDirectory(prefix="fcu-", ignore_cleanup_errors=True) as folder:
            for name, data in task.sources.items():
                (Path(folder) / _file_name(name)).write_bytes(data)
            path = Path(folder) / _file_name(task.name)
            path.write_bytes(task.firmware)
            try:
                return judge(path, rubric, seed=task.seed, build_log=task.build_log).to_json()
            except FirmwareFileError as error:
                if isinstance(error.__cause__, OSError):  # this machine cannot read the temporary file
                    raise error.__cause__ from None
                raise RejectedError(str(error).replace(f"{path}", path.name)) from None
            except InputError as error:  # caused by this machine, such as a missing C library
                raise NotJudgedError(str(error), kind=error.kind) from error
    except OSError as error:
        raise NotJudgedError(f"this machine has run out of a resource: {error}") from error
    finally:
        gc.collect()  # boards have reference cycles, which would double the memory use


def use_temporary_folder(folder: str) -> None:
    """Set the folder for temporary files of this process."""
    tempfile.tempdir = folder


@functools.cache
def code_digest() -> str:
    """Return a digest of the version and all files that can change a verdict."""
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
    """Return a valid file name that is similar to the submitted name."""
    plain = "".join(sign if sign.isalnum() or sign in "._-" else "_" for sign in name)[-60:].lstrip(".-")
    return plain or "firmware"
