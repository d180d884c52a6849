"""Texts in results of ``fcu mcp``: pages of bounded size that together have the whole text."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from fcu_emulator.emulator.agents.texts import MOST_BYTES, MOST_LINES, TextStore, latest, lines_of, page
from fcu_emulator.emulator.errors import InputError


def pages(store: TextStore, kind: str, text: str) -> list[str]:
    """Return all pages of a text, as an agent reads them."""
    found = [store.shown(kind, text)]
    while "rest" in found[-1]:
        name, line = (
            found[-1]["rest"].removeprefix("read_text(name=").removesuffix(")").split(", first_line=")
        )
        found.append(store.read(name.strip('"'), int(line)))
    return [one["text"] for one in found]


@given(st.text(alphabet=st.sampled_from("ab\n\u20ac\x1b"), max_size=3000).map(lambda text: text * 20))
def test_pages_together_are_whole_text(text: str) -> None:
    found = pages(TextStore(), "x", text)

    assert "\n".join(found).split("\n") == (lines_of(text) or [""])
    assert all(len(one.encode()) <= MOST_BYTES and len(one.splitlines()) <= MOST_LINES for one in found)


@given(st.lists(st.text(alphabet="a\u20ac", max_size=500), max_size=400))
def test_latest_lines_fit_into_page(lines: list[str]) -> None:
    kept = latest(lines)

    assert kept == lines[len(lines) - len(kept) :]
    assert len("\n".join(kept).encode()) <= MOST_BYTES
    assert len(kept) <= MOST_LINES
    if len(kept) < min(len(lines), MOST_LINES):
        assert len("\n".join(lines[-len(kept) - 1 :]).encode()) + 1 > MOST_BYTES


def test_short_text_is_not_kept() -> None:
    store = TextStore()

    assert store.shown("x", "one\ntwo\n") == {"text": "one\ntwo"}
    with pytest.raises(InputError, match="unknown text"):
        store.read("x-1", 1)


def test_line_without_end_is_bounded() -> None:
    found = pages(TextStore(), "x", "y" * 100_000)

    assert "".join(found).replace("\n", "") == "y" * 100_000
    assert len(found) > 5


def test_lost_bytes_are_counted() -> None:
    shown = TextStore().shown("x", "y\n" * (1 << 20), lost_bytes=7)

    assert shown["lost"] == f"the last {(1 << 20) + 7} bytes were not kept"


def test_only_latest_texts_are_kept() -> None:
    store = TextStore()
    names = [store.keep("x", str(number))["name"] for number in range(20)]

    assert store.read(names[-1], 1)["text"] == "19"
    with pytest.raises(InputError, match="unknown text 'x-1'"):
        store.read(names[0], 1)


@pytest.mark.parametrize("line", [0, 3, -1])
def test_line_outside_text_is_refused(line: int) -> None:
    store = TextStore()
    store.keep("x", "one\ntwo")

    with pytest.raises(InputError, match="first_line must be from 1 to 2"):
        store.read("x-1", line)


def test_control_characters_are_escaped() -> None:
    assert page(lines_of("a\x1b[31mb\r\nc"))[0] == "a\\x1b[31mb\nc"
