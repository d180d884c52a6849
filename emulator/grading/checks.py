"""The kinds of checks that a rubric has beside those of scenarios.

Schema and judgement of a kind stand in one class, as with :mod:`emulator.scenario.expectations`: a new kind
is one class and its name in the union at the end.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Annotated, Literal

from pydantic import Field

from emulator.board.board import Board
from emulator.chip.diagnosis.report import Diagnosis
from emulator.scenario.expectations import (
    ExpectField,
    ExpectHardIron,
    ExpectLed,
    ExpectLine,
    ExpectNever,
    ExpectRegex,
    ExpectText,
    ExpectTicks,
    Seen,
)
from emulator.scenario.result import Miss
from emulator.scenario.tables import Table


@dataclass(frozen=True)
class Judged:
    """A run that is over: the board, what scenarios see of it, and what is seen to be wrong."""

    board: Board
    seen: Seen
    diagnoses: tuple[Diagnosis, ...]


class Check(Table, ABC):
    """One entry of ``expect`` that scenarios do not have."""

    @abstractmethod
    def judge(self, run: Judged) -> Miss | None:
        """How it is not met; None when it is."""


class NoFault(Check):
    """The firmware neither crashes nor hangs, and is not reset."""

    kind: Literal["no_fault"]

    def judge(self, run: Judged) -> Miss | None:
        """By the diagnosis at the end of the run."""
        fatal = next((one for one in run.diagnoses if one.fatal), None)
        return None if fatal is None else Miss("wrong value", "a program that runs on", fatal.summary)


ScenarioKind = (
    ExpectLine
    | ExpectRegex
    | ExpectNever
    | ExpectField
    | ExpectLed
    | ExpectTicks
    | ExpectHardIron
    | ExpectText
)

AnyCheck = Annotated[ScenarioKind | NoFault, Field(discriminator="kind")]
