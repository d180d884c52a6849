"""What every expectation has in common: a view of the run, and a window of time."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass

from pydantic import Field, model_validator

from emulator.scenario.board_view import BoardView
from emulator.scenario.recorder import Line
from emulator.scenario.result import Miss
from emulator.scenario.tables import Table
from emulator.scenario.units import Duration
from emulator.time.clock import NEVER_PS
from emulator.time.durations import seconds


@dataclass(frozen=True)
class Seen:
    """A run as expectations see it: its lines, and the board after ``end_ps``."""

    board: BoardView
    lines: list[Line]
    end_ps: int


class Expectation(Table, ABC):
    """One ``[[expect]]`` table: schema and judgement in one class."""

    @abstractmethod
    def judge(self, seen: Seen) -> Miss | None:
        """How it is not met; None when it is."""


class Windowed(Expectation):
    """Looks at a part of the run only: lines whose printing began in the window."""

    from_: Duration = Field(0, alias="from")
    to: Duration | None = None

    @model_validator(mode="after")
    def _in_order(self) -> Windowed:
        if self.to is not None and self.to <= self.from_:
            raise ValueError("has a window that ends before it begins; give a later to")
        return self

    def lines_in_window(self, seen: Seen) -> list[Line]:
        """The lines that count."""
        end_ps = NEVER_PS if self.to is None else self.to
        return [line for line in seen.lines if self.from_ <= line.at_ps <= end_ps]

    def window_text(self) -> str:
        """The window for messages; empty when it is the whole run."""
        if self.from_ == 0 and self.to is None:
            return ""
        end = "the end" if self.to is None else seconds(self.to)
        return f" from {seconds(self.from_)} to {end}"
