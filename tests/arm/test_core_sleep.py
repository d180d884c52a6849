"""WFI, WFE, SEV and SLEEPONEXIT (ARMv7-M ARM B1.5.17 to B1.5.19; PM0214 2.5)."""

from __future__ import annotations

import pytest

from fcu_emulator.emulator.clock import PS_PER_US
from tests.support.arm.core_bench import ENTRY_CYCLES, CoreBench, interrupts, store

EMR, RTSR = 0x4001_3C04, 0x4001_3C08
BACK_US = ENTRY_CYCLES + 4 + 1 + 10 + 3
"""Time from the interrupt to the log after it: entry, handler (log and BX), return, and the store of the log."""


def bench(body: str, priorities: dict[int, int]) -> CoreBench:
    return CoreBench(
        f"reset: {interrupts(priorities)} {body} b .\nirq0: log 10\n bx lr\nirq1: log 20\n bx lr\n"
    )


@pytest.mark.parametrize("instruction", ["wfi", "wfe"])
@pytest.mark.parametrize("at_us", [200, 200.125, 201, 12345.5])
def test_interrupt_ends_sleep_at_once(instruction: str, at_us: float) -> None:
    """B1.5.18, B1.5.19: the interrupt is taken immediately, and execution continues after the instruction."""
    core = bench(f"log 1\n {instruction}\n log 2\n", {0: 0x20})
    core.pulse_at_us(at_us, 0)
    core.run_us(20_000)

    assert core.values == [1, 10, 2]
    assert core.time_us(10) == at_us + ENTRY_CYCLES + 3
    assert core.time_us(2) == at_us + BACK_US


@pytest.mark.parametrize("instruction", ["wfi", "wfe"])
def test_sleeping_core_executes_no_instructions(instruction: str) -> None:
    core = bench(f"log 1\n {instruction}\n log 2\n", {0: 0x20})
    core.run_us(1_000)
    before = core.core.retired
    core.run_us(1_000_000)

    assert core.core.retired == before
    assert core.core.asleep
    assert core.values == [1]


def test_wfi_wakes_for_interrupt_blocked_by_primask() -> None:
    """B1.5.19: PRIMASK does not prevent waking up. The handler runs when PRIMASK is cleared."""
    core = bench("cpsid i\n wfi\n log 1\n cpsie i\n log 2\n", {0: 0x20})
    core.pulse_at_us(200, 0)
    core.run_us(1_000)

    assert core.values == [1, 10, 2]
    assert core.time_us(1) == 203


def test_wfi_does_not_sleep_with_masked_pending_interrupt() -> None:
    """B1.5.19: the usual idle loop without a race: mask, test, WFI, unmask."""
    core = bench(f"cpsid i\n {store('ISPR', 1)} wfi\n log 1\n cpsie i\n log 2\n", {0: 0x20})
    core.run_us(100)

    assert core.values == [1, 10, 2]


def test_wfi_ignores_interrupt_below_basepri() -> None:
    """B1.5.19: only PRIMASK is ignored for waking up, BASEPRI is not."""
    core = bench("movs r2, #0x40\n msr basepri, r2\n wfi\n log 1\n", {0: 0x40, 1: 0x30})
    core.pulse_at_us(200, 0)
    core.pulse_at_us(400, 1)
    core.run_us(1_000)

    assert core.values == [20, 1]


def test_wfi_ignores_disabled_interrupt() -> None:
    """B1.5.19: a disabled interrupt never becomes an exception that can be taken."""
    core = bench("wfi\n log 1\n", {0: 0x40})
    core.pulse_at_us(200, 1)
    core.pulse_at_us(400, 0)
    core.run_us(1_000)

    assert core.time_us(10) == 400 + ENTRY_CYCLES + 3


def test_wfi_in_handler_waits_for_preempting_interrupt() -> None:
    """WFI in a handler waits for an interrupt that may preempt the handler."""
    core = CoreBench(
        f"""
reset: {interrupts({0: 0x40, 1: 0x20})} {store("ISPR", 1)} b .
irq0:  log 10
       wfi
       log 11
       bx lr
irq1:  log 20
       bx lr
"""
    )
    core.pulse_at_us(200, 0)  # pending again, but of the same priority
    core.pulse_at_us(400, 1)
    core.run_us(1_000)

    assert core.values[:3] == [10, 20, 11]
    assert core.time_us(20) == 400 + ENTRY_CYCLES + 3


# -- events ---------------------------------------------------------------------------------------------


