"""ADC1: conversions that timers and EXTI start (RM0368 sections 11.6, 12.3.8, 12.3.9, 12.4.2, 10.2.3)."""

from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fcu_emulator.emulator.clock import NEVER_PS, PS_PER_S, PS_PER_US
from tests.support.arm.adc_bench import (
    ADON,
    CCR,
    CR1,
    CR2,
    DDS,
    DMA,
    JEOC,
    JSTRT,
    SR,
    STRT,
    SWSTART,
    DmaResults,
    injected_sequence,
    regular_sequence,
)
from tests.support.arm.chip_fakes import NativeChip

# Registers and bits of a timer (RM0368 12.4, 13.4).
T_CR1, T_CR2, T_DIER, T_SR, T_EGR, T_CCMR1, T_CCMR2, T_CCER = 0x00, 0x04, 0x0C, 0x10, 0x14, 0x18, 0x1C, 0x20
T_CNT, T_PSC, T_ARR, T_RCR, T_CCR1, T_BDTR = 0x24, 0x28, 0x2C, 0x30, 0x34, 0x44
CEN, UDIS, OPM, DIR, CMS = 1, 2, 8, 0x10, 0x60
UG, MOE = 1, 1 << 15
FROZEN, ACTIVE, INACTIVE, TOGGLE, LOW, HIGH, PWM1, PWM2 = range(8)  # OCxM
RESET, ENABLE, UPDATE, COMPARE_PULSE, OC1REF = range(5)  # MMS
RISING, FALLING, BOTH = 1, 2, 3  # EXTEN, JEXTEN

REGULAR = ["1.1", "1.2", "1.3", "2.2", "2.3", "2.4", "2.T", "3.1", "3.T", "4.4", "5.1", "5.2", "5.3"]
INJECTED = ["1.4", "1.T", "2.1", "2.T", "3.2", "3.4", "4.1", "4.2", "4.3", "4.T", "5.4", "5.T"]
"""Timer and channel, or T for its trigger output, by EXTSEL and JEXTSEL (RM0368 11.12.3)."""
TIM2_TRGO, TIM3_CC1, TIM3_TRGO, EXTI_LINE = 6, 7, 8, 15
CONVERSION_PS = 9 * PS_PER_S // 42_000_000
"""The shortest conversion: 3 cycles of sampling and 6 bits, with half of PCLK2."""


class Bench:
    """A chip whose ADC records the times at which conversions have started, in microseconds."""

    def __init__(self) -> None:
        self.chip = NativeChip()
        self.adc = self.chip.adc
        self.started: list[float] = []
        self.adc.inputs.connect(1, self._sample)
        self.adc.write(CCR, 0)
        self.adc.write(CR1, 3 << 24)  # RES: 6 bits
        regular_sequence(self.adc, [1])
        injected_sequence(self.adc, [1])

    def _sample(self) -> float:
        self.started.append((self.chip.clock.now_ps - CONVERSION_PS) / PS_PER_US)
        return 0.0

    def timer(self, number: int, arr: int = 99, cr1: int = 0) -> None:
        """Set up a timer that counts microseconds, without starting it."""
        tim = self.tim = self.chip[f"TIM{number}"]
        tim.write(T_PSC, 83)
        tim.write(T_ARR, arr)
        tim.write(T_CR1, cr1)
        tim.write(T_BDTR, MOE)
        tim.write(T_EGR, UG)

    def channel(self, number: int, mode: int, compare: int, enable: int = 1) -> None:
        """Set up an output. ``enable``: CCxE, and CCxP in bit 1."""
        shift = 8 * ((number - 1) % 2)
        self.tim.write(T_CCR1 + 4 * (number - 1), compare)
        self.tim.write(T_CCMR1 if number < 3 else T_CCMR2, mode << 4 + shift)
        self.tim.write(T_CCER, enable << 4 * (number - 1))

    def trigger(self, source: int, edges: int = RISING) -> None:
        self.adc.write(CR2, ADON | edges << 28 | source << 24)

    def trigger_injected(self, source: int, edges: int = RISING) -> None:
        self.adc.write(CR2, ADON | edges << 20 | source << 16)

    def start(self, us: float) -> list[float]:
        """Start the timer, and return the starts of conversions in the given time."""
        self.tim.write(T_CR1, self.tim.read(T_CR1) | CEN)
        return self.run(us)

    def run(self, us: float) -> list[float]:
        self.chip.run_for(round(us * PS_PER_US))
        return self.started


