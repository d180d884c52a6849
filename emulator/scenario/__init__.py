"""Scenarios: TOML files that say what happens to the board, and what is expected of its firmware.

::

    from fcu_emulator import Board
    from fcu_emulator.emulator.scenario import run

    result = run(Board(scenario="stairs"))
    print("\\n".join(result.lines))
    assert result.passed

Files are a thin layer over the Python interface: a timeline entry is a call of the world's method of that
name, so tests in Python and in files cannot disagree.

Names are loaded when they are first used: schemas need pydantic, and what reads printed numbers does not.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from fcu_emulator.emulator.scenario.expectations import Failure
    from fcu_emulator.emulator.scenario.loader import load_scenario, scenario_names
    from fcu_emulator.emulator.scenario.scenario import Finding, Result, Scenario, check, run
    from fcu_emulator.emulator.scenario.schema import ScenarioFile, json_schema

_HOMES = {
    "load_scenario": "loader",
    "scenario_names": "loader",
    "Failure": "expectations",
    "Finding": "scenario",
    "Result": "scenario",
    "Scenario": "scenario",
    "check": "scenario",
    "run": "scenario",
    "ScenarioFile": "schema",
    "json_schema": "schema",
}

__all__ = [
    "Failure",
    "Finding",
    "Result",
    "Scenario",
    "ScenarioFile",
    "check",
    "json_schema",
    "load_scenario",
    "run",
    "scenario_names",
]


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_HOMES[name]}"), name)
