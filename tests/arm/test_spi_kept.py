"""If the chip keeps bytes of the sensors on SPI2, the bytes, messages and times stay the same.

The oracle is a bench on which no bytes are kept: Python answers each byte at its time.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from itertools import groupby
from unittest.mock import patch

from hypothesis import given, settings
from hypothesis import strategies as st

from fcu_emulator.emulator.chip.library import FcuChip
from fcu_emulator.emulator.chip.sensor_registers import Targets
from fcu_emulator.emulator.clock import PS_PER_MS, PS_PER_US
from fcu_emulator.emulator.trace import BusTransfer, RegisterWrite
from fcu_emulator.sensors.lps22hb.output import OutputTrain
from fcu_emulator.sensors.sampling import OutputWords
from fcu_emulator.sensors.spi import SpiTarget
from tests.arm.test_spi_master import BIDIOE, CR1, LIS2MDL, LPS22HB, LSM6DSL, SPE, StSpi, put, three_wire
from tests.support.arm.comm_bench import CommBench

OUTPUTS = [(LSM6DSL, 0x20, 14), (LIS2MDL, 0x68, 6), (LPS22HB, 0x28, 5)]
STATUS = [(LSM6DSL, 0x1E), (LIS2MDL, 0x67), (LPS22HB, 0x27)]


def measuring(*, keeps: bool) -> StSpi:
    """Return all three sensors at about 100 Hz with block data update."""
    if keeps:
        spi = three_wire(CommBench())
    else:
        with patch.object(Targets, "add", return_value=-1):
            spi = three_wire(CommBench())
    spi.write(LSM6DSL, 0x12, 0x4C)
    spi.write(LSM6DSL, 0x10, 0x40, 0x40)
    spi.write(LIS2MDL, 0x60, 0x8C, 0x00, 0x30)
    spi.write(LPS22HB, 0x10, 0x53)
    return spi


@contextmanager
def no_call_of_python() -> Iterator[None]:
    asked = AssertionError("asked")
    with (
        patch.object(OutputWords, "fill", side_effect=asked),
        patch.object(OutputTrain, "fill", side_effect=asked),
        patch.object(SpiTarget, "read", side_effect=asked),
        patch.object(SpiTarget, "shared_bank", side_effect=asked),
    ):
        yield


@contextmanager
def one_run(spi: StSpi) -> Iterator[None]:
    """Treat the accesses in the block as one run of instructions, during which C does not return."""
    with patch.object(FcuChip, "raise_error", lambda _chip: None):
        yield
    spi.bench.chip.fcu.raise_error()


def read_some(spi: StSpi, where: tuple[tuple[str, int], int, int], first: int, count: int) -> bytes:
    pin, register, size = where
    extra = 0x40 if pin == LIS2MDL else 0
    return spi.read(pin, (register | extra) + first % size, count)


steps = st.one_of(
    st.tuples(st.just("read"), st.sampled_from(OUTPUTS), st.integers(0, 13), st.integers(1, 16)),
    st.tuples(st.just("bytes"), st.sampled_from(OUTPUTS), st.integers(0, 13), st.integers(1, 7)),
    st.tuples(st.just("status"), st.sampled_from(STATUS)),
    st.tuples(st.just("write"), st.sampled_from([(LSM6DSL, 0x73), (LIS2MDL, 0x45)]), st.integers(0, 255)),
    st.tuples(st.just("round"), st.sampled_from([(LSM6DSL, 0x22), (LIS2MDL, 0x45), (LPS22HB, 0x28)])),
    st.tuples(st.just("bdu"), st.booleans()),
    st.tuples(st.just("increment"), st.booleans()),
    st.tuples(st.just("turn"), st.integers(-80, 80)),
    st.tuples(st.just("wait"), st.sampled_from([10 * PS_PER_US, PS_PER_MS, 9 * PS_PER_MS])),
    st.tuples(st.just("look")),
)


OUTSIDE = ("turn", "look")


def turn_round(spi: StSpi, pin: tuple[str, int], register: int) -> bytes:
    """Write during a read, and then continue the read, which no driver does."""
    bench = spi.bench
    put(bench, pin, 0)
    spi._send(register | 0x80)
    data = []
    for _ in range(2):
        bench.modify(bench.spi2, CR1, clear=SPE | BIDIOE)
        data += [spi._receive() for _ in range(2)]
        bench.modify(bench.spi2, CR1, set_bits=BIDIOE)
        bench.modify(bench.spi2, CR1, set_bits=SPE)
        spi._send(0x55)
    put(bench, pin, 1)
    return bytes(data)


def carry_out(spi: StSpi, step: tuple[object, ...]) -> object:
    bench, seen = spi.bench, None
    match step:
        case "read", tuple(where), int(first), int(count):
            seen = read_some(spi, where, first, count)
        case "bytes", tuple(where), int(first), int(count):  # one byte a message, as ST's drivers do
            seen = b"".join(read_some(spi, where, first + n, 1) for n in range(count))
        case "status", (tuple(pin), int(register)):
            seen = spi.read(pin, register, 1)
        case "write", (tuple(pin), int(register)), int(value):
            spi.write(pin, register, value)
        case "bdu", bool(on):
            spi.write(LSM6DSL, 0x12, 0x4C if on else 0x0C)
        case "increment", bool(on):
            spi.write(LPS22HB, 0x11, 0x10 if on else 0x00)
        case "turn", int(degrees):
            bench.board.world.set_attitude(roll_deg=degrees, pitch_deg=5, yaw_deg=30)
        case "round", (tuple(pin), int(register)):
            seen = turn_round(spi, pin, register)
        case "wait", int(duration_ps):
            bench.wait(duration_ps)
        case ("look",):
            seen = bench.spi_bus.recent_transfers()
    return seen


@settings(max_examples=60, deadline=None)
@given(st.lists(steps, max_size=25), st.booleans(), st.booleans())
def test_kept_and_live_bytes_have_equal_times(
    steps: list[tuple[object, ...]], detailed: bool, runs: bool
) -> None:
    kept, live = measuring(keeps=True), measuring(keeps=False)
    for spi in (kept, live):
        if detailed:
            spi.bench.trace.record_all()
    for outside, some in groupby([*steps, ("look",)], lambda step: step[0] in OUTSIDE):
        with nullcontext() if outside or not runs else one_run(kept):
            for step in some:
                assert carry_out(kept, step) == carry_out(live, step)
    assert kept.bench.clock.now_ps == live.bench.clock.now_ps
    for kind in (BusTransfer, RegisterWrite):
        assert kept.bench.trace.of(kind) == live.bench.trace.of(kind)
    for one, other in zip(kept.bench.board.sensors.parts, live.bench.board.sensors.parts, strict=True):
        assert one.read(0x0F if one.NAME != "LIS2MDL" else 0x4F, 1, kept.bench.clock.now_ps)
        assert bytes(one.registers.mem) == bytes(other.registers.mem), one.NAME


def test_read_of_kept_bytes_needs_no_python_calls() -> None:
    """Data-ready is cleared and each word is read once. Afterwards the chip has all bytes and needs no call."""
    spi = measuring(keeps=True)
    spi.bench.wait(25 * PS_PER_MS)

    def read_all() -> list[bytes]:  # in bursts, and one byte a message, as ST's drivers do
        bursts = [read_some(spi, where, 0, where[2]) for where in OUTPUTS]
        return [
            *bursts,
            *(spi.read(LSM6DSL, 0x28 + n) for n in range(6)),
        ]

    with one_run(spi):
        read_all()
        seen = read_all()
        with no_call_of_python():
            for _ in range(3):
                assert read_all() == seen


def test_single_byte_messages_need_no_python_calls() -> None:
    """ST's driver of the LPS22HB clears IF_ADD_INC. The pressure is held from the first to the last byte."""
    spi = measuring(keeps=True)
    spi.write(LPS22HB, 0x11, 0x00)
    spi.bench.wait(25 * PS_PER_MS)

    def read_pressure() -> list[bytes]:
        return [spi.read(LPS22HB, 0x28 + n) for n in range(3)]

    with one_run(spi):
        read_pressure()
        seen = read_pressure()
        with no_call_of_python():
            for _ in range(3):
                assert read_pressure() == seen
        assert spi.read(LPS22HB, 0x29, 4) == 4 * seen[1]
        assert read_pressure() == seen


