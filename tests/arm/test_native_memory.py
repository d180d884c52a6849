"""Loads and stores are the same as on Unicorn (ARMv7-M ARM A5.2.4, A5.2.5, A5.3.5 to A5.3.10).

This includes the data, the base register after the access, and accesses to addresses without a memory.
"""

from __future__ import annotations

import struct
from collections.abc import Callable
from random import Random

import pytest

from fcu_emulator.emulator.chip.cpu.bare_core import BareCore, Stop
from fcu_emulator.emulator.chip.cpu.core_registers import IT_BITS, CoreRegisters
from fcu_emulator.emulator.chip.memory_map import FLASH, FLASH_SIZE, RAM, RAM_SIZE, SYSTEM_MEMORY
from tests.support.arm.engine_pair import (
    CODE,
    GENERAL,
    THUMB,
    Access,
    EnginePair,
    Fields,
    Form,
    Values,
    any_values,
    register_name,
)
from tests.support.arm.thumb_assembler import assemble

WITH_SP = range(15)
"""All registers except PC."""
WORDS = range(0, 256, 4)
TABLE = CODE + 0x8000
"""Address of a table of code addresses, in flash."""


def index_apart(fields: Fields) -> bool:
    return fields["m"] != fields["n"]


def base_apart(fields: Fields) -> bool:
    """Return whether no transferred register is the base, which is written back."""
    return fields["n"] not in (fields["t"], fields.get("d"))


def two_listed(fields: Fields) -> bool:
    """Return whether two or more registers are listed, and no base that is written back. ``l`` has no bit for SP."""
    registers = fields["l"] & 0x1FFF | fields["l"] >> 13 << 14
    return registers.bit_count() > 1 and not (fields["w"] and registers >> fields["n"] & 1)


def two_apart(fields: Fields) -> bool:
    return fields["t"] != fields["d"] and base_apart(fields)


KINDS = {
    "STRB": "0 u 000",
    "STRH": "0 u 010",
    "STR": "0 u 100",
    "LDRB": "0 u 001",
    "LDRH": "0 u 011",
    "LDR": "0 u 101",
    "LDRSB": "1 u 001",
    "LDRSH": "1 u 011",
}
"""Bits 8 to 4 of the first half-word: sign extension, U, size, load."""
NARROW = [
    Form("register (16 bits)", "0101 ooo mmm nnn ttt", rule=index_apart),
    Form("LDR, STR (16 bits)", "0110 o iiiii nnn ttt"),
    Form("LDRB, STRB (16 bits)", "0111 o iiiii nnn ttt"),
    Form("LDRH, STRH (16 bits)", "1000 o iiiii nnn ttt"),
    Form("LDR, STR (SP, 16 bits)", "1001 o ttt iiiiiiii"),
]
OFFSETS = [
    Form(f"{name} (12 bits)", f"1111100 {kind} nnnn tttt iiiiiiiiiiii", {"n": WITH_SP, "u": (1,)})
    for name, kind in KINDS.items()
]
SMALL_OFFSETS = [
    form
    for name, kind in KINDS.items()
    for form in (
        Form(f"{name} (negative)", f"1111100 {kind} nnnn tttt 1100 iiiiiiii", {"n": WITH_SP, "u": (0,)}),
        Form(f"{name}T", f"1111100 {kind} nnnn tttt 1110 iiiiiiii", {"u": (0,)}),
        Form(f"{name} (pre-indexed)", f"1111100 {kind} nnnn tttt 11a1 iiiiiiii", {"u": (0,)}, base_apart),
        Form(f"{name} (post-indexed)", f"1111100 {kind} nnnn tttt 10a1 iiiiiiii", {"u": (0,)}, base_apart),
    )
]
INDEXED = [
    Form(f"{name} (register)", f"1111100 {kind} nnnn tttt 000000 ii mmmm", {"u": (0,)}, index_apart)
    for name, kind in KINDS.items()
] + [
    Form(
        "LDR, STR (SP, indexed)",
        "11111000010 o 1101 tttt 1 p u 1 iiiiiiii",
        {"i": WORDS},
        lambda f: f["p"] | f["u"] > 0,
    )
]
LITERALS = [Form("LDR (literal, 16 bits)", "01001 ttt iiiiiiii")] + [
    Form(f"{name} (literal)", f"1111100 {kind} 1111 tttt iiiiiiiiiiii")
    for name, kind in KINDS.items()
    if name.startswith("LDR")
]
SEVERAL = [
    Form("STM", "11000 nnn llllllll", {"l": range(1, 256)}, lambda f: not f["l"] >> f["n"] & 1),
    Form("LDM", "11001 nnn llllllll", {"l": range(1, 256)}),
    Form("PUSH", "1011010 llllllll l", {"l": range(1, 512)}),
    Form("POP", "10111100 llllllll", {"l": range(1, 256)}),
    Form("STMIA, LDMIA (32 bits)", "1110100010 w o nnnn 0l0 lllllllllllll", {"n": WITH_SP}, two_listed),
    Form("STMDB, LDMDB (32 bits)", "1110100100 w o nnnn 0l0 lllllllllllll", {"n": WITH_SP}, two_listed),
    Form("STRD, LDRD", "1110100 1 u 1 0 o nnnn tttt dddd iiiiiiii", {"n": WITH_SP}, two_apart),
    Form("STRD, LDRD (pre-indexed)", "1110100 1 u 1 1 o nnnn tttt dddd iiiiiiii", rule=two_apart),
    Form("STRD, LDRD (post-indexed)", "1110100 0 u 1 1 o nnnn tttt dddd iiiiiiii", rule=two_apart),
    Form("LDRD (literal)", "1110100 1 u 101 1111 tttt dddd iiiiiiii", rule=lambda f: f["t"] != f["d"]),
]


