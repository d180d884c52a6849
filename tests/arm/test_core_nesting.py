"""Random interrupts with random nesting, compared with the rules of ARMv7-M ARM B1.5.4, B1.5.11 and B1.5.12.

The oracle implements these rules a second time. It does not execute code: it only knows the number of instructions of
each handler, and counts them.
"""

from __future__ import annotations

from dataclasses import dataclass, field

from hypothesis import given, settings
from hypothesis import strategies as st

from tests.support.arm.core_bench import (
    CHAIN_CYCLES,
    ENTRY_CYCLES,
    RETURN_CYCLES,
    CoreBench,
    interrupts,
    store,
)

INPUTS = 5
FIRST_US, END_US = 300, 3_000

Entry = tuple[int, int]  # time in us, what is logged


def program(priorities: list[int], passes: list[int], prigroup: int, basepri: int) -> str:
    """Return handlers that log 10 n, loop ``passes[n]`` times and log 10 n + 1: 10 + 2 x passes instructions."""
    handlers = "".join(
        f"irq{n}: log {10 * n}\n movw r0, #{count}\n"
        f"wait{n}: subs r0, #1\n bne wait{n}\n log {10 * n + 1}\n bx lr\n"
        for n, count in enumerate(passes)
    )
    start = interrupts(dict(enumerate(priorities))) + store("AIRCR", 0x05FA_0000 | prigroup << 8)
    return f"reset: {start} movs r0, #{basepri}\n msr basepri, r0\n b .\n{handlers}"


@dataclass
class Oracle:
    """Oracle that does one instruction or one step of an exception at a time."""

    priorities: list[int]
    passes: list[int]
    prigroup: int
    basepri: int
    pulses: list[tuple[int, int]]
    now: int = FIRST_US
    pending: set[int] = field(default_factory=set)
    active: list[list[int]] = field(
        default_factory=list
    )  # [input, instructions executed], the present one last
    log: list[Entry] = field(default_factory=list)

    def group(self, priority: int) -> int:
        return priority >> self.prigroup + 1

    def level(self) -> int:
        """Return the level of the running code, for which only group priorities count."""
        levels = [self.group(self.priorities[number]) for number, _ in self.active]
        return min(levels + ([self.group(self.basepri)] if self.basepri else []), default=1 << 8)

    def pass_time(self, cycles: int) -> None:
        """Let time pass, and make interrupts pending whose pulses arrive in this time."""
        self.now += cycles
        due = [pulse for pulse in self.pulses if pulse[0] <= self.now]
        self.pending |= {number for _, number in due}
        self.pulses = [pulse for pulse in self.pulses if pulse not in due]

    def preempted(self) -> bool:
        return any(self.group(self.priorities[number]) < self.level() for number in self.pending)

    def enter(self, cycles: int) -> None:
        """Enter an exception. The choice is made at the end of the entry: a more urgent exception may arrive late."""
        self.pass_time(cycles)
        number = min(self.pending, key=lambda number: (self.priorities[number], number))
        self.pending.discard(number)
        self.active.append([number, 0])

    def execute(self) -> None:
        number, done = self.active[-1]
        last = 9 + 2 * self.passes[number]
        if done in (3, last - 1):
            self.log.append((self.now, 10 * number + (done != 3)))
        self.active[-1][1] += 1
        if done < last:
            self.pass_time(1)
        else:  # the return is part of its instruction: what comes at the end of that is not seen yet
            self.now += 1
            self.active.pop()
            if self.preempted():
                self.enter(CHAIN_CYCLES)
            else:
                self.pass_time(RETURN_CYCLES)

    def run(self) -> list[Entry]:
        self.pass_time(0)
        while self.now < END_US:
            if self.preempted():
                self.enter(ENTRY_CYCLES)
            elif self.active:
                self.execute()
            else:
                self.pass_time(1)
        return [entry for entry in self.log if entry[0] < END_US]


@given(
    priorities=st.lists(st.sampled_from(range(0, 256, 16)), min_size=INPUTS, max_size=INPUTS),
    passes=st.lists(st.integers(1, 120), min_size=INPUTS, max_size=INPUTS),
    prigroup=st.integers(3, 7),
    basepri=st.sampled_from((0, 0, 0, 0x40, 0xA0)),
    pulses=st.lists(st.tuples(st.integers(FIRST_US, 1_500), st.integers(0, INPUTS - 1)), max_size=20),
)
@settings(max_examples=80, deadline=None)
def test_order_of_nested_interrupts_equals_oracle(
    priorities: list[int], passes: list[int], prigroup: int, basepri: int, pulses: list[tuple[int, int]]
) -> None:
    """Every handler begins and ends in the same order and at the same times."""
    core = CoreBench(program(priorities, passes, prigroup, basepri))
    for time_us, number in pulses:
        core.pulse_at_us(time_us, number)
    core.run_us(END_US - 0.5)

    expected = Oracle(priorities, passes, prigroup, basepri, pulses).run()
    assert core.log_us == expected
