"""``--isolate``: run the same command in a worker process."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import fields

import click

from fcu_emulator.emulator.cli.exit_codes import ExitCode
from fcu_emulator.emulator.errors import InputError, NotJudgedError
from fcu_emulator.emulator.host.isolation import (
    WorkerLimits,
    limits_of_worker,
    not_limited,
    parse_limits,
    run_isolated,
)
from fcu_emulator.emulator.text import choices


def limits_of_run(settings: Sequence[str], isolate: bool) -> tuple[WorkerLimits | None, tuple[str, ...]]:
    """Return the limits of the worker, or None without a worker, and the settings of the board.

    Raises InputError for a process limit without ``--isolate``.
    """
    limits, others = parse_limits(settings)
    if limits is not None and not isolate:
        named = next(setting for setting in settings if setting not in others)
        raise InputError(f"--limit {named} must be used with --isolate, because it limits a process")
    start_worker = isolate and limits_of_worker() is None
    return (limits or WorkerLimits()) if start_worker else None, others


def limits_of_process(settings: Sequence[str], isolate: bool) -> WorkerLimits | None:
    """Return the limits of the worker. Raises InputError for a limit of the board."""
    limits, others = limits_of_run(settings, isolate)
    if others:
        known = choices(field.name for field in fields(WorkerLimits))
        raise InputError(f"--limit must be {known} for this command, not {others[0]}")
    return limits


def in_worker(limits: WorkerLimits) -> ExitCode:
    """Run this command again in a worker. Raises NotJudgedError if the worker dies."""
    arguments: Sequence[str] = click.get_current_context().obj
    ending = run_isolated("fcu_emulator", arguments, limits)
    if ending.code in set(ExitCode):
        return ExitCode(ending.code)
    if ending.interrupted:
        return ExitCode.INTERRUPTED
    cause = ending.cause or f"it exited with the unexpected status {ending.code}"
    raise NotJudgedError(f"the worker process died: {cause}; the firmware was not judged")


def announcement() -> Iterator[str]:
    """Yield lines about this worker's limits, if any."""
    limits = limits_of_worker()
    if limits is None:
        return
    shown = {
        "memory_bytes": f"{limits.memory_bytes / 2**20:.0f} MiB of memory",
        "cpu_s": f"{limits.cpu_s} s of processor time",
        "file_bytes": f"{limits.file_bytes / 2**20:.0f} MiB in a file",
        "open_files": f"{limits.open_files} open files",
    }
    missing = not_limited()
    kept = [text for name, text in shown.items() if name not in missing]
    yield f"isolated in a worker process{', at most ' if kept else ''}{', '.join(kept)}"
    if missing:
        yield f"not limited on this system: {', '.join(missing)}"
