"""The test assembler writes the same code as the GNU assembler (arm-none-eabi-as 2.40)."""

from __future__ import annotations

import pytest

from tests.support.arm.thumb_assembler import assemble

ENCODINGS = [  # with "back" two instructions before, and "ahead" behind the second one after
    ("nop", "00bf"),
    ("wfe", "20bf"),
    ("wfi", "30bf"),
    ("sev", "40bf"),
    ("dsb", "bff34f8f"),
    ("isb", "bff36f8f"),
    ("clrex", "bff32f8f"),
    ("cpsie i", "62b6"),
    ("cpsid i", "72b6"),
    ("cpsie f", "61b6"),
    ("cpsid if", "73b6"),
    ("svc #7", "07df"),
    ("udf #1", "01de"),
    ("bkpt #3", "03be"),
    ("movs r3, #200", "c823"),
    ("cmp r7, #255", "ff2f"),
    ("adds r1, #1", "0131"),
    ("subs r2, #9", "093a"),
    ("adds r1, r2, r3", "d118"),
    ("subs r4, r5, r6", "ac1b"),
    ("ands r1, r2", "1140"),
    ("eors r1, r2", "5140"),
    ("tst r3, r4", "2342"),
    ("cmp r5, r6", "b542"),
    ("orrs r7, r0", "0743"),
    ("bics r0, r7", "b843"),
    ("movw r9, #0xABCD", "4af6cd39"),
    ("movt r12, #0x4000", "c4f2000c"),
    ("mov r8, r1", "8846"),
    ("mov r0, sp", "6846"),
    ("mov pc, r3", "9f46"),
    ("mrs r0, psp", "eff30980"),
    ("mrs r5, basepri", "eff31185"),
    ("msr primask, r1", "81f31088"),
    ("msr basepri_max, r2", "82f31288"),
    ("msr control, r3", "83f31488"),
    ("msr apsr_nzcvq, r4", "84f30088"),
    ("mrs r1, xpsr", "eff30381"),
    ("add sp, sp, #16", "04b0"),
    ("sub sp, sp, #24", "86b0"),
    ("tst lr, #0x10", "1ef0100f"),
    ("lsls r1, r2, #3", "d100"),
    ("udiv r0, r1, r2", "b1fbf2f0"),
    ("sdiv r9, r10, r11", "9afbfbf9"),
    ("ldr r0, [r1, #4]", "d1f80400"),
    ("str r12, [r9]", "c9f800c0"),
    ("ldrb r3, [r4, #1]", "94f80130"),
    ("strb r5, [r6, #3]", "86f80350"),
    ("ldrh r1, [r2, #2]", "b2f80210"),
    ("strh r1, [r2, #2]", "a2f80210"),
    ("ldrd r0, r1, [r2, #8]", "d2e90201"),
    ("strd r4, r5, [r6, #-8]", "46e90245"),
    ("ldrex r0, [r1]", "51e8000f"),
    ("strex r2, r0, [r1]", "41e80002"),
    ("ldmia r0!, {r4-r11, lr}", "b0e8f04f"),
    ("ldmia r3, {r0-r2}", "93e80700"),
    ("stmdb r0!, {r4-r11}", "20e9f00f"),
    ("stmia r1!, {r2, r3}", "a1e80c00"),
    ("ldmdb r7, {r0, r1}", "17e90300"),
    ("push {r0, lr}", "01b5"),
    ("push {r4-r11, lr}", "2de9f04f"),
    ("pop {r0-r3, pc}", "0fbd"),
    ("pop {r4-r11, pc}", "bde8f08f"),
    ("push {r4}", "10b4"),
    ("vmov s3, r1", "01ee901a"),
    ("vmov r7, s31", "1fee907a"),
    ("vadd.f32 s0, s1, s2", "30ee810a"),
    ("vadd.f32 s17, s30, s5", "7fee228a"),
    ("vldr s1, [r2, #12]", "d2ed030a"),
    ("vstr s4, [r3]", "83ed002a"),
    ("vstmdb r0!, {s16-s31}", "20ed108a"),
    ("vldmia r0!, {s16-s31}", "b0ec108a"),
    ("vstmia r1, {s0-s15}", "81ec100a"),
    ("vldmia r1, {s1-s4}", "d1ec040a"),
    ("vmrs r0, fpscr", "f1ee100a"),
    ("vmsr fpscr, r1", "e1ee101a"),
    ("bx lr", "7047"),
    ("blx r3", "9847"),
    ("bx r0", "0047"),
    ("b .", "fee7"),
    ("b back", "fce7"),
    ("beq back", "fcd0"),
    ("bne ahead", "01d1"),
    ("b ahead", "01e0"),
    ("bl back", "fff7fcff"),
    ("bl ahead", "00f002f8"),
    ("cbz r3, ahead", "0bb1"),
    ("cbnz r1, ahead", "09b9"),
    ("it eq", "08bf"),
    ("itt ne", "1cbf"),
    ("ite cs", "2cbf"),
    ("itete lt", "b5bf"),
    ("itttt gt", "c1bf"),
]


@pytest.mark.parametrize(("text", "encoding"), ENCODINGS)
def test_encoding_equals_gnu_assembler(text: str, encoding: str) -> None:
    code, _ = assemble(f"back: nop\n nop\n {text}\n nop\n nop\nahead: nop", 0)

    assert code[4:-6].hex() == encoding


def test_mov32_accepts_labels_as_addresses() -> None:
    code, labels = assemble("mov32 r1, end+1 ; two instructions\nend: .word end+1", 0x0800_0100)

    assert labels == {"end": 0x0800_0108}
    assert code.hex() == "40f20911c0f60001" + "09010008"


def test_branch_out_of_reach_is_refused() -> None:
    with pytest.raises(AssertionError, match="out of reach"):
        assemble("b far", 0, {"far": 0x2000})
