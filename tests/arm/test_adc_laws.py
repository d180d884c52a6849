"""ADC1, its triggers and DMA: the results depend neither on the division of a run nor on snapshots."""

from __future__ import annotations

import ctypes
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fcu_emulator import Board
from fcu_emulator.emulator.chip.memory_map import RAM
from fcu_emulator.emulator.clock import PS_PER_MS, PS_PER_US
from tests.support.arm.adc_bench import (
    ADC_ADDRESS,
    ADON,
    CCR,
    CONT,
    CR1,
    CR2,
    DDS,
    DMA,
    DR,
    EOCIE,
    HTR,
    JAUTO,
    JSQR,
    JSWSTART,
    LTR,
    SCAN,
    SQR1,
    SQR3,
    SR,
    SWSTART,
    DmaResults,
)
from tests.support.arm.chip_fakes import NativeChip
from tests.support.arm.heavy_programs import endless, put
from tests.support.arm.hostile_programs import board_with

TIM1, TIM2, TIM3 = 0x4001_0000, 0x4000_0000, 0x4000_0400
TIMERS = ("TIM1", "TIM2", "TIM3")
REGISTERS = (*range(0, 0x50, 4), CCR)

controls = st.builds(
    lambda bits, triggers: ADON | bits | triggers,
    st.sets(st.sampled_from([CONT, DMA, DDS, 1 << 10, 1 << 11, SWSTART, JSWSTART])).map(sum),
    st.tuples(st.integers(0, 3), st.integers(0, 15), st.integers(0, 3), st.integers(0, 15)).map(
        lambda fields: fields[0] << 28 | fields[1] << 24 | fields[2] << 20 | fields[3] << 16
    ),
)
modes = st.sets(
    st.sampled_from([EOCIE, 1 << 6, 1 << 7, SCAN, 1 << 9, JAUTO, 1 << 11, 1 << 12, 1 << 22, 1 << 23, 1 << 26])
)
writes = st.one_of(
    st.tuples(st.just("ADC1"), st.just(CR2), controls),
    st.tuples(st.just("ADC1"), st.just(CR1), modes.map(sum)),
    st.tuples(st.just("ADC1"), st.just(SR), st.integers(0, 0x3F)),
    st.tuples(st.just("ADC1"), st.just(SQR1), st.integers(0, 3).map(lambda length: length << 20)),
    st.tuples(st.just("ADC1"), st.sampled_from([SQR3, JSQR]), st.integers(0, 0x3F_FFFF)),
    st.tuples(st.just("ADC1"), st.sampled_from([HTR, LTR]), st.integers(0, 4095)),
    st.tuples(st.just("ADC1"), st.just(CCR), st.integers(0, 3).map(lambda prescaler: prescaler << 16)),
    st.tuples(st.just("ADC1"), st.just(DR), st.none()),
    st.tuples(st.sampled_from(TIMERS), st.just(0x00), st.sampled_from([0, 1, 0x11, 0x61, 9])),
    st.tuples(st.sampled_from(TIMERS), st.just(0x04), st.integers(0, 7).map(lambda mode: mode << 4)),
    st.tuples(st.sampled_from(TIMERS), st.just(0x14), st.integers(0, 3)),
    st.tuples(
        st.sampled_from(TIMERS), st.just(0x18), st.integers(0, 0x7F).map(lambda mode: mode << 8 | mode)
    ),
    st.tuples(st.sampled_from(TIMERS), st.just(0x20), st.sampled_from([0, 0x1111, 0x3333])),
    st.tuples(st.sampled_from(TIMERS), st.sampled_from([0x24, 0x2C, 0x34, 0x38]), st.integers(0, 900)),
    st.tuples(st.just("EXTI"), st.just(0x10), st.sampled_from([1 << 11, 1 << 15, 0])),
    st.tuples(st.just("EXTI"), st.just(0x04), st.sampled_from([1 << 11 | 1 << 15, 0])),
)
steps = st.lists(st.tuples(writes, st.integers(0, 40 * PS_PER_US)), min_size=1, max_size=20)
"""A write, or a read of DR, and the time until the next one."""


