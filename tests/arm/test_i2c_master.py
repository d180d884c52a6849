"""I2C2 as HAL V1.6.0 uses it, compared with whole transfers of the same bus (RM0368 section 18)."""

from __future__ import annotations

from collections.abc import Callable

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fcu_emulator.emulator.buses.i2c import FaultKind, I2CFault
from fcu_emulator.emulator.chip.peripherals.peripheral import NOT_CACHEABLE_PS
from fcu_emulator.emulator.clock import NEVER_PS, PS_PER_MS, PS_PER_S, PS_PER_US
from fcu_emulator.emulator.errors import I2CNackError
from fcu_emulator.emulator.trace import BusTransfer
from tests.support.arm.comm_bench import RAM, CommBench
from tests.support.arm.hal_i2c import (
    ADDR,
    AF,
    ARLO,
    BERR,
    BTF,
    BUSY,
    CCR,
    CR1,
    CR2,
    DR,
    ERROR_IRQ,
    ITERREN,
    MSL,
    OAR1,
    PE,
    RXNE,
    SB,
    SR1,
    SR2,
    START,
    STOP,
    SWRST,
    TRA,
    TRISE,
    TXE,
    HalError,
    HalI2c,
)
from tests.support.words import Words

LSM6DSL, LIS2MDL, LPS22HB, MEMORY = 0x6B, 0x1E, 0x5D, 0x42
FOREVER = 1 << 62
counts = st.integers(1, 40)
delays = st.lists(st.sampled_from([0, 0, 0, 5 * PS_PER_US, 30 * PS_PER_US, 300 * PS_PER_US]), max_size=200)


class MemoryChip:
    """A memory of 256 different bytes with a sub-address that increments, so that a lost or repeated byte is visible."""

    def __init__(self) -> None:
        self.bytes = bytearray((7 * index + 3) & 0xFF for index in range(256))
        self.address = 0
        self._expects_address = False

    def start(self, *, read: bool) -> bool:
        self._expects_address = not read
        return True

    def write(self, data: bytes) -> int:
        for value in data:
            if self._expects_address:
                self.address, self._expects_address = value, False
            else:
                self.bytes[self.address] = value
                self.address = self.address + 1 & 0xFF
        return len(data)

    def read(self, count: int) -> bytes:
        data = bytes(self.bytes[self.address + index & 0xFF] for index in range(count))
        self.address = self.address + count & 0xFF
        return data

    def stop(self) -> None:
        self._expects_address = False

    def read_from(self, subaddress: int, count: int, now_ps: int) -> bytes | None:
        self.address = subaddress
        return self.read(count)

    def name(self) -> str:
        return "memory"

    def register_name(self, address: int) -> str:
        return f"0x{address:02X}"


def bench_with_memory(delays: list[int] | None = None) -> tuple[CommBench, HalI2c, MemoryChip]:
    bench = CommBench(delays or ())
    memory = MemoryChip()
    bench.board.i2c2.bus.attach(MEMORY, memory)
    return bench, HalI2c(bench), memory


def whole_read(register: int, count: int) -> tuple[bytes, int]:
    """Read in one whole transfer. Return the data and the sub-address after the transfer."""
    bench, _, memory = bench_with_memory()
    return bench.board.i2c2.bus.transfer(MEMORY, bytes((register,)), count), memory.address


@pytest.mark.parametrize(("address", "register", "identity"), [(LSM6DSL, 0x0F, 0x6A), (LPS22HB, 0x0F, 0xB1)])
def test_sensor_identity_is_read(address: int, register: int, identity: int) -> None:
    assert HalI2c(CommBench()).mem_read(address, register, 1) == bytes([identity])


@pytest.mark.parametrize("count", [1, 2, 3, 4, 5, 6, 7, 14])
def test_polled_read_equals_whole_transfer(count: int) -> None:
    """HAL V1.6.0 ends a read of 1, 2, 3 and more bytes in four different ways (RM0368 18.3.3)."""
    _, hal, memory = bench_with_memory()
    assert (hal.mem_read(MEMORY, 0x28, count), memory.address) == whole_read(0x28, count)
    hal.wait_idle()


