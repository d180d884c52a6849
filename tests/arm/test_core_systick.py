"""SysTick and the cycle counter (ARMv7-M ARM B3.3, C1.8; PM0214 4.5)."""

from __future__ import annotations

from fractions import Fraction

import pytest

from fcu_emulator.emulator.clock import PS_PER_S
from tests.support.arm.chip_fakes import NativeChip
from tests.support.arm.core_bench import ENTRY_CYCLES, CoreBench, store

ENABLE, TICKINT, CLKSOURCE, COUNTFLAG = 1, 2, 4, 1 << 16


def started(reload: int, control: int = ENABLE | TICKINT | CLKSOURCE) -> str:
    return store("SYST_RVR", reload) + store("SYST_CVR", 0) + store("SYST_CSR", control)


START_US = 14.0
"""Time of the store that enables SysTick, which is the 15th instruction."""


@pytest.mark.parametrize("reload", [49, 50, 99, 1000])
def test_systick_period_is_reload_plus_one(reload: int) -> None:
    """B3.3.1: at 0 the next clock reloads the counter. The exception comes at each step from 1 to 0."""
    core = CoreBench(f"reset: {started(reload)} b .\nsys_tick: log 1\n bx lr\n")
    core.run_us(10 * reload)

    first = START_US + reload + 1
    times = [at - ENTRY_CYCLES - 3 for at, _ in core.log_us]
    assert [round(at - first) for at in times] == [n * (reload + 1) for n in range(len(times))]
    assert len(times) == 9


def test_million_periods_do_not_drift() -> None:
    """84 MHz / 84000 is the HAL's millisecond: the thousandth tick is exactly 1 s after the start."""
    core = CoreBench(
        f"reset: {started(83_999)} wfi\nagain: wfi\n b again\nsys_tick: log 1\n bx lr\n", hclk_hz=84_000_000
    )
    core.core.run_until_ps(1_001 * 10**9)

    times = [at_ps for at_ps, _ in core.probe.log]
    assert len(times) == 1_000
    assert times[999] - times[0] == 999 * 10**9


def test_counter_counts_down_from_reload() -> None:
    """B3.3.5: SYST_CVR is 0 after a write, and has the reload value one clock later."""
    core = CoreBench(
        f"reset: {started(20)} mov32 r0, SYST_CVR\n"
        + "ldr r4, [r0]\n log r4\n" * 6
        + "b .\n sys_tick: bx lr\n"
    )
    core.run_us(32.5)

    # read 3 clocks behind the start, then every 4: 1 clock to reload, so 21 - 3
    assert core.values == [18, 14, 10, 6]


def test_systick_without_clksource_counts_hclk_over_8() -> None:
    """RM0368 6.2, figure 12: HCLK / 8."""
    core = CoreBench(f"reset: {started(9, ENABLE | TICKINT)} b .\nsys_tick: log 1\n bx lr\n")
    core.run_us(300)

    assert [at for at, _ in core.log_us] == [START_US + 80 * n + ENTRY_CYCLES + 3 for n in (1, 2, 3)]


def test_countflag_is_cleared_by_reading() -> None:
    """B3.3.3."""
    core = CoreBench(
        f"""
reset: {started(30, ENABLE | CLKSOURCE)} mov32 r0, SYST_CSR
       ldr r4, [r0]
       log r4
wait:  ldr r4, [r0]
       lsls r5, r4, #15
       bpl wait
       log r4
       ldr r4, [r0]
       log r4
       b .
"""
    )
    core.run_us(60)

    assert core.values == [5, COUNTFLAG | 5, 5]
    assert 45 <= core.log_us[1][0] <= 45 + 6


def test_writing_counter_clears_counter_and_flag() -> None:
    """B3.3.5: "a write of any value clears the register to 0" and COUNTFLAG. It does not cause an exception."""
    core = CoreBench(
        f"""
reset: {started(10, ENABLE | CLKSOURCE)} mov32 r0, SYST_CVR
       mov32 r1, SYST_CSR
       mov32 r2, 7
       nop
       nop
       nop
       nop
       nop
       str r2, [r0]
       ldr r4, [r1]
       log r4
       b .
"""
    )
    core.run_us(100)

    assert core.values == [5]


def test_no_exception_is_pending_without_tickint() -> None:
    """B3.3.3."""
    core = CoreBench(f"reset: {started(10, ENABLE | CLKSOURCE)} b .\n")
    core.run_us(100)

    assert core.values == []
    assert core.system("ICSR") >> 26 & 1 == 0


def test_new_reload_value_applies_from_next_reload() -> None:
    """B3.3.4."""
    core = CoreBench(f"reset: {started(99)} {store('SYST_RVR', 49)} b .\nsys_tick: log 1\n bx lr\n")
    core.run_us(250)

    assert [at - ENTRY_CYCLES - 3 - START_US for at, _ in core.log_us] == [100, 150, 200]


def test_reload_value_0_stops_counter_at_next_wrap() -> None:
    """B3.3.1: "writing 0 to SYST_RVR disables the counter on the next wrap", even if SysTick is enabled again."""
    core = CoreBench(f"reset: {started(99)} {store('SYST_RVR', 0)} b .\nsys_tick: log 1\n bx lr\n")
    core.run_us(10_000)
    assert core.values == [1]

    again = CoreBench(
        f"reset: {started(99)} {store('SYST_CSR', 0)} {store('SYST_RVR', 0)} {store('SYST_CSR', 7)} b .\n"
        "sys_tick: log 1\n bx lr\n"
    )
    again.run_us(10_000)
    assert again.values == [1]


