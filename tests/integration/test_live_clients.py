"""Clients of a live session: past data for a later client, variables, failures and judgements."""

from __future__ import annotations

import itertools
from typing import Any

import pytest

from fcu_emulator.emulator.errors import InputError
from fcu_emulator.emulator.live import messages
from fcu_emulator.emulator.live.messages import Checked, SessionEvent
from fcu_emulator.emulator.live.past import MOST_PRINTS, MOST_STATES, Past
from fcu_emulator.emulator.live.setup import Setup
from fcu_emulator.firmware_model.arm import prebuilt
from tests.support.arm.broken_programs import FOLDER
from tests.support.live_fakes import Page, do


def state(t_s: float, **variables: float) -> messages.State:
    truth = {"roll_deg": t_s, "rotation": [1, 0, 0, 0, 1, 0, 0, 0, 1], "magnet_m": None}
    return messages.State(1, t_s, 1.0, {}, truth, {}, variables, {}, 0)


# -- the past -----------------------------------------------------------------------------------------------


def test_later_client_gets_past_data() -> None:
    later = object()
    script = [(0.5, do(do="set_attitude", roll_deg=40))]

    def follow(event: SessionEvent) -> None:
        if isinstance(event, messages.State) and event.t_s >= 3 and later not in page.session._clients:
            page.session.attach(later)

    page = Page(Setup("solution", ideal=True), script, end_s=3.5, on_event=follow)
    page.run()
    past = page.of(messages.PastEvent)[-1]
    times = [one["t_s"] for one in past.states]
    assert times == sorted(times)
    assert times[0] < 0.2
    assert 2.8 < times[-1] <= 3.2
    assert max(after - before for before, after in itertools.pairwise(times)) < 0.2
    rolls = {round(one["truth"]["roll_deg"]) for one in past.states}
    assert {0, 40} <= rolls
    assert [one["t_s"] for one in past.prints] == [
        one.t_s for one in page.of(messages.PrintedEvent)[: len(past.prints)]
    ]
    assert past.prints


def test_past_data_are_stored_without_client() -> None:
    page = Page(Setup("solution", ideal=True), end_s=3.0)

    def follow(event: SessionEvent) -> None:
        if isinstance(event, messages.State) and page.session._clients and event.t_s < 2:
            page.session.detach(page)
        if isinstance(event, messages.State) and not page.session._clients and event.t_s > 2:
            page.session.attach(page)

    page._on_event = follow
    page.run()
    times = [one["t_s"] for one in page.of(messages.PastEvent)[-1].states]
    assert max(after - before for before, after in itertools.pairwise(times)) < 0.2


def test_reset_discards_past_data() -> None:
    page = Page(Setup("solution", ideal=True), [(1.5, messages.Reset())], end_s=2.0)
    page.run()
    last = page.of(messages.PastEvent)[-1]
    assert (last.run, last.states) == (2, [])


def test_size_of_past_data_is_limited() -> None:
    past = Past(1)
    for number in range(3 * MOST_STATES):
        past.add_state(state(0.1 * number), wall_s=0.1 * number)
        past.add_printed(messages.PrintedEvent(0.1 * number, {"Roll": 1.0}, {}))
    message = past.message()
    assert len(message.states) == MOST_STATES
    assert len(message.prints) == MOST_PRINTS
    assert message.states[-1]["t_s"] == pytest.approx(0.1 * (3 * MOST_STATES - 1))


@pytest.mark.parametrize(
    ("virtual_s", "wall_s", "kept"), [(0.02, 0.02, 12), (2.0, 0.02, 60), (2e-4, 0.02, 12)]
)
def test_past_data_are_thinned_at_each_speed(virtual_s: float, wall_s: float, kept: int) -> None:
    past = Past(1)
    for number in range(60):
        past.add_state(state(virtual_s * number), wall_s=wall_s * number)
    assert len(past.message().states) == kept


# -- variables ----------------------------------------------------------------------------------------------


def watched(*names: str) -> Page:
    page = Page(
        Setup(prebuilt("solution", "I2C2"), ideal=True), [(1.2, messages.Watch(list(names)))], end_s=1.5
    )
    page.run()
    return page


@pytest.mark.parametrize("name", ["no_such_variable", "pitch.AXIS_X", "acc.AXIS_Q", "acc[0]", "", "main"])
def test_only_unknown_variable_is_refused(name: str) -> None:
    page = watched("pitch", name, "acc")
    assert page.of(messages.Unknown) == [messages.Unknown([name])]
    (notice,) = page.of(messages.Notice)
    assert notice.kind == "error"
    assert set(page.of(messages.State)[-1].variables) == {"pitch", "acc.AXIS_X", "acc.AXIS_Y", "acc.AXIS_Z"}


