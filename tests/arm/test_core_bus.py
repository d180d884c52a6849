"""Accesses: sizes, alignment, bit-band aliases, flash aliases, system control space (ARMv7-M ARM A3, B3)."""

from __future__ import annotations

import pytest

from fcu_emulator.emulator.chip.memory_map import FLASH, RAM
from fcu_emulator.emulator.trace import DeviceNote
from tests.support.arm.core_bench import PROBE, STACK, CoreBench, store


def run(body: str) -> CoreBench:
    core = CoreBench(f"reset: {body}\n b .\n")
    core.run_us(500)
    return core


# -- sizes ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("instruction", "offset", "value", "mask"),
    [
        ("str", 0, 0x1234_5678, 0xFFFF_FFFF),
        ("strh", 0, 0x5678, 0xFFFF),
        ("strh", 2, 0x5678_0000, 0xFFFF_0000),
        ("strb", 0, 0x78, 0xFF),
        ("strb", 1, 0x7800, 0xFF00),
        ("strb", 2, 0x78_0000, 0xFF_0000),
        ("strb", 3, 0x7800_0000, 0xFF00_0000),
    ],
)
def test_store_changes_only_addressed_bytes_of_register(
    instruction: str, offset: int, value: int, mask: int
) -> None:
    """RM0368 2.3: peripherals on AHB and APB accept byte, half-word and word accesses."""
    core = run(f"mov32 r0, LOG+{offset}\n mov32 r1, 0x12345678\n {instruction} r1, [r0]")

    ((register, written, bits),) = core.probe.writes
    assert (register, written & bits, bits) == (0, value, mask)


TIM2_ARR, DMA1_S0M0AR = 0x4000_002C, 0x4002_601C
"""Registers of 32 bits in peripherals that are modelled in C."""


@pytest.mark.parametrize("register", [TIM2_ARR, DMA1_S0M0AR])
@pytest.mark.parametrize(
    ("size", "offset"), [("", 0), ("h", 0), ("h", 2), ("b", 0), ("b", 1), ("b", 2), ("b", 3)]
)
def test_accesses_of_all_sizes_reach_addressed_bytes(register: int, size: str, offset: int) -> None:
    """RM0368 2.3; the other bytes keep their values."""
    core = run(
        f"mov32 r0, {register}\n mov32 r1, 0xAABBCCDD\n str r1, [r0]\n mov32 r1, 0x12345678\n"
        f"mov32 r2, {register + offset}\n str{size} r1, [r2]\n ldr{size} r4, [r2]\n\n"
        "ldr r5, [r0]\n log r4\n log r5"
    )
    bits = {"": 32, "h": 16, "b": 8}[size]
    part = 0x1234_5678 & (1 << bits) - 1
    kept = 0xAABB_CCDD & ~((1 << bits) - 1 << 8 * offset)

    assert core.values == [part, kept | part << 8 * offset]


@pytest.mark.parametrize(
    ("instruction", "offset", "value"),
    [
        ("ldr", 0, 0x8765_4321),
        ("ldrh", 0, 0x4321),
        ("ldrh", 2, 0x8765),
        ("ldrb", 0, 0x21),
        ("ldrb", 1, 0x43),
        ("ldrb", 3, 0x87),
    ],
)
def test_load_reads_addressed_bytes_of_register(instruction: str, offset: int, value: int) -> None:
    core = CoreBench(f"reset: mov32 r0, EFFECT+{offset}\n {instruction} r1, [r0]\n log r1\n b .\n")
    core.probe.registers[8] = 0x8765_4320  # one is added by reading
    core.run_us(100)

    assert core.values == [value]


def test_load_multiple_reads_registers_once_in_order() -> None:
    """A3.5.3: Device memory is accessed in program order, as often as the program says."""
    core = run(
        "mov32 r0, LOG\n ldmia r0!, {r4-r6}\n log r6\n mov32 r0, LOG\n movs r5, #5\n stmia r0!, {r5, r6}"
    )

    assert core.values == [1, 5]
    assert [register for register, _, _ in core.probe.writes] == [0, 0, 4]


@pytest.mark.parametrize("offset", range(4))
def test_loads_and_stores_of_memory_may_be_unaligned(offset: int) -> None:
    """A3.2.1: LDR, STR, LDRH, STRH."""
    core = run(
        f"""mov32 r0, RAM+{256 + offset}
       mov32 r1, 0x11223344
       str r1, [r0]
       ldr r2, [r0]
       log r2
       strh r1, [r0, #5]
       ldrh r2, [r0, #5]
       log r2"""
    )

    assert core.values == [0x1122_3344, 0x3344]
    at = 256 + offset
    assert bytes(core.core.ram[at : at + 7]) == bytes.fromhex("44332211004433")


