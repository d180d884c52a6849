"""What is relied upon of both engines: each fact by itself, so that another version of Unicorn that differs
is found out here.
"""

from __future__ import annotations

import pytest

from emulator.arm.cpu import engines
from emulator.arm.cpu.engine import FLASH, RAM
from emulator.arm.cpu.registers import Registers
from emulator.arm.cpu.stop import Stop
from tests.arm.thumb_assembler import assemble

CODE = FLASH + 0x200
DEVICE = 0x4002_0000
SYMBOLS = {"RAM": RAM, "DEVICE": DEVICE}


class Bench:
    """An engine in front of a program; ``log`` are the accesses to a device of one kilobyte."""

    def __init__(self, source: str) -> None:
        self.engine = engines.make("")
        code, self.labels = assemble(source, CODE, SYMBOLS)
        self.engine.flash[CODE - FLASH : CODE - FLASH + len(code)] = code
        self.engine.pc = CODE
        self.log: list[tuple[str, int, int]] = []
        self.counts: list[int] = []
        self.cuts = False
        Registers(self.engine, ("sp",)).write(RAM + 0x8000)
        self.engine.map_callbacks(DEVICE, 0x400, self._read, self._write)

    def _read(self, _engine: int, offset: int, _size: int, _data: int) -> int:
        self.log.append(("read", offset, 7))
        self._came_by()
        return 7

    def _write(self, _engine: int, offset: int, _size: int, value: int, _data: int) -> None:
        self.log.append(("write", offset, value))
        self._came_by()

    def _came_by(self) -> None:
        self.counts.append(self.engine.counter.value)
        if self.cuts:
            self.engine.cut()

    def register(self, number: int) -> int:
        return self.engine.register(number)


def test_a_run_has_as_many_instructions_as_asked_for() -> None:
    bench = Bench("loop: adds r0, #1\n b loop")

    assert bench.engine.run(7) is Stop.SLICE
    assert (bench.engine.executed, bench.register(0), bench.engine.pc) == (7, 4, CODE + 2)


def test_an_it_block_is_executed_as_a_whole() -> None:
    bench = Bench("cmp r0, #0\n itt eq\n addseq r1, #1\n addseq r2, #1\n adds r3, #1")

    bench.engine.run(3)
    assert (bench.register(1), bench.register(2), bench.register(3)) == (1, 1, 0)


def test_the_counter_includes_the_access_in_flight_and_can_end_the_run_behind_it() -> None:
    bench = Bench("mov32 r0, DEVICE\n nop\n ldr r1, [r0]\n nop\n nop")
    bench.cuts = True

    assert bench.engine.run(100) is Stop.SLICE
    assert (bench.counts, bench.engine.executed, bench.register(1)) == ([4], 4, 7)


@pytest.mark.parametrize("access", ["ldreq r1, [r0]", "streq r1, [r0]"])
@pytest.mark.parametrize("place", ["RAM+1024", "RAM+2048", "DEVICE"])
def test_an_access_in_an_it_block_leaves_no_condition_behind(access: str, place: str) -> None:
    """At the first access to a page, which fills the TLB; what follows is jumped to through a register."""
    bench = Bench(
        f"mov32 r0, {place}\n mov32 r5, on+1\n cmp r6, #0\n itt eq\n {access}\n addseq r2, #1\n"
        "cmp r6, #1\n bx r5\n nop\non: adds r3, #1\n adds r4, #1\nend: b end"
    )
    bench.engine.run(40)

    assert (bench.register(2), bench.register(3), bench.register(4)) == (1, 1, 1)


def test_code_in_ram_that_is_overwritten_is_executed_anew() -> None:
    """And before any of it is executed, RAM is not executable, which makes stores fast."""
    bench = Bench(
        "mov32 r0, RAM+64\n mov32 r1, 0x47702501  ; MOVS R5, #1; BX LR\n mov32 r2, 0x47702502\n"
        "mov32 r3, RAM+65\n str r1, [r0]\n blx r3\n mov r6, r5\n str r2, [r0]\n blx r3\nend: b end"
    )
    begun: list[int] = []
    bench.engine.when_ram_is_executed.append(lambda: begun.append(bench.engine.pc))
    while bench.engine.pc != bench.labels["end"]:
        assert bench.engine.run(100) is Stop.SLICE

    assert (bench.register(6), bench.register(5)) == (1, 2)
    assert begun == [RAM + 64]


def test_a_run_ends_in_front_of_a_place_and_can_pass_it() -> None:
    bench = Bench("adds r0, #1\nhere: adds r1, #1\n adds r2, #1\n b here")
    here = bench.labels["here"]
    bench.engine.run(5)  # translated before
    bench.engine.stop_in_front_of(frozenset({here}))

    assert bench.engine.run(100) is Stop.PLACE
    assert (bench.engine.pc, bench.engine.executed) == (here, 2)
    assert bench.engine.run_past() is Stop.SLICE
    assert (bench.engine.pc, bench.register(1)) == (here + 2, 3)
    assert bench.engine.run(100) is Stop.PLACE

    bench.engine.stop_in_front_of(frozenset())
    assert bench.engine.run(100) is Stop.SLICE


def test_wfi_is_told_from_a_place() -> None:
    bench = Bench("nop\n wfi\nhere: nop\n nop")
    bench.engine.stop_in_front_of(frozenset({bench.labels["here"]}))

    assert (bench.engine.run(100), bench.engine.executed) == (Stop.WFI, 2)
    assert (bench.engine.run(100), bench.engine.executed) == (Stop.PLACE, 0)


def test_the_whole_state_has_every_word_that_was_ever_stored_to() -> None:
    bench = Bench("mov32 r0, RAM+5000\n movs r1, #1\nloop: str r1, [r0]\n movs r1, #2\n movs r1, #1\n b loop")
    bench.engine.run(5)
    states = []
    for _ in range(3):
        bench.engine.run(4)
        states.append(bench.engine.whole_state())
    bench.engine.ram[5000] = 9

    assert states[0] == states[1] == states[2] != bench.engine.whole_state()


def test_a_window_read_from_an_image_still_calls_for_writes() -> None:
    bench = Bench("mov32 r0, DEVICE\nloop: ldr r1, [r0, #16]\n adds r2, #1\n strh r2, [r0, #24]\n b loop")
    image = memoryview(bytearray(0x400)).cast("I")
    image[4] = 0x1234
    bench.engine.show_image(DEVICE, image)

    assert bench.engine.run(100) is Stop.SLICE
    assert (bench.engine.executed, bench.register(1)) == (5, 0x1234)
    assert bench.log == [("write", 24, 1)]

    bench.engine.hide_image(DEVICE)
    bench.engine.run(4)
    assert (bench.register(1), bench.log[1:]) == (7, [("read", 16, 7), ("write", 24, 2)])
