"""Floating point is the same as on Unicorn (ARMv7-M ARM A6.4 to A6.7), for any FPSCR and operands."""

from __future__ import annotations

from random import Random

import pytest

from fcu_emulator.emulator.chip.cpu.core_registers import CoreRegisters
from fcu_emulator.emulator.chip.memory_map import RAM
from tests.support.arm.engine_pair import CODE, GENERAL, EnginePair, Fields, Form, Values, any_values

ACTIVE = 0xC
"""CONTROL.FPCA, and a bit that Unicorn sets together with FPCA for a context that has used floating point."""
RMODE = 3 << 22
WRITABLE = 0xF7C0_009F
"""Writable bits of FPSCR (A2.5.3): N, Z, C, V; AHP, DN, FZ, RMode; cumulative exceptions."""
SPECIAL = (
    *(0, 1, 0x007F_FFFF, 0x0080_0000, 0x0080_0001, 0x00FF_FFFF),  # zero, denormal, smallest normal
    *(0x3F80_0000, 0x3F80_0001, 0x3F7F_FFFF, 0x3F00_0000, 0x4020_0000, 0x3EFF_FFFF),  # about 1, and halves
    *(0x4EFF_FFFF, 0x4F00_0000, 0x4F7F_FFFF, 0x4F80_0000, 0x46FF_FE00, 0x477F_FF00),  # ends of integers
    *(0x477F_E000, 0x477F_EFFF, 0x477F_F000, 0x3880_0000, 0x387F_C000, 0x3300_0001),  # ends of half precision
    *(0x7F7F_FFFF, 0x7F80_0000, 0x7FC0_0000, 0x7FC1_2345, 0x7F80_0001, 0x7FA0_0000),  # infinite, NaNs
)
HALF_WAY = (0x3F80_0800, 0xBF80_0800, 0x2180_0000, 0xA180_0000)
"""1 + 2^-12, whose square is half-way between two numbers, and 2^-60, which decides if no digit is lost."""


def single(random: Random) -> int:
    """Return special numbers, their neighbours, numbers near 1, denormal numbers, or any numbers."""
    exponent = 127 + random.randint(-3, 33)
    magnitude = random.choice(
        (
            random.choice(SPECIAL),
            max(random.choice(SPECIAL) + random.randint(-2, 2), 0),
            exponent << 23 | random.getrandbits(23),
            exponent << 23 | random.getrandbits(4) << 19,
            random.getrandbits(23) >> random.randrange(23),
            random.getrandbits(31),
        )
    )
    return magnitude | random.getrandbits(1) << 31


def floats(random: Random, fields: Fields) -> Values:
    """Return registers with few different values, so that sums cancel."""
    few = [single(random) for _ in range(4)]
    few += [few[0] ^ 1 << 31, few[1] ^ 1]
    chosen = random.choice((few, few, few, HALF_WAY))
    registers = {f"s{number}": random.choice(chosen) for number in range(32)}
    return {
        **any_values(random, fields),
        **registers,
        "fpscr": random.getrandbits(32) & WRITABLE,
        "control": ACTIVE,
    }


def to_nearest(random: Random, fields: Fields) -> Values:
    """Return registers with rounding to nearest, for tests in which the rounding mode must not have an effect."""
    values = floats(random, fields)
    return {**values, "fpscr": values["fpscr"] & ~RMODE}


def in_ram(random: Random, fields: Fields) -> Values:
    """Return registers with addresses in RAM. Address plus any offset is also in RAM."""
    bases = [f"r{number}" for number in range(13)] + ["lr"]
    return {**floats(random, fields), **{base: RAM + 0x1000 + 4 * random.randrange(0x3800) for base in bases}}


def first_use(random: Random, fields: Fields) -> Values:
    """Return registers that usually have FPCA = 0."""
    return {**in_ram(random, fields), "control": random.choice((0, 2, ACTIVE))}


def two_apart(fields: Fields) -> bool:
    return fields["a"] != fields["t"]


def singles_exist(fields: Fields) -> bool:
    """Return whether all registers exist. The number of the first has its lowest bit at D."""
    first = (fields["d"] & 15) << 1 | fields["d"] >> 4
    return 0 < fields["i"] <= 32 - first


def doubles_exist(fields: Fields) -> bool:
    return 0 < fields["i"] <= 16 - fields["v"]


