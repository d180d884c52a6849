"""The word after ``--serial``, and how long the end of a run waits."""

from __future__ import annotations

import os
import sys

import pytest

from emulator.errors import LinkError
from emulator.links import StdoutLink, byte_link, open_link
from emulator.links.byte_link import Patience


def test_stdout_is_a_link(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(os, "isatty", lambda fd: False)  # the terminal of who runs the tests stays theirs
    link = open_link("stdout")
    link.close()
    assert isinstance(link, StdoutLink)


@pytest.mark.parametrize("spec", ["", "pty:", "tcp:1234", "stdout:x", "ptyx", "PTY"])
def test_anything_else_names_the_choices(spec: str) -> None:
    with pytest.raises(LinkError, match=r"choose stdout, pty or pty:/path/of/a/link$") as caught:
        open_link(spec)
    assert f"--serial {spec}:" in str(caught.value)


@pytest.mark.parametrize("spec", ["pty", "pty:/some/link"])
def test_windows_is_told_to_use_stdout(spec: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "platform", "win32")
    with pytest.raises(LinkError, match=r"^--serial pty: .*; use --serial stdout$"):
        open_link(spec)


class WallClock:
    """``time.monotonic`` under the test's control."""

    def __init__(self) -> None:
        self.now_s = 100.0

    def monotonic(self) -> float:
        return self.now_s


@pytest.fixture
def wall(monkeypatch: pytest.MonkeyPatch) -> WallClock:
    clock = WallClock()
    monkeypatch.setattr(byte_link, "time", clock)
    return clock


def test_patience_ends_at_the_timeout_in_spite_of_progress(wall: WallClock) -> None:
    waiting = Patience(timeout_s=3.0)
    for step in range(3):
        wall.now_s = 100.0 + step
        assert waiting.wait_s(10 - step) > 0.0
    wall.now_s = 103.0
    assert waiting.wait_s(1) == 0.0


def test_patience_ends_two_seconds_after_the_last_progress(wall: WallClock) -> None:
    waiting = Patience(timeout_s=60.0)
    assert waiting.wait_s(10) == 2.0
    wall.now_s = 101.5
    assert waiting.wait_s(10) == 0.5
    assert waiting.wait_s(9) == 2.0
    wall.now_s = 103.5
    assert waiting.wait_s(9) == 0.0
