"""The core as a debugger's target: its stops, and runs that a debugger does not change."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from fcu_emulator.emulator.chip.gdb.core_target import CoreTarget
from fcu_emulator.emulator.chip.gdb.target import HaltReason, Point, PointKind
from fcu_emulator.emulator.chip.memory_map import FLASH, RAM
from fcu_emulator.emulator.clock import PS_PER_US
from tests.support.arm.core_bench import CODE, PROBE, CoreBench, interrupts, store
from tests.support.arm.thumb_assembler import assemble


class Debugged:
    """A bench whose core a debugger has stopped before its first instruction."""

    def __init__(self, program: str, *, skip: bool = True) -> None:
        self.bench = CoreBench(program, skip=skip)
        self.target = CoreTarget(self.bench.core, self.bench.clock, self.bench.core.run_until_ps)
        self.target.attach()

    def at(self, label: str) -> int:
        return self.bench.labels[label]

    def break_at(self, label: str) -> Point:
        point = Point(PointKind.HARDWARE_BREAK, self.at(label), 2)
        self.target.add(point)
        return point

    def go(self, until_us: float = 1000) -> HaltReason | None:
        self.target.resume()
        return self.run(until_us)

    def step(self, until_us: float = 1000) -> HaltReason | None:
        self.target.step()
        return self.run(until_us)

    def run(self, until_us: float) -> HaltReason | None:
        return self.target.run_until_ps(round(until_us * PS_PER_US))

    @property
    def pc(self) -> int:
        return self.target.read_registers()["pc"]

    @property
    def now_us(self) -> float:
        return self.bench.clock.now_ps / PS_PER_US


# -- breakpoints --------------------------------------------------------------------------------------------

LOOP = """
reset:  movs r0, #0
loop:   adds r0, #1
here:   nop
        b loop
"""


def test_breakpoint_stops_before_its_instruction_each_time() -> None:
    gdb = Debugged(LOOP)
    point = gdb.break_at("loop")

    stops = [(gdb.go(), gdb.now_us, gdb.target.read_registers()["r0"]) for _ in range(3)]

    assert stops == [(HaltReason(point, point.address), 1 + 3 * n, n) for n in range(3)]


def test_breakpoint_stops_again_when_set_again() -> None:
    gdb = Debugged(LOOP)
    point = gdb.break_at("here")
    assert gdb.go() is not None
    gdb.target.remove(point)
    assert gdb.go(until_us=50) is None
    gdb.target.halt()
    gdb.target.add(point)

    assert gdb.go() == HaltReason(point, point.address)
    assert 50 < gdb.now_us <= 54


def test_breakpoint_changes_no_memory_and_no_time() -> None:
    gdb, free = Debugged(LOOP), CoreBench(LOOP)
    gdb.break_at("here")
    code = gdb.target.read_memory(CODE, 16)
    while gdb.go(until_us=200) is not None:
        assert gdb.target.read_memory(CODE, 16) == code
    free.run_us(200)

    assert gdb.bench.core.retired == free.core.retired
    assert gdb.target.read_registers()["r0"] == free.register(0)


@pytest.mark.parametrize(
    "loop",
    [
        "loop: ldr r1, [r4]\nhere: cmp r1, #0\n beq loop",  # a flag of a block
        "loop: ldr r1, [r5]\nhere: cmp r1, #0\n beq loop",  # a variable
        "loop: str r5, [r5]\nhere: ldr r1, [r4]\n cmp r1, #0\n beq loop",  # storing the same again and again
        "here: b here",
        "loop: wfi\nhere: b loop",
    ],
)
def test_waiting_loop_with_breakpoint_is_not_skipped(loop: str) -> None:
    """Without a debugger the loop is skipped. With a debugger, each pass stops at the breakpoint."""
    program = f"""
    reset:  mov32 r4, FLAG
            mov32 r5, RAM
            {store("SYST_RVR", 99)}
            {store("SYST_CSR", 7)}
    {loop}
            b .
    sys_tick: bx lr
    """

    def passages(skip: bool) -> list[tuple[float, int]]:
        gdb = Debugged(program, skip=skip)
        assert gdb.go(until_us=3000) is None  # by now the loop has been found
        gdb.target.halt()
        gdb.break_at("here")
        return [(gdb.now_us, gdb.pc) for _ in range(40) if gdb.go(until_us=10_000)]

    skipped = passages(skip=True)

    assert len(skipped) == 40
    assert skipped == passages(skip=False)


def test_breakpoint_in_interrupt_handler_stops() -> None:
    gdb = Debugged(f"reset: {interrupts({3: 0})}\nloop: b loop\nirq3: log 1\n bx lr")
    gdb.bench.pulse_at_us(500, 3)
    point = gdb.break_at("irq3")

    assert gdb.go() == HaltReason(point, point.address)
    assert gdb.now_us == 500 + 12  # the cycles of the entry
    assert gdb.target.read_registers()["xpsr"] & 0x1FF == 16 + 3


IT_BLOCK = """
reset:  movs r0, #{value}
        movs r1, #0
        cmp r0, #1
