"""RCC: the lab's boot sequence, ready flags, prescalers, gates and resets (RM0368 section 6)."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from fcu_emulator.emulator.chip.chip import SystemPeripherals
from fcu_emulator.emulator.chip.peripherals.rcc import NOMINAL, Oscillators, frequencies, pll
from fcu_emulator.emulator.clock import PS_PER_MS, PS_PER_S, PS_PER_US
from tests.support.arm.chip_fakes import Chip, NativeChip
from tests.support.words import Words

CR, PLLCFGR, CFGR, CIR = 0x00, 0x04, 0x08, 0x0C
APB1RSTR, AHB1ENR, APB1ENR, BDCR, CSR = 0x20, 0x30, 0x40, 0x70, 0x74
HSEON, HSERDY, PLLON, PLLRDY = 1 << 16, 1 << 17, 1 << 24, 1 << 25
PWR_CR_DBP = 1 << 8


class Board:
    """The peripherals of the chip on a fake core."""

    def __init__(self, oscillators: Oscillators = NOMINAL) -> None:
        self.chip = Chip()
        self.blocks = SystemPeripherals(self.chip.soc, oscillators=oscillators)
        self.rcc = self.blocks.rcc
        self.native = NativeChip()
        self.rcc.control((*self.blocks, *self.native.fcu.peripherals.values()), self.native.fcu)

    def set_bits(self, offset: int, bits: int) -> None:
        self.rcc.write(offset, self.rcc.read(offset) | bits)

    def start_hse(self) -> None:
        self.set_bits(CR, HSEON)
        self.chip.run_for(2 * PS_PER_MS)

    def to_84_mhz(self) -> None:
        """Set up 84 MHz as ST's firmware does."""
        self.blocks.flash.write(0x00, 0x702)
        self.start_hse()
        self.rcc.write(PLLCFGR, 0x0741_5410)
        self.set_bits(CR, PLLON)
        self.chip.run_for(100 * PS_PER_US)
        self.rcc.write(CFGR, 0x0000_1002)


def test_core_runs_from_hsi_after_reset() -> None:
    """RM0368 6.2: 16 MHz HSI, no prescaler."""
    rcc = Board().rcc
    assert (rcc.sysclk_hz, rcc.hclk_hz, rcc.pclk1_hz, rcc.timer1_hz) == (16_000_000,) * 4
    assert rcc.read(CR) & 3 == 3


def test_settings_of_lab_give_84_mhz() -> None:
    """ST's firmware: HSE 16, M 16, N 336, P 4; APB1 / 2 with its timers at 84 MHz."""
    board = Board()
    board.to_84_mhz()
    rcc = board.rcc
    assert rcc.read(CFGR) == 0x0000_100A
    assert (rcc.sysclk_hz, rcc.hclk_hz) == (84_000_000, 84_000_000)
    assert (rcc.pclk1_hz, rcc.pclk2_hz) == (42_000_000, 84_000_000)
    assert (rcc.timer1_hz, rcc.timer2_hz) == (84_000_000, 84_000_000)
    board.chip.run_for(PS_PER_S)
    assert board.chip.notes() == []


def test_oscillator_errors_change_clocks_but_violate_no_limit() -> None:
    """The quartz is 100 ppm fast: 84 MHz is exceeded by this tolerance, which does not violate the manual's limits."""
    board = Board(Oscillators(hsi_hz=16_160_000, hse_hz=16_001_600))
    assert board.rcc.hclk_hz == 16_160_000
    board.to_84_mhz()
    assert (board.rcc.hclk_hz, board.rcc.pclk1_hz) == (84_008_400, 42_004_200)
    board.chip.run_for(PS_PER_S)
    assert board.chip.notes() == []


def test_fast_hsi_needs_one_wait_state() -> None:
    board = Board(Oscillators(hsi_hz=16_160_000))
    board.blocks.flash.write(0x00, 1)
    board.rcc.write(PLLCFGR, 16 | 240 << 6 | 1 << 16)  # M 16, N 240, P 4
    board.set_bits(CR, PLLON)
    board.chip.run_for(100 * PS_PER_US)
    board.rcc.write(CFGR, 0x0000_1002)
    assert board.rcc.hclk_hz == 60_600_000
    board.chip.run_for(PS_PER_S)
    assert board.chip.notes() == []


def test_oscillator_needs_time_to_start() -> None:
    """STM32F401xB/C datasheet: the crystal needs 2 ms, and the PLL starts when its source is ready."""
    board = Board()
    board.set_bits(CR, HSEON)
    board.rcc.write(PLLCFGR, 0x0741_5410)
    board.set_bits(CR, PLLON)
    board.chip.run_for(2 * PS_PER_MS - 1)
    assert not board.rcc.read(CR) & (HSERDY | PLLRDY)
    board.chip.run_for(1)
    assert board.rcc.read(CR) & (HSERDY | PLLRDY) == HSERDY
    board.chip.run_for(100 * PS_PER_US)
    assert board.rcc.read(CR) & PLLRDY


