"""USART1 as HAL V1.6.0 uses it, and the arrival of its bytes at the terminal (RM0368 section 19)."""

from __future__ import annotations

from collections.abc import Iterable
from fractions import Fraction

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fcu_emulator.emulator.buses.uart import Uart
from fcu_emulator.emulator.chip.peripherals.usart import ConnectedUsarts, Usart, wire_terminal
from fcu_emulator.emulator.clock import NEVER_PS, PS_PER_MS, PS_PER_S, PS_PER_US
from fcu_emulator.emulator.trace import TerminalBytes
from tests.support.arm.chip_fakes import NativeChip
from tests.support.arm.comm_bench import ACCESS_PS, FakeProcessor

SR, DR, BRR, CR1, CR2, CR3 = 0x00, 0x04, 0x08, 0x0C, 0x10, 0x14
ORE, IDLE, RXNE, TC, TXE = 1 << 3, 1 << 4, 1 << 5, 1 << 6, 1 << 7
RE, TE, IDLEIE, RXNEIE, TCIE, TXEIE = 1 << 2, 1 << 3, 1 << 4, 1 << 5, 1 << 6, 1 << 7
UE, OVER8 = 1 << 13, 1 << 15
DMAR, DMAT = 1 << 6, 1 << 7
USART1_IRQ, DMA2_STREAM7_IRQ = 37, 70
RAM = 0x2000_0000
FRAME_PS = Fraction(10 * 729 * PS_PER_S, 84_000_000)  # BRR 0x2D9
delays = st.lists(st.sampled_from([0, 0, 20 * PS_PER_US, 200 * PS_PER_US]), max_size=60)


class Bench(FakeProcessor):
    """USART1 with a terminal. Before each access, one of ``delays`` passes. The access takes ``ACCESS_PS``."""

    def __init__(self, delays: Iterable[int] = ()) -> None:
        chip = NativeChip()
        super().__init__(chip, chip.irq, delays)
        self.clock, self.trace, self.clocks = chip.clock, chip.trace, chip.clocks
        self.uart = Uart("USART1", chip.clock, chip.trace, 84_000_000)
        ConnectedUsarts(chip.fcu, {"USART1": self.uart})
        wire_terminal(chip.fcu, "USART1", ("A", 9, 7))
        chip.fcu.set_alternate("A", 9, 7)
        block = chip["USART1"]
        assert isinstance(block, Usart)
        self.usart1, self.dma2 = block, chip["DMA2"]
        self.ram = chip.fcu.ram

    @property
    def text(self) -> str:
        return self.uart.received().decode("latin-1")

    def notes(self) -> list[str]:
        return [f"{what}: {text}" for what, text in self.chip.notes()]


def started(delays: Iterable[int] = (), brr: int = 0x2D9, cr1: int = 0) -> Bench:
    """Return the bench after HAL_UART_Init: 115200 8N1, with transmitter and receiver enabled."""
    bench = Bench(delays)
    bench.write(bench.usart1, BRR, brr)
    bench.write(bench.usart1, CR1, TE | RE | cr1)
    bench.write(bench.usart1, CR1, UE | TE | RE | cr1)
    return bench


def send(bench: Bench, value: int) -> None:
    bench.poll(bench.usart1, SR, TXE)
    bench.write(bench.usart1, DR, value)


def frame_ps(bench: Bench) -> int:
    """Return the duration of a frame on the idle line: TXE is set immediately, TC at the end of the frame."""
    send(bench, 0x55)
    return bench.usart1.next_change_ps() - bench.clock.now_ps


def transmit(bench: Bench, data: bytes) -> None:
    """Transmit as HAL_UART_Transmit does."""
    for value in data:
        send(bench, value)
    bench.poll(bench.usart1, SR, TC)


@settings(max_examples=40, deadline=None)
@given(st.binary(min_size=1, max_size=30), delays)
def test_polled_transmission_delivers_every_byte_in_order(data: bytes, delays: list[int]) -> None:
    bench = started(delays)
    transmit(bench, data)
    assert bench.text == data.decode("latin-1")


def test_frames_are_sent_without_gap_or_drift() -> None:
    bench = started()
    bench.trace.record_all()
    transmit(bench, bytes(100))
    starts = [event.t_ps for event in bench.trace.of(TerminalBytes)]
    assert starts == [starts[0] + int(number * FRAME_PS) for number in range(100)]
    done_ps = starts[0] + int(100 * FRAME_PS)
    assert done_ps <= bench.clock.now_ps < done_ps + 2 * ACCESS_PS