def test_disabled_systick_keeps_its_value() -> None:
    """HAL_SuspendTick clears only TICKINT. Clearing ENABLE stops the counter at its value."""
    core = CoreBench(
        f"""
reset: {started(99)} {store("SYST_CSR", 0)} mov32 r0, SYST_CVR
       ldr r4, [r0]
       log r4
       ldr r4, [r0]
       log r4
       b .
"""
    )
    core.run_us(300)

    assert core.values == [100 - 5, 100 - 5]


@pytest.mark.parametrize("cycles", [Fraction(13, 10), Fraction(7, 3)])
def test_repeated_write_of_csr_does_not_change_count(cycles: Fraction) -> None:
    """HAL_SuspendTick and HAL_ResumeTick are called a thousand times, and the phase does not change."""
    toggle = f"again: {store('SYST_CSR', 5)} {store('SYST_CSR', 7)} b again\n"
    core = CoreBench(f"reset: {started(999)} {toggle} sys_tick: bx lr\n", cycles=cycles)
    still = CoreBench(f"reset: {started(999)} b .\n sys_tick: bx lr\n", cycles=cycles)
    core.run_us(20_000)
    still.run_us(20_000)

    assert core.system("SYST_CVR") == still.system("SYST_CVR")


def test_hclk_change_continues_from_count() -> None:
    """RM0368 6.2: HCLK is the clock of SysTick."""
    core = CoreBench(f"reset: {started(99)} {store('RATE', 500)} wfi\n b .\nsys_tick: log 1\n bx lr\n")
    core.run_us(600)

    # 5 clocks of 1 us, the store being the first slow one; then 2 us each
    first = START_US + 5 + 2 * 95
    assert core.log_us[0][0] == first + 2 * (ENTRY_CYCLES + 3)


def test_systick_calibration_equals_manual() -> None:
    """PM0214 4.5.4: 10500, which is 1 ms of 84 MHz / 8."""
    core = CoreBench("reset: mov32 r0, 0xE000E01C\n ldr r4, [r0]\n log r4\n b .\n")
    core.run_us(20)

    assert core.values[0] & 0xFF_FFFF == 10_500


# -- CYCCNT ---------------------------------------------------------------------------------------------

DWT_ON = store("DEMCR", 1 << 24) + store("CYCCNT", 0) + store("DWT_CTRL", 1)


def test_cyccnt_counts_cycles() -> None:
    """C1.8.3, C1.8.8."""
    core = CoreBench(
        f"""
reset: {DWT_ON} mov32 r0, CYCCNT
       ldr r4, [r0]
       nop
       nop
       nop
       ldr r5, [r0]
       log r4
       log r5
       b .
"""
    )
    core.run_us(100)

    first, second = core.values
    assert first == 3  # the store itself, MOVW, MOVT
    assert second - first == 4


def test_cyccnt_equals_instructions_times_cycles_per_instruction() -> None:
    """At 84 MHz and 1.3 cycles per instruction, 1000 passes of two instructions take 2600 cycles."""
    core = CoreBench(
        f"""
reset: {DWT_ON} mov32 r0, CYCCNT
       mov32 r1, 1000
       ldr r4, [r0]
again: subs r1, #1
       bne again
       ldr r5, [r0]
       subs r5, r5, r4
       log r5
       b .
""",
        hclk_hz=84_000_000,
        cycles=Fraction(13, 10),
    )
    core.run_us(100)

    assert core.values[0] in (2601, 2602)


def test_cyccnt_stops_without_trcena() -> None:
    """C1.6.5: DEMCR.TRCENA is the main switch. Programs often forget to set this bit, because a debugger sets it."""
    core = CoreBench(
        f"reset: {store('DWT_CTRL', 1)} mov32 r0, CYCCNT\n"
        "ldr r4, [r0]\n log r4\n ldr r4, [r0]\n log r4\n b .\n"
    )
    core.run_us(100)

    assert core.values == [0, 0]


def test_cyccnt_continues_from_written_value() -> None:
    core = CoreBench(
        f"reset: {DWT_ON} {store('CYCCNT', 0xFFFF_FFFE)} mov32 r0, CYCCNT\n"
        "nop\n nop\n ldr r4, [r0]\n log r4\n b .\n"
    )
    core.run_us(100)

    assert core.values == [3]  # wraps


def test_cyccnt_counts_cycles_after_hclk_change() -> None:
    core = CoreBench(
        f"reset: {DWT_ON} {store('RATE', 250)} nop\n nop\n mov32 r0, CYCCNT\n ldr r4, [r0]\n log r4\n b .\n"
    )
    core.run_us(200)

    assert core.values == [10]


@pytest.mark.parametrize("hclk_hz", [0, 7])
def test_systick_without_clock_does_not_count(hclk_hz: int) -> None:
    """7 Hz with CLKSOURCE 0 is a clock below 1 Hz, which must not cause a division by zero."""
    chip = NativeChip()
    chip.clocks.set(hclk_hz=hclk_hz)
    space = chip["SCS"]
    for offset, value in ((0x14, 9), (0x18, 0), (0x10, ENABLE | TICKINT)):  # SYST_RVR, SYST_CVR, SYST_CSR
        space.write(offset, value)
    chip.run_for(PS_PER_S)
    assert not space.peek(0x10) & COUNTFLAG
