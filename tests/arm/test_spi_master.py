"""SPI2 as ST's sensor driver and HAL V1.6.0 use it (RM0368 section 20)."""

from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fcu_emulator import Board
from fcu_emulator.emulator.clock import NEVER_PS, PS_PER_MS, PS_PER_S, PS_PER_US
from fcu_emulator.emulator.trace import BusTransfer, DeviceNote
from fcu_emulator.sensors.spi import SpiTarget
from tests.support.arm.comm_bench import RAM, CommBench
from tests.support.words import Words

CR1, CR2, SR, DR = 0x00, 0x04, 0x08, 0x0C  # RM0368 20.5
MSTR, SPE, LSBFIRST, SSI, SSM, DFF = 1 << 2, 1 << 6, 1 << 7, 1 << 8, 1 << 9, 1 << 11
BIDIOE, BIDIMODE = 1 << 14, 1 << 15
RXDMAEN, TXDMAEN, RXNEIE, TXEIE = 1 << 0, 1 << 1, 1 << 6, 1 << 7
RXNE, TXE, MODF, OVR, BSY = 1 << 0, 1 << 1, 1 << 5, 1 << 6, 1 << 7
LSM6DSL, LIS2MDL, LPS22HB = ("A", 8), ("B", 12), ("C", 13)
SPI2_IRQ = 36
BYTE_PS = 8 * 16 * PS_PER_S // 42_000_000
THREE_WIRE = 0x831F  # BIDIMODE, SSM, SSI, /16, MSTR, mode 3: what ST's firmware writes
FULL_DUPLEX = 0x031F
delays = st.lists(st.sampled_from([0, 0, 2 * PS_PER_US, 40 * PS_PER_US]), max_size=100)


def output(bench: CommBench, pin: tuple[str, int]) -> None:
    """Make a pin a push-pull output (MODER, 8.4.1)."""
    port, number = pin
    bench.chip[f"GPIO{port}"].write(0x00, 1 << 2 * number, 3 << 2 * number)


def put(bench: CommBench, pin: tuple[str, int], level: int) -> None:
    """Set the level of a pin (BSRR, 8.4.7)."""
    port, number = pin
    bench.chip[f"GPIO{port}"].write(0x18, 1 << number if level else 1 << number + 16)


