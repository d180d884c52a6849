"""DSP, multiplication and division are the same as on Unicorn (ARMv7-M ARM A5.3.12 to A5.3.17)."""

from __future__ import annotations

from itertools import product

import pytest

from tests.support.arm.engine_pair import GENERAL, EnginePair, Form, any_values

TWICE = {"m": [number << 4 | number for number in GENERAL]}
"""The register occurs twice in the encoding."""
SEL_AND_MRS = "111110101010 pppp 1111 qqqq 1000 rrrr 1111001111101111 1000 tttt 00000000"
"""Instructions that show APSR.GE; t is APSR."""
READ = dict.fromkeys("pqr", GENERAL)

SHIFTS_AND_EXTENSIONS = [
    Form("LSL, LSR, ASR, ROR (register)", "111110100 oo s nnnn 1111 dddd 0000 mmmm"),
    *(
        Form(f"{name}, with addition", f"111110100 {kind} nnnn 1111 dddd 10rr mmmm", {"n": (*GENERAL, 15)})
        for name, kind in (
            ("SXTH", "000"),
            ("UXTH", "001"),
            ("SXTB16", "010"),
            ("UXTB16", "011"),
            ("SXTB", "100"),
            ("UXTB", "101"),
        )
    ),
]
PARALLEL = {
    prefix + name: f"111110101 {op1} nnnn 1111 dddd 0 {op2} mmmm"
    for (prefix, op2), (name, op1) in product(
        {"S": "000", "Q": "001", "SH": "010", "U": "100", "UQ": "101", "UH": "110"}.items(),
        {"ADD8": "000", "ADD16": "001", "ASX": "010", "SUB8": "100", "SUB16": "101", "SAX": "110"}.items(),
    )
}
MISCELLANEOUS = [
    Form("QADD, QDADD, QSUB, QDSUB", "111110101000 nnnn 1111 dddd 10oo mmmm"),
    Form("REV, REV16, RBIT, REVSH", "111110101001 mmmm 1111 dddd 10oo mmmm", TWICE),
    Form("CLZ", "111110101011 mmmm 1111 dddd 1000 mmmm", TWICE),
]
MULTIPLICATIONS = [
    Form("MLS", "111110110000 nnnn aaaa dddd 0001 mmmm"),
    Form("SMMLS", "111110110110 nnnn aaaa dddd 000r mmmm"),
    *(
        Form(name, f"111110110 {op1} nnnn {added} dddd {op2} mmmm")
        for names, op1, op2 in (
            ("MLA MUL", "000", "0000"),
            ("SMLAxy SMULxy", "001", "00xy"),
            ("SMLAD SMUAD", "010", "000x"),
            ("SMLAWy SMULWy", "011", "000y"),
            ("SMLSD SMUSD", "100", "000x"),
            ("SMMLA SMMUL", "101", "000r"),
            ("USADA8 USAD8", "111", "0000"),
        )
        for name, added in zip(names.split(), ("aaaa", "1111"), strict=True)
    ),
]
LONG = [
    Form(name, f"111110111 {op1} nnnn aaaa dddd {op2} mmmm", rule=lambda fields: fields["a"] != fields["d"])
    for name, op1, op2 in (
        ("SMULL", "000", "0000"),
        ("UMULL", "010", "0000"),
        ("SMLAL", "100", "0000"),
        ("SMLALxy", "100", "10xy"),
        ("SMLALD", "100", "110x"),
        ("SMLSLD", "101", "110x"),
        ("UMLAL", "110", "0000"),
        ("UMAAL", "110", "0110"),
    )
]
DIVISIONS = [Form("SDIV, UDIV", "1111101110 u 1 nnnn 1111 dddd 1111 mmmm")]
REST = SHIFTS_AND_EXTENSIONS + MISCELLANEOUS + MULTIPLICATIONS + LONG + DIVISIONS


@pytest.fixture(scope="module")
def pair() -> EnginePair:
    return EnginePair()


@pytest.mark.parametrize("form", REST, ids=str)
def test_results_and_flags_equal_unicorn(pair: EnginePair, form: Form) -> None:
    pair.check(form, any_values)


@pytest.mark.parametrize("form", [Form(*item) for item in PARALLEL.items()], ids=str)
def test_parallel_results_equal_unicorn(pair: EnginePair, form: Form) -> None:
    pair.check(form, any_values)


@pytest.mark.parametrize(
    "form",
    [
        *(
            Form(f"{name}, SEL, MRS", f"{pattern} {SEL_AND_MRS}", READ, instructions=3)
            for name, pattern in PARALLEL.items()
            if name.startswith(("SADD", "SSUB", "SASX", "SSAX", "UADD", "USUB", "UASX", "USAX"))
        ),
        Form(
            "MSR APSR, SEL, MRS", f"111100111000 nnnn 1000 f100 00000000 {SEL_AND_MRS}", READ, instructions=3
        ),
    ],
    ids=str,
)
def test_flags_of_parallel_arithmetic_equal_unicorn(pair: EnginePair, form: Form) -> None:
    """These instructions set APSR.GE, except instructions that saturate or halve. MSR also sets it (A2.3.2)."""
    pair.check(form, any_values, longest_block=0)
