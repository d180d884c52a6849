"""The TCP links with real readers: sockets, pyserial's ``socket://`` and ``rfc2217://``, PuTTY's plink."""

from __future__ import annotations

import contextlib
import random
import re
import shutil
import socket
import subprocess
import threading
import time
from collections.abc import Callable, Iterator

import pytest
import serial

from fcu_emulator import Board
from fcu_emulator.emulator.errors import LinkError
from fcu_emulator.emulator.links import ByteLink, open_link, tcp
from fcu_emulator.emulator.links.rfc2217 import Rfc2217Link
from fcu_emulator.emulator.links.runner import Runner
from fcu_emulator.emulator.links.tcp import TcpLink
from tests.support.words import Words

pytestmark = pytest.mark.filterwarnings("ignore:set(Daemon|Name)\\(:DeprecationWarning")  # pyserial 3.5

ALL_BYTES = bytes(range(256))
BOOT = b"STEVAL-FCU001V1 FH rev.1.0 - Sep 2017\n\n"  # the lab's text
DEADLINE_S = 30.0
IAC = 255
MIB = 1024 * 1024


@pytest.fixture(params=["tcp:0", "rfc2217:0"])
def link(request: pytest.FixtureRequest) -> Iterator[TcpLink]:
    link = open_link(request.param)
    assert isinstance(link, TcpLink)
    yield link
    link.close()


@pytest.fixture
def raw() -> Iterator[TcpLink]:
    with contextlib.closing(TcpLink(0)) as link:
        yield link


@pytest.fixture
def said() -> list[str]:
    return []


@pytest.fixture
def rfc2217(said: list[str]) -> Iterator[Rfc2217Link]:
    with contextlib.closing(Rfc2217Link(0, lambda: 115_226.3, said.append)) as link:
        yield link


class Served:
    """A link that a thread polls all the time, as a running board does."""

    def __init__(self, link: TcpLink) -> None:
        self.typed = bytearray()
        self._link = link
        self._outgoing: list[bytes] = []
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._run)

    def __enter__(self) -> Served:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._over.set()
        self._thread.join(DEADLINE_S)

    def print(self, data: bytes) -> None:
        self._outgoing.append(data)

    def _run(self) -> None:
        while not self._over.wait(0.001):
            self._link.send(self._outgoing.pop(0) if self._outgoing else b"")
            self.typed += self._link.receive(1 << 20)


def url(link: TcpLink) -> str:
    return f"{'socket' if link.kind == 'tcp' else 'rfc2217'}://127.0.0.1:{link.port}"


@contextlib.contextmanager
def terminal(link: TcpLink, baud: int = 115_200) -> Iterator[serial.Serial]:
    with serial.serial_for_url(url(link), baud, timeout=DEADLINE_S) as device:
        yield device


def opened(link: TcpLink) -> socket.socket:
    """Open a reader of a board that runs in its own thread, because only this thread may call the link."""
    return socket.create_connection(("127.0.0.1", link.port), timeout=DEADLINE_S)


@contextlib.contextmanager
def connected(link: TcpLink) -> Iterator[socket.socket]:
    with opened(link) as connection:
        link.send(b"")  # the board notices
        yield connection


def until(condition: Callable[[], bool]) -> None:
    give_up_s = time.monotonic() + DEADLINE_S
    while not condition():
        assert time.monotonic() < give_up_s
        time.sleep(0.001)  # the others' turn


def exactly(connection: socket.socket, count: int) -> bytes:
    got = bytearray()
    while len(got) < count and (data := connection.recv(count - len(got))):
        got += data
    return bytes(got)


def collect(link: TcpLink, count: int) -> bytes:
    got = bytearray()

    def more() -> bool:
        got.extend(link.receive(1 << 20))
        return len(got) >= count

    until(more)
    return bytes(got)


# -- what every reader may rely on --------------------------------------------------------------------------


def test_all_byte_values_pass_both_ways(link: TcpLink) -> None:
    with Served(link) as board, terminal(link) as device:
        board.print(ALL_BYTES)
        device.write(ALL_BYTES)
        assert device.read(256) == ALL_BYTES
        until(lambda: len(board.typed) >= 256)
        assert board.typed == ALL_BYTES
    assert link.report() == []


