"""DMA1 and DMA2: streams, flags, interrupts, the request tables (RM0368 section 9)."""

from __future__ import annotations

from itertools import product

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.support.arm.chip_fakes import DmaLines, NativeChip

EN, TCIE, HTIE, TEIE = 1, 1 << 4, 1 << 3, 1 << 2
CIRC, PINC, MINC, DBM, CT = 1 << 8, 1 << 9, 1 << 10, 1 << 18, 1 << 19
TO_PERIPHERAL, MEMORY_TO_MEMORY = 1 << 6, 2 << 6
TCIF, HTIF, TEIF = 1 << 5, 1 << 4, 1 << 3
I2C2_RX = 7 << 25  # channel 7 of DMA1 streams 2 and 3
RAM = 0x2000_0000
DEVICE = 0x4000_2800  # the RTC's address: a peripheral in Python


def stream_base(stream: int) -> int:
    return 0x10 + 0x18 * stream


class Register:
    """A data register whose value increases at each read. It stores the written values."""

    def __init__(self) -> None:
        self.value = 0
        self.written: list[tuple[int, int]] = []

    def read(self) -> int:
        self.value += 1
        return self.value * 0x0101_0101


class DmaBench:
    def __init__(self) -> None:
        self.chip = NativeChip()
        self.ram = self.chip.fcu.ram
        self.lines = DmaLines(self.chip.fcu)
        self.device = Register()
        self.chip.fcu.read_python, self.chip.fcu.write_python = self._load, self._store
        self.dma1, self.dma2 = self.chip["DMA1"], self.chip["DMA2"]

    def _load(self, address: int, size: int) -> int:
        assert address & 0xFFFF_FC00 == DEVICE
        return self.device.read() & (1 << 8 * size) - 1

    def _store(self, address: int, size: int, value: int) -> None:
        assert address & 0xFFFF_FC00 == DEVICE
        self.device.written.append((value, size))

    def start(
        self, stream: int, control: int, items: int, memory: int = RAM, peripheral: int = DEVICE, dma: int = 1
    ) -> None:
        block = self.dma1 if dma == 1 else self.dma2
        base = stream_base(stream)
        block.write(base + 4, items)
        block.write(base + 8, peripheral)
        block.write(base + 12, memory)
        block.write(base, control)
        block.write(base, control | EN)

    def flags(self, stream: int, dma: int = 1) -> int:
        block = self.dma1 if dma == 1 else self.dma2
        return block.read(4 * (stream >= 4)) >> (0, 6, 16, 22)[stream % 4] & 0x3F

    def requests(self, count: int, line: str = "I2C2_RX") -> int:
        """Return the number of served requests among ``count`` requests."""
        return sum(self.lines.request(line) for _ in range(count))


@settings(max_examples=40, deadline=None)
@given(st.integers(1, 50), st.sampled_from([0, 1, 2]), st.booleans())
def test_items_are_stored_in_order(items: int, size: int, increment: bool) -> None:
    bench = DmaBench()
    bench.start(3, I2C2_RX | (MINC if increment else 0) | size << 11 | size << 13, items)
    assert bench.requests(items + 5) == items
    width = 1 << size
    sent = [bytes([number & 0xFF] * width) for number in range(1, items + 1)]
    expected = b"".join(sent) if increment else sent[-1]
    assert bytes(bench.ram[: len(expected) + 1]) == expected + b"\0"
    assert bench.flags(3) & TCIF
    assert bench.dma1.read(stream_base(3)) & EN == 0
    assert bench.dma1.read(stream_base(3) + 4) == 0


def test_half_and_complete_transfers_raise_interrupts() -> None:
    bench = DmaBench()
    bench.start(3, I2C2_RX | MINC | HTIE | TCIE, 6)
    bench.requests(2)
    assert (bench.flags(3), bench.chip.irq.level(14)) == (0, False)
    bench.requests(1)
    assert (bench.flags(3), bench.chip.irq.level(14)) == (HTIF, True)
    bench.dma1.write(0x08, HTIF << 22)
    assert (bench.flags(3), bench.chip.irq.level(14)) == (0, False)
    bench.requests(3)
    assert (bench.flags(3), bench.chip.irq.level(14)) == (TCIF, True)


def test_transfer_from_memory_uses_register_size() -> None:
    bench = DmaBench()
    bench.ram[:4] = b"\x11\x22\x33\x44"
    bench.start(7, I2C2_RX | TO_PERIPHERAL | MINC | 1 << 11 | 1 << 13, 2)
    assert bench.requests(3, "I2C2_TX") == 2
    assert bench.device.written == [(0x2211, 2), (0x4433, 2)]


