"""The debugger's socket: one client on 127.0.0.1, stopped time, and hostile clients."""

from __future__ import annotations

import socket
from collections.abc import Iterator

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fcu_emulator import Board
from fcu_emulator.emulator.chip.gdb.attach import serve
from fcu_emulator.emulator.chip.gdb.packets import LONGEST, Arrival, frame
from fcu_emulator.emulator.chip.gdb.server import GdbServer
from fcu_emulator.emulator.clock import PS_PER_MS
from fcu_emulator.emulator.errors import FirmwareError, InputError, LinkError
from fcu_emulator.emulator.links.runner import Runner
from tests.support.arm.gdb_fakes import START, Client, FakeTarget
from tests.support.words import Words

SLICE_PS = 100_000


class Bench:
    """A server with a target that only counts."""

    def __init__(self, halted: bool = False) -> None:
        self.target = FakeTarget()
        self.server = GdbServer(self.target, lambda command: f"<{command}>", 0, halted)
        self.clients: list[Client] = []

    def run(self) -> None:
        self.server.run_until_ps(self.target.now_ps + SLICE_PS)

    def call(self) -> Client:
        """Connect without sending data."""
        self.clients.append(Client(self.server, self.run))
        return self.clients[-1]

    def connect(self) -> Client:
        """Connect as GDB does: GDB first asks for the supported features."""
        client = self.call()
        client.ask(b"qSupported")
        return client

    def close(self) -> None:
        self.server.close()
        for client in self.clients:
            client.close()


@pytest.fixture
def bench() -> Iterator[Bench]:
    bench = Bench()
    yield bench
    bench.close()


def test_board_runs_without_debugger(bench: Bench) -> None:
    bench.run()

    assert bench.target.now_ps == SLICE_PS
    assert bench.server.port > 0


def test_new_debugger_is_served_after_first_disconnects(bench: Bench) -> None:
    """The server sees both events at the same time."""
    bench.connect().close()
    client = bench.connect()

    assert client.ask(b"?") == b"T05thread:1;"


def test_halted_board_waits_for_debugger() -> None:
    bench = Bench(halted=True)
    bench.run()
    client = bench.connect()

    assert client.ask(b"?") == b"T05thread:1;"
    assert bench.target.now_ps == 0
    client.send(frame(b"c"))
    bench.run()
    bench.run()
    assert bench.target.now_ps > 0
    bench.close()


def test_connecting_halts_board_and_time(bench: Bench) -> None:
    bench.run()
    client = bench.connect()
    came_ps = bench.target.now_ps
    for _ in range(3):
        assert client.ask(b"?") == b"T05thread:1;"

    assert bench.server.halted
    assert bench.target.now_ps == came_ps


def test_breakpoint_and_control_c_stop_running_board(bench: Bench) -> None:
    client = bench.connect()
    assert client.ask(b"Z0,%x,2" % (START + 8)) == b"OK"
    assert client.ask(b"c") == b"T05thread:1;"
    assert client.ask(b"z0,%x,2" % (START + 8)) == b"OK"
    client.send(frame(b"c"))
    bench.run()
    client.send(b"\x03")

    assert client.wait() == b"T02thread:1;"


def test_packets_are_acknowledged_until_no_ack_mode_starts(bench: Bench) -> None:
    client = bench.connect()
    client.raw = b""
    client.ask(b"qC")
    assert client.raw == b"+$QC1#c5"
    client.ask(b"QStartNoAckMode")
    client.raw = b""
    client.ask(b"qC")
    assert client.raw == b"$QC1#c5"


def test_corrupt_packet_and_lost_answer_are_repeated(bench: Bench) -> None:
    client = bench.connect()
    client.send(b"$qC#00")
    bench.run()
    assert client.wait() is Arrival.RESEND
    assert client.ask(b"qC") == b"QC1"
    client.send(b"-")
    assert client.wait() == b"QC1"


def test_too_long_packet_gets_error_answer(bench: Bench) -> None:
    client = bench.connect()
    client.send(b"$" + b"m" * (3 * LONGEST) + b"#00")

    assert client.wait() == b"E01"
    assert client.ask(b"qC") == b"QC1"


def test_monitor_commands_reach_board(bench: Bench) -> None:
    client = bench.connect()

    assert client.ask(b"qRcmd," + b"time".hex().encode()) == b"O" + b"<time>".hex().encode()
    assert client.wait() == b"OK"


def test_second_debugger_is_refused(bench: Bench) -> None:
    first, second = bench.connect(), bench.connect()

    assert second.wait() == b""
    assert first.ask(b"qC") == b"QC1"


