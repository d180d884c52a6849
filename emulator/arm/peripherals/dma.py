"""DMA1 and DMA2: eight streams each (RM0368 section 9; interrupt numbers of table 38).

Here are the registers and interrupts; ``dma_stream`` does the transfers, ``dma_requests`` has the wiring.
Everything that happens is caused by a request, which a block makes in an access or an event, so no flag here
changes by itself.

Not modelled, and told when used: the peripheral as flow controller (PFCTRL, for SDIO only).
"""

from __future__ import annotations

from functools import partial
from typing import ClassVar

from emulator.arm.peripherals.dma_requests import DmaLines, lines
from emulator.arm.peripherals.dma_stream import EN, MEMORY_TO_MEMORY, Stream
from emulator.arm.peripherals.irq_line import IrqLine
from emulator.arm.peripherals.peripheral import WORD, Peripheral
from emulator.arm.soc import Soc

LISR, HISR, LIFCR, HIFCR = 0x00, 0x04, 0x08, 0x0C
CR, NDTR, PAR, M0AR, M1AR, FCR = 0x00, 0x04, 0x08, 0x0C, 0x10, 0x14

_FIRST_STREAM, _STREAM_SIZE, _STREAMS = 0x10, 0x18, 8
_FLAG_SHIFT = (0, 6, 16, 22)  # of streams 0 to 3 in LISR, 4 to 7 in HISR
_FLAGS = 0x3D
_PFCTRL = 1 << 5
_CR_BITS = 0x0FEF_FFFF
_NAMES = ("CR", "NDTR", "PAR", "M0AR", "M1AR", "FCR")
_INTERRUPTS = {
    "DMA1": (11, 12, 13, 14, 15, 16, 17, 47),
    "DMA2": (56, 57, 58, 59, 60, 68, 69, 70),
}


def stream_base(stream: int) -> int:
    """The offset of a stream's registers."""
    return _FIRST_STREAM + _STREAM_SIZE * stream


class Dma(Peripheral):
    """``name`` is "DMA1" or "DMA2"; ``requests`` are the lines that both share."""

    REGISTERS: ClassVar[dict[int, int]] = {}
    NAMES: ClassVar[dict[int, str]] = {
        LISR: "LISR",
        HISR: "HISR",
        LIFCR: "LIFCR",
        HIFCR: "HIFCR",
        **{
            stream_base(stream) + 4 * number: f"S{stream}{register}"
            for stream in range(_STREAMS)
            for number, register in enumerate(_NAMES)
        },
    }

    def __init__(self, soc: Soc, name: str, base: int, requests: DmaLines, size: int = 0x400) -> None:
        super().__init__(soc, name, base, size)
        self.streams = [Stream(soc, requests, partial(self._update, stream)) for stream in range(_STREAMS)]
        self._irqs = [IrqLine(soc, number) for number in _INTERRUPTS[name]]

    def reset(self) -> None:
        """All streams off, all flags clear."""
        super().reset()
        for number, stream in enumerate(self.streams):
            stream.reset()
            self._update(number)

    def read(self, offset: int) -> int:
        """No read has a side effect; the flag clear registers read as 0."""
        if offset in (LISR, HISR):
            first = 4 if offset == HISR else 0
            return sum(self.streams[first + n].flags << shift for n, shift in enumerate(_FLAG_SHIFT))
        if offset < _FIRST_STREAM:
            return 0
        number, register = divmod(offset - _FIRST_STREAM, _STREAM_SIZE)
        return _read(self.streams[number], register) if number < _STREAMS else 0

    def peek(self, offset: int) -> int:
        """The same."""
        return self.read(offset)

    def write(self, offset: int, value: int, mask: int = WORD) -> None:
        """Clear flags, or configure, start and stop a stream."""
        if offset in (LIFCR, HIFCR):
            self._clear_flags(4 if offset == HIFCR else 0, value & mask)
        if offset < _FIRST_STREAM:
            return
        number, register = divmod(offset - _FIRST_STREAM, _STREAM_SIZE)
        if number < _STREAMS:
            old = _read(self.streams[number], register)
            self._write(number, register, old & ~mask | value & mask)

    def _clear_flags(self, first: int, bits: int) -> None:
        for number, shift in enumerate(_FLAG_SHIFT, start=first):
            self.streams[number].flags &= ~(bits >> shift & _FLAGS)
            self._update(number)

    def _write(self, number: int, register: int, value: int) -> None:
        stream = self.streams[number]
        if register == CR:
            self._control(number, value & _CR_BITS)
        elif stream.control & EN and register in (NDTR, PAR):
            self.note(
                "forbidden",
                f"S{number}{_NAMES[register // 4]} written while the stream is enabled: no effect",
            )
        elif register == NDTR:
            stream.items = value & 0xFFFF
        elif register == PAR:
            stream.peripheral = value
        elif register in (M0AR, M1AR):
            stream.memory[register == M1AR] = value
        else:
            stream.fifo_control = stream.fifo_control & 0x38 | value & 0x87

    def _control(self, number: int, value: int) -> None:
        stream = self.streams[number]
        if value & _PFCTRL:
            self.note("not modelled", f"S{number}CR.PFCTRL")
        channel = value >> 25 & 7
        names = lines(self.name, number, channel)
        if value & EN and not stream.control & EN:
            self._check(number, channel, value, names)
        if not stream.write_control(value, names):
            self.note("forbidden", f"S{number}CR reconfigured while the stream is enabled: no effect")
        self._update(number)

    def _check(self, number: int, channel: int, value: int, names: tuple[str, ...]) -> None:
        to_memory = value >> 6 & 3 == MEMORY_TO_MEMORY
        if to_memory and self.name == "DMA1":
            self.note("forbidden", "memory to memory is for DMA2 only (RM0368 9.3.2)")
        if not to_memory and not names:
            self.note(
                "forbidden", f"stream {number} channel {channel} is enabled, but no request line is there"
            )

    def _update(self, number: int) -> None:
        self._irqs[number].set(f"{self.name}.{number}", self.streams[number].interrupt())


def _read(stream: Stream, register: int) -> int:
    return (stream.control, stream.items, stream.peripheral, *stream.memory, stream.fifo_control)[
        register // 4
    ]
