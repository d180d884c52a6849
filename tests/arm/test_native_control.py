"""Branches, special registers and requested exceptions are the same as on Unicorn, and runs end correctly.

ARMv7-M ARM A5.2.3, A5.2.5, A5.2.6, A5.3.4, B5.2.
"""

from __future__ import annotations

import struct
from random import Random

import pytest

from fcu_emulator.emulator.chip.cpu.bare_core import BareCore, Stop
from fcu_emulator.emulator.chip.memory_map import FLASH, RAM
from tests.support.arm.core_bench import CoreBench
from tests.support.arm.core_programs import interrupted_core, state
from tests.support.arm.engine_pair import (
    CODE,
    GENERAL,
    THUMB,
    Access,
    EnginePair,
    Fields,
    Form,
    State,
    Values,
    any_values,
    flags,
    register_name,
)

CONDITIONS = {"c": range(14)}
NEAR_FORWARD = {"i": range(1 << 15)}

BRANCHES = [
    Form("B (condition)", "1101 cccc iiiiiiii", CONDITIONS),
    Form("CBZ, CBNZ", "1011 o0i1 iiiii nnn"),
    Form(
        "B (condition, 32 bits, forward)",
        "11110 0 cccc iiiiii 10000 iiiiiiiiiii",
        {**CONDITIONS, **NEAR_FORWARD},
    ),
    Form("B (condition, 32 bits, back)", "11110 1 cccc 111 iii 10101 iiiiiiiiiii", CONDITIONS),
]
LAST_IN_IT = [
    Form("B", "11100 iiiiiiiiiii"),
    Form("B, BL (32 bits, forward)", "11110 0 iiiiiiiiii 1l111 iiiiiiiiiii", NEAR_FORWARD),
    Form("B, BL (32 bits, back)", "11110 1 1111111 iii 1l111 iiiiiiiiiii"),
    Form("BX, BLX", "01000111 l mmmm 000", {"m": GENERAL}),
]
NO_BRANCHES = [
    Form("NOP", "10111111 0000 0000"),
    Form("NOP, YIELD (32 bits)", "1111001110101111 10000000 00000000"),
    Form("CLREX", "1111001110111111 10001111 0010 1111"),
    Form("WFI", "10111111 0011 0000"),
    Form("SVC", "11011111 iiiiiiii"),
    Form("UDF", "11011110 iiiiiiii"),
    Form("UDF (32 bits)", "111101111111 iiii 1010 iiiiiiiiiiii"),
    Form("MCR, MRC", "11101110 iiio iiii tttt pppp iii1 iiii", {"p": (*range(10), *range(12, 16))}),
]
NOT_IN_IT = [
    Form("BKPT", "10111110 iiiiiiii"),
    Form("DSB, DMB, ISB", "1111001110111111 10001111 01oo 1111", {"o": (0, 1, 2)}),
]
"""BKPT is never conditional, and after barriers in IT blocks Unicorn counts differently."""
MRS = Form("MRS", "1111001111101111 1000 dddd ssssssss", {"s": (0, 1, 2, 3, 5, 6, 7, 8, 9, *range(16, 21))})
MSR = Form("MSR (flags, masks)", "111100111000 nnnn 1000 1000 ssssssss", {"s": (0, 1, 2, 3, 16, 17, 18, 19)})
MSR_SP = Form("MSR (stack pointers, CONTROL)", "111100111000 nnnn 1000 1000 ssssssss", {"s": (8, 9, 20)})
CPS = Form("CPS", "10110110011 e 00 if", {"i": (1,)})


@pytest.fixture(scope="module")
def pair() -> EnginePair:
    return EnginePair()


def jumps(random: Random, fields: Fields) -> Values:
    """Return registers whose branch targets are in flash."""
    values = any_values(random, fields)
    target = {register_name(fields["m"]): CODE + 2 * random.randrange(0x4000) | 1} if "m" in fields else {}
    return {**values, "r0": random.choice((0, 0, values["r0"])), **target}


def privileged(random: Random, fields: Fields) -> Values:
    """Return registers in Thread mode on either stack, or in Handler mode."""
    handler = random.choice((0, 0, 11, 15, 20))
    return {
        **any_values(random, fields),
        "xpsr": flags(random) | handler,
        "control": 0 if handler else random.choice((0, 2)),
        "primask": random.getrandbits(1),
        "basepri": random.choice((0, 0x10, 0x50, 0xF0)),
        "faultmask": random.getrandbits(1),
        "msp": RAM + 0x4000 + 4 * random.getrandbits(8),
        "psp": RAM + 0x6000 + 4 * random.getrandbits(8),
    }


