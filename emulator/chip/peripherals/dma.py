"""Requests of the peripherals in Python to DMA1 and DMA2 (native/peripherals/dma.c)."""

from __future__ import annotations

from typing import Final

from fcu_emulator.emulator.chip.library import FcuChip
from fcu_emulator.emulator.chip.registers.dma import REQUESTS

_STREAMS: Final = 8
_EN: Final = 1


def _stream_base(stream: int) -> int:
    return 0x10 + 0x18 * stream


def _number(line: str) -> int:
    return 1 + REQUESTS.index(line)


class DmaLines:
    """Implements :class:`fcu_emulator.emulator.chip.peripherals.peripheral.DmaRequests`."""

    def __init__(self, chip: FcuChip) -> None:
        self._chip = chip

    def request(self, line: str) -> bool:
        chip = self._chip
        chip.enter()
        served = bool(chip.library.fcu_dma_request(chip.handle, _number(line)))
        chip.raise_error()
        return served

    def remaining(self, line: str) -> int:
        count: int = self._chip.library.fcu_dma_remaining(self._chip.handle, _number(line))
        return count


def is_any_stream_on(chip: FcuChip) -> bool:
    """Return whether a DMA stream is enabled."""
    controllers = (chip.peripherals["DMA1"], chip.peripherals["DMA2"])
    return any(
        dma.clocked and dma.peek(_stream_base(stream)) & _EN
        for dma in controllers
        for stream in range(_STREAMS)
    )
