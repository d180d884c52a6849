"""The remote protocol without sockets and without a core (GDB manual, "GDB Remote Serial Protocol")."""

from __future__ import annotations

import xml.etree.ElementTree as ET

import pytest
from hypothesis import given
from hypothesis import strategies as st

from fcu_emulator.emulator.chip.gdb.description import REGISTERS, memory_map_xml, target_xml
from fcu_emulator.emulator.chip.gdb.packets import (
    LONGEST,
    MALFORMED,
    OK,
    REFUSED,
    Arrival,
    Framer,
    frame,
    unescape,
)
from fcu_emulator.emulator.chip.gdb.session import DebuggerExit
from fcu_emulator.emulator.chip.gdb.target import HaltReason, Point, PointKind
from fcu_emulator.emulator.chip.memory_map import FLASH, FLASH_SIZE, RAM, RAM_SIZE
from tests.support.arm.gdb_fakes import INSTRUCTION_PS, LOOP_END, START, Debugger, FakeTarget

STOPPED = b"T05thread:1;"
VERBS = b"?gGpPmMXcCsSZzHTDkqQv!bidnrRtA"


@pytest.fixture
def gdb() -> Debugger:
    return Debugger(FakeTarget())


# -- framing ------------------------------------------------------------------------------------------------


def test_packet_has_format_of_manual() -> None:
    assert frame(b"OK") == b"$OK#9a"
    assert frame(b"a}b#") == b"$a}]b}\x03#" + b"%02x" % ((ord("a") + 0x7D + 0x5D + ord("b") + 0x7D + 3) % 256)


@given(st.lists(st.binary(max_size=200), max_size=5), st.integers(1, 50))
def test_packets_are_decoded_from_pieces_of_stream(payloads: list[bytes], length: int) -> None:
    wire = b"+".join(map(frame, payloads))
    framer = Framer()

    arrived = [one for at in range(0, len(wire), length) for one in framer.feed(wire[at : at + length])]

    assert arrived == payloads


def test_framer_recognises_control_and_corrupt_bytes() -> None:
    framer = Framer()

    assert framer.feed(b"+\x03-") == [Arrival.INTERRUPT, Arrival.RESEND]
    assert framer.feed(b"$OK#9b") == [Arrival.CORRUPT]
    assert framer.feed(b"$OK#9A") == [b"OK"]
    assert framer.feed(b"$O$OK#9a") == [b"OK"]  # the first one was given up
    assert framer.feed(b"$O#zz") == [Arrival.CORRUPT]


def test_control_c_inside_packet_is_data() -> None:
    assert Framer().feed(b"$a\x03#64") == [b"a\x03"]


def test_too_long_packet_is_discarded() -> None:
    framer = Framer()

    assert framer.feed(frame(b"m" * LONGEST)) == [b"m" * LONGEST]
    assert framer.feed(b"$" + b"m" * (LONGEST + 1) + b"#00$g#67") == [Arrival.OVERLONG, b"g"]


def test_escape_at_end_is_dropped() -> None:
    assert unescape(b"ab}") == b"ab"
    assert unescape(b"}]}]") == b"}}"


# -- descriptions -------------------------------------------------------------------------------------------


