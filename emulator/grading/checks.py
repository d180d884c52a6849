"""The kinds of checks that a rubric has beside those of scenarios.

Schema and judgement of a kind stand in one class, as with :mod:`fcu_emulator.emulator.scenario.expectations`: a new kind
is one class and its name in the union at the end. What a kind wants to see during the run, it watches from
:meth:`Check.watch` on; everything else it finds in :class:`Judged`.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import Annotated, Any, ClassVar, Literal

from pydantic import AfterValidator, Field

from fcu_emulator.emulator.analysis.recorder import TruthRecorder
from fcu_emulator.emulator.assembly.board import Board
from fcu_emulator.emulator.assembly.firmware import FirmwareFactory
from fcu_emulator.emulator.chip.diagnosis.backtrace import Places
from fcu_emulator.emulator.chip.diagnosis.report import Diagnosis, Kind
from fcu_emulator.emulator.chip.firmware import ArmFirmware
from fcu_emulator.emulator.errors import FirmwareError, NotJudgedError
from fcu_emulator.emulator.scenario.expectations import Failure, RunView
from fcu_emulator.emulator.scenario.fields import Duration, Length, Table
from fcu_emulator.emulator.scenario.run_view import escaped
from fcu_emulator.emulator.scenario.schema import Kinds
from fcu_emulator.emulator.text import shown
from fcu_emulator.emulator.time.clock import PS_PER_MS, PS_PER_S, Periodic

# -- What every kind has in common --------------------------------------------------------------------------


@dataclass(frozen=True)
class Judged:
    """A run that is over: the board, what scenarios see of it, and what is seen to be wrong.

    ``watched``: what the check's own :meth:`Check.watch` has returned.
    """

    firmware: str | Path | FirmwareFactory
    board: Board
    seen: RunView
    recorder: TruthRecorder
    diagnoses: tuple[Diagnosis, ...]
    build_log: str | None
    watched: Any


class Check(Table, ABC):
    """One entry of ``expect`` that scenarios do not have."""

    def watch(self, board: Board) -> Any:
        """Called before the run; what it returns is ``watched`` at the end."""
        del board
        return None

    @abstractmethod
    def judge(self, run: Judged) -> Failure | None:
        """How it is not met; None when it is. Raises NotJudgedError when nothing can be said."""


# -- The program as a whole: it runs on, nothing is diagnosed, it builds without warnings -------------------


class NoFault(Check):
    """The firmware neither crashes nor hangs, and is not reset."""

    kind: Literal["no_fault"]

    def judge(self, run: Judged) -> Failure | None:
        """By the diagnosis at the end of the run."""
        fatal = next((one for one in run.diagnoses if one.fatal), None)
        return None if fatal is None else Failure("wrong value", "a program that runs on", fatal.summary)


class NoDiagnosis(Check):
    """The diagnosis has nothing of these kinds to say at the end of the run.

    Of a program that cannot go on it says that alone, so such a program does not pass either.
    """

    kind: Literal["no_diagnosis"]
    of: list[Kind] = Field(min_length=1)

    def judge(self, run: Judged) -> Failure | None:
        """The first one that it has."""
        found = next((one for one in run.diagnoses if one.fatal or one.kind in self.of), None)
        if found is None:
            return None
        return Failure("wrong value", f"nothing to be said about: {', '.join(self.of)}", found.summary)


class NoWarnings(Check):
    """The compiler had nothing to say about the program; unjudged where it was not built here."""

    RENAMED: ClassVar[Mapping[str, str]] = {"most": "max"}

    kind: Literal["no_warnings"]
    max: int = Field(0, ge=0)

    def judge(self, run: Judged) -> Failure | None:
        """Lines with ``warning:`` in what the build printed."""
        if run.build_log is None:
            raise NotJudgedError("the program was not built here")
        lines = run.build_log.splitlines()
        warnings = [line for line in lines if "warning:" in line and line[:1] != " "]  # a space: an excerpt
        if len(warnings) <= self.max:
            return None
        count = f"{len(warnings)} warning{'s' * (len(warnings) > 1)}, the first: {escaped(warnings[0])[:200]}"
        return Failure("wrong value", f"at most {self.max} warnings" if self.max else "no warning", count)


# -- The callback -------------------------------------------------------------------------------------------


_LOOK_PS = Fraction(PS_PER_MS, 10)
_FEW = 8  # looks, 0.8 ms
_BYTES = 4  # within these, from inside the callback: a byte takes 0.09 ms, and main() stands still


class QuietCallback(Check):
    """Nothing is printed in the timer's callback: while it runs, the serial line comes to rest."""

    kind: Literal["quiet_callback"]
    from_: Duration = Field(2 * PS_PER_S, alias="from")
    for_: Length = Field(1_200 * PS_PER_MS, alias="for")

    def watch(self, board: Board) -> list[float]:
        """Look every 0.1 ms whether bytes go out while the timer's interrupt is being handled."""
        caught: list[float] = []
        counts: list[int] = []

        def look() -> None:
            arm = board.chip
            serial = board.description.serial.peripheral
            if arm is None or not arm.handles(board.timer.name) or arm.handles(serial):
                counts.clear()
                return
            counts.append(board.terminal.uart.received_count())
            if len(counts) > _FEW:
                del counts[0]
            if counts[-1] - counts[0] >= _BYTES and not _sends_by_itself(arm):
                caught.append(board.now_s)

        def begin() -> None:
            looking = Periodic(board.clock, board.clock.now_ps, _LOOK_PS, look)
            board.clock.schedule(self.from_ + self.for_, looking.cancel, last=True)

        board.clock.schedule(self.from_, begin)
        return caught

    def judge(self, run: Judged) -> Failure | None:
        """The first time that it was seen."""
        if not run.watched:
            return None
        place = _print_in_callback(run.board)
        seen = f"one at {run.watched[0]:.3f} s" + (f", from {place}" if place else "")
        return Failure("wrong value", "no print in the timer's callback", seen)