def test_transmission_of_two_bytes_sets_flags_in_order() -> None:
    """19.3.2: TXE is set when the byte moves to the shift register, TC when the line is idle."""
    bench = started()
    assert bench.read(bench.usart1, SR) & (TXE | TC) == TXE | TC
    bench.write(bench.usart1, DR, 0x41)
    first_ps = bench.clock.now_ps
    assert bench.read(bench.usart1, SR) & (TXE | TC) == TXE
    bench.write(bench.usart1, DR, 0x42)
    assert bench.read(bench.usart1, SR) & (TXE | TC) == 0
    assert bench.usart1.next_change_ps() == first_ps + int(FRAME_PS)
    bench.chip.run_to(first_ps + int(FRAME_PS))
    assert bench.usart1.read(SR) & (TXE | TC) == TXE
    bench.chip.run_to(first_ps + int(2 * FRAME_PS) - 1)
    assert bench.usart1.read(SR) & (TXE | TC) == TXE
    bench.chip.run_to(first_ps + int(2 * FRAME_PS))
    assert bench.usart1.read(SR) & (TXE | TC) == TXE | TC
    assert bench.usart1.next_change_ps() == NEVER_PS


def test_tc_is_cleared_by_writing_zero_to_it() -> None:
    """19.6.1. HAL_UART_Transmit_DMA clears TC in this way before it sets DMAT."""
    bench = started()
    bench.write(bench.usart1, SR, ~TC)
    assert bench.read(bench.usart1, SR) & (TXE | TC) == TXE
    transmit(bench, b"x")


def test_tc_stays_set_without_sr_read_before_dr() -> None:
    """19.6.1: the sequence that clears TC is a read of SR, then a write of DR."""
    bench = started()
    bench.write(bench.usart1, DR, 0x41)
    assert bench.read(bench.usart1, SR) & TC
    bench.wait(PS_PER_MS)
    bench.write(bench.usart1, DR, 0x42)
    assert not bench.read(bench.usart1, SR) & TC


def test_polled_sending_schedules_no_event() -> None:
    bench = started()
    transmit(bench, b"Hello")
    assert bench.chip.next_ps == NEVER_PS


@settings(max_examples=30, deadline=None)
@given(st.binary(min_size=1, max_size=30))
def test_interrupt_driven_transmission_sends_all_bytes(data: bytes) -> None:
    """HAL_UART_Transmit_IT: TXEIE for each byte, then TCIE."""
    bench = started()
    left, done = list(data), list[int]()

    def handler() -> None:
        status = bench.read(bench.usart1, SR)
        control = bench.read(bench.usart1, CR1)
        if status & TXE and control & TXEIE:
            bench.write(bench.usart1, DR, left.pop(0))
            if not left:
                bench.modify(bench.usart1, CR1, set_bits=TCIE, clear=TXEIE)
        elif status & TC and control & TCIE:
            bench.modify(bench.usart1, CR1, clear=TCIE)
            done.append(bench.clock.now_ps)

    bench.modify(bench.usart1, CR1, set_bits=TXEIE)
    bench.serve(USART1_IRQ, handler, lambda: bool(done))
    assert bench.text == data.decode("latin-1")
    assert not bench.irq.level(USART1_IRQ)


def test_transmission_interrupts_come_with_flags() -> None:
    bench = started()
    send(bench, 1)
    start_ps = bench.clock.now_ps
    send(bench, 2)
    bench.modify(bench.usart1, CR1, set_bits=TXEIE)
    bench.wait(PS_PER_MS)
    bench.modify(bench.usart1, CR1, clear=TXEIE)
    send(bench, 3)
    last_ps = bench.clock.now_ps
    bench.modify(bench.usart1, CR1, set_bits=TCIE)
    bench.wait(PS_PER_MS)
    times = [time for time, number in bench.irq.rises if number == USART1_IRQ]
    assert times == [start_ps + int(FRAME_PS), last_ps + int(FRAME_PS)]


def test_dma_transmission_sends_all_bytes() -> None:
    """HAL_UART_Transmit_DMA: DMA2 stream 7 channel 4 (RM0368 table 29)."""
    bench = started()
    text = b"Pitch: 0.000000 deg"
    bench.ram[: len(text)] = text
    stream = 0x10 + 0x18 * 7
    for offset, value in [(4, len(text)), (8, 0x4001_1004), (12, RAM)]:
        bench.write(bench.dma2, stream + offset, value)
    bench.write(bench.dma2, stream, 4 << 25 | 1 << 10 | 1 << 6 | 1 << 4 | 1)
    bench.write(bench.usart1, SR, ~TC)
    bench.modify(bench.usart1, CR3, set_bits=DMAT)
    start_ps = bench.clock.now_ps
    bench.wait(10 * PS_PER_MS)
    assert bench.text == text.decode()
    assert bench.read(bench.usart1, SR) & TC
    # the last byte goes to DR when the one before the one before has left
    assert bench.irq.rises == [(start_ps + int((len(text) - 2) * FRAME_PS), DMA2_STREAM7_IRQ)]