def test_packing_is_little_endian() -> None:
    """RM0368 9.3.10: bytes from the peripheral, words in memory, by the FIFO."""
    bench = DmaBench()
    bench.dma1.write(stream_base(3) + 0x14, 0x07)  # FIFO mode, full threshold
    bench.start(3, I2C2_RX | MINC | 2 << 13, 4)
    bench.requests(4)
    assert bytes(bench.ram[:4]) == b"\1\2\3\4"


def test_circular_stream_restarts_without_software() -> None:
    bench = DmaBench()
    bench.start(3, I2C2_RX | MINC | CIRC, 4)
    assert bench.requests(10) == 10
    assert bytes(bench.ram[:5]) == b"\x09\x0a\x07\x08\0"
    assert bench.dma1.read(stream_base(3) + 4) == 2


def test_double_buffer_continues_in_other_memory() -> None:
    bench = DmaBench()
    bench.dma1.write(stream_base(3) + 0x10, RAM + 0x100)
    bench.start(3, I2C2_RX | MINC | DBM, 2)
    bench.requests(3)
    assert bytes(bench.ram[:2]) == b"\1\2"
    assert bench.ram[0x100] == 3
    assert bench.dma1.read(stream_base(3)) & CT


def test_memory_copy_takes_time_and_sets_tc() -> None:
    bench = DmaBench()
    bench.ram[:8] = b"abcdefgh"
    bench.start(0, MEMORY_TO_MEMORY | PINC | MINC | TCIE, 8, memory=RAM + 0x40, peripheral=RAM, dma=2)
    assert bench.flags(0, dma=2) == 0
    bench.chip.run_for(10_000_000)
    assert bytes(bench.ram[0x40:0x48]) == b"abcdefgh"
    assert bench.flags(0, dma=2) & TCIF
    assert bench.chip.irq.rises == [(8 * 4 * 10**12 // 84_000_000, 56)]


def test_unmapped_address_ends_stream_with_te() -> None:
    bench = DmaBench()
    bench.start(3, I2C2_RX | MINC | TEIE, 4, memory=0x6000_0000)
    bench.requests(2)
    assert bench.flags(3) == TEIF
    assert bench.chip.irq.level(14)
    assert not bench.dma1.read(stream_base(3)) & EN


def test_request_is_served_only_by_enabled_stream() -> None:
    bench = DmaBench()
    assert not bench.lines.request("I2C2_RX")
    bench.start(3, I2C2_RX | MINC, 1)
    assert bench.lines.remaining("I2C2_RX") == 1
    assert bench.requests(2) == 1


def test_stopped_stream_serves_no_request_and_sets_tc() -> None:
    """RM0368 9.3.15: TCIF shows that the transfer in progress has ended."""
    bench = DmaBench()
    bench.start(3, I2C2_RX | MINC, 4)
    bench.requests(1)
    bench.dma1.write(stream_base(3), I2C2_RX | MINC)
    assert bench.requests(1) == 0
    assert bench.flags(3) == TCIF
    assert bench.dma1.read(stream_base(3) + 4) == 3


def test_circular_stream_stopped_midway_keeps_remaining_count() -> None:
    """RM0368 9.3.15: EN reads 0, NDTR has the number of remaining items, and TCIF requests the interrupt."""
    bench = DmaBench()
    bench.start(3, I2C2_RX | MINC | CIRC | TCIE, 6)
    bench.requests(8)
    bench.dma1.write(0x08, 0x3D << 22)
    bench.dma1.write(stream_base(3), I2C2_RX | MINC | CIRC | TCIE)
    assert bench.requests(3) == 0
    assert bench.dma1.read(stream_base(3)) == I2C2_RX | MINC | CIRC | TCIE
    assert bench.dma1.read(stream_base(3) + 4) == 4
    assert bench.flags(3) == TCIF
    assert bench.chip.irq.level(14)
    assert bytes(bench.ram[:7]) == b"\7\x08\3\4\5\6\0"


def test_stopped_stream_resumes_with_new_address_and_count() -> None:
    """RM0368 9.3.15: software writes the remaining number to NDTR and the next address to M0AR."""
    bench = DmaBench()
    bench.start(3, I2C2_RX | MINC, 4)
    bench.requests(1)
    bench.dma1.write(stream_base(3), I2C2_RX | MINC)
    bench.dma1.write(0x08, 0x3D << 22)
    bench.start(3, I2C2_RX | MINC, bench.dma1.read(stream_base(3) + 4), memory=RAM + 1)
    assert bench.requests(5) == 3
    assert bytes(bench.ram[:5]) == b"\1\2\3\4\0"
    assert bench.flags(3) & TCIF


def test_stopped_memory_copy_moves_nothing_more() -> None:
    bench = DmaBench()
    bench.ram[:4] = b"abcd"
    bench.start(0, MEMORY_TO_MEMORY | PINC | MINC, 4, memory=RAM + 0x40, peripheral=RAM, dma=2)
    bench.dma2.write(stream_base(0), MEMORY_TO_MEMORY | PINC | MINC)
    bench.chip.run_for(10_000_000)
    assert bench.flags(0, dma=2) == TCIF
    assert not any(bench.ram[0x40:0x44])


def test_enabling_completed_stream_reloads_ndtr() -> None:
    """RM0368 9.5.6: NDTR is reloaded with the value that software wrote last."""
    bench = DmaBench()
    bench.start(3, I2C2_RX | MINC, 2)
    bench.requests(2)
    assert bench.dma1.read(stream_base(3) + 4) == 0
    bench.dma1.write(0x08, 0x3D << 22)
    bench.dma1.write(stream_base(3), I2C2_RX | MINC | EN)
    assert bench.dma1.read(stream_base(3) + 4) == 2
    assert bench.requests(3) == 2
    assert bytes(bench.ram[:3]) == b"\3\4\0"


def test_registers_are_protected_while_stream_runs() -> None:
    bench = DmaBench()
    bench.start(3, I2C2_RX | MINC, 4)
    bench.dma1.write(stream_base(3) + 4, 9)
    bench.dma1.write(stream_base(3), I2C2_RX | CIRC | MINC | EN | TCIE)
    assert bench.dma1.read(stream_base(3) + 4) == 4
    assert bench.dma1.read(stream_base(3)) == I2C2_RX | MINC | EN | TCIE
    assert bench.chip.problems() == {"written-while-enabled": {"stream": 3}}
    assert len(bench.chip.notes()) == 2


def test_stream_without_items_does_not_start() -> None:
    bench = DmaBench()
    bench.start(3, I2C2_RX, 0)
    assert not bench.dma1.read(stream_base(3)) & EN


@pytest.mark.parametrize(("dma", "is_noted"), [(1, True), (2, False)])
def test_memory_copy_on_dma1_is_noted(dma: int, is_noted: bool) -> None:
    """9.3.2: only DMA2 can transfer from memory to memory."""
    bench = DmaBench()
    bench.start(0, MEMORY_TO_MEMORY | PINC | MINC, 4, memory=RAM + 64, peripheral=RAM, dma=dma)
    assert bench.chip.problems() == ({"memory-to-memory": {}} if is_noted else {})


def test_channel_without_request_line_is_noted() -> None:
    bench = DmaBench()
    bench.start(0, I2C2_RX, 1)
    assert bench.chip.problems()["no-request-line"] == {"stream": 0, "channel": 7}


@pytest.mark.parametrize(
    ("line", "places"),
    [
        ("USART1_TX", {("DMA2", 7, 4)}),
        ("USART1_RX", {("DMA2", 2, 4), ("DMA2", 5, 4)}),
        ("USART2_TX", {("DMA1", 6, 4)}),
        ("I2C2_RX", {("DMA1", 2, 7), ("DMA1", 3, 7)}),
        ("I2C2_TX", {("DMA1", 7, 7)}),
        ("SPI2_RX", {("DMA1", 3, 0)}),
        ("SPI2_TX", {("DMA1", 4, 0)}),
        ("SPI1_TX", {("DMA2", 3, 3), ("DMA2", 5, 3)}),
        ("ADC1", {("DMA2", 0, 0), ("DMA2", 4, 0)}),
        ("TIM4_UP", {("DMA1", 6, 2)}),
        ("TIM2_UP", {("DMA1", 1, 3), ("DMA1", 7, 3)}),
    ],
)
def test_request_tables_equal_manual(line: str, places: set[tuple[str, int, int]]) -> None:
    """RM0368 tables 28 and 29."""
    bench = DmaBench()
    found = set()
    for dma, stream, channel in product((1, 2), range(8), range(8)):
        bench.start(stream, channel << 25, 1, dma=dma)
        if bench.lines.remaining(line):
            found.add((f"DMA{dma}", stream, channel))
        bench.chip[f"DMA{dma}"].write(stream_base(stream), 0)
    assert found == places


def test_reset_stops_everything() -> None:
    bench = DmaBench()
    bench.start(3, I2C2_RX | MINC | TCIE, 1)
    bench.requests(1)
    bench.dma1.reset()
    assert bench.dma1.read(0) == bench.dma1.read(stream_base(3)) == 0
    assert bench.dma1.read(stream_base(3) + 0x14) == 0x21
    assert not bench.chip.irq.level(14)
