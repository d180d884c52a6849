"""The state of DMA1 and DMA2 (native/peripherals/dma.c)."""

from __future__ import annotations

from typing import Final

from fcu_emulator.emulator.chip.library import FcuChip

_STREAMS: Final = 8
_EN: Final = 1


def _stream_base(stream: int) -> int:
    return 0x10 + 0x18 * stream


def is_any_stream_on(chip: FcuChip) -> bool:
    """Return whether a DMA stream is enabled."""
    controllers = (chip.peripherals["DMA1"], chip.peripherals["DMA2"])
    return any(
        dma.clocked and dma.peek(_stream_base(stream)) & _EN
        for dma in controllers
        for stream in range(_STREAMS)
    )
