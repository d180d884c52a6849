"""Timers agree with a slow oracle, for any writes at any times and for any reads."""

from __future__ import annotations

from hypothesis import given, settings
from hypothesis import strategies as st

from fcu_emulator.emulator.clock import PS_PER_S
from tests.support.arm.chip_fakes import NativeChip
from tests.support.arm.timer_oracle import SlowTimer

CR1, DIER, SR, EGR, CCMR1 = 0x00, 0x0C, 0x10, 0x14, 0x18
CNT, PSC, ARR, RCR, CCR1 = 0x24, 0x28, 0x2C, 0x30, 0x34
CEN, UDIS, URS, OPM, ARPE = 1, 2, 4, 8, 0x80
DIRECTION = {"up": 0, "down": 0x10, "centre": 0x60}  # CMS = 3: flags in both halves
TICK_PS = 1_000_000

SMALL = st.integers(0, 9)
STEPS = st.lists(
    st.one_of(
        st.tuples(st.just("wait"), st.integers(1, 120)),
        st.tuples(st.sampled_from(["psc"]), st.integers(0, 3)),
        st.tuples(st.sampled_from(["arr", "ccr", "cnt"]), SMALL),
        st.tuples(st.sampled_from(["cen", "arpe", "ocpe", "udis", "urs", "opm", "uie"]), st.integers(0, 1)),
        st.tuples(st.sampled_from(["ug", "clear", "look"]), st.just(0)),
    ),
    max_size=25,
)


class Pair:
    """A timer and its oracle, which receive the same writes."""

    def __init__(self, direction: str) -> None:
        self.chip = NativeChip()
        self.chip.clocks.set(timer1_hz=PS_PER_S // TICK_PS)
        self.tim = self.chip.timer("TIM3")
        self.slow = SlowTimer(direction)
        self.uie = False
        self._cr1 = DIRECTION[direction]
        self.tim.write(CR1, self._cr1)
        for name, value in (("arr", 7), ("ug", 0), ("clear", 0)):
            self.do(name, value)

    def do(self, name: str, value: int) -> None:
        tim, slow = self.tim, self.slow
        match name:
            case "wait":
                self.chip.run_for(value * TICK_PS)
                for _ in range(value):
                    slow.tick()
            case "psc":
                tim.write(PSC, value)
                slow.psc = value
            case "arr":
                tim.write(ARR, value)
                slow.write_arr(value)
            case "ccr":
                tim.write(CCR1, value)
                slow.write_ccr(value)
            case "cnt":
                tim.write(CNT, value)
                slow.cnt = value
            case "ocpe":
                tim.write(CCMR1, value << 3)
                slow.ocpe = bool(value)
                slow.write_ccr(slow.ccr)
            case "uie":
                tim.write(DIER, value)
                self.uie = bool(value)
            case "ug":
                tim.write(EGR, 1)
                slow.update_by_software()
            case "clear":
                tim.write(SR, 0)
                slow.uif = slow.cc1if = False
            case "look":
                self.compare()
            case _:
                self._control(name, value)

    def _control(self, name: str, value: int) -> None:
        setattr(self.slow, name, bool(value))
        self.slow.write_arr(self.slow.arr)
        slow = self.slow
        bits = CEN * slow.cen | UDIS * slow.udis | URS * slow.urs | OPM * slow.opm | ARPE * slow.arpe
        self.tim.write(CR1, self._cr1 | bits)

    def compare(self) -> None:
        tim, slow = self.tim, self.slow
        assert (tim.read(CNT), tim.read(SR) & 3) == (slow.cnt, slow.uif | slow.cc1if << 1)
        assert bool(tim.read(CR1) & CEN) == slow.cen
        assert self.chip.irq.level(29) == (self.uie and slow.uif)


@settings(max_examples=150)
@given(STEPS)
def test_counting_up_equals_oracle(steps: list[tuple[str, int]]) -> None:
    pair = Pair("up")
    for step in [*steps, ("look", 0)]:
        pair.do(*step)


@settings(max_examples=150)
@given(STEPS)
def test_counting_down_equals_oracle(steps: list[tuple[str, int]]) -> None:
    pair = Pair("down")
    for step in [*steps, ("look", 0)]:
        pair.do(*step)


@settings(max_examples=150)
@given(STEPS)
def test_counting_up_and_down_equals_oracle(steps: list[tuple[str, int]]) -> None:
    """The test does not write CNT, and changes ARR only at an update. The manual does not describe other cases."""
    pair = Pair("centre")
    pair.do("arpe", 1)
    for name, value in [*steps, ("look", 0)]:
        if name not in {"cnt", "arpe"}:
            pair.do(name, value)


@given(st.integers(0, 3), st.integers(1, 9), st.integers(0, 4), st.integers(1, 600))
def test_repetition_counter_divides_updates(psc: int, arr: int, rcr: int, ticks: int) -> None:
    """RM0368 12.3.3: an update every RCR + 1 overflows."""
    chip = NativeChip()
    chip.clocks.set(timer2_hz=PS_PER_S // TICK_PS)
    tim = chip.timer("TIM1")
    for offset, value in ((PSC, psc), (ARR, arr), (RCR, rcr), (EGR, 1), (SR, 0), (DIER, 1), (CR1, CEN)):
        tim.write(offset, value)
    period = (psc + 1) * (arr + 1) * (rcr + 1)
    for _ in range(ticks // period):
        chip.run_for(period * TICK_PS - 1)
        assert not chip.irq.level(25)
        chip.run_for(1)
        assert chip.irq.level(25)
        tim.write(SR, 0)
    chip.run_for(ticks % period * TICK_PS)
    assert tim.ticks == ticks // period
    assert tim.rate_hz == 1e6 / period


@given(st.integers(10**6, 84 * 10**6), st.integers(0, 0xFFFF), st.integers(1, 0xFFFF), st.integers(1, 1000))
def test_updates_never_drift(hz: int, psc: int, arr: int, count: int) -> None:
    """The k-th update comes k periods after the start, rounded down once."""
    chip = NativeChip()
    chip.clocks.set(timer2_hz=hz)
    tim = chip.timer("TIM9")
    for offset, value in ((PSC, psc), (ARR, arr), (EGR, 1), (SR, 0), (DIER, 1), (CR1, CEN)):
        tim.write(offset, value)
    at_ps = count * (psc + 1) * (arr + 1) * PS_PER_S // hz
    chip.run_to(at_ps - 1)
    tim.write(SR, 0)
    assert not chip.irq.level(24)
    chip.run_to(at_ps)
    assert chip.irq.level(24)
    assert tim.read(CNT) == 0


@given(st.integers(1, 84 * 10**6), st.integers(1, 9), st.lists(st.integers(1, PS_PER_S // 5), max_size=30))
def test_counter_read_often_never_drifts(hz: int, prescale: int, waits_ps: list[int]) -> None:
    """CNT depends only on the time since the start, for any number and times of reads."""
    chip = NativeChip()
    chip.clocks.set(timer1_hz=hz)
    tim = chip.timer("TIM2")
    for offset, value in ((PSC, prescale - 1), (ARR, 0xFFFF_FFFF), (EGR, 1), (SR, 0), (CR1, CEN)):
        tim.write(offset, value)
    began_ps = chip.clock.now_ps
    for wait_ps in waits_ps:
        chip.run_for(wait_ps)
        after_ps = chip.clock.now_ps - began_ps
        ticks = ((after_ps + 1) * hz - 1) // PS_PER_S  # the last one whose time, rounded down, has come
        assert tim.read(CNT) == ticks // prescale