def test_registers_have_names_that_gdb_requires() -> None:
    """GDB manual, "ARM Features": r0 to r12, sp, lr, pc, xpsr; d0 to d15, fpscr; msp, psp."""
    features = {feature.get("name"): feature for feature in ET.fromstring(target_xml()).iter("feature")}
    names = {name: [reg.get("name") for reg in feature] for name, feature in features.items()}

    assert names["org.gnu.gdb.arm.m-profile"] == [*(f"r{n}" for n in range(13)), "sp", "lr", "pc", "xpsr"]
    assert names["org.gnu.gdb.arm.vfp"] == [*(f"d{n}" for n in range(16)), "fpscr"]
    assert {"msp", "psp"} <= set(names["org.gnu.gdb.arm.m-system"])
    sizes = [int(reg.get("bitsize") or 0) // 8 for feature in features.values() for reg in feature]
    assert sizes == [register.size for register in REGISTERS]


def test_memory_map_has_flash_and_ram() -> None:
    regions = {
        int(memory.get("start") or "", 16): (memory.get("type"), int(memory.get("length") or "", 16))
        for memory in ET.fromstring(memory_map_xml()).iter("memory")
    }

    assert regions[FLASH] == ("flash", FLASH_SIZE)
    assert regions[RAM] == ("ram", RAM_SIZE)


def test_flash_in_memory_map_has_block_size() -> None:
    """GDB manual, "Memory Map Format": without the block size, GDB refuses the whole map."""
    flash = ET.fromstring(memory_map_xml()).findall("memory[@type='flash']/property[@name='blocksize']")

    assert [int(one.text or "", 16) for one in flash] == [0x4000]


def test_xml_documents_are_read_in_pieces(gdb: Debugger) -> None:
    text, reply = b"", b"m"
    while reply[:1] == b"m":
        reply = gdb.ask(b"qXfer:features:read:target.xml:%x,40" % len(text))
        text += reply[1:]

    assert reply[:1] == b"l"
    assert text == target_xml()
    assert gdb.ask(b"qXfer:features:read:target.xml:%x,40" % 10**6) == b"l"
    assert gdb.ask(b"qXfer:memory-map:read::0,1000")[1:] == memory_map_xml()
    assert gdb.ask(b"qXfer:auxv:read::0,1000") == b""


# -- queries ------------------------------------------------------------------------------------------------


def test_supported_features_are_announced(gdb: Debugger) -> None:
    announced = gdb.ask(b"qSupported:multiprocess+;hwbreak+").split(b";")

    assert b"PacketSize=%x" % LONGEST in announced
    assert {b"QStartNoAckMode+", b"qXfer:features:read+", b"qXfer:memory-map:read+"} <= set(announced)


@pytest.mark.parametrize(
    ("packet", "reply"),
    [
        (b"?", STOPPED),
        (b"qAttached", b"1"),
        (b"qC", b"QC1"),
        (b"qfThreadInfo", b"m1"),
        (b"qsThreadInfo", b"l"),
        (b"Hg0", OK),
        (b"T1", OK),
        (b"T2", MALFORMED),
        (b"vCont?", b"vCont;c;C;s;S"),
        (b"vMustReplyEmpty", b""),
        (b"qTStatus", b""),
        (b"", b""),
        (b"!", b""),
    ],
)
def test_packet_gets_documented_answer(gdb: Debugger, packet: bytes, reply: bytes) -> None:
    assert gdb.ask(packet) == reply


def test_acknowledgements_can_be_switched_off(gdb: Debugger) -> None:
    assert gdb.session.acknowledged
    assert gdb.ask(b"QStartNoAckMode") == OK
    assert not gdb.session.acknowledged


def test_monitor_commands_print_on_console(gdb: Debugger) -> None:
    gdb.session.handle(b"qRcmd," + b"time".hex().encode())

    assert gdb.commands == ["time"]
    assert gdb.sent == [b"O" + b"done: time\n".hex().encode(), OK]


# -- registers and memory -----------------------------------------------------------------------------------


def test_registers_are_little_endian_words_in_order(gdb: Debugger) -> None:
    gdb.target.registers |= {"r1": 0x11223344, "s2": 0xAABBCCDD, "s3": 0x01020304, "control": 7}

    everything = gdb.ask(b"g")

    assert len(everything) == 2 * sum(register.size for register in REGISTERS)
    assert everything[8:16] == b"44332211"
    assert everything.endswith(b"07000000")
    d1 = [register.name for register in REGISTERS].index("d1")
    assert gdb.ask(b"p%x" % d1) == b"ddccbbaa04030201"


@given(st.binary(min_size=4 * 40 + 4 * 16, max_size=4 * 40 + 4 * 16))
def test_written_registers_are_read_back(data: bytes) -> None:
    gdb = Debugger(FakeTarget())
    data = data[: sum(register.size for register in REGISTERS)]

    assert gdb.ask(b"G" + data.hex().encode()) == OK
    assert gdb.ask(b"g") == data.hex().encode()


def test_one_register_is_written(gdb: Debugger) -> None:
    assert gdb.ask(b"Pf=78563412") == OK
    assert gdb.target.registers["pc"] == 0x12345678


@pytest.mark.parametrize("packet", [b"p28", b"p", b"pzz", b"P0=00", b"P0", b"P99=00000000", b"G00", b"Gxy"])
def test_unknown_register_is_refused(gdb: Debugger, packet: bytes) -> None:
    assert gdb.ask(packet) == MALFORMED


@pytest.mark.parametrize("packet", [b"M%x,4:01027d2a", b"X%x,4:\x01\x02\x7d\x2a"])
def test_memory_is_written_and_read(gdb: Debugger, packet: bytes) -> None:
    assert gdb.ask(packet % RAM) == OK
    assert gdb.ask(b"m%x,6" % RAM) == b"01027d2a0000"


def test_memory_read_stops_at_end_of_memory(gdb: Debugger) -> None:
    assert gdb.ask(b"m%x,8" % (RAM + RAM_SIZE - 2)) == b"0000"
    assert gdb.ask(b"m60000000,4") == REFUSED
    assert gdb.ask(b"M60000000,1:00") == REFUSED
    assert len(gdb.ask(b"m%x,ffff" % RAM)) <= LONGEST


@pytest.mark.parametrize(
    "packet",
    [b"m", b"m,", b"m0", b"mffffffff,2", b"m100000000,1", b"m-1,4", b"M20000000,2:00", b"X20000000,1"],
)
def test_impossible_range_is_refused(gdb: Debugger, packet: bytes) -> None:
    assert gdb.ask(packet) == MALFORMED


def test_program_is_loaded_into_flash(gdb: Debugger) -> None:
    """GDB manual, "Packets": vFlashErase, vFlashWrite, vFlashDone."""
    gdb.target.flash[:] = bytes(FLASH_SIZE)

    assert gdb.ask(b"vFlashErase:%08x,00008000" % FLASH) == OK
    assert gdb.ask(b"vFlashWrite:%x:a:b;c" % (FLASH + 4)) == OK
    assert gdb.ask(b"vFlashDone") == OK

    assert gdb.target.flash[:10] == b"\xff\xff\xff\xffa:b;c\xff"
    assert gdb.target.flash[0x7FFF:0x8001] == b"\xff\x00"
    assert gdb.ask(b"vFlashErase:%x,4" % RAM) == REFUSED
    assert gdb.ask(b"vFlashErase:0,ffffffff") == REFUSED
    assert gdb.ask(b"vFlashWrite:%x:ab" % (FLASH + FLASH_SIZE - 1)) == REFUSED


# -- running ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("packet", [b"s", b"vCont;s:1;c", b"S05", b"vCont;s"])
def test_step_executes_one_instruction(gdb: Debugger, packet: bytes) -> None:
    assert gdb.go(packet) == STOPPED
    assert gdb.target.registers["pc"] == START + 2
    assert gdb.target.now_ps == INSTRUCTION_PS


@pytest.mark.parametrize("packet", [b"c", b"vCont;c", b"vCont;c:-1", b"C05"])
@pytest.mark.parametrize("kind", [b"0", b"1"])
def test_breakpoint_stops_before_its_instruction(gdb: Debugger, packet: bytes, kind: bytes) -> None:
    assert gdb.ask(b"Z%s,%x,2" % (kind, START + 8)) == OK

    assert gdb.go(packet) == STOPPED
    assert gdb.target.registers["pc"] == START + 8
    assert gdb.go(packet) == STOPPED  # once round the loop
    assert gdb.target.now_ps == (4 + (LOOP_END - START) // 2 + 1) * INSTRUCTION_PS


def test_removed_breakpoint_does_not_stop(gdb: Debugger) -> None:
    for packet in (b"Z1,%x,2", b"Z1,%x,2", b"z1,%x,2"):
        assert gdb.ask(packet % (START + 8)) == OK

    assert gdb.go(b"c") == b""
    assert not gdb.session.halted


def test_breakpoint_kind_is_reported_if_supported(gdb: Debugger) -> None:
    gdb.ask(b"qSupported:swbreak+;hwbreak+")
    gdb.ask(b"Z1,%x,2" % (START + 2))

    assert gdb.go(b"c") == b"T05hwbreak:;thread:1;"
    assert gdb.ask(b"?") == b"T05hwbreak:;thread:1;"


@pytest.mark.parametrize(("kind", "word"), [(b"2", b"watch"), (b"4", b"awatch")])
def test_watchpoint_stops_after_access(gdb: Debugger, kind: bytes, word: bytes) -> None:
    gdb.target.stores[START + 6] = RAM + 0x12
    assert gdb.ask(b"Z%s,%x,4" % (kind, RAM + 0x10)) == OK

    assert gdb.go(b"c") == b"T05%s:20000012;thread:1;" % word
    assert gdb.target.registers["pc"] == START + 8


def test_execution_continues_at_given_address(gdb: Debugger) -> None:
    assert gdb.go(b"s%x" % (START + 0x20)) == STOPPED
    assert gdb.target.registers["pc"] == START + 0x22


def test_running_target_is_silent_until_control_c(gdb: Debugger) -> None:
    assert gdb.go(b"c") == b""
    gdb.session.handle(b"g")
    assert not gdb.sent
    gdb.session.interrupt()
    gdb.session.interrupt()  # already halted

    assert gdb.sent == [b"T02thread:1;"]
    assert gdb.ask(b"?") == b"T02thread:1;"


def test_failure_is_printed_and_halts_target(gdb: Debugger) -> None:
    gdb.session.handle(b"c")
    gdb.session.stopped(HaltReason(failure="HardFault in main"))

    assert gdb.sent == [b"O" + b"HardFault in main\n".hex().encode(), b"T0bthread:1;"]
    assert gdb.session.halted


@pytest.mark.parametrize(
    "packet",
    [b"Z1,8000000", b"Z1,8000000,x", b"Z2,20000000,0", b"Z2,20000000,101", b"vCont;x", b"vCont;s:7", b"cxyz"],
)
def test_impossible_request_is_refused_and_stays_halted(gdb: Debugger, packet: bytes) -> None:
    assert gdb.ask(packet) == MALFORMED
    assert gdb.session.halted


def test_unknown_kind_of_breakpoint_is_not_supported(gdb: Debugger) -> None:
    assert gdb.ask(b"Z5,8000000,2") == b""


def test_number_of_breakpoints_is_limited(gdb: Debugger) -> None:
    replies = [gdb.ask(b"Z1,%x,2" % (FLASH + 2 * number)) for number in range(1001)]

    assert replies[:1000] == [OK] * 1000
    assert replies[1000] == REFUSED


@pytest.mark.parametrize(
    ("packet", "ending", "sent"),
    [
        (b"D", DebuggerExit.DETACHED, [OK]),
        (b"k", DebuggerExit.KILLED, []),
        (b"vKill;1", DebuggerExit.KILLED, [OK]),
    ],
)
def test_detaching_or_killing_removes_breakpoints(
    gdb: Debugger, packet: bytes, ending: DebuggerExit, sent: list[bytes]
) -> None:
    gdb.ask(b"Z0,%x,2" % START)
    assert gdb.target.points == {Point(PointKind.SOFTWARE_BREAK, START, 2)}
    gdb.sent.clear()

    gdb.session.handle(packet)
    gdb.session.close()

    assert (gdb.session.ended, gdb.sent) == (ending, sent)
    assert not gdb.target.points
    assert not gdb.session.halted


# -- hostile debuggers --------------------------------------------------------------------------------------

ARGUMENT = st.one_of(
    st.binary(max_size=60),
    st.text("0123456789abcdef,:;=-", max_size=40).map(str.encode),
    st.from_regex(rb"[0-9a-f]{1,9},[0-9a-f]{1,9}(:[0-9a-f]*)?", fullmatch=True),
)
PACKETS = st.builds(
    lambda verb, argument: verb + argument,
    st.sampled_from(
        [
            *(bytes((verb,)) for verb in VERBS),
            *(b"qRcmd,", b"qXfer:features:read:target.xml:", b"qXfer:", b"vCont;", b"vFlashErase:"),
            *(b"vFlashWrite:", b"Z0,", b"Z2,", b"z1,", b"qSupported:"),
        ]
    ),
    ARGUMENT,
)


@given(st.lists(PACKETS, max_size=20))
def test_every_packet_is_answered_while_halted(packets: list[bytes]) -> None:
    gdb = Debugger(FakeTarget())
    for packet in packets:
        gdb.sent.clear()
        gdb.session.handle(packet)
        assert gdb.sent or not gdb.session.halted or gdb.session.ended
        assert all(len(reply) <= LONGEST for reply in gdb.sent)
        gdb.session.interrupt()


@given(st.binary(max_size=500))
def test_framer_output_is_bounded_by_its_input(data: bytes) -> None:
    assert len(Framer().feed(data)) <= len(data)
