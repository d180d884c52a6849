"""Times of the messages to a page, on a wall clock that the test owns and reads every millisecond."""

from __future__ import annotations

import itertools
import math
from pathlib import Path
from typing import Any

import pytest

from fcu_emulator import Board
from fcu_emulator.emulator.live import messages, view
from fcu_emulator.emulator.live.broadcast import Broadcast
from fcu_emulator.emulator.live.messages import SessionEvent, Watch
from fcu_emulator.emulator.python_cpu.hal import VirtualHal
from tests.support.scenario_files import SHORT, write

HISTORY = 64 << 10
PAGE = "page"


class Sent:
    """A broadcast with one page, and its messages: (wall time in ms, message, client)."""

    def __init__(self, board: Board, watch: Watch | None = None) -> None:
        self.board = board
        self.clients: dict[object, Watch] = {PAGE: watch or Watch()}
        self.wall_ms = 0
        self.events: list[tuple[int, SessionEvent, object | None]] = []
        self.broadcast = Broadcast(board, 1, self._publish, self.clients, self.wall_s)

    @property
    def wall_s(self) -> float:
        return 100.0 + self.wall_ms / 1000

    def pass_ms(self, duration: int, every: int = 1, changed: bool = False, speed: float = 0.0) -> None:
        """Let this wall time pass, with a poll each ``every`` ms; the board runs at ``speed``."""
        for _ in range(duration // every):
            self.wall_ms += every
            if speed:
                self.board.run_for(speed * every / 1000)
            self.broadcast.changed |= changed or speed > 0
            self.broadcast.show(self.wall_s, running=speed > 0)

    def of(self, kind: type[Any]) -> list[tuple[int, Any]]:
        return [(at_ms, event) for at_ms, event, _ in self.events if isinstance(event, kind)]

    def times(self, kind: type[Any]) -> list[int]:
        return [at_ms for at_ms, _ in self.of(kind)]

    def _publish(self, event: SessionEvent, client: object | None) -> None:
        self.events.append((self.wall_ms, event, client))


def gaps(times: list[int]) -> list[int]:
    return [new - old for old, new in itertools.pairwise(times)]


@pytest.fixture
def sent() -> Sent:
    return Sent(Board("lab3", ideal=True))


# -- frames -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("every", [2, 7, 15])
def test_state_is_sent_every_20_ms_during_changes(sent: Sent, every: int) -> None:
    """The average is kept with rarer polls, too: a late poll does not delay the next frame."""
    sent.pass_ms(2100, every, changed=True)

    assert len(sent.of(messages.State)) == pytest.approx(105, abs=2)
    assert max(gaps(sent.times(messages.State))) <= 20 + every


def test_slow_machine_sends_one_state_per_poll(sent: Sent) -> None:
    """A slow machine does not send more frames later to catch up."""
    sent.pass_ms(500, 50, changed=True)
    assert sent.times(messages.State) == list(range(50, 501, 50))
    sent.pass_ms(60, changed=True)

    assert sent.times(messages.State)[10:] == pytest.approx([510, 530, 550], abs=1)


def test_idle_state_is_sent_at_2_hz(sent: Sent) -> None:
    sent.pass_ms(2500)

    assert gaps(sent.times(messages.State)) == pytest.approx([510] * 4, abs=3)


@pytest.mark.parametrize(("after_ms", "shown_ms"), [(1, 5), (4, 5), (8, 9), (18, 19)])
def test_command_result_is_sent_5_ms_after_state(sent: Sent, after_ms: int, shown_ms: int) -> None:
    sent.pass_ms(100, changed=True)
    while sent.times(messages.State)[-1] != sent.wall_ms:
        sent.pass_ms(1, changed=True)
    state_ms = sent.wall_ms
    sent.pass_ms(after_ms, changed=True)
    sent.broadcast.answer(7)
    assert sent.broadcast.frame_in_s(sent.wall_s) == pytest.approx((5 - after_ms) / 1000, abs=1e-6)
    sent.pass_ms(20, changed=True)

    shown = [at_ms for at_ms, state in sent.of(messages.State) if state.done == 7]
    assert shown[0] - state_ms == pytest.approx(shown_ms, abs=1)


def test_wait_for_frame_depends_on_changes_and_clients(sent: Sent) -> None:
    sent.pass_ms(100, changed=True)
    last_ms = sent.times(messages.State)[-1]

    in_ms = sent.broadcast.frame_in_s(sent.wall_s) * 1000
    assert in_ms == pytest.approx(last_ms + 20 - sent.wall_ms, abs=1)
    sent.pass_ms(50)
    assert sent.broadcast.frame_in_s(sent.wall_s) == math.inf
    sent.broadcast.changed = True
    assert sent.broadcast.frame_in_s(sent.wall_s) < 0
    sent.clients.clear()
    assert sent.broadcast.frame_in_s(sent.wall_s) == math.inf


# -- registers, bus and pins; verdicts; findings ------------------------------------------------------------


@pytest.mark.parametrize("kind", [messages.BusEvent, messages.Pins])
def test_bus_and_pins_are_sent_every_100_ms(sent: Sent, kind: type[SessionEvent]) -> None:
    sent.clients[PAGE] = Watch(bus=True, pins=True)
    sent.pass_ms(1050)

    assert gaps(sent.times(kind)) == pytest.approx([100] * 10, abs=1)


def test_registers_are_sent_every_100_ms_if_changed() -> None:
    sent = Sent(Board("solution"), Watch(registers="LSM6DSL"))
    sent.board.run_for(1.5)
    sent.pass_ms(250)
    assert sent.times(messages.RegistersEvent) == [1]
    sent.pass_ms(500, speed=1)
    assert gaps(sent.times(messages.RegistersEvent))[-4:] == pytest.approx([100] * 4, abs=1)
    sent.pass_ms(150)
    quiet = len(sent.of(messages.RegistersEvent))
    sent.pass_ms(150)
    assert len(sent.of(messages.RegistersEvent)) == quiet
    sent.broadcast.look_again()
    sent.pass_ms(1)

    assert sent.times(messages.RegistersEvent)[-1] == sent.wall_ms
    assert [event.part["name"] for _, event in sent.of(messages.Declared)] == ["LSM6DSL"] * 2


def test_verdicts_are_sent_every_500_ms(tmp_path: Path) -> None:
    led = '[[expect]]\nkind = "led"\nled = "led1"\nstate = "off"\nfrom = "{0}ms"\nto = "{1}ms"\n'
    text = SHORT + led.format(100, 200) + led.format(400, 500)
    sent = Sent(Board("lab3", scenario=write(tmp_path, text)))
    sent.pass_ms(100)
    sent.board.run_for(0.3)
    sent.pass_ms(500)
    sent.board.run_for(0.3)
    sent.pass_ms(600)

    states = [
        (at_ms, [one["state"] for one in event.verdicts]) for at_ms, event in sent.of(messages.Verdicts)
    ]
    assert [state for _, state in states] == [["open", "open"], ["met", "open"], ["met", "met"]]
    assert [at_ms for at_ms, _ in states] == pytest.approx([1, 501, 1001], abs=1)


def test_findings_are_sent_every_2_s() -> None:
    sent = Sent(Board("solution"))
    assert sent.board.chip is not None
    sent.pass_ms(10)
    for _ in range(2):
        sent.board.chip.core.request_reset("IWDG")
        sent.board.run_for(1.1)
        sent.pass_ms(2100, 10)

    assert [[one["kind"] for one in event.findings] for _, event in sent.of(messages.Findings)] == [
        ["reset"]
    ] * 2
    assert sent.times(messages.Findings) == pytest.approx([2001, 4001], abs=20)


# -- pace ---------------------------------------------------------------------------------------------------


def test_pace_is_measured_over_preceding_second() -> None:
    sent = Sent(Board("lab3", ideal=True))
    sent.pass_ms(1010, speed=0.5)
    sent.pass_ms(1100, speed=0.25)
    paces = [(at_ms, state.pace) for at_ms, state in sent.of(messages.State)]
    changes = [new for old, new in itertools.pairwise(paces) if new[1] != old[1]]
    sent.pass_ms(600)

    assert paces[0][1] == 0
    assert [pace for _, pace in changes] == pytest.approx([0.5, 0.25], abs=0.01)
    assert [at_ms for at_ms, _ in changes] == pytest.approx([1011, 2011], abs=5)
    assert sent.of(messages.State)[-1][1].pace == 0


def test_pace_is_measured_from_run_start() -> None:
    sent = Sent(Board("lab3", ideal=True))
    sent.pass_ms(3000)
    sent.broadcast.measure_pace(sent.wall_s)
    sent.pass_ms(1040, speed=0.5)

    assert sent.of(messages.State)[-1][1].pace == pytest.approx(0.5, abs=0.001)


# -- text ---------------------------------------------------------------------------------------------------


class Loud:
    """Firmware in Python that once prints more text than a new page receives."""

    def __init__(self, hal: VirtualHal) -> None:
        self._hal = hal

    def main(self) -> None:
        """Run the firmware's main function, as in C."""
        self._hal.HAL_UART_Transmit(bytes(n % 251 for n in range(HISTORY + 5000)), 10_000)

    def HAL_TIM_PeriodElapsedCallback(self) -> None:
        """The timer is not used."""


def test_new_page_gets_latest_64_kib_only_once() -> None:
    sent = Sent(Board(Loud))
    sent.clients.clear()
    sent.board.run_for(7)
    sent.pass_ms(10, changed=True)
    sent.clients[PAGE] = Watch()
    sent.events.clear()
    sent.broadcast.greet(PAGE, view.hello(sent.board, [], []), status(sent.board))
    sent.pass_ms(100, changed=True)

    ((_, event, client),) = (one for one in sent.events if isinstance(one[1], messages.Text))
    assert isinstance(event, messages.Text)
    assert client == PAGE
    assert event.position == 5000
    assert event.text.encode("latin-1") == bytes(n % 251 for n in range(5000, HISTORY + 5000))


def status(board: Board) -> messages.StatusEvent:
    """Return a page's status, which these tests do not read."""
    return messages.StatusEvent(
        run=1,
        firmware="",
        file="",
        sources={},
        wiring=board.booted.wiring.name,
        scenario="",
        question="",
        duration_s=0.0,
        state="running",
        speed=1.0,
        problem="",
        notes=[],
        variables=[],
        peripherals=[],
        recording="",
    )
