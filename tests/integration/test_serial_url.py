"""``fcu://`` for pyserial: a board inside the process, which is read in virtual time."""

from __future__ import annotations

import contextlib

import pytest
import serial

from fcu_emulator import Board
from fcu_emulator.emulator.adapters import protocol_fcu
from fcu_emulator.emulator.adapters.protocol_fcu import port_of

ALL_BYTES = bytes(range(256))


@contextlib.contextmanager
def opened(url: str, **settings: object):
    with contextlib.closing(serial.serial_for_url(url, 115_200, **settings)) as port:
        yield port


def test_pyserial_port_reads_text_of_board() -> None:
    with opened("fcu://lab3?ideal=1&seed=3", timeout=2) as port:
        assert port.read_until(b"Init...").endswith(b"LAB3 Init...")
        assert port.board.seed == 3
        port.board.world.set_attitude(0, 30, 0)
        port.board.run_for(1)
        port.reset_input_buffer()
        text = port.read_until(b" deg Roll")
        assert b"Pitch: 30.0" in text or b"Pitch: 29.9" in text


def test_same_program_reads_same_bytes() -> None:
    def read() -> bytes:
        with opened("fcu://solution?scenario=desk", timeout=2) as port:
            return port.read(300) + port.read(10_000)

    first = read()
    assert len(first) > 600
    assert read() == first


def test_timeout_uses_virtual_time() -> None:
    board = Board(firmware="lab3")
    board.run_for(1)
    port = port_of(board, timeout=0.25)
    port.reset_input_buffer()
    assert len(port.read(1_000_000)) < 4000
    assert board.now_s == pytest.approx(1.25)


@pytest.mark.parametrize("timeout_s", [0.0, 0.0004, 0.25, 0.2507])
def test_read_of_silent_board_ends_at_timeout(timeout_s: float) -> None:
    board = Board(firmware=None)
    assert port_of(board, timeout=timeout_s).read(1) == b""
    assert board.now_s == pytest.approx(timeout_s, abs=1e-9)


def test_read_ends_when_requested_bytes_have_arrived() -> None:
    board = Board(firmware="lab3")
    port = port_of(board, timeout=30)
    assert port.read(10) == board.terminal.text[:10].encode()
    first_s = board.now_s
    port.read(10)
    assert first_s < 1.2
    assert board.now_s - first_s < 0.003  # they follow at 87 us each


def test_silent_board_without_timeout_raises_error(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(protocol_fcu, "SILENCE_S", 0.1)
    port = port_of(Board(firmware=None))  # the processor is held in reset
    with pytest.raises(serial.SerialException, match=r"^1 of 1 .* 0\.1 s "):
        port.read(1)


def test_polling_in_loop_advances_virtual_time() -> None:
    port = port_of(Board(firmware="lab3"))
    assert any(port.in_waiting for _ in range(2000))
    assert port.read(port.in_waiting)


def test_typed_bytes_arrive_at_line_speed() -> None:
    board = Board(firmware="lab3")
    port = port_of(board)
    assert port.write(ALL_BYTES) == 256
    assert port.out_waiting == 256
    port.flush()
    assert board.now_s == pytest.approx(256 * 10 / 115_200, abs=0.002)
    assert board.terminal.uart.rx_lost + board.terminal.uart.rxne == 256


@pytest.mark.parametrize(
    ("url", "message"),
    [
        ("fcu://lab4", "unknown firmware 'lab4'"),
        ("fcu://lab3?sede=1", "unknown option 'sede'; known: ideal, scenario, seed, wiring"),
        ("fcu://lab3?seed=x", "seed must be a whole number, not 'x'"),
        ("fcu://?scenario=nowhere", "nowhere"),
    ],
)
def test_invalid_url_raises_error_of_pyserial(url: str, message: str) -> None:
    with pytest.raises(serial.SerialException, match=r"^fcu://") as caught:
        serial.serial_for_url(url)
    assert message in str(caught.value)


def test_read_of_closed_port_raises_error() -> None:
    port = port_of(Board(firmware="lab3"))
    port.close()
    with pytest.raises(serial.SerialException):
        port.read(1)