def test_large_data_are_sent_both_ways_without_loss(link: TcpLink) -> None:
    size = MIB if link.kind == "tcp" else 50_000  # pyserial's Telnet takes seconds for a mebibyte
    data = random.Random(1).randbytes(size)
    with Served(link) as board, terminal(link) as device:
        board.print(data)
        assert device.read(size) == data
        device.write(data)
        until(lambda: len(board.typed) >= size)
        assert board.typed == data
    assert link.report() == []


def test_mebibyte_passes_rfc2217_both_ways_without_loss(rfc2217: Rfc2217Link) -> None:
    """RFC 854: 255 is sent twice, and commands have three bytes of which the first is 255."""
    data = random.Random(1).randbytes(MIB)
    doubled = data.replace(b"\xff", b"\xff\xff")
    with Served(rfc2217) as board, opened(rfc2217) as connection:
        board.print(data)
        greeting = exactly(connection, 3)
        while greeting[-3] == IAC and greeting[-2] != IAC:
            greeting += exactly(connection, 3)
        assert greeting[-3:] + exactly(connection, len(doubled) - 3) == doubled
        connection.sendall(doubled)
        until(lambda: len(board.typed) >= MIB)
        assert board.typed == data
    assert rfc2217.report() == []


def test_text_before_first_reader_is_kept(link: TcpLink) -> None:
    link.send(BOOT)
    with Served(link), terminal(link) as device:
        assert device.read(len(BOOT)) == BOOT


def only_report(link: TcpLink, *numbers: int) -> str:
    """Return the only line of a link's report, with placeholders for its port and for varying numbers."""
    (line,) = link.report()
    line = line.replace(f"{link.kind}:{link.port}", "PORT")
    for number in numbers:
        line = re.sub(rf"\b{number}\b", "COUNT", line)
    return line


def test_reader_may_disconnect_and_reconnect(link: TcpLink, words: Words) -> None:
    with Served(link) as board:
        with terminal(link) as device:
            board.print(b"hello")
            assert device.read(5) == b"hello"
        until(lambda: not link._readers)
        board.print(b"nobody hears this")
        until(lambda: link.report() != [])
        with terminal(link) as device:
            board.print(b"welcome back")
            assert device.read(12) == b"welcome back"
    words("run", only_report(link))
    assert link.undelivered() == 0


def test_two_readers_share_text_and_typing(link: TcpLink) -> None:
    with Served(link) as board, terminal(link) as first, terminal(link) as second:
        first.write(b"a")
        until(lambda: board.typed == b"a")
        second.write(b"b")
        until(lambda: board.typed == b"ab")
        board.print(b"both")
        assert first.read(4) == second.read(4) == b"both"


# -- raw TCP: bounds, and what is counted -------------------------------------------------------------------


def test_bytes_sent_before_closing_arrive(raw: TcpLink) -> None:
    with connected(raw) as connection:
        connection.sendall(b"reset\r")
    assert collect(raw, 6) == b"reset\r"


def test_newest_mebibyte_is_kept_before_first_reader(raw: TcpLink, words: Words) -> None:
    data = random.Random(4).randbytes(3_000_000)
    raw.send(data)
    told = only_report(raw)
    assert told.count(f" {len(data) - MIB} ") == 1
    words("run", told)
    with connected(raw) as connection, Served(raw):
        assert exactly(connection, MIB) == data[-MIB:]


def test_bytes_of_stopped_reader_are_delivered_or_counted(raw: TcpLink, words: Words) -> None:
    total = 40 * MIB
    with connected(raw) as connection:
        for _ in range(40):
            raw.send(bytes(MIB))  # nobody reads, and the board goes on
        lost = raw.undelivered()
        assert 0 < lost < total - tcp.BACKLOG_LIMIT
        with Served(raw):
            assert len(exactly(connection, total - lost)) == total - lost
    words("run", only_report(raw, lost))


def test_stopped_reader_does_not_affect_other_reader(raw: TcpLink) -> None:
    data = random.Random(5).randbytes(20 * MIB)
    with connected(raw), connected(raw) as reads, Served(raw) as board:
        for start in range(0, len(data), MIB):
            board.print(data[start : start + MIB])
        assert exactly(reads, len(data)) == data


