"""Selection and time of exceptions: priorities, masks, tail-chaining, late arrival (ARMv7-M ARM B1.5)."""

from __future__ import annotations

import pytest

from tests.support.arm.core_bench import (
    CHAIN_CYCLES,
    ENTRY_CYCLES,
    RETURN_CYCLES,
    CoreBench,
    interrupts,
    store,
)
from tests.support.arm.core_interrupts import bench


def order(priorities: dict[int, int], *pulses: tuple[float, int], before: str = "") -> list[int]:
    """Return the log after these pulses (time in us, interrupt)."""
    core = bench(priorities, before)
    for time_us, number in pulses:
        core.pulse_at_us(time_us, number)
    core.run_us(1000)
    return core.values[1:]


def test_more_urgent_interrupt_preempts_handler() -> None:
    """B1.5.4: an exception preempts code whose execution priority is a larger number."""
    assert order({0: 0x40, 1: 0x20}, (200, 0), (240, 1)) == [10, 20, 21, 11]


@pytest.mark.parametrize("second", [0x40, 0x60])
def test_interrupt_of_equal_or_lower_priority_waits(second: int) -> None:
    """B1.5.4: the interrupt waits until the handler returns."""
    assert order({0: 0x40, 1: second}, (200, 0), (240, 1)) == [10, 11, 20, 21]


def test_three_priority_levels_nest() -> None:
    """B1.5.4: each of the three levels preempts the previous one."""
    assert order({0: 0x60, 1: 0x40, 2: 0x00}, (200, 0), (240, 1), (280, 2)) == [10, 20, 30, 31, 21, 11]


def test_more_urgent_pending_interrupt_comes_first() -> None:
    """B1.5.4: the pending exception with the lowest priority number is taken first."""
    assert order({0: 0x40, 1: 0x30}, (200, 0), (200, 1)) == [20, 21, 10, 11]


def test_lower_number_comes_first_with_equal_priorities() -> None:
    """B1.5.4: "the exception with the lowest exception number"."""
    assert order({0: 0x40, 1: 0x40}, (200, 1), (200, 0)) == [10, 11, 20, 21]


def test_subpriority_determines_order_but_not_preemption() -> None:
    """B1.5.4, B3.2.6: with PRIGROUP 5, bits 7 and 6 are the group, so 0x50 and 0x40 are in one group."""
    grouped = store("AIRCR", 0x05FA_0500)

    assert order({0: 0x50, 1: 0x40}, (200, 0), (240, 1), before=grouped) == [10, 11, 20, 21]
    assert order({0: 0x50, 1: 0x40}, (200, 0), (200, 1), before=grouped) == [20, 21, 10, 11]


def test_prigroup_3_gives_four_bits_to_group() -> None:
    """PM0214 table 51. The HAL's NVIC_PRIORITYGROUP_4 selects this setting."""
    assert order({0: 0x50, 1: 0x40}, (200, 0), (240, 1), before=store("AIRCR", 0x05FA_0300)) == [
        10,
        20,
        21,
        11,
    ]


def test_prigroup_7_lets_no_interrupt_preempt_another() -> None:
    """B3.2.6: no bit of the priority is group priority."""
    assert order({0: 0xF0, 1: 0x00}, (200, 0), (240, 1), before=store("AIRCR", 0x05FA_0700)) == [
        10,
        11,
        20,
        21,
    ]


def test_aircr_without_its_key_changes_nothing() -> None:
    """B3.2.6: VECTKEY 0x05FA is required."""
    assert order({0: 0x50, 1: 0x40}, (200, 0), (240, 1), before=store("AIRCR", 0x05FB_0700)) == [
        10,
        20,
        21,
        11,
    ]


def test_priorities_have_four_bits() -> None:
    """PM0214 4.3.7: the low four bits read as zero, so 0x4F and 0x40 are equal."""
    assert order({0: 0x4F, 1: 0x40}, (200, 0), (240, 1)) == [10, 11, 20, 21]


# -- chaining -------------------------------------------------------------------------------------------


def test_pending_interrupt_is_tail_chained() -> None:
    """B1.5.12: tail-chaining omits unstacking and stacking between handlers, so it takes 6 cycles instead of 22."""
    core = bench({1: 0x40, 2: 0x40})
    core.pulse_at_us(200, 1)
    core.pulse_at_us(240, 2)
    core.run_us(1000)

    assert (
        core.time_us(30) - core.time_us(21) == 1 + 1 + CHAIN_CYCLES + 3
    )  # the store, BX, the chain, three instructions of the log


def test_exception_entry_takes_12_and_return_10_cycles() -> None:
    """Cortex-M4 technical reference manual section 3.9: entry takes 12 cycles, return 10."""
    program = f"reset: {interrupts({2: 0})} log 1\n log 2\n log 3\n log 4\n b .\n irq2: bx lr\n"
    core, undisturbed = CoreBench(program), CoreBench(program)
    undisturbed.run_us(100)
    times_us = [at for at, _ in undisturbed.log_us]
    core.pulse_at_us(times_us[1] + 1, 2)
    core.run_us(100)

    late_us = ENTRY_CYCLES + 1 + RETURN_CYCLES
    assert [at for at, _ in core.log_us] == [*times_us[:2], times_us[2] + late_us, times_us[3] + late_us]


@pytest.mark.parametrize("delay", [1, 6, 11, 12])
def test_more_urgent_interrupt_during_entry_is_taken_first(delay: int) -> None:
    """B1.5.11: a more urgent exception that arrives while the frame is saved is taken in place of the first."""
    core = bench({0: 0x40, 2: 0x20})
    core.pulse_at_us(200, 0)
    core.pulse_at_us(200 + delay, 2)
    core.run_us(1000)

    assert core.values[1:] == [30, 31, 10, 11]
    assert core.time_us(30) == 200 + ENTRY_CYCLES + 3


def test_interrupt_after_entry_preempts_handler() -> None:
    """B1.5.11: the second interrupt arrives too late to be taken in place of the first."""
    core = bench({0: 0x40, 2: 0x20})
    core.pulse_at_us(200, 0)
    core.pulse_at_us(200 + ENTRY_CYCLES + 1, 2)
    core.run_us(1000)

    assert core.values[1:] == [30, 31, 10, 11]
    assert core.time_us(30) == 200 + 2 * ENTRY_CYCLES + 1 + 3


def test_interrupt_pended_by_handler_comes_after_handler() -> None:
    """B3.4.5: a handler usually passes work to a lower priority by NVIC_ISPR."""
    core = CoreBench(
        f"""
reset: {interrupts({3: 0x20, 2: 0x40})}
       {store("ISPR", 8)} log 1
       b .
irq3:  log 40
       {store("ISPR", 4)} log 41
       bx lr
irq2:  log 30
       bx lr
"""
    )
    core.run_us(300)

    assert core.values == [40, 41, 30, 1]