@pytest.fixture
def bench() -> Bench:
    return Bench()


# -- sources ------------------------------------------------------------------------------------------------


def set_up_source(bench: Bench, source: str) -> None:
    number, signal = source.split(".")
    bench.timer(int(number))
    if signal == "T":
        bench.channel(1, PWM1, 40, enable=0)
        bench.tim.write(T_CR2, OC1REF << 4)
    else:
        bench.channel(int(signal), PWM1, 40)


each_edge = pytest.mark.parametrize(
    ("edges", "starts"), [(RISING, [100, 200]), (FALLING, [40, 140]), (BOTH, [40, 100, 140, 200])]
)


@each_edge
@pytest.mark.parametrize("source", REGULAR)
def test_timer_starts_regular_conversion(bench: Bench, source: str, edges: int, starts: list[float]) -> None:
    set_up_source(bench, source)
    bench.trigger(REGULAR.index(source), edges)
    assert bench.start(220) == starts
    assert bench.adc.read(SR) & (STRT | JSTRT) == STRT


@each_edge
@pytest.mark.parametrize("source", INJECTED)
def test_timer_starts_injected_conversion(bench: Bench, source: str, edges: int, starts: list[float]) -> None:
    set_up_source(bench, source)
    bench.trigger_injected(INJECTED.index(source), edges)
    assert bench.start(220) == starts
    assert bench.adc.read(SR) == JSTRT | JEOC


@pytest.mark.parametrize("source", sorted({*REGULAR, *INJECTED}))
def test_other_sources_do_not_start_conversions(bench: Bench, source: str) -> None:
    """Both groups listen to all other sources in turn."""
    set_up_source(bench, source)
    bench.tim.write(T_CR1, bench.tim.read(T_CR1) | CEN)
    for code in range(16):
        regular = BOTH if code >= len(REGULAR) or REGULAR[code] != source else 0
        injected = BOTH if code >= len(INJECTED) or INJECTED[code] != source else 0
        bench.adc.write(CR2, ADON | regular << 28 | code << 24 | injected << 20 | code << 16)
        bench.run(250)
    assert bench.started == []


def test_trigger_needs_adon_and_edge_selection(bench: Bench) -> None:
    """RM0368 11.6: EXTEN = 0 disables the trigger."""
    set_up_source(bench, "3.1")
    for control in (TIM3_CC1 << 24 | BOTH << 28, TIM3_CC1 << 24 | ADON, 0):
        bench.adc.write(CR2, control)
        assert (bench.start(220), bench.chip.next_ps) == ([], NEVER_PS)


def test_software_starts_conversion_besides_trigger(bench: Bench) -> None:
    set_up_source(bench, "3.1")
    bench.trigger(TIM3_CC1)
    bench.adc.write(CR2, bench.adc.read(CR2) | SWSTART)
    assert bench.start(120) == [0, 100]


def test_trigger_during_conversion_is_ignored(bench: Bench) -> None:
    """RM0368 11.3.9 describes only triggers of the other group. A conversion of 480 + 6 cycles takes 11.6 us."""
    bench.timer(2, arr=4)
    bench.tim.write(T_CR2, UPDATE << 4)
    bench.adc.write(0x10, 7 << 3)  # SMPR2.SMP1
    bench.trigger(TIM2_TRGO)
    long_us = (486 - 9) / 42
    assert [round(at_us - long_us) for at_us in bench.start(50)] == [5, 20, 35]


