"""Faults: their exceptions, status bits and addresses (ARMv7-M ARM B1.5.14, B1.5.15, B3.2.15 to B3.2.18)."""

from __future__ import annotations

import pytest

from fcu_emulator.emulator.chip.cpu.exceptions import (
    BFARVALID,
    DIVBYZERO,
    FORCED,
    IACCVIOL,
    IBUSERR,
    INVSTATE,
    NOCP,
    PRECISERR,
    UNALIGNED,
    UNDEFINSTR,
    VECTTBL,
)
from fcu_emulator.emulator.chip.memory_map import RAM
from tests.support.arm.core_bench import CODE, STACK, CoreBench, store
from tests.support.arm.core_faults import (
    ALL_ENABLED,
    BUS_FAULT,
    HANDLERS,
    HARD_FAULT,
    MEM_MANAGE,
    NOWHERE,
    USAGE_FAULT,
)

TRAPS = {
    "undefined": ("udf #0", USAGE_FAULT, UNDEFINSTR),
    "undefined, 32 bits": (".word 0xA000F7F0", USAGE_FAULT, UNDEFINSTR),  # UDF.W
    "division by zero": (store("CCR", 0x210) + "movs r1, #0\nfault: udiv r0, r0, r1", USAGE_FAULT, DIVBYZERO),
    "signed division": (store("CCR", 0x210) + "movs r1, #0\nfault: sdiv r0, r0, r1", USAGE_FAULT, DIVBYZERO),
    "no coprocessor": ("vmov s0, r0", USAGE_FAULT, NOCP),
    "coprocessor 0": (".word 0x0010EE10", USAGE_FAULT, NOCP),  # MRC p0, 0, R0, C0, C0, 0
    "load": (f"mov32 r1, {NOWHERE}\nfault: ldr r0, [r1]", BUS_FAULT, PRECISERR | BFARVALID),
    "store": (f"mov32 r1, {NOWHERE}\nfault: str r0, [r1]", BUS_FAULT, PRECISERR | BFARVALID),
    "unaligned word": (
        store("CCR", 0x208) + "mov32 r1, RAM+1\nfault: ldr r0, [r1]",
        USAGE_FAULT,
        UNALIGNED,
    ),
    "unaligned half-word": (
        store("CCR", 0x208) + "mov32 r1, RAM+1\nfault: strh r0, [r1]",
        USAGE_FAULT,
        UNALIGNED,
    ),
}


def run(body: str, before: str = "") -> CoreBench:
    core = CoreBench(f"reset: {before} movs r0, #1\n {body}\n log 0\n b .\n{HANDLERS}")
    core.run_us(300)
    return core


@pytest.mark.parametrize("name", TRAPS)
def test_fault_enters_its_handler_and_sets_status(name: str) -> None:
    """B1.5.14, table B1-7. The return address is the faulting instruction's address (B1.5.6)."""
    body, exception, status = TRAPS[name]
    core = run(body if "fault:" in body else f"fault: {body}", ALL_ENABLED)

    assert core.values == [exception, core.labels["fault"]]
    assert core.system("CFSR") == status
    assert core.system("HFSR") == 0


@pytest.mark.parametrize("name", TRAPS)
def test_fault_with_disabled_handler_becomes_hard_fault(name: str) -> None:
    """B1.5.14, "priority escalation": HFSR.FORCED is set, and CFSR still shows the original fault."""
    body, _, status = TRAPS[name]
    core = run(body if "fault:" in body else f"fault: {body}")

    assert core.values == [HARD_FAULT, core.labels["fault"]]
    assert core.system("CFSR") == status
    assert core.system("HFSR") == FORCED


@pytest.mark.parametrize(
    ("instruction", "address"), [("ldr r0, [r1]", NOWHERE + 4), ("strb r0, [r1]", NOWHERE + 5)]
)
def test_bfar_has_address_of_access(instruction: str, address: int) -> None:
    """B3.2.18."""
    core = run(f"mov32 r1, {address}\n {instruction}")

    assert core.system("BFAR") == address