# -- rate -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("brr", "cr1", "ticks"),
    [(0x2D9, 0, 729), (0x222E, 0, 0x222E), (0x5B1, OVER8, 0x5B * 8 + 1)],
)
def test_baud_rate_follows_brr(brr: int, cr1: int, ticks: int) -> None:
    """19.3.4: with OVER8 the fraction has three bits, and a bit has eighths of USARTDIV."""
    bench = started(brr=brr, cr1=cr1)
    assert frame_ps(bench) == 10 * ticks * PS_PER_S // 84_000_000
    assert ("baud-rate" in bench.chip.problems()) is (ticks == 0x222E)


def test_rate_change_applies_to_second_text() -> None:
    bench = started()
    bench.trace.record_all()
    transmit(bench, b"ab")
    bench.write(bench.usart1, BRR, 2 * 0x2D9)
    transmit(bench, b"cd")
    a, b, c, d = (event.t_ps for event in bench.trace.of(TerminalBytes))
    assert (b - a, d - c) == (int(FRAME_PS), int(2 * FRAME_PS))
    assert bench.text == "abcd"
    assert bench.chip.problems()["baud-rate"] == {"baud": 57613, "expected": 115200}


def test_baud_rate_follows_peripheral_clock() -> None:
    """If the PLL does not start, firmware runs from HSI at 16 MHz, with a BRR for 84 MHz."""
    bench = started()
    bench.clocks.set(pclk2_hz=16_000_000)
    assert frame_ps(bench) == 10 * 729 * PS_PER_S // 16_000_000


def test_clock_change_is_reported_at_next_byte() -> None:
    """Firmware runs from HSI for a moment after Stop, and selects the PLL before it prints."""
    bench = started()
    for pclk2_hz in (0, 16_000_000, 84_000_000):
        bench.clocks.set(pclk2_hz=pclk2_hz)
    transmit(bench, b"a")
    assert "baud-rate" not in bench.chip.problems()
    bench.clocks.set(pclk2_hz=16_000_000)
    transmit(bench, b"b")
    assert "baud-rate" in bench.chip.problems()


def test_two_stop_bits_lengthen_frame_and_are_noted() -> None:
    bench = started()
    bench.write(bench.usart1, CR2, 2 << 12)
    assert frame_ps(bench) == 11 * 729 * PS_PER_S // 84_000_000
    assert "frame-format" in bench.chip.problems()


def test_zero_baud_rate_never_sends() -> None:
    bench = started(brr=0)
    send(bench, 1)
    bench.wait(PS_PER_S)
    assert not bench.read(bench.usart1, SR) & TC


def test_transmitter_without_clock_sends_nothing() -> None:
    bench = started()
    bench.clocks.set(pclk2_hz=0)
    send(bench, 1)
    bench.wait(PS_PER_S)
    assert not bench.read(bench.usart1, SR) & TC
    assert bench.text == ""


def test_long_text_without_pause_arrives_completely() -> None:
    """The text is longer than the buffer in C."""
    bench = started()
    text = bytes(32 + number % 90 for number in range(1000))
    transmit(bench, text)
    assert bench.text == text.decode()


# -- what firmware forgets ------------------------------------------------------------------------------


def test_byte_written_before_te_is_sent_after_te() -> None:
    bench = Bench()
    bench.write(bench.usart1, BRR, 0x2D9)
    bench.write(bench.usart1, DR, 0x41)
    bench.wait(PS_PER_MS)
    assert bench.read(bench.usart1, SR) & (TXE | TC) == 0
    assert "written-while-disabled" in bench.chip.problems()
    bench.write(bench.usart1, CR1, UE | TE)
    bench.poll(bench.usart1, SR, TC)
    assert bench.text == "A"


def test_writing_to_full_dr_loses_waiting_byte() -> None:
    bench = started()
    for value in b"abc":
        bench.write(bench.usart1, DR, value)
    bench.wait(PS_PER_MS)
    assert bench.text == "ac"
    assert "data-lost" in bench.chip.problems()


def test_unconnected_pin_sends_nothing() -> None:
    bench = started()
    bench.chip.fcu.set_alternate("A", 9, None)
    transmit(bench, b"unheard")
    assert bench.text == ""
    assert "pins-not-switched" in bench.chip.problems()
    assert any("PA9 to AF7" in text for text in bench.notes())
    bench.chip.fcu.set_alternate("A", 9, 7)
    transmit(bench, b"heard")
    assert bench.text == "heard"


# -- receiver -------------------------------------------------------------------------------------------


