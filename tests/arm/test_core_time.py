"""Virtual time is exactly instructions x cycles / HCLK, also if a run is divided, counted or skipped."""

from __future__ import annotations

import itertools
from collections.abc import Iterable
from fractions import Fraction

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fcu_emulator.emulator.chip.cpu.core import CYCLES_PER_INSTRUCTION
from fcu_emulator.emulator.clock import PS_PER_S
from tests.support.arm.core_bench import CoreBench, interrupts, store
from tests.support.arm.core_programs import interrupted_core, state
from tests.support.words import Words

END_US = 100_000

pulses = st.lists(st.tuples(st.integers(50, 8 * END_US).map(lambda n: n / 8), st.integers(0, 2)), max_size=8)
flags_us = st.integers(100, 2 * END_US).map(lambda n: n / 2)


cycles_each = st.sampled_from((Fraction(1), CYCLES_PER_INSTRUCTION, Fraction(2, 3)))


# -- instructions and cycles ----------------------------------------------------------------------------


@given(
    hclk_hz=st.sampled_from((16_000_000, 84_000_000, 42_000_000, 1_000_003)),
    cycles=st.fractions(Fraction(1, 2), 5, max_denominator=16),
    before=st.integers(0, 40),
)
@settings(max_examples=40)
def test_nth_instruction_begins_after_n_cycle_times(hclk_hz: int, cycles: Fraction, before: int) -> None:
    """The time is rounded down once, to a picosecond."""
    core = CoreBench("reset: " + "nop\n" * before + "log 1\n log 2\n b .", hclk_hz=hclk_hz, cycles=cycles)
    core.run_us(300)

    places = (before + 3, before + 7)
    assert [at_ps for at_ps, _ in core.probe.log] == [int(n * cycles * PS_PER_S / hclk_hz) for n in places]


