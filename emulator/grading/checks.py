"""Kinds of checks in rubrics, in addition to a scenario's expectations."""

from __future__ import annotations

from abc import abstractmethod
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
from fcu_emulator.emulator.clock import PS_PER_MS, PS_PER_S, Periodic
from fcu_emulator.emulator.errors import FirmwareError, NotJudgedError
from fcu_emulator.emulator.scenario.expectations import RunView
from fcu_emulator.emulator.scenario.fields import Duration, Length
from fcu_emulator.emulator.scenario.result import ExpectationResult, Expected
from fcu_emulator.emulator.scenario.run_view import escaped
from fcu_emulator.emulator.scenario.schema import Kinds
from fcu_emulator.emulator.text import choices, shown

# -- Shared by all kinds ------------------------------------------------------------------------------------


@dataclass(frozen=True)
class FinishedRun:
    """A finished run. ``watched``: result of :meth:`Check.watch`."""

    firmware: str | Path | FirmwareFactory
    board: Board
    view: RunView
    recorder: TruthRecorder
    diagnoses: tuple[Diagnosis, ...]
    build_log: str | None
    watched: Any


class Check(Expected):
    """An entry of ``expect`` of a kind that only rubrics have."""

    @abstractmethod
    def evaluate(self, run: FinishedRun) -> ExpectationResult:
        """Return the result. Raises NotJudgedError if the check cannot be judged."""


# -- The program as a whole: no fault, no diagnosis, no compiler warnings -----------------------------------


class NoFault(Check):
    """The firmware does not crash, hang or reset."""

    kind: Literal["no_fault"]

    def describe(self) -> str:
        return "a program that keeps running"

    def evaluate(self, run: FinishedRun) -> ExpectationResult:
        fatal = next((one for one in run.diagnoses if one.fatal), None)
        return self.met() if fatal is None else self.failed("wrong value", fatal.summary)


class NoDiagnosis(Check):
    """The final diagnosis has none of these kinds, and is not fatal."""

    kind: Literal["no_diagnosis"]
    of: list[Kind] = Field(min_length=1)

    def describe(self) -> str:
        return f"no diagnosis of: {', '.join(self.of)}"

    def evaluate(self, run: FinishedRun) -> ExpectationResult:
        found = next((one for one in run.diagnoses if one.fatal or one.kind in self.of), None)
        return self.met() if found is None else self.failed("wrong value", found.summary)


class NoWarnings(Check):
    """The compiler printed at most ``max`` warnings. Unjudged if fcu did not build the program."""

    RENAMED: ClassVar[Mapping[str, str]] = {"most": "max"}

    kind: Literal["no_warnings"]
    max: int = Field(0, ge=0)

    def describe(self) -> str:
        return f"at most {self.max} warnings" if self.max else "no warning"

    def evaluate(self, run: FinishedRun) -> ExpectationResult:
        if run.build_log is None:
            raise NotJudgedError("the program was not built from source")
        lines = run.build_log.splitlines()
        warnings = [
            line for line in lines if "warning:" in line and line[:1] != " "
        ]  # a leading space marks a quoted line of source
        if len(warnings) <= self.max:
            return self.met()
        count = f"{len(warnings)} warning{'s' * (len(warnings) > 1)}, the first: {escaped(warnings[0])[:200]}"
        return self.failed("wrong value", count)


# -- The callback -------------------------------------------------------------------------------------------


_LOOK_PS = Fraction(PS_PER_MS, 10)
_FEW = 8  # number of polls; 0.8 ms
_BYTES = 4  # bytes sent during these polls come from the callback, because main() is suspended


class QuietCallback(Check):
    """The timer's callback prints nothing."""

    kind: Literal["quiet_callback"]
    from_: Duration = Field(2 * PS_PER_S, alias="from")
    for_: Length = Field(1_200 * PS_PER_MS, alias="for")

    def describe(self) -> str:
        return "no print in the timer's callback"

    def watch(self, board: Board) -> list[float]:
        """Every 0.1 ms, check for bytes sent during the timer's interrupt."""
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

    def evaluate(self, run: FinishedRun) -> ExpectationResult:
        if not run.watched:
            return self.met()
        place = _print_in_callback(run.board)
        seen = f"one at {run.watched[0]:.3f} s" + (f", from {place}" if place else "")
        return self.failed("wrong value", seen)


def _print_in_callback(board: Board) -> str:
    if board.chip is None:
        return ""
    places = Places(board.chip.image)
    start = places.address_of("HAL_TIM_PeriodElapsedCallback")
    call = start and places.call_of(("PRINTF", "HAL_UART_Transmit"), start, board.chip.core.memory)
    return f"{call[1]}() in {places.place(call[0])}" if call else ""


def _sends_by_itself(arm: ArmFirmware) -> bool:
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
"""Names of tests in :mod:`fcu_emulator.emulator.testing.lab3`, without ``test_``."""


def _known_property(name: str) -> str:
    if name not in PROPERTIES:
        raise ValueError(f"must be {choices(PROPERTIES)}, not {shown(name)}")
    return name


class Property(Check):
    """The compiled functions obey a law of :mod:`fcu_emulator.emulator.testing.lab3`.

    The check is unjudged if the function or the package Hypothesis is missing.
    """

    kind: Literal["property"]
    property: Annotated[
        str, AfterValidator(_known_property), Field(json_schema_extra={"enum": list(PROPERTIES)})
    ]
    examples: int = Field(100, ge=1, le=10_000)

    def describe(self) -> str:
        return self.property.replace("_", " ")

    def evaluate(self, run: FinishedRun) -> ExpectationResult:
        if not isinstance(run.firmware, str | Path):
            raise NotJudgedError("firmware in Python has no compiled functions")
        try:
            from fcu_emulator.emulator.testing.counterexample import counterexample
        except ModuleNotFoundError as error:
            raise NotJudgedError(
                f"{error.name} is not installed; install it: pip install {error.name}"
            ) from error
        try:
            found = counterexample(str(run.firmware), self.property, self.examples)
        except FirmwareError as error:
            return self.failed("wrong value", str(error).splitlines()[0])
        return self.met() if found is None else self.failed("wrong value", found)


AnyCheck = Annotated[
    Kinds | NoFault | NoDiagnosis | NoWarnings | QuietCallback | Property,
    Field(discriminator="kind"),
]