@pytest.fixture(scope="module")
def pair() -> EnginePair:
    return EnginePair()


def at(random: Random, fields: Fields, address: Callable[[], int]) -> Values:
    """Return registers that are all addresses, except a small index."""
    values = dict(any_values(random, fields))
    values |= {register: address() & 0xFFFF_FFFF for register in values if register != "xpsr"}
    return values | ({register_name(fields["m"]): random.getrandbits(8)} if "m" in fields else {})


def in_ram(random: Random, fields: Fields) -> Values:
    """Return addresses in RAM, some of them unaligned. Address plus any offset is also in RAM."""
    return at(
        random,
        fields,
        lambda: RAM + 0x1800 + 4 * random.randrange(0x3400) + random.choice((0, 0, random.randrange(4))),
    )


def words_in_ram(random: Random, fields: Fields) -> Values:
    """Return aligned addresses. An unaligned access to several registers faults (A3.2.1), but not on Unicorn."""
    return at(random, fields, lambda: RAM + 0x1800 + 4 * random.randrange(0x3400))


def elsewhere(random: Random, fields: Fields) -> Values:
    """Return addresses in flash and system memory, at the ends of RAM and flash, and without a memory."""
    places = (FLASH + 0x2000, 0x2000, SYSTEM_MEMORY + 0x2000, 0x6000_0000, 0xFFFF_F000)
    ends = (RAM + RAM_SIZE, FLASH + FLASH_SIZE, FLASH_SIZE)
    return at(
        random,
        fields,
        lambda: random.choice(
            (random.choice(places) + random.getrandbits(10), random.choice(ends) + random.randint(-300, 30))
        ),
    )


def at_the_ends(random: Random, fields: Fields) -> Values:
    """Return addresses at the ends of RAM and flash. An access that begins in system memory also ends there."""
    places = (
        *(RAM + distance for distance in (-8, -4, 0, 1, 2, 3)),
        *(
            end - distance
            for end in (RAM + RAM_SIZE, FLASH + FLASH_SIZE, FLASH_SIZE)
            for distance in range(6)
        ),
    )
    return at(random, fields, lambda: random.choice(places))


def in_flash(random: Random, fields: Fields) -> Values:
    """Return addresses for loads of several registers from a single memory."""
    return {**at(random, fields, lambda: FLASH + 0x2000 + 4 * random.getrandbits(10)), "msp": FLASH + 0x3000}


def from_table(random: Random, fields: Fields) -> Values:
    """Return registers whose base and SP are in the table of addresses."""
    table = at(random, fields, lambda: TABLE + 4 * random.randrange(64))
    return {**table, "msp": TABLE + 4 * random.randrange(64), "psp": 0}


def aligned(random: Random, fields: Fields) -> Values:
    """Return registers with R1 near the values of the other registers."""
    return {**at(random, fields, lambda: RAM + 0x1800 + 4 * random.randrange(4)), "r0": 0}


@pytest.mark.parametrize("form", NARROW + OFFSETS + SMALL_OFFSETS + INDEXED + LITERALS + SEVERAL, ids=str)
def test_accesses_in_ram_equal_unicorn(pair: EnginePair, form: Form) -> None:
    pair.check(form, words_in_ram if form in SEVERAL else in_ram, longest_block=1)


@pytest.mark.parametrize(
    "access", ["ldmia r1, {r2, r3}", "stmia r1, {r2, r3}", "ldrd r2, r3, [r1]", "strd r2, r3, [r1]"]
)
def test_unaligned_multiple_access_causes_fault(pair: EnginePair, access: str) -> None:
    """ARMv7-M ARM A3.2.1."""
    engine = engine_at(pair, access, {"r1": RAM + 0x102})

    assert (engine.run(1), engine.pc, engine.fault_address) == (Stop.UNALIGNED, CODE, RAM + 0x102)