@settings(max_examples=60, deadline=None)
@given(counts, delays)
def test_delays_neither_lose_nor_repeat_bytes(count: int, delays: list[int]) -> None:
    _, hal, memory = bench_with_memory(delays)
    assert (hal.mem_read(MEMORY, 0x10, count), memory.address) == whole_read(0x10, count)
    assert hal.mem_read(MEMORY, 0x80, 3) == whole_read(0x80, 3)[0]


@settings(max_examples=30, deadline=None)
@given(counts, delays)
def test_interrupt_driven_read_equals_whole_transfer(count: int, delays: list[int]) -> None:
    _, hal, memory = bench_with_memory(delays)
    memory.address = 0x33
    data = hal.receive_interrupt(MEMORY, count)
    assert (data, memory.address) == whole_read(0x33, count)
    hal.wait_idle()


@settings(max_examples=30, deadline=None)
@given(st.binary(min_size=1, max_size=20), delays)
def test_write_equals_whole_transfer(data: bytes, delays: list[int]) -> None:
    _, hal, memory = bench_with_memory(delays)
    other, _, oracle = bench_with_memory()
    hal.mem_write(MEMORY, 0xF0, data)
    hal.wait_idle()
    other.board.i2c2.bus.transfer(MEMORY, bytes((0xF0,)) + data)
    assert (memory.bytes, memory.address) == (oracle.bytes, oracle.address)


RX_STREAM, TX_STREAM = 0x10 + 0x18 * 3, 0x10 + 0x18 * 7
"""DMA1 streams 3 and 7 on channel 7: I2C2_RX and I2C2_TX (RM0368 table 28)."""
ON = 7 << 25 | 1 << 10 | 1 << 4 | 1  # channel 7, MINC, TCIE, EN


def start_stream(bench: CommBench, stream: int, count: int, direction: int = 0) -> None:
    for offset, value in [(4, count), (8, 0x4000_5810), (12, RAM)]:
        bench.write(bench.dma1, stream + offset, value)
    bench.write(bench.dma1, stream, ON | direction)


@pytest.mark.parametrize("count", [2, 3, 6, 14])
def test_dma_with_last_bit_reads_all_bytes(count: int) -> None:
    """RM0368 18.3.7: with LAST, the final byte of the DMA transfer is not acknowledged."""
    bench, hal, memory = bench_with_memory()
    start_stream(bench, RX_STREAM, count)
    hal.mem_read_dma_address(MEMORY, 0x55)
    bench.serve(
        14, lambda: bench.write(bench.dma1, 0x08, 0x3D << 22), lambda: not bench.dma1.peek(RX_STREAM + 4)
    )
    hal.mem_read_dma_complete()
    hal.wait_idle()
    assert (bytes(bench.ram[:count]), memory.address) == whole_read(0x55, count)


@pytest.mark.parametrize("count", [1, 2, 9])
def test_dma_write_equals_whole_transfer(count: int) -> None:
    """RM0368 18.3.7: TxE requests each byte. After the last byte BTF is set, and firmware sends STOP."""
    bench, hal, memory = bench_with_memory()
    data = bytes(range(0xA0, 0xA0 + count))
    bench.ram[:count] = data
    hal.mem_write_dma_address(MEMORY, 0x20)
    start_stream(bench, TX_STREAM, count, direction=1 << 6)
    hal.mem_write_dma_data()
    bench.serve(47, lambda: None, lambda: bench.irq.level(47))
    assert bench.dma1.peek(4) >> 22 & 0x30 == (0x30 if count > 1 else 0x20)  # HISR: HTIF7, TCIF7
    hal.mem_write_dma_complete()
    hal.wait_idle()
    assert (bytes(memory.bytes[0x20 : 0x20 + count]), memory.address) == (data, 0x20 + count)


