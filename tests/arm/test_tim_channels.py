"""Compare, PWM and capture (RM0368 12.3.5 to 12.3.10, 13.3)."""

from __future__ import annotations

from itertools import pairwise

import pytest

from fcu_emulator.emulator.chip.peripherals.tim import Pwm, Timer
from fcu_emulator.emulator.clock import PS_PER_US
from tests.support.arm.chip_fakes import NativeChip

CR1, DIER, SR, EGR, CNT, CCR1, BDTR = 0x00, 0x0C, 0x10, 0x14, 0x24, 0x34, 0x44
OFFSETS = {
    "CR1": CR1,
    "DIER": DIER,
    "SR": SR,
    "EGR": EGR,
    "CCMR1": 0x18,
    "CCMR2": 0x1C,
    "CCER": 0x20,
    "CNT": CNT,
    "PSC": 0x28,
    "ARR": 0x2C,
    "CCR1": CCR1,
    "CCR2": 0x38,
}
CC1IF, CC2IF, CC1OF = 2, 4, 1 << 9


@pytest.fixture
def chip() -> NativeChip:
    return NativeChip()


def timer(chip: NativeChip, name: str, **registers: int) -> Timer:
    """A timer of a chip whose timer clock is 84 MHz. Registers are written in the given order."""
    tim = chip.timer(name)
    for register, value in registers.items():
        tim.write(OFFSETS[register], value)
    return tim


def duty(tim: Timer) -> float:
    pwm = tim.pwm(1)
    assert pwm is not None
    return pwm.duty


def motors(chip: NativeChip, **registers: int) -> Timer:
    """Return TIM4 with the settings of ST's firmware for the motors."""
    settings = {"PSC": 84, "ARR": 1999, "CCMR1": 0x6868, "CCMR2": 0x6868, "CCER": 0x1111, **registers}
    return timer(chip, "TIM4", **settings, EGR=1, CR1=1)


def test_motor_pwm_has_st_frequency_and_duty(chip: NativeChip) -> None:
    """ST's firmware: 84 MHz / 85 / 2000 = 494.118 Hz, duty CCR / 2000."""
    tim = motors(chip, CCR2=500)
    pwm = tim.pwm(2)
    assert pwm is not None
    assert pwm.frequency_hz == pytest.approx(494.118, abs=1e-3)
    assert (pwm.duty, tim.pwm(1)) == (0.25, Pwm(pwm.frequency_hz, 0.0))


def test_preloaded_duty_waits_for_next_cycle(chip: NativeChip) -> None:
    """RM0368 12.4.7, OC1PE."""
    tim = motors(chip, CCR1=500)
    tim.write(CCR1, 1000)
    assert duty(tim) == 0.25
    chip.run_for(2024 * PS_PER_US)
    assert duty(tim) == 0.5


@pytest.mark.parametrize(
    ("ccmr1", "ccer", "cr1", "ccr", "share"),
    [
        (0x60, 1, 1, 25, 0.25),  # PWM mode 1, up: high while CNT < CCR
        (0x70, 1, 1, 25, 0.75),  # PWM mode 2
        (0x60, 3, 1, 25, 0.75),  # active low
        (0x60, 1, 0x11, 25, 0.26),  # down: high while CNT <= CCR
        (0x60, 1, 1, 0, 0.0),  # CCR of 0: held low
        (0x70, 1, 1, 0, 1.0),  # in mode 2 held high
        (0x60, 1, 0x11, 0, 0.01),  # down: "0 % PWM is not possible"
        (0x60, 1, 0x61, 0, 0.0),  # centre-aligned
        (0x60, 1, 1, 200, 1.0),  # CCR beyond ARR
        (0x50, 1, 1, 0, 1.0),  # forced active
        (0x40, 1, 1, 0, 0.0),  # forced inactive
    ],
)
def test_pwm_modes_and_polarity_determine_duty(
    chip: NativeChip, ccmr1: int, ccer: int, cr1: int, ccr: int, share: float
) -> None:
    """RM0368 12.3.7, 12.3.9."""
    tim = timer(chip, "TIM3", ARR=99, CCMR1=ccmr1, CCER=ccer, CCR1=ccr, CR1=cr1)
    hz = 84e6 / (198 if cr1 & 0x60 else 100)
    assert tim.pwm(1) == Pwm(pytest.approx(hz), pytest.approx(share))


