"""ADC1: battery, temperature, reference; single, scanning and continuous conversion (RM0368 section 11)."""

from __future__ import annotations

import struct
from functools import partial

import pytest

from emulator.chip.peripherals.adc import Adc, AdcInputs
from emulator.chip.peripherals.dbgmcu import system_memory
from emulator.chip.peripherals.peripheral import InterruptInput
from emulator.time.clock import PS_PER_MS, PS_PER_S
from tests.arm.chip_fakes import Chip

SR, CR1, CR2, SMPR2, SQR1, SQR3, DR, CCR = 0x00, 0x04, 0x08, 0x10, 0x2C, 0x34, 0x4C, 0x304
EOC, STRT, OVR = 2, 1 << 4, 1 << 5
ADON, CONT, DMA, DDS, EOCS, SWSTART = 1, 2, 1 << 8, 1 << 9, 1 << 10, 1 << 30
EOCIE, SCAN, OVRIE = 1 << 5, 1 << 8, 1 << 26
DIV4 = 1 << 16
VBATE, TSVREFE = 1 << 22, 1 << 23
CONVERSION_PS = (3 + 12) * 4 * PS_PER_S // 84_000_000  # 21 MHz, 12 bit, 3 cycles


@pytest.fixture
def chip() -> Chip:
    return Chip()


@pytest.fixture
def adc(chip: Chip) -> Adc:
    block = Adc(chip.soc, "ADC1", 0x4001_2000, InterruptInput(chip.soc, 18), AdcInputs(battery_v=3.7))
    block.write(CCR, DIV4)
    block.write(SQR3, 9)
    return block


def test_the_battery_as_the_lab_reads_it(chip: Chip, adc: Adc) -> None:
    """ST's firmware: VBAT = raw * 3.3 / 4095 * (10 + 20) / 20."""
    adc.write(CR2, ADON | EOCS)
    adc.write(CR2, ADON | EOCS | SWSTART)
    chip.run_to(CONVERSION_PS - 1)
    assert adc.read(SR) == STRT
    chip.run_to(CONVERSION_PS)
    assert adc.read(SR) == STRT | EOC
    assert adc.read(DR) * 3.3 / 4095 * 30 / 20 == pytest.approx(3.7, abs=1e-3)
    assert adc.read(SR) == STRT
    adc.inputs.battery_v = 3.3
    adc.write(CR2, ADON | EOCS | SWSTART)
    chip.run_for(CONVERSION_PS)
    assert adc.read(DR) * 3.3 / 4095 * 30 / 20 == pytest.approx(3.3, abs=1e-3)


def test_it_does_not_convert_while_it_is_off(chip: Chip, adc: Adc) -> None:
    adc.write(CR2, SWSTART)
    chip.run_to(PS_PER_MS)
    assert adc.read(SR) == 0


@pytest.mark.parametrize(("channel", "expected_v"), [(17, 1.21), (18, 0.76 + 0.0025 * 5)])
def test_inner_channels_need_tsvrefe(chip: Chip, adc: Adc, channel: int, expected_v: float) -> None:
    """RM0368 11.9, 11.10; datasheet: V25 0.76 V, 2.5 mV/degC, reference 1.21 V; the die is at 30 degC."""
    adc.write(SQR3, channel)
    quarter_v = 3.3 / 4 if channel == 18 else 0.0
    for ccr, volts in ((DIV4, 0.0), (DIV4 | TSVREFE, expected_v), (DIV4 | VBATE, quarter_v)):
        adc.write(CCR, ccr)
        adc.write(CR2, ADON | SWSTART)
        chip.run_for(PS_PER_MS)
        assert adc.read(DR) * 3.3 / 4095 == pytest.approx(volts, abs=5e-4)


def test_the_factory_calibration_agrees_with_the_sensor(chip: Chip, adc: Adc) -> None:
    """Datasheet: TS_CAL1 at 30 degC, TS_CAL2 at 110 degC, VREFIN_CAL, all at 3.3 V."""
    vrefint, cold, hot = struct.unpack_from("<3H", system_memory(), 0x2A)
    adc.write(CCR, DIV4 | TSVREFE)
    seen = []
    for channel, die_degc in ((17, 30), (18, 30), (18, 110)):
        adc.inputs.die_degc = die_degc
        adc.write(SQR3, channel)
        adc.write(CR2, ADON | SWSTART)
        chip.run_for(PS_PER_MS)
        seen.append(adc.read(DR))
    assert seen == [vrefint, cold, hot]