# -- outputs of the channels --------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("mode", "compare", "rises", "falls"),
    [
        (PWM1, 0, [], []),
        (PWM1, 1, [100, 200], [1, 101, 201]),
        (PWM1, 99, [100, 200], [99, 199]),
        (PWM1, 100, [], []),
        (PWM2, 40, [40, 140, 240], [100, 200]),
        (ACTIVE, 40, [40], []),
        (INACTIVE, 40, [], []),
        (TOGGLE, 40, [40, 240], [140]),
        (TOGGLE, 0, [100], [200]),
        (TOGGLE, 120, [], []),
        (FROZEN, 40, [], []),
        (LOW, 40, [], []),
        (HIGH, 40, [], []),
    ],
)
def test_output_mode_determines_edges(
    bench: Bench, mode: int, compare: int, rises: list[float], falls: list[float]
) -> None:
    """RM0368 12.3.8, 12.3.9, 12.4.7. The channel's mode is set before the ADC listens."""
    for edges, starts in ((RISING, rises), (FALLING, falls)):
        one = Bench()
        one.timer(3)
        one.channel(1, mode, compare)
        one.trigger(TIM3_CC1, edges)
        assert one.start(250) == starts


@pytest.mark.parametrize(
    ("cr1", "rises", "falls"),
    [(DIR, [60, 160], [100, 200]), (CMS, [158], [40, 238])],
    ids=["down", "centre"],
)
def test_counting_direction_determines_edges(cr1: int, rises: list[float], falls: list[float]) -> None:
    """RM0368 12.3.9. Down from 99: CNT <= 39 from 60 us on. Centre-aligned: up to 99, then CNT <= 40 at 158 us."""
    for edges, starts in ((RISING, rises), (FALLING, falls)):
        bench = Bench()
        bench.timer(3, cr1=cr1)
        bench.channel(1, PWM1, 39 if cr1 == DIR else 40)
        bench.trigger(TIM3_CC1, edges)
        assert bench.start(240) == starts


def test_inverted_output_exchanges_edges(bench: Bench) -> None:
    """The trigger is the output, behind the polarity (CCxP)."""
    bench.timer(3)
    bench.channel(1, PWM1, 40, enable=3)
    bench.trigger(TIM3_CC1)
    assert bench.start(220) == [40, 140]


@pytest.mark.parametrize(("number", "enable", "moe"), [(3, 0, 1), (1, 1, 0), (1, 0, 1)])
def test_disabled_output_does_not_trigger(bench: Bench, number: int, enable: int, moe: int) -> None:
    """The signal to the ADC is that of the pin (efton.sk/STM32/gotcha/g89.html): CCxE, and MOE of TIM1."""
    bench.timer(number)
    bench.tim.write(T_BDTR, MOE * moe)
    bench.channel(1, PWM1, 40, enable)
    bench.trigger(REGULAR.index(f"{number}.1"), BOTH)
    assert bench.start(250) == []


def test_enabling_output_starts_conversion(bench: Bench) -> None:
    """A change by software is an edge, too. The forced modes make edges at any time (RM0368 12.3.7)."""
    bench.timer(3)
    bench.channel(1, HIGH, 0, enable=0)
    bench.trigger(TIM3_CC1)
    bench.run(5)
    bench.tim.write(T_CCER, 1)
    bench.run(5)
    bench.tim.write(T_CCMR1, LOW << 4)
    bench.run(5)
    bench.tim.write(T_CCMR1, HIGH << 4)
    assert bench.run(5) == [5, 15]


def test_toggling_output_keeps_level_without_listener(bench: Bench) -> None:
    """The output toggles at 40, 140 and 240 us; the ADC listens from 250 us on."""
    bench.timer(3)
    bench.channel(1, TOGGLE, 40)
    bench.start(250)
    bench.trigger(TIM3_CC1, FALLING)
    assert bench.run(200) == [340]


def test_frozen_output_keeps_level_of_pwm(bench: Bench) -> None:
    """RM0368 12.4.7: in the frozen mode, the comparison has no effect on the output."""
    bench.timer(3)
    bench.channel(1, PWM1, 40)
    bench.trigger(TIM3_CC1, FALLING)
    bench.start(20)
    bench.tim.write(T_CCMR1, FROZEN << 4)
    assert bench.run(200) == []
    bench.tim.write(T_CCMR1, LOW << 4)
    assert bench.run(10) == [220]


def test_preloaded_compare_value_moves_edge_from_update(bench: Bench) -> None:
    """RM0368 12.3.9, 12.4.7, OCxPE."""
    bench.timer(3)
    bench.channel(1, PWM1, 40)
    bench.tim.write(T_CCMR1, PWM1 << 4 | 1 << 3)
    bench.trigger(TIM3_CC1, FALLING)
    bench.start(20)
    bench.tim.write(T_CCR1, 70)
    assert bench.run(260) == [40, 170, 270]


