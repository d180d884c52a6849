"""FLASH, PWR, CRC, DBGMCU, RTC and the memory map (RM0368 sections 2 to 5, 17, 23, 24)."""

from __future__ import annotations

import binascii
import struct
from datetime import UTC, datetime, timedelta
from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from fcu_emulator.emulator.chip.chip import SystemPeripherals
from fcu_emulator.emulator.chip.cpu.python_peripherals import NOT_MODELLED
from fcu_emulator.emulator.chip.peripherals.dbgmcu import SYSTEM_MEMORY, system_memory
from fcu_emulator.emulator.clock import PS_PER_MS, PS_PER_S, PS_PER_US
from tests.support.arm.chip_fakes import Chip, NativeChip
from tests.support.words import Words

ACR, KEYR, SR, CR = 0x00, 0x04, 0x0C, 0x10
RCC_CSR = 0x74
KEYS = (0x4567_0123, 0xCDEF_89AB)
LSION, RTC_ON_LSI = 1, 1 << 15 | 2 << 8
RTC_TR, RTC_DR, RTC_ISR, RTC_PRER, RTC_WPR, RTC_SSR, BKP0R = 0x00, 0x04, 0x0C, 0x10, 0x24, 0x28, 0x50
INIT, INITF, RSF = 1 << 7, 1 << 6, 1 << 5


@pytest.fixture
def chip() -> Chip:
    return Chip()


@pytest.fixture
def blocks(chip: Chip) -> SystemPeripherals:
    return SystemPeripherals(chip.soc)


# -- the map ------------------------------------------------------------------------------------------------


def test_peripherals_do_not_overlap(blocks: SystemPeripherals) -> None:
    """RM0368 table 1."""
    places = sorted((block.base, block.base + block.size, block.name) for block in blocks)
    assert all(end <= begin for (_, end, _), (begin, _, _) in pairwise(places))
    assert len({name for *_, name in places}) == len(places)


def test_every_register_has_name_and_reset_value(blocks: SystemPeripherals) -> None:
    for block in blocks:
        missing = [hex(offset) for offset in block.registers if offset not in block.NAMES]
        assert (block.name, missing) == (block.name, [])


def test_reset_restores_every_peripheral(blocks: SystemPeripherals) -> None:
    """The RTC, DBGMCU, and the reset flags of RCC, which RMVF clears, are not restored."""
    before = {block.name: dict(block.registers) for block in blocks}
    for block in blocks:
        for offset in block.NAMES:
            if block.name not in {"WWDG", "IWDG", "RTC", "DBGMCU"} and (block.name, offset) != (
                "RCC",
                RCC_CSR,
            ):
                block.write(offset, 0x1111_1111)
    for block in blocks:
        block.reset()
    assert {block.name: dict(block.registers) for block in blocks} == before


@pytest.mark.parametrize("name", NOT_MODELLED)
def test_unmodelled_peripheral_is_noted_once(chip: Chip, blocks: SystemPeripherals, name: str) -> None:
    block = next(one for one in blocks.named if one.name == name)
    assert [block.read(0), block.read(4)] == [0, 0]
    block.write(0, 1)
    assert len(chip.notes()) == 1


def test_usb_core_reset_ends_without_cable(chip: Chip, blocks: SystemPeripherals) -> None:
    """USB_CoreReset() of ST's driver, followed by its set-up; RM0368 22.16: GRSTCTL, GUSBCFG, GINTSTS."""
    otg = blocks.otg
    assert otg.read(0x10) >> 31
    otg.write(0x10, 1)
    assert otg.read(0x10) == 1 << 31
    for mode, current in ((1 << 29, 1), (1 << 30, 0)):
        otg.write(0x0C, mode)
        assert otg.read(0x14) & 1 == current
    for flush in (1 << 5 | 0x10 << 6, 1 << 4):
        otg.write(0x10, flush)
        assert otg.read(0x10) == 1 << 31
    otg.write(0x804, 2)
    assert otg.read(0x804) == 2
    assert [what for what, _ in chip.notes()] == ["not modelled"]