UP_TO_16 = {"i": [field for field in range(32) if 2 * (field & 15) + (field >> 4) <= 16]}
"""16 minus the number of fraction bits, with its lowest bit in front."""
ARITHMETIC = [
    Form(name, f"11101110 {opc1[0]}d{opc1[1:]} nnnn dddd 1010 n{op}m0 mmmm")
    for name, opc1, op in (
        ("VMLA", "000", 0),
        ("VMLS", "000", 1),
        ("VNMLS", "001", 0),
        ("VNMLA", "001", 1),
        ("VMUL", "010", 0),
        ("VNMUL", "010", 1),
        ("VADD", "011", 0),
        ("VSUB", "011", 1),
        ("VDIV", "100", 0),
        ("VFNMS", "101", 0),
        ("VFNMA", "101", 1),
        ("VFMA", "110", 0),
        ("VFMS", "110", 1),
    )
]
OTHER = [
    Form(name, f"111011101d11 {opc2} dddd 1010 {op}1m0 mmmm")
    for name, opc2, op in (
        ("VMOV", "0000", 0),
        ("VABS", "0000", 1),
        ("VNEG", "0001", 0),
        ("VSQRT", "0001", 1),
        ("VCVTB, VCVTT to single", "0010", "t"),
        ("VCVTB, VCVTT to half", "0011", "t"),
        ("VCMP, VCMPE", "0100", "e"),
        ("VCVT from integer", "1000", "s"),
        ("VCVT, VCVTR to unsigned", "1100", "r"),
        ("VCVT, VCVTR to signed", "1101", "r"),
    )
] + [
    Form("VMOV (immediate)", "111011101d11 iiii dddd 1010 0000 iiii"),
    Form("VCMP, VCMPE with zero", "111011101d11 0101 dddd 1010 e100 0000"),
    Form("VCVT to fixed point of 16 bits", "111011101d11 111u dddd 1010 01i0 iiii", UP_TO_16),
    Form("VCVT to fixed point of 32 bits", "111011101d11 111u dddd 1010 11i0 iiii"),
]
FROM_FIXED_POINT = [
    Form("VCVT from fixed point of 16 bits", "111011101d11 101u dddd 1010 01i0 iiii", UP_TO_16),
    Form("VCVT from fixed point of 32 bits", "111011101d11 101u dddd 1010 11i0 iiii"),
]
MOVES = [
    Form("VMOV (core and S)", "11101110000 o nnnn tttt 1010 n0010000"),
    Form("VMOV (core and half of D)", "111011100 0ho vvvv tttt 1011 00010000"),
    Form("VMOV (two core and two S)", "11101100010 o aaaa tttt 1010 00m1 mmmm", {"m": range(31)}, two_apart),
    Form("VMOV (two core and D)", "11101100010 o aaaa tttt 1011 0001 vvvv", rule=two_apart),
    Form("VMSR", "111011101110 0001 tttt 1010 00010000"),
    Form("VMRS", "111011101111 0001 tttt 1010 00010000", {"t": (*GENERAL, 15)}),
]
TRANSFERS = [
    Form("VSTR, VLDR", "11101101 ud0o nnnn dddd 1010 iiiiiiii", {"n": range(14)}),
    Form("VSTR, VLDR (D)", "11101101 u00o nnnn vvvv 1011 iiiiiiii", {"n": range(14)}),
    Form("VLDR (literal)", "11101101 ud01 1111 dddd 1010 iiiiiiii"),
    Form("VLDR (D, literal)", "11101101 u001 1111 vvvv 1011 iiiiiiii"),
    Form("VSTMIA, VLDMIA", "11101100 1dwo nnnn dddd 1010 00iiiiii", {"n": range(15)}, singles_exist),
    Form("VSTMIA, VLDMIA (D)", "11101100 10wo nnnn vvvv 1011 000iiii0", {"n": range(15)}, doubles_exist),
    Form("VSTMDB, VLDMDB", "11101101 0d1o nnnn dddd 1010 00iiiiii", {"n": range(15)}, singles_exist),
    Form("VSTMDB, VLDMDB (D)", "11101101 001o nnnn vvvv 1011 000iiii0", {"n": range(15)}, doubles_exist),
]


@pytest.fixture(scope="module")
def pair() -> EnginePair:
    return EnginePair()


@pytest.mark.parametrize("form", ARITHMETIC + OTHER, ids=str)
def test_results_and_exceptions_equal_unicorn(pair: EnginePair, form: Form) -> None:
    pair.check(form, floats, runs=24)


@pytest.mark.parametrize("form", FROM_FIXED_POINT, ids=str)
def test_conversion_from_fixed_point_equals_unicorn(pair: EnginePair, form: Form) -> None:
    pair.check(form, to_nearest)


def test_conversion_from_fixed_point_rounds_to_nearest(pair: EnginePair) -> None:
    """VCVT (between floating point and fixed point, A7.7) rounds to nearest for any FPSCR. Unicorn rounds up."""
    pair.place(CODE, (0xEEBA, 0x0AEF))  # VCVT.F32.S32 S0, S0, #1
    registers = CoreRegisters(pair.native, ("control", "fpscr", "s0"))
    registers.write(ACTIVE, 1 << 22, 0x0100_0001)
    pair.native.pc = CODE
    pair.native.run(1)

    assert registers.read()[2] == 0x4B00_0000


@pytest.mark.parametrize("form", MOVES, ids=str)
def test_register_moves_equal_unicorn(pair: EnginePair, form: Form) -> None:
    pair.check(form, floats)


@pytest.mark.parametrize("form", TRANSFERS, ids=str)
def test_loads_and_stores_equal_unicorn(pair: EnginePair, form: Form) -> None:
    pair.check(form, in_ram, longest_block=1)


@pytest.mark.parametrize("form", [ARITHMETIC[0], OTHER[0], *MOVES[-2:], TRANSFERS[0]], ids=str)
def test_first_floating_point_use_equals_unicorn(pair: EnginePair, form: Form) -> None:
    """FPSCR is initialised from FPDSCR, and CONTROL.FPCA is set (ExecuteFPCheck, B1.4.7)."""
    pair.check(form, first_use, longest_block=1)
