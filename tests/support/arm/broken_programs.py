"""The broken programs in tests/arm/broken: their runs, diagnoses and expected texts.

``python -m tests.support.arm.broken_programs`` writes the expected texts again. They must be read before they are
kept.
"""

from __future__ import annotations

import re
from pathlib import Path

from fcu_emulator import Board

FOLDER = Path(__file__).parents[2] / "arm" / "broken"
EXPECTED = FOLDER / "expected"

RUN_S = {
    "asleep": 0.05,
    "clock_is_not_the_cause": 3.1,
    "delay_in_callback": 0.3,
    "divide_by_zero": 0.01,
    "ended": 0.05,
    "error_in_main": 1.2,
    "even_address": 0.01,
    "faulting_handler": 0.003,
    "flag_never_set": 0.05,
    "flash_write": 0.01,
    "gpio_without_clock": 0.05,
    "main_returns": 0.01,
    "masked_delay": 0.05,
    "no_clock": 0.2,
    "no_handler": 0.3,
    "null_function": 0.01,
    "null_pointer": 0.01,
    "other_port": 0.05,
    "outside_memory": 0.05,
    "poll_for_ever": 3.1,
    "poll_without_clock": 0.05,
    "reset_for_ever": 0.1,
    "reset_in_fault": 0.05,
    "slow_callback": 0.3,
    "spi_direction": 0.05,
    "spi_while_blinking": 3.1,
    "stack_into_data": 0.05,
    "stack_overflow": 0.01,
    "stripped": 0.01,
    "thread_masked": 0.05,
    "thread_on_spi": 3.1,
    "tick_off": 0.05,
    "unshifted_address": 0.05,
    "watchdog": 0.3,
    "wrong_address": 0.05,
}
"""Virtual time after which each program is diagnosed."""

FINE = (
    "fine_callback",
    "fine_flash",
    "fine_gated",
    "fine_idle_thread",
    "fine_masked",
    "fine_quiet",
    "fine_spi",
    "fine_threads",
)
"""Correct programs, which get no diagnosis."""


def run(name: str, folder: Path = FOLDER) -> Board:
    """Return the board after the time of the program."""
    board = Board(firmware=folder / f"{name}.elf", ideal=True)  # an exact oscillator
    board.run_for(RUN_S[name])
    return board


def diagnosed(name: str, folder: Path = FOLDER) -> str:
    """Return the diagnosis as text."""
    board = run(name, folder)
    assert board.chip is not None
    return str(board.chip.diagnosis())


def without_times(text: str) -> str:
    """Return a text without times. Times depend on the clock model, so only their presence is checked."""
    return re.sub(r"\b\d+\.\d{6} s", "<time>", text)


if __name__ == "__main__":
    for program in RUN_S:
        (EXPECTED / f"{program}.txt").write_text(diagnosed(program) + "\n")