def tame(random: Random, fields: Fields) -> Values:
    """Return privileged registers. No value of R0 to LR sets the low bits of SP or CONTROL.nPRIV."""
    values = privileged(random, fields)
    return {**values, **{register_name(number): values[register_name(number)] & ~11 for number in GENERAL}}


def unprivileged(random: Random, fields: Fields) -> Values:
    """Return registers in Thread mode on either stack. Bit 3 of CONTROL, which is reserved, is not written."""
    values = {name: value & ~8 for name, value in any_values(random, fields).items()}
    return {**values, "xpsr": flags(random), "control": random.choice((1, 3))}


@pytest.mark.parametrize("form", BRANCHES, ids=str)
def test_branches_equal_unicorn(pair: EnginePair, form: Form) -> None:
    pair.check(form, jumps, longest_block=0)


@pytest.mark.parametrize("form", LAST_IN_IT, ids=str)
def test_branches_in_it_blocks_equal_unicorn(pair: EnginePair, form: Form) -> None:
    pair.check(form, jumps, longest_block=1)


@pytest.mark.parametrize("form", NO_BRANCHES, ids=str)
def test_hints_and_exceptions_equal_unicorn(pair: EnginePair, form: Form) -> None:
    pair.check(form, any_values)


@pytest.mark.parametrize("form", NOT_IN_IT, ids=str)
def test_hints_and_exceptions_outside_it_blocks_equal_unicorn(pair: EnginePair, form: Form) -> None:
    pair.check(form, any_values, longest_block=0)


@pytest.mark.parametrize(
    ("form", "values", "longest_block"),
    [(MRS, privileged, 4), (MSR, privileged, 4), (MSR_SP, tame, 1), (CPS, privileged, 0)],
    ids=["MRS", "MSR", "MSR of SP and CONTROL", "CPS"],
)
def test_special_registers_equal_unicorn(
    pair: EnginePair, form: Form, values: State, longest_block: int
) -> None:
    pair.check(form, values, longest_block=longest_block)


@pytest.mark.parametrize("exception", [2, 3])
@pytest.mark.parametrize("words", [(0xB671,), (0xF380, 0x8813)], ids=["CPSID f", "MSR"])
def test_faultmask_cannot_be_set_in_nmi_or_hardfault(
    pair: EnginePair, words: tuple[int, ...], exception: int
) -> None:
    """Their priority is already as high (B5.2.1, B5.2.3). Unicorn sets FAULTMASK nevertheless."""
    pair.place(CODE, words)
    access = Access(pair.native)
    access.write({"xpsr": THUMB | exception, "r0": 1})
    pair.native.pc = CODE
    pair.native.run(1)

    assert access.read()["faultmask"] == 0


@pytest.mark.parametrize("form", [MRS, MSR, MSR_SP, CPS], ids=str)
def test_special_registers_without_privilege_equal_unicorn(form: Form) -> None:
    """After its CPS, Unicorn would stay without privilege."""
    EnginePair().check(form, unprivileged, longest_block=0)


def test_conditional_branches_reach_one_megabyte(pair: EnginePair) -> None:
    """A7.7.12, encoding T3: S:J2:J1:imm6:imm11:0."""
    random = Random("T3")
    form = Form("BEQ", "11110 s 0000 iiiiii 10 j 0 k iiiiiiiiiii")
    for _ in range(50):
        words, f = form.draw(random)
        distance = 2 * (f["k"] << 18 | f["j"] << 17 | f["i"]) - (f["s"] << 20)
        assert branched(pair.native, words) == CODE + 4 + distance & 0xFFFF_FFFF


@pytest.mark.parametrize("links", [0, 1])
def test_branches_reach_16_megabytes(pair: EnginePair, links: int) -> None:
    """B (A7.7.12, encoding T4) and BL (A7.7.18): S:I1:I2:imm10:imm11:0, where I is NOT(J EOR S)."""
    random = Random("T4")
    form = Form("B, BL", f"11110 s iiiiiiiiii 1 {links} j 1 k iiiiiiiiiii")
    for _ in range(50):
        words, f = form.draw(random)
        upper = (f["j"] ^ f["s"] ^ 1) << 1 | f["k"] ^ f["s"] ^ 1
        distance = 2 * (upper << 21 | f["i"]) - (f["s"] << 24)
        assert branched(pair.native, words) == CODE + 4 + distance & 0xFFFF_FFFF
        assert pair.native.register(14) == (CODE + 5 if links else 0)


