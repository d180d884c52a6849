"""Firmware with the highest cost for the emulator: its slow paths call few Python functions, and a limit ends it."""

from __future__ import annotations

import re
import subprocess
import sys
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from types import FrameType
from typing import Any

import pytest

from fcu_emulator import Board
from fcu_emulator.emulator.chip.firmware import WORK_PER_S, Limits
from fcu_emulator.emulator.clock import PS_PER_MS
from fcu_emulator.emulator.errors import LimitError
from fcu_emulator.emulator.grading.judge import judge
from fcu_emulator.emulator.grading.rubric import load_rubric
from fcu_emulator.emulator.grading.verdict import Verdict
from fcu_emulator.emulator.trace import DeviceNote, GpioEdge
from tests.support.arm.heavy_programs import all_programs, mixtures
from tests.support.arm.hostile_programs import RAM, board_with, program, put, word
from tests.support.words import Words

PROGRAMS = all_programs()
BEGUN_PS = PS_PER_MS // 2
"""Time at which the PLL runs and the loop has begun."""
LOW = 8_000_000
"""A limit that is exceeded within a few milliseconds."""
ONE_RUN = 5_000_000
"""Amount by which the limit may be exceeded, because changing code is counted at the end of a run of instructions."""


def calls_of(action: Callable[[], None]) -> int:
    """Return the number of Python functions that are called."""
    count = 0

    def heard(_frame: FrameType, event: str, _argument: object) -> None:
        nonlocal count
        count += event == "call"

    sys.setprofile(heard)
    try:
        action()
    finally:
        sys.setprofile(None)
    return count