def test_known_variables_are_not_refused() -> None:
    page = watched("pitch", "acc.AXIS_X")
    assert page.of(messages.Unknown) == []
    assert page.of(messages.Notice) == []
    assert set(page.of(messages.State)[-1].variables) == {"pitch", "acc.AXIS_X"}


# -- failures -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("program", "at_s"),
    [("even_address", 0.05), ("divide_by_zero", 0.05), ("poll_without_clock", 0.6), ("tick_off", 0.6)],
)
def test_crash_or_hang_is_reported_promptly(program: str, at_s: float) -> None:
    told: list[tuple[float, dict[str, Any]]] = []

    def follow(event: SessionEvent) -> None:
        if isinstance(event, messages.Findings) and event.findings:
            told.append((page.session.board.now_s, event.findings[0]))

    page = Page(Setup(FOLDER / f"{program}.elf", ideal=True), end_s=1.0, on_event=follow)
    page.run()
    when_s, finding = told[0]
    assert finding["fatal"]
    assert when_s < at_s


# -- judgements ---------------------------------------------------------------------------------------------


class FakeExercises:
    """An exercise that is done half a second after its start."""

    def __init__(self) -> None:
        self.started: list[tuple[str, str, int]] = []
        self.wanted: list[Checked] = []
        self.closed = False

    def offered(self) -> list[dict[str, Any]]:
        return [{"id": "1", "title": "Read", "question": "Does it?", "next": ""}]

    def start(self, exercise: str, firmware: str, seed: int) -> None:
        if exercise != "1":
            raise InputError("unknown exercise")
        self.started.append((exercise, firmware, seed))

    def finished(self) -> list[Checked]:
        done, self.wanted = self.wanted, []
        return done

    def close(self) -> None:
        self.closed = True


PROBLEM = {
    "kind": "formula",
    "summary": "main.c:45: Bx3 is wrong",
    "details": [],
    "fatal": False,
    "data": {"fields": "Yaw"},
}


def checked_page(
    script: list[tuple[float, messages.PageCommand]], end_s: float
) -> tuple[Page, FakeExercises]:
    exercises = FakeExercises()

    def follow(event: SessionEvent) -> None:
        if isinstance(event, messages.State) and event.t_s > 1 and exercises.started and not page.of(Done):
            page.events.append(Done())
            exercises.wanted.append(Checked("1", "done", 3.0, 3.0, causes=[PROBLEM]))

    page = Page(Setup("solution", seed=4), script, end_s, on_event=follow, exercises=exercises)
    page.run()
    return page, exercises


class Done(SessionEvent):
    """A mark that the fake judge has returned its result."""


def test_exercise_is_checked_while_session_runs() -> None:
    page, exercises = checked_page([(0.2, messages.CheckCommand("1"))], 1.5)
    assert page.of(messages.Hello)[0].exercises == exercises.offered()
    assert exercises.started == [("1", "solution", 4)]
    assert [one.state for one in page.of(Checked)] == ["checking", "done"]
    assert page.of(messages.State)[-1].run == 1
    assert exercises.closed


def test_new_firmware_makes_result_outdated() -> None:
    script = [(0.2, messages.CheckCommand("1")), (1.3, messages.FirmwareCommand("lab3"))]
    page, _ = checked_page(script, 1.5)
    assert [(one.state, one.outdated) for one in page.of(Checked)][-1] == ("done", True)


def test_problem_found_by_check_belongs_to_its_firmware() -> None:
    script = [(0.2, messages.CheckCommand("1")), (5.0, messages.FirmwareCommand("lab3"))]
    page, _ = checked_page(script, 8.0)
    shown = [[one["summary"] for one in event.findings] for event in page.of(messages.Findings)]
    assert [PROBLEM["summary"]] in shown
    assert shown[-1] == []


def test_impossible_check_causes_notice() -> None:
    page, exercises = checked_page([(0.2, messages.CheckCommand("7"))], 0.5)
    assert exercises.started == []
    assert [one.kind for one in page.of(messages.Notice)] == ["error"]
    without = Page(Setup("solution"), [(0.2, messages.CheckCommand("1"))], 0.5)
    without.run()
    assert [one.kind for one in without.of(messages.Notice)] == ["error"]