@pytest.mark.parametrize(
    ("offset", "value"),
    [
        *((0x000, 0x0001_0000), (0x00C, 0x0000_0A00), (0x014, 0x0400_0020), (0x024, 0x0000_0200)),
        *((0x028, 0x0000_0200), (0x02C, 0x0008_0200), (0x03C, 0x0000_1000), (0x100, 0x0200_0600)),
        *((0x104, 0x0200_0400), (0x108, 0x0200_0400), (0x10C, 0x0200_0400)),
        *((0x404, 0x0000_EA60), (0x408, 0x0000_3FFF), (0x410, 0x0008_0100)),
        *((0x800, 0x0220_0000), (0x808, 0x0000_0010), (0x828, 0x0000_17D7), (0x82C, 0x0000_05B8)),
        *((0x900, 0x0000_8000), (0x908, 0x0000_0080), (0x968, 0x0000_0080), (0x978, 0x0000_0200)),
        *((0xB00, 0x0000_8000), (0xB08, 0x0000_0080), (0xB68, 0x0000_0080), (0xE00, 0)),
    ],
)
def test_usb_core_has_documented_reset_value(blocks: SystemPeripherals, offset: int, value: int) -> None:
    """RM0368 22.16: reset values of the global, host, device and power registers."""
    blocks.otg.write(0x104, 0x0040_0300)
    blocks.otg.write(0x10, 1)
    assert blocks.otg.read(offset) == value


def test_usb_without_cable_has_no_session(blocks: SystemPeripherals) -> None:
    """GOTGCTL.BSVLD, and the reset and enumeration flags of GINTSTS."""
    otg = blocks.otg
    otg.write(0x08, 1)
    otg.write(0x1000, 0x1234)
    assert not otg.read(0x00) & 1 << 19
    assert not otg.read(0x14) & 0x3 << 12


# -- flash --------------------------------------------------------------------------------------------------


def test_byte_write_of_latency_keeps_other_bits(blocks: SystemPeripherals) -> None:
    """ST's firmware: ACR 0x700, then a byte write of 2."""
    blocks.flash.write(ACR, 0x700)
    blocks.flash.write(ACR, 0x02, 0xFF)
    assert blocks.flash.read(ACR) == 0x702


def test_lasting_lack_of_flash_wait_states_is_noted(
    chip: Chip, blocks: SystemPeripherals, words: Words
) -> None:
    """RM0368 table 5: 84 MHz needs 2 wait states at 2.7 to 3.6 V."""
    blocks.pwr.write(0, 0)
    rcc = blocks.rcc
    rcc.write(0x04, 0x0741_5410 & ~(1 << 22))  # from HSI
    rcc.write(0x00, rcc.read(0x00) | 1 << 24)
    chip.run_for(PS_PER_MS)
    rcc.write(0x08, 0x1002)
    blocks.flash.write(ACR, 1)
    chip.run_for(2 * PS_PER_MS)
    ((what, text),) = chip.notes()
    assert what == "forbidden"
    words("chip", text)


def test_flash_control_needs_both_keys(chip: Chip, blocks: SystemPeripherals) -> None:
    """RM0368 3.6.1."""
    flash = blocks.flash
    flash.write(CR, 1 << 1)
    assert flash.read(CR) == 1 << 31
    for key in KEYS:
        flash.write(KEYR, key)
    flash.write(CR, 1 << 1)
    assert flash.read(CR) == 1 << 1
    flash.write(CR, 1 << 31)
    assert flash.read(CR) >> 31


def test_wrong_key_locks_until_reset(blocks: SystemPeripherals) -> None:
    flash = blocks.flash
    for key in (KEYS[0], 5, *KEYS):
        flash.write(KEYR, key)
    assert flash.read(CR) >> 31
    flash.reset()
    for key in KEYS:
        flash.write(KEYR, key)
    assert not flash.read(CR) >> 31


@pytest.fixture
def memory(blocks: SystemPeripherals) -> bytearray:
    """Return the flash, completely programmed, with an unlocked interface."""
    content = bytearray(256 * 1024)
    blocks.flash.connect(memoryview(content), lambda _offset, _size: None, lambda: None)
    for key in KEYS:
        blocks.flash.write(KEYR, key)
    return content