class StSpi:
    """The driver of the board's stock firmware: three wires, and one byte for each pulse of SPE."""

    def __init__(self, bench: CommBench) -> None:
        self.bench = bench
        for pin in (LSM6DSL, LIS2MDL, LPS22HB):
            output(bench, pin)
            put(bench, pin, 1)
        for value in (0, THREE_WIRE, THREE_WIRE | BIDIOE, THREE_WIRE | BIDIOE | SPE):
            bench.write(bench.spi2, CR1, value)

    def write(self, pin: tuple[str, int], register: int, *data: int) -> None:
        put(self.bench, pin, 0)
        for value in (register, *data):
            self._send(value)
        put(self.bench, pin, 1)

    def read(self, pin: tuple[str, int], register: int, count: int = 1) -> bytes:
        bench, spi = self.bench, self.bench.spi2
        put(bench, pin, 0)
        self._send(register | 0x80)
        bench.modify(spi, CR1, clear=SPE)
        bench.modify(spi, CR1, clear=BIDIOE)
        data = bytes(self._receive() for _ in range(count))
        put(bench, pin, 1)
        bench.modify(spi, CR1, set_bits=BIDIOE)
        bench.modify(spi, CR1, set_bits=SPE)
        return data

    def _send(self, value: int) -> None:
        self.bench.poll(self.bench.spi2, SR, TXE)
        self.bench.write(self.bench.spi2, DR, value, 0xFF)
        self.bench.poll(self.bench.spi2, SR, TXE)
        self.bench.poll_clear(self.bench.spi2, SR, BSY)

    def _receive(self) -> int:
        bench, spi = self.bench, self.bench.spi2
        bench.modify(spi, CR1, set_bits=SPE)
        bench.wait(67 * PS_PER_S // 84_000_000)  # 67 DSB
        bench.modify(spi, CR1, clear=SPE)
        bench.poll(spi, SR, RXNE)
        value = bench.read(spi, DR)
        bench.poll_clear(spi, SR, BSY)
        return value


def receive_two(bench: CommBench, wait_ps: int) -> int:
    """Disable a receiving SPI ``wait_ps`` after its first byte; return the number of bytes (20.3.8)."""
    spi = three_wire(bench)
    put(bench, LSM6DSL, 0)
    spi._send(0x8F)
    bench.modify(bench.spi2, CR1, clear=SPE)
    bench.modify(bench.spi2, CR1, clear=BIDIOE)
    bench.modify(bench.spi2, CR1, set_bits=SPE)
    bench.poll(bench.spi2, SR, RXNE)
    bench.wait(wait_ps)
    bench.modify(bench.spi2, CR1, clear=SPE)
    received = [bench.read(bench.spi2, DR)]
    bench.wait(2 * BYTE_PS)
    if bench.read(bench.spi2, SR) & RXNE:
        received.append(bench.read(bench.spi2, DR))
    put(bench, LSM6DSL, 1)
    assert received[0] == 0x6A
    return len(received)


def test_last_byte_arrives_if_spe_is_cleared_late() -> None:
    """20.3.8: wait for the next to last RXNE, then one SPI clock cycle, clear SPE, wait for the last RXNE."""
    assert receive_two(CommBench(), BYTE_PS // 8) == 2


def test_reception_ends_if_spe_is_cleared_immediately() -> None:
    assert receive_two(CommBench(), 0) == 1


def three_wire(bench: CommBench) -> StSpi:
    """Set all three parts to three wires by a blind write, as the stock firmware's boot does."""
    spi = StSpi(bench)
    spi.write(LSM6DSL, 0x12, 0x0C)
    spi.write(LPS22HB, 0x10, 0x01)
    return spi


def test_sensor_identities_are_read() -> None:
    spi = three_wire(CommBench())
    assert spi.read(LSM6DSL, 0x0F) == b"\x6a"
    assert spi.read(LIS2MDL, 0x4F) == b"\x40"
    assert spi.read(LPS22HB, 0x0F) == b"\xb1"


@settings(max_examples=40, deadline=None)
@given(
    st.sampled_from([(LIS2MDL, 0x45), (LSM6DSL, 0x0D), (LPS22HB, 0x0C)]),
    st.binary(min_size=1, max_size=4),
    st.integers(1, 12),
    delays,
)
def test_three_wire_bytes_equal_those_of_sensor(
    where: tuple[tuple[str, int], int], data: bytes, count: int, delays: list[int]
) -> None:
    """The oracle sends each message as a whole to :class:`SpiTarget`."""
    pin, register = where
    spi = three_wire(CommBench(delays))
    spi.write(pin, register, *data)
    seen = spi.read(pin, register, count)
    board = Board(wiring="fcu001v1", ideal=True)
    part = board.sensors.parts[(LSM6DSL, LIS2MDL, LPS22HB).index(pin)]
    target = SpiTarget(part, lambda: 0)
    for message in (
        b"\x12\x0c" if pin == LSM6DSL else b"\x10\x01" if pin == LPS22HB else b"",
        bytes([register]) + data,
    ):
        target.select()
        target.write(message, 3)
    target.select()
    target.write(bytes([register | 0x80]), 3)
    assert seen == target.read(count, 3, 3)


def test_byte_takes_eight_clock_periods() -> None:
    """ST's firmware has 42 MHz / 16. BSY and RXNE show the end of a byte, and polling firmware needs no event."""
    bench = CommBench()
    spi = three_wire(bench)
    assert bench.spi_bus.speed_hz == 2_625_000
    bench.write(bench.spi2, DR, 0x00)
    start_ps = bench.clock.now_ps
    assert bench.next_ps == NEVER_PS
    assert bench.read(bench.spi2, SR) & (TXE | BSY) == TXE | BSY
    bench.write(bench.spi2, DR, 0x00)
    assert bench.read(bench.spi2, SR) & (TXE | BSY) == BSY
    bench.chip.run_to(start_ps + BYTE_PS - 1)
    assert bench.spi2.read(SR) & (TXE | BSY) == BSY
    bench.chip.run_to(start_ps + BYTE_PS)
    assert bench.spi2.read(SR) & (TXE | BSY) == TXE | BSY
    bench.chip.run_to(start_ps + 2 * BYTE_PS - 1)
    assert bench.spi2.read(SR) & (TXE | BSY) == TXE | BSY
    bench.chip.run_to(start_ps + 2 * BYTE_PS)
    assert bench.spi2.read(SR) == TXE
    assert spi.read(LIS2MDL, 0x4F) == b"\x40"


def test_message_is_recorded_between_chip_select_edges() -> None:
    bench = CommBench()
    spi = three_wire(bench)
    bench.trace.record_all()
    start_ps = bench.clock.now_ps
    spi.read(LIS2MDL, 0x4F)
    (event,) = bench.trace.of(BusTransfer)
    assert (event.bus, event.device, event.register) == ("SPI2", "LIS2MDL", "WHO_AM_I")
    assert (event.written, event.read) == (b"\xcf", b"\x40")
    assert event.t_ps == start_ps
    assert 2 * BYTE_PS < event.end_ps - start_ps < 3 * BYTE_PS


def test_spe_pulse_sends_one_byte() -> None:
    bench = CommBench()
    spi = three_wire(bench)
    put(bench, LIS2MDL, 0)
    spi._send(0x4F | 0x80)
    bench.write(bench.spi2, CR1, THREE_WIRE)
    for pulse_ps in (PS_PER_US, PS_PER_MS):
        bench.write(bench.spi2, CR1, THREE_WIRE | SPE)
        assert not bench.read(bench.spi2, SR) & BSY
        bench.wait(pulse_ps)
        bench.write(bench.spi2, CR1, THREE_WIRE)
        bench.poll(bench.spi2, SR, RXNE)
        bench.read(bench.spi2, DR)
        bench.wait(PS_PER_MS)
        assert not bench.read(bench.spi2, SR) & (RXNE | OVR)


def test_read_of_dr_while_enabled_starts_next_byte() -> None:
    bench = CommBench()
    spi = three_wire(bench)
    spi.write(LIS2MDL, 0x45, 1, 2, 3, 4)
    put(bench, LIS2MDL, 0)
    spi._send(0x45 | 0x80)
    bench.write(bench.spi2, CR1, THREE_WIRE)
    bench.write(bench.spi2, CR1, THREE_WIRE | SPE)
    received = []
    for _ in range(4):
        bench.poll(bench.spi2, SR, RXNE)
        received.append(bench.read(bench.spi2, DR))
    assert received == [1, 2, 3, 4]


# -- full duplex ----------------------------------------------------------------------------------------


def four_wire(bench: CommBench, extra: int = 0) -> None:
    """Return the LIS2MDL on four wires (CFG_REG_C.4WSPI), and SPI2 in full duplex."""
    spi = StSpi(bench)
    spi.write(LIS2MDL, 0x62, 0x04)
    bench.write(bench.spi2, CR1, 0)
    bench.write(bench.spi2, CR1, FULL_DUPLEX | extra | SPE)


def exchange(bench: CommBench, data: bytes) -> bytes:
    """HAL_SPI_TransmitReceive, polled."""
    received = bytearray()
    for value in data:
        bench.poll(bench.spi2, SR, TXE)
        bench.write(bench.spi2, DR, value)
        bench.poll(bench.spi2, SR, RXNE)
        received.append(bench.read(bench.spi2, DR))
    bench.poll_clear(bench.spi2, SR, BSY)
    return bytes(received)


def test_full_duplex_messages_write_and_read_registers() -> None:
    bench = CommBench()
    four_wire(bench)
    put(bench, LIS2MDL, 0)
    assert exchange(bench, b"\xcf\0")[1:] == b"\x40"
    put(bench, LIS2MDL, 1)
    put(bench, LIS2MDL, 0)
    exchange(bench, b"\x45\x11\x22\x33")
    put(bench, LIS2MDL, 1)
    put(bench, LIS2MDL, 0)
    assert exchange(bench, b"\xc5\0\0\0")[1:] == b"\x11\x22\x33"


def test_first_full_duplex_message_reads_sensor() -> None:
    """After power-on the LSM6DSL has four wires, and SPI2 has sent nothing before."""
    bench = CommBench()
    put(bench, LSM6DSL, 1)  # before it is an output, so that the sensor sees no edge
    output(bench, LSM6DSL)
    bench.write(bench.spi2, CR1, FULL_DUPLEX | SPE)
    put(bench, LSM6DSL, 0)
    assert exchange(bench, b"\x8f\0")[1:] == b"\x6a"


def test_unread_frame_causes_overrun() -> None:
    """20.3.10: the later frame is lost. Reading DR, then SR, clears OVR."""
    bench = CommBench()
    four_wire(bench)
    put(bench, LIS2MDL, 0)
    for value in (0xCF, 0):
        bench.poll(bench.spi2, SR, TXE)
        bench.write(bench.spi2, DR, value)
    bench.wait(PS_PER_MS)
    assert bench.read(bench.spi2, SR) & (RXNE | OVR) == RXNE | OVR
    assert bench.read(bench.spi2, DR) == 0xFF  # the first: nobody drives MISO during the command
    assert bench.read(bench.spi2, SR) & (RXNE | OVR) == OVR
    assert bench.read(bench.spi2, SR) & (RXNE | OVR) == 0


def test_sixteen_bit_frame_sends_upper_byte_first() -> None:
    bench = CommBench()
    four_wire(bench, DFF)
    put(bench, LIS2MDL, 0)
    bench.write(bench.spi2, DR, 0xCF00)
    start_ps = bench.clock.now_ps
    bench.chip.run_to(start_ps + 2 * BYTE_PS - 1)
    assert not bench.spi2.read(SR) & RXNE
    bench.chip.run_to(start_ps + 2 * BYTE_PS)
    assert bench.spi2.read(SR) & RXNE
    bench.poll(bench.spi2, SR, RXNE)
    assert bench.read(bench.spi2, DR) & 0xFF == 0x40


def test_lsb_first_reverses_bits_of_every_byte() -> None:
    bench = CommBench()
    four_wire(bench, LSBFIRST)
    put(bench, LIS2MDL, 0)
    assert exchange(bench, b"\xf3\0")[1:] == b"\x02"  # 0xCF and 0x40 mirrored


@pytest.mark.parametrize("mode", [1, 2])
def test_sensor_ignores_clock_modes_1_and_2(mode: int) -> None:
    bench = CommBench()
    four_wire(bench)
    bench.write(bench.spi2, CR1, 0)
    bench.write(bench.spi2, CR1, FULL_DUPLEX & ~3 | mode | SPE)
    assert bench.spi_bus.mode == mode
    put(bench, LIS2MDL, 0)
    assert exchange(bench, b"\xcf\0")[1:] == b"\xff"


def test_interrupts_drive_full_duplex_message() -> None:
    """HAL_SPI_TransmitReceive_IT."""
    bench = CommBench()
    four_wire(bench)
    put(bench, LIS2MDL, 0)
    out, received = [0xCF, 0, 0], bytearray()

    def handler() -> None:
        status = bench.read(bench.spi2, SR)
        if status & RXNE:
            received.append(bench.read(bench.spi2, DR))
        elif status & TXE and out:
            bench.write(bench.spi2, DR, out.pop(0))
            if not out:
                bench.modify(bench.spi2, CR2, clear=TXEIE)

    bench.modify(bench.spi2, CR2, set_bits=TXEIE | RXNEIE)
    bench.serve(SPI2_IRQ, handler, lambda: len(received) == 3)
    assert received[1] == 0x40


def test_dma_sends_and_receives_full_duplex_message() -> None:
    """HAL_SPI_TransmitReceive_DMA: DMA1 streams 3 and 4, channel 0 (RM0368 table 28)."""
    bench = CommBench()
    four_wire(bench)
    put(bench, LIS2MDL, 0)
    bench.ram[:4] = b"\xcf\0\0\0"
    for stream, address, direction in [(3, RAM + 0x40, 0), (4, RAM, 1 << 6)]:
        base = 0x10 + 0x18 * stream
        for offset, value in [(4, 4), (8, 0x4000_380C), (12, address)]:
            bench.write(bench.dma1, base + offset, value)
        bench.write(bench.dma1, base, direction | 1 << 10 | 1)
    bench.modify(bench.spi2, CR2, set_bits=RXDMAEN)
    bench.modify(bench.spi2, CR2, set_bits=TXDMAEN)
    bench.wait(5 * BYTE_PS)
    assert bench.ram[0x41] == 0x40
    assert bench.dma1.read(0) >> 22 & 0x20
    assert not bench.read(bench.spi2, SR) & (OVR | BSY)


# -- what goes wrong ------------------------------------------------------------------------------------


def test_two_low_chip_selects_are_noted() -> None:
    bench = CommBench()
    spi = three_wire(bench)
    put(bench, LSM6DSL, 0)
    spi.read(LIS2MDL, 0x4F)
    assert "chip-selects-conflict" in bench.problems()
    assert any("PA8 and PB12" in text for text in bench.notes())


def test_low_chip_selects_without_clock_are_not_noted() -> None:
    """Firmware sets up its pins, and each output is low until firmware sets it."""
    bench = CommBench()
    for pin in (LSM6DSL, LIS2MDL, LPS22HB):
        output(bench, pin)
    for pin in (LSM6DSL, LIS2MDL, LPS22HB):
        put(bench, pin, 1)
    three_wire(bench).read(LIS2MDL, 0x4F)
    assert bench.notes() == []


def test_early_rise_of_chip_select_discards_byte() -> None:
    """The firmware does not wait for BSY."""
    bench = CommBench()
    spi = three_wire(bench)
    put(bench, LIS2MDL, 0)
    spi._send(0x45)
    bench.write(bench.spi2, DR, 0x77)
    put(bench, LIS2MDL, 1)
    bench.wait(PS_PER_MS)
    assert spi.read(LIS2MDL, 0x45) == b"\0"


def test_completed_byte_is_accepted_without_polling() -> None:
    """The firmware counts instead of waiting for BSY, so only time passes between DR and the edge."""
    bench = CommBench()
    spi = three_wire(bench)
    put(bench, LIS2MDL, 0)
    spi._send(0x45)
    bench.write(bench.spi2, DR, 0x77)
    bench.clock.now_ps += 2 * BYTE_PS
    bench.chip.fcu.shared[0] = bench.clock.now_ps  # as the core does: it stops for events only
    put(bench, LIS2MDL, 1)
    assert spi.read(LIS2MDL, 0x45) == b"\x77"


def test_master_with_low_nss_has_mode_fault() -> None:
    """20.3.10: MODF clears SPE and MSTR. Reading SR and then writing CR1 clears it."""
    bench = CommBench()
    bench.write(bench.spi2, CR1, SSM | MSTR | SPE)
    assert bench.read(bench.spi2, SR) & MODF
    assert not bench.read(bench.spi2, CR1) & (SPE | MSTR)
    bench.write(bench.spi2, CR1, SSM | SSI | MSTR)
    assert not bench.read(bench.spi2, SR) & MODF


@pytest.mark.parametrize(
    ("value", "problem", "data"),
    [
        (SSM | SSI | SPE, "slave-mode", {}),
        (SSM | SSI | MSTR | SPE, "sck-too-fast", {"sck_mhz": 21, "max_mhz": 10}),
        (SSM | SSI | MSTR | 1 << 13, "crc", {}),
        (MSTR | SPE | 3 << 3, "nss-input", {}),
    ],
)
def test_unmodelled_or_too_fast_setting_is_noted(
    value: int, problem: str, data: dict[str, object], words: Words
) -> None:
    bench = CommBench()
    bench.write(bench.spi2, CR1, value)
    assert bench.problems()[problem] == data
    words("chip", "\n".join(bench.notes()))


def test_nss_as_output_is_not_noted() -> None:
    """20.5.2: the bit is SSOE."""
    bench = CommBench()
    bench.write(bench.spi2, CR2, 1 << 2)
    bench.write(bench.spi2, CR1, MSTR | SPE | 3 << 3)
    assert bench.notes() == []


def test_overwritten_frame_in_dr_is_noted() -> None:
    bench = CommBench()
    bench.write(bench.spi2, CR1, SSM | SSI | MSTR | SPE | 3 << 3)
    for value in (0, 1):  # the first is shifted out, the second waits
        bench.write(bench.spi2, DR, value)
    assert bench.notes() == []
    bench.write(bench.spi2, DR, 2)
    assert bench.problems() == {"data-lost": {}}


def test_pins_without_alternate_function_are_unconnected() -> None:
    bench = CommBench()
    bench.chip.fcu.set_alternate("B", 15, None)
    assert three_wire(bench).read(LIS2MDL, 0x4F) == b"\xff"
    assert "pins-not-switched" in bench.problems()
    assert any("PB15 to AF5" in text for text in bench.notes())


def test_absent_bluenrg_keeps_its_interrupt_low() -> None:
    """ST's firmware must read a header other than 0x02, with PA4 low."""
    bench = CommBench()
    spi1 = bench.spi1
    bench.write(spi1, CR1, SSM | SSI | MSTR | 2 << 3 | SPE)
    output(bench, ("B", 0))
    for value in (0x0B, 0, 0, 0, 0):
        bench.poll(spi1, SR, TXE)
        bench.write(spi1, DR, value)
        bench.poll(spi1, SR, RXNE)
        assert bench.read(spi1, DR) == 0xFF
    assert bench.chip.gpio.reads("A", 4) == 0
    assert [note.device for note in bench.trace.of(DeviceNote)] == ["BlueNRG"]


def test_bidirectional_bits_equal_manual() -> None:
    """20.5.1. CR1 has the values 0x831F, 0xC31F and 0xC35F on the real board."""
    assert (THREE_WIRE & BIDIMODE, THREE_WIRE | BIDIOE, THREE_WIRE | BIDIOE | SPE) == (0x8000, 0xC31F, 0xC35F)
