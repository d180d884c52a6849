"""A server's lines on the terminal: one line each and limited in number, for any clients."""

from __future__ import annotations

from fcu_emulator.emulator.links.limited_lines import BURST, EVERY_S, LimitedLines
from fcu_emulator.emulator.links.rfc2217 import Negotiated, Rfc2217Link


class Clock:
    """A wall clock that a test advances."""

    def __init__(self) -> None:
        self.now_s = 0.0

    def __call__(self) -> float:
        return self.now_s


def test_foreign_text_stays_in_its_line() -> None:
    said: list[str] = []
    LimitedLines(said.append)("a\r\nb\x1b[31m\x00 \u202e")
    assert said == ["a b\\x1b[31m\\x00 \\u202e"]
    LimitedLines(said.append)("x" * 10_000)
    assert len(said[1]) <= 200


def test_flood_of_lines_is_counted() -> None:
    said: list[str] = []
    clock = Clock()
    say = LimitedLines(said.append, clock)
    for number in range(1000):
        say(f"line {number}")
    assert said == [f"line {number}" for number in range(BURST)]
    clock.now_s += EVERY_S
    say("later")
    say("at once")
    assert len(said) == BURST + 1
    assert said[-1].startswith("later")
    assert str(1000 - BURST) in said[-1]


def test_client_setting_many_rates_prints_bounded_lines() -> None:
    said: list[str] = []
    link = Rfc2217Link(0, lambda: 115_200.0, said.append)
    coding = link.coding()
    assert isinstance(coding, Negotiated)
    for rate in range(1000, 3000):
        option = b"\xff\xfa\x2c\x01" + rate.to_bytes(4, "big").replace(b"\xff", b"\xff\xff") + b"\xff\xf0x"
        coding.decode(option)
    link.close()
    assert 0 < len(said) <= BURST
    assert len(link.report()) < 30
