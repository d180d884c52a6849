"""A board of ``fcu web`` that another terminal moves and types to, and that a debugger halts."""

from __future__ import annotations

import re
import socket
import threading
import tomllib
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path

import pytest

from fcu_emulator.emulator.chip.gdb.packets import frame
from fcu_emulator.emulator.cli.move import MoveOptions, move
from fcu_emulator.emulator.cli.terminal import open_port
from fcu_emulator.emulator.clock import PS_PER_MS
from fcu_emulator.emulator.errors import InputError
from fcu_emulator.emulator.host.loopback import HOST
from fcu_emulator.emulator.links.control import ControlServer, the_running_board
from fcu_emulator.emulator.live import messages
from fcu_emulator.emulator.live.messages import SessionEvent
from fcu_emulator.emulator.live.session import LiveSession
from fcu_emulator.emulator.live.setup import Setup
from tests.support.live_fakes import do
from tests.support.words import Words

DEADLINE_S = 30.0


class Live:
    """A session at real time in a thread, with a control server, and its messages."""

    def __init__(self, setup: Setup) -> None:
        self.said: list[SessionEvent] = []
        self.heard = threading.Condition()
        self.session = LiveSession(setup, self._publish)
        self.session.attach(self)
        self._door = ControlServer("mine.elf", [], self.session.answer)
        self.session.control = self._door
        self._thread = threading.Thread(target=self.session.run)
        self._thread.start()

    def until_state(self, state: str) -> messages.StatusEvent:
        """Wait for the next status with this state."""

        def found() -> messages.StatusEvent | None:
            statuses = [one for one in self.said if isinstance(one, messages.StatusEvent)]
            return statuses[-1] if statuses and statuses[-1].state == state else None

        with self.heard:
            assert self.heard.wait_for(found, DEADLINE_S)
        status = found()
        assert status is not None
        return status

    def close(self) -> None:
        self.session.stop()
        self._thread.join(DEADLINE_S)
        self._door.close()

    def _publish(self, event: SessionEvent, client: object | None) -> None:
        del client
        with self.heard:
            self.said.append(event)
            self.heard.notify_all()


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Return a runtime folder for this test."""
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    monkeypatch.setenv("LOCALAPPDATA", str(tmp_path))


def live(setup: Setup) -> Iterator[Live]:
    one = Live(setup)
    yield one
    one.close()


@pytest.fixture
def board() -> Iterator[Live]:
    yield from live(Setup("solution", ideal=True))


@pytest.fixture
def debugged() -> Iterator[Live]:
    yield from live(Setup("solution", ideal=True, gdb=0))


class Debugger:
    """A client of GDB's protocol, without acknowledgements."""

    def __init__(self, session: LiveSession) -> None:
        (way,) = (line for line in session.ways() if line.startswith("gdb:"))
        self._socket = socket.create_connection((HOST, int(way.split(":")[-1])), DEADLINE_S)
        self._answers = self._socket.makefile("rb")
        self.ask(b"qSupported")

    def say(self, packet: bytes) -> None:
        self._socket.sendall(frame(packet))

    def ask(self, packet: bytes) -> bytes:
        self.say(packet)
        answer = b""
        while not answer.startswith(b"$"):
            answer = self._until(b"#").lstrip(b"+")
        self._answers.read(2)
        self._socket.sendall(b"+")
        return answer[1:-1]

    def close(self) -> None:
        self._answers.close()
        self._socket.close()

    def _until(self, end: bytes) -> bytes:
        read = b""
        while not read.endswith(end):
            byte = self._answers.read(1)
            assert byte
            read += byte
        return read


def test_motion_from_another_terminal_is_recorded(board: Live, capsys: pytest.CaptureFixture[str]) -> None:
    move(MoveOptions(roll=30.0))
    assert "mine.elf: moves from roll" in capsys.readouterr().out
    board.close()
    assert "follow_attitude" in board.session.recording.text()


def test_board_without_port_has_terminal(board: Live) -> None:
    where, port = open_port(None)
    assert "mine.elf" in where
    with closing(port):
        read = b""
        while b"Pitch:" not in read:
            data = port.read()
            assert data is not None
            read += data
        port.write(b"\x00\xffp" * 700)
    board.close()
    assert port.read() is None
    timeline = tomllib.loads(board.session.recording.text())["timeline"]
    assert bytes.fromhex("".join(entry["hex"] for entry in timeline)) == b"\x00\xffp" * 700


def test_unknown_control_message_gets_one_line_error(board: Live, words: Words) -> None:
    del board
    running = the_running_board()
    pause, nonsense, far = running.ask(
        {"type": "pause"}, {"type": "do", "entry": {"do": "fly"}}, {"type": "text", "position": 10**9}
    )
    words("move", pause["error"])
    assert "fly" in nonsense["error"]
    assert far["text"] == ""


def test_page_stays_connected_under_debugger(debugged: Live, words: Words) -> None:
    session = debugged.session
    debugged.until_state("running")
    with closing(Debugger(session)) as gdb:
        debugged.until_state("halted")
        at_ps = session.board.clock.now_ps
        assert len(gdb.ask(b"g")) > 100
        session.post(debugged, do(do="tap"))
        with pytest.raises(InputError) as refused:
            move(MoveOptions(roll=30.0))
        assert session.board.clock.now_ps == at_ps
        gdb.say(b"c")
        debugged.until_state("running")
    move(MoveOptions(roll=30.0))
    notices = [one.text for one in debugged.said if isinstance(one, messages.Notice)]
    assert notices == [str(refused.value)]
    words("gdb", notices[0])


def test_debugger_reconnects_at_same_port_after_reset(debugged: Live) -> None:
    session = debugged.session
    before = session.ways()
    with closing(Debugger(session)):
        debugged.until_state("halted")
        session.post(debugged, messages.Reset())
        debugged.until_state("running")
    assert session.ways() == before
    assert session.run_number == 2
    with closing(Debugger(session)):
        debugged.until_state("halted")
    debugged.until_state("running")


def test_paused_board_answers_debugger(debugged: Live) -> None:
    debugged.session.post(debugged, messages.Pause())
    debugged.until_state("paused")
    at_ps = debugged.session.board.clock.now_ps
    with closing(Debugger(debugged.session)) as gdb:
        assert gdb.ask(b"?").startswith(b"T")
    assert 0 <= debugged.session.board.clock.now_ps - at_ps < PS_PER_MS  # it stops between two instructions


def test_python_firmware_cannot_be_debugged() -> None:
    with pytest.raises(InputError) as refused:
        LiveSession(Setup("lab3", gdb=0), lambda _event, _client: None)
    assert refused.value.kind == "no_chip"


def test_halt_option_makes_firmware_wait_for_debugger(words: Words) -> None:
    one = Live(Setup("solution", gdb=0, halt=True))
    try:
        one.until_state("halted")
        assert one.session.board.clock.now_ps == 0
        words("gdb", re.sub(r":\d+", ":PORT", one.session.ways()[0]))
    finally:
        one.close()
