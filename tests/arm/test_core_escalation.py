"""Faults of entry and return, escalation and lock-up (ARMv7-M ARM B1.5.8, B1.5.14, B1.5.15)."""

from __future__ import annotations

import pytest

from fcu_emulator.emulator.chip.cpu.exceptions import (
    BFARVALID,
    DEBUGEVT,
    FORCED,
    IACCVIOL,
    INVPC,
    PRECISERR,
    STKERR,
    UNDEFINSTR,
    UNSTKERR,
)
from fcu_emulator.emulator.chip.memory_map import RAM
from tests.support.arm.core_bench import STACK, CoreBench, interrupts, store
from tests.support.arm.core_faults import (
    ALL_ENABLED,
    HANDLERS,
    HARD_FAULT,
    MEM_MANAGE,
    NOWHERE,
    USAGE_FAULT,
)


def run(body: str, before: str = "") -> CoreBench:
    core = CoreBench(f"reset: {before} {body}\n log 0\n b .\n{HANDLERS}")
    core.run_us(300)
    return core


# -- returns --------------------------------------------------------------------------------------------


@pytest.mark.parametrize("value", [0xFFFF_FFF1, 0xFFFF_FFF5, 0xFFFF_FFF7, 0xFFFF_FF79, 0xFFFF_FFFB])
def test_wrong_exc_return_is_refused(value: int) -> None:
    """B1.5.8: UsageFault with INVPC, taken as if tail-chained; LR shows the origin."""
    core = CoreBench(
        f"""
reset: {ALL_ENABLED} svc #0
       b .
svc:   mov32 r0, {value}
       bx r0
usage_fault:
       mov r4, lr
       log r4
       b .
"""
    )
    core.run_us(100)

    assert core.system("CFSR") == INVPC
    assert core.values == [value]


def test_exc_return_in_thread_mode_is_ordinary_address() -> None:
    """B1.5.8: only Handler mode interprets the value. In Thread mode it is an address, which is Execute Never."""
    core = run("mov32 r1, 0xFFFFFFF9\n bx r1", ALL_ENABLED)

    assert core.values[0] == MEM_MANAGE
    assert core.system("CFSR") == IACCVIOL


def test_return_from_inactive_exception_is_refused() -> None:
    """B1.5.8: SHCSR.SVCALLACT cleared by software."""
    core = run(
        "svc #0\n b .\n"
        "svc: mov32 r0, SHCSR\n ldr r1, [r0]\n movs r2, #0x80\n bics r1, r2\n str r1, [r0]\n bx lr",
        ALL_ENABLED,
    )

    assert core.values[0] == USAGE_FAULT
    assert core.system("CFSR") == INVPC


def test_frame_for_wrong_mode_is_refused() -> None:
    """B1.5.8: returning to Thread mode with an IPSR that is not 0."""
    core = run("svc #0\n b .\nsvc: mov32 r0, 0x01000010\n str r0, [sp, #28]\n bx lr", ALL_ENABLED)

    assert core.values[0] == USAGE_FAULT
    assert core.system("CFSR") == INVPC


def test_unreadable_frame_is_unstacking_error() -> None:
    """B1.5.8, B3.2.15: UNSTKERR."""
    core = CoreBench(
        f"""
reset: {ALL_ENABLED} mov32 r0, {RAM + 0x1000}
       msr psp, r0
       movs r0, #2
       msr control, r0
       svc #0
       b .
svc:   mov32 r0, {NOWHERE}
       msr psp, r0
       bx lr
bus_fault: log 5
       b .
"""
    )
    core.run_us(100)

    assert core.values == [5]
    assert core.system("CFSR") == UNSTKERR


# -- stacks ---------------------------------------------------------------------------------------------


def test_overflow_of_main_stack_is_stacking_error() -> None:
    """B1.5.6, B3.2.15: STKERR; the handler runs although the frame could not be saved (PM0214 2.4.3)."""
    core = CoreBench(
        f"reset: mov32 r0, {RAM + 8}\n msr msp, r0\n svc #0\n b .\n"
        f"hard_fault: mov32 r0, STACK\n msr msp, r0\n log 3\n b .\n"
    )
    core.run_us(100)

    assert core.values == [3]
    assert core.system("CFSR") == STKERR
    assert core.system("HFSR") == FORCED


def test_process_stack_overflow_is_handled_on_main_stack() -> None:
    """B1.5.6: the fault is handled on the main stack."""
    core = CoreBench(
        f"""
reset: {ALL_ENABLED} mov32 r0, {RAM + 16}
       msr psp, r0
       movs r0, #2
       msr control, r0
       isb
       svc #0
       b .
bus_fault:
       mov r4, sp
       log r4
       mov r4, lr
       log r4
       b .
svc:   log 11
       b .
"""
    )
    core.run_us(100)

    assert core.values == [STACK, 0xFFFF_FFFD]
    assert core.system("CFSR") == STKERR


def test_pushing_below_ram_is_bus_fault() -> None:
    """This is the end of a runaway recursion; the frame of the fault cannot be saved either."""
    core = CoreBench(
        "reset: push {r4-r11, lr}\n b reset\nhard_fault: mov32 r0, STACK\n msr msp, r0\n log 3\n b .\n",
        stack=RAM + 0x100,
    )
    core.run_us(1_000)

    assert core.values == [3]
    assert core.system("CFSR") == PRECISERR | BFARVALID | STKERR
    assert core.system("HFSR") == FORCED


# -- escalation and lock-up -----------------------------------------------------------------------------


