"""Figures in the summary of a run: the figures that the slides ask for, and only important notes."""

from __future__ import annotations

import re
from types import SimpleNamespace
from typing import Any

import pytest

from fcu_emulator import Board
from fcu_emulator.emulator.analysis.recorder import TruthRecorder
from fcu_emulator.emulator.cli.run_figures import _callback
from tests.integration.test_cli import fcu
from tests.support.words import Words

USUAL = "COMP_TEMP_EN"


def summary(*arguments: str) -> str:
    return fcu("run", *arguments).stderr.decode()


@pytest.mark.parametrize(
    ("wiring", "bus"),
    [
        ("lab3", "I2C2: SCL 400 kHz; a read of 6 bytes took 0.21"),  # 84 bits at 400 kHz are 0.21 ms
        ("fcu001v1", "SPI2: SCK 2.625 MHz; a read of 1 byte took 0.0"),
    ],
)
def test_summary_has_bus_clock_and_read_time(wiring: str, bus: str) -> None:
    assert bus in summary("solution", "--wiring", wiring, "--duration", "1200ms")


def test_serial_line_load_is_bytes_times_ten_bits() -> None:
    found = re.search(
        r"USART1: (\d+) baud; (\d+) bytes, (\S+) % of the time", summary("lab3", "--duration", "2s")
    )
    assert found is not None
    baud, count, load = int(found[1]), int(found[2]), float(found[3])

    assert baud == 115_226
    assert load == pytest.approx(100 * count * 10 / baud / 2.0, abs=0.1)


def test_summary_has_callback_time_and_period() -> None:
    """The four reads take 0.78 ms of bus time (docs/compare.md) and 0.8 ms with the HAL. The template does only this."""
    took = {}
    for firmware in ("template-arm", "solution"):
        found = re.search(r"callback .* (\S+) ms, .* 1\.25 ms", summary(firmware, "--duration", "3s"))
        assert found is not None
        took[firmware] = float(found[1])

    assert 0.78 <= took["template-arm"] <= 0.83
    assert 0.95 <= took["solution"] <= 1.1


def test_short_period_is_printed_with_all_digits(words: Words) -> None:
    """An eighth of a millisecond is 0.125, not 0.12."""
    board: Any = SimpleNamespace(timer=SimpleNamespace(rate_hz=8000.0))
    recorder: Any = SimpleNamespace(looks_at_callback=1000, callback_seen=1000)

    (line,) = _callback(board, recorder)
    assert re.findall(r"[\d.]+", line) == ["0.125", "100", "0.125"]
    words("run", line)


def test_callback_time_excludes_fault_handlers(monkeypatch: pytest.MonkeyPatch) -> None:
    """The interrupt of the callback stays active below the fault that it has caused."""
    board = Board(firmware="solution")
    recorder = TruthRecorder(board)
    board.run_for(1.2)
    before = recorder.looks_at_callback, recorder.callback_seen
    assert board.chip is not None
    handled = ["MemManage", "TIM1_BRK_TIM9"]
    monkeypatch.setattr(board.chip, "handled", lambda: handled)
    board.run_for(0.1)

    assert before[0] > before[1] > 0
    assert (recorder.looks_at_callback, recorder.callback_seen) == before


def test_verbose_shows_notes_of_correct_programs() -> None:
    assert USUAL not in summary("lab3", "--duration", "1200ms")
    assert USUAL in summary("lab3", "--duration", "1200ms", "--verbose")


def test_all_uarts_option_shows_output_of_usart2() -> None:
    program = "tests/arm/broken/other_port.elf"
    line = "\nfcu: USART2: Hello, 21.5 \u00b0C\n"
    assert line in summary(program, "--duration", "0.05s", "--all-uarts").replace("\r", "")
    assert line not in summary(program, "--duration", "0.05s")


def test_board_returns_output_of_other_uarts() -> None:
    board = Board(firmware="tests/arm/broken/other_port.elf")
    board.run_for(0.05)
    assert board.other_uarts() == {"USART2": "Hello, 21.5 \u00b0C\r\n".encode()}
    assert Board().other_uarts() == {}