@pytest.mark.parametrize("name", ["division by zero", "unaligned word"])
def test_untrapped_division_and_unaligned_access_succeed(name: str) -> None:
    """B3.2.8. A quotient by zero is 0 (A7.7.223), and unaligned LDR and STR are allowed (A3.2.1)."""
    body = TRAPS[name][0]
    core = run(body.replace(str(0x208), str(0x200)).replace(str(0x210), str(0x200)))

    assert core.values == [0]
    assert core.register(0) == 0


@pytest.mark.parametrize(("divisor", "condition"), [(0, "ne"), (1, "eq")])
def test_skipped_instruction_in_it_block_does_not_trap(divisor: int, condition: str) -> None:
    """A7.3: the compiler generates this code for "if (d) x / d"."""
    core = run(
        f"{store('CCR', 0x210)} movs r1, #{divisor}\n cmp r1, #0\n itt {condition}\n"
        f"udiv{condition} r0, r0, r1\n vmov{condition} s0, r0"
    )

    assert core.values == [0]


def test_division_by_zero_inside_it_block_traps() -> None:
    """The fault is at the instruction (B1.5.14), not after the block."""
    core = run(f"{store('CCR', 0x210)} movs r1, #0\n cmp r1, #0\n itt eq\nfault: udiveq r0, r0, r1\n nopeq\n")

    assert core.values == [HARD_FAULT, core.labels["fault"]]
    assert core.system("CFSR") == DIVBYZERO


ALIGNED_ONLY = {
    "ldrd r2, r3, [r1]": True,
    "strd r2, r3, [r1]": True,
    "ldmia r1, {r2, r3}": True,
    "stmia r1!, {r2-r6}": True,
    "ldrex r2, [r1]": True,
    "vldr s0, [r1]": True,
    "vstr s0, [r1]": True,
    "ldr r2, [r1]": False,
    "str r2, [r1]": False,
    "ldrh r2, [r1]": False,
    "strh r2, [r1]": False,
}


@pytest.mark.parametrize("instruction", ALIGNED_ONLY)
@pytest.mark.parametrize("offset", range(4))
def test_some_accesses_must_always_be_aligned(instruction: str, offset: int) -> None:
    """A3.2.1: LDM, LDRD and similar instructions fault even without UNALIGN_TRP."""
    before = ALL_ENABLED + store("CPACR", 0x00F0_0000)
    core = run(f"mov32 r1, {RAM + 64 + offset}\nfault: {instruction}", before)

    faults = ALIGNED_ONLY[instruction] and offset != 0
    assert core.values == ([USAGE_FAULT, core.labels["fault"]] if faults else [0])
    assert core.system("CFSR") == (UNALIGNED if faults else 0)


def test_unaligned_ldrex_faults_in_any_case() -> None:
    """A3.2.1. The core itself refuses the access."""
    core = run(f"mov32 r1, {RAM + 65}\nfault: ldrex r2, [r1]", ALL_ENABLED)

    assert core.values == [USAGE_FAULT, core.labels["fault"]]


@pytest.mark.parametrize(
    "block",
    [
        "it ne\n ldrne r3, [r5]",
        "it ne\n strne r3, [r6]",
        "it ne\n ldrne r3, [r8]",
        "itte ne\n ldrne r3, [r5]\n strne r3, [r6]\n moveq r6, r3",
        "ite eq\n moveq r3, r6\n strne r0, [r6]",
    ],
)
def test_access_hooks_do_not_disturb_it_blocks(block: str) -> None:
    """B1.4.2: after the block ITSTATE is 0, and instructions are no longer conditional."""
    core = run(
        f"""mov32 r5, RAM+128
       mov32 r6, RAM+64
       mov32 r8, EFFECT
       movs r1, #0
       movs r2, #3
       cmp r1, #1
       {block}
       cmp r2, #3
       bls back
       log 99
back:  adds r1, #1
       log r1""",
    )

    assert core.values == [1, 0]


@pytest.mark.parametrize("ccr", [0x200, 0x208])
def test_double_registers_need_only_word_alignment(ccr: int) -> None:
    """A6.5, A6.6: VLDM and VSTM of D registers need word alignment."""
    before = store("CPACR", 0x00F0_0000) + store("CCR", ccr)
    core = run(
        "sub sp, sp, #4\n .word 0x8B02ED2D ; VPUSH {D8}\n .word 0x8B02ECBD ; VPOP {D8}",
        before,
    )

    assert core.values == [0]


