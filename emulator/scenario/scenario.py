"""Scenarios and their runs. Any number of boards can play a scenario.

Motions are planned when the board is created. After the first jump (``set_...``), every step is
performed at its time, because a jump deletes the plans for the same quantity.

Limits are checked between slices of virtual time. In Python firmware, virtual time passes only in
HAL calls.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any, Protocol
from weakref import WeakKeyDictionary

from fcu_emulator.emulator.boards.description import BoardErrors, SensorSettings
from fcu_emulator.emulator.clock import PS_PER_S, Clock, format_duration, seconds
from fcu_emulator.emulator.errors import InputError, ScenarioError
from fcu_emulator.emulator.links.runner import Runner
from fcu_emulator.emulator.scenario.expectations import SETTLE_PS, ExpectField, RunView
from fcu_emulator.emulator.scenario.fields import Window
from fcu_emulator.emulator.scenario.following import ExpectLineFollows
from fcu_emulator.emulator.scenario.formats import NamedFormat, NumberFormat
from fcu_emulator.emulator.scenario.hardware import ExpectLedFollows
from fcu_emulator.emulator.scenario.result import ExpectationResult, Result
from fcu_emulator.emulator.scenario.run_view import BoardView, Recorder, TerminalView, Wanted, against_truth
from fcu_emulator.emulator.scenario.schema import AnyExpectation, LimitsTable, ReportTable, ScenarioFile
from fcu_emulator.emulator.scenario.timeline import TimelineAction
from fcu_emulator.emulator.world import World, earth_field
from fcu_emulator.sensors.errors import Quality

# -- Steps with absolute times, from timeline entries -------------------------------------------------------


CreateWorld = Callable[[Clock], World]


@dataclass(frozen=True)
class TimelineStep:
    """Timeline entry ``number`` of the file, active from ``at_ps`` to ``end_ps``."""

    number: int
    entry: TimelineAction
    at_ps: int
    end_ps: int

    @property
    def key(self) -> str:
        return f"timeline[{self.number}]"

    @property
    def name(self) -> str:
        kind = getattr(self.entry, "do", "")
        return f"{self.key} ({kind})"


def steps_of(entries: Sequence[TimelineAction], duration_ps: int, file: str) -> list[TimelineStep]:
    """Return steps in order of time. Raises ScenarioError for late or overlapping steps."""
    steps = []
    end_ps = 0
    for number, entry in enumerate(entries):
        at_ps = end_ps if entry.at is None else entry.at
        end_ps = at_ps + entry.length_ps
        if at_ps > duration_ps:
            problem = (
                f"must begin before the scenario's end at {seconds(duration_ps)}, not at {seconds(at_ps)}; "
                "start it earlier or give a longer duration"
            )
            raise ScenarioError(file, f"timeline[{number}].at", problem, kind="after_end")
        steps.append(TimelineStep(number, entry, at_ps, end_ps))
    steps.sort(key=lambda step: step.at_ps)
    _refuse_overlaps(steps, file)
    return steps


def _refuse_overlaps(steps: Sequence[TimelineStep], file: str) -> None:
    moving: dict[str, TimelineStep] = {}
    for step in steps:
        for quantity in sorted(step.entry.moves):
            before = moving.get(quantity)
            if before is not None and step.at_ps < before.end_ps and not step.entry.interrupts:
                problem = (
                    f"begins at {seconds(step.at_ps)} while {before.name} still moves the {quantity}; "
                    f'begin at "{format_duration(before.end_ps)}" or later'
                )
                raise ScenarioError(file, f"{step.key}.at", problem, kind="overlap")
            moving[quantity] = step


def rehearse(steps: Sequence[TimelineStep], create_world: CreateWorld, file: str) -> None:
    """Perform all steps on another world, to find errors. Raises ScenarioError."""
    clock = Clock()
    world = create_world(clock)
    for step in steps:
        clock.advance_to(step.at_ps)
        try:
            step.entry.plan(world, clock.now_s)
        except InputError as error:
            raise ScenarioError(file, step.key, str(error), kind=error.kind) from error


# -- The scenario -------------------------------------------------------------------------------------------


class Scenario:
    """One checked file: settings, timeline and expectations.

    Raises ScenarioError if the parts or the timeline are invalid.
    """

    def __init__(
        self,
        contents: ScenarioFile,
        path: Path,
        name: str | None = None,
        table: Mapping[str, Any] | None = None,
    ) -> None:
        self.name = path.stem if name is None else name
        self.path = path
        self.file = str(path)
        self.question = contents.question
        self.seed = contents.seed
        self.firmware = contents.firmware
        self.powered_on_ps = None if contents.uptime is None else -contents.uptime
        """Time of power-on. None means long before the run."""
        self.duration_ps = contents.duration
        self.i2c_speed_hz = contents.bus.speed
        self.crystal_hz = contents.crystal
        self.limits: LimitsTable = contents.limits
        self.expectations: list[AnyExpectation] = contents.expect
        self.reports: list[ReportTable] = contents.report
        self.table = table or {}
        """The table of the file, with drawn values."""
        self.contents = contents
        self.ahead = True
        """Whether motions are planned ahead. False on a live board, because a user's motion deletes plans."""
        self._recorders: WeakKeyDictionary[TerminalView, Recorder] = WeakKeyDictionary()
        self._watched: WeakKeyDictionary[TerminalView, dict[int, Any]] = WeakKeyDictionary()
        if self.duration_ps > self.limits.duration:
            problem = "must be at most limits.duration; shorten it or raise that limit"
            raise ScenarioError(self.file, "duration", problem, kind="too_long")
        self._refuse_windows_after_the_end()
        self._field_ut = self._magnetic_field()
        self.steps: Sequence[TimelineStep] = steps_of(contents.timeline, self.duration_ps, self.file)
        rehearse(self.steps, self.create_world, self.file)

    @property
    def duration_s(self) -> float:
        return self.duration_ps / PS_PER_S

    def firmware_settings(self) -> dict[str, Any]:
        return self.contents.firmware_settings.model_dump(exclude_unset=True)

    def sensor_settings(self) -> SensorSettings:
        return self.contents.sensors.settings()

    def board_errors(self, quality: Quality, seed: int) -> BoardErrors:
        """Return the deviations in the file. Deviations not in the file are random."""
        return replace(BoardErrors.of_quality(quality, seed), **self.contents.board)

    def create_world(self, clock: Clock, own: BoardErrors | None = None) -> World:
        """Create the world at power-on. ``own``: deviations of the board that are not in the file."""
        table = self.contents.world
        own = own or BoardErrors()
        try:
            floor_m = table.floor_altitude_m
            if floor_m is None and table.place is not None:
                floor_m = table.place.altitude_m
            world = World(clock) if floor_m is None else World(clock, floor_m)
            world.set_attitude(table.roll_deg, table.pitch_deg, table.yaw_deg)
            if self._field_ut is not None:
                world.set_magnetic_field(*self._field_ut)
            world.set_iron(table.hard_iron_mgauss or own.hard_iron_mgauss, table.soft_iron or own.soft_iron())
            for steel in table.steel:
                world.put_steel(**steel.model_dump())
            if table.gravity is not None:
                world.set_gravity(table.gravity)
            if table.temperature_degc is not None:
                world.set_temperature(table.temperature_degc)
            if table.humidity_percent is not None:
                world.set_humidity(table.humidity_percent)
            if table.pressure_hpa is not None:  # depends on the temperature, which sets the density
                world.set_pressure(table.pressure_hpa)
        except InputError as error:
            raise ScenarioError(self.file, "world", str(error), kind=error.kind) from error
        return world

    def play(self, board: BoardView) -> None:
        """At power-on, schedule the timeline and start to record the board."""
        tilts = any(isinstance(one, ExpectLedFollows) for one in self.expectations)
        recorder = Recorder(board, self.duration_ps, self._truth_wanted(), tilts, self._sampled())
        self._recorders[board.terminal] = recorder
        self._watched[board.terminal] = {id(one): one.watch(board) for one in self.expectations}
        jumped = not self.ahead
        for step in self.steps:
            jumped = jumped or step.entry.LIVE
            if jumped:
                board.clock.schedule(step.at_ps, partial(step.entry.perform, board, step.at_ps))
            else:
                step.entry.plan(board.world, step.at_ps / PS_PER_S)
                board.clock.schedule(step.at_ps, partial(step.entry.act, board, step.at_ps))

    def exceeded(self, board: BoardView, wall_s: float) -> str:
        """Return the limit that is exceeded after ``wall_s`` of wall time, or ""."""
        if board.terminal.uart.received_count() > self.limits.terminal_bytes:
            return f"{self.limits.terminal_bytes} bytes of text, limits.terminal_bytes"
        if wall_s > self.limits.wall / PS_PER_S:
            return f"{seconds(self.limits.wall)} of wall time, limits.wall"
        return ""

    def check(self, board: BoardView, limit: str = "") -> Result:
        """Evaluate all expectations and reports now.

        Before the end of the scenario, the result has an ``early_end``, which names ``limit`` as
        the reason. Raises InputError if the board plays another scenario.
        """
        run = self.run_view(board)
        early_end = None
        if limit or not self.is_over(board):
            cause = f"; the run exceeded {limit}" if limit else ""
            expected, seen = f"a run of {seconds(self.duration_ps)}", f"{seconds(board.clock.now_ps)}{cause}"
            early_end = ExpectationResult(expected, "stopped", seen, key="duration", kind="run")
        settle_ps = {report.field: SETTLE_PS for report in self.reports}
        for one in self._truth_wanted():
            settle_ps[one.quantity] = max(one.settle_ps, settle_ps.get(one.quantity, 0))
        reports: list[str] = []
        for report in self.reports:
            lines = [line for line in run.lines if report.covers(line.at_ps)]
            reports += against_truth(report.field, lines, settle_ps[report.field], report.window_text())
        return Result(self._results(run, self.is_over(board)), tuple(reports), early_end)

    def run_view(self, board: BoardView) -> RunView:
        """Return the run view of a board. Raises InputError if the board plays another scenario."""
        recorder = self._recorders.get(board.terminal)
        if recorder is None:
            raise InputError(f"this board must play the scenario {self.name}", kind="other_scenario")
        end_ps = min(self.duration_ps, board.clock.now_ps)
        watched = self._watched[board.terminal]
        return RunView(
            board,
            recorder.lines(),
            end_ps,
            tilts=recorder.tilts(),
            samples=recorder.samples(),
            watched=watched,
        )

    def asking(self, expectations: Sequence[AnyExpectation], reports: Sequence[ReportTable] = ()) -> Scenario:
        """Return this scenario with other expectations and reports. Raises ScenarioError."""
        changed = {"expect": list(expectations), "report": list(reports)}
        return Scenario(self.contents.model_copy(update=changed), self.path, self.name, self.table)

    def results(self, board: BoardView) -> tuple[ExpectationResult, ...]:
        """Return all current results. Raises InputError if the board plays another scenario."""
        return self._results(self.run_view(board), self.is_over(board))

    def _results(self, run: RunView, over: bool) -> tuple[ExpectationResult, ...]:
        results = []
        for number, one in enumerate(self.expectations):
            result = one.result(run)
            end_ps = getattr(one, "to", None)
            is_final = over or bool(result.is_final) or (end_ps is not None and run.end_ps >= end_ps)
            results.append(
                replace(
                    result, says=one.describe(), key=f"expect[{number}]", kind=one.kind, is_final=is_final
                )
            )
        return tuple(results)

    def is_over(self, board: BoardView) -> bool:
        return board.clock.now_ps >= self.duration_ps

    def standing(self, board: BoardView) -> list[str]:
        """Return the result as text. During the run, the text has only the counts and those failures that can
        no longer change.

        Raises InputError if the board plays another scenario.
        """
        if self.is_over(board):
            return self.check(board).lines
        results = self.results(board)
        met, still_open = (sum(one.state == state for one in results) for state in ("met", "open"))
        when = f"{seconds(board.clock.now_ps)} of {seconds(self.duration_ps)}"
        count = f"{met} of {len(results)} expectations met, {still_open} still open at {when}"
        return [*(line for one in results if one.state == "failed" for line in one.lines), count]

    def _refuse_windows_after_the_end(self) -> None:
        """Refuse windows after the end, because their expectations would always pass."""
        tables = [
            *((f"expect[{number}]", one) for number, one in enumerate(self.expectations)),
            *((f"report[{number}]", one) for number, one in enumerate(self.reports)),
        ]
        for name, table in tables:
            if isinstance(table, Window) and table.from_ >= self.duration_ps:
                problem = (
                    f"begins at {seconds(table.from_)}, but the scenario ends at "
                    f"{seconds(self.duration_ps)}; begin earlier, or give a longer duration"
                )
                raise ScenarioError(self.file, f"{name}.from", problem, kind="after_end")

    def _truth_wanted(self) -> list[Wanted]:
        compared = [one for one in self.expectations if isinstance(one, ExpectField) and one.truth]
        return [
            *(Wanted(one.field, SETTLE_PS, NamedFormat(one.field).is_begun_by) for one in self.reports),
            *(Wanted(one.quantity, one.settle, partial(_may_be, one.number_format())) for one in compared),
        ]

    def _sampled(self) -> list[str]:
        found = [one.condition for one in self.expectations if isinstance(one, ExpectLedFollows)]
        found += [one.when for one in self.expectations if isinstance(one, ExpectLineFollows)]
        names = [one.quantity for one in found if one.quantity is not None]
        both = ["pitch", "roll"] if {"pitch", "roll"} & {*names} else []  # findings also need the other angle
        return list(dict.fromkeys([*names, *both]))

    def _magnetic_field(self) -> tuple[float, float, float] | None:
        """Return the field (north, east, down) in uT, or None for the default."""
        table = self.contents.world
        if table.field is not None:
            return table.field.north_ut, table.field.east_ut, table.field.down_ut
        place = table.place
        if place is None:
            return None
        try:
            where = place.latitude_deg, place.longitude_deg, place.altitude_m or 0.0
            return earth_field(*where, place.date, place.north)
        except InputError as error:
            raise ScenarioError(self.file, "world.place", str(error), kind=error.kind) from error


def _may_be(number: NumberFormat, line: str) -> bool:
    """Return whether a line may have the number. Return True after a timeout."""
    try:
        return number.is_begun_by(line)
    except TimeoutError:
        return True


# -- Running a board through its scenario -------------------------------------------------------------------


class ScenarioBoard(BoardView, Protocol):
    """A board that has a scenario."""

    @property
    def scenario(self) -> Scenario | None: ...


def run(board: ScenarioBoard, wall_clock_s: Callable[[], float] = time.monotonic) -> Result:
    """Run a board to the end of its scenario or to a limit, and evaluate the run.

    Raises FirmwareError if the firmware fails, and InputError if the board has no scenario.
    """
    plan = _scenario(board)
    runner = Runner(board, [], plan.duration_ps, None, partial(plan.exceeded, board), wall_clock_s)
    runner.run()
    return plan.check(board, runner.limit)


def check(board: ScenarioBoard) -> list[ExpectationResult]:
    """Return the early end and the expectations that fail now."""
    return list(_scenario(board).check(board).findings)


def _scenario(board: ScenarioBoard) -> Scenario:
    if board.scenario is None:
        raise InputError('this board has no scenario; give one: Board(scenario="flat")')
    return board.scenario