def test_only_first_wfe_after_sev_continues() -> None:
    """B1.5.18: the event register is one bit, and WFE clears it."""
    core = bench("sev\n sev\n wfe\n log 1\n wfe\n log 2\n", {})
    core.run_us(1_000)

    assert core.values == [1]
    assert core.core.asleep


def test_handled_exception_is_event_for_wfe() -> None:
    """B1.5.18: exception entry and return set the event register."""
    core = CoreBench("reset: svc #0\n wfe\n log 1\n wfe\n log 2\n b .\nsvc: bx lr\n")
    core.run_us(1_000)

    assert core.values == [1]


def test_wfe_ignores_interrupt_blocked_by_primask() -> None:
    """B1.5.18, PM0214 2.5.2: WFE wakes up only for an exception whose priority is sufficient for exception entry."""
    core = bench("cpsid i\n wfe\n log 1\n", {0: 0x20})
    core.pulse_at_us(200, 0)
    core.run_us(1_000)

    assert core.values == []


@pytest.mark.parametrize("enabled", [{}, {0: 0x20}])
def test_sevonpend_wakes_wfe_for_disabled_interrupt(enabled: dict[int, int]) -> None:
    """B1.5.18, B3.2.7: with SCR.SEVONPEND even a disabled interrupt is an event when it becomes pending."""
    core = bench(f"{store('SCR', 1 << 4)} cpsid i\n wfe\n log 1\n", enabled)
    core.pulse_at_us(200, 0)
    core.run_us(1_000)

    assert core.log_us == [(203, 1)]


def test_sevonpend_ignores_interrupt_that_was_already_pending() -> None:
    """B3.2.7: "transitions from inactive to pending". An interrupt that was pending before is not an event."""
    core = bench(f"{store('SCR', 1 << 4)} cpsid i\n wfe\n log 1\n wfe\n log 2\n", {})
    core.pulse_at_us(200, 0)
    core.pulse_at_us(300, 0)
    core.run_us(1_000)

    assert core.values == [1]


def test_interrupt_pended_by_software_is_event_with_sevonpend() -> None:
    """B3.2.7: pending by NVIC_ISPR and by STIR."""
    for name, value in (("ISPR", 1), ("STIR", 0)):
        core = bench(f"{store('SCR', 1 << 4)} {store(name, value)} wfe\n log 1\n", {})
        core.run_us(1_000)
        assert core.values == [1], name


# -- sleep on exit --------------------------------------------------------------------------------------


def test_sleeponexit_sleeps_instead_of_returning_to_thread() -> None:
    """B1.5.17, B3.2.7: the core sleeps on return to Thread mode, and no more code of the thread is executed."""
    core = bench(f"{store('SCR', 2)} log 1\n", {0: 0x40, 1: 0x20})
    core.pulse_at_us(200, 0)
    core.pulse_at_us(201, 1)
    core.run_us(1_000)
    before = core.core.retired
    core.run_us(2_000)

    assert core.values == [1, 20, 10]
    assert core.core.retired == before

    core.pulse_at_us(2_100, 0)
    core.run_us(3_000)
    assert core.log_us[-1] == (2_100 + ENTRY_CYCLES + 3, 10)


def test_handler_clearing_sleeponexit_returns_to_thread() -> None:
    """B1.5.17."""
    core = CoreBench(
        f"""
reset: {interrupts({0: 0x40})} {store("SCR", 2)} wfi
       log 1
       b .
irq0:  {store("SCR", 0)} log 10
       bx lr
"""
    )
    core.pulse_at_us(200, 0)
    core.run_us(1_000)

    assert core.values == [10, 1]


@pytest.mark.parametrize(("mask", "values"), [(0, [1]), (1 << 17, [1, 2])])
def test_exti_event_wakes_wfe_without_interrupt(mask: int, values: list[int]) -> None:
    """RM0368 10.2.3: an event of a line in EMR wakes WFE, without a pending bit to clear. Line 17 is the RTC alarm."""
    core = CoreBench(
        f"reset: {_put(EMR, mask)} {_put(RTSR, 1 << 17)} log 1\n wfe\n log 2\n wfe\n log 3\n b .\n"
    )
    core.clock.schedule(200 * PS_PER_US, lambda: core.core.set_exti_line(17, True))
    core.run_us(1_000)

    assert core.values == values
    assert mask == 0 or core.time_us(2) == 203


def _put(address: int, value: int) -> str:
    return f"mov32 r0, {address}\n mov32 r1, {value}\n str r1, [r0]\n"
