"""``fcu scenarios`` and ``fcu scenario ...``."""

from __future__ import annotations

import json

import click

from emulator.scenario import json_schema, load_scenario, scenario_names


def list_scenarios() -> None:
    """Print the shipped scenarios with their questions."""
    names = scenario_names()
    width = max(len(name) for name in names)
    for name, question in names.items():
        click.echo(f"{name:<{width}}  {question}")
    click.echo("\nRun one with: fcu run --scenario NAME")


def check_scenario(file: str) -> None:
    """Load a scenario; raises ScenarioError naming file and key path."""
    plan = load_scenario(file)
    click.echo(f"{file}: good; {plan.question}")


def print_schema() -> None:
    """Print the JSON schema of scenario files."""
    click.echo(json.dumps(json_schema(), indent=2))
