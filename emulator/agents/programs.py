"""Results of ``fcu build``, ``fcu check`` and ``fcu run`` as data."""

from __future__ import annotations

import json
import tempfile
from pathlib import Path
from typing import Any, Final

from fcu_emulator.emulator.agents.arguments import Build, Check, Run
from fcu_emulator.emulator.agents.commands import Finished, TimeLimit, run_fcu
from fcu_emulator.emulator.agents.texts import TextStore
from fcu_emulator.emulator.errors import NotJudgedError
from fcu_emulator.emulator.grading.exercise_result import as_checked
from fcu_emulator.emulator.grading.verdict import Verdict

_MOST_ENTRIES: Final = 20  # of a list in the result of a run
_START_UP_S: Final = 5.0  # wall time of the process before and after the run
_OF_RUN: Final = (
    *("exit_code", "verdict", "error", "virtual_s", "timer", "chip", "bus_errors", "bytes_lost", "notes"),
    *("diagnoses", "expectations", "unchecked"),
)
"""Keys of ``fcu run --json`` that the result of the tool contains."""
_VERDICTS: Final = {0: "passed", 1: "failed", 2: "usage error", 3: "firmware failed", 4: "not judged"}


def build(texts: TextStore, wanted: Build, limit: TimeLimit) -> dict[str, Any]:
    """Build a project. Raises InputError if the folder is not a project."""
    ended = run_fcu(["build", "--", wanted.folder], limit)
    ended.raise_usage_error()
    file = Path(wanted.folder) / "lab3.elf"
    built = ended.code == 0
    return {
        "built": built,
        "file": str(file) if built else None,
        "compiler": texts.shown("build", ended.errors, 0),
    }


def check(texts: TextStore, wanted: Check, limit: TimeLimit) -> dict[str, Any]:
    """Check a program by a rubric. Raises InputError, NotJudgedError."""
    with tempfile.TemporaryDirectory(prefix="fcu-agents-") as folder:
        file = Path(folder) / "verdict.json"
        ended = run_fcu(_check_arguments(wanted, file), limit)
        ended.raise_usage_error()
        verdict = Verdict.from_json(file.read_bytes()) if file.is_file() else None
    result = _summary(ended) | {"screen": texts.shown("check", ended.output, ended.lost)}
    if ended.errors.strip():
        result["errors"] = texts.shown("errors", ended.errors)
    if verdict is not None:
        result |= _exercises(verdict)
    return result


def _check_arguments(wanted: Check, file: Path) -> list[str]:
    chosen = [f"--exercise={name}" for name in wanted.exercises]
    hints = ["--hint"] * wanted.hints
    return ["check", f"--json={file}", f"--seed={wanted.seed}", *chosen, *hints, "--", wanted.target]


def _exercises(verdict: Verdict) -> dict[str, Any]:
    judged = [
        (one, as_checked(one.exercise, verdict)) for one in verdict.exercises if verdict.of(one.exercise)
    ]
    return {
        "points": verdict.points,
        "max_points": verdict.max_points,
        "exercises": [
            {
                "exercise": one.exercise,
                "title": one.title,
                "state": result.state,
                "points": result.points,
                "max_points": result.max_points,
                "failed_checks": [check for check in result.checks if check["outcome"] != "passed"],
                "explanations": result.causes,
            }
            for one, result in judged
        ],
    }


def run(texts: TextStore, wanted: Run, limit: TimeLimit) -> dict[str, Any]:
    """Run a firmware, with a scenario or for some time. Raises InputError, NotJudgedError."""
    with tempfile.TemporaryDirectory(prefix="fcu-agents-") as folder:
        file = Path(folder) / "run.json"
        ended = run_fcu(_run_arguments(wanted, file, limit), limit)
        ended.raise_usage_error()
        text = file.read_text(encoding="utf-8") if file.is_file() else ""
    result = _summary(ended)
    if text:
        record = json.loads(text)
        result |= {key: _first(record[key]) for key in _OF_RUN}
        result["record"] = texts.keep("record", text)
    result["terminal"] = texts.shown("terminal", ended.output, ended.lost)
    result["report"] = texts.shown("report", ended.errors)
    return result


def _run_arguments(wanted: Run, file: Path, limit: TimeLimit) -> list[str]:
    duration = wanted.duration or (None if wanted.scenario else "5s")
    options = {
        "--json": file,
        "--scenario": wanted.scenario,
        "--duration": duration,
        "--wiring": wanted.wiring,
        "--seed": wanted.seed,
        "--speed": "max",
        "--limit": f"wall_s={limit.wall_s - _START_UP_S:g}",
    }
    given = [f"{name}={value}" for name, value in options.items() if value is not None]
    ideal = ["--ideal"] if wanted.ideal else []
    firmware = [] if wanted.firmware is None else ["--", wanted.firmware]
    return ["run", *given, *ideal, *firmware]


def _summary(ended: Finished) -> dict[str, Any]:
    """Return the exit code with its meaning. Raises NotJudgedError if the process was killed."""
    if ended.code not in _VERDICTS:
        raise NotJudgedError(f"the process of fcu has ended with the unexpected status {ended.code}")
    return {"exit_code": ended.code, "verdict": _VERDICTS[ended.code]}


def _first(value: Any) -> Any:
    """Return the first entries of a list, or of each list in a table."""
    if isinstance(value, dict):
        return {key: _first(one) for key, one in value.items()}
    return value[:_MOST_ENTRIES] if isinstance(value, list) else value
