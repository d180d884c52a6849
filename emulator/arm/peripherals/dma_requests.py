"""Which request line reaches which DMA stream on which channel (RM0368 section 9.3.3, tables 28 and 29).

Lines that two events share ("TIM2_UP/TIM2_CH3") are listed under each name. The tables were compared with
those of RM0090 (STM32F405), of which they are a part but for I2C3_RX on stream 1 and I2C3_TX on stream 5:
these two are not certain. I2S extension blocks, SPI4 and SDIO make no requests on this board.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Final, Protocol

_NONE: tuple[str, ...] = ("",) * 8

# one row a channel, one column a stream
_DMA1: Final = (
    ("SPI3_RX", "", "SPI3_RX", "SPI2_RX", "SPI2_TX", "SPI3_TX", "", "SPI3_TX"),
    ("I2C1_RX", "I2C3_RX", "", "", "", "I2C1_RX", "I2C1_TX", "I2C1_TX"),
    ("TIM4_CH1", "", "I2S3_EXT_RX", "TIM4_CH2", "I2S2_EXT_TX", "I2S3_EXT_TX", "TIM4_UP", "TIM4_CH3"),
    (
        "I2S3_EXT_RX",
        "TIM2_UP/TIM2_CH3",
        "I2C3_RX",
        "I2S2_EXT_RX",
        "I2C3_TX",
        "TIM2_CH1",
        "TIM2_CH2/TIM2_CH4",
        "TIM2_UP/TIM2_CH4",
    ),
    ("", "", "", "", "", "USART2_RX", "USART2_TX", ""),
    ("", "", "TIM3_CH4/TIM3_UP", "", "TIM3_CH1/TIM3_TRIG", "TIM3_CH2", "", "TIM3_CH3"),
    (
        "TIM5_CH3/TIM5_UP",
        "TIM5_CH4/TIM5_TRIG",
        "TIM5_CH1",
        "TIM5_CH4/TIM5_TRIG",
        "TIM5_CH2",
        "I2C3_TX",
        "TIM5_UP",
        "",
    ),
    ("", "", "I2C2_RX", "I2C2_RX", "", "", "", "I2C2_TX"),
)
_DMA2: Final = (
    ("ADC1", "", "", "", "ADC1", "", "TIM1_CH1/TIM1_CH2/TIM1_CH3", ""),
    _NONE,
    _NONE,
    ("SPI1_RX", "", "SPI1_RX", "SPI1_TX", "", "SPI1_TX", "", ""),
    ("SPI4_RX", "SPI4_TX", "USART1_RX", "SDIO", "", "USART1_RX", "SDIO", "USART1_TX"),
    ("", "USART6_RX", "USART6_RX", "SPI4_RX", "SPI4_TX", "", "USART6_TX", "USART6_TX"),
    (
        "TIM1_TRIG",
        "TIM1_CH1",
        "TIM1_CH2",
        "TIM1_CH1",
        "TIM1_CH4/TIM1_TRIG/TIM1_COM",
        "TIM1_UP",
        "TIM1_CH3",
        "",
    ),
    _NONE,
)
_TABLES: Final = {"DMA1": _DMA1, "DMA2": _DMA2}


def lines(controller: str, stream: int, channel: int) -> tuple[str, ...]:
    """The request lines at ``channel`` of a stream of "DMA1" or "DMA2"; empty where the table has none."""
    return tuple(filter(None, _TABLES[controller][channel][stream].split("/")))


class Server(Protocol):
    """An enabled stream."""

    def transfer(self) -> None:
        """Do one transfer."""
        ...

    def remaining(self) -> int:
        """Transfers left."""
        ...


class DmaLines:
    """The request lines between blocks and streams; implements :class:`emulator.arm.soc.DmaRequests`."""

    def __init__(self) -> None:
        self._servers: dict[str, Server] = {}
        self._askers: dict[str, Callable[[], None]] = {}

    def request(self, line: str) -> bool:
        """One transfer for ``line``, at once; False if no enabled stream has it selected."""
        server = self._servers.get(line)
        if server is None:
            return False
        server.transfer()
        return True

    def remaining(self, line: str) -> int:
        """Transfers left of the stream that serves ``line``; 0 if none does."""
        server = self._servers.get(line)
        return server.remaining() if server else 0

    def connect(self, line: str, served: Callable[[], None]) -> None:
        """Call ``served()`` when a stream starts to serve ``line``."""
        self._askers[line] = served

    def serve(self, names: tuple[str, ...], server: Server) -> None:
        """``server`` has been enabled: it does the transfers of these lines from now on."""
        for line in names:
            self._servers[line] = server
        for line in names:
            if line in self._askers:
                self._askers[line]()

    def leave(self, names: tuple[str, ...], server: Server) -> None:
        """``server`` has been disabled."""
        for line in names:
            if self._servers.get(line) is server:
                del self._servers[line]
