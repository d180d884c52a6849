"""Masking of interrupts: PRIMASK, BASEPRI, FAULTMASK, enable bits; and lines that stay active.

ARMv7-M ARM B1.4.3, B3.4; PM0214 4.3.9.
"""

from __future__ import annotations

import pytest

from fcu_emulator.emulator.chip.memory_map import RAM
from tests.support.arm.core_bench import ENTRY_CYCLES, CoreBench, interrupts, store
from tests.support.arm.core_interrupts import HANDLERS, bench


def masked(mask: str, unmask: str, priorities: dict[int, int], number: int = 2) -> CoreBench:
    """Return a program that makes ``number`` pending between ``mask`` and ``unmask``."""
    pend = store("ISPR", 1 << number)
    program = f"reset: {interrupts(priorities)} {mask}\n {pend} log 1\n {unmask}\n log 2\n b .\n{HANDLERS}"
    core = CoreBench(program)
    core.run_us(300)
    return core


@pytest.mark.parametrize(
    ("mask", "unmask"),
    [
        ("cpsid i", "cpsie i"),
        ("cpsid f", "cpsie f"),
        ("movs r2, #1\n msr primask, r2\n movs r2, #0", "msr primask, r2"),
        ("movs r2, #1\n msr faultmask, r2\n movs r2, #0", "msr faultmask, r2"),
        ("movs r2, #0x20\n msr basepri, r2\n movs r2, #0", "msr basepri, r2"),
        ("movs r2, #0x20\n msr basepri, r2\n movs r2, #0x30", "msr basepri, r2"),
    ],
)
def test_mask_delays_interrupt_until_mask_is_cleared(mask: str, unmask: str) -> None:
    """B1.4.3, B1.5.4; ARMv7-M ARM B5.2.1: CPSIE takes effect immediately, and then the interrupt is taken."""
    core = masked(mask, unmask, {2: 0x20})

    assert core.values == [1, 30, 31, 2]
    assert (
        core.time_us(30) - core.time_us(1) == 2 + ENTRY_CYCLES + 3
    )  # the store, the unmasking, entry, the log's three


def test_basepri_does_not_mask_more_urgent_interrupts() -> None:
    """B1.4.3: BASEPRI masks priorities equal to or greater than its value."""
    core = masked("movs r2, #0x30\n msr basepri, r2\n movs r2, #0", "msr basepri, r2", {2: 0x20})

    assert core.values == [30, 31, 1, 2]


def test_basepri_of_0_masks_nothing() -> None:
    """B1.4.3."""
    core = masked("movs r2, #0\n msr basepri, r2", "nop", {2: 0xF0})

    assert core.values == [30, 31, 1, 2]


def test_basepri_has_four_bits() -> None:
    """PM0214 2.1.3: the low four bits of BASEPRI are not implemented. So a value of 1 to 15 masks no interrupt."""
    core = masked("movs r2, #5\n msr basepri, r2", "nop", {2: 0xF0})

    assert core.values == [30, 31, 1, 2]


def test_basepri_max_accepts_only_more_urgent_priority() -> None:
    """B5.2.3: MSR BASEPRI_MAX writes only a more urgent, non-zero value."""
    core = CoreBench(
        """
reset: movs r0, #0x40
       msr basepri_max, r0
       movs r1, #0x60
       msr basepri_max, r1
       mrs r2, basepri
       log r2
       movs r1, #0x20
       msr basepri_max, r1
       mrs r2, basepri
       log r2
       b .
"""
    )
    core.run_us(100)

    assert core.values == [0x40, 0x20]


def test_primask_in_handler_blocks_more_urgent_interrupts() -> None:
    """B1.5.4: PRIMASK makes the execution priority 0 or higher."""
    core = CoreBench(
        f"""
reset: {interrupts({0: 0x40, 2: 0x10})} log 1
       b .
irq0:  cpsid i
       {store("ISPR", 4)} log 10
       cpsie i
       log 11
       bx lr
irq2:  log 30
       bx lr
"""
    )
    core.pulse_at_us(200, 0)
    core.run_us(500)

    assert core.values == [1, 10, 30, 11]


def test_faultmask_is_cleared_by_leaving_handler() -> None:
    """B1.4.3: FAULTMASK is cleared on return from every exception except NMI. The masked interrupt then follows."""
    core = CoreBench(
        f"""
reset: {interrupts({0: 0x40, 2: 0x10})} {store("ISPR", 1)} mrs r2, faultmask
       log r2
       b .
irq0:  cpsid f
       {store("ISPR", 4)} log 10
       bx lr
irq2:  log 30
       bx lr
"""
    )
    core.run_us(500)

    assert core.values == [10, 30, 0]


