"""The pytest plugin: boards, expectations in virtual time, and evidence for failures.

::

    @pytest.mark.board("build/mylab.elf", scenario="flat")
    def test_pitch_follows_the_board(board, dut):
        board.world.set_attitude(roll_deg=0, pitch_deg=30, yaw_deg=0)
        dut.expect(r"Pitch: (29|30)[.]")
        dut.not_matching(r"nan", timeout=3)

A failed test shows terminal, transfers, diagnosis, and the command that repeats the test.
``grading.pytest_plugin`` adds the line of a wrong formula. The JUnit file has all these texts if
``junit_logging = "system-out"``.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

import pytest

from fcu_emulator.emulator.text import visible

if TYPE_CHECKING:
    from fcu_emulator.emulator.assembly.board import Board

Pattern: TypeAlias = str | re.Pattern[str]

TIMEOUT_S = 5.0
_STEP_S = 0.01
_TERMINAL_LINES = 40
_TRANSFERS = 12
_MARKER = ("scenario", "wiring", "seed", "ideal", "cold_start")
"""Keyword arguments of the marker."""
_RECORDING = pytest.StashKey[Any]()  # a BoardRecording, which is imported with the first board
_FOLDERS = pytest.StashKey[pytest.TempPathFactory]()


class Dut:
    """Device under test with a serial line.

    Each expectation searches the output after the previous match.
    """

    def __init__(self, board: Board) -> None:
        self.board = board
        self._position = 0

    def write(self, data: bytes | str) -> None:
        """Type Latin-1 text or bytes."""
        self.board.terminal.write(data)

    def expect(
        self,
        pattern: Pattern | Sequence[Pattern],
        timeout: float = TIMEOUT_S,
        *,
        expect_all: bool = False,
        not_matching: Pattern | None = None,
    ) -> Any:
        """Run until a pattern is printed, and return its match.

        With ``expect_all``, wait for all patterns, and return their matches. Fails if
        ``not_matching`` is printed earlier, or if ``timeout`` virtual seconds have passed.
        """
        __tracebackhide__ = True
        many = [pattern] if isinstance(pattern, str | re.Pattern) else list(pattern)
        compiled = [re.compile(one) for one in many]
        matches = self._search(compiled, timeout, expect_all, not_matching)
        return matches if expect_all else matches[0]

    def expect_exact(self, text: str | Sequence[str], timeout: float = TIMEOUT_S) -> Any:
        """Run until a literal text is printed."""
        __tracebackhide__ = True
        many = [text] if isinstance(text, str) else text
        return self.expect([re.escape(one) for one in many], timeout)

    def expect_all(self, patterns: Sequence[Pattern], timeout: float = TIMEOUT_S) -> list[re.Match[str]]:
        """Run until all patterns are printed, and return their matches."""
        __tracebackhide__ = True
        matches: list[re.Match[str]] = self.expect(patterns, timeout, expect_all=True)
        return matches

    def not_matching(self, pattern: Pattern, timeout: float = TIMEOUT_S) -> None:
        """Run for ``timeout`` virtual seconds, and fail if the pattern is printed."""
        __tracebackhide__ = True
        end_s = self.board.now_s + timeout
        while True:
            text, _ = self._since()
            match = re.search(pattern, text)
            if match:
                pytest.fail(f"{match.group()!r} was printed, but no output may match {_shown(pattern)}")
            if self.board.now_s >= end_s:
                return
            self.board.run_for(min(_STEP_S, max(end_s - self.board.now_s, 1e-12)))

    def _since(self) -> tuple[str, int]:
        data, end = self.board.terminal.since(self._position)
        return data.decode("latin-1"), end

    def _search(
        self, wanted: list[re.Pattern[str]], timeout: float, everyone: bool, never: Pattern | None
    ) -> list[re.Match[str]]:
        __tracebackhide__ = True
        end_s = self.board.now_s + timeout
        while True:
            text, end = self._since()
            found = [match for match in (one.search(text) for one in wanted) if match]
            limit = max((match.end() for match in found), default=len(text))
            unwanted = re.search(never, text[:limit]) if never is not None else None
            if unwanted:
                pytest.fail(f"{unwanted.group()!r} was printed, but no output may match {_shown(never)}")
            if found and (not everyone or len(found) == len(wanted)):
                if not everyone:
                    found = [min(found, key=lambda match: match.end())]
                self._position = end - len(text) + max(match.end() for match in found)
                return found
            if self.board.now_s >= end_s:
                missing = [one for one in wanted if not one.search(text)]
                joined = (" and " if everyone else " or ").join(map(_shown, missing))
                pytest.fail(
                    f"{joined} was not printed within {timeout:g} s of virtual time "
                    f"(now {self.board.now_s:.3f} s)"
                )
            self.board.run_for(min(_STEP_S, max(end_s - self.board.now_s, 1e-12)))


# -- fixtures -----------------------------------------------------------------------------------------------


@pytest.fixture
def firmware(request: pytest.FixtureRequest) -> str | Path | None:
    """The firmware that ``--firmware``, the marker or the scenario names, or else ``lab3``."""
    given: str | None = request.config.getoption("--firmware")
    if given is not None:
        return given
    marker = request.node.get_closest_marker("board")
    if marker is not None and marker.args:
        chosen: str | Path | None = marker.args[0]
        return chosen
    if marker is not None and marker.kwargs.get("scenario"):
        return None
    from fcu_emulator.emulator.boards.fcu001v1 import (
        FCU001V1,  # not needed without boards
    )

    return FCU001V1.default_firmware


@pytest.fixture
def board(
    request: pytest.FixtureRequest, firmware: str | Path | None, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[Board]:
    """A board with ``firmware``. Its marker may set scenario, wiring, seed, ideal, cold_start."""
    from fcu_emulator.emulator.assembly.board import (
        Board,  # not needed without boards
    )
    from fcu_emulator.emulator.errors import InputError

    marker = request.node.get_closest_marker("board")
    asked = marker.kwargs if marker is not None else {}
    unknown = [name for name in asked if name not in (*_MARKER, "profile")]  # Board warns about the old name
    if unknown:
        takes = ", ".join(_MARKER)
        problem = f"the marker board has no argument {unknown[0]!r}; give a firmware, and any of {takes}"
        pytest.fail(problem, pytrace=False)
    try:
        made = Board(firmware, **asked)
    except InputError as error:
        pytest.fail(str(error), pytrace=False)  # a traceback of this package does not help the user
    from fcu_emulator.emulator.testing.board_recording import BoardRecording

    request.node.stash[_RECORDING] = BoardRecording(made, cold=bool(asked.get("cold_start")))
    request.node.stash[_FOLDERS] = tmp_path_factory
    with made:
        yield made


@pytest.fixture
def dut(board: Board) -> Dut:
    """The board's serial line, with expectations."""
    return Dut(board)