@pytest.mark.parametrize("moved", [1, 3])
def test_stopping_dma_stream_pauses_i2c_read(moved: int) -> None:
    """RM0368 9.3.15, 18.3.3: the next byte waits in DR with RxNE. Firmware can read it, send a NACK and stop."""
    bench, hal, _ = bench_with_memory()
    start_stream(bench, RX_STREAM, 6)
    hal.mem_read_dma_address(MEMORY, 0x55)
    while bench.dma1.peek(RX_STREAM + 4) > 6 - moved:
        bench.wait(PS_PER_US)
    bench.write(bench.dma1, RX_STREAM, ON & ~1)
    bench.wait(200 * PS_PER_US)
    assert bench.dma1.read(RX_STREAM) & 1 == 0
    assert bench.dma1.read(RX_STREAM + 4) == 6 - moved
    assert bench.dma1.read(0) >> 22 & 0x20  # LISR: TCIF3
    assert bench.i2c2.peek(SR1) & (RXNE | BTF) == RXNE | BTF
    hal.mem_read_dma_complete()
    rest = [bench.read(bench.i2c2, DR) for _ in range(2)]
    hal.wait_idle()
    expected = whole_read(0x55, moved + 2)[0]
    assert bytes(bench.ram[:moved]) + bytes(rest) == expected
    assert not any(bench.ram[moved : moved + 6])


def test_transfer_with_prompt_firmware_takes_wire_time() -> None:
    """Six bytes at 400 kHz: start, three address bytes, restart, data, stop, and the time of the software."""
    bench, hal, _ = bench_with_memory()
    bench.trace.record_all()
    hal.mem_read(MEMORY, 0, 6)
    hal.wait_idle()
    (event,) = bench.trace.of(BusTransfer)
    on_the_wire_ps = (1 + 9 + 9 + 1 + 9 + 54 + 1) * PS_PER_S // 400_000
    assert 0 <= event.end_ps - event.t_ps - on_the_wire_ps < 10 * PS_PER_US
    assert (event.device, event.register, event.written, event.result) == ("memory", "0x00", b"\0", "ok")


@pytest.mark.parametrize(
    ("ccr", "trise", "speed_hz"),
    [
        (0x8000 | 35, 13, 400_000),  # fast, duty 2: 3 x 35 periods of 42 MHz
        (0xC000 | 4, 13, 420_000),  # fast, duty 16/9: 25 x 4
        (210, 43, 100_000),  # standard: 2 x 210
    ],
)
def test_scl_frequency_follows_ccr(ccr: int, trise: int, speed_hz: int) -> None:
    """RM0368 18.6.8."""
    bench, hal, _ = bench_with_memory()
    bench.write(bench.i2c2, CR1, 0)
    bench.write(bench.i2c2, CCR, ccr)
    bench.write(bench.i2c2, TRISE, trise)
    bench.write(bench.i2c2, CR1, PE)
    assert bench.board.i2c2.bus.speed_hz == speed_hz
    start_ps = bench.clock.now_ps
    hal.mem_read(MEMORY, 0, 30)
    hal.wait_idle()
    bits = 30 + 9 * 30
    assert (
        bits * PS_PER_S // speed_hz
        < bench.clock.now_ps - start_ps
        < bits * PS_PER_S * 1.05 // speed_hz + 10**7
    )
    too_fast = {"scl-too-fast": {"scl_khz": 420, "max_khz": 400}}
    assert bench.problems() == (too_fast if speed_hz > 404_000 else {})


@pytest.mark.parametrize(
    ("register", "value", "problem", "data"),
    [
        (TRISE, 2, "trise-wrong", {"trise": 2, "fits": 13}),
        (CR2, 16, "freq-wrong", {"freq_mhz": 16, "pclk1_mhz": 42}),
        (CR2, 3, "pclk1-too-slow", {"mode": "fast", "freq_mhz": 3, "min_mhz": 4}),
        (CCR, 0x8000 | 3, "ccr-too-small", {"ccr": 3}),
        (CCR, 0xC000, "ccr-too-small", {"ccr": 0}),
    ],
)
def test_forbidden_setting_is_noted(
    register: int, value: int, problem: str, data: dict[str, object], words: Words
) -> None:
    bench, _, _ = bench_with_memory()
    bench.modify(bench.i2c2, CR1, clear=PE)
    bench.write(bench.i2c2, register, value)
    bench.modify(bench.i2c2, CR1, set_bits=PE)
    bench.modify(bench.i2c2, CR1, set_bits=START)
    bench.wait(PS_PER_MS)
    assert bench.problems()[problem] == data
    words("chip", "\n".join(bench.notes()))