@pytest.mark.parametrize("form", NARROW + SMALL_OFFSETS + INDEXED, ids=str)
def test_accesses_outside_ram_equal_unicorn(pair: EnginePair, form: Form) -> None:
    pair.check(form, elsewhere, longest_block=0, runs=6)


@pytest.mark.parametrize("form", SEVERAL, ids=str)
def test_multiple_accesses_in_flash_equal_unicorn(pair: EnginePair, form: Form) -> None:
    """Stores to flash are refused."""
    pair.check(form, in_flash, longest_block=0, runs=6)


@pytest.mark.parametrize(
    "form",
    [
        Form("LDR, STR (no offset)", "11111000110 o nnnn tttt 000000000000"),
        Form("LDRH, STRH (no offset)", "11111000101 o nnnn tttt 000000000000"),
        Form("LDRB, STRB (no offset)", "11111000100 o nnnn tttt 000000000000"),
    ],
    ids=str,
)
def test_accesses_at_memory_ends_equal_unicorn(pair: EnginePair, form: Form) -> None:
    pair.check(form, at_the_ends, longest_block=0)


@pytest.mark.parametrize(
    "form",
    [
        Form("LDR PC", "111110001101 nnnn 1111 0000 iiiiiiii", {"i": WORDS}),
        Form("LDR PC (register)", "111110000101 nnnn 1111 000000 ii mmmm", {"i": (2, 3)}, index_apart),
        Form("LDR PC (post-indexed)", "111110000101 nnnn 1111 10u1 iiiiiiii"),
        Form("POP PC", "10111101 llllllll"),
        Form("LDM PC", "1110100010 w 1 nnnn 100 lllllllllllll", {"l": range(1, 1 << 13)}, two_listed),
    ],
    ids=str,
)
def test_loads_of_pc_equal_unicorn(pair: EnginePair, form: Form) -> None:
    """BXWritePC (A2.3.1)."""
    pair.place(
        TABLE, [half for n in range(1024) for half in divmod(CODE + 0x4000 + 2 * n + 1, 1 << 16)[::-1]]
    )
    pair.check(form, from_table, longest_block=1)


@pytest.mark.parametrize(
    "form",
    [
        Form("TBB", "111010001101 nnnn 11110000 0000 mmmm", {"n": (*GENERAL, 15)}, index_apart),
        Form("TBH", "111010001101 nnnn 11110000 0001 mmmm", {"n": (*GENERAL, 15)}, index_apart),
    ],
    ids=str,
)
def test_table_branches_equal_unicorn(pair: EnginePair, form: Form) -> None:
    pair.check(form, words_in_ram if form in SEVERAL else in_ram, longest_block=1)


BETWEEN = {"": 0, "10111111 00000000": 1, "11110011 10111111 10001111 00101111": 1, "0101 0x0 000 zzz 010": 1}
"""Between load and store: no instruction, NOP, CLREX, STR or STRB to the same or another address."""


EXCLUSIVES = pytest.mark.parametrize(
    ("load", "store"),
    [
        ("111010000101 0001 0100 1111 0000000i", "111010000100 0001 ssss 0101 0000000j"),
        ("111010001101 0001 0100 1111 0101 1111", "111010001100 0001 ssss 1111 0101 0101"),
        ("111010001101 0001 0100 1111 0100 1111", "111010001100 0001 ssss 1111 0100 0101"),
    ],
    ids=["word", "half-word", "byte"],
)
"""LDREX R4, [R1]; STREX R5, Rs, [R1]."""


@EXCLUSIVES
@pytest.mark.parametrize("between", BETWEEN, ids=["at once", "NOP", "CLREX", "a store"])
def test_exclusive_accesses_equal_unicorn(pair: EnginePair, load: str, between: str, store: str) -> None:
    """The comparison includes whether the value is stored (A3.4.1). The store may have another address."""
    pattern = load + between + store
    form = Form(pattern, pattern, {"s": (2, 3, 4)}, instructions=2 + BETWEEN[between])
    pair.check(form, aligned, longest_block=0)


@EXCLUSIVES
def test_second_exclusive_store_fails_as_on_unicorn(pair: EnginePair, load: str, store: str) -> None:
    """The first store has cleared the monitor."""
    pattern = load + store + store.replace("s", "x").replace("j", "k")
    form = Form(pattern, pattern, {"s": (2, 3, 4), "x": (2, 3, 4)}, instructions=3)
    pair.check(form, aligned, longest_block=0)


@pytest.mark.parametrize(
    "form",
    [
        Form("LDREX", "111010000101 nnnn tttt 1111 0000000i"),
        Form("LDREXH", "111010001101 nnnn tttt 1111 0101 1111"),
        Form("LDREXB", "111010001101 nnnn tttt 1111 0100 1111"),
    ],
    ids=str,
)
def test_exclusive_loads_at_any_address_equal_unicorn(pair: EnginePair, form: Form) -> None:
    """Unaligned exclusive loads are faults (A3.2.1)."""
    pair.check(form, in_ram, longest_block=0)


