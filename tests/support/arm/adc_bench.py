"""ADC1 of a chip without a core: offsets and bits (RM0368 11.12), times of conversions, and results stored by DMA."""

from __future__ import annotations

from functools import partial

from fcu_emulator.emulator.chip.memory_map import RAM
from fcu_emulator.emulator.chip.peripherals.adc import Adc
from fcu_emulator.emulator.clock import PS_PER_S
from tests.support.arm.chip_fakes import NativeChip

SR, CR1, CR2, SMPR1, SMPR2, HTR, LTR = 0x00, 0x04, 0x08, 0x0C, 0x10, 0x24, 0x28
SQR1, SQR2, SQR3, JSQR, DR, CCR = 0x2C, 0x30, 0x34, 0x38, 0x4C, 0x304
JOFR, JDR = (0x14, 0x18, 0x1C, 0x20), (0x3C, 0x40, 0x44, 0x48)
AWD, EOC, JEOC, JSTRT, STRT, OVR = (1 << n for n in range(6))  # SR
EOCIE, AWDIE, JEOCIE, SCAN, AWDSGL = (1 << n for n in range(5, 10))  # CR1
JAUTO, DISCEN, JDISCEN, JAWDEN, AWDEN, OVRIE = 1 << 10, 1 << 11, 1 << 12, 1 << 22, 1 << 23, 1 << 26  # CR1
ADON, CONT, DMA, DDS, EOCS, ALIGN = 1 << 0, 1 << 1, 1 << 8, 1 << 9, 1 << 10, 1 << 11  # CR2
JSWSTART, SWSTART = 1 << 22, 1 << 30  # CR2
ADCPRE_DIV4, VBATE, TSVREFE = 1 << 16, 1 << 22, 1 << 23  # CCR

ADC_IRQ = 18
ADC_ADDRESS = 0x4001_2000
ADCCLK_HZ = 84_000_000 // 4  # PCLK2 over ADCPRE
SHORTEST_SAMPLING, FULL_RESOLUTION = 3, 12  # cycles of ADCCLK
VOLTS_PER_LSB = 3.3 / 4095


def conversion_ps(sampling: int = SHORTEST_SAMPLING, resolution: int = FULL_RESOLUTION) -> int:
    """RM0368 11.5: a conversion takes its sampling time and a cycle for each bit."""
    return (sampling + resolution) * PS_PER_S // ADCCLK_HZ


def code(volts: float) -> int:
    """Return the result of 12 bits for a voltage."""
    return round(volts / VOLTS_PER_LSB)


def regular_sequence(adc: Adc, channels: list[int]) -> None:
    """Write the channels of the regular group, at most six."""
    adc.write(SQR1, (len(channels) - 1) << 20)  # L
    adc.write(SQR3, sum(channel << 5 * place for place, channel in enumerate(channels)))


def injected_sequence(adc: Adc, channels: list[int]) -> None:
    """Write the channels of the injected group. RM0368 11.12.12: a shorter sequence ends with JSQ4, too."""
    first = 4 - len(channels)
    places = sum(channel << 5 * (first + n) for n, channel in enumerate(channels))
    adc.write(JSQR, (len(channels) - 1) << 20 | places)


def connect(adc: Adc, voltages: list[float]) -> None:
    """Connect the voltages to channels 0, 1 and so on; they may change later."""
    for channel in range(len(voltages)):
        adc.inputs.connect(channel, partial(voltages.__getitem__, channel))


class DmaResults:
    """Stream 0 of DMA2, which stores half-words from DR in RAM (RM0368 table 29: channel 0)."""

    _S0CR, _S0NDTR, _S0PAR, _S0M0AR = 0x10, 0x14, 0x18, 0x1C

    def __init__(self, chip: NativeChip, items: int, *, circular: bool = False) -> None:
        self._ram, self._dma = chip.fcu.ram, chip["DMA2"]
        self._items, self._circular = items, circular
        self._dma.write(self._S0PAR, ADC_ADDRESS + DR)
        self._dma.write(self._S0M0AR, RAM)
        self.restart()

    def restart(self) -> None:
        """Enable the stream again, with its initial number of items."""
        self._dma.write(0x08, 0x3D)  # LIFCR
        self._dma.write(self._S0NDTR, self._items)
        control = 1 << 13 | 1 << 11 | 1 << 10  # half-words, memory addresses are incremented
        self._dma.write(self._S0CR, control | self._circular << 8 | 1)

    @property
    def stored(self) -> list[int]:
        """The latest results of this transfer."""
        return self.at(self._items - self._dma.read(self._S0NDTR))

    def at(self, count: int) -> list[int]:
        """Return the first half-words in RAM."""
        return [int.from_bytes(self._ram[2 * n : 2 * n + 2], "little") for n in range(count)]

    def complete(self) -> bool:
        """Return TCIF."""
        return bool(self._dma.read(0x00) & 1 << 5)