def test_preloaded_compare_value_starts_toggling_after_update(bench: Bench) -> None:
    """A compare value above ARR never matches. The value that replaces it is active from the update at 100 us on."""
    bench.timer(3)
    bench.channel(1, TOGGLE, 120)
    bench.tim.write(T_CCMR1, TOGGLE << 4 | 1 << 3)
    bench.trigger(TIM3_CC1, BOTH)
    bench.start(20)
    bench.tim.write(T_CCR1, 40)
    assert bench.run(260) == [140, 240]


def test_overflow_without_update_raises_output(bench: Bench) -> None:
    """RM0368 12.4.1, UDIS: the counter overflows without an update, and the output follows the counter."""
    bench.timer(3)
    bench.channel(1, PWM1, 40)
    bench.tim.write(T_CR1, UDIS)
    bench.trigger(TIM3_CC1)
    assert bench.start(250) == [100, 200]


def test_counter_above_arr_compares_until_it_wraps(bench: Bench) -> None:
    """RM0368 12.3.2: CNT = 65000 is above ARR, and counts up to 65535. CNT < CCR holds until 65100, and from 0 on."""
    bench.timer(3)
    bench.channel(1, PWM1, 65_100)
    bench.tim.write(T_CNT, 65_000)
    bench.trigger(TIM3_CC1, BOTH)
    assert bench.start(1_000) == [100, 536]


# -- trigger output -----------------------------------------------------------------------------------------


def trigger_output(bench: Bench, mode: int, *, number: int = 3, edges: int = RISING, cr1: int = 0) -> None:
    bench.timer(number, cr1=cr1)
    bench.channel(1, PWM1, 40, enable=0)
    bench.tim.write(T_CR2, mode << 4)
    if number == 1:
        bench.trigger_injected(INJECTED.index("1.T"), edges)
    else:
        bench.trigger(TIM3_TRGO, edges)


def test_trigger_output_in_reset_mode_sends_ug(bench: Bench) -> None:
    """RM0368 12.4.2, MMS = 0."""
    trigger_output(bench, RESET)
    bench.start(130)
    bench.tim.write(T_EGR, UG)
    assert bench.run(250) == [130]


@pytest.mark.parametrize(("edges", "starts"), [(RISING, [0]), (FALLING, [100])])
def test_trigger_output_in_enable_mode_sends_cen(bench: Bench, edges: int, starts: list[float]) -> None:
    """RM0368 12.4.2, MMS = 1. In one-pulse mode, CEN falls at the update."""
    trigger_output(bench, ENABLE, edges=edges, cr1=OPM)
    assert bench.start(250) == starts


def test_trigger_output_in_update_mode_sends_updates(bench: Bench) -> None:
    """RM0368 12.4.2, MMS = 2. UIF stays set, which has no effect."""
    trigger_output(bench, UPDATE)
    bench.start(250)
    bench.tim.write(T_EGR, UG)
    assert bench.run(110) == [100, 200, 250, 350]


def test_disabled_updates_send_no_trigger(bench: Bench) -> None:
    """RM0368 12.4.1, UDIS."""
    trigger_output(bench, UPDATE, cr1=UDIS)
    bench.start(250)
    bench.tim.write(T_EGR, UG)
    assert bench.run(110) == []


def test_repetition_counter_divides_triggers(bench: Bench) -> None:
    """RM0368 12.3.3: RCR = 2 gives an update at each third overflow."""
    trigger_output(bench, UPDATE, number=1)
    bench.tim.write(T_RCR, 2)
    bench.tim.write(T_EGR, UG)
    bench.run(1)
    assert bench.start(910) == [0, 301, 601, 901]


def test_compare_pulse_mode_sends_each_match(bench: Bench) -> None:
    """RM0368 12.4.2, MMS = 3: a pulse when CC1IF is to be set, even if it is already set."""
    trigger_output(bench, COMPARE_PULSE)
    assert bench.start(250) == [40, 140, 240]


def test_compare_pulse_mode_sends_software_event(bench: Bench) -> None:
    """RM0368 12.4.2, 12.4.6: CC1G is to set CC1IF, too."""
    trigger_output(bench, COMPARE_PULSE)
    bench.run(10)
    bench.tim.write(T_EGR, 1 << 1)
    assert bench.run(10) == [10]