@pytest.mark.parametrize(
    ("cr2", "ccr", "trise"),
    [(42, 0x8000 | 35, 13), (4, 0x8000 | 4, 2), (2, 10, 3), (10, 0xC000 | 1, 4), (2, 4, 3)],
)
def test_settings_at_manuals_limits_are_not_noted(cr2: int, ccr: int, trise: int) -> None:
    """18.6.2, 18.6.8, 18.6.9: SCL stays below the sensors' 400 kHz at these limits. The oscillator has an error."""
    bench, _, _ = bench_with_memory()
    bench.clocks.set(pclk1_hz=cr2 * 1_000_150, nominal_pclk1_hz=cr2 * 1_000_000)
    for register, value in ((CR1, 0), (CR2, cr2), (CCR, ccr), (TRISE, trise), (CR1, PE), (CR1, PE | START)):
        bench.write(bench.i2c2, register, value)
    bench.wait(PS_PER_MS)
    assert bench.problems().keys() <= {"scl-too-fast"}


@pytest.mark.parametrize(("register", "name"), [(CCR, "CCR"), (TRISE, "TRISE")])
def test_setting_changed_while_enabled_is_noted_once(register: int, name: str) -> None:
    """18.6.8, 18.6.9: the setting can be changed only while PE = 0."""
    bench, _, _ = bench_with_memory()
    value = bench.read(bench.i2c2, register)
    for _ in range(2):
        bench.write(bench.i2c2, register, value)
    assert bench.problems() == {"written-while-enabled": {"register": name}}
    bench.write(bench.i2c2, CR1, 0)
    bench.write(bench.i2c2, register, value)
    assert len(bench.notes()) == 1


def test_freq_of_fractional_pclk1_is_rounded() -> None:
    """18.6.2: FREQ has whole megahertz, and ST's HAL rounds 10.5 MHz down."""
    bench, _, _ = bench_with_memory()
    bench.clocks.set(pclk1_hz=10_500_000)
    for register, value in ((CR1, 0), (CR2, 10), (TRISE, 4), (CR1, PE), (CR1, PE | START)):
        bench.write(bench.i2c2, register, value)
    assert bench.notes() == []


def addressed_for_writing() -> CommBench:
    """Return a state in which the memory has acknowledged its address, and DR is empty."""
    bench, _, _ = bench_with_memory()
    bench.modify(bench.i2c2, CR1, set_bits=START)
    bench.poll(bench.i2c2, SR1, SB)
    bench.write(bench.i2c2, DR, MEMORY << 1)
    bench.poll(bench.i2c2, SR1, ADDR)
    bench.read(bench.i2c2, SR2)
    return bench


def test_transmitter_address_sets_addr_and_txe_together() -> None:
    """Figure 163 (EV6, EV8_1); ST's older library waits for BUSY, MSL, ADDR, TXE and TRA."""
    bench, _, memory = bench_with_memory()
    bench.modify(bench.i2c2, CR1, set_bits=START)
    bench.poll(bench.i2c2, SR1, SB)
    bench.write(bench.i2c2, DR, MEMORY << 1)
    assert bench.poll(bench.i2c2, SR1, ADDR) == ADDR | TXE
    assert bench.read(bench.i2c2, SR2) == MSL | BUSY | TRA
    assert bench.read(bench.i2c2, SR1) == TXE
    bench.write(bench.i2c2, DR, 0x31)
    bench.poll(bench.i2c2, SR1, BTF)
    assert memory.address == 0x31


