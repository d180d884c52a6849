"""Optimisations of the chip do not change results: skipped or executed waiting, ports read from memory or not."""

from __future__ import annotations

from functools import partial
from pathlib import Path

import pytest

from fcu_emulator.emulator.clock import PS_PER_MS, PS_PER_US
from fcu_emulator.firmware_model.arm import prebuilt
from tests.support.arm.speed_bench import Chip, Result
from tests.support.arm.speed_programs import (
    COUNTS_IN_RAM,
    I2C_BY_DMA,
    I2C_BY_INTERRUPT,
    LOSES_THE_CLOCK,
    POLLS_A_PIN,
    READS_PARTS,
    SHOWS_A_PIN,
    program,
)

RAM = 0x2000_0000


def file(tmp_path: Path, source: str) -> Path:
    path = tmp_path / "program.bin"
    path.write_bytes(program(source))
    return path


def word(result: Result, address: int) -> int:
    return int.from_bytes(result.ram[address - RAM :][:4], "little")


def register(result: Result, number: int) -> int:
    return int.from_bytes(result.registers[4 * number :][:4], "little")


@pytest.mark.parametrize(("bus", "wiring", "calls"), [("I2C2", "lab3", 24), ("SPI2", "fcu001v1", 24)])
def test_skipping_does_not_change_solution(bus: str, wiring: str, calls: int) -> None:
    """The run has the boot and some callbacks. Text, transfers, times, LEDs, registers, RAM and counts are compared."""
    results = []
    for skip in (True, False):
        chip = Chip(prebuilt("solution", bus), wiring, skip=skip)
        chip.run_until_ps(1_120 * PS_PER_MS)
        results.append(chip.result())

    assert results[0] == results[1]
    assert results[0].terminal.count(b"initialized and enabled") == 5
    assert len(results[0].transfers) > calls * (4 if bus == "I2C2" else 21)


@pytest.mark.parametrize("source", [I2C_BY_INTERRUPT, I2C_BY_DMA], ids=["interrupts", "dma"])
def test_skipping_does_not_change_interrupt_transfers(tmp_path: Path, source: str) -> None:
    """RM0368 18.3.3, 18.3.7: the main program waits for a variable that a handler sets."""
    results = []
    for skip in (True, False):
        chip = Chip(file(tmp_path, source), skip=skip)
        chip.run_until_ps(20 * PS_PER_MS)
        results.append(chip.result())

    assert results[0] == results[1]
    whole = [read for _, _, address, written, read in results[0].transfers if address == 0x6B]
    assert len(whole) > 100
    assert {len(read) for read in whole} == {2}
    assert word(results[0], RAM + 8) == int.from_bytes(whole[-1], "little")
    assert word(results[0], RAM + 12) == sum(int.from_bytes(read, "little") for read in whole)


@pytest.mark.parametrize("source", [POLLS_A_PIN, SHOWS_A_PIN], ids=["counts laps", "shows the pin"])
@pytest.mark.parametrize("skip", [True, False])
def test_polled_pin_edge_is_seen_in_same_pass(tmp_path: Path, source: str, *, skip: bool) -> None:
    """Edges occur between passes. Before, thousands of passes have read the port. Every pass or none writes to it."""
    chip = Chip(file(tmp_path, source), skip=skip)
    edges_us = (3_000, 3_001, 5_000, 5_777, 9_000)
    for number, at_us in enumerate(edges_us):
        change = partial(chip.board.gpio.drive, "A", 0, number % 2 ^ 1)
        chip.board.clock.schedule(at_us * PS_PER_US, change)
    chip.run_until_ps(10 * PS_PER_MS)
    lap_us = 8 * 1.3 / 16  # instructions, cycles, MHz

    result = chip.result()
    if source is SHOWS_A_PIN:
        seen = [edge for edge in result.edges if "PB5" in edge]
        assert len(seen) == 1 + len(edges_us)
    else:
        high_us = (3_001 - 3_000) + (5_777 - 5_000) + (10_000 - 9_000)
        assert register(result, 5) == pytest.approx(high_us / (6 * 1.3 / 16), abs=len(edges_us))
        assert register(result, 4) > 10_000 / lap_us


def test_waiting_for_pin_is_skipped_despite_port_writes(tmp_path: Path) -> None:
    """Writes that do not change a port do not end the wait. An edge is visible in the pass in which it occurs."""
    results, skipped = [], []
    for skip in (True, False):
        chip = Chip(file(tmp_path, SHOWS_A_PIN), skip=skip)
        for number, at_ms in enumerate((3, 500, 501, 1_400)):
            change = partial(chip.board.gpio.drive, "A", 0, number % 2 ^ 1)
            chip.board.clock.schedule(at_ms * PS_PER_MS + 123_457, change)
        chip.run_until_ps(2_000 * PS_PER_MS)
        results.append(chip.result())
        skipped.append(chip.core.skipped / chip.core.retired)

    assert results[0] == results[1]
    assert skipped[0] > 0.999
    assert skipped[1] == 0


@pytest.mark.parametrize("skip", [True, False])
def test_loop_that_changes_only_memory_is_executed(tmp_path: Path, *, skip: bool) -> None:
    """Each pass has six instructions, at 16 MHz and 1.3 cycles each."""
    chip = Chip(file(tmp_path, COUNTS_IN_RAM), skip=skip)
    chip.run_until_ps(10 * PS_PER_MS)

    assert word(chip.result(), RAM) == pytest.approx(10_000 * 16 / 1.3 / 6, abs=5)


@pytest.mark.parametrize("skip", [True, False])
def test_polled_port_without_clock_reads_zero(tmp_path: Path, *, skip: bool) -> None:
    """RM0368 6.3.9: a register that was read from memory just before is read from the peripheral again."""
    chip = Chip(file(tmp_path, LOSES_THE_CLOCK), skip=skip)
    chip.board.gpio.drive("A", 0, 1)
    chip.run_until_ps(10 * PS_PER_MS)

    result = chip.result()
    assert register(result, 4) & 1 == 1
    assert register(result, 5) == 0
    assert register(result, 6) == register(result, 4)


@pytest.mark.parametrize("skip", [True, False])
def test_parts_of_polled_register_are_read_correctly(tmp_path: Path, *, skip: bool) -> None:
    """Reset values of MODER and OSPEEDR, RM0368 8.4.1 and 8.4.3."""
    chip = Chip(file(tmp_path, READS_PARTS), skip=skip)
    chip.run_until_ps(10 * PS_PER_MS)

    values = [register(chip.result(), number) for number in (4, 5, 6, 7)]
    assert values == [0xA800_0000, 0xA8, 0xA800, 0x000C_0000]