class Machine:
    """A chip with changing voltages, running timers, and a circular DMA stream."""

    def __init__(self) -> None:
        self.chip = NativeChip()
        for channel in range(0, 16, 2):
            self.chip.adc.inputs.connect(channel, lambda n=channel: self._volts(n))
        for channel in range(1, 16, 2):
            self.chip.adc.inputs.connect(channel, channel / 5)
        self.results = DmaResults(self.chip, 16, circular=True)
        for name in TIMERS:
            for offset, value in ((0x2C, 500), (0x34, 100), (0x38, 300), (0x44, 1 << 15), (0x00, 1)):
                self.chip[name].write(offset, value)
        self.read: list[int] = []

    def _volts(self, channel: int) -> float:
        return (self.chip.clock.now_ps // 1000 + 333 * channel) % 3300 / 1000

    def do(self, name: str, offset: int, value: int | None) -> None:
        if value is None:
            self.read.append(self.chip[name].read(offset))
        else:
            self.chip[name].write(offset, value)

    def seen(self) -> tuple[object, ...]:
        """Return registers, interrupts, and the memory that DMA has written."""
        adc = [self.chip.adc.peek(offset) for offset in REGISTERS]
        timers = [self.chip[name].peek(offset) for name in TIMERS for offset in (0x00, 0x10, 0x24)]
        memory = bytes(self.chip.fcu.ram[:64])
        return adc, timers, memory, self.chip.irq.rises, self.read, self.chip.clock.now_ps


@settings(max_examples=300, deadline=None)
@given(steps, st.lists(st.integers(1, 20 * PS_PER_US), min_size=1, max_size=8))
def test_any_division_of_run_gives_same_results(
    actions: list[tuple[tuple[str, int, int | None], int]], pieces: list[int]
) -> None:
    whole, divided = Machine(), Machine()
    for action, wait_ps in actions:
        whole.do(*action)
        whole.chip.run_for(wait_ps)
        divided.do(*action)
        end_ps = whole.chip.clock.now_ps
        for piece_ps in [*pieces, wait_ps]:
            divided.chip.run_to(min(divided.chip.clock.now_ps + piece_ps, end_ps))
        assert divided.seen() == whole.seen()


@settings(max_examples=100, deadline=None)
@given(steps, steps, steps)
def test_restored_chip_repeats_conversions(
    before: list[tuple[tuple[str, int, int | None], int]],
    meanwhile: list[tuple[tuple[str, int, int | None], int]],
    after: list[tuple[tuple[str, int, int | None], int]],
) -> None:
    machine = Machine()
    chip = machine.chip.fcu

    def run(actions: list[tuple[tuple[str, int, int | None], int]]) -> tuple[object, ...]:
        machine.read.clear()
        machine.chip.irq.rises.clear()
        for action, wait_ps in actions:
            machine.do(*action)
            machine.chip.run_for(wait_ps)
        adc, timers, memory, rises, read, now_ps = machine.seen()
        return adc, timers, memory, list(rises), list(read), now_ps  # type: ignore[call-overload]

    run(before)
    saved = ctypes.create_string_buffer(chip.library.fcu_snapshot_size())
    chip.library.fcu_save(chip.handle, saved)
    now_ps, levels = chip.clock.now_ps, dict(machine.chip.irq._levels)
    once = run(after)
    run(meanwhile)
    chip.library.fcu_restore(chip.handle, saved)
    chip.clock.now_ps = now_ps
    machine.chip.irq._levels = levels
    assert run(after) == once


# -- firmware -----------------------------------------------------------------------------------------------


def sampling_program(loop: str) -> bytes:
    """Return a program in which updates of TIM2 start scans of channels 1, 9, 2 and 3 into a circular buffer."""
    dma, timer = 0x4002_6400, TIM2
    before = put(timer + 0x2C, 1679) + put(timer + 4, 2 << 4) + put(timer, 1)
    before += put(dma + 0x14, 256) + put(dma + 0x18, ADC_ADDRESS + DR) + put(dma + 0x1C, RAM + 0x100)
    before += put(dma + 0x10, 1 << 13 | 1 << 11 | 1 << 10 | 1 << 8 | 1)
    before += put(ADC_ADDRESS + CCR, 1 << 16) + put(ADC_ADDRESS + SQR1, 3 << 20)
    before += put(ADC_ADDRESS + SQR3, 1 | 9 << 5 | 2 << 10 | 3 << 15) + put(ADC_ADDRESS + CR1, SCAN)
    before += put(ADC_ADDRESS + CR2, 6 << 24 | 1 << 28 | DDS | DMA | ADON)
    return endless(loop, before)


POLLS = "mov32 r0, 0x40026414\nldr r1, [r0]\nmov32 r0, 0x20000200\nldrh r2, [r0]\nadds r3, r3, r2"
LOOPS = {"wfi": "wfi", "counts": "adds r3, #1", "polls NDTR": POLLS}


def sampling_board(loop: str, folder: Path, *, skip: bool = True) -> Board:
    board = board_with(sampling_program(LOOPS[loop]), folder)
    assert board.chip is not None
    clock, inputs = board.clock, board.chip.chip.adc.inputs
    inputs.connect(1, lambda: clock.now_ps % PS_PER_MS / PS_PER_MS)
    inputs.connect(2, 2.5)
    if not skip:
        board.chip.core.library.fcu_configure(board.chip.core.handle, 13, 10, 0)
    return board


def seen(board: Board) -> tuple[object, ...]:
    assert board.chip is not None
    core = board.chip.core
    return core.core_state(), bytes(core.ram), core.retired, board.clock.now_ps


@pytest.mark.parametrize("loop", LOOPS)
def test_firmware_samples_same_bytes_in_divided_run(loop: str, tmp_path: Path) -> None:
    whole, divided = sampling_board(loop, tmp_path), sampling_board(loop, tmp_path)
    unskipped = sampling_board(loop, tmp_path, skip=False)
    whole.run_until_ps(8 * PS_PER_MS)
    unskipped.run_until_ps(8 * PS_PER_MS)
    while divided.clock.now_ps < 8 * PS_PER_MS:
        divided.run_until_ps(min(divided.clock.now_ps + 77_777_777, 8 * PS_PER_MS))

    assert any(bytes(whole.chip.core.ram[0x100:0x300]))
    assert seen(divided) == seen(whole) == seen(unskipped)


@pytest.mark.parametrize("loop", LOOPS)
def test_snapshot_of_board_includes_adc_and_voltages(loop: str, tmp_path: Path) -> None:
    board = sampling_board(loop, tmp_path)
    assert board.chip is not None
    inputs = board.chip.chip.adc.inputs
    board.run_until_ps(5 * PS_PER_MS + 123_456)
    snapshot = board.snapshot()
    board.run_until_ps(8 * PS_PER_MS)
    once = seen(board)
    inputs.battery_v = 3.0
    inputs.connect(1, 0.5)
    inputs.connect(2, lambda: 0.5)
    board.run_until_ps(9 * PS_PER_MS)
    board.restore(snapshot)
    assert inputs.battery_v == 3.7
    board.run_until_ps(8 * PS_PER_MS)

    assert seen(board) == once
