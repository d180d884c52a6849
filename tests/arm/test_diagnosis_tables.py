"""Names of faults, exceptions and addresses, as in the manuals."""

from __future__ import annotations

import pytest

from fcu_emulator import Board
from fcu_emulator.emulator.chip.diagnosis.evidence import nobody
from fcu_emulator.emulator.chip.diagnosis.faults import CFSR, HFSR, decoded
from fcu_emulator.emulator.chip.diagnosis.hang import exception_name, handler_name
from fcu_emulator.emulator.chip.registers import scb
from tests.support.words import Words


@pytest.mark.parametrize(
    ("value", "names"),
    [
        (0x0000_0082, ["DACCVIOL", "MMARVALID"]),  # MMFSR, bits 7:0 (ARMv7-M ARM B3.2.15)
        (0x0000_9200, ["PRECISERR", "STKERR", "BFARVALID"]),  # BFSR, bits 15:8
        (0x0300_0000, ["UNALIGNED", "DIVBYZERO"]),  # UFSR, bits 31:16
        (0x000F_0000, ["UNDEFINSTR", "INVSTATE", "INVPC", "NOCP"]),
        (0, []),
    ],
)
def test_cfsr_is_decoded_bit_by_bit(value: int, names: list[str]) -> None:
    lines = list(decoded(scb.CFSR, value, CFSR))

    assert lines[0] == f"CFSR 0x{value:08X}"
    assert [line.split(":")[0].strip() for line in lines[1:]] == names


def test_hfsr_is_decoded_bit_by_bit() -> None:
    """ARMv7-M ARM B3.2.16."""
    lines = list(decoded(scb.HFSR, 0xC000_0002, HFSR))

    assert [line.split(":")[0].strip() for line in lines[1:]] == ["VECTTBL", "FORCED", "DEBUGEVT"]


@pytest.mark.parametrize(
    ("interrupt", "name"),
    [
        (0, "WWDG"),
        (10, "EXTI4"),
        (17, "DMA1_Stream6"),
        (18, "ADC"),
        (24, "TIM1_BRK_TIM9"),
        (33, "I2C2_EV"),
        (37, "USART1"),
        (41, "RTC_Alarm"),
        (51, "SPI3"),
        (60, "DMA2_Stream4"),
        (68, "DMA2_Stream5"),
        (73, "I2C3_ER"),
        (84, "SPI4"),
    ],
)
def test_interrupts_have_names_of_manual(interrupt: int, name: str) -> None:
    """RM0368 table 38."""
    assert exception_name(16 + interrupt) == name
    assert handler_name(16 + interrupt) == f"{name}_IRQHandler"


def test_system_exceptions_and_reserved_interrupts_are_named() -> None:
    """ARMv7-M ARM table B1-4; position 19 of RM0368 table 38 is reserved."""
    assert [handler_name(number) for number in (3, 11, 14, 15)] == [
        "HardFault_Handler",
        "SVC_Handler",
        "PendSV_Handler",
        "SysTick_Handler",
    ]
    assert exception_name(16 + 19) == "interrupt 19"


@pytest.mark.parametrize(
    ("given", "on_the_wire", "meant"),
    [
        ("LSM6DSL's other address", 0x6A, ["LSM6DSL", "0x6B", "0xD6"]),
        ("LPS22HB's other address", 0x5C, ["LPS22HB", "0x5D", "0xBA"]),
        ("0x6B not shifted", 0x35, ["0x6B", "0xD6"]),
        ("0x1E not shifted", 0x0F, ["0x1E", "0x3C"]),
        ("0x5D not shifted", 0x2E, ["0x5D", "0xBA"]),
        ("0x1E shifted twice", 0x3C, ["twice"]),
        ("something else", 0x50, ["0x50"]),
    ],
)
def test_diagnosis_of_wrong_address_shows_intended_sensor(
    given: str, on_the_wire: int, meant: list[str], words: Words
) -> None:
    """Addresses: LSM6DSL datasheet T10, LIS2MDL 5.1.1, LPS22HB 7.2.1. The HAL uses addresses with 8 bits."""
    signals = Board().signals
    cause = nobody(signals, signals.i2c["I2C2"], on_the_wire)

    assert all(part in cause.short for part in ["I2C2", f"0x{on_the_wire:02X}", *meant])
    assert cause.sentences
    words("diagnosis", cause.short)


def test_every_fault_status_bit_has_meaning() -> None:
    assert {bits.name for bits in scb.CFSR.fields} == CFSR.keys()
    assert {bits.name for bits in scb.HFSR.fields} == HFSR.keys()
