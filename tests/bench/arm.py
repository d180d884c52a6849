"""The rows of the speed table for the chip. Each asserts its results before it returns a figure."""

from __future__ import annotations

import json
import tempfile
from pathlib import Path

from fcu_emulator import Board
from tests.bench.row import Row, factor
from tests.support.arm import vendor_programs as vendor
from tests.support.arm.speed_programs import ARITHMETIC, POLLS_A_PIN, SHOWS_A_PIN, program

_HSI_HZ = 16_000_000
_NOMINAL = 84_000_000 / _HSI_HZ  # the programs in assembly run from HSI: a second of theirs is less work
_TICK_HZ = 800
_BOOT_S = 1.1  # TIM9 runs then


def _ticking(board: Board) -> float:
    """Return virtual over CPU time of a board that has booted. A late or lost tick is an error."""
    board.run_for(_BOOT_S)
    ticks = board.tim9.ticks
    figure, seconds = factor(board)
    assert abs(board.tim9.ticks - ticks - seconds * _TICK_HZ) <= 1, board.tim9.ticks
    assert (board.tim9.late, board.tim9.lost) == (0, 0)
    if seconds < 1.2:  # time for another block of text, which the assertions need
        board.run_for(1.2 - seconds)
    return figure


def solution(wiring: str) -> float:
    """Return the speed of the shipped solution in the scenario desk."""
    board = Board(firmware="solution", wiring=wiring, scenario="desk")
    figure = _ticking(board)
    assert "LAB3 Init..." in board.terminal.text, board.terminal.text[:300]
    assert board.terminal.text.count("Pitch: ") >= 2, board.terminal.text
    return figure


def solution_traced() -> float:
    """Return the speed of the solution on I2C2, with every event written to a file."""
    board = Board(firmware="solution", wiring="lab3", scenario="desk")
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "trace.jsonl"
        board.trace.write_to(file)
        figure = _ticking(board)
        board.trace.close()
        kinds = [json.loads(line)["kind"] for line in file.read_text(encoding="utf-8").splitlines()]
    assert kinds.count("bus") > 4 * board.tim9.ticks
    assert kinds.count("terminal") > 500
    return figure


def lab3(way: str) -> float:
    """Return the speed of LAB3 in the vendor's calling style on I2C2."""
    board = Board(firmware=vendor.file(f"lab3_i2c_{way}"), wiring="lab3", ideal=True)
    figure = _ticking(board)
    blocks = board.terminal.text.split("*****")
    assert vendor.BLOCK in blocks[2], blocks[2:]
    assert set(vendor.numbers("Errors", board.terminal.text)) == {0}
    samples = vendor.numbers("Samples", board.terminal.text)
    assert samples[1] - samples[0] > _TICK_HZ, samples
    return figure


def flight() -> float:
    """Return the speed with six messages on SPI2, eight PWM channels and a radio that does not answer, in each tick."""
    board = Board(firmware=vendor.file("flight"), wiring="fcu001v1", ideal=True)
    figure = _ticking(board)
    text = board.terminal.text
    assert vendor.STATE in text, text
    ticks, silent, headers = (vendor.numbers(name, text)[-1] for name in ("ticks", "silent", "headers"))
    assert ticks == silent > _TICK_HZ, text
    assert 30 * ticks < headers < 40 * ticks, text
    return figure


def all_blocks() -> float:
    """Return the speed of waiting for a value in more than a hundred registers, one after the other."""
    board = Board(firmware=vendor.file("all_blocks"))
    board.run_for(0.05)
    figure, _ = factor(board, 0.05)
    lines = board.terminal.text.splitlines(keepends=True)
    assert lines[:5] == [vendor.laps_line(vendor.LAPS * number) for number in range(1, 6)], lines
    return figure


def threads() -> float:
    """Return the speed of threads in a small kernel."""
    board = Board(firmware=vendor.file("threads"), ideal=True)
    board.run_for(0.1)
    figure, _ = factor(board)
    answers = vendor.numbers("answer", board.terminal.text)
    assert answers[:10] == list(range(1001, 1011)), answers
    return figure


def _chip(source: str, seconds: float = 0.2) -> tuple[Board, float, int, int]:
    """Run a program in assembly; return board, virtual over CPU time, instructions per virtual second, R4."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "program.bin"
        file.write_bytes(program(source))
        board = Board(firmware=file, ideal=True)
    board.run_for(0.05)
    assert board.chip is not None
    core = board.chip.core
    before = core.retired
    figure, spent = factor(board, seconds)
    return board, figure, round((core.retired - before) / spent), core.register(4)


def polling() -> float:
    """Return the speed of a main loop that polls a pin and never repeats itself, at 84 MHz."""
    _, figure, rate, laps = _chip(POLLS_A_PIN)
    assert abs(rate * 1.3 - _HSI_HZ) < 100, rate
    assert laps > 1_000_000, laps
    return figure / _NOMINAL


def button() -> float:
    """Return the speed of a main loop that shows a pin on a LED, at 84 MHz."""
    board, figure, _, _ = _chip(SHOWS_A_PIN, 0.01)
    assert board.led1.on
    return figure / _NOMINAL


def arithmetic() -> float:
    """Return million instructions per CPU second, without loads and stores."""
    _, figure, rate, laps = _chip(ARITHMETIC)
    assert laps > 1_000_000, laps
    return rate * figure / 1e6


def rows() -> list[Row]:
    """Return the rows of the chip."""
    return [
        Row("solution on I2C2", lambda: solution("lab3"), "x", 2, 12, 20),
        Row("solution on SPI2", lambda: solution("fcu001v1"), "x", 2, 8, 16),
        Row("solution on I2C2, with a trace file", solution_traced, "x", 2),
        Row("vendor's style, I2C2 polled", lambda: lab3("polled"), "x", 2, 8, 14),
        Row("vendor's style, I2C2 by interrupt", lambda: lab3("it"), "x", 2, 5, 10),
        Row("vendor's style, I2C2 by DMA", lambda: lab3("dma"), "x", 2, 5, 10),
        Row("flight-like firmware on SPI2", flight, "x", 2, 4, 10),
        Row("all blocks, a hundred registers waited for", all_blocks, "x", 2),
        Row("threads of a kernel", threads, "x", 2),
        Row("arithmetic", arithmetic, "MIPS", 0, 550, 900),
        Row("a loop that polls a pin and counts, of 84 MHz", polling, "x", 2, 5, 8),
        Row("a loop that shows a pin on a LED, of 84 MHz", button, "x", 2),
    ]
