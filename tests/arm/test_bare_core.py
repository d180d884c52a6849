"""A processor without peripherals: runs, accesses, breakpoints, code in RAM."""

from __future__ import annotations

import pytest

from fcu_emulator.emulator.chip.cpu.bare_core import BareCore, Stop
from fcu_emulator.emulator.chip.memory_map import FLASH, RAM
from tests.support.arm.thumb_assembler import assemble

CODE = FLASH + 0x200
DEVICE = 0x4002_0000


class Bench:
    """A core that is ready to run a program. ``log`` lists the accesses to a device."""

    def __init__(self, source: str) -> None:
        self.core = core = BareCore()
        code, self.labels = assemble(source, CODE, {"RAM": RAM, "DEVICE": DEVICE})
        core.flash[CODE - FLASH : CODE - FLASH + len(code)] = code
        core.pc = CODE
        self.log: list[tuple[str, int, int]] = []
        core.read_python, core.write_python = self._read, self._write

    def _read(self, address: int, size: int) -> int:
        self.log.append(("read", address, size))
        return 7

    def _write(self, address: int, size: int, value: int) -> None:
        del size
        self.log.append(("write", address, value))


def test_run_executes_given_number_of_instructions() -> None:
    bench = Bench("loop: adds r0, #1\n b loop")

    assert bench.core.run(7) is Stop.SLICE
    assert (bench.core.executed, bench.core.register(0), bench.core.pc) == (7, 4, CODE + 2)


@pytest.mark.parametrize("count", range(1, 6))
def test_run_may_stop_inside_it_block(count: int) -> None:
    """ARMv7-M ARM B1.5.6: an exception may occur between two instructions of a block, because ITSTATE is saved."""
    source = "cmp r0, #0\n itt eq\n addseq r1, #1\n addseq r2, #1\n adds r3, #1"
    whole, divided = Bench(source), Bench(source)
    whole.core.run(5)
    divided.core.run(count)
    assert divided.core.executed == count
    divided.core.run(5 - count)

    assert divided.core.core_state() == whole.core.core_state()


def test_accesses_to_registers_reach_python() -> None:
    bench = Bench("mov32 r1, DEVICE\n ldrh r0, [r1, #2]\n strb r0, [r1, #4]")

    assert bench.core.run(4) is Stop.SLICE
    assert bench.log == [("read", DEVICE + 2, 2), ("write", DEVICE + 4, 7)]
    assert bench.core.register(0) == 7


def test_error_in_device_access_reaches_caller() -> None:
    bench = Bench("mov32 r1, DEVICE\n ldr r0, [r1]")

    def fail(_address: int, _size: int) -> int:
        raise ValueError("no such device")

    bench.core.read_python = fail
    with pytest.raises(ValueError, match="no such device"):
        bench.core.run(10)


def test_run_stops_at_breakpoint_until_removed() -> None:
    bench = Bench("adds r0, #1\nhere: adds r0, #1\n adds r0, #1\n b .")
    bench.core.stop_before(bench.labels["here"])

    assert bench.core.run(10) is Stop.BREAKPOINT
    assert (bench.core.executed, bench.core.pc, bench.core.register(0)) == (1, bench.labels["here"], 1)
    bench.core.stop_before(bench.labels["here"], False)
    assert bench.core.run(2) is Stop.SLICE
    assert bench.core.register(0) == 3


def test_changed_code_in_ram_is_executed() -> None:
    bench = Bench("mov32 r1, RAM\n movw r2, #0x3001\n strh r2, [r1]\n mov32 r3, RAM+1\n bx r3")
    bench.core.ram[0:4] = bytes.fromhex("01 20 fe e7")  # MOVS R0, #1; B .

    assert bench.core.run(8) is Stop.SLICE
    assert (bench.core.pc, bench.core.register(0)) == (RAM + 2, 1)  # ADDS R0, #1


def test_loads_and_stores_in_watched_memory_are_reported() -> None:
    bench = Bench("mov32 r1, RAM\n ldr r0, [r1, #8]\n str r0, [r1, #12]\n str r0, [r1, #16]")
    seen: list[tuple[int, int, bool]] = []
    bench.core.on_access = lambda *access: seen.append(access)
    bench.core.watch_memory(RAM + 8, RAM + 12)
    bench.core.run(5)

    assert seen == [(RAM + 8, 4, False), (RAM + 12, 4, True)]
