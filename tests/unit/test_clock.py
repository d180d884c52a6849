"""Virtual time: order of events, exact periods, cancellation."""

from __future__ import annotations

from fractions import Fraction

from hypothesis import given
from hypothesis import strategies as st

from fcu_emulator.emulator.clock import NEVER_PS, PS_PER_S, Clock, Periodic, to_ps


def test_events_fire_in_order_of_time_and_scheduling() -> None:
    clock, seen = Clock(), list[str]()
    clock.schedule(20, lambda: seen.append("late"))
    clock.schedule(10, lambda: seen.append("first"))
    clock.schedule(10, lambda: seen.append("second"))
    clock.schedule(10, lambda: seen.append("last"), last=True)
    clock.schedule(10, lambda: seen.append("third"))
    clock.advance_to(15)
    assert seen == ["first", "second", "third", "last"]
    assert (clock.now_ps, clock.next_ps) == (15, 20)


def test_event_scheduled_in_past_fires_immediately() -> None:
    clock, seen = Clock(), list[int]()
    clock.advance_to(100)
    clock.schedule(50, lambda: seen.append(clock.now_ps))
    clock.advance_to(100)
    assert seen == [100]


def test_cancelled_event_does_not_fire() -> None:
    clock, seen = Clock(), list[int]()
    event = clock.schedule(10, lambda: seen.append(1))
    event.cancel()
    clock.advance_to(20)
    assert seen == []
    assert clock.next_ps == NEVER_PS


def test_event_may_schedule_another_for_same_time() -> None:
    clock, seen = Clock(), list[int]()
    clock.schedule(10, lambda: clock.schedule(10, lambda: seen.append(clock.now_ps)) and None)
    clock.advance_to(10)
    assert seen == [10]


@given(st.fractions(min_value=1000, max_value=10**9), st.integers(1, 200))
def test_nth_period_is_computed_from_n(period: Fraction, count: int) -> None:
    clock, times = Clock(), list[int]()
    Periodic(clock, 5, period, lambda: times.append(clock.now_ps))
    clock.advance_to(5 + int(count * period))
    assert times == [5 + int(n * period) for n in range(1, len(times) + 1)]
    assert len(times) == count


def test_800_hz_is_exact_after_hour() -> None:
    """The lab's timer has 84 MHz / 84 / 1250."""
    clock = Clock()
    ticks = Periodic(clock, 0, Fraction(PS_PER_S, 800), lambda: None)
    assert ticks.time_ps(800 * 3600) == 3600 * PS_PER_S


def test_st_timer_period_does_not_drift() -> None:
    """ST's firmware has 84 MHz / 52 / 2000 = 807.692 Hz, a period of 1238095.238... ns."""
    clock = Clock()
    ticks = Periodic(clock, 0, Fraction(PS_PER_S * 52 * 2000, 84_000_000), lambda: None)
    assert ticks.time_ps(807_692_308) == 807_692_308 * 104_000 * PS_PER_S // 84_000_000


def test_seconds_are_converted_to_picoseconds() -> None:
    assert to_ps(0.00125) == 1_250_000_000