PG, SER, MER, X32, STRT, EOPIE, ERRIE = 1 << 0, 1 << 1, 1 << 2, 2 << 8, 1 << 16, 1 << 24, 1 << 25  # CR
EOP, OPERR, PGPERR, PGSERR, BSY = 1 << 0, 1 << 1, 1 << 6, 1 << 7, 1 << 16  # SR


def test_flash_programming_only_clears_bits(chip: Chip, blocks: SystemPeripherals, memory: bytearray) -> None:
    """RM0368 3.6.3: bits change only from 1 to 0; datasheet: 16 us for a word."""
    flash = blocks.flash
    memory[0x8000:0x8004] = b"\xff\x0f\xff\xff"
    flash.write(CR, PG | X32 | EOPIE)
    assert flash.store(0x8000, 4, 0x1234_5678)
    assert flash.read(SR) == BSY
    chip.run_for(16 * PS_PER_US - 1)
    assert flash.read(SR) == BSY
    chip.run_for(1)
    assert flash.read(SR) == EOP
    assert chip.irq.level(4)
    assert memory[0x8000:0x8004] == b"\x78\x06\x34\x12"


@pytest.mark.parametrize(
    ("control", "size", "errors"),
    [(0, 1, PGSERR), (0, 4, PGSERR | PGPERR), (PG, 4, PGPERR), (PG | X32, 1, PGPERR), (X32, 4, PGSERR)],
)
def test_flash_refuses_store_without_valid_control_bits(
    chip: Chip, blocks: SystemPeripherals, memory: bytearray, control: int, size: int, errors: int
) -> None:
    """RM0368 3.8.4: PGSERR, PGPERR; OPERR "only if error interrupts are enabled"."""
    flash = blocks.flash
    memory[:4] = b"\xff" * 4
    flash.write(CR, control)
    assert not flash.store(0, size, 0)
    assert flash.read(SR) == errors
    flash.write(CR, control | ERRIE)
    assert not flash.store(0, size, 0)
    assert flash.read(SR) == errors | OPERR
    assert chip.irq.level(4)
    assert memory[:4] == b"\xff" * 4
    flash.write(SR, errors | OPERR)
    assert flash.read(SR) == 0
    assert not chip.irq.level(4)


@pytest.mark.parametrize(
    ("control", "begin", "end", "milliseconds"),
    [
        (SER | 0 << 3, 0, 0x4000, 400),
        (SER | 3 << 3 | X32, 0xC000, 0x1_0000, 250),
        (SER | 4 << 3 | X32, 0x1_0000, 0x2_0000, 550),
        (SER | 5 << 3 | X32, 0x2_0000, 0x4_0000, 1000),
        (MER | X32, 0, 0x4_0000, 2000),
    ],
)
def test_flash_erases_selected_sectors(
    chip: Chip,
    blocks: SystemPeripherals,
    memory: bytearray,
    control: int,
    begin: int,
    end: int,
    milliseconds: int,
) -> None:
    """RM0368 table 5 (STM32F401xC); datasheet: typical times at 2.7 to 3.6 V."""
    flash = blocks.flash
    flash.write(CR, control)
    flash.write(CR, control | STRT)
    assert flash.read(CR) == control | STRT
    chip.run_for(milliseconds * PS_PER_MS - 1)
    assert flash.read(SR) == BSY
    chip.run_for(1)
    assert (flash.read(SR), flash.read(CR)) == (0, control)
    assert memory == bytes(begin) + b"\xff" * (end - begin) + bytes(len(memory) - end)


@pytest.mark.parametrize("control", [0, SER | MER, SER | 6 << 3])
def test_flash_erases_nothing_without_selection(
    blocks: SystemPeripherals, memory: bytearray, control: int
) -> None:
    blocks.flash.write(CR, control | STRT)
    assert blocks.flash.read(CR) == control
    assert not any(memory)


# -- power, CRC, identity -----------------------------------------------------------------------------------


def test_power_control_has_flags(blocks: SystemPeripherals) -> None:
    """RM0368 5.4.1: CWUF and CSBF are read as 0, and VOSRDY is set."""
    blocks.pwr.write(0, 0x8100 | 0xC)
    assert blocks.pwr.read(0) == 0x8100
    assert blocks.pwr.read(4) == 1 << 14
    assert blocks.pwr.backup_writable


