"""Timer interrupts: the lab's tick, late and lost ticks, shared numbers, and operation without events."""

from __future__ import annotations

import pytest

from fcu_emulator.emulator.clock import NEVER_PS, PS_PER_MS, PS_PER_S, PS_PER_US
from fcu_emulator.emulator.trace import TickLate, TickLost
from tests.support.arm.chip_fakes import NativeChip

CR1, SMCR, DIER, SR, EGR, CNT, PSC, ARR = 0x00, 0x08, 0x0C, 0x10, 0x14, 0x24, 0x28, 0x2C
UG = 1
TIM9_IRQ = 24


class Tick:
    """TIM9 with the lab's start: PSC and ARR, UG, UIE, CEN (HAL_TIM_Base_Init, HAL_TIM_Base_Start_IT)."""

    def __init__(self, psc: int = 83, arr: int = 1249, *, start: bool = True) -> None:
        self.chip = NativeChip()
        self.tim = self.chip.timer("TIM9")
        if start:
            for offset, value in ((ARR, arr), (PSC, psc), (EGR, UG), (DIER, 1), (CR1, 1)):
                self.tim.write(offset, value)

    def handle(self) -> None:
        """Do the same as HAL_TIM_IRQHandler, which clears a flag by writing 0 to its bit."""
        assert self.tim.read(SR) & 1
        self.tim.write(SR, 0xFFFF_FFFE)


@pytest.mark.parametrize(("psc", "arr", "rate_hz"), [(83, 1249, 800.0), (51, 1999, 807.692)])
def test_timer_has_rates_of_lab(psc: int, arr: int, rate_hz: float) -> None:
    """The rates are 84 MHz / 84 / 1250, and in ST's firmware 84 MHz / 52 / 2000."""
    assert Tick(psc, arr).tim.rate_hz == pytest.approx(rate_hz, abs=1e-3)