@pytest.mark.parametrize("goodbye", [frame(b"D"), b""])
def test_disconnected_debugger_leaves_no_breakpoints(bench: Bench, goodbye: bytes) -> None:
    client = bench.connect()
    client.ask(b"Z0,%x,2" % START)
    client.send(goodbye)
    client.close()
    before_ps = bench.target.now_ps
    for _ in range(3):
        bench.run()

    assert bench.target.now_ps > before_ps
    assert not bench.target.points
    assert bench.connect().ask(b"?") == b"T05thread:1;"


def test_kill_packet_ends_run(bench: Bench) -> None:
    client = bench.connect()
    client.send(frame(b"k"))
    bench.run()
    before_ps = bench.target.now_ps
    bench.run()

    assert bench.server.killed
    assert bench.target.now_ps == before_ps


def test_waiting_debugger_gets_end_of_run(bench: Bench) -> None:
    client = bench.connect()
    client.send(frame(b"c"))
    bench.run()
    bench.server.close()
    client.turn = lambda: None

    assert client.wait() == b"W00"
    assert client.wait() == b""


def test_firmware_failure_reaches_debugger_or_caller() -> None:
    class Failing(FakeTarget):
        def run_until_ps(self, at_ps: int) -> None:
            raise FirmwareError("it broke")

    bench = Bench()
    bench.server.close()
    bench.server = GdbServer(Failing(), str, 0)
    with pytest.raises(FirmwareError):
        bench.run()
    bench.server.close()
    bench.server = GdbServer(Failing(), str, 0, halted=True)
    client = bench.connect()

    assert client.ask(b"c") == b"O" + b"it broke\n".hex().encode()
    assert client.wait() == b"T0bthread:1;"
    bench.close()


@settings(max_examples=25)
@given(st.lists(st.one_of(st.binary(max_size=300), st.binary(max_size=50).map(frame)), max_size=8))
def test_server_survives_any_data_from_client(pieces: list[bytes]) -> None:
    bench = Bench()
    client = bench.connect()
    client.send(b"".join(pieces))
    for _ in range(2):
        bench.run()
    client.close()
    bench.run()

    assert bench.server.killed or bench.connect().ask(b"qC") == b"QC1"
    bench.close()


def test_port_in_use_is_refused_in_one_line(bench: Bench) -> None:
    with pytest.raises(LinkError, match=f"--gdb {bench.server.port}: ") as caught:
        GdbServer(FakeTarget(), str, bench.server.port)
    assert caught.value.kind == "port_not_free"
    assert "\n" not in str(caught.value)


def test_server_listens_on_this_machine_only(bench: Bench) -> None:
    with socket.socket() as elsewhere, pytest.raises(OSError, match="refused"):
        elsewhere.connect(("127.0.0.2", bench.server.port))


# -- with a board -------------------------------------------------------------------------------------------

CALLBACK = "HAL_TIM_PeriodElapsedCallback"


def _built(**settings: bool) -> Board:
    return Board(firmware="solution", **settings)


def test_python_firmware_cannot_be_debugged() -> None:
    with pytest.raises(InputError) as caught:
        serve(Board(firmware="lab3"), 0)
    assert caught.value.kind == "no_chip"


def test_debugger_does_not_change_run() -> None:
    """The run is the same without a debugger, with a debugger that only continues, and with stops at every callback."""
    end_ps = 1_080 * PS_PER_MS

    def outcome(stops: bool | None) -> tuple[bytes, int, int]:
        board = _built()
        assert board.chip is not None
        server = serve(board, 0, halted=stops is not None)
        if stops is not None:
            client = Client(server, lambda: server.run_until_ps(min(board.clock.now_ps + PS_PER_MS, end_ps)))
            if stops:
                assert board.chip.image.symbols is not None
                client.ask(b"Z1,%x,2" % board.chip.image.symbols.address_of(CALLBACK))
            count = 0
            client.send(frame(b"c"))
            while board.clock.now_ps < end_ps:
                server.run_until_ps(end_ps)
                if server.halted:
                    count += 1
                    client.send(frame(b"c"))
            assert count > 10 if stops else count == 0
            client.close()
        server.run_until_ps(end_ps)
        server.close()
        return board.terminal.since(0)[0], board.chip.core.retired, len(board.trace)

    free = outcome(stops=None)
    assert b"ACC" in free[0]
    assert outcome(stops=False) == free
    assert outcome(stops=True) == free