# -- hooks --------------------------------------------------------------------------------------------------


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add the option ``--firmware FILE``."""
    what = "firmware of the fixture 'board': an ELF, HEX or BIN file, or a name"
    parser.getgroup("fcu", "virtual boards").addoption("--firmware", metavar="FILE", help=what)


def pytest_configure(config: pytest.Config) -> None:
    """Register the marker ``board``."""
    arguments = f"firmware=None, *, {', '.join(_MARKER)}"
    config.addinivalue_line("markers", f"board({arguments}): arguments of the fixture 'board'")


@pytest.hookimpl(tryfirst=True)
def pytest_runtest_makereport(item: pytest.Item, call: pytest.CallInfo[None]) -> None:
    """Report a failed test with evidence."""
    if call.when != "call" or call.excinfo is None or call.excinfo.errisinstance(pytest.skip.Exception):
        return
    board: Any = getattr(item, "funcargs", {}).get("board")
    if type(board).__name__ == "Board":
        for title, text in evidence(board, _by_hand(item, board)):
            item.add_report_section("call", f"stdout: {title},", text)


def _by_hand(item: pytest.Item, board: Board) -> str:
    from fcu_emulator.emulator.testing.board_recording import by_hand

    def save(text: str) -> str:
        path = item.stash[_FOLDERS].mktemp("fcu") / "board.toml"
        path.write_text(text, encoding="utf-8")
        return str(path)

    return "\n".join(by_hand(board, item.stash.get(_RECORDING, None), save))


def evidence(board: Board, by_hand: str = "") -> Iterator[tuple[str, str]]:
    """Yield each piece of evidence for a failure as title and text.

    ``by_hand``: command that runs the same board.
    """
    lines = board.terminal.text.replace("\r", "").splitlines() or ["(no output)"]
    dropped = [f"... {len(lines) - _TERMINAL_LINES} earlier lines"] if len(lines) > _TERMINAL_LINES else []
    shown = [*dropped, *(visible(line) for line in lines[-_TERMINAL_LINES:])]
    yield f"terminal at {board.now_s:.3f} s", "\n".join(shown)
    latest = board.recent_transfers()[-_TRANSFERS:]
    if latest:
        yield (
            f"transfers before {board.now_s:.3f} s",
            "\n".join(
                f"{one.t_ps / 1e12:.6f} s  {one.bus} {one.device or hex(one.address)} {one.register} "
                f"written {one.written.hex(' ') or '-'} read {one.read.hex(' ') or '-'} {one.result}"
                for one in latest
            ),
        )
    diagnosis = board.chip.diagnosis() if board.chip else None
    if diagnosis is not None:
        yield "diagnosis", str(diagnosis)
    if by_hand:
        yield "the same board by hand", by_hand


def _shown(pattern: Pattern | None) -> str:
    return repr(pattern.pattern if isinstance(pattern, re.Pattern) else pattern)
