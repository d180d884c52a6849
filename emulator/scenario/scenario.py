"""A scenario that is ready to be played on any number of boards.

How it is played: motions are planned on the world when the board is built, with absolute start times, so
that the truth can be asked for ahead of time. From the first jump of the world on (``set_...``), every step
is done when its time comes, because a jump drops what was planned for its quantity, and a motion begins from
the state in force. Bus faults and typing are always done when their time comes.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any
from weakref import WeakKeyDictionary

from emulator.boards.description import SensorSettings
from emulator.errors import InputError, ScenarioError
from emulator.scenario.board_view import BoardView, TerminalView
from emulator.scenario.expect_board import SETTLE_PS, ExpectField
from emulator.scenario.expectation import Seen, Windowed
from emulator.scenario.recorder import Recorder
from emulator.scenario.report import against_truth
from emulator.scenario.result import Finding, Miss, Result
from emulator.scenario.schema import AnyExpectation, ReportTable, ScenarioFile
from emulator.scenario.setup import LimitsTable
from emulator.scenario.steps import Step, rehearse, steps_of
from emulator.time.clock import PS_PER_S
from emulator.time.durations import seconds
from emulator.world import World, earth_field


class Scenario:
    """One file, checked: its board's settings, its timeline, its expectations.

    ``name`` is the file's name without ``.toml``; ``file`` is how messages call it. Raises ScenarioError when
    the parts do not fit together or the world cannot follow the timeline.
    """

    def __init__(self, contents: ScenarioFile, path: Path) -> None:
        self.name = path.stem
        self.path = path
        self.file = str(path)
        self.question = contents.question
        self.seed = contents.seed
        self.firmware = contents.firmware
        self.duration_ps = contents.duration
        self.i2c_speed_hz = contents.bus.speed
        self.limits: LimitsTable = contents.limits
        self.expectations: list[AnyExpectation] = contents.expect
        self.reports: list[ReportTable] = contents.report
        self._contents = contents
        self._recorders: WeakKeyDictionary[TerminalView, Recorder] = WeakKeyDictionary()
        if self.duration_ps > self.limits.duration:
            problem = "is longer than limits.duration; shorten it or raise that limit"
            raise ScenarioError(self.file, "duration", problem)
        self._refuse_windows_after_the_end()
        self._field_ut = self._magnetic_field()
        self._steps = steps_of(contents.timeline, self.duration_ps, self.file)
        rehearse(self._steps, self.create_world, self.file)

    @property
    def duration_s(self) -> float:
        """How long it lasts, in seconds of virtual time."""
        return self.duration_ps / PS_PER_S

    def firmware_settings(self) -> dict[str, Any]:
        """What the file sets about the firmware."""
        return self._contents.firmware_settings.model_dump(exclude_unset=True)

    def sensor_settings(self) -> SensorSettings:
        """How the sensors deviate."""
        sensors = self._contents.sensors
        return SensorSettings(
            sensors.grade, sensors.lsm6dsl, sensors.lis2mdl, sensors.lps22hb, sensors.magnetometer_mounting
        )

    def create_world(self, now_s: Callable[[], float]) -> World:
        """The world at power-on."""
        table = self._contents.world
        try:
            world = World(now_s) if table.floor_altitude_m is None else World(now_s, table.floor_altitude_m)
            world.set_attitude(table.roll_deg, table.pitch_deg, table.yaw_deg)
            if self._field_ut is not None:
                world.set_magnetic_field(*self._field_ut)
            world.set_hard_iron(*table.hard_iron_mgauss)
            if table.soft_iron is not None:
                world.set_soft_iron(table.soft_iron)
            if table.gravity is not None:
                world.set_gravity(table.gravity)
            if table.temperature_degc is not None:
                world.set_temperature(table.temperature_degc)
            if table.pressure_hpa is not None:  # after the temperature, on which the air's density depends
                world.set_pressure(table.pressure_hpa)
        except InputError as error:
            raise ScenarioError(self.file, "world", str(error)) from error
        return world

    def play(self, board: BoardView) -> None:
        """Bring the timeline to a board at power-on, and watch it.

        The board may be a weak proxy, so that what is scheduled does not keep it alive. Its terminal, which
        no other board has, stands for it here: a proxy is no key.
        """
        self._recorders[board.terminal] = Recorder(board, self.duration_ps, self._fields_of_interest())
        jumped = False
        for step in self._steps:
            jumped = jumped or step.entry.LIVE
            if jumped:
                board.clock.schedule(step.at_ps, partial(_do, step, board.world))
            else:
                step.entry.plan(board.world, step.at_ps / PS_PER_S)
            board.clock.schedule(step.at_ps, partial(step.entry.act, board, step.at_ps))

    def exceeded(self, board: BoardView, wall_s: float) -> str:
        """The limit that a run of ``wall_s`` seconds of wall time has exceeded by now; empty if none."""
        if board.uart.received_count() > self.limits.terminal_bytes:
            return f"{self.limits.terminal_bytes} bytes of text, limits.terminal_bytes"
        if wall_s > self.limits.wall / PS_PER_S:
            return f"{seconds(self.limits.wall)} of wall time, limits.wall"
        return ""

    def check(self, board: BoardView, limit: str = "") -> Result:
        """All expectations and reports about a board that plays this scenario, as of now.

        A board that has not come to the end is judged by what it did so far, and a finding says so; ``limit``
        is what kept it from the end. Raises InputError for a board that plays another scenario.
        """
        recorder = self._recorders.get(board.terminal)
        if recorder is None:
            raise InputError(f"this board does not play the scenario {self.name}")
        lines = recorder.lines()
        now_ps = board.clock.now_ps
        seen = Seen(board, lines, min(self.duration_ps, now_ps))
        findings = []
        if now_ps < self.duration_ps or limit:
            cause = f"; the run exceeded {limit}" if limit else ""
            miss = Miss("stopped", f"a run of {seconds(self.duration_ps)}", f"{seconds(now_ps)}{cause}")
            findings.append(Finding("duration", "run", miss))
        for number, expectation in enumerate(self.expectations):
            failure = _judged(expectation, seen)
            if failure is not None:
                findings.append(Finding(f"expect[{number}]", expectation.kind, failure))
        reports = [text for report in self.reports for text in against_truth(report.field, lines)]
        return Result(len(self.expectations), tuple(findings), tuple(reports))

    def _refuse_windows_after_the_end(self) -> None:
        """An expectation that looks at nothing must not pass for one that is met."""
        for number, expectation in enumerate(self.expectations):
            if isinstance(expectation, Windowed) and expectation.from_ >= self.duration_ps:
                problem = (
                    f"begins at {seconds(expectation.from_)}, when the scenario has ended "
                    f"({seconds(self.duration_ps)}); look earlier or give a longer duration"
                )
                raise ScenarioError(self.file, f"expect[{number}].from", problem)

    def _fields_of_interest(self) -> dict[str, int]:
        """Fields to be compared with the truth, and for how long before each print it is wanted."""
        settle_ps = {report.field: SETTLE_PS for report in self.reports}
        for expectation in self.expectations:
            if isinstance(expectation, ExpectField) and expectation.truth:
                longest = max(expectation.settle, settle_ps.get(expectation.name, 0))
                settle_ps[expectation.name] = longest
        return settle_ps

    def _magnetic_field(self) -> tuple[float, float, float] | None:
        """NED in uT; None for the world's default."""
        table = self._contents.world
        if table.field is not None:
            return table.field.north_ut, table.field.east_ut, table.field.down_ut
        place = table.place
        if place is None:
            return None
        try:
            where = place.latitude_deg, place.longitude_deg, place.altitude_m
            return earth_field(*where, place.date, place.north)
        except InputError as error:
            raise ScenarioError(self.file, "world.place", str(error)) from error


def _judged(expectation: AnyExpectation, seen: Seen) -> Miss | None:
    try:
        return expectation.judge(seen)
    except TimeoutError:
        return Miss(
            "stopped", "a pattern that can be searched in reasonable time", "the search took too long"
        )


def _do(step: Step, world: World) -> None:
    step.entry.plan(world, step.at_ps / PS_PER_S)