def engine_at(pair: EnginePair, source: str, values: Values) -> BareCore:
    """Return a core in front of a program, with these registers."""
    code, _ = assemble(source, CODE)
    pair.place(CODE, struct.unpack(f"<{len(code) // 2}H", code))
    Access(pair.native).write(values)
    pair.native.pc = CODE
    return pair.native


def test_faulting_store_in_it_block_can_be_repeated(pair: EnginePair) -> None:
    """The frame of the fault has the address and the ITSTATE of the store (B1.5.6, B1.5.8); Unicorn is after it."""
    engine = engine_at(pair, "itt eq\n streq r0, [r1]\n addseq r0, #1", {"xpsr": THUMB | 1 << 30})

    assert (engine.run(3), engine.pc, engine.executed) == (Stop.WRITE, CODE + 2, 2)
    assert CoreRegisters(engine, ("xpsr",)).read()[0] & IT_BITS == 0x400


def test_faulting_load_multiple_keeps_base(pair: EnginePair) -> None:
    """The instruction is executed again after the handler (B1.5.10). Unicorn has loaded the first registers."""
    base = RAM + RAM_SIZE - 8
    engine = engine_at(pair, "ldmia r1, {r0-r3}", {"r1": base})

    assert (engine.run(1), engine.pc, engine.fault_address) == (Stop.READ, CODE, RAM + RAM_SIZE)
    assert [engine.register(number) for number in range(4)] == [0, base, 0, 0]


@pytest.mark.parametrize("access", ["ldr", "ldrh", "ldrb", "str", "strh", "strb"])
@pytest.mark.parametrize("address", [RAM + RAM_SIZE, 0x6000_0000, 0xFFFF_FFFC])
def test_fault_has_address_of_access(pair: EnginePair, access: str, address: int) -> None:
    engine = engine_at(pair, f"{access} r0, [r1]", {"r1": address})

    assert engine.run(1) is (Stop.READ if access[0] == "l" else Stop.WRITE)
    assert engine.fault_address == address


NARROW_CODE = 0x2501, 0x4770
"""MOVS R5, #1; BX LR."""
WIDE_CODE = 0xF240, 0x0501, 0x4770
"""MOVW R5, #1; BX LR."""
SECOND = 0x4770_2502
"""MOVS R5, #2; BX LR."""


@pytest.mark.parametrize(
    ("code", "words", "store", "address", "value"),
    [
        (RAM, NARROW_CODE, "str r2, [r1]", RAM, SECOND),
        (RAM, NARROW_CODE, "strb r2, [r1]", RAM, 2),
        (RAM, WIDE_CODE, "strb r2, [r1]", RAM + 2, 2),
        (RAM + 0x7FE, WIDE_CODE, "strb r2, [r1]", RAM + 0x800, 2),
        (RAM + 0x7FE, WIDE_CODE, "str r2, [r1]", RAM + 0x800, 0x4770_0502),
        (RAM + 0x800, NARROW_CODE, "str r2, [r1]", RAM + 0x7FE, 0x2502 << 16),
        (RAM + 0x800, NARROW_CODE, "str r2, [r1]", RAM + 0x7FD, 2 << 24),
        (RAM + 0x800, NARROW_CODE, "strh r2, [r1]", RAM + 0x7FF, 2 << 8),
        (RAM + 0x800, NARROW_CODE, "strd r3, r2, [r1]", RAM + 0x7FC, SECOND),
        (RAM + RAM_SIZE - 8, NARROW_CODE, "push {r2, r4}", 0, SECOND),
    ],
)
def test_code_changed_in_ram_is_executed(
    code: int, words: tuple[int, ...], store: str, address: int, value: int
) -> None:
    """The stores begin at the first word of RAM, cross from one kilobyte into the next, and reach the end of RAM.

    They also change the second half of an instruction.
    """
    pair = EnginePair()
    program, labels = assemble(
        f"mov32 r0, {code + 1}\n blx r0\n mov r6, r5\n {store}\n blx r0\nend: b end", CODE
    )
    values = {"r1": address, "r2": value, "r4": 0x4770_4770, "msp": RAM + RAM_SIZE}
    pair.place(CODE, struct.unpack(f"<{len(program) // 2}H", program))
    pair.place(code, words)
    for engine in (pair.native, pair.unicorn):
        Access(engine).write(values)
        engine.pc = CODE
        while engine.pc != labels["end"]:
            assert engine.run(20) is Stop.SLICE

        assert (engine.register(6), engine.register(5)) == (1, 2)
