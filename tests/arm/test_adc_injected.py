"""ADC1: injected group, discontinuous mode, analog watchdog (RM0368 sections 11.3.7 to 11.3.10)."""

from __future__ import annotations

import pytest

from fcu_emulator.emulator.chip.peripherals.adc import Adc
from fcu_emulator.emulator.clock import PS_PER_MS
from tests.support.arm.adc_bench import (
    ADC_IRQ,
    ADCPRE_DIV4,
    ADON,
    ALIGN,
    AWD,
    AWDEN,
    AWDIE,
    AWDSGL,
    CCR,
    CONT,
    CR1,
    CR2,
    DDS,
    DISCEN,
    DMA,
    DR,
    EOC,
    EOCS,
    HTR,
    JAUTO,
    JAWDEN,
    JDISCEN,
    JDR,
    JEOC,
    JEOCIE,
    JOFR,
    JSQR,
    JSTRT,
    JSWSTART,
    LTR,
    OVR,
    SCAN,
    SMPR2,
    SQR1,
    SQR2,
    SR,
    STRT,
    SWSTART,
    VOLTS_PER_LSB,
    DmaResults,
    code,
    connect,
    conversion_ps,
    injected_sequence,
    regular_sequence,
)
from tests.support.arm.chip_fakes import NativeChip

VOLTAGES = [n / 4 for n in range(12)]
"""The voltages of channels 0 to 11."""
CODES = [code(volts) for volts in VOLTAGES]


@pytest.fixture
def chip() -> NativeChip:
    return NativeChip()


@pytest.fixture
def adc(chip: NativeChip) -> Adc:
    chip.adc.write(CCR, ADCPRE_DIV4)
    connect(chip.adc, VOLTAGES)
    return chip.adc


def results(adc: Adc) -> list[int]:
    """Return JDR1 to JDR4."""
    return [adc.read(register) for register in JDR]


# -- injected group -----------------------------------------------------------------------------------------


def test_injected_conversion_is_stored_in_jdr1(chip: NativeChip, adc: Adc) -> None:
    """RM0368 11.3.4: JDR1 has the result, JEOC is set. JSQ4 selects the only channel (11.12.12)."""
    adc.write(JSQR, 5 << 15 | 1)
    adc.write(CR1, JEOCIE)
    adc.write(CR2, ADON | JSWSTART)
    chip.run_to(conversion_ps() - 1)
    assert adc.read(SR) == JSTRT
    chip.run_to(conversion_ps())
    assert (adc.read(SR), results(adc)) == (JSTRT | JEOC, [CODES[5], 0, 0, 0])
    assert chip.irq.rises == [(conversion_ps(), ADC_IRQ)]
    adc.write(SR, ~JEOC & 0x3F)
    assert not chip.irq.level(ADC_IRQ)
    assert adc.read(DR) == 0


@pytest.mark.parametrize("channels", [[1], [4, 2], [7, 3, 1], [1, 2, 3, 4]])
def test_injected_sequence_ends_with_jsq4(chip: NativeChip, adc: Adc, channels: list[int]) -> None:
    """RM0368 11.12.12: a sequence of n channels starts with JSQ(5 - n). Its results are in JDR1 to JDRn."""
    injected_sequence(adc, channels)
    adc.write(CR1, SCAN)
    adc.write(CR2, ADON | JSWSTART)
    chip.run_to(len(channels) * conversion_ps() - 1)
    assert not adc.read(SR) & JEOC
    chip.run_for(1)
    assert adc.read(SR) & JEOC
    assert results(adc) == [*(CODES[channel] for channel in channels), 0, 0, 0][:4]


@pytest.mark.parametrize(
    ("resolution", "left", "expected"),
    [
        (0, False, [0xFF9C, 0x0064]),  # 1000 - 1100, 1000 - 900
        (0, True, [0xFCE0, 0x0320]),  # SEXT, D11 to D0, 3 zeros
        (3, False, [0xFFC3, 0x000F]),  # 15 - 76, 15 - 0
        (3, True, [0xFF86, 0x001E]),  # SEXT, D5 to D0, 1 zero, in a byte
    ],
)
def test_offset_is_subtracted_with_sign(
    chip: NativeChip, adc: Adc, resolution: int, left: bool, expected: list[int]
) -> None:
    """RM0368 11.4: a negative result has its sign in the upper bits."""
    adc.inputs.connect(1, 1000 * VOLTS_PER_LSB)
    injected_sequence(adc, [1, 1])
    for register, offset in zip(JOFR, (1100, 900) if resolution == 0 else (76, 0), strict=False):
        adc.write(register, offset)
    adc.write(CR1, SCAN | resolution << 24)
    adc.write(CR2, ADON | JSWSTART | ALIGN * left)
    chip.run_for(PS_PER_MS)
    assert results(adc)[:2] == expected