def calls_for_an_access(name: str, folder: Path) -> float:
    """Return the number of Python functions called for each access, in 0.05 ms after the loop has begun."""
    board = board_with(PROGRAMS[name], folder)
    assert board.chip is not None
    board.chip.limits = replace(Limits(), work_per_s=10**12)
    core = board.chip.core
    board.run_until_ps(BEGUN_PS)
    accesses = core.status().accesses
    calls = calls_of(lambda: board.run_until_ps(BEGUN_PS + PS_PER_MS // 20))
    return calls / max(1_000, core.status().accesses - accesses)


# -- slow paths ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "name",
    [
        *(name for name in PROGRAMS if name.startswith("unmapped: a ")),
        *("unmapped: SDIO is read", "unmapped: SPI4 is written", "unmapped: private space is read"),
        *("unmapped: bit-band of a reserved block", "unaligned register", "bit-band: RAM"),
    ],
)
def test_access_to_missing_register_calls_python_once(name: str, tmp_path: Path) -> None:
    assert calls_for_an_access(name, tmp_path) < 0.05


@pytest.mark.parametrize("name", ["RCC: CR", "PWR", "FLASH", "ADC1", "CRC", "IWDG", "DBGMCU"])
def test_polling_of_register_calls_python_once(name: str, tmp_path: Path) -> None:
    polled = f"{name} is read" if name == "RCC: CR" else f"{name}: read"

    assert calls_for_an_access(polled, tmp_path) < 0.05


@pytest.mark.parametrize("name", [name for name in PROGRAMS if name.startswith(("GPIO", "bit-band: GPIO"))])
def test_pins_are_set_up_and_toggled_without_python(name: str, tmp_path: Path) -> None:
    """Exceptions are pins to which a sensor is connected, such as chip selects."""
    sensors = {"GPIO: sixteen pins of port B toggle", "GPIO: MODER of sixteen pins"}

    assert calls_for_an_access(name, tmp_path) < (20 if name in sensors else 0.05)


@pytest.mark.parametrize("name", [name for name in PROGRAMS if name.startswith("RCC")])
def test_change_of_clocks_calls_few_python_functions(name: str, tmp_path: Path) -> None:
    """The count includes the calls for all peripherals that a change of frequency affects."""
    assert calls_for_an_access(name, tmp_path) < 35


def test_trace_contains_latest_edges_in_order(tmp_path: Path) -> None:
    """The latest edges are kept in order; earlier edges are only counted."""
    board = board_with(PROGRAMS["GPIO: one output toggles by ODR"], tmp_path)

    board.run_for(0.02)

    edges = board.trace.of(GpioEdge)
    times = [edge.t_ps for edge in edges]
    assert len(board.trace) == 200_000
    assert board.trace.dropped > 200_000
    assert (times, times[-1] > board.clock.now_ps - PS_PER_MS) == (sorted(times), True)
    assert {edge.pin for edge in edges} == {"PC0"}
    assert all(one.level != other.level for one, other in pairwise(edges))


def test_edges_reach_subscriber_when_they_happen(tmp_path: Path) -> None:
    board = board_with(PROGRAMS["GPIO: one output toggles by ODR"], tmp_path)
    board.run_for(0.001)
    before = len(board.trace.of(GpioEdge))
    heard: list[tuple[int, int]] = []

    stop = board.trace.subscribe(lambda event: heard.append((event.t_ps, board.clock.now_ps)), detail=False)
    board.run_for(0.0001)
    stop()

    assert len(heard) == len(board.trace.of(GpioEdge)) - before > 1_000
    assert all(at_ps == now_ps for at_ps, now_ps in heard)


def test_python_register_is_read_again_after_write(tmp_path: Path) -> None:
    """The read returns the latest value of PWR_CR, however many polls came before."""
    source = "reset:\n" + put("RCC_APB1ENR", 1 << 28) + "mov32 r0, 0x40007000\nmov32 r4, RAM\n"
    for value in (0x100, 0x000, 0x110):
        source += f"mov32 r1, {value}\nstr r1, [r0]\n" + "ldr r2, [r0]\n" * 8 + "str r2, [r4]\nadds r4, #4\n"
    board = board_with(program(source + "b ."), tmp_path)

    board.run_for(0.001)

    assert [word(board, RAM + 4 * n) & 0x1F0 for n in range(3)] == [0x100, 0x000, 0x110]


def test_missing_clock_is_noted_after_missing_register(tmp_path: Path) -> None:
    """The same address has no register while CRC has a clock, and later CRC has no clock."""
    access = "mov32 r0, 0x40023080\n" + "ldr r1, [r0]\nstr r1, [r0]\n" * 3
    source = f"reset:\n{put('RCC_AHB1ENR', 1 << 12)}{access}{put('RCC_AHB1ENR', 0)}{access}b ."
    board = board_with(program(source), tmp_path)

    board.run_for(0.001)

    notes = [(note.what, note.device) for note in board.trace.of(DeviceNote)]
    assert notes == [("not modelled", "CRC"), ("forbidden", "CRC"), ("forbidden", "CRC")]  # read, written


# -- the limit ----------------------------------------------------------------------------------------------


def stopped(data: bytes, folder: Path, slice_s: float = 1.0, **limits: Any) -> tuple[LimitError, Board]:
    board = board_with(data, folder)
    assert board.chip is not None
    board.chip.limits = replace(Limits(), **limits)
    while True:
        try:
            board.run_for(slice_s)
        except LimitError as error:
            return error, board


@pytest.mark.parametrize(
    ("name", "costliest"),
    [
        ("RCC: HPRE flips", "accesses to RCC"),
        ("RCC: APB1ENR flips", "accesses to RCC"),
        ("CRC: DR", "accesses to CRC"),
        ("GPIO: sixteen outputs toggle", "accesses to GPIOC"),
        ("unmapped: bus fault", "exceptions BusFault"),
        ("unmapped: BusFault in its handler", "exceptions BusFault"),
        ("timers: interrupt storm", "accesses to TIM2"),
        ("reset: AIRCR", "resets"),
        ("arithmetic", "instructions"),
        ("code in RAM rewrites itself", "instructions"),
    ],
)
def test_excessive_work_ends_run_with_cause(name: str, costliest: str, tmp_path: Path) -> None:
    error, board = stopped(PROGRAMS[name], tmp_path, work_per_s=LOW, resets_per_s=9_999)

    assert error.limit == "work_per_s"
    assert f" {costliest} in " in str(error)
    assert "too much work" in str(error)
    assert "\n" not in str(error)
    assert board.chip is not None
    assert board.chip.core.work < LOW * (1 + board.now_s + 0.01) + ONE_RUN


def test_work_limit_ends_at_same_instruction(tmp_path: Path) -> None:
    ends = set()
    for slice_s in (1.0, 0.01, 1.0):
        error, board = stopped(PROGRAMS["RCC: HPRE flips"], tmp_path, slice_s, work_per_s=LOW)
        assert board.chip is not None
        ends.add((board.clock.now_ps, board.chip.core.retired, str(error)))

    assert len(ends) == 1


def test_raised_work_limit_continues_run(tmp_path: Path) -> None:
    _, board = stopped(PROGRAMS["RCC: HPRE flips"], tmp_path, work_per_s=LOW)
    assert board.chip is not None
    with pytest.raises(LimitError):
        board.run_for(0.001)

    board.chip.limits = replace(Limits(), work_per_s=10**12)
    end_ps = board.clock.now_ps + PS_PER_MS
    board.run_until_ps(end_ps)

    assert board.clock.now_ps == end_ps


@pytest.mark.parametrize("data", mixtures(12).values(), ids=mixtures(12).keys())
def test_random_peripheral_accesses_take_bounded_work(data: bytes, tmp_path: Path) -> None:
    board = board_with(data, tmp_path)
    assert board.chip is not None
    board.chip.limits = replace(Limits(), work_per_s=LOW, resets_per_s=9_999)
    with suppress(LimitError):
        board.run_for(0.05)

    assert board.chip.core.work < 1.06 * LOW + ONE_RUN


@pytest.mark.parametrize("wiring", ["lab3", "fcu001v1"])
def test_solution_needs_small_fraction_of_work_limit(wiring: str) -> None:
    board = Board(firmware="solution", wiring=wiring, scenario="desk")

    board.run_for(1.5)

    assert board.chip is not None
    assert 20 * board.chip.core.work < WORK_PER_S * board.now_s


def test_run_command_stops_at_work_limit(tmp_path: Path, words: Words) -> None:
    file = tmp_path / "clocks.bin"
    file.write_bytes(PROGRAMS["RCC: HPRE flips"])
    command = [sys.executable, "-m", "fcu_emulator", "run", str(file), "--speed", "max"]

    done = subprocess.run(
        [*command, "--limit", f"work_per_s={LOW}"],
        capture_output=True,
        text=True,
        stdin=subprocess.DEVNULL,
        timeout=60,
        check=False,
    )

    assert done.returncode == 3
    words("run", re.sub(r"\d[\d.,]*", "N", done.stderr.splitlines()[-1]))


# -- in grading ---------------------------------------------------------------------------------------------

RUBRIC = f"""
schema = 1
title = "Work"
[limits]
work_per_s = {LOW}
[run.short]
question = "Does it run?"
duration = "2s"
[[exercise]]
id = "1"
title = "Runs"
run = "short"
[[exercise.check]]
id = "runs"
title = "It does not crash"
expect = [{{ kind = "no_fault" }}]
"""


def verdict_of(name: str, folder: Path) -> Verdict:
    rubric, firmware = folder / "work.toml", folder / "program.bin"
    rubric.write_text(RUBRIC)
    firmware.write_bytes(PROGRAMS[name])
    return judge(firmware, load_rubric(rubric), seed=1)


@pytest.mark.parametrize("name", ["RCC: HPRE flips", "unmapped: bus fault", "timers: interrupt storm"])
def test_too_slow_program_gets_final_verdict(name: str, tmp_path: Path) -> None:
    """The verdict is final: the store keeps it, because the next run would end at the same instruction."""
    verdict = verdict_of(name, tmp_path)
    (check,) = verdict.checks

    assert (check.outcome, verdict.counts, verdict.unjudged) == ("failed", True, ())
    assert "too much work" in check.actual
    assert "too much work" in verdict.evidence[0].stopped
    assert verdict_of(name, tmp_path) == verdict