@pytest.mark.parametrize(("resolution", "bits"), [(0, 12), (1, 10), (2, 8), (3, 6)])
def test_resolution_and_alignment(chip: Chip, adc: Adc, resolution: int, bits: int) -> None:
    """RM0368 11.7, 11.4: fewer bits are faster; left alignment is to 16 bits, of 6 bits to 8."""
    adc.inputs.connect(3, lambda: 3.3)
    adc.write(SQR3, 3)
    adc.write(CR1, resolution << 24)
    adc.write(CR2, ADON | SWSTART)
    chip.run_to((3 + bits) * 4 * PS_PER_S // 84_000_000)
    assert adc.read(DR) == (1 << bits) - 1
    adc.write(CR2, ADON | 1 << 11 | SWSTART)
    chip.run_for(PS_PER_MS)
    assert adc.read(DR) == (1 << bits) - 1 << (2 if bits == 6 else 16 - bits)


def test_sampling_time(chip: Chip, adc: Adc) -> None:
    """RM0368 11.5: SMP9 = 7 is 480 cycles."""
    adc.write(SMPR2, 7 << 27)
    adc.write(CR2, ADON | SWSTART)
    chip.run_to(492 * 4 * PS_PER_S // 84_000_000 - 1)
    assert not adc.read(SR) & EOC
    chip.run_for(1)
    assert adc.read(SR) & EOC


def scan(adc: Adc, voltages: list[float]) -> None:
    for channel in range(len(voltages)):
        adc.inputs.connect(channel, partial(voltages.__getitem__, channel))
    adc.write(SQR1, len(voltages) - 1 << 20)
    adc.write(SQR3, sum(channel << 5 * channel for channel in range(len(voltages))))


def test_a_scan_by_dma(chip: Chip, adc: Adc) -> None:
    """RM0368 11.8.1: one request a conversion."""
    scan(adc, [0.0, 1.65, 3.3])
    taken = list[int]()
    chip.dma.serve("ADC1", lambda: taken.append(adc.read(DR)))
    adc.write(CR1, SCAN)
    adc.write(CR2, ADON | DMA | SWSTART)
    chip.run_to(3 * CONVERSION_PS)
    assert taken == [0, 2048, 4095]
    chip.run_for(PS_PER_MS)
    assert len(taken) == 3


def test_requests_stop_after_the_last_transfer_without_dds(chip: Chip, adc: Adc) -> None:
    """RM0368 11.13.3, DDS."""
    results = list[int]()
    chip.dma.serve("ADC1", lambda: results.append(adc.read(DR)))
    adc.write(CR2, ADON | DMA | SWSTART)
    chip.run_for(PS_PER_MS)
    adc.write(CR2, ADON | DMA | SWSTART)
    chip.run_for(PS_PER_MS)
    assert len(chip.dma.requests) == 1
    adc.write(SR, 0)
    adc.write(CR2, ADON)
    for _ in range(2):
        adc.write(CR2, ADON | DMA | DDS | SWSTART)
        chip.run_for(PS_PER_MS)
    assert len(results) == 3


def test_an_overrun_stops_the_scan(chip: Chip, adc: Adc) -> None:
    """RM0368 11.8.2: with EOCS each result must be read in time."""
    scan(adc, [0.0, 1.65, 3.3])
    adc.write(CR1, SCAN | OVRIE)
    adc.write(CR2, ADON | EOCS | SWSTART)
    chip.run_to(PS_PER_MS)
    assert adc.read(SR) == STRT | EOC | OVR
    assert chip.irq.level(18)
    assert adc.read(DR) == 0
    adc.write(SR, 0)
    assert not chip.irq.level(18)


def test_the_end_of_conversion_interrupt(chip: Chip, adc: Adc) -> None:
    """Table 38: ADC is number 18."""
    adc.write(CR1, EOCIE)
    adc.write(CR2, ADON | SWSTART)
    chip.run_to(CONVERSION_PS)
    assert chip.irq.rises == [(CONVERSION_PS, 18)]
    adc.read(DR)
    assert not chip.irq.level(18)


def test_continuous_conversion_shows_the_present(chip: Chip, adc: Adc) -> None:
    """RM0368 11.3.5; nobody reads, so nothing has to happen until somebody does."""
    adc.write(CR2, ADON | CONT | SWSTART)
    chip.run_to(PS_PER_MS)
    adc.inputs.battery_v = 3.0
    chip.run_to(PS_PER_S)
    assert adc.read(DR) * 3.3 / 4095 * 1.5 == pytest.approx(3.0, abs=1e-3)
    assert not adc.read(SR) & EOC
    chip.run_for(CONVERSION_PS)
    assert adc.read(SR) & EOC


def test_what_is_not_modelled_is_told(chip: Chip, adc: Adc) -> None:
    adc.write(CR2, 1 << 22)
    adc.write(CR1, 1 << 23)
    assert [what for what, _ in chip.notes()] == ["not modelled", "not modelled"]