def test_system_reset_keeps_debug_configuration(blocks: SystemPeripherals) -> None:
    """RM0368 23.16.1: only power-on resets DBGMCU_CR."""
    blocks.dbgmcu.write(4, 7)
    blocks.dbgmcu.reset()
    assert blocks.dbgmcu.read(4) == 7


def test_wake_up_pin_sets_flag_while_enabled(chip: Chip, blocks: SystemPeripherals) -> None:
    """RM0368 5.4.2: WUF; a high level counts as an edge when EWUP is set. A system reset clears WUF."""
    chip.gpio.drive("A", 0, 1)
    assert not blocks.pwr.read(4) & 1
    blocks.pwr.write(4, 1 << 8)
    assert blocks.pwr.read(4) & 1
    blocks.pwr.write(0, 1 << 2)
    assert not blocks.pwr.read(4) & 1
    chip.gpio.drive("A", 0, 0)
    chip.gpio.drive("A", 0, 1)
    assert blocks.pwr.read(4) & 1
    blocks.pwr.reset()
    assert blocks.pwr.read(4) == 1 << 14


@given(st.lists(st.integers(0, 0xFFFF_FFFF), max_size=8))
def test_crc_uses_ethernet_polynomial_without_reflection(words: list[int]) -> None:
    """RM0368 4.2. The standard library's CRC-32 is reflected and inverted."""
    crc = NativeChip()["CRC"]
    crc.write(0x08, 1)
    for word in words:
        crc.write(0x00, word)
    reflected = b"".join(int(f"{word:032b}"[::-1], 2).to_bytes(4, "little") for word in words)
    expected = int(f"{binascii.crc32(reflected) ^ 0xFFFF_FFFF:032b}"[::-1], 2)
    assert crc.read(0x00) == expected


def test_reset_bit_of_crc_keeps_stored_byte() -> None:
    crc = NativeChip()["CRC"]
    crc.write(0x00, 1)
    crc.write(0x04, 0x1AB)
    crc.write(0x08, 1)
    assert (crc.read(0x00), crc.read(0x04)) == (0xFFFF_FFFF, 0xAB)
    crc.write(0x00, 1)
    crc.reset()
    assert (crc.read(0x00), crc.read(0x04)) == (0xFFFF_FFFF, 0)


def test_device_and_unique_id_equal_manual() -> None:
    """RM0368 23.6.1: STM32F401xB/C is device 0x423; section 24: flash size in KiB at 0x1FFF7A22."""
    assert SystemPeripherals(Chip().soc).dbgmcu.read(0) & 0xFFF == 0x423
    memory = system_memory(7)
    assert all(struct.unpack_from("<3I", system_memory(0), 0x10))
    assert struct.unpack_from("<H", memory, 0x1FFF_7A22 - SYSTEM_MEMORY) == (256,)
    assert memory[0x10:0x1C] != system_memory(8)[0x10:0x1C]


# -- RTC ----------------------------------------------------------------------------------------------------


def start_rtc(chip: Chip, blocks: SystemPeripherals, time: int, date: int) -> None:
    """Start the RTC on LSI with 128 * 250 cycles a second."""
    blocks.pwr.write(0, 1 << 8)
    blocks.rcc.write(0x74, LSION)
    blocks.rcc.write(0x70, RTC_ON_LSI)
    chip.run_for(15 * PS_PER_US)
    rtc = blocks.rtc
    for offset, value in ((RTC_WPR, 0xCA), (RTC_WPR, 0x53), (RTC_ISR, INIT), (RTC_PRER, 127 << 16 | 249)):
        rtc.write(offset, value)
    assert rtc.read(RTC_ISR) & INITF
    for offset, value in ((RTC_TR, time), (RTC_DR, date), (RTC_ISR, 0), (RTC_WPR, 0xFF)):
        rtc.write(offset, value)