def branched(engine: BareCore, words: list[int]) -> int:
    """Return the address after one instruction, with Z set."""
    engine.flash[CODE - FLASH : CODE - FLASH + 4] = struct.pack("<2H", *words)
    engine.invalidate_code()
    Access(engine).write({"xpsr": THUMB | 1 << 30})
    engine.pc = CODE
    assert engine.run(1) is Stop.SLICE
    return engine.pc


@pytest.mark.parametrize("address", [0xF000_0000, 0xFEFF_FFFF, 0xFFFF_FFE9, 0xFFFF_FFFF])
def test_only_handler_mode_interprets_exception_return(pair: EnginePair, address: int) -> None:
    """Bits 31:28 decide (BXWritePC, A2.3.1). Unicorn needs 31:24 set."""
    engine = pair.native
    pair.place(CODE, (0x4708,))  # BX R1
    for mode, stop in ((15, Stop.EXCEPTION_RETURN), (0, Stop.EXECUTE_NEVER)):
        Access(engine).write({"xpsr": THUMB | mode, "r1": address | 1})
        engine.pc, engine.thumb = CODE, True
        assert engine.run(2) is stop


@pytest.mark.parametrize(("hint", "stop"), [(0xBF10, Stop.SLICE), (0xBF20, Stop.WFE)], ids=["YIELD", "WFE"])
@pytest.mark.parametrize("it", [[], [0xBF08]], ids=["alone", "in an IT block"])
def test_yield_does_nothing_and_wfe_stops_run(pair: EnginePair, hint: int, stop: Stop, it: list[int]) -> None:
    """YIELD and WFE (A7.7, by name). The core executes WFE itself and does not give it to Unicorn."""
    pair.place(CODE, (*it, hint, 0xBF00))
    Access(pair.native).write({"xpsr": THUMB | 1 << 30})
    pair.native.pc = CODE

    assert (pair.native.run(len(it) + 1), pair.native.pc) == (stop, CODE + 2 * len(it) + 2)


def test_split_run_equals_single_run() -> None:
    """The program has interrupts, polling, waiting and IT blocks, with one instruction per microsecond."""

    def core() -> CoreBench:
        return interrupted_core([(120, 0), (333, 1), (900, 2), (1500, 0)], flag_us=250)

    divided, time_us = core(), 40
    for length in range(1, 61):
        time_us += length
        divided.run_us(time_us)
        whole = core()
        whole.run_us(time_us)
        assert state(divided) == state(whole), f"at {time_us} us, after {length}"


@pytest.mark.parametrize(
    ("mask", "value"),
    [(0, 0), (0x0FFF, 0xB000), (0x01FF, 0xE800), (0x03FF, 0xEC00), (0x01FF, 0xF800), (0x07FF, 0xF000)],
    ids=["anything", "miscellaneous", "several", "floating point", "single", "system"],
)
def test_random_halfwords_do_no_harm(mask: int, value: int) -> None:
    """Half of the half-words are instructions of a known kind. The run ends in time, and flash does not change."""
    random = Random(value)
    engine = BareCore()
    kinds = [(0xFFFF, 0), (mask or 0xFFFF, value)]
    words = [random.getrandbits(16) & kept | fixed for _ in range(2048) for kept, fixed in kinds]
    engine.flash[: 2 * len(words)] = struct.pack(f"<{len(words)}H", *words)
    flash = bytes(engine.flash)
    access = Access(engine)
    for _ in range(100):
        pointers = {f"r{number}": RAM + random.getrandbits(16) for number in range(13)}
        access.write({**pointers, "xpsr": flags(random), "control": random.choice((0, 1, 2))})
        engine.pc, engine.thumb = FLASH + 2 * random.randrange(len(words)), True
        engine.run(40)

        assert engine.executed <= 44  # an IT block is not divided
        assert engine.flash == flash


def test_breakpoint_in_it_block_is_unconditional(pair: EnginePair) -> None:
    """A7.7.17."""
    pair.place(CODE, (0xBF18, 0xBE00))  # IT NE; BKPT
    Access(pair.native).write({"xpsr": THUMB | 1 << 30})
    pair.native.pc = CODE

    assert (pair.native.run(2), pair.native.pc) == (Stop.BKPT, CODE + 2)
