"""ADC1: battery, temperature, reference; single, scanning and continuous conversion (RM0368 section 11)."""

from __future__ import annotations

import struct
from functools import partial

import pytest

from fcu_emulator.emulator.chip.peripherals.adc import Adc, AdcInputs
from fcu_emulator.emulator.chip.peripherals.dbgmcu import SYSTEM_MEMORY, system_memory
from fcu_emulator.emulator.chip.peripherals.peripheral import InterruptInput
from fcu_emulator.emulator.clock import PS_PER_MS, PS_PER_S
from tests.support.arm.chip_fakes import Chip

# Offsets and bits (RM0368 11.12); CCR is the common register.
SR, CR1, CR2, SMPR2, SQR1, SQR3, DR, CCR = 0x00, 0x04, 0x08, 0x10, 0x2C, 0x34, 0x4C, 0x304
EOC, STRT, OVR = 1 << 1, 1 << 4, 1 << 5  # SR
EOCIE, SCAN, AWDEN, OVRIE = 1 << 5, 1 << 8, 1 << 23, 1 << 26  # CR1
ADON, CONT, DMA, DDS, EOCS, ALIGN = 1 << 0, 1 << 1, 1 << 8, 1 << 9, 1 << 10, 1 << 11  # CR2
JSWSTART, SWSTART = 1 << 22, 1 << 30  # CR2
ADCPRE_DIV4, VBATE, TSVREFE = 1 << 16, 1 << 22, 1 << 23  # CCR

ADC_IRQ = 18
BATTERY, VREFINT, TEMPERATURE = 9, 17, 18  # channels; VBATE gives 18 to the backup supply instead
HAL_TEMPERATURE = 16  # ADC_CHANNEL_TEMPSENSOR of ST's headers for the STM32F401
ADCCLK_HZ = 84_000_000 // 4  # PCLK2 over ADCPRE
SHORTEST_SAMPLING, FULL_RESOLUTION = 3, 12  # cycles of ADCCLK
VOLTS_PER_LSB = 3.3 / 4095


def conversion_ps(sampling: int = SHORTEST_SAMPLING, resolution: int = FULL_RESOLUTION) -> int:
    """RM0368 11.5: a conversion takes its sampling time and a cycle for each bit."""
    return (sampling + resolution) * PS_PER_S // ADCCLK_HZ


def battery_v(raw: int) -> float:
    """Return the battery's voltage as ST's firmware for the board computes it, with a divider of 10 kOhm over 20 kOhm."""
    return raw * VOLTS_PER_LSB * (10 + 20) / 20


@pytest.fixture
def chip() -> Chip:
    return Chip()


@pytest.fixture
def adc(chip: Chip) -> Adc:
    block = Adc(chip.soc, "ADC1", 0x4001_2000, InterruptInput(chip.soc, ADC_IRQ), AdcInputs(battery_v=3.7))
    block.write(CCR, ADCPRE_DIV4)
    block.write(SQR3, BATTERY)
    return block


def connect_sequence(adc: Adc, voltages: list[float]) -> None:
    """Put the voltages on channels 0, 1, ..., and make these channels the sequence of regular conversions."""
    for channel in range(len(voltages)):
        adc.inputs.connect(channel, partial(voltages.__getitem__, channel))
    adc.write(SQR1, (len(voltages) - 1) << 20)  # L
    adc.write(SQR3, sum(channel << 5 * channel for channel in range(len(voltages))))


def test_battery_voltage_is_read_after_conversion_time(chip: Chip, adc: Adc) -> None:
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


def test_disabled_adc_does_not_convert(chip: Chip, adc: Adc) -> None:
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
    chip: Chip, adc: Adc, channel: int, with_tsvrefe_v: float, with_vbate_v: float
) -> None:
    """RM0368 11.9, 11.10; datasheet: 0.76 V at 25 degC, 2.5 mV/degC, reference 1.21 V. The die has 30 degC."""
    adc.write(SQR3, channel)
    for switched_on, volts in ((0, 0.0), (TSVREFE, with_tsvrefe_v), (VBATE, with_vbate_v)):
        adc.write(CCR, ADCPRE_DIV4 | switched_on)
        adc.write(CR2, ADON | SWSTART)
        chip.run_for(PS_PER_MS)
        assert adc.read(DR) * VOLTS_PER_LSB == pytest.approx(volts, abs=5e-4)