def test_centre_aligned_pwm_has_half_frequency(chip: NativeChip) -> None:
    """RM0368 12.3.9: up and down in 2 * ARR counts."""
    tim = timer(chip, "TIM3", ARR=100, CCMR1=0x60, CCER=1, CCR1=25, CR1=0x61)
    assert tim.pwm(1) == Pwm(420_000.0, 0.25)


def test_pwm_needs_channel_counter_and_main_output_enabled(chip: NativeChip) -> None:
    """RM0368 12.4.18: TIM1 needs MOE."""
    assert timer(chip, "TIM3", ARR=99, CCMR1=0x60, CCR1=5, CR1=1).pwm(1) is None
    assert timer(chip, "TIM4", ARR=99, CCMR1=0x60, CCR1=5, CCER=1).pwm(1) is None
    tim1 = timer(chip, "TIM1", ARR=99, CCMR1=0x60, CCR1=5, CCER=1, CR1=1)
    assert tim1.pwm(1) is None
    tim1.write(BDTR, 1 << 15)
    assert tim1.pwm(1) == Pwm(840_000.0, 0.05)


def test_compare_interrupt_comes_at_its_count(chip: NativeChip) -> None:
    """TIM3 counts at 1 MHz with CCR1 = 10: the interrupt comes 10 us after the start, then once a cycle of 50 us."""
    tim = timer(chip, "TIM3", PSC=83, ARR=49, EGR=1, SR=0, CCR1=10, DIER=CC1IF, CR1=1)
    for cycle in range(3):
        chip.run_to((10 + 50 * cycle) * PS_PER_US - 1)
        assert not chip.irq.level(29)
        chip.run_for(1)
        assert chip.irq.level(29)
        assert tim.read(CNT) == 10
        tim.write(SR, ~CC1IF)