def test_fault_in_its_own_handler_is_escalated() -> None:
    """B1.5.14: a fault may not preempt its own handler."""
    core = CoreBench(f"reset: {ALL_ENABLED} udf #0\nusage_fault: log 6\n udf #1\nhard_fault: log 3\n b .\n")
    core.run_us(100)

    assert core.values == [6, 3]
    assert core.system("HFSR") == FORCED


def test_fault_of_lower_priority_is_escalated() -> None:
    """B1.5.14: a BusFault at 0x40 may not preempt an interrupt at 0x20."""
    core = CoreBench(
        f"""
reset: {ALL_ENABLED} {store("SHPR1", 0x4000)} {interrupts({0: 0x20})} {store("ISPR", 1)} b .
irq0:  mov32 r0, {NOWHERE}
       ldr r0, [r0]
bus_fault: log 5
       b .
hard_fault: log 3
       b .
"""
    )
    core.run_us(100)

    assert core.values == [3]


def test_fault_of_higher_priority_preempts_handler() -> None:
    core = CoreBench(
        f"""
reset: {ALL_ENABLED} {store("SHPR1", 0x1000)} {interrupts({0: 0x20})} {store("ISPR", 1)} b .
irq0:  mov32 r0, {NOWHERE}
       ldr r0, [r0]
bus_fault: mov r4, lr
       log r4
       b .
"""
    )
    core.run_us(100)

    assert core.values == [0xFFFF_FFF1]


def test_fault_with_primask_set_is_escalated() -> None:
    """B1.5.14: configurable faults have priority 0 or lower, and PRIMASK makes the present priority 0."""
    assert run("cpsid i\n udf #0", ALL_ENABLED).values[0] == HARD_FAULT


def test_blocked_svc_is_hard_fault() -> None:
    """B1.5.14: SVC with PRIMASK set, or in a handler of the same priority."""
    core = run("cpsid i\n svc #0")

    assert core.values[0] == HARD_FAULT
    assert core.system("HFSR") == FORCED
    assert core.system("CFSR") == 0


def test_breakpoint_without_debugger_is_hard_fault() -> None:
    """C1.6.1, B3.2.16: HFSR.DEBUGEVT, DFSR.BKPT."""
    core = run("fault: bkpt #0")

    assert core.values == [HARD_FAULT, core.labels["fault"]]
    assert core.system("HFSR") == DEBUGEVT


@pytest.mark.parametrize("fault", ["udf #0", "svc #0", "bkpt #0", f"mov32 r0, {NOWHERE}\n ldr r0, [r0]"])
def test_fault_in_hard_fault_handler_locks_up(fault: str) -> None:
    """B1.5.15: no instruction is executed and no interrupt is taken. The trace reports the lock-up once."""
    core = CoreBench(
        f"reset: {interrupts({0: 0x20})} udf #0\nhard_fault: log 3\n {fault}\n log 4\nirq0: log 10\n bx lr\n"
    )
    core.pulse_at_us(500, 0)
    core.run_us(1_000)
    retired = core.core.retired
    core.run_us(10_000)

    assert core.values == [3]
    assert core.core.retired == retired
    (text,) = core.faults()
    assert "lock-up" in text


def test_fault_with_faultmask_set_locks_up() -> None:
    """B1.5.15: a fault at priority -1."""
    core = run("cpsid f\n udf #0")

    assert core.values == []
    assert len(core.faults()) == 1


def test_reset_ends_lock_up() -> None:
    """B1.5.15: for example a reset by the watchdog."""
    core = CoreBench("reset: log 1\n cpsid f\n udf #0\n")
    core.at_us(500, lambda: core.core.request_reset("IWDG"))
    core.run_us(1_000)

    assert core.values == [1, 1]
    assert len(core.faults()) == 2


def test_hard_fault_handler_may_skip_instruction() -> None:
    """B1.5.8: the handler may change the return address in the frame."""
    core = CoreBench(
        "reset: udf #0\n log 1\n udf #1\n log 2\n b .\n"
        "hard_fault: ldr r0, [sp, #24]\n adds r0, #2\n str r0, [sp, #24]\n bx lr\n"
    )
    core.run_us(300)

    assert core.values == [1, 2]


def test_hard_fault_handler_without_repair_is_entered_again() -> None:
    """B1.5.6: the return address is the faulting instruction's address, so the core executes it again."""
    core = CoreBench("reset: log 1\n udf #0\n log 2\n b .\nhard_fault: log 3\n bx lr\n")
    core.run_us(200)

    assert core.values[:4] == [1, 3, 3, 3]
    assert 2 not in core.values


def test_cfsr_is_cleared_by_writing_ones() -> None:
    """B3.2.15. CFSR can also be cleared by byte, because UFSR and BFSR are parts of CFSR."""
    core = CoreBench(
        f"""
reset: {ALL_ENABLED} udf #0
       mov32 r0, {NOWHERE}
       ldr r0, [r0]
       b .
usage_fault: ldr r0, [sp, #24]
       adds r0, #2
       str r0, [sp, #24]
       bx lr
bus_fault: mov32 r0, CFSR
       ldr r4, [r0]
       log r4
       movs r1, #0xFF
       strb r1, [r0, #1]
       ldr r4, [r0]
       log r4
       ldr r4, [r0]
       str r4, [r0]
       ldr r4, [r0]
       log r4
       b .
"""
    )
    core.run_us(200)

    assert core.values == [PRECISERR | BFARVALID | UNDEFINSTR, UNDEFINSTR, 0]
