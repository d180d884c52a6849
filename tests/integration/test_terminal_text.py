"""Output of the board as text: UTF-8, and Latin-1 for bytes that are not UTF-8."""

from __future__ import annotations

import pytest

from fcu_emulator.emulator.assembly.terminal import Terminal
from fcu_emulator.emulator.buses.uart import Uart
from fcu_emulator.emulator.clock import Clock
from fcu_emulator.emulator.trace import Trace


class Printed(Uart):
    """A serial line on which these bytes have been printed."""

    def __init__(self, data: bytes) -> None:
        super().__init__("USART1", Clock(), Trace(), 84_000_000)
        self._data = bytearray(data)

    def received(self) -> bytearray:
        return self._data

    def received_count(self) -> int:
        return len(self._data)


def terminal(data: bytes) -> Terminal:
    return Terminal(Printed(data), Clock(), lambda _at_ps: None)


@pytest.mark.parametrize(
    ("data", "text"),
    [
        ("21.5 °C, 3 µs, 日本".encode(), "21.5 °C, 3 µs, 日本"),
        ("21.5 °C".encode("latin-1"), "21.5 °C"),
        (b"\xff\x00" + "°".encode() + b"\xe2\x82", "ÿ\x00°â\x82"),
    ],
)
def test_terminal_text_is_utf8(data: bytes, text: str) -> None:
    assert terminal(data).text == text


def test_expect_after_match_continues_at_byte_position() -> None:
    one = terminal("°C °C \xff".encode("latin-1") + " 1 µs, 2 µs".encode())
    assert one.expect("1 µs", since=0)
    assert one.expect(r"(\d) µs")[1] == "2"