def _print_in_callback(board: Board) -> str:
    """Where the callback of the HAL prints; "" if that is not seen."""
    if board.chip is None:
        return ""
    places = Places(board.chip.image)
    start = places.address_of("HAL_TIM_PeriodElapsedCallback")
    call = start and places.call_of(("PRINTF", "HAL_UART_Transmit"), start, board.chip.core.memory)
    return f"{call[1]}() in {places.place(call[0])}" if call else ""


def _sends_by_itself(arm: ArmFirmware) -> bool:
    """Whether the terminal's USART is fed by DMA or by its own interrupt, so that text goes on meanwhile."""
    usart = arm.chip.core.peripherals[arm.signals.board.serial.peripheral]
    interrupt, dma = usart.peek(0x0C) >> 7, usart.peek(0x14) >> 7  # CR1.TXEIE, CR3.DMAT
    return bool((interrupt | dma) & 1)


# -- Properties of the compiled functions -------------------------------------------------------------------


PROPERTIES = (
    "pitch_is_the_inclination_of_the_x_axis",
    "roll_is_the_inclination_of_the_y_axis",
    "yaw_is_the_direction_of_the_x_axis_against_magnetic_north",
    "angles_stay_within_their_ranges",
    "angles_do_not_depend_on_the_vectors_lengths",
    "calibration_finds_any_offset",
    "altitude_is_0_where_it_was_zeroed",
    "less_pressure_is_more_altitude",
)
"""Of :mod:`fcu_emulator.emulator.testing.lab3`, without ``test_``."""


def _known_property(name: str) -> str:
    if name not in PROPERTIES:
        raise ValueError(f"is {shown(name)}; known: {', '.join(PROPERTIES)}")
    return name


class Property(Check):
    """A law of the lab's arithmetic holds for the compiled functions (:mod:`fcu_emulator.emulator.testing.lab3`).

    The same ``examples`` for everybody. Unjudged if the firmware has no such function, or Hypothesis is not
    installed.
    """

    kind: Literal["property"]
    property: Annotated[
        str, AfterValidator(_known_property), Field(json_schema_extra={"enum": list(PROPERTIES)})
    ]
    examples: int = Field(100, ge=1, le=10_000)

    def judge(self, run: Judged) -> Failure | None:
        """Hypothesis looks for a counter-example, and makes it small."""
        if not isinstance(run.firmware, str | Path):
            raise NotJudgedError("firmware in Python has no compiled functions")
        try:
            from fcu_emulator.emulator.testing.counterexample import counterexample
        except ModuleNotFoundError as error:
            raise NotJudgedError(f"{error.name} is not installed; pip install {error.name}") from error
        try:
            found = counterexample(str(run.firmware), self.property, self.examples)
        except FirmwareError as error:
            return Failure("wrong value", self._text(), str(error).splitlines()[0])
        return None if found is None else Failure("wrong value", self._text(), found)

    def _text(self) -> str:
        return self.property.replace("_", " ")


AnyCheck = Annotated[
    Kinds | NoFault | NoDiagnosis | NoWarnings | QuietCallback | Property,
    Field(discriminator="kind"),
]