def test_sysclk_switches_when_selected_source_is_ready() -> None:
    """RM0368 6.2.6: a switch occurs when the target is ready."""
    board = Board()
    board.rcc.write(PLLCFGR, 0x0741_5410)
    board.set_bits(CR, HSEON | PLLON)
    board.rcc.write(CFGR, 0x0000_1002)
    assert board.rcc.read(CFGR) >> 2 & 3 == 0
    assert board.rcc.sysclk_hz == 16_000_000
    board.chip.run_for(3 * PS_PER_MS)
    assert board.rcc.read(CFGR) >> 2 & 3 == 2
    assert board.rcc.sysclk_hz == 84_000_000


def test_active_clock_source_cannot_be_switched_off() -> None:
    """RM0368 6.3.1, PLLON and HSEON: neither bit can be cleared while its clock is the source of the system clock."""
    board = Board()
    board.to_84_mhz()
    board.rcc.write(CR, 0)
    assert board.rcc.read(CR) & (HSEON | PLLON) == HSEON | PLLON
    assert not board.rcc.read(CR) & 1


def test_clock_listeners_are_called_after_change() -> None:
    board = Board()
    heard = list[int]()
    board.rcc.on_change(lambda: heard.append(board.rcc.hclk_hz))
    board.rcc.write(CFGR, 0x80)
    board.rcc.write(CFGR, 0x80)
    assert heard == [8_000_000]


def test_ready_interrupt_is_raised_and_cleared() -> None:
    """RM0368 6.3.4; table 38: RCC is number 5."""
    board = Board()
    board.rcc.write(CIR, 1 << 11)
    board.start_hse()
    assert board.chip.irq.level(5)
    assert board.rcc.read(CIR) == 1 << 11 | 1 << 3
    board.rcc.write(CIR, 1 << 11 | 1 << 19)
    assert not board.chip.irq.level(5)


def test_clock_gates_follow_enable_registers() -> None:
    """RM0368 6.3.9, 6.3.11: GPIOB is AHB1ENR bit 1, TIM2 APB1ENR bit 0."""
    board = Board()
    gpiob, tim2 = board.native["GPIOB"], board.native["TIM2"]
    assert not gpiob.clocked
    assert not tim2.clocked
    board.rcc.write(AHB1ENR, 1 << 1)
    board.rcc.write(APB1ENR, 1 << 0)
    assert gpiob.clocked
    assert tim2.clocked
    assert board.blocks.flash.clocked
    board.rcc.reset()
    assert not gpiob.clocked


def test_reset_bit_resets_its_peripheral() -> None:
    board = Board()
    tim2 = board.native["TIM2"]
    tim2.write(0x2C, 1000)
    board.rcc.write(APB1RSTR, 1)
    assert tim2.read(0x2C) == 0xFFFF_FFFF


def test_reset_flags_show_cause_until_cleared() -> None:
    """RM0368 6.3.21: IWDGRSTF is bit 29, PINRSTF 26, RMVF 24."""
    board = Board()
    assert board.rcc.read(CSR) == 0x0E00_0000
    board.rcc.write(CSR, 1 << 24)
    assert board.rcc.read(CSR) == 0
    board.rcc.reset_because("IWDG")
    board.rcc.reset()
    assert board.rcc.read(CSR) == 1 << 29 | 1 << 26


def test_system_reset_returns_to_hsi() -> None:
    board = Board()
    board.to_84_mhz()
    board.rcc.reset()
    assert board.rcc.hclk_hz == 16_000_000
    assert board.rcc.read(CR) == 0x83


def test_backup_domain_is_protected_and_survives_reset(words: Words) -> None:
    """RM0368 5.1.2: PWR_CR.DBP ends the protection; 6.3.20."""
    board = Board()
    board.rcc.write(BDCR, 1)
    assert board.rcc.read(BDCR) == 0
    ((what, text),) = board.chip.notes()
    assert what == "refused"
    words("chip", text)
    board.blocks.pwr.write(0, PWR_CR_DBP)
    board.rcc.write(BDCR, 1)
    board.rcc.reset()
    board.chip.run_for(2 * PS_PER_S)
    assert board.rcc.read(BDCR) == 3
    board.rcc.write(BDCR, 1 << 16)
    assert board.rcc.read(BDCR) == 1 << 16


