"""Limits of a run of compiled firmware, and the end of a run that exceeds them."""

from __future__ import annotations

import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from fcu_emulator import Board, FirmwareError
from fcu_emulator.emulator.chip.firmware import LimitedRun, Limits, parse_limits
from fcu_emulator.emulator.clock import PS_PER_S
from fcu_emulator.emulator.errors import InputError, LimitError
from tests.support.arm.hostile_programs import board_with, program, put
from tests.support.words import Words

PRINTS_FOR_EVER = program(
    "reset:\n"
    + put("RCC_AHB1ENR", 1)
    + put("GPIOA_MODER", 0xA808_0000)  # PA9: alternate function
    + put("GPIOA_AFRH", 0x70)  # USART1_TX
    + put("RCC_APB2ENR", 1 << 4)
    + put("USART1_BRR", 16)  # a megabaud at 16 MHz
    + put("USART1_CR1", 0x2008)  # UE, TE (RM0368 19.6.4)
    + "mov32 r0, USART1_DR\nagain: strb r1, [r0]\nb again"
)
RESETS_ITSELF = program("reset:\n" + put("AIRCR", 0x05FA_0004))
WATCHDOG = [put("IWDG_KR", 0x5555), put("IWDG_PR", 0), put("IWDG_RLR", 0), put("IWDG_KR", 0xCCCC)]
BITTEN_AT_ONCE = program("reset:\n" + "".join(WATCHDOG) + "b .")
COUNTS = program("reset: adds r0, #1\nb reset")


def stopped(board: Board, seconds: float = 3600.0) -> LimitError:
    with pytest.raises(LimitError) as caught:
        board.run_for(seconds)
    assert "\n" not in str(caught.value)
    return caught.value


def limited(data: bytes, folder: Path, **limits: Any) -> Board:
    board = board_with(data, folder)
    assert board.chip is not None
    board.chip.limits = replace(Limits(), **limits)
    return board


def test_endless_text_ends_at_terminal_limit(tmp_path: Path, words: Words) -> None:
    board = limited(PRINTS_FOR_EVER, tmp_path, terminal_bytes=2_000)

    error = stopped(board)

    assert (error.limit, isinstance(error, FirmwareError)) == ("terminal_bytes", True)
    words("run", str(error))
    assert len(board.terminal.text) <= 2_000 + 1_000 + 1  # 100,000 a second, looked at every 10 ms


def test_endless_loop_ends_at_instruction_limit(tmp_path: Path) -> None:
    """After reset the core runs at 16 MHz (RM0368 6.2.2) and needs 1.3 cycles per instruction."""
    board = limited(COUNTS, tmp_path, instructions=1_000_000)

    assert stopped(board).limit == "instructions"
    assert 1_000_000 * 1.3 / 16e6 <= board.now_s <= 1_000_000 * 1.3 / 16e6 + 0.01


@pytest.mark.parametrize(
    ("data", "reason"), [(RESETS_ITSELF, "SYSRESETREQ"), (BITTEN_AT_ONCE, "IWDG")], ids=["itself", "watchdog"]
)
def test_endless_resets_are_stopped_with_reason(
    data: bytes, reason: str, tmp_path: Path, words: Words
) -> None:
    board = limited(data, tmp_path, resets_per_s=100)

    error = stopped(board)

    assert error.limit == "resets_per_s"
    assert reason in str(error)
    words("run", str(error))


def test_rare_resets_are_allowed(tmp_path: Path) -> None:
    """Firmware hangs, and a watchdog resets it every 32 ms (LSI 32 kHz / 4 / 256)."""
    data = program("reset:\n" + "".join((*WATCHDOG[:2], put("IWDG_RLR", 255), WATCHDOG[3])) + "b .")
    board = board_with(data, tmp_path)

    board.run_for(2.0)

    assert board.chip is not None
    assert len(board.chip.core.resets) == pytest.approx(2.0 / 0.032, abs=2)


def test_wall_time_limit_ends_slow_run(tmp_path: Path, words: Words) -> None:
    """The test replaces the wall clock: each read takes one second."""
    board = board_with(COUNTS, tmp_path)
    assert board.chip is not None
    seconds = iter(range(1_000_000))
    uart = board.terminal.uart
    run = LimitedRun(board.chip.core, board.clock, uart, wall_clock_s=lambda: float(next(seconds)))

    with pytest.raises(LimitError) as caught:
        run.run_until_ps(PS_PER_S, Limits(wall_s=30.0))

    assert caught.value.limit == "wall_s"
    words("run", str(caught.value))
    assert board.now_s == pytest.approx(0.31)  # 10 ms a look


def test_run_within_limits_ends_at_requested_time(tmp_path: Path) -> None:
    board = board_with(COUNTS, tmp_path)

    board.run_until_ps(123_456_789_012)

    assert board.clock.now_ps == 123_456_789_012


def test_exceeded_limit_stops_run_until_raised(tmp_path: Path) -> None:
    board = limited(COUNTS, tmp_path, instructions=1_000)
    stopped(board)
    stopped(board)
    assert board.chip is not None

    board.chip.limits = Limits()
    board.run_for(0.1)


@pytest.mark.parametrize(
    "limits",
    [{"instructions": 0}, {"terminal_bytes": -1}, {"wall_s": float("nan")}, {"resets_per_s": 1_000_000}],
)
def test_impossible_limits_are_refused(limits: dict[str, Any], words: Words) -> None:
    with pytest.raises(InputError) as caught:
        replace(Limits(), **limits)

    assert caught.value.kind == "out_of_range"
    assert next(iter(limits)) in str(caught.value)
    words("run", str(caught.value))


def test_limits_are_parsed_from_text() -> None:
    assert parse_limits(["wall_s=0.5", "instructions=1000"]) == Limits(wall_s=0.5, instructions=1000)


@pytest.mark.parametrize(
    ("setting", "kind"),
    [
        ("wall=60", "unknown_limit"),
        ("wall_s=long", "not_a_number"),
        ("wall_s", "not_a_number"),
        ("wall_s=0", "out_of_range"),
    ],
)
def test_invalid_limit_text_is_refused(setting: str, kind: str, words: Words) -> None:
    with pytest.raises(InputError) as caught:
        parse_limits([setting])

    assert caught.value.kind == kind
    words("run", str(caught.value))


def fcu_run(*arguments: str | Path) -> tuple[int, str]:
    """Return the exit code and the last line of stderr."""
    command = [sys.executable, "-m", "fcu_emulator", "run", *map(str, arguments)]
    done = subprocess.run(
        command, capture_output=True, text=True, stdin=subprocess.DEVNULL, timeout=60, check=False
    )
    return done.returncode, done.stderr.splitlines()[-1]


def test_command_prints_stop_reason_in_one_line(tmp_path: Path, words: Words) -> None:
    file = tmp_path / "loop.bin"
    file.write_bytes(COUNTS)

    code, line = fcu_run(file, "--speed", "max", "--limit", "instructions=1000000")

    assert code == 3
    words("run", line)


def test_python_firmware_limit_is_checked_between_slices(words: Words) -> None:
    code, line = fcu_run("lab3", "--duration", "5s", "--limit", "terminal_bytes=100")

    assert code == 3
    words("run", line)