def test_injected_group_interrupts_regular_conversion(chip: NativeChip, adc: Adc) -> None:
    """RM0368 11.3.9: the regular conversion is reset, and the group resumes with it afterwards."""
    regular_sequence(adc, [1, 2, 3])
    injected_sequence(adc, [7, 8])
    dma = DmaResults(chip, 3)
    adc.write(CR1, SCAN)
    adc.write(CR2, ADON | DMA | SWSTART)
    begun_ps = conversion_ps() * 3 // 2  # in the middle of the second conversion
    chip.run_to(begun_ps)
    adc.write(CR2, ADON | DMA | JSWSTART)
    chip.run_to(begun_ps + 2 * conversion_ps())
    assert adc.read(SR) == STRT | JSTRT | JEOC
    assert (dma.stored, results(adc)[:2]) == ([CODES[1]], [CODES[7], CODES[8]])
    chip.run_to(begun_ps + 4 * conversion_ps() - 1)
    assert dma.stored == [CODES[1], CODES[2]]
    chip.run_for(1)
    assert dma.stored == [CODES[1], CODES[2], CODES[3]]


def test_regular_start_waits_for_injected_group(chip: NativeChip, adc: Adc) -> None:
    """RM0368 11.3.9: a regular trigger does not interrupt the injected group."""
    regular_sequence(adc, [1])
    injected_sequence(adc, [7, 8])
    adc.write(CR1, SCAN)
    adc.write(CR2, ADON | JSWSTART)
    chip.run_to(conversion_ps() // 2)
    adc.write(CR2, ADON | SWSTART)
    chip.run_to(3 * conversion_ps() - 1)
    assert adc.read(SR) == STRT | JSTRT | JEOC
    chip.run_for(1)
    assert (adc.read(SR) & EOC, adc.read(DR)) == (EOC, CODES[1])


def test_regular_start_does_not_restart_interrupted_group(chip: NativeChip, adc: Adc) -> None:
    """RM0368 11.3.9: the regular group resumes with the interrupted conversion, not with its first channel."""
    regular_sequence(adc, [1, 2])
    injected_sequence(adc, [7])
    dma = DmaResults(chip, 5)
    adc.write(CR1, SCAN)
    adc.write(CR2, ADON | DMA | SWSTART)
    chip.run_to(conversion_ps() * 3 // 2)
    adc.write(CR2, ADON | DMA | JSWSTART)
    adc.write(CR2, ADON | DMA | SWSTART)
    chip.run_for(PS_PER_MS)
    assert dma.stored == [CODES[1], CODES[2]]


def test_injected_group_delays_continuous_conversion(chip: NativeChip, adc: Adc) -> None:
    """If firmware reads a result of continuous conversion during the injected group, the next result follows later."""
    regular_sequence(adc, [1])
    injected_sequence(adc, [7])
    adc.write(CR2, ADON | CONT | SWSTART)
    chip.run_to(PS_PER_MS)
    adc.write(CR2, ADON | CONT | JSWSTART)
    chip.run_for(conversion_ps() // 2)
    assert adc.read(DR) == CODES[1]
    chip.run_to(PS_PER_MS + 2 * conversion_ps() - 1)
    assert adc.read(SR) == STRT | JSTRT | JEOC
    chip.run_for(1)
    assert adc.read(SR) == STRT | JSTRT | JEOC | EOC


def test_jauto_converts_injected_group_after_regular(chip: NativeChip, adc: Adc) -> None:
    """RM0368 11.3.9, auto-injection."""
    regular_sequence(adc, [1, 2])
    injected_sequence(adc, [7, 8])
    adc.write(CR1, SCAN | JAUTO)
    adc.write(CR2, ADON | SWSTART)
    chip.run_to(4 * conversion_ps() - 1)
    assert adc.read(SR) == STRT | JSTRT | EOC
    chip.run_for(1)
    assert adc.read(SR) == STRT | JSTRT | EOC | JEOC
    assert (adc.read(DR), results(adc)[:2]) == (CODES[2], [CODES[7], CODES[8]])
    adc.write(SR, 0)
    chip.run_for(PS_PER_MS)
    assert adc.read(SR) == 0


def test_jauto_with_cont_repeats_both_groups(chip: NativeChip, adc: Adc) -> None:
    """RM0368 11.3.9: with CONT, regular and injected channels are converted continuously."""
    regular_sequence(adc, [1])
    injected_sequence(adc, [7])
    adc.write(CR1, JAUTO)
    adc.write(CR2, ADON | CONT | SWSTART)
    for _ in range(5):
        adc.write(SR, 0)
        chip.run_for(conversion_ps())
        assert adc.read(SR) & (EOC | JEOC) == EOC
        chip.run_for(conversion_ps())
        assert adc.read(SR) & (EOC | JEOC) == EOC | JEOC


def test_overrun_does_not_stop_injected_group(chip: NativeChip, adc: Adc) -> None:
    """RM0368 11.8.1: overruns do not affect injected channels."""
    regular_sequence(adc, [1, 2])
    injected_sequence(adc, [7])
    adc.write(CR1, SCAN)
    adc.write(CR2, ADON | EOCS | SWSTART)
    chip.run_for(PS_PER_MS)
    adc.write(CR2, ADON | EOCS | JSWSTART)
    chip.run_for(PS_PER_MS)
    assert adc.read(SR) == STRT | JSTRT | EOC | JEOC | OVR
    assert results(adc)[0] == CODES[7]


def test_injected_group_has_sampling_time_of_channel(chip: NativeChip, adc: Adc) -> None:
    """RM0368 11.5: SMP7 = 7 is 480 cycles."""
    injected_sequence(adc, [7])
    adc.write(SMPR2, 7 << 21)
    adc.write(CR2, ADON | JSWSTART)
    chip.run_to(conversion_ps(sampling=480) - 1)
    assert not adc.read(SR) & JEOC
    chip.run_for(1)
    assert adc.read(SR) & JEOC


@pytest.mark.parametrize("control", [0, JSWSTART])
def test_injected_group_needs_adon(chip: NativeChip, adc: Adc, control: int) -> None:
    """RM0368 11.3.1. Clearing ADON also ends the conversions."""
    adc.write(CR2, control)
    chip.run_for(PS_PER_MS)
    adc.write(CR2, ADON | JSWSTART)
    adc.write(CR2, 0)
    chip.run_for(PS_PER_MS)
    assert adc.read(SR) == JSTRT


# -- discontinuous mode -------------------------------------------------------------------------------------


def test_discontinuous_mode_converts_subgroups(chip: NativeChip, adc: Adc) -> None:
    """RM0368 11.3.10, the manual's example: n = 3, channels 0, 1, 2, 3, 6, 7, 9, 10."""
    channels = [0, 1, 2, 3, 6, 7, 9, 10]
    regular_sequence(adc, channels[:6])
    adc.write(SQR1, 7 << 20)  # L
    adc.write(SQR2, 9 | 10 << 5)
    adc.write(CR1, SCAN | DISCEN | (3 - 1) << 13)
    dma = DmaResults(chip, 20)
    counts = []
    for _ in range(4):
        adc.write(CR2, ADON | DMA | DDS | SWSTART)
        chip.run_for(PS_PER_MS)
        counts.append(len(dma.stored))
    assert counts == [3, 6, 8, 11]
    assert dma.stored == [CODES[channel] for channel in [*channels, 0, 1, 2]]


def test_discontinuous_conversion_sets_eoc_each_time(chip: NativeChip, adc: Adc) -> None:
    """RM0368 11.3.10: each conversion sets EOC, so that software can read each channel after its trigger."""
    regular_sequence(adc, [4, 5])
    adc.write(CR1, SCAN | DISCEN)
    seen = []
    for _ in range(3):
        adc.write(CR2, ADON | SWSTART)
        chip.run_for(PS_PER_MS)
        assert adc.read(SR) == STRT | EOC
        seen.append(adc.read(DR))
    assert seen == [CODES[4], CODES[5], CODES[4]]


def test_injected_discontinuous_mode_converts_single_channels(chip: NativeChip, adc: Adc) -> None:
    """RM0368 11.3.10, the manual's example: channels 1, 2, 3. JEOC follows the third one."""
    injected_sequence(adc, [1, 2, 3])
    adc.write(CR1, SCAN | JDISCEN)
    seen = []
    for _ in range(4):
        adc.write(SR, 0)
        adc.write(CR2, ADON | JSWSTART)
        chip.run_for(PS_PER_MS)
        seen.append((adc.read(SR) & JEOC, results(adc)[:3]))
    assert seen == [
        (0, [CODES[1], 0, 0]),
        (0, [CODES[1], CODES[2], 0]),
        (JEOC, [CODES[1], CODES[2], CODES[3]]),
        (0, [CODES[1], CODES[2], CODES[3]]),
    ]


# -- analog watchdog ----------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("low", "high", "raised"), [(0, 999, True), (0, 1000, False), (1000, 4095, False), (1001, 4095, True)]
)
def test_watchdog_compares_result_with_thresholds(
    chip: NativeChip, adc: Adc, low: int, high: int, raised: bool
) -> None:
    """RM0368 11.3.7: AWD is set below LTR and above HTR, independent of the alignment."""
    adc.inputs.connect(1, 1000 * VOLTS_PER_LSB)
    regular_sequence(adc, [1])
    adc.write(LTR, low)
    adc.write(HTR, high)
    adc.write(CR1, AWDEN | AWDIE)
    adc.write(CR2, ADON | ALIGN | SWSTART)
    chip.run_for(PS_PER_MS)
    assert adc.read(SR) == STRT | EOC | AWD * raised
    assert chip.irq.rises == [(conversion_ps(), ADC_IRQ)] * raised
    adc.write(SR, ~AWD & 0x3F)
    assert not chip.irq.level(ADC_IRQ)


@pytest.mark.parametrize(
    ("control", "regular", "injected"),
    [
        (0, False, False),
        (JAWDEN, False, True),
        (AWDEN, True, False),
        (AWDEN | JAWDEN, True, True),
        (AWDSGL | JAWDEN | 1, False, False),
        (AWDSGL | JAWDEN | 2, False, True),
        (AWDSGL | AWDEN | 1, True, False),
        (AWDSGL | AWDEN | 2, False, False),
    ],
)
def test_watchdog_guards_selected_channels(
    chip: NativeChip, adc: Adc, control: int, regular: bool, injected: bool
) -> None:
    """RM0368 11.3.7. Channel 1 is regular, channel 2 is injected; AWDCH selects the single channel."""
    regular_sequence(adc, [1])
    injected_sequence(adc, [2])
    adc.write(LTR, 4095)
    adc.write(CR1, control)
    seen = []
    for start in (SWSTART, JSWSTART):
        adc.write(SR, 0)
        adc.write(CR2, ADON | start)
        chip.run_for(PS_PER_MS)
        seen.append(bool(adc.read(SR) & AWD))
    assert seen == [regular, injected]


def test_watchdog_notices_change_during_continuous_conversion(chip: NativeChip, adc: Adc) -> None:
    voltages = [1.0]
    connect(adc, voltages)
    adc.write(HTR, code(2.0))
    adc.write(CR1, AWDEN | AWDIE)
    adc.write(CR2, ADON | CONT | SWSTART)
    chip.run_for(PS_PER_MS)
    assert not chip.irq.level(ADC_IRQ)
    voltages[0] = 2.5
    chip.run_for(conversion_ps())
    assert chip.irq.level(ADC_IRQ)


def test_reset_ends_injected_conversion(chip: NativeChip, adc: Adc) -> None:
    adc.write(JOFR[2], 5)
    adc.write(CR2, ADON | JSWSTART)
    adc.reset()
    chip.run_for(PS_PER_MS)
    assert [adc.read(offset) for offset in (SR, CR1, CR2, JOFR[2], HTR, LTR)] == [0, 0, 0, 0, 0xFFF, 0]