def test_lasting_clock_limit_violation_is_noted(words: Words) -> None:
    """RM0368 6.2: APB1 has at most 42 MHz. ST's HAL divides APB1 shortly after it has selected the PLL."""
    board = Board()
    board.to_84_mhz()
    board.rcc.write(CFGR, 0x2)
    board.chip.run_for(PS_PER_MS // 2)
    assert board.chip.notes() == []
    board.chip.run_for(PS_PER_MS)
    ((what, text),) = board.chip.notes()
    assert what == "forbidden"
    words("chip", text)


@pytest.mark.parametrize(
    ("pllcfgr", "part", "frequency"),
    [
        (0x0741_5408, "VCO", "672 MHz"),
        (0x0741_5404, "input", "4 MHz"),
        (0x0740_5410, "output", "168 MHz"),
    ],
)
def test_forbidden_pll_setting_is_explained(pllcfgr: int, part: str, frequency: str, words: Words) -> None:
    problem = pll(pllcfgr).problem()

    assert part in problem
    assert frequency in problem
    words("chip", problem)


@pytest.mark.parametrize(
    ("pllcfgr", "fits_mhz"),
    [(0x0741_5408, 8), (0x0741_5419, 25), (0x0741_5404, None), (0x0701_5408, None)],
)
def test_note_shows_crystal_that_fits_pll_setting(pllcfgr: int, fits_mhz: float | None) -> None:
    """M 8 and 25 with N 336, P 4 are ST's settings for crystals of 8 and 25 MHz. M 4 fits no crystal, HSI has none."""
    board = Board()
    board.start_hse()
    board.rcc.write(PLLCFGR, pllcfgr)
    board.set_bits(CR, PLLON)
    named = board.chip.problems().get("wrong-crystal")
    assert named == ({"crystal_mhz": 16, "fits_mhz": fits_mhz} if fits_mhz else None)


def test_pll_setting_of_lab_is_allowed() -> None:
    assert pll(0x0741_5410).problem() == ""


@given(st.integers(0, 15), st.integers(0, 7), st.integers(0, 7))
def test_timers_run_at_twice_divided_bus_clock(hpre: int, ppre1: int, ppre2: int) -> None:
    """RM0368 figure 12 and the table of RCC_CFGR: AHB is divided by 1 to 512 without 32, APB by 1 to 16."""
    ahb = [1] * 8 + [2, 4, 8, 16, 64, 128, 256, 512]
    apb = [1] * 4 + [2, 4, 8, 16]
    clocks = frequencies(84_000_000, hpre << 4 | ppre1 << 10 | ppre2 << 13)
    assert clocks.hclk_hz == 84_000_000 // ahb[hpre]
    for ppre, pclk_hz, timer_hz in (
        (ppre1, clocks.pclk1_hz, clocks.timer1_hz),
        (ppre2, clocks.pclk2_hz, clocks.timer2_hz),
    ):
        assert pclk_hz == clocks.hclk_hz // apb[ppre]
        assert timer_hz == (pclk_hz if apb[ppre] == 1 else clocks.hclk_hz * 2 // apb[ppre])


def test_rtc_runs_from_selected_lsi_when_ready() -> None:
    """RM0368 6.2.8: LSI is 32 kHz and needs RTCEN and RTCSEL = 10."""
    board = Board()
    board.blocks.pwr.write(0, PWR_CR_DBP)
    board.rcc.write(CSR, 1)
    board.rcc.write(BDCR, 1 << 15 | 2 << 8)
    assert board.rcc.rtc_hz() == 0
    board.chip.run_for(15 * PS_PER_US)
    assert board.rcc.rtc_hz() == 32_000


def test_pll_with_zero_multiplier_never_starts() -> None:
    """RM0368 6.3.2: N = 0 is a wrong configuration. The core continues with HSI, and the note has the reason."""
    board = Board()
    board.rcc.write(PLLCFGR, 0x2400_0010)
    board.set_bits(CR, PLLON)
    board.chip.run_for(PS_PER_MS)
    board.rcc.write(CFGR, 2)

    assert not board.rcc.read(CR) & PLLRDY
    assert board.rcc.read(CFGR) & 0xC == 0
    assert board.rcc.hclk_hz == 16_000_000
    assert "pll-settings" in board.chip.problems()
    assert pll(0x2400_0010).vco_hz == 0


# -- another crystal ----------------------------------------------------------------------------------------


@pytest.mark.parametrize(("crystal_hz", "m"), [(8_000_000, 8), (25_000_000, 25)])
def test_boards_with_other_crystals_reach_84_mhz(crystal_hz: int, m: int) -> None:
    """Settings of other boards: VCO of 336 MHz, P = 4 (6.3.2)."""
    board = Board(Oscillators(crystal_hz=crystal_hz, hse_hz=crystal_hz))
    board.blocks.flash.write(0x00, 0x702)
    board.start_hse()
    board.rcc.write(PLLCFGR, 1 << 22 | 1 << 16 | 336 << 6 | m)
    board.rcc.write(CFGR, 4 << 10)
    board.set_bits(CR, PLLON)
    board.chip.run_for(PS_PER_MS)
    board.set_bits(CFGR, 2)
    board.chip.run_for(2 * PS_PER_MS)
    assert (board.rcc.sysclk_hz, board.rcc.pclk1_hz) == (84_000_000, 42_000_000)
    assert board.chip.notes() == []


def test_pll_setting_for_another_crystal_is_noted() -> None:
    """The PLL is set up for 16 MHz on a board with 8 MHz."""
    board = Board(Oscillators(hse_hz=8_000_000, crystal_hz=8_000_000))
    board.start_hse()
    board.rcc.write(PLLCFGR, 1 << 22 | 1 << 16 | 200 << 6 | 16)
    board.set_bits(CR, PLLON)
    assert board.chip.problems() == {"wrong-crystal": {"crystal_mhz": 8, "fits_mhz": 16}}