def test_one_second_has_64_615_385_instructions() -> None:
    """The default is 1.3 cycles per instruction, so 64,615,384.6 instructions a second at 84 MHz."""
    core = CoreBench("reset: b reset\n", hclk_hz=84_000_000, cycles=CYCLES_PER_INSTRUCTION)
    core.core.run_until_ps(PS_PER_S)

    assert core.core.retired == -(-84_000_000 * 10 // 13)


@pytest.mark.parametrize("hclk_hz", [84_000_000, 84_012_243])
def test_time_stays_exact_when_counts_exceed_64_bits(hclk_hz: int) -> None:
    """The rate of a clock with a deviation has large terms: count x cycles x PS_PER_S / HCLK soon exceeds 64 bits."""
    turns = 20_000_000
    source = f"reset: mov32 r0, {turns}\nagain: subs r0, #1\nbne again\nlog 1\n b .\n"
    core = CoreBench(source, hclk_hz=hclk_hz, cycles=CYCLES_PER_INSTRUCTION)
    core.run_us(700_000)

    place = 2 + 2 * turns + 3
    assert [at_ps for at_ps, _ in core.probe.log] == [
        int(place * CYCLES_PER_INSTRUCTION * PS_PER_S / hclk_hz)
    ]


def test_new_hclk_applies_from_store_that_sets_it() -> None:
    """RM0368 6.3.3: for example when RCC_CFGR.SW selects the PLL."""
    core = CoreBench(f"reset: log 1\n {store('RATE', 4_000)} log 2\n {store('RATE', 500)} log 3\n b .\n")
    core.run_us(100)

    # the store is the first instruction at the new rate: 8 at 1 MHz, 9 at 4 MHz, then 2 us each
    first = 8 + 9 * 0.25
    assert core.log_us == [(3, 1), (8 + 4 * 0.25, 2), (first + 4 * 2, 3)]


def test_hclk_change_in_event_takes_effect_at_once() -> None:
    """For example when the crystal fails and the clock security system selects HSI (RM0368 6.2.7)."""
    core = CoreBench(f"reset: {interrupts({0: 0})} wfi\n log 1\n b .\nirq0: bx lr\n")
    core.at_us(100, lambda: core.clocks.set(hclk_hz=2_000_000))
    core.pulse_at_us(101, 0)
    core.run_us(300)

    assert core.log_us == [(101 + (12 + 1 + 10 + 3) * 0.5, 1)]


def test_impossible_cycles_per_instruction_are_refused(words: Words) -> None:
    for cycles in (Fraction(0), Fraction(-1), Fraction(101)):
        with pytest.raises(ValueError, match=str(cycles)) as caught:
            CoreBench("reset: b .", cycles=cycles)
        words("chip", str(caught.value))


def test_sleep_lasts_until_event() -> None:
    core = CoreBench(f"reset: {interrupts({0: 0})} wfi\n log 1\n b .\nirq0: bx lr\n", hclk_hz=84_000_000)
    core.pulse_at_us(1_000_000.000_001, 0)
    core.core.run_until_ps(2 * PS_PER_S)

    cycles = 12 + 1 + 10 + 3
    assert core.probe.log == [(PS_PER_S + 1 + cycles * PS_PER_S // 84_000_000, 1)]


# -- instructions whose condition fails -----------------------------------------------------------------

CONDITIONAL = {
    "arithmetic": "adds{} r2, #1",
    "constant": "movw{} r2, #256",
    "comparison": "cmp{} r1, #1",
    "division": "udiv{} r2, r2, r1",
    "load": "ldr{} r2, [r4]",
    "store": "str{} r2, [r4]",
    "several": "ldmia{} r4, {{r2, r3}}",
    "floating point": "vmov{} s0, r1",
    "status": "mrs{} r2, ipsr",
}
"""An example of each way to make an instruction conditional. None of them clears Z."""


def cycles_of(instructions: str, ends_us: Iterable[int]) -> int:
    """Return the cycles that DWT counts. R0 is 0, R1 is 1, R4 points to RAM, Z is set. The run pauses at each time."""
    core = CoreBench(
        f"""
reset: {store("DEMCR", 1 << 24)} {store("DWT_CTRL", 1)} {store("CPACR", 0xF << 20)}
       mov32 r4, RAM
       mov32 r7, CYCCNT
       movs r1, #1
       movs r0, #0
       ldr r5, [r7]
       {instructions}
       ldr r6, [r7]
       b .
"""
    )
    for end_us in ends_us:
        core.run_us(end_us)
    return core.register(6) - core.register(5) - 1  # but for the first load


@pytest.mark.parametrize("ends_us", [(90,), range(1, 90)], ids=["at once", "one by one"])
@pytest.mark.parametrize("kind", CONDITIONAL)
@pytest.mark.parametrize("length", [1, 2, 4])
def test_instruction_with_false_condition_takes_one_cycle(
    kind: str, length: int, ends_us: Iterable[int]
) -> None:
    """Cortex-M4 technical reference manual (ARM DDI 0439), 3.3.1."""
    counted = set()
    for conditions in list(itertools.product(("eq", "ne"), repeat=length))[:: max(1, length - 1)]:
        switches = "".join("t" if condition == conditions[0] else "e" for condition in conditions[1:])
        block = [CONDITIONAL[kind].format(condition) for condition in conditions]
        counted.add(cycles_of("\n".join([f"it{switches} {conditions[0]}", *block]), ends_us))

    assert counted == {1 + length}


@pytest.mark.parametrize("ends_us", [(90,), range(1, 90)], ids=["at once", "one by one"])
@pytest.mark.parametrize("condition", ["eq", "ne"])
def test_branch_ending_it_block_takes_one_cycle(condition: str, ends_us: Iterable[int]) -> None:
    block = f"itt {condition}\n adds{condition} r2, #1\n b{condition} next\n next:"

    assert cycles_of(block, ends_us) == 3


@pytest.mark.parametrize("fails", [0, 1])
def test_conditional_loop_takes_constant_time(fails: int) -> None:
    """The loop takes as long as a loop without conditional instructions: 20 times six, and the start."""
    core = CoreBench(
        f"""
reset: movs r0, #20
       movs r1, #{fails}
       movs r3, #0
loop:  cmp r1, #0
       itt eq
       addseq r2, #1
       cmpeq r3, #0
       subs r0, #1
       bne loop
       log 1
       b .
"""
    )
    core.run_us(200)

    assert core.time_us(1) == 3 + 20 * 6 + 3


# -- laws -----------------------------------------------------------------------------------------------


@given(
    pulses=pulses,
    flag_us=flags_us,
    cuts=st.lists(st.integers(1, 16 * END_US), max_size=30),
    cycles=cycles_each,
)
@settings(max_examples=60, deadline=None)
def test_splitting_run_changes_nothing(
    pulses: list[tuple[float, int]], flag_us: float, cuts: list[int], cycles: Fraction
) -> None:
    whole, divided = (interrupted_core(pulses, flag_us, cycles=cycles) for _ in range(2))
    whole.run_us(END_US)
    for cut in sorted(cuts):
        divided.run_us(min(cut / 16, END_US))
    divided.run_us(END_US)

    assert state(divided) == state(whole)
    assert divided.clock.now_ps == whole.clock.now_ps == END_US * 10**6


@given(pulses=pulses, flag_us=flags_us, cycles=cycles_each)
@settings(max_examples=60, deadline=None)
def test_skipping_of_waiting_loops_changes_nothing(
    pulses: list[tuple[float, int]], flag_us: float, cycles: Fraction
) -> None:
    quick = interrupted_core(pulses, flag_us, cycles=cycles)
    slow = interrupted_core(pulses, flag_us, cycles=cycles, skip=False)
    quick.run_us(END_US)
    slow.run_us(END_US)

    assert state(quick) == state(slow)
