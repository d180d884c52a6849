"""Data processing is the same as on Unicorn (ARMv7-M ARM A5.2.1 to A5.2.3, A5.2.5, A5.3.1 to A5.3.3, A5.3.11)."""

from __future__ import annotations

from random import Random

import pytest

from tests.support.arm.engine_pair import (
    CODE,
    GENERAL,
    EnginePair,
    Fields,
    Form,
    Values,
    any_values,
    flags,
    register_name,
)

ANY = range(15)
"""All registers except PC."""
CONSTANTS = [imm12 for imm12 in range(1 << 12) if imm12 < 256 or imm12 >= 1024 or imm12 & 0xFF]
"""ThumbExpandImm (A5.3.2): 00XY00XY and similar forms are UNPREDICTABLE for 00."""
OPCODES = {
    "AND": "0000",
    "BIC": "0001",
    "ORR": "0010",
    "ORN": "0011",
    "EOR": "0100",
    "ADD": "1000",
    "ADC": "1010",
    "SBC": "1011",
    "SUB": "1101",
    "RSB": "1110",
}
TESTS = {"TST": "0000", "TEQ": "0100", "CMN": "1000", "CMP": "1101"}
"""These instructions have PC as the destination, which they do not write."""


def _extracted(fields: Fields) -> bool:
    return fields["l"] + fields["w"] < 32


def _inserted(fields: Fields) -> bool:
    return fields["l"] <= fields["w"]


SIXTEEN_BITS = [
    Form("LSL, LSR, ASR (immediate)", "000tt iiiii mmm ddd", {"t": (0, 1, 2)}),
    Form("ADD, SUB (register, 3 bits)", "00011oo mmm nnn ddd"),
    Form("MOV, CMP, ADD, SUB (8 bits)", "001oo ddd iiiiiiii"),
    Form("two registers", "010000 oooo mmm ddd"),
    Form("ADD (any registers)", "01000100 d mmmm ddd", {"d": GENERAL, "m": ANY}),
    Form("ADD (with PC)", "01000100 d 1111 ddd", {"d": GENERAL}),
    Form("CMP (any registers)", "01000101 n mmmm nnn", {"m": ANY}, lambda f: f["n"] > 7 or f["m"] > 7),
    Form("MOV (any registers)", "01000110 d mmmm ddd", {"d": GENERAL, "m": range(16)}),
    Form("ADR, ADD (SP plus immediate)", "1010 s ddd iiiiiiii"),
    Form("ADD, SUB (SP, immediate)", "10110000 o iiiiiii"),
    Form("SXTH, SXTB, UXTH, UXTB", "10110010 oo mmm ddd"),
    Form("REV, REV16, REVSH", "10111010 oo mmm ddd", {"o": (0, 1, 3)}),
]
MODIFIED_CONSTANTS = [
    Form(f"{name} (modified constant)", f"11110 i 0 {opcode} s nnnn 0 iii dddd iiiiiiii", {"i": CONSTANTS})
    for name, opcode in OPCODES.items()
] + [
    Form("MOV, MVN (modified constant)", "11110 i 0001 o s 1111 0 iii dddd iiiiiiii", {"i": CONSTANTS}),
    *(
        Form(
            f"{name} (modified constant)", f"11110 i 0 {opcode} 1 nnnn 0 iii 1111 iiiiiiii", {"i": CONSTANTS}
        )
        for name, opcode in TESTS.items()
    ),
    Form("ADD, SUB (SP, modified constant)", "11110 i 01 o01 s 1101 0 iii dddd iiiiiiii", {"i": CONSTANTS}),
]
SHIFTED_REGISTERS = [
    Form(f"{name} (shifted register)", f"1110101 {opcode} s nnnn 0 iii dddd ii tt mmmm", {"t": range(4)})
    for name, opcode in OPCODES.items()
] + [
    Form("MOV, MVN (shifted register)", "1110101001 o s 1111 0 iii dddd ii tt mmmm", {"t": range(4)}),
    *(
        Form(f"{name} (shifted register)", f"1110101 {opcode} 1 nnnn 0 iii 1111 ii tt mmmm", {"t": range(4)})
        for name, opcode in TESTS.items()
    ),
    Form("ADD, SUB (SP, shifted register)", "1110101 1 o01 s 1101 0 iii dddd ii tt mmmm", {"t": range(4)}),
    Form("PKHBT, PKHTB", "111010101100 nnnn 0 iii dddd ii t0 mmmm", {"t": range(2)}),
]
PLAIN_CONSTANTS = [
    Form("ADDW, SUBW", "11110 i 10 o0o0 nnnn 0 iii dddd iiiiiiii", {"o": (0, 3), "n": ANY}),
    Form("ADR", "11110 i 10 o0o0 1111 0 iii dddd iiiiiiii", {"o": (0, 3)}),
    Form("MOVW, MOVT", "11110 i 10 o100 iiii 0 iii dddd iiiiiiii"),
    Form("SBFX, UBFX", "111100 11 o100 nnnn 0 lll dddd ll 0 wwwww", rule=_extracted),
    Form("BFI", "111100110110 nnnn 0 lll dddd ll 0 wwwww", rule=_inserted),
    Form("BFC", "1111001101101111 0 lll dddd ll 0 wwwww", rule=_inserted),
    Form("SSAT, USAT", "111100 11 o000 nnnn 0 lll dddd ll 0 wwwww"),
    Form("SSAT, USAT (ASR)", "111100 11 o010 nnnn 0 lll dddd ll 0 wwwww", {"l": range(1, 32)}),
    Form("SSAT16, USAT16", "111100 11 o010 nnnn 0 000 dddd 00 00 wwww"),
]
TO_SP = [
    Form("MOV (to SP)", "01000110 1 mmmm 101", {"m": GENERAL}),
    Form("ADD (to SP)", "01000100 1 mmmm 101", {"m": GENERAL}),
    Form(
        "ADD, SUB (SP plus constant, to SP)",
        "11110 i 01 o01 s 1101 0 iii 1101 iiiiiiii",
        {"i": range(0, 256, 4)},
    ),
    Form(
        "ADDW, SUBW (SP)", "11110 i 10 o0o0 1101 0 iii 1101 iiiiiiii", {"o": (0, 3), "i": range(0, 4096, 4)}
    ),
    Form("ADD, SUB (SP plus register, to SP)", "1110101 1 o01 s 1101 0000 1101 ii 00 mmmm"),
]