def test_compare_pulse_mode_sends_captures(bench: Bench) -> None:
    """RM0368 12.4.2, MMS = 3: also a capture. PA6 is the input of channel 1 of TIM3 (alternate function 2)."""
    bench.timer(3)
    bench.chip["GPIOA"].write(0x20, 2 << 24)
    bench.chip["GPIOA"].write(0x00, 2 << 12)
    bench.tim.write(T_CCMR1, 1)
    bench.tim.write(T_CCER, 1)
    bench.tim.write(T_CR2, COMPARE_PULSE << 4)
    bench.trigger(TIM3_TRGO)
    bench.chip.gpio.drive("A", 6, 0)
    bench.start(30)
    bench.chip.gpio.drive("A", 6, 1)
    bench.run(30)
    assert bench.started == [30]


@pytest.mark.parametrize("channel", [1, 2, 3, 4])
def test_output_reference_is_trigger_output(bench: Bench, channel: int) -> None:
    """RM0368 12.4.2, MMS = 4 to 7: OCxREF needs neither CCxE nor MOE, and has no polarity."""
    bench.timer(1)
    bench.tim.write(T_BDTR, 0)
    bench.channel(channel, PWM1, 40, enable=2)
    bench.tim.write(T_CR2, (OC1REF + channel - 1) << 4)
    bench.trigger_injected(INJECTED.index("1.T"))
    assert bench.start(220) == [100, 200]


def test_timer_without_listener_causes_no_events(bench: Bench) -> None:
    """An output costs time only while the ADC listens to it."""
    trigger_output(bench, UPDATE)
    bench.start(50)
    assert bench.chip.next_ps == 100 * PS_PER_US
    bench.trigger(TIM3_CC1, 0)
    assert bench.chip.next_ps == NEVER_PS
    bench.trigger(TIM3_TRGO)
    bench.adc.reset()
    assert bench.chip.next_ps == NEVER_PS


def test_timer_after_reset_sends_no_triggers(bench: Bench) -> None:
    trigger_output(bench, UPDATE)
    bench.start(150)
    bench.tim.reset()
    assert bench.run(250) == [100]


def test_timer_after_reset_toggles_from_low_level(bench: Bench) -> None:
    bench.timer(3)
    bench.channel(1, TOGGLE, 40)
    bench.start(50)
    bench.tim.reset()
    bench.timer(3)
    bench.channel(1, TOGGLE, 40)
    bench.trigger(TIM3_CC1)
    assert bench.start(250) == [90, 290]


