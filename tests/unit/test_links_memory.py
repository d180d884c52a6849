"""The link for tests, and the bounded queue beneath the real links."""

from __future__ import annotations

import tracemalloc

from hypothesis import given
from hypothesis import strategies as st

from fcu_emulator import Board, TerminalBytes
from fcu_emulator.emulator.links import ByteLink, MemoryLink
from fcu_emulator.emulator.links.byte_link import Backlog
from fcu_emulator.emulator.links.runner import Runner


def test_sent_bytes_are_collected_in_order() -> None:
    link: ByteLink = MemoryLink()
    link.send(b"LAB3 ")
    link.send(b"Init...\n")
    link.flush(1.0)
    assert isinstance(link, MemoryLink)
    assert link.sent == b"LAB3 Init...\n"


def test_fed_bytes_arrive_exactly_once() -> None:
    link = MemoryLink()
    link.feed(b"a")
    link.feed(b"\x00\xff")
    assert link.receive(1 << 20) == b"a\x00\xff"
    assert link.receive(1 << 20) == b""


def test_closed_link_accepts_and_returns_no_bytes() -> None:
    link = MemoryLink()
    link.send(b"kept")
    link.feed(b"late")
    link.close()
    link.close()
    link.send(b"too late")
    assert link.receive(1 << 20) == b""
    assert link.sent == b"kept"
    assert link.closed


def test_memory_link_has_no_announcement_or_report() -> None:
    link = MemoryLink()
    assert link.announce() == []
    assert link.report() == []


@given(limit=st.integers(0, 50), pieces=st.lists(st.binary(max_size=40)))
def test_backlog_keeps_newest_and_counts_lost_bytes(limit: int, pieces: list[bytes]) -> None:
    backlog = Backlog(limit)
    lost = sum(backlog.put(piece) for piece in pieces)
    everything = b"".join(pieces)
    assert lost == max(0, len(everything) - limit)
    assert len(backlog) == len(everything) - lost
    assert backlog.take() == everything[lost:]
    assert len(backlog) == 0


@given(data=st.binary(max_size=60), first=st.integers(0, 70))
def test_backlog_returns_oldest_bytes_first(data: bytes, first: int) -> None:
    backlog = Backlog(100)
    backlog.put(data)
    assert backlog.peek(first) == data[:first]
    assert backlog.take(first) == data[:first]
    assert backlog.take() == data[first:]


def test_lowered_limit_applies_from_next_put() -> None:
    backlog = Backlog(10)
    backlog.put(b"0123456789")
    backlog.limit = 4
    assert backlog.put(b"ab") == 8
    assert backlog.take() == b"89ab"


def test_pasted_text_arrives_complete() -> None:
    """The board takes a few thousand bytes at a time, which the wire can carry, for any length of the text."""
    link = MemoryLink()
    link.feed(bytes(range(256)) * 80)
    board = Board()
    terminal = board.terminal
    taken: list[int] = []

    def look(_progress: object) -> None:
        taken.append(terminal.typing_left)

    board.trace.record_all()
    Runner(board, [link], 2_500_000_000_000, None).run(look)

    assert 0 < max(taken) <= 4096
    typed = b"".join(event.data for event in board.trace.of(TerminalBytes) if event.direction == "rx")
    assert typed == bytes(range(256)) * 80
    assert terminal.typing_left == 0


def test_million_typed_bytes_need_little_memory() -> None:
    board = Board()
    tracemalloc.start()
    try:
        board.terminal.write(b"x" * 1_000_000)
        board.run_for(0.5)
        _, peak = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()

    assert board.terminal.typing_left == 1_000_000 - 5761  # 115226 baud, frames of ten bits
    assert peak < 10_000_000
