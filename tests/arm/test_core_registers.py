"""Registers of the system control space and their values after a reset (ARMv7-M ARM B3.2, B3.4)."""

from __future__ import annotations

import pytest

from fcu_emulator.emulator.trace import DeviceNote
from tests.support.arm.chip_fakes import NativeChip
from tests.support.arm.core_bench import STACK, SYMBOLS, CoreBench, interrupts, store
from tests.support.words import Words


def run(body: str) -> CoreBench:
    core = CoreBench(f"reset: {body}\n b .\n")
    core.run_us(500)
    return core


def read(address: int, before: str = "") -> int:
    core = CoreBench(f"reset: {before} mov32 r0, {address}\n ldr r4, [r0]\n log r4\n b .\n")
    core.run_us(200)
    return core.values[-1]


@pytest.mark.parametrize(
    ("address", "value"),
    [
        (0xE000_ED00, 0x410F_C241),  # CPUID: Cortex-M4 r0p1 (PM0214 4.4.2)
        (0xE000_ED08, 0),  # VTOR
        (0xE000_ED0C, 0xFA05_0000),  # AIRCR
        (0xE000_ED14, 0x200),  # CCR: STKALIGN
        (0xE000_E004, 2),  # ICTR: 96 lines in steps of 32
        (0xE000_EF34, 0xC000_0000),  # FPCCR: ASPEN, LSPEN
    ],
)
def test_registers_have_reset_values_of_manual(address: int, value: int) -> None:
    """PM0214 tables 49 to 57."""
    assert read(address) == value


@pytest.mark.parametrize("word", range(3))
def test_each_interrupt_input_has_enable_bit(word: int) -> None:
    """B3.4.3; RM0368 table 38: 85 inputs."""
    implemented = (1 << 85) - 1 >> 32 * word & 0xFFFF_FFFF
    enable = "cpsid i\n" + store(f"ISER+{4 * word}", 0xFFFF_FFFF)

    assert read(SYMBOLS["ISER"] + 4 * word, enable) == implemented
    assert read(SYMBOLS["ICER"] + 4 * word, enable) == implemented
    assert read(SYMBOLS["ISER"] + 4 * word, enable + store(f"ICER+{4 * word}", 0x10)) == implemented & ~0x10
    pend = "cpsid i\n" + store(f"ISPR+{4 * word}", 0xFFFF_FFFF)
    assert read(SYMBOLS["ISPR"] + 4 * word, pend) == implemented
    assert read(SYMBOLS["ICPR"] + 4 * word, pend + store(f"ICPR+{4 * word}", 0x10)) == implemented & ~0x10


def test_each_priority_is_one_byte() -> None:
    """B3.4.9: four priorities in a word; the low four bits of each are not implemented."""
    written = store("IPR+68", 0x1234_5678)

    assert read(SYMBOLS["IPR"] + 68, written) == 0x1030_5070
    assert read(SYMBOLS["IPR"] + 69, written) & 0xFF == 0x50
    assert read(SYMBOLS["IPR"] + 84, store("IPR+84", 0xFFFF_FFFF)) == 0xF0  # input 84 is the last


def test_icsr_and_iabr_show_active_and_pending_exceptions() -> None:
    """B3.2.4, B3.4.7."""
    core = CoreBench(
        f"""
reset: {interrupts({70: 0x40, 3: 0x60})} {store("ISPR+8", 64)} b .
irq70: {store("ISPR", 8)} mov32 r0, ICSR
       ldr r4, [r0]
       log r4
       mov32 r0, IABR+8
       ldr r4, [r0]
       log r4
       bx lr
irq3:  mov32 r0, ICSR
       ldr r4, [r0]
       log r4
       bx lr
"""
    )
    core.run_us(200)

    isrpending, rettobase = 1 << 22, 1 << 11
    assert core.values == [isrpending | (16 + 3) << 12 | rettobase | 16 + 70, 64, rettobase | 16 + 3]


def test_rettobase_tells_whether_another_exception_is_active() -> None:
    """B3.2.4: 1 in the outer handler, 0 in the handler that preempts it, and 1 again after its return."""
    core = CoreBench(
        f"""
reset: {interrupts({70: 0x40, 3: 0x20})} {store("ISPR+8", 64)} b .
irq70: mov32 r0, ICSR
       ldr r4, [r0]
       {store("ISPR", 8)}
       mov32 r0, ICSR
       ldr r5, [r0]
       log r4
       log r5
       bx lr
irq3:  mov32 r0, ICSR
       ldr r6, [r0]
       log r6
       bx lr
"""
    )
    core.run_us(200)

    rettobase = 1 << 11
    assert core.values == [16 + 3, rettobase | 16 + 70, rettobase | 16 + 70]


def test_rettobase_ignores_active_bit_of_running_handler() -> None:
    """B3.2.4: an SVC handler that clears its own active bit still has an active interrupt below it."""
    core = CoreBench(
        f"""
reset: {interrupts({70: 0x40})} {store("ISPR+8", 64)} b .
irq70: svc #0
       b .
svc:   {store("SHCSR", 0)} mov32 r0, ICSR
       ldr r4, [r0]
       log r4
       b .
"""
    )
    core.run_us(200)

    assert core.values == [11]