def test_nmi_is_not_masked() -> None:
    """B1.5.4: priority -2, above PRIMASK and FAULTMASK."""
    core = CoreBench(
        f"reset: cpsid i\n cpsid f\n {store('ICSR', 1 << 31)} log 1\n b .\n nmi: log 2\n bx lr\n"
    )
    core.run_us(100)

    assert core.values == [2, 1]


def test_polled_critical_section_does_not_starve_interrupts() -> None:
    """An interrupt raised while PRIMASK is 1 is taken in the one-instruction window of each pass."""
    core = CoreBench(
        f"""
reset: {interrupts({2: 0x20})} log 1
again: cpsid i
       nop
       nop
       nop
       cpsie i
       b again
irq2:  log 30
       bx lr
"""
    )
    core.pulse_at_us(200, 2)
    core.run_us(300)

    assert 200 <= core.time_us(30) <= 200 + 6 + ENTRY_CYCLES + 3


def test_unmasking_instruction_in_ram_takes_effect_at_once() -> None:
    """B5.2.1; FreeRTOS and flash drivers have such functions in RAM."""
    core = CoreBench(
        f"""
reset: {interrupts({2: 0x20})} mov32 r0, RAM+64
       mov32 r1, 0x4770B662  ; CPSIE i; BX LR
       str r1, [r0]
       cpsid i
       {store("ISPR", 4)} mov32 r0, RAM+65
       blx r0
       log 1
       b .
irq2:  ldr r4, [sp, #24]
       log r4
       bx lr
"""
    )
    core.run_us(300)

    assert core.values == [RAM + 66, 1]


def test_icsr_sets_and_clears_pending_exceptions() -> None:
    """B3.2.4: PENDSVSET and PENDSTSET, PENDSVCLR and PENDSTCLR."""
    both = store("ICSR", 1 << 28) + store("ICSR", 1 << 26)
    neither = store("ICSR", 1 << 27) + store("ICSR", 1 << 25)
    handlers = "pend_sv: log 14\n bx lr\nsys_tick: log 15\n bx lr\n"
    core = CoreBench(f"reset: cpsid i\n {both} {neither} cpsie i\n log 1\n {both} log 2\n b .\n{handlers}")
    core.run_us(300)

    assert core.values == [1, 14, 15, 2]


def test_disabled_interrupt_stays_pending_until_enabled() -> None:
    """B3.4.3: NVIC_ISER and NVIC_ICER."""
    core = CoreBench(
        f"""
reset: {interrupts({2: 0x20})} {store("ICER", 4)} {store("ISPR", 4)} log 1
       {store("ISER", 4)} log 2
       b .
irq2:  log 30
       bx lr
"""
    )
    core.run_us(200)

    assert core.values == [1, 30, 2]


# -- level-sensitive lines ------------------------------------------------------------------------------


def test_interrupt_repeats_until_active_line_is_lowered() -> None:
    """PM0214 4.3.9: level-sensitive interrupts."""
    core = CoreBench(
        f"""
reset: {interrupts({2: 0x20})} log 1
       b .
irq2:  mov32 r1, RAM
       ldr r2, [r1]
       adds r2, #1
       str r2, [r1]
       log r2
       cmp r2, #3
       bne out
       mov32 r0, LOWER
       movs r1, #2
       str r1, [r0]
out:   bx lr
"""
    )
    core.line_at_us(100, 2, True)
    core.run_us(1000)

    assert core.values == [1, 1, 2, 3]


def test_pulse_during_handler_causes_second_interrupt() -> None:
    """PM0214 4.3.9: the interrupt becomes pending again."""
    core = bench({2: 0x20})
    for at_us in (200, 216, 217):
        core.pulse_at_us(at_us, 2)
    core.run_us(1000)

    assert core.values == [1, 30, 31, 30, 31]


def test_active_line_sets_cleared_pending_bit_again() -> None:
    """PM0214 4.3.9: the interrupt of an active line is pending again immediately. A pulse is lost."""
    program = f"""
reset: {interrupts({2: 0x20})} cpsid i
       nop
       nop
       nop
       nop
       {store("ICPR", 4)} mov32 r0, ISPR
       ldr r1, [r0]
       log r1
       b .
"""
    for level, seen in ((True, 4), (False, 0)):
        core = CoreBench(program)
        core.pulse_at_us(18, 2)
        core.line_at_us(19, 2, level)
        core.run_us(100)
        assert core.values == [seen]