def test_push_and_pop_are_always_aligned() -> None:
    """B5.1.1: bits 0 and 1 of SP are always 0."""
    assert run("push {r0-r4, lr}\n pop {r0-r4, lr}\n push {r4}\n pop {r4}").values == [0]


# -- where code is fetched ------------------------------------------------------------------------------


@pytest.mark.parametrize("address", [0x4000_0000, 0x5000_0000, 0xA000_0000, 0xE000_E000, 0x4200_0000])
def test_code_in_device_memory_is_never_executed(address: int) -> None:
    """B3.1, table B3-1: Execute Never. The fault is MemManage with IACCVIOL, even without an MPU (B3.2.15)."""
    core = run(f"mov32 r1, {address + 1}\n bx r1", ALL_ENABLED)

    assert core.values == [MEM_MANAGE, address]
    assert core.system("CFSR") == IACCVIOL


@pytest.mark.parametrize("address", [0x6000_0000, 0x0804_0000, 0x2001_0000, 0x1000_0000])
def test_code_at_unmapped_address_is_bus_fault(address: int) -> None:
    """B3.2.15: IBUSERR; BFAR is not written."""
    core = run(f"mov32 r1, {address + 1}\n bx r1", ALL_ENABLED)

    assert core.values == [BUS_FAULT, address]
    assert core.system("CFSR") == IBUSERR


def test_execution_past_ram_end_is_bus_fault() -> None:
    code = f"mov32 r1, {STACK - 4}\n mov32 r2, 0xBF00BF00\n str r2, [r1]\n adds r1, #1\n bx r1"
    core = run("sub sp, sp, #64\n" + code, ALL_ENABLED)

    assert core.values == [BUS_FAULT, STACK]
    assert core.system("CFSR") == IBUSERR


def test_even_address_leaves_thumb_state() -> None:
    """A2.3.1, B1.5.14: the instruction at the address faults with INVSTATE, and the saved xPSR has T = 0."""
    core = run(f"mov32 r1, {CODE}\n blx r1", ALL_ENABLED)

    assert core.values == [USAGE_FAULT, CODE]
    assert core.system("CFSR") == INVSTATE
    assert core.word(STACK - 4) >> 24 & 1 == 0


@pytest.mark.parametrize("step", range(1, 14))
def test_branch_to_even_address_faults_in_split_run(step: int) -> None:
    core = CoreBench(f"reset: mov32 r1, {CODE}\n blx r1\n b .\n{HANDLERS}")
    for until in range(step, 60, step):
        core.run_us(until)
    core.run_us(60)

    assert core.values == [HARD_FAULT, CODE]
    assert core.system("CFSR") == INVSTATE


def test_even_vector_leaves_thumb_state() -> None:
    """B1.5.6: ExceptionTaken() copies T from bit 0 of the vector."""
    core = CoreBench(f"reset: svc #0\n b .\n {HANDLERS}", vectors={"svc": CODE})
    core.run_us(100)

    assert core.values == [HARD_FAULT, CODE]
    assert core.system("CFSR") == INVSTATE


def test_even_reset_vector_faults_at_once() -> None:
    """B1.5.5, TakeReset()."""
    core = CoreBench(f"start: b .\n {HANDLERS}", vectors={"reset": CODE})
    core.run_us(100)

    assert core.values == [HARD_FAULT, CODE]


def test_erased_vector_faults_at_target_address() -> None:
    """Erased flash has only ones: a vector of 0xFFFFFFFF leads to 0xFFFFFFFE, which is Execute Never."""
    core = CoreBench(f"reset: svc #0\n b .\n {HANDLERS}", vectors={"svc": 0xFFFF_FFFF})
    core.run_us(100)

    assert core.values == [HARD_FAULT, 0xFFFF_FFFE]
    assert core.system("CFSR") == IACCVIOL


def test_unmapped_vector_table_locks_up() -> None:
    """B1.5.14: HFSR.VECTTBL. The vector of the HardFault cannot be read either, which causes a lock-up."""
    core = CoreBench(f"reset: {store('VTOR', 0x3000_0000)} svc #0\n b .\n")
    core.run_us(100)

    assert core.system("HFSR") & VECTTBL
    assert len(core.faults()) == 1
