"""Boards in threads and processes print the same bytes, or one line if this is not possible."""

from __future__ import annotations

import multiprocessing
import subprocess
import sys
import threading
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from hashlib import sha256

import pytest

from fcu_emulator import Board, InputError

FIRMWARES = ("lab3", "solution", "template", "template-arm")
PIECES_S = (0.1, 0.35, 0.005, 0.4)

FORKS = """
import os, sys
from tests.integration.test_threads_and_processes import digest, started
board = started(sys.argv[1])
reader, writer = os.pipe()
if os.fork() == 0:
    os.write(writer, digest(board).encode())
    os._exit(0)
mine = digest(board)
os.wait()
print(mine == os.read(reader, 100).decode(), mine)
"""


def started(firmware: str) -> Board:
    """Return a board that has run for a while, with a trace of all events."""
    board = Board(firmware=firmware, scenario="desk", seed=7)
    board.trace.record_all()
    board.run_for(0.2)
    return board


def digest(board: Board) -> str:
    """Return a digest of the board's results after some more runs."""
    for seconds in PIECES_S:
        board.run_for(seconds)
    seen = [bytes(board.terminal.read()).decode(), *map(str, board.trace)]
    return sha256("\n".join(seen).encode()).hexdigest()


def whole(firmware: str) -> str:
    """Return the digest of a run from power-on, for threads and processes."""
    return digest(started(firmware))


def in_a_thread(function: Callable[[], object]) -> object:
    """Return the function's result or exception in another thread."""
    with ThreadPoolExecutor(1) as pool:
        return pool.submit(function).result()


def test_boards_in_threads_equal_single_runs() -> None:
    chosen = FIRMWARES * 2
    alone = {firmware: whole(firmware) for firmware in FIRMWARES}
    barrier = threading.Barrier(len(chosen))

    def run(firmware: str) -> str:
        barrier.wait()
        return whole(firmware)

    with ThreadPoolExecutor(len(chosen)) as pool:
        assert list(pool.map(run, chosen)) == [alone[firmware] for firmware in chosen]


@pytest.mark.parametrize("firmware", FIRMWARES)
def test_board_may_run_in_another_thread(firmware: str) -> None:
    board = Board(firmware=firmware, scenario="desk", seed=7)
    board.trace.record_all()

    def run() -> str:
        board.run_for(0.2)
        return digest(board)

    assert in_a_thread(run) == whole(firmware)


def test_started_chip_may_continue_in_another_thread() -> None:
    board = started("solution")

    assert in_a_thread(lambda: digest(board)) == whole("solution")


def test_started_python_firmware_refuses_another_thread() -> None:
    board = started("lab3")

    with pytest.raises(InputError) as refused:
        in_a_thread(lambda: board.run_for(1))

    assert refused.value.kind == "other_thread"
    assert digest(board) == whole("lab3")  # and goes on in its own


@pytest.mark.parametrize("firmware", ["lab3", "solution"])
def test_another_process_gives_same_results(firmware: str) -> None:
    with multiprocessing.get_context("spawn").Pool(1) as pool:
        assert pool.apply(whole, [firmware]) == whole(firmware)


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no fork")
@pytest.mark.parametrize("firmware", ["lab3", "solution"])
def test_forked_process_gives_same_results(firmware: str) -> None:
    done = subprocess.run(
        [sys.executable, "-c", FORKS, firmware], capture_output=True, text=True, check=False
    )

    assert done.stdout.split() == ["True", whole(firmware)], done.stderr
