"""Floating-point context in exceptions (ARMv7-M ARM B1.4.4, B1.5.7)."""

from __future__ import annotations

from tests.support.arm.core_bench import STACK, CoreBench, interrupts, store

T, PADDED = 1 << 24, 1 << 9
FPU_ON = store("CPACR", 0x00F0_0000)


def frame(core: CoreBench, at: int, words: int = 8) -> list[int]:
    return [core.word(at + 4 * n) for n in range(words)]


FILL = "\n".join(f"movs r0, #{n}\n vmov s{n}, r0" for n in range(32))


def test_floating_point_frame_follows_basic_frame() -> None:
    """B1.5.7, figure B1-4: 26 words. S0 to S15, FPSCR and a reserved word follow the basic frame."""
    core = CoreBench(
        f"""
reset: {FPU_ON} {FILL}
       mov32 r0, 0x03000000
       vmsr fpscr, r0
       svc #0
       b .
svc:   mov r4, sp
       mov r5, lr
       mrs r6, control
       b .
"""
    )
    core.run_us(200)

    at = STACK - 0x68
    assert core.register(4) == at
    assert frame(core, at + 0x20, 17) == [*range(16), 0x0300_0000]
    assert core.register(5) == 0xFFFF_FFE9
    assert core.register(6) == 0  # FPCA is cleared for the handler (B1.4.4)
    assert core.system("FPCAR") == at + 0x20


def test_frame_without_floating_point_has_eight_words() -> None:
    """B1.4.4, B1.5.7: CONTROL.FPCA selects the frame, not whether the unit is enabled."""
    core = CoreBench(f"reset: {FPU_ON} svc #0\n b .\nsvc: mov r4, sp\n mov r5, lr\n b .\n")
    core.run_us(100)

    assert core.register(4) == STACK - 0x20
    assert core.register(5) == 0xFFFF_FFF9


def test_first_floating_point_instruction_sets_fpca() -> None:
    """B1.4.4: FPCA is set only if FPCCR.ASPEN is 1, its value after reset."""
    core = CoreBench(
        f"reset: {FPU_ON} mrs r4, control\n log r4\n vmov s0, r0\n mrs r4, control\n log r4\n b .\n"
    )
    core.run_us(100)

    assert [control & 4 for control in core.values] == [0, 4]


def test_floating_point_registers_survive_handler() -> None:
    """B1.5.7: hardware saves S0 to S15 and FPSCR. A new context begins with FPSCR 0 (FPDSCR)."""
    core = CoreBench(
        f"""
reset: {interrupts({0: 0x20})} {FPU_ON} {FILL}
       mov32 r0, 0xF0000000
       vmsr fpscr, r0
       {store("ISPR", 1)} {store("ISPR", 1)} vmov r0, s3  ; floating point goes on in the same context
       vmrs r4, fpscr
       log r4
       b .
irq0:  vmrs r0, fpscr
       log r0
       mov32 r0, 0x40000000
       vmov s0, r0
       vadd.f32 s7, s0, s0
       vmov s15, r0
       vmsr fpscr, r0
       bx lr
"""
    )
    core.run_us(300)

    assert core.values == [0, 0, 0xF000_0000]
    assert core.floating_point() == [*range(32), 0xF000_0000]


def test_handler_using_floating_point_is_itself_interrupted() -> None:
    """Table B1-8: 0xFFFFFFE1 means a handler with a floating-point frame. Each level has its own S0."""
    core = CoreBench(
        f"""
reset: {interrupts({0: 0x40, 1: 0x20})} {FPU_ON} movs r0, #1
       vmov s0, r0
       {store("ISPR", 1)} vmov r4, s0
       log r4
       b .
irq0:  push {{r4, lr}}
       movs r0, #2
       vmov s0, r0
       {store("ISPR", 2)} vmov r4, s0
       log r4
       pop {{r4, pc}}
irq1:  mov r2, lr
       log r2
       movs r0, #3
       vmov s0, r0
       bx lr
"""
    )
    core.run_us(300)

    assert core.values == [0xFFFF_FFE1, 2, 1]


def test_floating_point_frame_is_aligned_without_stkalign() -> None:
    """B1.5.7: "the FP extension requires 8-byte alignment"; PushStack()."""
    core = CoreBench(
        f"""
reset: {store("CCR", 0)} {FPU_ON} vmov s0, r0
       sub sp, sp, #4
       svc #0
       mov r4, sp
       log r4
       b .
svc:   mov r4, sp
       log r4
       bx lr
"""
    )
    core.run_us(100)

    assert core.values == [STACK - 0x70, STACK - 4]
