"""Reverse execution: a board returns to earlier states exactly, and its observers notice nothing."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from hashlib import sha256
from itertools import pairwise
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from fcu_emulator import Board
from fcu_emulator.emulator.chip.diagnosis.backtrace import CALLBACK
from fcu_emulator.emulator.chip.firmware import Limits
from fcu_emulator.emulator.chip.gdb.attach import serve
from fcu_emulator.emulator.chip.gdb.core_target import CoreTarget
from fcu_emulator.emulator.chip.gdb.target import HaltReason, Point, PointKind
from fcu_emulator.emulator.chip.history import History
from fcu_emulator.emulator.chip.memory_map import RAM, RAM_SIZE
from fcu_emulator.emulator.clock import PS_PER_MS, PS_PER_US, to_ps
from fcu_emulator.emulator.errors import FirmwareError
from fcu_emulator.emulator.trace import TerminalBytes, TraceEvent
from tests.support.arm.gdb_fakes import Client
from tests.support.arm.recorded_cases import CASES
from tests.support.arm.recording import board_of

NEVER_CALLED = "SVC_Handler"


State = tuple[object, ...]
PROGRAMS = [
    "solution-flat",
    "vendor-flight",
    "vendor-lab3-i2c-dma",
    "vendor-lab3-i2c-it-nack",
    "assembly-i2c-by-dma",
    "broken-faulting_handler",
]
"""Programs that poll, sleep, use interrupts and DMA, and fail."""


@dataclass
class Debugged:
    board: Board
    target: CoreTarget

    @property
    def now_ps(self) -> int:
        return self.board.clock.now_ps

    def state(self) -> State:
        """Return the time, the registers, a digest of the RAM, and the printed text."""
        ram = sha256(self.target.read_memory(RAM, RAM_SIZE)).hexdigest()
        return self.now_ps, self.target.read_registers(), ram, self.board.terminal.text

    def run_until(self, seconds: float) -> HaltReason | None:
        self.target.resume()
        stop = self.target.run_until_ps(to_ps(seconds))
        self.target.halt()
        return stop

    def run_for_us(self, us: int) -> HaltReason | None:
        self.target.resume()
        stop = self.target.run_until_ps(self.now_ps + us * PS_PER_US)
        self.target.halt()
        return stop

    def step(self) -> None:
        self.target.step()
        assert self.target.run_until_ps(self.now_ps + 10 * PS_PER_MS) is not None

    def back(self) -> HaltReason | None:
        return self.target.reverse_continue(lambda: False)

    def address_of(self, name: str) -> int:
        assert self.board.chip is not None
        assert self.board.chip.image.symbols is not None
        return self.board.chip.image.symbols.address_of(name) & ~1


@contextmanager
def debugged(board: Board) -> Iterator[Debugged]:
    chip = board.chip
    assert chip is not None
    target = CoreTarget(chip.core, board.clock, board.run_until_ps, lambda: History(board, chip))
    target.attach()
    yield Debugged(board, target)
    target.release()
    board.close()


# -- instructions -------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", [name for name in PROGRAMS if name in CASES])
@settings(max_examples=3, deadline=None, suppress_health_check=list(HealthCheck))
@given(part=st.floats(0.05, 0.95), steps=st.integers(1, 500))
def test_reverse_steps_return_to_each_state(name: str, part: float, steps: int) -> None:
    """Law: after n steps, n reverse steps lead through the same states, in reverse order."""
    case = CASES[name]
    with debugged(board_of(case)) as one:
        one.run_until(part * case.seconds)
        states = [one.state()]
        for _ in range(min(steps, 60)):
            one.step()
            states.append(one.state())
        for earlier in reversed(states[:-1]):
            assert one.target.reverse_step()
            assert one.state() == earlier


def test_reverse_step_ends_at_start_of_history() -> None:
    with debugged(Board("solution", ideal=True)) as one:
        begin = one.state()
        one.step()
        one.step()

        assert [one.target.reverse_step() for _ in range(3)] == [True, True, False]
        assert one.state() == begin


# -- breakpoints and watchpoints ----------------------------------------------------------------------------


def test_reverse_continue_finds_same_stops_in_reverse() -> None:
    """A breakpoint in the 800 Hz callback and watched stores of pitch."""
    with debugged(Board("solution", ideal=True)) as one:
        one.run_until(1.06)
        one.target.add(Point(PointKind.HARDWARE_BREAK, one.address_of(CALLBACK), 2))
        states = []
        while one.now_ps < to_ps(1.08):
            assert one.run_for_us(10_000) is not None
            states.append(one.state())
        found = []
        while one.now_ps > to_ps(1.06) and one.back() is not None:
            found.append(one.state())

        assert len(states) > 10
        assert found[: len(states) - 1] == states[-2::-1]


def test_reverse_continue_stops_before_watched_store() -> None:
    with debugged(Board("solution", ideal=True)) as one:
        one.board.world.set_attitude(0, 30, 0)
        one.run_until(2)
        address = one.address_of("pitch")
        one.target.add(Point(PointKind.WRITE, address, 4))
        value = one.board.variable("pitch")
        stop = one.back()
        before = one.state()
        one.step()

        assert stop is not None
        assert stop.address == address
        assert one.board.variable("pitch") == pytest.approx(value, abs=1)
        assert one.target.reverse_step()
        assert one.state() == before


def test_breakpoint_in_endless_loop_is_found_soon() -> None:
    """The loop reaches its breakpoint about four million times in a second."""
    with debugged(Board("template-arm", ideal=True)) as one:
        one.run_until(1.1)
        one.target.add(Point(PointKind.HARDWARE_BREAK, one.target.read_registers()["pc"], 2))
        one.run_for_us(200)
        end_ps = one.now_ps

        assert one.back() is not None
        assert end_ps - 100 * PS_PER_MS < one.now_ps < end_ps


def test_reverse_continue_without_stop_returns_to_start() -> None:
    with debugged(Board("solution", ideal=True)) as one:
        begin = one.state()
        one.run_until(1.2)
        one.target.add(Point(PointKind.HARDWARE_BREAK, one.address_of(NEVER_CALLED), 2))

        assert one.back() is None
        assert one.state() == begin


def test_interrupted_search_leaves_board_in_past() -> None:
    with debugged(Board("solution", ideal=True)) as one:
        one.run_until(2.1)

        assert one.target.reverse_continue(lambda: True) is None
        assert one.board.now_s == pytest.approx(2, abs=1e-6)


# -- inputs and observers -----------------------------------------------------------------------------------


def test_repeated_run_contains_all_inputs() -> None:
    """The run has inputs of the world, typed bytes, a pin and a variable; then the board repeats the whole run."""
    with debugged(Board("solution", ideal=True)) as one:
        board = one.board
        one.run_until(1.2)
        board.world.set_attitude(10, 40, 70)
        one.run_until(1.3)
        board.terminal.write("typed")
        one.run_until(1.4)
        board.press_button("PA0", seconds=0.05)
        one.run_until(1.5)
        one.target.write_memory(one.address_of("pitch"), b"\0\0\x80\x3f")
        one.run_until(2.6)
        present = one.state()
        while one.target.reverse_continue(lambda: False) is not None:
            pass
        assert one.board.now_s == 0
        one.run_until(2.6)

        assert one.state() == present
        assert one.target.take_remark() == ""


def test_observers_receive_repeated_events_once(tmp_path: Path) -> None:
    def outcome(back: bool) -> tuple[list[TraceEvent], str, bytes]:
        board = Board("solution", scenario="tilt_sweep", ideal=True)
        events: list[TraceEvent] = []
        board.trace.subscribe(events.append)
        file = tmp_path / f"{back}.jsonl"
        board.trace.write_to(file)
        link, position = b"", 0
        with debugged(board) as one:
            for end_s in (0.7, 1.3, 1.9, 2.5):
                one.run_until(end_s)
                one.target.add(Point(PointKind.WRITE, one.address_of("pitch"), 4))
                one.run_for_us(2_000)  # ends inside the callback, at a store
                one.target.remove(Point(PointKind.WRITE, one.address_of("pitch"), 4))
                link, position = link + board.terminal.since(position)[0], board.terminal.since(position)[1]
                if back:
                    for _ in range(3):
                        one.target.reverse_step()
                    one.back()  # without a breakpoint to the start
                    link += board.terminal.since(position)[0]
                    one.run_until(end_s - 0.2)
                    link += board.terminal.since(position)[0]
            one.run_until(2.6)
            link += board.terminal.since(position)[0]
        texts = [event for event in events if isinstance(event, TerminalBytes)]
        others = [event for event in events if not isinstance(event, TerminalBytes)]
        return others, b"".join(one.data for one in texts).decode("latin-1") + file.read_text(), link

    assert outcome(back=True) == outcome(back=False)


def test_events_before_halt_are_received_once() -> None:
    """The end of a bus transfer may be executed later, with the next event. The core halts before this event."""

    def outcome(back: bool) -> list[TraceEvent]:
        events: list[TraceEvent] = []
        with debugged(Board("solution", ideal=True)) as one:
            one.run_until(1.1)
            one.board.trace.subscribe(events.append)
            one.target.add(Point(PointKind.WRITE, one.address_of("pitch"), 4))
            for _ in range(5):
                assert one.run_for_us(2_000) is not None
                if back:
                    one.target.reverse_step()
                    one.step()
            one.target.remove(Point(PointKind.WRITE, one.address_of("pitch"), 4))
            one.run_until(1.2)
        return [event for event in events if not isinstance(event, TerminalBytes)]

    assert outcome(back=True) == outcome(back=False)


def test_change_in_past_discards_later_history() -> None:
    with debugged(Board("solution", ideal=True)) as one:
        one.run_until(1.5)
        one.board.world.set_attitude(0, 60, 0)
        one.run_until(2.5)
        position = one.board.terminal.since(0)[1]
        one.back()  # without a breakpoint to the start
        assert one.board.now_s == 0
        one.board.world.set_attitude(0, 20, 0)
        one.run_until(0.2)
        remark = one.target.take_remark()
        printed, position = one.board.terminal.since(position)
        one.run_until(2.5)
        later, _ = one.board.terminal.since(position)

        assert "2.5" in remark
        assert one.board.variable("pitch") == pytest.approx(20, abs=1)
        assert b"Pitch" in later
        assert (printed + later).startswith(b"STEVAL-FCU001V1")


def test_board_continues_from_past_after_detaching() -> None:
    board = Board("solution", ideal=True)
    with debugged(board) as one:
        one.run_until(2.5)
        printed, position = board.terminal.since(0)
        one.back()
        one.target.release()
        board.run_until(2.5)

        assert board.terminal.since(position)[0] == printed


def test_reverse_step_after_change_in_past_is_exact() -> None:
    with debugged(Board("solution", ideal=True)) as one:
        one.run_until(1.1)
        for _ in range(20):
            one.target.reverse_step()
        one.target.write_register("r12", 0x1234)
        changed = one.state()
        states = []
        for _ in range(20):
            one.step()
            states.append(one.state())
        for earlier in (*reversed(states[:-1]), changed):
            one.target.reverse_step()
            assert one.state() == earlier


# -- memory -------------------------------------------------------------------------------------------------


def test_long_run_has_bounded_number_of_snapshots() -> None:
    """The distance of two snapshots is at most a third of their age, or 250 ms."""
    with debugged(Board("template-arm", ideal=True)) as one:
        history = one.target._history
        assert history is not None
        one.run_until(20)
        times = [moment.at_ps for moment in reversed(history.moments_before(1 << 62))]

        assert times[0] == 0
        assert len(times) <= 56
        for earlier, later in pairwise(times):
            assert later - earlier <= max((one.now_ps - earlier) / 3, 251 * PS_PER_MS)


def test_many_inputs_shorten_history() -> None:
    with debugged(Board("template-arm", ideal=True)) as one:
        for number in range(100):
            one.board.world.set_attitude(0, number / 10, 0)
            one.run_for_us(10_000)
        history = one.target._history
        assert history is not None

        assert len(history.moments_before(1 << 62)) <= 56
        assert one.back() is None
        assert 0.4 < one.board.now_s < 1


def test_watchpoint_beside_polled_variable_costs_little_work() -> None:
    """The main loop polls the variable directly before the watched one, but the work of firmware is limited."""
    with debugged(Board("solution", ideal=True)) as one:
        one.run_until(1.1)
        before = one.board.chip.core.work if one.board.chip is not None else 0
        one.target.add(Point(PointKind.WRITE, one.address_of("pitch"), 4))
        while one.now_ps < to_ps(1.3):
            one.target.resume()
            one.target.run_until_ps(to_ps(1.3))
        work = one.board.chip.core.work - before if one.board.chip is not None else 0

        assert work < 100_000_000


# -- packets ------------------------------------------------------------------------------------------------


def test_server_answers_reverse_packets() -> None:
    board = Board("solution", ideal=True)
    server = serve(board, 0, halted=True)
    client = Client(server, lambda: server.run_until_ps(board.clock.now_ps + PS_PER_MS))
    features = client.ask(b"qSupported")

    assert {b"ReverseStep+", b"ReverseContinue+"} <= set(features.split(b";"))
    assert client.ask(b"bs") == b"T05replaylog:begin;thread:1;"
    assert client.ask(b"s").startswith(b"T05thread")
    assert client.ask(b"bs") == b"T05thread:1;"
    assert client.ask(b"bx") == b""
    assert client.ask(b"bc") == b"T05replaylog:begin;thread:1;"
    client.close()
    server.close()
    board.close()


# -- failures -------------------------------------------------------------------------------------------------


def test_board_returns_from_failure() -> None:
    """A limit ends the run. The states before the failure can be reached, and the run fails again."""
    board = Board("solution", ideal=True)
    assert board.chip is not None
    board.chip.limits = Limits(instructions=70_000_000)
    with debugged(board) as one:
        begin = one.state()
        with pytest.raises(FirmwareError):
            one.run_until(3)
        one.target.halt()
        failed_ps = one.now_ps

        assert one.target.reverse_step()
        assert one.now_ps < failed_ps
        assert one.back() is None
        assert one.state() == begin
        with pytest.raises(FirmwareError):
            one.run_until(3)
        assert one.now_ps >= failed_ps