# -- bit-band -------------------------------------------------------------------------------------------


@pytest.mark.parametrize("byte", [0, 1, 0x123, 0xFFFF])
@pytest.mark.parametrize("bit", [0, 3, 7])
def test_bit_band_alias_reaches_bit_of_ram(byte: int, bit: int) -> None:
    """PM0214 2.2.5: 0x22000000 + 32 x byte + 4 x bit. Only bit 0 of the written value has an effect."""
    alias = 0x2200_0000 + 32 * byte + 4 * bit
    core = CoreBench(
        f"reset: mov32 r0, {alias}\n ldr r2, [r0]\n log r2\n"
        "movw r1, #0xFFF1\n str r1, [r0]\n ldr r2, [r0]\n log r2\n"
        "movw r1, #0xFFF0\n str r1, [r0]\n ldrb r2, [r0]\n log r2\n b .\n",
        stack=STACK - 64,
    )
    others = 0xA5 & ~(1 << bit)
    core.core.ram[byte] = others
    core.run_us(9.5)
    assert core.core.ram[byte] == others | 1 << bit
    core.run_us(100)

    assert core.values == [0, 1, 0]
    assert core.core.ram[byte] == others


@pytest.mark.parametrize("bit", [0, 9, 31])
def test_bit_band_alias_reaches_bit_of_registers(bit: int) -> None:
    """PM0214 2.2.5: 0x42000000 + 32 x byte + 4 x bit: a read-modify-write of the word."""
    alias = 0x4200_0000 + 32 * (PROBE - 0x4000_0000 + 8) + 4 * bit
    core = CoreBench(f"reset: mov32 r0, {alias}\n ldr r2, [r0]\n log r2\n movs r1, #1\n str r1, [r0]\n b .\n")
    core.probe.registers[8] = (1 << bit) - 1
    core.run_us(100)

    register, value, mask = core.probe.writes[-1]
    assert core.values == [1]
    assert (register, mask) == (8, 0xFFFF_FFFF)
    assert value == ((1 << bit) + 1) | 1 << bit  # two reads, each with its effect


def test_interrupt_set_by_store_precedes_next_instruction() -> None:
    """An interrupt that a store raises is taken directly after the store."""
    icsr_set = "mov32 r0, ICSR\n mov32 r1, 0x10000000\n"
    core = CoreBench(f"reset: {icsr_set} str r1, [r0]\n log 1\n b .\npend_sv: log 2\n bx lr\n")
    core.run_us(100)

    assert core.values == [2, 1]


# -- memory ---------------------------------------------------------------------------------------------


def test_flash_appears_at_address_0() -> None:
    """RM0368 2.4: BOOT0 low: main flash memory is aliased to address 0; ST's firmware reads there."""
    core = run("movs r0, #0\n ldr r1, [r0]\n log r1\n ldr r1, [r0, #4]\n log r1")

    assert core.values == [STACK, core.labels["reset"] + 1]


def test_vector_table_can_be_moved_to_ram() -> None:
    """B3.2.5: VTOR, as boot loaders and RTOSes use it."""
    core = CoreBench(
        f"""
reset: {store(f"RAM+{4 * 11 + 0x200}", 0)} mov32 r1, other+1
       mov32 r0, RAM+{0x200 + 4 * 11}
       str r1, [r0]
       {store("VTOR", RAM + 0x200)} svc #0
       {store("VTOR", FLASH)} svc #0
       b .
svc:   log 1
       bx lr
other: log 2
       bx lr
"""
    )
    core.run_us(300)

    assert core.values == [2, 1]


def test_code_runs_from_ram_and_may_be_changed() -> None:
    """B2.1: the SRAM region is executable. DSB and ISB follow the change of the code."""
    core = run(
        f"""mov32 r4, {RAM + 0x100}
       mov32 r1, 0x47703001     ; ADDS R0, #1; BX LR
       str r1, [r4]
       dsb
       isb
       movs r0, #0
       adds r5, r4, r0
       adds r5, #1
       blx r5
       mov32 r1, 0x47703003     ; ADDS R0, #3; BX LR
       str r1, [r4]
       dsb
       isb
       blx r5
       log r0"""
    )

    assert core.values == [4]


def test_address_without_register_is_noted_once() -> None:
    core = run("mov32 r0, LOG+0x100\n ldr r1, [r0]\n str r1, [r0]\n ldr r1, [r0]\n log r1")

    assert core.values == [0]
    notes = [(note.device, note.what) for note in core.trace.of(DeviceNote)]
    assert notes == [("probe", "not modelled")]