def test_wall_time_while_halted_does_not_count() -> None:
    class Debugger:
        def __init__(self) -> None:
            self.turns = 0
            self.halted = False

        @property
        def killed(self) -> bool:
            return self.turns == 6

        def run_until_ps(self, at_ps: int) -> None:
            self.turns += 1
            self.halted = self.turns > 2

    debugger = Debugger()
    runner = Runner(Board(), [], PS_PER_MS, None, lambda _: "", lambda: 10.0 * debugger.turns, debugger)
    runner.run()

    assert runner.stopped
    assert debugger.turns == 6
    assert runner.wall_s == 20.0


@pytest.mark.parametrize(
    ("command", "answer"),
    [
        ("attitude", "roll 0.000 deg, pitch 0.000 deg, yaw 0.000 deg\n"),
        ("attitude 10 -20 30", "roll 10.000 deg, pitch -20.000 deg, yaw 30.000 deg\n"),
        ("attitude 10 north 30", "ROLL PITCH YAW"),
        ("time", "0.000000000 s\n"),
        ("reset halt", "halted\n"),
        ("regs nothing", "'nothing'"),
        ("regs rcc", "CR         0x00000083\n"),
        ("regs gpiob", "MODER      0x00000280\n"),
        ("fly", "'fly'"),
    ],
)
def test_monitor_command_prints_expected_text(command: str, answer: str, words: Words) -> None:
    board = Board(firmware="solution")
    server = serve(board, 0, halted=True)
    client = Client(server, lambda: server.run_until_ps(0))
    reply = client.ask(b"qRcmd," + command.encode().hex().encode())
    client.close()
    server.close()

    assert isinstance(reply, bytes)
    text = bytes.fromhex(reply[1:].decode()).decode()
    assert answer in text
    words("gdb", text.splitlines()[0])


def test_where_command_prints_function_and_line() -> None:
    board = Board(firmware="solution")
    server = serve(board, 0, halted=True)
    client = Client(server, lambda: server.run_until_ps(0))

    def where() -> str:
        reply = client.ask(b"qRcmd," + b"where".hex().encode())
        assert client.wait() == b"OK"
        assert isinstance(reply, bytes)
        return bytes.fromhex(reply[1:].decode()).decode()

    assert " in Reset_Handler at startup_stm32f401xc.c:" in where()
    client.ask(b"vFlashWrite:08000200:abcd")
    assert " in " not in where()
    client.close()
    server.close()


# -- who is a debugger --------------------------------------------------------------------------------------

REQUEST = b"POST /x HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Length: 9\r\n\r\n"
STRANGERS = [
    REQUEST + frame(b"k"),
    b"GET / HTTP/1.1\r\n\r\n",
    b"\x16\x03\x01\x02\x00\x01\x00",  # TLS
    b"SSH-2.0-x\r\n",
    b"+" + REQUEST + frame(b"k"),
    b"\x00",
    b"$k#00",  # a wrong checksum
    b"$" + b"k" * (LONGEST + 1) + b"#00",
]


@pytest.mark.parametrize("halted", [False, True])
@pytest.mark.parametrize("said", STRANGERS)
def test_non_debugger_client_is_disconnected_without_effect(said: bytes, halted: bool) -> None:
    bench = Bench(halted)
    stranger = bench.call()
    stranger.send(said)
    began_ps = bench.target.now_ps
    for _ in range(5):
        bench.run()

    assert bench.server.halted is halted
    assert not bench.server.killed
    assert bench.target.now_ps == began_ps + (0 if halted else 5 * SLICE_PS)
    assert bench.connect().ask(b"?") == b"T05thread:1;"
    bench.close()


def test_halted_board_ignores_connections_without_data() -> None:
    bench = Bench(halted=True)
    for _ in range(1000):
        bench.call().close()
        bench.run()

    assert bench.server.halted
    assert bench.target.now_ps == 0
    bench.close()


def test_silent_connection_blocks_nothing(bench: Bench) -> None:
    silent = [bench.call() for _ in range(20)]
    began_ps = bench.target.now_ps
    bench.run()
    assert bench.target.now_ps == began_ps + SLICE_PS

    silent[-1].send(b"+")
    bench.run()
    assert bench.target.now_ps == began_ps + 2 * SLICE_PS
    assert bench.connect().ask(b"?") == b"T05thread:1;"


def test_packet_may_come_in_pieces(bench: Bench) -> None:
    client = bench.call()
    for byte in b"+" + frame(b"?"):
        assert not bench.server.halted
        client.send(bytes((byte,)))
        bench.run()
    assert bench.server.halted
