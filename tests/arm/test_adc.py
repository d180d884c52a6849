"""ADC1: battery, temperature, reference; single, scanning and continuous conversion (RM0368 section 11)."""

from __future__ import annotations

import struct

import pytest

from fcu_emulator.emulator.chip.peripherals.adc import Adc
from fcu_emulator.emulator.chip.peripherals.dbgmcu import SYSTEM_MEMORY, system_memory
from fcu_emulator.emulator.clock import PS_PER_MS, PS_PER_S
from tests.support.arm.adc_bench import (
    ADC_IRQ,
    ADCPRE_DIV4,
    ADON,
    ALIGN,
    CCR,
    CONT,
    CR1,
    CR2,
    DDS,
    DMA,
    DR,
    EOC,
    EOCIE,
    EOCS,
    OVR,
    OVRIE,
    SCAN,
    SMPR2,
    SQR3,
    SR,
    STRT,
    SWSTART,
    TSVREFE,
    VBATE,
    VOLTS_PER_LSB,
    DmaResults,
    code,
    connect,
    conversion_ps,
    regular_sequence,
)
from tests.support.arm.chip_fakes import NativeChip

BATTERY, VREFINT, TEMPERATURE = 9, 17, 18  # channels; VBATE gives 18 to the backup supply instead
HAL_TEMPERATURE = 16  # ADC_CHANNEL_TEMPSENSOR of ST's headers for the STM32F401


def battery_v(raw: int) -> float:
    """Return the battery's voltage as ST's firmware for the board computes it, with a divider of 10 kOhm over 20 kOhm."""
    return raw * VOLTS_PER_LSB * (10 + 20) / 20


@pytest.fixture
def chip() -> NativeChip:
    return NativeChip()


@pytest.fixture
def adc(chip: NativeChip) -> Adc:
    block = chip.adc
    block.inputs.battery_v = 3.7
    block.write(CCR, ADCPRE_DIV4)
    block.write(SQR3, BATTERY)
    return block


def connect_sequence(adc: Adc, voltages: list[float]) -> None:
    """Put the voltages on channels 0, 1, ..., and make these channels the sequence of regular conversions."""
    connect(adc, voltages)
    regular_sequence(adc, list(range(len(voltages))))


def test_battery_voltage_is_read_after_conversion_time(chip: NativeChip, adc: Adc) -> None:
    adc.write(CR2, ADON | EOCS)
    adc.write(CR2, ADON | EOCS | SWSTART)
    chip.run_to(conversion_ps() - 1)
    assert adc.read(SR) == STRT
    chip.run_to(conversion_ps())
    assert adc.read(SR) == STRT | EOC
    assert battery_v(adc.read(DR)) == pytest.approx(3.7, abs=1e-3)
    assert adc.read(SR) == STRT
    adc.inputs.battery_v = 3.3
    adc.write(CR2, ADON | EOCS | SWSTART)
    chip.run_for(conversion_ps())
    assert battery_v(adc.read(DR)) == pytest.approx(3.3, abs=1e-3)


def test_disabled_adc_does_not_convert(chip: NativeChip, adc: Adc) -> None:
    adc.write(CR2, SWSTART)
    chip.run_to(PS_PER_MS)
    assert adc.read(SR) == 0


@pytest.mark.parametrize(
    ("channel", "with_tsvrefe_v", "with_vbate_v"),
    [
        (VREFINT, 1.21, 0.0),
        (TEMPERATURE, 0.76 + 0.0025 * (30 - 25), 3.3 / 4),
        (HAL_TEMPERATURE, 0.76 + 0.0025 * (30 - 25), 0.0),
    ],
)
def test_internal_channels_have_to_be_switched_on(
    chip: NativeChip, adc: Adc, channel: int, with_tsvrefe_v: float, with_vbate_v: float
) -> None:
    """RM0368 11.9, 11.10; datasheet: 0.76 V at 25 degC, 2.5 mV/degC, reference 1.21 V. The die has 30 degC."""
    adc.write(SQR3, channel)
    for switched_on, volts in ((0, 0.0), (TSVREFE, with_tsvrefe_v), (VBATE, with_vbate_v)):
        adc.write(CCR, ADCPRE_DIV4 | switched_on)
        adc.write(CR2, ADON | SWSTART)
        chip.run_for(PS_PER_MS)
        assert adc.read(DR) * VOLTS_PER_LSB == pytest.approx(volts, abs=5e-4)


def test_factory_calibration_agrees_with_sensor(chip: NativeChip, adc: Adc) -> None:
    """Datasheet: VREFIN_CAL, TS_CAL1 at 30 degC and TS_CAL2 at 110 degC, from 0x1FFF7A2A, all at 3.3 V."""
    calibration = struct.unpack_from("<3H", system_memory(), 0x1FFF_7A2A - SYSTEM_MEMORY)
    adc.write(CCR, ADCPRE_DIV4 | TSVREFE)
    seen = []
    for channel, die_degc in ((VREFINT, 30), (TEMPERATURE, 30), (TEMPERATURE, 110)):
        adc.inputs.die_degc = die_degc
        adc.write(SQR3, channel)
        adc.write(CR2, ADON | SWSTART)
        chip.run_for(PS_PER_MS)
        seen.append(adc.read(DR))
    assert seen == list(calibration)


