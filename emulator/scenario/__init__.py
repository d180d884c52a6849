"""Scenarios: TOML files with events on a board and expectations about its firmware.

::

    from fcu_emulator import Board
    from fcu_emulator.emulator.scenario import run

    result = run(Board(scenario="stairs"))
    print("\\n".join(result.lines))
    assert result.passed

Names are loaded on first use, because schemas need pydantic, which is slow to import.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from fcu_emulator.emulator.scenario.loader import load_scenario, scenario_names
    from fcu_emulator.emulator.scenario.result import ExpectationResult, Result
    from fcu_emulator.emulator.scenario.scenario import Scenario, check, run
    from fcu_emulator.emulator.scenario.schema import ScenarioFile, json_schema

_HOMES = {
    "load_scenario": "loader",
    "scenario_names": "loader",
    "ExpectationResult": "result",
    "Result": "result",
    "Scenario": "scenario",
    "check": "scenario",
    "run": "scenario",
    "ScenarioFile": "schema",
    "json_schema": "schema",
}

__all__ = [
    "ExpectationResult",
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
