"""Skipping of waiting loops has no effect: log, times, memory and number of instructions stay the same."""

from __future__ import annotations

import pytest

from fcu_emulator.emulator.clock import PS_PER_MS
from tests.support.arm.core_bench import CoreBench, interrupts, store
from tests.support.arm.core_programs import state

TICKING = store("SYST_RVR", 9_999) + store("SYST_CVR", 0) + store("SYST_CSR", 7)
TICK = """
sys_tick: mov32 r0, RAM
       ldr r1, [r0]
       adds r1, #1
       str r1, [r0]
       bx lr
"""

LOOPS = {
    "a flag in RAM": f"""
reset: {interrupts({0: 0})} mov32 r5, RAM
wait:  ldr r1, [r5]
       cmp r1, #0
       beq wait
       log 1
       b .
irq0:  movs r1, #1
       mov32 r0, RAM
       str r1, [r0]
       bx lr
""",
    "nothing for ever": f"reset: {interrupts({0: 0})} b .\nirq0: log 1\n bx lr\n",
    "nothing for ever, after a priority has been set": f"""
reset: {store("SHPR3", 0xF0F0_0000)} log 1
       b .
""",
    "WFI in a loop": f"reset: {interrupts({0: 0})}\nidle: wfi\n b idle\nirq0: log 1\n bx lr\n",
    "a register that an access will find changed": """
reset: mov32 r0, FLAG
wait:  ldr r1, [r0]
       cmp r1, #0
       beq wait
       log 1
       b .
""",
    "HAL_Delay of 20 ticks, as compiled without optimisation": f"""
reset: {TICKING} movs r0, #20
       bl delay
       log 1
       movs r0, #5
       bl delay
       log 2
       b .
delay: push {{r7, lr}}
       sub sp, sp, #16
       mov r7, sp
       str r0, [r7, #4]
       bl get_tick
       str r0, [r7, #8]
       ldr r3, [r7, #4]
       str r3, [r7, #12]
       nop
again: bl get_tick
       mov r2, r0
       ldr r3, [r7, #8]
       subs r2, r2, r3
       ldr r3, [r7, #12]
       cmp r3, r2
       bhi again
       nop
       add sp, sp, #16
       pop {{r7, pc}}
get_tick: push {{r7}}
       mov r7, sp
       mov32 r3, RAM
       ldr r3, [r3]
       mov r0, r3
       mov sp, r7
       pop {{r7}}
       bx lr
{TICK}
""",
    "a delay inside of a handler": f"""
reset: {interrupts({0: 0x40})} {store("SHPR3", 0)} {TICKING} {store("ISPR", 1)} log 2
       b .
irq0:  mov32 r2, RAM
wait:  ldr r3, [r2]
       cmp r3, #9
       bne wait
       log 1
       bx lr
{TICK}
""",
    "a poll that writes its loop count to the stack": f"""
reset: {interrupts({0: 0})} sub sp, sp, #8
       mov32 r5, RAM
wait:  ldr r1, [r5]
       str r1, [sp, #4]
       ldr r1, [sp, #4]
       cmp r1, #0
       beq wait
       log 1
       b .
irq0:  movs r1, #1
       mov32 r0, RAM
       str r1, [r0]
       bx lr
""",
}
NEVER_SKIPPED = {
    "a poll with a timeout that is counted down": """
reset: mov32 r0, FLAG
       mov32 r2, 20000
wait:  ldr r1, [r0]
       subs r2, #1
       beq out
       cmp r1, #0
       beq wait
out:   log r2
       b .
""",
    "a poll with a side effect": """
reset: mov32 r0, EFFECT
       movw r4, #5000
wait:  ldr r1, [r0]
       cmp r1, r4
       bne wait
       log r1
       mov32 r0, FLAG
far:   ldr r1, [r0]
       cmp r1, #0
       beq far
       log 2
       b .
""",
    "a loop that counts": """
reset: movs r4, #0
again: adds r4, #1
       lsls r5, r4, #18
       bne again
       log r4
       b again
""",
}
END_US = 300_000
FLAG_PS = 170_000_123_456


PULSES_US = (70_000.125, 150_001, 150_050.5)


def prepared(program: str, skip: bool = True) -> CoreBench:
    core = CoreBench(program, skip=skip)
    core.probe.flag_ps = FLAG_PS
    for at_us in PULSES_US:
        core.pulse_at_us(at_us, 0)
    for at_us in range(0, END_US, 5_000):
        core.at_us(at_us, lambda: None)  # something goes on on every board; a loop is looked for at an event
    return core


def run(program: str, skip: bool) -> CoreBench:
    core = prepared(program, skip)
    core.run_us(END_US)
    return core


@pytest.mark.parametrize("name", LOOPS)
def test_skipping_of_waiting_loop_changes_nothing(name: str) -> None:
    quick, slow = run(LOOPS[name], True), run(LOOPS[name], False)

    assert slow.core.skipped == 0
    assert quick.values
    assert state(quick) == state(slow)
    if "WFI" not in name:
        assert quick.core.skipped > 0.5 * quick.core.retired


@pytest.mark.parametrize("name", NEVER_SKIPPED)
def test_loop_with_side_effect_is_executed(name: str) -> None:
    quick, slow = run(NEVER_SKIPPED[name], True), run(NEVER_SKIPPED[name], False)

    assert quick.values
    assert state(quick) == state(slow)


def test_delay_takes_same_time_in_split_run() -> None:
    """A run that stops every 7 ms must find its loop again each time."""
    whole = run(LOOPS["HAL_Delay of 20 ticks, as compiled without optimisation"], True)
    divided = prepared(LOOPS["HAL_Delay of 20 ticks, as compiled without optimisation"])
    for until_ms in range(0, 300, 7):
        divided.core.run_until_ps(until_ms * PS_PER_MS + 1)
    divided.run_us(END_US)

    assert state(divided) == state(whole)
    assert [round(at / 1000) for at, _ in whole.log_us] == [200, 250]