def test_writer_waits_if_faster_than_board(raw: TcpLink) -> None:
    with connected(raw) as connection:
        connection.setblocking(False)
        sent = 0
        with contextlib.suppress(BlockingIOError):
            while True:
                sent += connection.send(bytes(65_536))
                raw.send(b"")
        assert collect(raw, sent) == bytes(sent)


def test_unread_bytes_of_reader_are_counted(raw: TcpLink, words: Words) -> None:
    with connected(raw):
        raw.send(bytes(16 * MIB))
    until(lambda: raw.send(b"") is None and raw.report() != [])
    words("run", only_report(raw, int(raw.report()[0].split()[1])))
    assert raw.undelivered() == 0


def test_ninth_reader_is_refused_and_reported(raw: TcpLink, words: Words) -> None:
    with contextlib.ExitStack() as stack:
        for _ in range(8):
            stack.enter_context(connected(raw))
        with connected(raw) as ninth:
            assert ninth.recv(1) == b""
    words("run", only_report(raw))


def test_flush_lets_reader_take_everything_before_close(raw: TcpLink) -> None:
    data = random.Random(6).randbytes(8 * MIB)
    got = bytearray()
    with connected(raw) as connection:
        reader = threading.Thread(target=lambda: got.extend(exactly(connection, len(data) + 1)))
        reader.start()
        raw.send(data)
        raw.flush(DEADLINE_S)
        raw.close()
        reader.join(DEADLINE_S)
    assert got == data
    assert raw.report() == []


def test_flush_times_out_on_stopped_reader(raw: TcpLink) -> None:
    with connected(raw):
        raw.send(bytes(16 * MIB))
        raw.flush(0.05)
        raw.close()
    assert raw.undelivered() > 0


def test_closed_link_is_silent(link: TcpLink) -> None:
    link.close()
    link.close()
    link.send(BOOT)
    link.flush(1.0)
    assert link.receive(1 << 20) == b""
    assert link.report() == []


def test_only_this_machine_can_connect(raw: TcpLink) -> None:
    assert raw._listener.getsockname()[0] == "127.0.0.1"


def test_error_for_busy_port_shows_remedy(raw: TcpLink) -> None:
    with pytest.raises(LinkError, match=rf"^--serial tcp:{raw.port}: .*127\.0\.0\.1") as refused:
        open_link(f"tcp:{raw.port}")
    assert refused.value.kind == "port_not_free"


def test_second_board_takes_next_port() -> None:
    with contextlib.closing(TcpLink()) as first, contextlib.closing(TcpLink()) as second:
        assert tcp.FIRST_PORT <= first.port < second.port < tcp.FIRST_PORT + tcp.PORTS_TRIED


# -- RFC 2217 -----------------------------------------------------------------------------------------------


def test_baud_rate_within_tolerance_is_not_reported(rfc2217: Rfc2217Link, said: list[str]) -> None:
    with Served(rfc2217) as board, terminal(rfc2217) as device:
        board.print(b"x")
        assert device.read(1) == b"x"
    assert said == []


def test_wrong_baud_rate_is_reported_once(rfc2217: Rfc2217Link, said: list[str], words: Words) -> None:
    with Served(rfc2217) as board, terminal(rfc2217, 9600) as device:
        for _ in range(3):
            board.print(b"x")
            assert device.read(1) == b"x"  # and the text stays readable
    assert said == rfc2217.report()
    assert re.findall(r" (\d+)\b", said[0]) == ["9600", "115226"]
    words("run", only_report(rfc2217))


@pytest.mark.parametrize(
    "hostile",
    [
        b"\xff\xfa" + bytes(100_000),  # an option without an end
        b"\xff\xf0",  # an end without an option
        b"\xff\xfa\x2c\x01\x00\xff\xf0",  # a rate of one byte
        b"\xff\xfa\x2c\x03\xee\xff\xf0",  # no such parity
        b"\xff\xfa\x2c\x0a\xff\xf0",  # a mask of no byte
    ],
)
def test_only_client_with_broken_telnet_is_disconnected(rfc2217: Rfc2217Link, hostile: bytes) -> None:
    with Served(rfc2217) as board, terminal(rfc2217) as device, opened(rfc2217) as stranger:
        with contextlib.suppress(OSError):
            stranger.sendall(hostile)
        with contextlib.suppress(OSError):
            while stranger.recv(4096):
                pass
        board.print(b"well")
        assert device.read(4) == b"well"


