"""From timeline entries to steps with absolute times, and the check that the world can follow them.

Every step is tried on a world of its own before the scenario is used: whatever the world refuses is an error
of the file, with its key path, and not a surprise in the middle of a run.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from emulator.errors import InputError, ScenarioError
from emulator.scenario.entry import Entry
from emulator.time.clock import PS_PER_S
from emulator.time.durations import format_duration, seconds
from emulator.world import World

CreateWorld = Callable[[Callable[[], float]], World]


@dataclass(frozen=True)
class Step:
    """Entry ``number`` (its index in the file) from ``at_ps`` to ``end_ps``."""

    number: int
    entry: Entry
    at_ps: int
    end_ps: int

    @property
    def key(self) -> str:
        """Its place in the file."""
        return f"timeline[{self.number}]"

    @property
    def name(self) -> str:
        """Its place and kind, for messages about others."""
        kind = getattr(self.entry, "do", "")
        return f"{self.key} ({kind})"


def steps_of(entries: Sequence[Entry], duration_ps: int, file: str) -> list[Step]:
    """Steps in order of time; raises ScenarioError for a step after the end, or two motions at once."""
    steps = []
    end_ps = 0
    for number, entry in enumerate(entries):
        at_ps = end_ps if entry.at is None else entry.at
        end_ps = at_ps + entry.length_ps
        if at_ps > duration_ps:
            problem = (
                f"begins at {seconds(at_ps)}, after the scenario's end at {seconds(duration_ps)}; "
                "let it begin earlier or give a longer duration"
            )
            raise ScenarioError(file, f"timeline[{number}].at", problem)
        steps.append(Step(number, entry, at_ps, end_ps))
    steps.sort(key=lambda step: step.at_ps)
    _refuse_overlaps(steps, file)
    return steps


def _refuse_overlaps(steps: Sequence[Step], file: str) -> None:
    moving: dict[str, Step] = {}
    for step in steps:
        for quantity in sorted(step.entry.moves):
            before = moving.get(quantity)
            if before is not None and step.at_ps < before.end_ps:
                problem = (
                    f"begins at {seconds(step.at_ps)} while {before.name} still moves the {quantity}; "
                    f'begin at "{format_duration(before.end_ps)}" or later'
                )
                raise ScenarioError(file, f"{step.key}.at", problem)
            moving[quantity] = step


def rehearse(steps: Sequence[Step], create_world: CreateWorld, file: str) -> None:
    """Let a world of its own follow all steps; what it refuses becomes a ScenarioError."""
    now_s = 0.0
    world = create_world(lambda: now_s)
    for step in steps:
        now_s = step.at_ps / PS_PER_S
        try:
            step.entry.plan(world, now_s)
        except InputError as error:
            raise ScenarioError(file, step.key, str(error)) from error