def test_receiver_address_sets_only_addr() -> None:
    bench, _, _ = bench_with_memory()
    bench.modify(bench.i2c2, CR1, set_bits=START)
    bench.poll(bench.i2c2, SR1, SB)
    bench.write(bench.i2c2, DR, MEMORY << 1 | 1)
    assert bench.poll(bench.i2c2, SR1, ADDR) == ADDR


@pytest.mark.parametrize("bit", [START, STOP])
def test_byte_written_after_request_is_dropped(bit: int) -> None:
    """ST's HAL writes a dummy byte after START to end the interrupts of TXE and BTF."""
    bench = addressed_for_writing()
    bench.write(bench.i2c2, DR, 0x31)
    bench.modify(bench.i2c2, CR1, set_bits=bit)
    for _ in range(2):
        bench.write(bench.i2c2, DR, 0)
    bench.wait(PS_PER_MS)
    assert bench.notes() == []
    assert bench.board.i2c2.bus.targets[MEMORY].address == 0x31


def test_overwritten_byte_in_dr_is_noted() -> None:
    bench = addressed_for_writing()
    for value in (0, 1):  # the first goes to the shift register, the second waits
        bench.write(bench.i2c2, DR, value)
    assert bench.notes() == []
    bench.write(bench.i2c2, DR, 2)
    assert bench.problems() == {"data-lost": {}}


@pytest.mark.parametrize("bit", [START, STOP])
def test_stop_before_unsent_byte_is_noted(bit: int) -> None:
    bench = addressed_for_writing()
    for value in (0, 1):
        bench.write(bench.i2c2, DR, value)
    bench.modify(bench.i2c2, CR1, set_bits=bit)
    bench.wait(PS_PER_MS)
    assert bench.problems() == {"stop-early": {}}


def test_sensor_setup_equals_whole_transfers() -> None:
    """One board writes the lab's set-up by registers, another by the board's master. All bytes are compared."""
    setup = [
        (LSM6DSL, 0x12, b"\x44"),
        (LSM6DSL, 0x10, b"\xa8\x6c"),
        (LSM6DSL, 0x17, b"\xe0"),
        (LIS2MDL, 0x60, b"\x8c\x02\x10"),
        (LPS22HB, 0x10, b"\x32\x10"),
    ]
    bench, hal, _ = bench_with_memory()
    other, _, _ = bench_with_memory()
    for address, register, data in setup:
        hal.mem_write(address, register, data)
        other.board.i2c2.write(address, bytes([register]) + data)
    hal.wait_idle()
    parts = zip(bench.board.sensors.parts, other.board.sensors.parts, strict=True)
    assert all(one.registers.mem == two.registers.mem for one, two in parts)
    assert [hal.mem_read(address, register, len(data)) for address, register, data in setup] == [
        data for _, _, data in setup
    ]


# -- what goes wrong ------------------------------------------------------------------------------------


def test_absent_address_sets_af_and_frees_bus() -> None:
    bench, hal, _ = bench_with_memory()
    with pytest.raises(HalError):
        hal.mem_read(0x33, 0, 1)
    hal.wait_idle()
    last = bench.trace.of(BusTransfer)[-1]
    assert (last.address, last.result) == (0x33, str(I2CNackError(0x33, 0)))
    assert hal.mem_read(LSM6DSL, 0x0F, 1) == b"\x6a"
    assert (hal.is_ready(0x33), hal.is_ready(MEMORY)) == (False, True)


def test_refused_byte_keeps_earlier_bytes() -> None:
    bench, hal, memory = bench_with_memory()
    bench.board.i2c2.inject(I2CFault("nack", address=MEMORY, byte_index=3))
    before = bytes(memory.bytes)
    with pytest.raises(HalError):
        hal.mem_write(MEMORY, 0x10, b"\xaa\xbb\xcc\xdd")
    assert bytes(memory.bytes) == before[:0x10] + b"\xaa" + before[0x11:]