def test_random_telnet_streams_do_no_harm(rfc2217: Rfc2217Link) -> None:
    draw = random.Random(7)
    alphabet = b"\xff\xff\xfa\xf0\xfb\xfc\xfd\xfe\x2c\x01\x02\x03\x05\x0a\x0b\x0c\x00\x01x"
    for _ in range(1000):
        coding = rfc2217.coding()
        with contextlib.suppress(ValueError):
            for _ in range(4):
                typed, answer = coding.decode(bytes(draw.choices(alphabet, k=50)))
                assert len(typed) <= 50
                assert len(answer) <= 50 * 20


@pytest.mark.parametrize(("baud", "usual"), [(115_200, True), (9600, False)])
def test_baud_rate_is_compared_with_firmware_usart(baud: int, usual: bool) -> None:
    board = Board(firmware="solution")
    board.run_for(0.5)  # it has set up its USART: 84 MHz / 729
    assert board.terminal.uart.bit_rate == pytest.approx(84e6 / 729)
    said: list[str] = []
    with contextlib.closing(
        open_link("rfc2217:0", lambda: board.terminal.uart.bit_rate, said.append)
    ) as link:
        assert isinstance(link, Rfc2217Link)
        done = threading.Event()

        def read() -> None:
            with terminal(link, baud) as device:
                device.read_until(b"\n")
            done.set()

        reader = threading.Thread(target=read)
        reader.start()
        runner = Runner(board, [link], None, 1.0)
        runner.run(lambda _: runner.stop() if done.is_set() else None)
        reader.join(DEADLINE_S)
    assert (said == []) is usual


# -- programs -----------------------------------------------------------------------------------------------


@pytest.mark.skipif(shutil.which("plink") is None, reason="PuTTY's plink is not installed")
def test_plink_reads_and_types_all_byte_values(raw: TcpLink) -> None:
    command = ["plink", "-batch", "-raw", "-P", str(raw.port), "127.0.0.1"]
    with (
        Served(raw) as board,
        subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE) as plink,
    ):
        assert plink.stdin is not None
        assert plink.stdout is not None
        board.print(ALL_BYTES)
        assert plink.stdout.read(256) == ALL_BYTES
        plink.stdin.write(ALL_BYTES)
        plink.stdin.flush()
        until(lambda: len(board.typed) >= 256)
        assert board.typed == ALL_BYTES
        plink.terminate()


# -- files --------------------------------------------------------------------------------------------------


def file_link(path: object) -> ByteLink:
    return open_link(f"file:{path}")


def test_file_gets_every_byte(tmp_path) -> None:
    path = tmp_path / "text"
    path.write_bytes(b"of an earlier run")
    data = ALL_BYTES * 8192
    with contextlib.closing(file_link(path)) as link:
        link.send(data)
        assert link.receive(10) == b""
        link.flush(DEADLINE_S)
    assert path.read_bytes() == data
    assert link.report() == []
    (announced,) = link.announce()
    assert announced.endswith(f" {path}")


@pytest.mark.skipif(not shutil.os.path.exists("/dev/full"), reason="needs /dev/full")
def test_full_disk_is_reported_and_counted(words: Words) -> None:
    with contextlib.closing(file_link("/dev/full")) as link:
        link.send(BOOT)
        link.flush(DEADLINE_S)
        link.send(BOOT)
    assert link.undelivered() == 2 * len(BOOT)
    words("run", "\n".join(link.report()))


def test_non_file_is_refused(tmp_path) -> None:
    for path, kind in ((tmp_path, "no_file"), (tmp_path / "missing" / "text", "not_writable")):
        with pytest.raises(LinkError) as refused:
            file_link(path)
        assert refused.value.kind == kind
        assert str(path) in str(refused.value)
