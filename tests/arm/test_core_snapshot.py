"""Snapshots of the chip in C: run, restore, and run again give the same result."""

from __future__ import annotations

from hypothesis import given, settings
from hypothesis import strategies as st

from fcu_emulator.emulator.chip.memory_map import RAM
from tests.support.arm.core_bench import CoreBench
from tests.support.arm.core_programs import interrupted_core

END_US = 20_000


def picture(core: CoreBench) -> tuple[object, ...]:
    """Return registers, memory, exceptions and time. The log of the program is kept in Python."""
    inner = core.core
    return (
        inner.core_state(),
        core.floating_point(),
        bytes(inner.ram),
        inner.active,
        inner.retired,
        inner.now_ps,
    )


@given(
    first_us=st.integers(0, END_US),
    meanwhile_us=st.integers(1, END_US),
)
@settings(max_examples=25, deadline=None)
def test_restored_core_repeats_its_run(first_us: int, meanwhile_us: int) -> None:
    core = interrupted_core([], 10**9)
    core.run_us(first_us)
    saved = core.core.snapshot()
    before, now_ps, registers = picture(core), core.clock.now_ps, dict(core.probe.registers)
    core.run_us(first_us + meanwhile_us)
    once = picture(core)
    core.core.restore(saved)
    core.clock.now_ps = now_ps
    core.probe.registers = registers
    assert picture(core) == before
    core.run_us(first_us + meanwhile_us)

    assert picture(core) == once


def test_restored_code_in_ram_is_decoded_again() -> None:
    core = CoreBench("reset: mov32 r3, RAM+1\nloop: blx r3\n b loop")
    core.core.ram[0:4] = bytes.fromhex("01 30 70 47")  # ADDS R0, #1; BX LR
    core.run_us(100)
    saved = core.core.snapshot()
    core.core.ram[0:4] = bytes.fromhex("02 31 70 47")  # ADDS R1, #2; BX LR
    core.core.invalidate_code()
    core.run_us(200)
    assert core.register(1) > 0
    before = core.register(0)
    core.core.restore(saved)
    core.run_us(300)

    assert core.word(RAM) == 0x47703001
    assert core.register(0) > before
    assert core.register(1) == 0