def test_first_interrupt_comes_immediately() -> None:
    """ST's firmware: UG sets UIF and HAL_TIM_Base_Start_IT does not clear it."""
    tick = Tick()
    assert tick.chip.irq.rises == [(0, TIM9_IRQ)]
    tick.handle()
    tick.chip.run_to(PS_PER_S // 800)
    assert tick.chip.irq.rises == [(0, TIM9_IRQ), (PS_PER_S // 800, TIM9_IRQ)]


def test_update_by_software_sets_no_flag_with_urs() -> None:
    """RM0368 12.4.1: with URS only an overflow sets UIF."""
    tick = Tick(start=False)
    tick.tim.write(CR1, 4)
    tick.tim.write(EGR, UG)
    assert tick.tim.read(SR) == 0


def test_ticks_come_at_800_hz() -> None:
    tick = Tick()
    tick.handle()
    while tick.chip.next_ps <= PS_PER_S:
        tick.chip.run_to(tick.chip.next_ps)
        tick.handle()
    assert (tick.tim.ticks, tick.tim.late, tick.tim.lost) == (801, 0, 0)


def test_late_handler_is_counted() -> None:
    tick = Tick()
    tick.chip.run_to(300 * PS_PER_US)
    tick.handle()
    assert (tick.tim.ticks, tick.tim.late, tick.tim.lost) == (1, 1, 0)
    assert tick.tim.longest_wait_s == 300e-6
    assert tick.chip.trace.of(TickLate) == [TickLate(300 * PS_PER_US, "TIM9", 300 * PS_PER_US)]


def test_prompt_handler_is_not_late() -> None:
    tick = Tick()
    tick.chip.run_to(10 * PS_PER_US)
    tick.handle()
    assert tick.tim.late == 0


def test_ticks_while_flag_is_set_are_lost() -> None:
    """The board must show an overrun. With a period of 1.25 ms and a handler after 4 ms, 3 ticks are lost."""
    tick = Tick()
    tick.chip.run_to(4 * PS_PER_MS)
    tick.handle()
    assert (tick.tim.ticks, tick.tim.lost) == (4, 3)
    assert tick.chip.trace.of(TickLost) == [TickLost(4 * PS_PER_MS, "TIM9", 3)]
    tick.chip.run_to(5 * PS_PER_MS)
    assert tick.chip.irq.rises[-1] == (5 * PS_PER_MS, TIM9_IRQ)


def test_timer_without_handler_causes_no_events() -> None:
    tick = Tick(psc=0, arr=9)
    tick.chip.run_to(PS_PER_MS)
    assert tick.chip.next_ps == NEVER_PS
    tick.handle()
    assert tick.tim.lost == 8400


def test_ticks_are_not_lost_while_interrupt_disabled() -> None:
    tick = Tick()
    tick.tim.write(DIER, 0)
    tick.chip.run_to(10 * PS_PER_MS)
    tick.tim.write(SR, 0)
    assert (tick.tim.ticks, tick.tim.lost) == (1, 0)


def test_free_running_timer_counts_without_events() -> None:
    tick = Tick(start=False)
    tim2 = tick.chip.timer("TIM2")
    tim2.write(PSC, 20)
    tim2.write(EGR, UG)
    tim2.write(CR1, 1)
    assert tick.chip.next_ps == NEVER_PS
    tick.chip.run_to(PS_PER_S)
    assert tim2.read(CNT) == 4_000_000


def test_polling_of_flag_can_be_skipped() -> None:
    tick = Tick(start=False)
    for offset, value in ((ARR, 1249), (PSC, 83), (EGR, UG), (SR, 0), (CR1, 1)):
        tick.tim.write(offset, value)
    tick.tim.write(SR, 0)
    assert tick.tim.pure_read(SR)
    assert not tick.tim.pure_read(CNT)
    tick.chip.run_to(tick.tim.next_change_ps() - 1)
    assert tick.tim.read(SR) == 0
    while not tick.tim.read(SR) & 1:
        tick.chip.run_to(tick.tim.next_change_ps())
    assert tick.chip.clock.now_ps == PS_PER_S // 800


def test_change_of_clock_keeps_count() -> None:
    """After the change from 16 to 84 MHz, the counter continues at its value."""
    tick = Tick(start=False)
    tick.chip.clocks.set(timer1_hz=16_000_000)
    tim3 = tick.chip.timer("TIM3")
    tim3.write(CR1, 1)
    tick.chip.run_to(100 * PS_PER_US)
    tick.chip.clocks.set(timer1_hz=84_000_000)
    assert tim3.read(CNT) == 1600
    tick.chip.run_for(100 * PS_PER_US)
    assert tim3.read(CNT) == 10_000


@pytest.mark.parametrize(
    ("name", "number"),
    [
        ("TIM1", 25),
        ("TIM2", 28),
        ("TIM3", 29),
        ("TIM4", 30),
        ("TIM5", 50),
        ("TIM9", 24),
        ("TIM10", 25),
        ("TIM11", 26),
    ],
)
def test_update_interrupts_have_numbers_of_manual(name: str, number: int) -> None:
    """RM0368 table 38."""
    tick = Tick(start=False)
    tick.chip.timer(name).write(EGR, UG)
    tick.chip.timer(name).write(DIER, 1)
    assert tick.chip.irq.rises == [(0, number)]


def test_interrupt_of_two_timers_lasts_until_both_served() -> None:
    """TIM1_UP and TIM10 both have number 25. The line is active until both are served."""
    tick = Tick(start=False)
    for name in ("TIM1", "TIM10"):
        tick.chip.timer(name).write(EGR, UG)
        tick.chip.timer(name).write(DIER, 1)
    tick.chip.timer("TIM1").write(SR, 0)
    assert tick.chip.irq.level(25)
    tick.chip.timer("TIM10").write(SR, 0)
    assert not tick.chip.irq.level(25)


def test_one_pulse_mode_stops_after_one_update() -> None:
    """RM0368 12.3.10."""
    tick = Tick(start=False)
    for offset, value in ((ARR, 99), (PSC, 83), (EGR, UG), (SR, 0), (DIER, 1), (CR1, 9)):
        tick.tim.write(offset, value)
    tick.chip.run_to(PS_PER_MS)
    assert len(tick.chip.irq.rises) == 1
    assert tick.tim.read(CR1) == 8
    assert tick.tim.read(CNT) == 0


def test_dma_transfers_item_at_each_timer_update() -> None:
    """RM0368 table 28: TIM4_UP is channel 2 of DMA1 stream 6. Here it writes a new ARR at each update."""
    tick = Tick(start=False)
    tim4, dma = tick.chip.timer("TIM4"), tick.chip["DMA1"]
    stream = 0x10 + 0x18 * 6
    tick.chip.fcu.ram[:4] = bytes((167, 0, 83, 0))  # two half-words
    for offset, value in ((4, 2), (8, 0x4000_082C), (12, 0x2000_0000)):
        dma.write(stream + offset, value)
    dma.write(stream, 2 << 25 | 1 << 13 | 1 << 11 | 1 << 10 | 1 << 6 | 1 << 4 | 1)
    for offset, value in ((ARR, 83), (DIER, 1 << 8), (CR1, 1)):
        tim4.write(offset, value)
    tick.chip.run_to(PS_PER_US)
    assert (tim4.read(ARR), dma.read(stream + 4)) == (167, 1)
    tick.chip.run_to(3 * PS_PER_US)
    assert tim4.read(ARR) == 83
    assert tick.chip.irq.rises == [(3 * PS_PER_US, 17)]


def test_reset_stops_timer_and_lowers_interrupt() -> None:
    tick = Tick()
    tick.tim.reset()
    assert not tick.chip.irq.level(TIM9_IRQ)
    assert tick.tim.read(ARR) == 0xFFFF
    assert tick.chip.next_ps == NEVER_PS


def test_timer_slave_mode_is_noted() -> None:
    tick = Tick(start=False)
    tick.chip.timer("TIM3").write(SMCR, 0)
    assert tick.chip.notes() == []
    tick.chip.timer("TIM3").write(SMCR, 3)
    assert tick.chip.notes()[0][0] == "not modelled"


def test_missing_timer_registers_read_zero() -> None:
    """RM0368 14.5: TIM10 has one channel and only counts up."""
    tick = Tick(start=False)
    tim10 = tick.chip.timer("TIM10")
    tim10.write(0x38, 5)
    tim10.write(CR1, 0x70)
    assert (tim10.read(0x38), tim10.read(CR1)) == (0, 0)


def test_stopped_clock_pauses_count() -> None:
    """RCC may select a PLL that does not run. Then no timer counts, and there is no division by 0."""
    tick = Tick()
    tick.handle()
    tick.chip.run_to(500 * PS_PER_US)
    tick.chip.clocks.set(timer2_hz=0)
    assert (tick.tim.read(CNT), tick.tim.rate_hz, tick.chip.next_ps) == (500, 0.0, NEVER_PS)
    tick.chip.run_for(PS_PER_S)
    assert tick.tim.read(CNT) == 500
    tick.chip.clocks.set(timer2_hz=84_000_000)
    tick.chip.run_for(750 * PS_PER_US)
    assert tick.chip.irq.rises[-1] == (PS_PER_S + 1250 * PS_PER_US, TIM9_IRQ)


def test_dma_bursts_and_compare_requests_are_noted() -> None:
    tick = Tick(start=False)
    tim3 = tick.chip.timer("TIM3")
    for offset, value in ((DIER, 1 << 9), (0x48, 1), (0x4C, 1), (0x4C, 2)):
        tim3.write(offset, value)
    assert tick.chip.problems() == {"capture-dma": {}, "dma-burst": {"register": "DMAR"}}
    assert len(tick.chip.notes()) == 3