def test_recent_kept_and_live_messages_are_in_order() -> None:
    spi = measuring(keeps=True)
    bench = spi.bench
    for n in range(3):
        spi.read(LSM6DSL, 0x0F)
        spi.write(LIS2MDL, 0x45, n)
        spi.read(LIS2MDL, 0x45)
    transfers = bench.spi_bus.recent_transfers()
    assert len(transfers) == 8
    assert [(one.written, one.read) for one in transfers[-3:]] == [
        (b"\x8f", b"\x6a"),
        (b"\x45\x02", b""),
        (b"\xc5", b"\x02"),
    ]
    times = [(one.t_ps, one.end_ps) for one in transfers]
    assert times == sorted(times)
    assert times[-1][1] <= bench.clock.now_ps


def test_message_longer_than_kept_bytes_is_complete() -> None:
    """Registers that only store a value are read around the wrap: 128 sub-addresses, 300 bytes."""
    kept, live = measuring(keeps=True), measuring(keeps=False)
    assert kept.read(LIS2MDL, 0x45, 300) == live.read(LIS2MDL, 0x45, 300)
    (transfer,) = kept.bench.spi_bus.recent_transfers()[-1:]
    assert len(transfer.read) == 300


def test_unaddressed_bytes_are_kept_for_diagnosis() -> None:
    spi = measuring(keeps=True)
    for value in range(10):
        spi._send(value)
    spi.bench.spi_bus.recent_transfers()
    assert [value for _, value in spi.bench.spi_bus.unaddressed] == list(range(2, 10))


def test_full_duplex_read_ignores_sensor_on_three_wires() -> None:
    """In full duplex the chip reads MISO, so it does not receive a sensor on three wires."""
    spi = measuring(keeps=True)
    bench = spi.bench
    assert spi.read(LIS2MDL, 0x4F) == b"\x40"
    bench.write(bench.spi2, 0x00, 0x031F)
    bench.write(bench.spi2, 0x00, 0x035F)
    put(bench, LIS2MDL, 0)
    for value in (0xCF, 0):
        bench.write(bench.spi2, 0x0C, value)
        bench.poll(bench.spi2, 0x08, 1)
        answer = bench.read(bench.spi2, 0x0C)
    put(bench, LIS2MDL, 1)
    assert answer == 0xFF
    for value in (0, 0x831F, 0xC31F, 0xC35F):
        bench.write(bench.spi2, 0x00, value)
    assert spi.read(LIS2MDL, 0x4F) == b"\x40"


def test_two_selected_sensors_combine_their_bytes_by_and() -> None:
    """Both sensors have WHO_AM_I at 0x0F, with 0x6A and 0xB1."""
    spi = measuring(keeps=True)
    for first, second in ((LSM6DSL, LPS22HB), (LPS22HB, LSM6DSL)):
        put(spi.bench, first, 0)
        assert spi.read(second, 0x0F) == b"\x20"
        put(spi.bench, first, 1)
    assert spi.read(LSM6DSL, 0x0F) == b"\x6a"