def test_compare_value_of_0_matches_once_per_cycle(chip: NativeChip) -> None:
    """RM0368 13.4.5, CC1IF: it is set when the counter reaches 0, which is each overflow of ARR = 49."""
    tim = timer(chip, "TIM3", PSC=83, ARR=49, EGR=1, SR=0, CCMR1=0x60, CCER=1, DIER=CC1IF, CR1=1)
    while chip.next_ps <= 150 * PS_PER_US:
        chip.run_to(chip.next_ps)
        tim.write(SR, 0)
    assert [at_ps // PS_PER_US for at_ps, _ in chip.irq.rises] == [50, 100, 150]


@pytest.mark.parametrize(("cms", "counts"), [(1, [90]), (2, [10]), (3, [10, 90])])
def test_centre_aligned_flags_are_set_in_selected_half(chip: NativeChip, cms: int, counts: list[int]) -> None:
    """RM0368 12.4.1, CMS: 1 for counting down, 2 for counting up, 3 for both."""
    tim = timer(chip, "TIM3", PSC=83, ARR=50, EGR=1, SR=0, CCR1=10, DIER=CC1IF, CR1=cms << 5 | 1)
    while chip.next_ps <= 100 * PS_PER_US:
        chip.run_to(chip.next_ps)
        tim.write(SR, 0)
    assert [at_ps // PS_PER_US for at_ps, _ in chip.irq.rises] == counts


def test_pulse_of_rc_receiver_is_measured(chip: NativeChip) -> None:
    """ST's firmware: TIM2 at 4 MHz captures both edges of the RC receiver on PA0."""
    tim = timer(chip, "TIM2", PSC=20, EGR=1, SR=0, CCMR1=0x0101, CCER=0xBB, DIER=CC1IF, CR1=1)
    port = chip["GPIOA"]
    port.write(0x20, 1)
    port.write(0x00, 2, 3)
    widths = list[int]()
    for level in (1, 0):
        chip.run_for(1500 * PS_PER_US)
        chip.gpio.drive("A", 0, level)
        assert chip.irq.level(28)
        widths.append(tim.read(CCR1))
        assert not chip.irq.level(28)
    assert widths == [6000, 12_000]


def test_unconnected_pin_is_not_captured(chip: NativeChip) -> None:
    tim = timer(chip, "TIM2", CCMR1=1, CCER=1, CR1=1)
    chip.gpio.drive("A", 0, 1)
    assert tim.read(SR) == 0


def test_second_capture_before_read_is_flagged(chip: NativeChip) -> None:
    """RM0368 12.3.6: CCxOF."""
    tim = timer(chip, "TIM2", CCMR1=1, CCER=0xB, CR1=1)
    port = chip["GPIOA"]
    port.write(0x20, 1)
    port.write(0x00, 2, 3)
    for level in (1, 0):
        chip.gpio.drive("A", 0, level)
    assert tim.read(SR) == CC1IF | CC1OF


def test_channel_captures_neighbour_input_with_prescaler(chip: NativeChip) -> None:
    """CC2S = 2: channel 2 captures TI1; IC2PSC = 1: every second edge."""
    tim = timer(chip, "TIM2", CCMR1=0x0600, CCER=0xB0, CR1=1)
    port = chip["GPIOA"]
    port.write(0x20, 1)
    port.write(0x00, 2, 3)
    chip.gpio.drive("A", 0, 1)
    assert tim.read(SR) == 0
    chip.gpio.drive("A", 0, 0)
    assert tim.read(SR) == CC2IF


def test_debugger_read_does_not_clear_capture_flag(chip: NativeChip) -> None:
    tim = timer(chip, "TIM2", CCMR1=1, CCER=1, CNT=77, EGR=CC1IF)
    assert tim.peek(CCR1) == 77
    assert tim.read(SR) & CC1IF
    assert tim.read(CCR1) == 77
    assert not tim.read(SR) & CC1IF


# -- an oscillator at input 4 of TIM5 (RM0368 13.4.21) -------------------------------------------------------

CCMR2, CCR4, OR, CC4IF, LSI = 0x1C, 0x40, 0x50, 0x10, 0x40


def lsi_timer(chip: NativeChip, ccmr2: int, **registers: int) -> Timer:
    tim = timer(chip, "TIM5", **registers)
    for offset, value in ((OR, LSI), (CCMR2, ccmr2), (0x20, 1 << 12), (CR1, 1)):
        tim.write(offset, value)
    return tim


@pytest.mark.parametrize(("ccmr2", "edges"), [(0x0100, 1), (0x0D00, 8)])
def test_tim5_measures_lsi(chip: NativeChip, ccmr2: int, edges: int) -> None:
    """84 MHz over 32 kHz gives 2625 counts between edges. IC4PSC = 3 captures every eighth edge."""
    tim = lsi_timer(chip, ccmr2, DIER=CC4IF)
    chip.run_for(PS_PER_US)
    chip.clocks.set(lsi_hz=32_000)
    captured = list[int]()
    for _ in range(5):
        while not chip.irq.level(50):
            chip.run_to(chip.next_ps)
        captured.append(tim.read(CCR4))
        assert not chip.irq.level(50)
    gaps = {after - before for before, after in pairwise(captured)}
    assert gaps == {2625 * edges}


def test_edge_of_polled_lsi_has_exact_time(chip: NativeChip) -> None:
    tim = lsi_timer(chip, 0x0100)
    chip.clocks.set(lsi_hz=32_000)
    value, until_ps = tim.read_with_validity(SR)
    assert not value & CC4IF
    chip.run_to(until_ps - 1)
    assert not tim.read(SR) & CC4IF
    while chip.clock.now_ps < 31_250_000:
        value, until_ps = tim.read_with_validity(SR)
        chip.run_to(until_ps)
    assert tim.read(SR) & CC4IF
    assert tim.read(CCR4) == 2625


def test_tim5_without_lsi_captures_nothing(chip: NativeChip) -> None:
    tim = lsi_timer(chip, 0x0100)
    chip.run_for(1000 * PS_PER_US)
    assert not tim.read(SR) & CC4IF