@pytest.mark.parametrize(("resolution", "bits"), [(0, 12), (1, 10), (2, 8), (3, 6)])
def test_lower_resolution_shortens_conversion_and_alignment_shifts_result(
    chip: NativeChip, adc: Adc, resolution: int, bits: int
) -> None:
    """RM0368 11.7, 11.4: fewer bits are faster. Results are left-aligned in 16 bits, results of 6 bits in 8."""
    adc.inputs.connect(3, lambda: 3.3)
    adc.write(SQR3, 3)
    adc.write(CR1, resolution << 24)  # RES
    adc.write(CR2, ADON | SWSTART)
    chip.run_to(conversion_ps(resolution=bits))
    full_scale = (1 << bits) - 1
    assert adc.read(DR) == full_scale
    adc.write(CR2, ADON | ALIGN | SWSTART)
    chip.run_for(PS_PER_MS)
    assert adc.read(DR) == full_scale << (8 - bits if bits == 6 else 16 - bits)


def test_sampling_time_lengthens_conversion(chip: NativeChip, adc: Adc) -> None:
    """RM0368 11.5: SMP9 = 7 is 480 cycles."""
    adc.write(SMPR2, 7 << 27)  # SMP9
    adc.write(CR2, ADON | SWSTART)
    chip.run_to(conversion_ps(sampling=480) - 1)
    assert not adc.read(SR) & EOC
    chip.run_for(1)
    assert adc.read(SR) & EOC


def test_dma_reads_each_result_of_scan(chip: NativeChip, adc: Adc) -> None:
    """RM0368 11.8.1: each conversion makes a request."""
    connect_sequence(adc, [0.0, 1.65, 3.3])
    results = DmaResults(chip, 4)
    adc.write(CR1, SCAN)
    adc.write(CR2, ADON | DMA | SWSTART)
    chip.run_to(3 * conversion_ps())
    assert results.stored == [0, 2048, 4095]
    chip.run_for(PS_PER_MS)
    assert len(results.stored) == 3


def test_dma_requests_end_at_final_transfer_without_dds(chip: NativeChip, adc: Adc) -> None:
    """RM0368 11.12.3, DDS. Writing 0 and then 1 to DMA makes requests possible again (11.8.1)."""
    results = DmaResults(chip, 1)
    adc.write(CR2, ADON | DMA | SWSTART)
    chip.run_for(PS_PER_MS)
    assert results.complete()
    results.restart()
    adc.write(CR2, ADON | DMA | SWSTART)
    chip.run_for(PS_PER_MS)
    assert not results.complete()
    adc.write(SR, 0)  # EOC of the result that was not read: the next result would be lost
    adc.write(CR2, ADON)
    for _ in range(2):
        adc.write(CR2, ADON | DMA | DDS | SWSTART)
        chip.run_for(PS_PER_MS)
        assert results.complete()
        results.restart()


@pytest.mark.parametrize(("dds", "count"), [(0, 2), (DDS, 5)])
def test_circular_stream_needs_dds(chip: NativeChip, adc: Adc, dds: int, count: int) -> None:
    """RM0368 11.8.1: without DDS the requests end with the number of items in NDTR, also in circular mode."""
    voltages = [0.0]
    connect_sequence(adc, voltages)
    results = DmaResults(chip, 2, circular=True)
    for number in range(5):
        voltages[0] = number * VOLTS_PER_LSB
        adc.write(SR, 0)
        adc.write(CR2, ADON | DMA | dds | SWSTART)
        chip.run_for(conversion_ps())
    assert results.at(2) == ([0, 1] if count == 2 else [4, 3])


def test_result_without_dma_stream_causes_overrun(chip: NativeChip, adc: Adc) -> None:
    """RM0368 11.8.1. To recover, software clears OVR, prepares the stream and starts the ADC (11.8.1)."""
    connect_sequence(adc, [0.0, 1.65, 3.3])
    adc.write(CR1, SCAN | OVRIE)
    adc.write(CR2, ADON | DMA | SWSTART)
    chip.run_to(2 * conversion_ps())
    assert adc.read(SR) == STRT | EOC | OVR
    assert chip.irq.rises == [(2 * conversion_ps(), ADC_IRQ)]
    adc.write(CR2, ADON | DMA | SWSTART)
    chip.run_for(PS_PER_MS)
    assert adc.read(SR) == STRT | EOC | OVR
    results = DmaResults(chip, 3)
    adc.write(SR, 0)
    adc.write(CR2, ADON)
    adc.write(CR2, ADON | DMA | SWSTART)
    chip.run_for(PS_PER_MS)
    assert (results.stored, adc.read(SR)) == ([0, 2048, 4095], STRT)