def test_stuck_line_is_busy_until_released() -> None:
    """HAL polls SR2.BUSY for 25 ms, then returns HAL_BUSY."""
    bench, hal, _ = bench_with_memory()
    bench.board.i2c2.inject(I2CFault("stuck", 0, 3e-3))
    status, until_ps = bench.i2c2.read_with_validity(SR2)
    assert status & BUSY
    assert until_ps == 3 * PS_PER_MS
    bench.modify(bench.i2c2, CR1, set_bits=START)  # waits for the bus
    bench.poll(bench.i2c2, SR1, SB)
    assert bench.clock.now_ps > 3 * PS_PER_MS
    bench.modify(bench.i2c2, CR1, set_bits=STOP)
    assert hal.mem_read(LSM6DSL, 0x0F, 1) == b"\x6a"


@pytest.mark.parametrize(("kind", "flag"), [("bus_error", BERR), ("arbitration", ARLO), ("absent", AF)])
def test_each_error_sets_flag_and_raises_interrupt(kind: FaultKind, flag: int) -> None:
    """RM0368 18.3.4, 18.4."""
    bench, hal, _ = bench_with_memory()
    bench.board.i2c2.inject(I2CFault(kind, 0, 1e-3, address=MEMORY))
    bench.modify(bench.i2c2, CR2, set_bits=ITERREN)
    bench.modify(bench.i2c2, CR1, set_bits=START)
    bench.poll(bench.i2c2, SR1, SB)
    bench.write(bench.i2c2, DR, MEMORY << 1)
    bench.wait(100 * PS_PER_US)
    assert bench.read(bench.i2c2, SR1) & (BERR | ARLO | AF) == flag
    assert bench.irq.level(ERROR_IRQ)
    bench.write(bench.i2c2, SR1, ~flag)
    assert not bench.irq.level(ERROR_IRQ)
    bench.modify(bench.i2c2, CR1, set_bits=STOP)
    bench.wait(PS_PER_MS)
    assert hal.mem_read(MEMORY, 0, 2) == whole_read(0, 2)[0]


def test_pins_without_alternate_function_are_unconnected() -> None:
    bench, hal, _ = bench_with_memory()
    bench.chip.fcu.set_alternate("B", 3, None)
    with pytest.raises(HalError):
        hal.mem_read(LSM6DSL, 0x0F, 1)
    assert "forbidden: no device can answer before the pins are switched: PB3 to AF9" in bench.notes()


def test_sr1_write_clears_only_written_error_flags() -> None:
    """18.6.6: rc_w0; SB, ADDR and BTF are cleared by other accesses."""
    bench, _, _ = bench_with_memory()
    bench.modify(bench.i2c2, CR1, set_bits=START)
    bench.poll(bench.i2c2, SR1, SB)
    bench.write(bench.i2c2, SR1, 0)
    assert bench.read(bench.i2c2, SR1) == SB
    bench.write(bench.i2c2, DR, 0x35 << 1)  # no device has this address
    bench.poll(bench.i2c2, SR1, AF)
    bench.write(bench.i2c2, SR1, 0, mask=0xFF)
    assert bench.read(bench.i2c2, SR1) == AF
    bench.write(bench.i2c2, SR1, 0, mask=0xFF00)
    assert bench.read(bench.i2c2, SR1) == 0


@pytest.mark.parametrize("bits", [SWRST, 0])
def test_bus_is_released_by_reset_and_disable(bits: int) -> None:
    """18.6.1: SWRST, and PE = 0."""
    bench, _, _ = bench_with_memory()
    bench.modify(bench.i2c2, CR1, set_bits=START)
    bench.poll(bench.i2c2, SR1, SB)
    bench.write(bench.i2c2, DR, MEMORY << 1)
    bench.poll(bench.i2c2, SR1, ADDR)
    bench.write(bench.i2c2, CR1, bits)
    assert (bench.read(bench.i2c2, SR1), bench.read(bench.i2c2, SR2)) == (0, 0)
    assert "abandoned" in bench.trace.of(BusTransfer)[-1].result
    assert HalI2c(bench).mem_read(MEMORY, 0, 3) == whole_read(0, 3)[0]