def test_polling_receives_typed_bytes() -> None:
    bench = started()
    bench.uart.type(b"hello")
    received = bytearray()
    for _ in range(5):
        bench.poll(bench.usart1, SR, RXNE)
        received.append(bench.read(bench.usart1, DR))
    assert received == b"hello"
    assert not bench.read(bench.usart1, SR) & (RXNE | ORE)


def test_debugger_peek_keeps_unread_byte() -> None:
    bench = started()
    for value in b"a\0\xff":
        bench.uart.type(bytes((value,)))
        bench.poll(bench.usart1, SR, RXNE)

        assert [bench.usart1.peek(DR) for _ in range(2)] == [value] * 2
        assert bench.usart1.peek(SR) & RXNE
        assert bench.read(bench.usart1, DR) == value
        assert not bench.usart1.peek(SR) & RXNE
        assert bench.usart1.peek(DR) == value


def test_unread_byte_is_kept_and_next_is_lost() -> None:
    """19.3.3, overrun: DR keeps the old byte. Reading SR, then DR, clears ORE."""
    bench = started()
    bench.uart.type(b"xyz")
    bench.wait(PS_PER_MS)
    assert bench.read(bench.usart1, SR) & (RXNE | ORE) == RXNE | ORE
    assert bench.read(bench.usart1, DR) == ord("x")
    assert not bench.read(bench.usart1, SR) & (RXNE | ORE)
    assert bench.uart.rx_lost == 2


def test_writing_zero_to_rxne_only_discards_byte() -> None:
    """19.6.1: rc_w0; ORE and IDLE are read-only."""
    bench = started()
    bench.uart.type(b"xy")
    bench.wait(PS_PER_MS)
    before = bench.read(bench.usart1, SR)
    assert before & (RXNE | ORE | TC) == RXNE | ORE | TC
    bench.write(bench.usart1, SR, 0, mask=0xFF00)
    bench.write(bench.usart1, SR, ~IDLE)
    assert bench.read(bench.usart1, SR) == before
    bench.write(bench.usart1, SR, ~RXNE, mask=0xFF)
    assert bench.read(bench.usart1, SR) == before & ~RXNE
    assert bench.read(bench.usart1, DR) != ord("x")


def test_disabled_receiver_receives_nothing() -> None:
    bench = started()
    bench.modify(bench.usart1, CR1, clear=RE)
    bench.uart.type(b"x")
    bench.wait(PS_PER_MS)
    assert not bench.read(bench.usart1, SR) & (RXNE | ORE)


def test_bytes_before_rate_is_set_are_lost() -> None:
    """The terminal sends at a constant rate, which does not depend on the chip."""
    bench = Bench()
    bench.uart.type(b"early")
    bench.wait(PS_PER_MS)
    bench.write(bench.usart1, BRR, 0x2D9)
    bench.write(bench.usart1, CR1, UE | RE)
    bench.uart.type(b"x")
    bench.poll(bench.usart1, SR, RXNE)
    assert bench.read(bench.usart1, DR) == ord("x")
    assert bench.uart.rx_lost == 0


def test_interrupt_driven_reception_reads_every_byte() -> None:
    bench = started()
    bench.modify(bench.usart1, CR1, set_bits=RXNEIE)
    received = bytearray()
    bench.uart.type(b"0123456789")
    bench.serve(
        USART1_IRQ,
        lambda: received.append(bench.read(bench.usart1, DR)),
        lambda: len(received) == 10,
    )
    assert received == b"0123456789"


def test_idle_line_ends_reception_by_dma() -> None:
    """IDLE is set one frame after the last stop bit. DMA2 stream 2 channel 4 reads the bytes."""
    bench = started()
    stream = 0x10 + 0x18 * 2
    for offset, value in [(4, 64), (8, 0x4001_1004), (12, RAM)]:
        bench.write(bench.dma2, stream + offset, value)
    bench.write(bench.dma2, stream, 4 << 25 | 1 << 10 | 1)
    bench.modify(bench.usart1, CR3, set_bits=DMAR)
    bench.modify(bench.usart1, CR1, set_bits=IDLEIE)
    start_ps = bench.clock.now_ps
    bench.uart.type(b"abc")
    bench.wait(PS_PER_MS)
    assert bench.ram[:4] == b"abc\0"
    assert bench.read(bench.dma2, stream + 4) == 61
    (rise,) = bench.irq.rises
    assert (rise[1], abs(rise[0] - start_ps - int(4 * FRAME_PS)) < 10) == (USART1_IRQ, True)
    assert bench.read(bench.usart1, SR) & IDLE
    bench.read(bench.usart1, DR)
    assert not bench.read(bench.usart1, SR) & IDLE
    assert not bench.irq.level(USART1_IRQ)