def test_continuous_scan_fills_circular_buffer(chip: NativeChip, adc: Adc) -> None:
    connect_sequence(adc, [0.0, 1.65, 3.3])
    results = DmaResults(chip, 7, circular=True)
    adc.write(CR1, SCAN)
    adc.write(CR2, ADON | CONT | DMA | DDS | SWSTART)
    chip.run_to(10 * conversion_ps())
    assert results.at(7) == [2048, 4095, 0, 0, 2048, 4095, 0]


def test_overrun_stops_scan(chip: NativeChip, adc: Adc) -> None:
    """RM0368 11.8.2: with EOCS an unread result causes an overrun. After an overrun, DR keeps the first result."""
    connect_sequence(adc, [0.0, 1.65, 3.3])
    adc.write(CR1, SCAN | OVRIE)
    adc.write(CR2, ADON | EOCS | SWSTART)
    chip.run_to(PS_PER_MS)
    assert adc.read(SR) == STRT | EOC | OVR
    assert chip.irq.level(ADC_IRQ)
    assert adc.read(DR) == 0
    adc.write(SR, 0)
    assert not chip.irq.level(ADC_IRQ)


def test_end_of_conversion_raises_interrupt(chip: NativeChip, adc: Adc) -> None:
    """RM0368 table 38: the ADC has interrupt 18."""
    adc.write(CR1, EOCIE)
    adc.write(CR2, ADON | SWSTART)
    chip.run_to(conversion_ps())
    assert chip.irq.rises == [(conversion_ps(), ADC_IRQ)]
    adc.read(DR)
    assert not chip.irq.level(ADC_IRQ)


def test_continuous_conversion_returns_voltage_at_time_of_read(chip: NativeChip, adc: Adc) -> None:
    """RM0368 11.3.5. The model converts only when DR is read, which firmware cannot detect."""
    adc.write(CR2, ADON | CONT | SWSTART)
    chip.run_to(PS_PER_MS)
    adc.inputs.battery_v = 3.0
    chip.run_to(PS_PER_S)
    assert battery_v(adc.read(DR)) == pytest.approx(3.0, abs=1e-3)
    assert not adc.read(SR) & EOC
    chip.run_for(conversion_ps())
    assert adc.read(SR) & EOC


def test_enabling_interrupt_ends_pause_of_continuous_conversion(chip: NativeChip, adc: Adc) -> None:
    """When EOCIE is set, each end of conversion raises the interrupt at its exact time."""
    adc.write(CR2, ADON | CONT | SWSTART)
    chip.run_to(PS_PER_MS)
    adc.write(CR1, EOCIE)
    for _ in range(3):
        adc.read(DR)
        chip.run_for(conversion_ps())
    assert [number for _, number in chip.irq.rises] == [ADC_IRQ] * 4


def test_clearing_cont_keeps_latest_result(chip: NativeChip, adc: Adc) -> None:
    """RM0368 11.3.5: without CONT no further conversion starts."""
    voltages = [1.0]
    connect_sequence(adc, voltages)
    adc.write(CR2, ADON | CONT | SWSTART)
    chip.run_to(PS_PER_MS)
    adc.write(CR2, ADON)
    voltages[0] = 2.0
    chip.run_for(PS_PER_MS)
    assert adc.read(DR) == code(1.0)
    chip.run_for(PS_PER_MS)
    assert adc.read(SR) == STRT


def test_input_is_connected_to_constant_voltage(chip: NativeChip, adc: Adc) -> None:
    adc.inputs.connect(3, lambda: 3.3)
    adc.inputs.connect(3, 1.1)
    adc.write(SQR3, 3)
    adc.write(CR2, ADON | SWSTART)
    chip.run_for(PS_PER_MS)
    assert adc.read(DR) == code(1.1)


@pytest.mark.parametrize("volts", [-1.0, 5.0, float("nan"), float("inf")])
def test_result_is_limited_to_range(chip: NativeChip, adc: Adc, volts: float) -> None:
    adc.inputs.connect(3, volts)
    adc.write(SQR3, 3)
    adc.write(CR2, ADON | SWSTART)
    chip.run_for(PS_PER_MS)
    assert adc.read(DR) == (4095 if volts > 3.3 else 0)


@pytest.mark.parametrize("channel", [-1, 16, 19])
def test_internal_channel_cannot_be_connected(adc: Adc, channel: int) -> None:
    with pytest.raises(ValueError, match=f"channel must be from 0 to 15, not {channel}"):
        adc.inputs.connect(channel, 1.0)


def test_error_in_voltage_function_reaches_caller(chip: NativeChip, adc: Adc) -> None:
    def fail() -> float:
        raise RuntimeError("no voltage")

    adc.inputs.connect(3, fail)
    adc.write(SQR3, 3)
    adc.write(CR2, ADON | SWSTART)
    with pytest.raises(RuntimeError, match="no voltage"):
        chip.run_for(PS_PER_MS)


def test_voltages_of_closed_chip_have_no_effect() -> None:
    """The memory of the closed chip belongs to another chip, or to nothing."""
    chip = NativeChip()
    inputs = chip.adc.inputs
    chip.fcu.close()
    inputs.battery_v = 3.0
    inputs.connect(1, lambda: 1.0)
    assert inputs.battery_v == 3.0
