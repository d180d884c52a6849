"""Stop and Standby (RM0368 5.3.5, 5.3.6, 5.4, 23.16.1; times: STM32F401xB/C datasheet, wake-up timings)."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import pytest

from tests.support.arm.power_programs import (
    CSBF,
    CWUF,
    EWUP,
    EXTI0,
    FPDS,
    HSE_ON,
    LED_OFF,
    LED_ON,
    LED_OUT,
    LPDS,
    LSI_RTC,
    PA0,
    PDDS,
    PWR_ON,
    RTC_WKUP,
    SBF,
    SYSTICK,
    SYSTICK_1_KHZ,
    WUF,
    PowerBoard,
    poll,
    put,
    sleep,
    wake_up_after,
)

DBG_STOP, DBG_STANDBY = 1 << 1, 1 << 2
HSEON, HSERDY, HSION, PLLON = 1 << 16, 1 << 17, 1 << 0, 1 << 24
START = "reset:\n" + LED_OUT + PWR_ON
PIN_WAKES = put("RCC_APB2ENR", 1 << 14) + put("EXTI_RTSR", PA0) + put("EXTI_IMR", PA0) + put("ISER0", 1 << 6)
PIN_EVENT = put("RCC_APB2ENR", 1 << 14) + put("EXTI_RTSR", PA0) + put("EXTI_EMR", PA0)
WKUP_PIN = put("PWR_CSR", EWUP)


def drive(bench: PowerBoard, level: int) -> None:
    """Set the level of PA0 from outside."""
    bench.board.gpio.drive("A", 0, level)


# -- Stop ---------------------------------------------------------------------------------------------------


def test_stop_ends_with_wake_up_timer(tmp_path: Path) -> None:
    """The wake-up timer expires 5 ms after its start; SysTick, which has 1 ms, does not wake the core."""
    bench = PowerBoard(
        START + LSI_RTC + SYSTICK_1_KHZ + wake_up_after(10) + LED_ON + sleep() + LED_OFF, tmp_path
    )
    bench.run_ms(20)
    on_us, off_us = bench.edges_us()

    assert 4_000 < off_us - on_us < 5_100
    assert bench.count(RTC_WKUP) >= 1


def test_systick_and_timers_pause_in_stop(tmp_path: Path) -> None:
    source = START + put("RCC_APB1ENR", 1 << 28 | 1) + LSI_RTC + SYSTICK_1_KHZ + wake_up_after(200)
    bench = PowerBoard(source + put("TIM2_CR1", 1) + sleep() + "b end", tmp_path)
    bench.run_ms(5)
    ticks, counted = bench.count(SYSTICK), bench.word("TIM2_CNT")
    bench.run_ms(90)

    assert bench.count(SYSTICK) == ticks
    assert bench.word("TIM2_CNT") == counted
    bench.run_ms(15)
    assert 8 <= bench.count(SYSTICK) - ticks <= 11


@pytest.mark.parametrize(("control", "wake_up_us"), [(0, 13.5), (LPDS, 21), (FPDS, 105), (LPDS | FPDS, 113)])
def test_wake_up_from_stop_takes_documented_time(tmp_path: Path, control: int, wake_up_us: float) -> None:
    bench = PowerBoard(START + PIN_EVENT + LED_ON + sleep("wfe", control) + LED_OFF, tmp_path)
    bench.run_ms(5)
    drive(bench, 1)
    bench.run_ms(1)
    _, off_us = bench.edges_us()

    assert off_us == pytest.approx(5_000 + wake_up_us, abs=1)


def test_hsi_is_system_clock_after_stop(tmp_path: Path) -> None:
    bench = PowerBoard(START + HSE_ON + PIN_WAKES + LED_ON + sleep() + LED_OFF + "b end", tmp_path)
    bench.run_ms(10)
    drive(bench, 1)
    bench.run_ms(1)

    assert bench.count(EXTI0) == 1
    assert bench.word("RCC_CR") & (HSEON | HSERDY | HSION | PLLON) == HSION
    assert bench.word("RCC_CFGR") & 0xF == 0
    assert bench.current_ua() == pytest.approx(16 * 128)


def test_registers_and_ram_survive_stop(tmp_path: Path) -> None:
    bench = PowerBoard(START + PIN_WAKES + put("PLACE", 0x1234_5678) + sleep() + "b end", tmp_path)
    bench.run_ms(5)
    drive(bench, 1)
    bench.run_ms(1)

    assert bench.word("PLACE") == 0x1234_5678
    assert bench.word("EXTI_RTSR") == PA0


def test_event_line_wakes_wfe_repeatedly(tmp_path: Path) -> None:
    """If a line is in EMR but not in IMR, it sets no pending bit, so Stop can be entered again (10.2.3)."""
    source = START + PIN_EVENT + LED_ON + sleep("wfe") + LED_OFF + sleep("wfe") + LED_ON + "b end"
    bench = PowerBoard(source, tmp_path)
    for level in (1, 0, 1):
        bench.run_ms(1)
        drive(bench, level)
    bench.run_ms(1)

    assert len(bench.edges_us()) == 3
    assert bench.word("EXTI_PR") == 0


def test_event_line_wakes_wfe_without_deep_sleep(tmp_path: Path) -> None:
    bench = PowerBoard(START + PIN_EVENT + LED_ON + "wfe\n" + LED_OFF, tmp_path)
    bench.run_ms(3)
    drive(bench, 1)
    bench.run_ms(1)

    assert bench.edges_us()[1] == pytest.approx(3_000, abs=2)


def test_stop_is_refused_while_line_is_pending(tmp_path: Path) -> None:
    """5.3.5: the entry is ignored, and the program continues."""
    source = START + put("RCC_APB2ENR", 1 << 14) + put("EXTI_RTSR", PA0) + poll("EXTI_PR", PA0, "edge")
    bench = PowerBoard(source + LED_ON + sleep() + LED_OFF, tmp_path)
    bench.run_ms(1)
    drive(bench, 1)
    bench.run_ms(1)

    assert len(bench.edges_us()) == 2
    assert "stop-refused" in bench.problems()


def test_dbg_stop_keeps_clocks_running(tmp_path: Path) -> None:
    """HCLK comes from HSI, so SysTick runs, and its interrupt ends the sleep (23.16.1)."""
    source = START + HSE_ON + put("DBGMCU_CR", DBG_STOP) + SYSTICK_1_KHZ + LED_ON + sleep() + LED_OFF
    bench = PowerBoard(source, tmp_path)
    bench.run_ms(10)
    on_us, off_us = bench.edges_us()

    assert off_us - on_us == pytest.approx(1_000, rel=0.05)
    assert bench.word("RCC_CFGR") & 0xF == 0


def test_window_watchdog_pauses_in_stop(tmp_path: Path) -> None:
    """At 16 MHz WWDG resets the chip after 64 counts of 4096 clocks, 16 ms."""
    source = (
        START + put("RCC_APB1ENR", 1 << 28 | 1 << 11) + put("WWDG_CR", 0xFF) + PIN_WAKES + sleep() + "b end"
    )
    bench = PowerBoard(source, tmp_path)
    bench.run_ms(100)
    assert bench.board.chip is not None
    assert not bench.board.chip.core.resets
    drive(bench, 1)
    bench.run_ms(30)

    assert [reason for _, reason in bench.board.chip.core.resets] == ["WWDG"]


def test_independent_watchdog_resets_chip_in_stop(tmp_path: Path) -> None:
    source = START + put("IWDG_KR", 0x5555) + put("IWDG_RLR", 319) + put("IWDG_KR", 0xCCCC) + sleep()
    bench = PowerBoard(source, tmp_path)
    bench.run_ms(60)
    assert bench.board.chip is not None

    assert [reason for _, reason in bench.board.chip.core.resets] == ["IWDG"]


@pytest.mark.parametrize(("control", "microampere"), [(0, 110), (FPDS, 75), (LPDS, 42), (LPDS | FPDS, 10)])
def test_stop_has_documented_current(tmp_path: Path, control: int, microampere: float) -> None:
    bench = PowerBoard(START + PIN_WAKES + sleep(control=control), tmp_path)
    bench.run_ms(5)

    assert bench.current_ua() == microampere


def test_stop_without_wake_up_source_is_stuck(tmp_path: Path) -> None:
    bench = PowerBoard(START + SYSTICK_1_KHZ + sleep() + "b end", tmp_path)
    bench.run_ms(5)
    assert bench.board.chip is not None
    diagnosis = bench.board.chip.diagnosis()

    assert diagnosis is not None
    assert diagnosis.kind == "stuck"
    assert diagnosis.fatal


def test_wake_up_timer_without_exti_line_is_stuck(tmp_path: Path) -> None:
    """The RTC wakes the chip from Stop through line 22 only (17.5, EXTI lines)."""
    source = START + LSI_RTC + wake_up_after(10) + put("EXTI_IMR", 0) + sleep() + "b end"
    bench = PowerBoard(source, tmp_path)
    bench.run_ms(3)
    assert bench.board.chip is not None
    diagnosis = bench.board.chip.diagnosis()

    assert diagnosis is not None
    assert diagnosis.kind == "stuck"


def test_stop_with_wake_up_source_is_not_stuck(tmp_path: Path) -> None:
    bench = PowerBoard(START + LSI_RTC + wake_up_after(60_000) + sleep(), tmp_path)
    for _ in range(5):
        bench.run_ms(700)
        assert bench.board.chip is not None
        assert bench.board.chip.diagnosis() is None


def test_debugger_halts_stopped_chip(tmp_path: Path) -> None:
    bench = PowerBoard(START + PIN_EVENT + LED_ON + sleep("wfe") + LED_OFF, tmp_path)
    bench.run_ms(5)
    assert bench.board.chip is not None
    core = bench.board.chip.core
    core.halt()
    assert core.halted
    core.resume(step=False)
    bench.run_ms(5)
    drive(bench, 1)
    bench.run_ms(1)

    assert bench.edges_us()[1] == pytest.approx(10_013.5, abs=1)


# -- Standby ------------------------------------------------------------------------------------------------

COUNT_BOOTS = put("PWR_CR", 1 << 8) + "mov32 r0, BKP0R\nldr r1, [r0]\nadds r1, #1\nstr r1, [r0]\n"


def standby(source: str, instruction: str = "wfi") -> str:
    """Return a program that counts its starts in BKP0R and enters Standby."""
    return START + COUNT_BOOTS + LED_ON + source + put("PLACE", 0x600D) + sleep(instruction, PDDS | CWUF)


def test_standby_ends_with_wkup_pin(tmp_path: Path) -> None:
    """The reset vector is fetched 314 us after the edge; SBF, WUF and the backup register are kept."""
    bench = PowerBoard(standby(WKUP_PIN), tmp_path)
    bench.run_ms(5)
    drive(bench, 1)
    bench.run_ms(0.3)
    assert bench.word("BKP0R") == 1
    bench.run_ms(0.7)

    assert bench.word("BKP0R") == 2
    assert bench.word("PWR_CSR") & SBF
    on_us = bench.edges_us()[-1]
    assert on_us == pytest.approx(5_314, abs=10)


def test_standby_loses_ram_and_registers(tmp_path: Path) -> None:
    bench = PowerBoard(standby(WKUP_PIN), tmp_path)
    bench.run_ms(5)

    assert bench.word("PLACE") != 0x600D
    assert bench.word("GPIOB_MODER") & 3 << 10 == 0


def test_dbg_standby_keeps_ram(tmp_path: Path) -> None:
    bench = PowerBoard(standby(put("DBGMCU_CR", DBG_STANDBY) + WKUP_PIN), tmp_path)
    bench.run_ms(5)

    assert bench.word("PLACE") == 0x600D


def test_standby_ends_with_wake_up_timer(tmp_path: Path) -> None:
    """LSI and the RTC continue; the reset then switches LSI off (6.3.21)."""
    bench = PowerBoard(standby(LSI_RTC + wake_up_after(20)), tmp_path)
    bench.run_ms(11.5)

    assert bench.word("BKP0R") == 2
    assert bench.word("PWR_CSR") & SBF


def test_standby_sets_flags_of_power_reset(tmp_path: Path) -> None:
    """6.1.2: the end of Standby is a power reset. CWUF and CSBF clear WUF and SBF (5.4.1)."""
    source = START + COUNT_BOOTS + "cmp r1, #2\nbeq woken\n" + WKUP_PIN + sleep(control=PDDS | CWUF)
    source += "woken:\n" + put("PLACE", 1) + LED_ON + poll("PLACE", 2, "seen")
    source += put("PWR_CR", CWUF | CSBF) + put("PLACE", 3) + "b end"
    bench = PowerBoard(source, tmp_path)
    bench.run_ms(5)
    drive(bench, 1)
    bench.run_ms(1)
    assert bench.word("RCC_CSR") >> 24 == 0x0E
    assert bench.word("PWR_CSR") & (WUF | SBF | EWUP) == WUF | SBF | EWUP
    assert bench.board.chip is not None
    bench.board.chip.core.poke(0x2000_0400, (2).to_bytes(4, "little"))
    bench.run_ms(1)

    assert bench.word("PWR_CSR") & (WUF | SBF) == 0
    assert not bench.board.chip.core.resets


def test_standby_is_refused_while_wuf_is_set(tmp_path: Path) -> None:
    """5.3.6; with EWUP a high level of the pin sets WUF (5.4.2)."""
    source = (
        START + poll("PLACE", 1, "go") + WKUP_PIN + put("SCR", 4) + put("PWR_CR", PDDS) + "wfi\n" + LED_ON
    )
    bench = PowerBoard(source, tmp_path)
    drive(bench, 1)
    assert bench.board.chip is not None
    bench.board.chip.core.poke(0x2000_0400, (1).to_bytes(4, "little"))
    bench.run_ms(1)

    assert bench.edges_us()
    assert "standby-refused" in bench.problems()


def test_standby_has_documented_current(tmp_path: Path) -> None:
    bench = PowerBoard(standby(WKUP_PIN), tmp_path)
    bench.run_ms(5)

    assert bench.current_ua() == pytest.approx(2.4)


def test_board_that_wakes_often_is_not_reset_endlessly(tmp_path: Path) -> None:
    bench = PowerBoard(standby(LSI_RTC + wake_up_after(20)), tmp_path)
    bench.run_ms(300)
    assert bench.board.chip is not None

    assert bench.word("BKP0R") > 20
    assert bench.board.chip.diagnosis() is None


def test_standby_without_wake_up_source_is_reported(tmp_path: Path) -> None:
    bench = PowerBoard(standby(""), tmp_path)
    bench.run_ms(5)
    assert bench.board.chip is not None
    diagnosis = bench.board.chip.diagnosis()

    assert diagnosis is not None
    assert not diagnosis.fatal


def test_stop_and_standby_continue_after_snapshot(tmp_path: Path) -> None:
    for source in (
        START + LSI_RTC + wake_up_after(20) + LED_ON + sleep() + LED_OFF + "b end",
        standby(WKUP_PIN),
    ):
        bench = PowerBoard(source, tmp_path)
        bench.run_ms(5)
        saved = bench.board.snapshot()
        seen = []
        for _ in range(2):
            bench.board.restore(saved)
            drive(bench, 1)
            bench.run_ms(20)
            seen.append((bench.word("PWR_CSR"), bench.word("BKP0R"), bench.board.now_s))
            drive(bench, 0)
        first, second = seen
        assert first == second


def test_wake_up_is_independent_of_runs(tmp_path: Path) -> None:
    source = (
        START + LSI_RTC + wake_up_after(7) + "again:\n" + LED_ON + sleep(control=LPDS) + LED_OFF + "b again"
    )
    whole, parts = PowerBoard(source, tmp_path), PowerBoard(source, tmp_path)
    whole.run_ms(50)
    for _ in range(500):
        parts.run_ms(0.1)

    assert whole.edges_us() == parts.edges_us()
    assert all(later > earlier for earlier, later in pairwise(whole.edges_us()))