def test_priorities_of_system_exceptions_are_in_shpr() -> None:
    """B3.2.10 to B3.2.12: by byte, as the HAL writes them."""
    core = run(
        "mov32 r0, SHPR3\n movs r1, #0xFF\n strb r1, [r0, #3]\n movs r1, #0x35\n strb r1, [r0, #2]\n"
        "ldr r4, [r0]\n log r4"
    )

    assert core.values == [0xF030_0000]


def test_sysresetreq_resets_and_keeps_ram() -> None:
    """B3.2.6: AIRCR.SYSRESETREQ, as NVIC_SystemReset sets it. SRAM keeps its contents (RM0368 6.1.1)."""
    core = CoreBench(
        f"""
reset: {store("IPR", 0x40)} mov32 r0, RAM
       ldr r4, [r0]
       log r4
       adds r4, #1
       str r4, [r0]
       cmp r4, #3
       bcs stay
       movs r5, #7
       msr basepri, r5
       msr control, r5
       {store("AIRCR", 0x05FA_0004)} log 99
stay:  b .
"""
    )
    core.run_us(1_000)

    assert core.values == [0, 1, 2]
    assert [reason for _, reason in core.core.resets] == ["SYSRESETREQ"] * 2


def test_reset_restores_power_on_state() -> None:
    """B1.5.5; B3.2.2."""
    body = (
        store("CPACR", 0x00F0_0000)
        + interrupts({0: 0x40, 84: 0x10})
        + store("SHCSR", 0x7_0000)
        + store("SYST_RVR", 100)
        + store("SYST_CSR", 7)
        + store("DEMCR", 1 << 24)
        + "cpsid i\n vmov s1, r0\n movs r0, #2\n msr control, r0\n"
        + store("AIRCR", 0x05FA_0304)
    )
    core = CoreBench(
        f"reset: mov32 r1, RAM\n ldr r0, [r1]\n cmp r0, #0\n bne done\n str r1, [r1]\n {body} b .\n"
        "done: b .\n"
    )
    core.run_us(1_000)
    fresh = CoreBench("reset: b .\n")
    fresh.run_us(1_000)

    names = (
        "ICSR",
        "SHCSR",
        "CPACR",
        "SHPR3",
        "AIRCR",
        "CCR",
        "ISER",
        "IPR",
        "SYST_CSR",
        "SYST_RVR",
        "DEMCR",
    )
    assert len(core.core.resets) == 1
    assert [core.system(name) for name in names] == [fresh.system(name) for name in names]
    assert core.register(13) == STACK
    assert core.floating_point() == [0] * 33


@pytest.mark.parametrize(
    ("address", "size"),
    [
        (0x0000_0000, 4),
        (0x0803_FFFE, 4),
        (0x1FFF_7A10, 4),
        (0x2000_FFFF, 2),
        (0x4000_0000, 4),
        (0xFFFF_FFFF, 1),
    ],
)
def test_program_outside_flash_and_ram_is_refused(address: int, size: int) -> None:
    """RM0368 2.3: 256 KB at 0x08000000, 64 KB at 0x20000000. System memory has ST's code."""
    with pytest.raises(ValueError, match=f"{size} bytes at 0x{address:08X} are neither in flash nor in RAM"):
        CoreBench("reset: b .\n", more=[(address, bytes(size))])


def test_program_may_include_contents_of_ram() -> None:
    core = CoreBench(
        "reset: mov32 r0, RAM\n ldr r4, [r0]\n log r4\n b .\n", more=[(0x2000_0000, b"\x2a\0\0\0")]
    )
    core.run_us(20)

    assert core.values == [42]


@pytest.mark.parametrize("bit", [0, 1, 3, 7, 8, 10, 11, 12, 13, 14, 15, 16, 17, 18])
def test_write_to_shcsr_affects_only_its_exceptions(bit: int) -> None:
    """B3.2.13: active, pending and enable bits can be written. Interrupts and PendSV stay pending."""
    shcsr, icsr, ispr0, pend_sv = 0xD24, 0xD04, 0x200, 1 << 28
    space = NativeChip()["SCS"]
    space.write(ispr0, 0xFFFF)
    space.write(icsr, pend_sv)
    for value in (1 << bit, 0, 0x7_FD8B, 1 << bit):
        space.write(shcsr, value)
        assert space.read(shcsr) == value
        assert space.read(ispr0) == 0xFFFF
        assert space.read(icsr) & pend_sv


# -- accesses that are noted --------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("address", "on_read", "on_write"),
    [
        (0xE000_ED08, "", ""),  # VTOR
        (0xE000_ED8C, "0xE000ED8C", "0xE000ED8C"),  # before the MPU
        (0xE000_ED90, "", "MPU"),  # MPU_TYPE: firmware asks it how many regions there are
        (0xE000_ED94, "", "MPU"),
        (0xE000_EDB8, "", "MPU"),  # MPU_RASR_A3, its last register
        (0xE000_EDBC, "0xE000EDBC", "0xE000EDBC"),
    ],
)
def test_unmodelled_register_access_is_noted(address: int, on_read: str, on_write: str, words: Words) -> None:
    for body, expected in (
        (f"mov32 r0, {address}\n ldr r1, [r0]", on_read),
        (f"mov32 r0, {address}\n movs r1, #0\n str r1, [r0]", on_write),
    ):
        notes = [(note.device, note.what, note.text) for note in run(body).trace.of(DeviceNote)]
        assert len(notes) == bool(expected)
        for device, what, text in notes:
            assert (device, what) == ("SCS", "not modelled")
            assert expected in text
            words("chip", text)
