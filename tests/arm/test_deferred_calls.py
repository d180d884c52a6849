"""Deferred calls of the clock do not stop a run, and do not depend on the times of other stops."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from fcu_emulator.emulator.clock import NEVER_PS, Clock

times = st.integers(0, 100)


def test_deferred_call_runs_at_its_own_time() -> None:
    clock, seen = Clock(), list[int]()
    clock.defer(10, lambda: seen.append(clock.now_ps))
    assert (clock.next_ps, clock.deferred_ps) == (NEVER_PS, 10)
    clock.now_ps = 50  # as the core does when it has run instructions until then
    clock.settle()
    assert (seen, clock.now_ps, clock.deferred_ps) == ([10], 50, NEVER_PS)


def test_deferred_call_is_kept_until_due() -> None:
    clock, seen = Clock(), list[int]()
    clock.defer(10, lambda: seen.append(1))
    clock.advance_to(9)
    clock.settle()
    assert seen == []
    clock.advance_to(10)
    assert seen == [1]


def test_cancelled_deferred_call_does_not_run() -> None:
    clock, seen = Clock(), list[int]()
    clock.defer(10, lambda: seen.append(1)).cancel()
    clock.advance_to(20)
    assert (seen, clock.now_ps) == ([], 20)


def test_event_scheduled_by_deferred_call_fires_on_time() -> None:
    clock, seen = Clock(), list[int]()
    clock.defer(10, lambda: clock.schedule(20, lambda: seen.append(clock.now_ps)) and None)
    clock.now_ps = 50
    clock.settle()
    assert (seen, clock.now_ps) == ([20], 50)


@given(st.lists(st.tuples(times, st.booleans()), max_size=20), st.lists(times, max_size=10))
def test_intermediate_stops_change_neither_order_nor_times(
    plan: list[tuple[int, bool]], looks: list[int]
) -> None:
    def run(looks: list[int]) -> list[tuple[int, int]]:
        clock, seen = Clock(), list[tuple[int, int]]()
        for number, (at_ps, deferred) in enumerate(plan):
            put = clock.defer if deferred else clock.schedule
            put(at_ps, lambda number=number: seen.append((number, clock.now_ps)))
        for look_ps in sorted(looks):
            clock.advance_to(look_ps)
        clock.advance_to(100)
        return seen

    assert run(looks) == run([])
    assert sorted(at_ps for _, at_ps in run([])) == sorted(at_ps for at_ps, _ in plan)