def test_calendar_advances_to_leap_day(chip: Chip, blocks: SystemPeripherals) -> None:
    """RM0368 17.3: Wednesday, 28 February 2024, 23:59:58 is followed by the 29th."""
    start_rtc(chip, blocks, 0x23_5958, 0x24_6228)
    rtc = blocks.rtc
    assert (rtc.read(RTC_TR), rtc.read(RTC_DR)) == (0x23_5958, 0x24_6228)
    chip.run_for(PS_PER_S // 2)
    assert rtc.read(RTC_SSR) == 249 - 125
    rtc.read(RTC_DR)  # unlock the shadow registers (17.3.6)
    chip.run_for(5 * PS_PER_S // 2)
    assert (rtc.read(RTC_TR), rtc.read(RTC_DR)) == (0x00_0001, 0x24_8229)
    assert rtc.read(RTC_ISR) & (RSF | 1 << 4) == RSF | 1 << 4


@given(
    st.datetimes(datetime(2000, 1, 1), datetime(2099, 12, 31)).map(lambda day: day.replace(tzinfo=UTC)),
    st.integers(0, 10**6),
)
def test_calendar_agrees_with_standard_library(start: datetime, seconds: int) -> None:
    chip = Chip()
    blocks = SystemPeripherals(chip.soc)
    start = start.replace(microsecond=0)
    bcd = {fmt: int(start.strftime(fmt), 16) for fmt in ("%H%M%S", "%y", "%m", "%d")}
    date = bcd["%y"] << 16 | start.isoweekday() << 13 | bcd["%m"] << 8 | bcd["%d"]
    start_rtc(chip, blocks, bcd["%H%M%S"], date)
    chip.run_for(seconds * PS_PER_S)
    seen = start + timedelta(seconds=seconds)
    assert blocks.rtc.read(RTC_TR) == int(seen.strftime("%H%M%S"), 16)
    shown = blocks.rtc.read(RTC_DR)
    assert (shown >> 16, shown & 0x1F3F) == (int(seen.strftime("%y"), 16), int(seen.strftime("%m%d"), 16))
    assert shown >> 13 & 7 == seen.isoweekday()


@given(st.integers(0, 10**13), st.sampled_from([RTC_TR, RTC_DR, RTC_SSR]))
def test_rtc_register_is_constant_until_stated_time(wait_ps: int, offset: int) -> None:
    chip = Chip()
    blocks = SystemPeripherals(chip.soc)
    start_rtc(chip, blocks, 0x23_5958, 0x24_6228)
    chip.run_for(wait_ps)
    blocks.rtc.read(offset)  # a read that locks or unlocks other registers cannot be repeated without effect
    value, until_ps = blocks.rtc.read_with_validity(offset)
    chip.run_to(until_ps - 1)
    assert blocks.rtc.read(offset) == value
    chip.run_to(until_ps)
    assert offset == RTC_DR or blocks.rtc.read(offset) != value


def test_rtc_registers_are_protected_by_keys(chip: Chip, blocks: SystemPeripherals) -> None:
    """RM0368 17.3.5: DBP, then the keys; backup registers need DBP only."""
    rtc = blocks.rtc
    rtc.write(BKP0R, 5)
    blocks.pwr.write(0, 1 << 8)
    rtc.write(BKP0R, 7)
    rtc.write(RTC_ISR, INIT)
    assert (rtc.read(BKP0R), rtc.read(RTC_ISR) & INITF) == (7, 0)
    rtc.write(RTC_WPR, 0xCA)
    rtc.write(RTC_WPR, 0x53)
    rtc.write(RTC_TR, 0x10)
    assert rtc.read(RTC_TR) == 0
    assert [what for what, _ in chip.notes()] == ["refused"] * 3


def test_backup_reset_clears_backup_registers(chip: Chip, blocks: SystemPeripherals) -> None:
    start_rtc(chip, blocks, 0x12_0000, 0x24_6228)
    blocks.rtc.write(BKP0R, 42)
    blocks.rtc.reset()
    assert (blocks.rtc.read(BKP0R), blocks.rtc.read(RTC_TR)) == (42, 0x12_0000)
    blocks.rcc.write(0x70, 1 << 16)
    assert (blocks.rtc.read(BKP0R), blocks.rtc.read(RTC_DR)) == (0, 0x2101)