def test_slave_mode_is_noted() -> None:
    bench, _, _ = bench_with_memory()
    bench.write(bench.i2c2, OAR1, 0x4000 | 0x30 << 1)
    assert bench.problems() == {"not-modelled": {}}
    assert "slave mode" in bench.notes()[0]


# -- flags and time -------------------------------------------------------------------------------------


def test_polled_firmware_needs_no_event() -> None:
    """The flags change without an event, because an event would end a run of instructions."""
    bench, hal, _ = bench_with_memory()
    assert bench.next_ps == NEVER_PS
    bench.modify(bench.i2c2, CR1, set_bits=START)
    assert bench.next_ps == NEVER_PS
    assert bench.i2c2.read_with_validity(SR1) == (0, bench.clock.now_ps + PS_PER_S // 400_000)
    bench.poll(bench.i2c2, SR1, SB)
    bench.modify(bench.i2c2, CR1, set_bits=STOP)
    hal.mem_read(MEMORY, 0, 6)
    assert bench.next_ps == NEVER_PS


def test_polling_frequency_does_not_change_events() -> None:
    """A skipped poll must have no effect: one read at the end gives the same result as a thousand reads."""

    def run(look: Callable[[CommBench], None]) -> tuple[int, int]:
        bench, hal, _ = bench_with_memory()
        bench.trace.record_all()
        hal._send_address(MEMORY << 1)
        hal._clear_addr()
        bench.write(bench.i2c2, DR, 0x12)
        look(bench)
        bench.wait(PS_PER_MS - bench.clock.now_ps)
        bench.modify(bench.i2c2, CR1, set_bits=STOP)
        hal.wait_idle()
        (event,) = bench.trace.of(BusTransfer)
        return event.t_ps, event.end_ps

    def look_often(bench: CommBench) -> None:
        for _ in range(300):
            bench.read(bench.i2c2, SR1)

    assert run(look_often) == run(lambda bench: None)


def test_addr_is_cleared_only_by_sr1_then_sr2() -> None:
    """18.6.6: ADDR."""
    bench, _, _ = bench_with_memory()
    bench.modify(bench.i2c2, CR1, set_bits=START)
    bench.poll(bench.i2c2, SR1, SB)
    bench.write(bench.i2c2, DR, MEMORY << 1)
    bench.wait(100 * PS_PER_US)
    bench.read(bench.i2c2, SR2)
    assert bench.read(bench.i2c2, SR1) & ADDR
    assert bench.i2c2.read_with_validity(SR2)[1] == NOT_CACHEABLE_PS
    assert not bench.read(bench.i2c2, SR1) & ADDR
    bench.modify(bench.i2c2, CR1, set_bits=STOP)


def test_full_receiver_stops_clock_until_dr_is_read() -> None:
    """18.3.3, closing a reception: BTF is set with DR and the shift register full, and SCL is low."""
    bench, hal, memory = bench_with_memory()
    memory.address = 0x20
    hal._set(CR1, 1 << 10)
    hal._send_address(MEMORY << 1 | 1)
    hal._clear_addr()
    bench.wait(10 * PS_PER_MS)
    assert bench.read(bench.i2c2, SR1) & (BTF | RXNE) == BTF | RXNE
    assert memory.address == 0x22
    assert bench.read(bench.i2c2, DR) == memory.bytes[0x20]
    assert bench.read(bench.i2c2, SR1) & (BTF | RXNE) == RXNE
    bench.wait(PS_PER_MS)
    assert memory.address == 0x23


def test_start_clears_flags_of_previous_transmission() -> None:
    bench, hal, _ = bench_with_memory()
    hal._send_address(MEMORY << 1)
    hal._clear_addr()
    bench.write(bench.i2c2, DR, 0x12)
    bench.poll(bench.i2c2, SR1, BTF)
    bench.modify(bench.i2c2, CR1, set_bits=START)
    assert bench.poll(bench.i2c2, SR1, SB) == SB
    bench.modify(bench.i2c2, CR1, set_bits=STOP)