@pytest.fixture(scope="module")
def pair() -> EnginePair:
    return EnginePair()


@pytest.mark.parametrize(
    "form", SIXTEEN_BITS + MODIFIED_CONSTANTS + SHIFTED_REGISTERS + PLAIN_CONSTANTS, ids=str
)
def test_results_and_flags_equal_unicorn(pair: EnginePair, form: Form) -> None:
    pair.check(form, any_values)


def _multiples_of_4(random: Random, fields: Fields) -> Values:
    """Return multiples of 4, so that the value for SP is a multiple (bits 1:0 of SP are 0, B1.4.7)."""
    return {**{name: value & ~3 for name, value in any_values(random, fields).items()}, "xpsr": flags(random)}


@pytest.mark.parametrize("form", TO_SP, ids=str)
def test_stack_pointer_as_result_equals_unicorn(pair: EnginePair, form: Form) -> None:
    pair.check(form, _multiples_of_4)


@pytest.mark.parametrize(
    ("form", "base"),
    [
        (Form("MOV (to PC)", "01000110 1 mmmm 111", {"m": GENERAL}), CODE),
        (Form("ADD (to PC)", "01000100 1 mmmm 111", {"m": GENERAL}), 0),
    ],
    ids=str,
)
def test_program_counter_as_result_equals_unicorn(pair: EnginePair, form: Form, base: int) -> None:
    """The result is an address in flash. Bit 0 is ignored (BranchWritePC, A2.3.1)."""

    def jumps(random: Random, fields: Fields) -> Values:
        return {**any_values(random, fields), register_name(fields["m"]): base + random.randrange(0x1_0000)}

    pair.check(form, jumps, longest_block=1)