def test_dma_stores_samples_at_rate_of_timer(bench: Bench) -> None:
    """A timer starts a conversion every 1905 ticks, about 44.1 kHz, because 1904 + 16/21 ticks are not possible."""
    bench.timer(2)
    bench.tim.write(T_PSC, 0)
    bench.tim.write(T_ARR, 1904)
    bench.tim.write(T_CR2, UPDATE << 4)
    bench.tim.write(T_EGR, UG)
    bench.adc.inputs.connect(1, lambda: 3.3 * (bench.chip.clock.now_ps % PS_PER_S) / PS_PER_S)
    bench.adc.write(CR1, 0)
    results = DmaResults(bench.chip, 1000, circular=True)
    bench.adc.write(CR2, ADON | DMA | DDS | RISING << 28 | TIM2_TRGO << 24)
    bench.start(100_000)
    conversion_ps = 15 * PS_PER_S // 42_000_000
    times = [number * 1905 * PS_PER_S // 84_000_000 + conversion_ps for number in range(1, 4410)]
    expected = [round(4095 * at_ps / PS_PER_S) for at_ps in times if at_ps <= 100_000 * PS_PER_US]
    stored = results.at(1000)
    assert len(expected) == 4409
    assert stored == expected[4000:4409] + expected[3409:4000]


# -- EXTI ---------------------------------------------------------------------------------------------------

X_IMR, X_EMR, X_RTSR, X_FTSR, X_SWIER, X_PR = 0x00, 0x04, 0x08, 0x0C, 0x10, 0x14


def listen_to_exti(bench: Bench, line: int, edges: int = RISING) -> None:
    (bench.trigger if line == 11 else bench.trigger_injected)(EXTI_LINE, edges)
    bench.chip["EXTI"].write(X_EMR, 1 << line)
    bench.chip.gpio.drive("C", line, 0)
    bench.chip["SYSCFG"].write(0x08 + 4 * (line // 4), 2 << 4 * (line % 4))  # EXTICR: port C


@pytest.mark.parametrize("edges", [RISING, FALLING, BOTH])
@pytest.mark.parametrize(("line", "flag"), [(11, STRT), (15, JSTRT)])
@pytest.mark.parametrize(("register", "at_us"), [(X_RTSR, 10), (X_FTSR, 20)])
def test_pin_event_starts_conversion(
    bench: Bench, register: int, at_us: float, line: int, flag: int, edges: int
) -> None:
    """RM0368 11.12.3: EXTI line 11 starts the regular group, line 15 the injected group. EXTI selects the edge."""
    listen_to_exti(bench, line, edges)
    bench.chip["EXTI"].write(register, 1 << line)
    for level in (1, 0):
        bench.run(10)
        bench.chip.gpio.drive("C", line, level)
    assert bench.run(10) == [at_us]
    assert bench.adc.read(SR) & (STRT | JSTRT) == flag


def test_software_event_starts_conversion(bench: Bench) -> None:
    """RM0368 10.2.3: SWIER makes the event, too; PR needs IMR (10.3.5)."""
    listen_to_exti(bench, 11)
    bench.chip["EXTI"].write(X_SWIER, 1 << 11)
    assert bench.run(10) == [0]
    assert bench.chip["EXTI"].read(X_PR) == 0


@pytest.mark.parametrize(("mask", "line"), [(0, 11), (1 << 11, 10), (1 << 11, 15)])
def test_masked_or_other_event_starts_nothing(bench: Bench, mask: int, line: int) -> None:
    listen_to_exti(bench, 11)
    bench.chip["EXTI"].write(X_EMR, mask)
    bench.chip["EXTI"].write(X_IMR, 0xFFFF)
    bench.chip["EXTI"].write(X_SWIER, 1 << line)
    assert bench.run(10) == []


# -- laws ---------------------------------------------------------------------------------------------------


@settings(max_examples=60, deadline=None)
@given(
    cr1=st.sampled_from([0, DIR, 0x20, 0x40, 0x60]),
    mode=st.sampled_from([PWM1, PWM2]),
    arr=st.integers(1, 8),
    changes=st.lists(st.tuples(st.integers(1, 30), st.integers(0, 10)), max_size=4),
    preload=st.booleans(),
)
def test_edges_agree_with_polled_counter(
    cr1: int, mode: int, arr: int, changes: list[tuple[int, int]], preload: bool
) -> None:
    """RM0368 12.3.9: the level is a function of CNT, DIR and the active CCR. Another timer is read at each count."""
    bench = Bench()
    bench.timer(3, arr, cr1)
    bench.channel(1, mode, 3)
    bench.tim.write(T_CCMR1, mode << 4 | preload << 3)
    bench.trigger(TIM3_CC1, BOTH)
    read = Bench()
    read.timer(3, arr, cr1)
    level = is_active(read, mode, 3)
    bench.start(0)
    read.start(0)
    active, expected, now = 3, [], 0
    for wait, compare in [*changes, (25, 0)]:
        for _ in range(wait):
            read.tim.write(T_SR, 0)
            read.run(1)
            now += 1
            if preload and read.tim.read(T_SR) & 1:
                active = bench.tim.peek(T_CCR1)
            before, level = level, is_active(read, mode, active)
            expected += [now] * (before != level)
        bench.run(wait)
        bench.tim.write(T_CCR1, compare)
        active = active if preload else compare
        before, level = level, is_active(read, mode, active)
        expected += [now] * (before != level)
    bench.run(1)
    assert bench.started == sorted(set(expected))  # the second edge of a count comes during the conversion


def is_active(bench: Bench, mode: int, compare: int) -> bool:
    value, falling = bench.tim.read(T_CNT), bool(bench.tim.read(T_CR1) & DIR)
    return (value <= compare if falling else value < compare) == (mode == PWM1)