def test_factory_calibration_agrees_with_sensor(chip: Chip, adc: Adc) -> None:
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
    chip: Chip, adc: Adc, resolution: int, bits: int
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


def test_sampling_time_lengthens_conversion(chip: Chip, adc: Adc) -> None:
    """RM0368 11.5: SMP9 = 7 is 480 cycles."""
    adc.write(SMPR2, 7 << 27)  # SMP9
    adc.write(CR2, ADON | SWSTART)
    chip.run_to(conversion_ps(sampling=480) - 1)
    assert not adc.read(SR) & EOC
    chip.run_for(1)
    assert adc.read(SR) & EOC


def test_dma_reads_each_result_of_scan(chip: Chip, adc: Adc) -> None:
    """RM0368 11.8.1: each conversion makes a request."""
    connect_sequence(adc, [0.0, 1.65, 3.3])
    taken: list[int] = []
    chip.dma.serve("ADC1", lambda: taken.append(adc.read(DR)))
    adc.write(CR1, SCAN)
    adc.write(CR2, ADON | DMA | SWSTART)
    chip.run_to(3 * conversion_ps())
    assert taken == [0, 2048, 4095]
    chip.run_for(PS_PER_MS)
    assert len(taken) == 3


def test_requests_stop_after_final_transfer_without_dds(chip: Chip, adc: Adc) -> None:
    """RM0368 11.12.3, DDS. Writing 0 and then 1 to DMA makes requests possible again (11.8.1)."""
    results: list[int] = []
    chip.dma.serve("ADC1", lambda: results.append(adc.read(DR)))
    adc.write(CR2, ADON | DMA | SWSTART)
    chip.run_for(PS_PER_MS)
    adc.write(CR2, ADON | DMA | SWSTART)
    chip.run_for(PS_PER_MS)
    assert len(chip.dma.requests) == 1
    adc.write(SR, 0)  # EOC of the result that nobody has fetched: the next one would be lost
    adc.write(CR2, ADON)
    for _ in range(2):
        adc.write(CR2, ADON | DMA | DDS | SWSTART)
        chip.run_for(PS_PER_MS)
    assert len(results) == 3


def test_overrun_stops_scan(chip: Chip, adc: Adc) -> None:
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


def test_end_of_conversion_raises_interrupt(chip: Chip, adc: Adc) -> None:
    """RM0368 table 38: the ADC has interrupt 18."""
    adc.write(CR1, EOCIE)
    adc.write(CR2, ADON | SWSTART)
    chip.run_to(conversion_ps())
    assert chip.irq.rises == [(conversion_ps(), ADC_IRQ)]
    adc.read(DR)
    assert not chip.irq.level(ADC_IRQ)


def test_continuous_conversion_returns_voltage_at_time_of_read(chip: Chip, adc: Adc) -> None:
    """RM0368 11.3.5. The model converts only when DR is read, which firmware cannot detect."""
    adc.write(CR2, ADON | CONT | SWSTART)
    chip.run_to(PS_PER_MS)
    adc.inputs.battery_v = 3.0
    chip.run_to(PS_PER_S)
    assert battery_v(adc.read(DR)) == pytest.approx(3.0, abs=1e-3)
    assert not adc.read(SR) & EOC
    chip.run_for(conversion_ps())
    assert adc.read(SR) & EOC


def test_unmodelled_conversions_are_noted(chip: Chip, adc: Adc) -> None:
    """Unmodelled conversions are injected conversions and the analog watchdog."""
    adc.write(CR2, JSWSTART)
    adc.write(CR1, AWDEN)
    assert [what for what, _ in chip.notes()] == ["not modelled", "not modelled"]