block:  itte eq
first:  addseq r1, #1
second: addseq r1, #2
third:  addsne r1, #4
after:  adds r1, #8
        b .
"""


@pytest.mark.parametrize(("value", "label", "r1"), [(1, "first", 0), (1, "second", 1), (0, "third", 0)])
def test_breakpoint_in_it_block_stops_on_true_condition(value: int, label: str, r1: int) -> None:
    gdb = Debugged(IT_BLOCK.format(value=value))
    point = gdb.break_at(label)

    assert gdb.go() == HaltReason(point, point.address)
    assert gdb.target.read_registers()["r1"] == r1
    assert gdb.go(until_us=50) is None
    assert gdb.target.read_registers()["r1"] == (11 if value else 12)


@pytest.mark.parametrize(("value", "label"), [(0, "first"), (0, "second"), (1, "third")])
def test_breakpoint_in_it_block_ignored_on_false_condition(value: int, label: str) -> None:
    gdb = Debugged(IT_BLOCK.format(value=value))
    gdb.break_at(label)

    assert gdb.go(until_us=50) is None


# -- single steps -------------------------------------------------------------------------------------------


def test_step_executes_one_instruction_in_it_block() -> None:
    gdb = Debugged(IT_BLOCK.format(value=1))
    labels = []
    for _ in range(8):
        assert gdb.step() == HaltReason()
        labels.append(next((name for name, at in gdb.bench.labels.items() if at == gdb.pc), ""))

    assert labels == ["", "", "block", "first", "second", "third", "after", ""]
    assert gdb.target.read_registers()["r1"] == 11


CONDITIONAL = st.sampled_from(
    ["adds{} r1, #3", "subs{} r2, #1", "cmp{} r1, r2", "movs{} r3, #7", "ands{} r1, r2"]
)


@given(
    st.lists(st.tuples(CONDITIONAL, st.booleans()), min_size=1, max_size=4),
    st.sampled_from(["eq", "ne", "cs", "cc", "mi", "pl", "vs", "vc", "hi", "ls", "ge", "lt", "gt", "le"]),
    st.integers(0, 255),
    st.integers(0, 255),
)
def test_single_steps_keep_result_of_it_block(
    body: list[tuple[str, bool]], condition: str, left: int, right: int
) -> None:
    """ARMv7-M ARM A7.3: the conditions, the flags and the number of instructions that take time stay the same."""
    body[0] = body[0][0], True
    letters = "".join("t" if then else "e" for _, then in body[1:])
    block = "\n".join(text.format(condition) for text, _ in body)
    program = f"""
    reset:  movs r1, #{left}
            movs r2, #{right}
            movs r3, #0
            lsls r4, r1, #24
            subs r5, r1, r2
            it{letters} {condition}
            {block}
    done:   b .
    """
    stepped, free = Debugged(program), CoreBench(program)
    while stepped.pc != stepped.at("done"):
        assert stepped.step() == HaltReason()
    stepped.go(until_us=40)
    free.run_us(40)

    assert stepped.bench.core.retired == free.core.retired
    assert stepped.bench.core.core_state() == free.core.core_state()


def test_step_over_wfi_stops_at_next_instruction() -> None:
    gdb = Debugged(f"reset: {interrupts({3: 0})}\nsleep: wfi\nbehind: b behind\nirq3: bx lr")
    gdb.bench.pulse_at_us(500, 3)
    gdb.break_at("sleep")
    assert gdb.go() is not None

    assert gdb.step() == HaltReason()
    assert gdb.pc == gdb.at("behind")
    assert gdb.step(until_us=400) is None  # asleep
    assert gdb.run(until_us=1000) == HaltReason()
    assert (gdb.pc, gdb.now_us) == (gdb.at("irq3"), 512)


def test_step_enters_due_interrupt_and_svc() -> None:
    gdb = Debugged(
        f"reset: {interrupts({3: 0})}\ncall: svc #0\nback: nop\n b .\nirq3: bx lr\nsvc: nop\n bx lr"
    )
    gdb.break_at("call")
    assert gdb.go() is not None

    assert gdb.step() == HaltReason()
    assert gdb.pc == gdb.at("svc")
    gdb.bench.pulse(3)
    assert gdb.step() == HaltReason()
    assert gdb.pc != gdb.at("irq3")  # equal priority does not preempt (ARMv7-M ARM B1.5.4)
    gdb.target.write_register("basepri", 0)
    places = []
    for _ in range(3):
        gdb.step()
        places.append(gdb.pc)
    assert places == [gdb.at("irq3"), gdb.at("back"), gdb.at("back") + 2]  # chained, returned, one more


def test_attaching_during_exception_entry_stops_at_handler() -> None:
    program = f"reset: {interrupts({3: 0})}\nloop: b loop\nirq3: bx lr"
    bench = CoreBench(program)
    bench.pulse_at_us(500, 3)
    bench.run_us(505)
    target = CoreTarget(bench.core, bench.clock, bench.core.run_until_ps)
    target.attach()

    assert target.read_registers()["pc"] == bench.labels["irq3"]
    assert bench.clock.now_ps == 512 * PS_PER_US


# -- watchpoints --------------------------------------------------------------------------------------------

ACCESSES = """
reset:  mov32 r0, RAM
        movs r1, #5
        movs r2, #6
        str r1, [r0, #4]
w1:     ldr r3, [r0, #4]
r1:     strd r1, r2, [r0, #8]
w2:     strb r1, [r0, #6]
w3:     ldrh r3, [r0, #12]
r2:     b .
"""


@pytest.mark.parametrize(
    ("kind", "offset", "size", "stops"),
    [
        (PointKind.WRITE, 4, 4, [("w1", 4), ("w3", 6)]),
        (PointKind.READ, 4, 4, [("r1", 4)]),
        (PointKind.ACCESS, 4, 4, [("w1", 4), ("r1", 4), ("w3", 6)]),
        (PointKind.WRITE, 7, 1, [("w1", 7)]),
        (PointKind.WRITE, 6, 1, [("w1", 6), ("w3", 6)]),
        (PointKind.ACCESS, 13, 1, [("w2", 13), ("r2", 13)]),
        (PointKind.WRITE, 14, 1, [("w2", 14)]),
        (PointKind.ACCESS, 16, 8, []),
    ],
)
def test_watchpoint_stops_after_each_access(
    kind: PointKind, offset: int, size: int, stops: list[tuple[str, int]]
) -> None:
    gdb = Debugged(ACCESSES)
    point = Point(kind, RAM + offset, size)
    gdb.target.add(point)
    seen = []
    while (stop := gdb.go(until_us=50)) is not None:
        seen.append((gdb.pc, stop))

    assert seen == [(gdb.at(label), HaltReason(point, RAM + at)) for label, at in stops]


def test_watchpoint_stops_with_written_value() -> None:
    gdb = Debugged(ACCESSES)
    gdb.target.add(Point(PointKind.WRITE, RAM + 4, 4))
    gdb.go()

    assert gdb.target.read_memory(RAM + 4, 4) == b"\5\0\0\0"


def test_watched_peripheral_register_is_accessed_once() -> None:
    gdb = Debugged("reset: mov32 r0, EFFECT\n ldr r1, [r0]\nbehind: mov32 r0, LOG\n str r1, [r0]\nend: b .")
    for kind, offset in ((PointKind.READ, 8), (PointKind.WRITE, 0)):
        gdb.target.add(Point(kind, PROBE + offset, 4))

    assert (gdb.go(), gdb.pc) == (
        HaltReason(Point(PointKind.READ, PROBE + 8, 4), PROBE + 8),
        gdb.at("behind"),
    )
    assert (gdb.go(), gdb.pc) == (HaltReason(Point(PointKind.WRITE, PROBE, 4), PROBE), gdb.at("end"))
    assert gdb.go(until_us=50) is None
    assert gdb.bench.values == [1]


BIT_BANDS = [(RAM + 5, 0x2200_0000 + 32 * 5), (PROBE + 1, 0x4200_0000 + 32 * (PROBE - 0x4000_0000 + 1))]


@pytest.mark.parametrize(("place", "alias"), BIT_BANDS)
def test_watchpoint_sees_bit_band_writes(place: int, alias: int) -> None:
    """PM0214 2.2.5."""
    gdb = Debugged(f"reset: movs r1, #1\n mov32 r0, {alias + 12}\n str r1, [r0]\nbehind: b .")
    point = Point(PointKind.WRITE, place, 1)
    gdb.target.add(point)

    assert gdb.go() == HaltReason(point, place)
    assert gdb.pc == gdb.at("behind")


# -- BKPT, lock-up, reset -----------------------------------------------------------------------------------

BKPT = "reset: movs r0, #1\nstop: bkpt #0\nbehind: movs r0, #2\n b .\nhard_fault: log 9\n b ."


def test_core_halts_at_bkpt_and_can_continue() -> None:
    """ARMv7-M ARM C1.4.1."""
    gdb = Debugged(BKPT)

    assert gdb.go() == HaltReason()
    assert gdb.pc == gdb.at("stop")
    assert gdb.go(until_us=50) is None
    assert gdb.target.read_registers()["r0"] == 2


def test_bkpt_without_debugger_is_fault() -> None:
    gdb = Debugged(BKPT)
    gdb.target.release()

    assert gdb.run(until_us=100) is None
    assert gdb.bench.values == [9]


def test_lock_up_is_reported_once() -> None:
    gdb = Debugged("reset: udf #0\nhard_fault: udf #0")
    stop = gdb.go()

    assert stop is not None
    assert "lock-up" in stop.failure
    assert gdb.go() is None


def test_reset_stops_before_first_instruction() -> None:
    gdb = Debugged(LOOP)
    gdb.go(until_us=50)
    gdb.target.halt()
    before_us = gdb.now_us
    gdb.target.reset()

    registers = gdb.target.read_registers()
    assert (registers["pc"], registers["sp"], registers["r0"]) == (gdb.at("reset"), RAM + 0x1_0000, 0)
    assert gdb.now_us == before_us
    assert gdb.step() == HaltReason()
    assert gdb.pc == gdb.at("loop")


# -- registers and memory -----------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["r0", "r12", "lr", "msp", "psp", "s0", "s31"])
def test_register_is_written_and_read(name: str) -> None:
    gdb = Debugged(LOOP)
    gdb.target.write_register(name, 0x2000_1230)

    assert gdb.target.read_registers()[name] == 0x2000_1230


def test_sp_is_pointer_of_stack_in_use() -> None:
    gdb = Debugged(LOOP)
    gdb.target.write_register("psp", 0x2000_0800)
    gdb.target.write_register("control", 2)  # SPSEL

    assert gdb.target.read_registers()["sp"] == 0x2000_0800


def test_writing_pc_wakes_sleeping_core() -> None:
    gdb = Debugged("reset: wfi\nother: movs r0, #5\nend: b .")
    gdb.go(until_us=20)
    gdb.target.halt()
    gdb.target.write_register("pc", gdb.at("other") | 1)
    gdb.break_at("end")

    assert gdb.go() is not None
    assert gdb.target.read_registers()["r0"] == 5


def test_exception_number_cannot_be_written() -> None:
    gdb = Debugged(LOOP)
    gdb.target.write_register("xpsr", 0x9100_0003)

    assert gdb.target.read_registers()["xpsr"] == 0x9100_0000


def test_register_read_has_no_side_effects() -> None:
    gdb = Debugged(LOOP)

    assert gdb.target.read_memory(PROBE + 8, 4) == gdb.target.read_memory(PROBE + 8, 4) == bytes(4)
    assert gdb.target.read_memory(PROBE + 7, 3) == bytes(3)
    assert gdb.target.write_memory(PROBE, b"\x2a\0\0\0")
    assert gdb.bench.values == [0x2A]
    assert gdb.target.write_memory(0xE000_ED08, b"\x00\x02\0\0")  # VTOR
    assert gdb.target.read_memory(0xE000_ED08, 4) == b"\x00\x02\0\0"


@pytest.mark.parametrize("address", [0x1FFF_0000, 0x6000_0000, RAM + 0xFFFE, 0x4007_FFFE])
def test_impossible_write_is_refused_completely(address: int) -> None:
    gdb = Debugged(LOOP)
    before = gdb.target.read_memory(address, 2)

    assert not gdb.target.write_memory(address, b"\1\2\3\4")
    assert gdb.target.read_memory(address, 2) == before


def test_memory_read_ends_at_unmapped_address() -> None:
    gdb = Debugged(LOOP)

    assert gdb.target.read_memory(RAM + 0xFFFD, 8) == bytes(3)
    assert gdb.target.read_memory(0x6000_0000, 4) == b""
    assert gdb.target.read_memory(0, 8) == gdb.target.read_memory(FLASH, 8)


def test_code_written_to_flash_is_executed() -> None:
    """WFE is one of the instructions for which the core searches the code beforehand."""
    gdb = Debugged(LOOP)
    gdb.go(until_us=50)
    gdb.target.halt()
    code, labels = assemble("wfe\nbehind: movs r0, #77\nend: b .", CODE)
    gdb.target.write_memory(CODE, code)
    gdb.target.write_register("pc", CODE)

    assert gdb.go(until_us=200) is None  # asleep
    gdb.target.halt()
    assert gdb.pc == labels["behind"]
    gdb.target.write_register("pc", gdb.pc)
    gdb.go(until_us=300)
    assert gdb.target.read_registers()["r0"] == 77
