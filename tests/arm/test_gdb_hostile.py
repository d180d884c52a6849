"""Hostile packets to the debugger cause errors and stops, but never an exception."""

from __future__ import annotations

from hypothesis import given, settings
from hypothesis import strategies as st

from fcu_emulator.emulator.chip.gdb.core_target import CoreTarget
from fcu_emulator.emulator.chip.gdb.description import REGISTERS
from fcu_emulator.emulator.chip.gdb.session import GdbSession
from fcu_emulator.emulator.chip.memory_map import RAM
from fcu_emulator.emulator.clock import PS_PER_US
from tests.support.arm.core_bench import CODE, PROBE, CoreBench, interrupts, store

PROGRAM = f"""
reset:  {interrupts({3: 0})}
        {store("CPACR", 0x00F0_0000)}
        {store("SYST_RVR", 40)}
        {store("SYST_CSR", 7)}
loop:   mov32 r0, RAM
        str r1, [r0]
        ldr r1, [r0]
        cmp r1, r2
        ite eq
        addseq r1, #1
        addsne r1, #2
        b loop
sys_tick: bx lr
irq3:   bx lr
"""

NUMBERS = st.one_of(
    st.sampled_from(
        [0, 1, 2, 0xFFFF_FFFF, 0xFFFF_FFF9, CODE, CODE + 1, CODE + 100, RAM, RAM - 2, PROBE, 0xE000_ED04]
    ),
    st.integers(0, 0xFFFF_FFFF),
)
ADDRESSES = st.one_of(NUMBERS, st.integers(CODE, CODE + 140), st.integers(0xE000_E000, 0xE000_EFFF))
SIZES = st.sampled_from([0, 1, 2, 3, 4, 8, 255])
PACKETS = st.one_of(
    st.builds(
        lambda number, value: b"P%x=%s" % (number, value.to_bytes(4, "little").hex().encode()),
        st.integers(0, len(REGISTERS)),
        NUMBERS,
    ),
    st.builds(lambda address, size: b"m%x,%x" % (address, size), ADDRESSES, SIZES),
    st.builds(
        lambda address, data: b"M%x,%x:%s" % (address, len(data), data.hex().encode()),
        ADDRESSES,
        st.binary(max_size=9),
    ),
    st.builds(
        lambda verb, kind, address, size: b"%c%d,%x,%x" % (verb, kind, address, size),
        st.sampled_from(b"Zz"),
        st.integers(0, 4),
        ADDRESSES,
        SIZES,
    ),
    st.builds(lambda data: b"vFlashWrite:%x:%s" % (CODE, data), st.binary(max_size=40)),
    st.builds(lambda address: b"c%x" % address, ADDRESSES),
    st.builds(lambda address: b"s%x" % address, ADDRESSES),
    st.sampled_from([b"c", b"s", b"g", b"vCont;c", b"vCont;s", b"?"]),
)


@settings(max_examples=150)
@given(st.lists(PACKETS, max_size=25))
def test_core_survives_any_packets(packets: list[bytes]) -> None:
    bench = CoreBench(PROGRAM)
    target = CoreTarget(bench.core, bench.clock, bench.core.run_until_ps)
    sent: list[bytes] = []
    session = GdbSession(target, lambda command: command, sent.append)
    for packet in packets:
        sent.clear()
        session.handle(packet)
        if not session.halted:
            stop = target.run_until_ps(bench.clock.now_ps + 200 * PS_PER_US)
            if stop is not None:
                session.stopped(stop)
            session.interrupt()
        assert sent
        assert session.halted
    session.close()
    bench.core.run_until_ps(bench.clock.now_ps + 200 * PS_PER_US)
