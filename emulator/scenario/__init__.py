"""Scenarios: TOML files that say what happens to the board, and what is expected of its firmware.

::

    from emulator import Board
    from emulator.scenario import run

    result = run(Board(scenario="stairs"))
    print("\\n".join(result.lines))
    assert result.passed

Files are a thin layer over the Python interface: a timeline entry is a call of the world's method of that
name, so tests in Python and in files cannot disagree.
"""

from emulator.scenario.loader import load_scenario, scenario_names
from emulator.scenario.result import Finding, Miss, Result
from emulator.scenario.scenario import Scenario, check, run
from emulator.scenario.schema import ScenarioFile, json_schema

__all__ = [
    "Finding",
    "Miss",
    "Result",
    "Scenario",
    "ScenarioFile",
    "check",
    "json_schema",
    "load_scenario",
    "run",
    "scenario_names",
]
