"""IWDG and WWDG reset firmware that hangs (RM0368 sections 15 and 16)."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from fcu_emulator.emulator.chip.peripherals.peripheral import InterruptInput
from fcu_emulator.emulator.chip.peripherals.watchdogs import Iwdg, Wwdg
from fcu_emulator.emulator.clock import NEVER_PS, PS_PER_MS, PS_PER_S
from tests.support.arm.chip_fakes import Chip

KR, PR, RLR = 0x00, 0x04, 0x08
START, RELOAD, UNLOCK = 0xCCCC, 0xAAAA, 0x5555
CR, CFR, SR = 0x00, 0x04, 0x08
WDGA, EWI = 0x80, 0x200


def iwdg(chip: Chip) -> Iwdg:
    return Iwdg(chip.soc, "IWDG", 0x4000_3000)


def wwdg(chip: Chip) -> Wwdg:
    return Wwdg(chip.soc, "WWDG", 0x4000_2C00, InterruptInput(chip.soc, 0))


@given(st.integers(0, 7), st.integers(0, 0xFFF))
def test_iwdg_resets_after_timeout_of_manual(prescaler: int, reload: int) -> None:
    """RM0368 table of IWDG time-outs: (RLR + 1) * 4 * 2^PR / 32 kHz, with a divider of 4 to 256."""
    chip = Chip()
    dog = iwdg(chip)
    for offset, value in ((KR, UNLOCK), (PR, prescaler), (RLR, reload), (KR, START)):
        dog.write(offset, value)
    timeout_ps = (reload + 1) * min(4 << prescaler, 256) * PS_PER_S // 32_000
    chip.run_to(timeout_ps - 1)
    assert chip.resets == []
    chip.run_to(timeout_ps)
    assert chip.resets == [(timeout_ps, "IWDG")]


def test_shortest_and_longest_timeout_equal_manual() -> None:
    """RM0368 table 62: 125 us and 32.768 s."""
    for prescaler, reload, timeout_ps in ((0, 0, PS_PER_MS // 8), (6, 0xFFF, 32_768 * PS_PER_MS)):
        chip = Chip()
        dog = iwdg(chip)
        for offset, value in ((KR, UNLOCK), (PR, prescaler), (RLR, reload), (KR, START)):
            dog.write(offset, value)
        chip.run_to(timeout_ps)
        assert chip.resets == [(timeout_ps, "IWDG")]


@given(st.lists(st.integers(1, 511), min_size=1, max_size=20))
def test_reload_in_time_prevents_reset(waits_ms: list[int]) -> None:
    """The reset values give 512 ms."""
    chip = Chip()
    dog = iwdg(chip)
    dog.write(KR, START)
    for wait in waits_ms:
        chip.run_for(wait * PS_PER_MS)
        dog.write(KR, RELOAD)
    last_ps = chip.clock.now_ps
    assert chip.resets == []
    chip.run_for(PS_PER_S)
    assert chip.resets == [(last_ps + 512 * PS_PER_MS, "IWDG")]


@given(st.integers(0, 6), st.integers(0, 300), st.integers(0, 10**12))
def test_second_reload_within_count_changes_nothing(prescaler: int, reload: int, wait_ps: int) -> None:
    """A reload does not reset the prescaler. So all reloads before its next count have the same time-out."""
    resets = []
    for again in (False, True):
        chip = Chip()
        dog = iwdg(chip)
        for offset, value in ((KR, UNLOCK), (PR, prescaler), (RLR, reload), (KR, START)):
            dog.write(offset, value)
        chip.run_for(wait_ps % ((reload + 1) * (4 << prescaler) * PS_PER_S // 32_000))
        dog.write(KR, RELOAD)
        until_ps = dog.same_write_until_ps(KR, RELOAD)
        assert chip.clock.now_ps < until_ps
        if again:
            chip.run_to(until_ps - 1)
            dog.write(KR, RELOAD)
        chip.run_for(40 * PS_PER_S)
        resets.append(chip.resets)
    assert resets[0] == resets[1] != []


def test_shorter_timeout_applies_at_reload() -> None:
    """ST's HAL starts the watchdog first and then sets it up."""
    chip = Chip()
    dog = iwdg(chip)
    for offset, value in ((KR, START), (KR, UNLOCK), (PR, 0), (RLR, 7), (KR, RELOAD)):
        dog.write(offset, value)
    chip.run_for(PS_PER_MS)
    assert chip.resets == [(PS_PER_MS, "IWDG")]


def test_unstarted_watchdog_never_resets() -> None:
    chip = Chip()
    dog = iwdg(chip)
    dog.write(KR, RELOAD)
    assert chip.clock.next_ps == NEVER_PS


def test_iwdg_settings_are_protected_by_key() -> None:
    """RM0368 15.3.2: any other key protects the registers again."""
    chip = Chip()
    dog = iwdg(chip)
    dog.write(RLR, 5)
    dog.write(KR, UNLOCK)
    dog.write(KR, RELOAD)
    dog.write(PR, 5)
    assert (dog.read(RLR), dog.read(PR)) == (0xFFF, 0)
    assert [what for what, _ in chip.notes()] == ["refused", "refused"]


def test_reset_stops_watchdog() -> None:
    chip = Chip()
    dog = iwdg(chip)
    dog.write(KR, START)
    dog.reset()
    chip.run_to(PS_PER_S)
    assert chip.resets == []


@pytest.mark.parametrize("divider", range(4))
@pytest.mark.parametrize("counter", [0x40, 0x41, 0x7F])
def test_window_watchdog_resets_after_0x40(divider: int, counter: int) -> None:
    """RM0368 16.4: PCLK1 / 4096 / 2^WDGTB, T6 to 0."""
    chip = Chip()
    dog = wwdg(chip)
    dog.write(CFR, 0x7F | divider << 7)
    dog.write(CR, WDGA | counter)
    timeout_ps = (counter - 0x3F) * (4096 << divider) * PS_PER_S // 42_000_000
    chip.run_to(timeout_ps - 1)
    assert chip.resets == []
    chip.run_to(timeout_ps)
    assert chip.resets == [(timeout_ps, "WWDG")]


def test_early_wake_up_interrupt_comes_at_count_0x40() -> None:
    """RM0368 16.4: the interrupt comes at 0x40 with number 0. Writing 0 clears SR."""
    chip = Chip()
    dog = wwdg(chip)
    dog.write(CFR, 0x7F | EWI)
    dog.write(CR, WDGA | 0x50)
    count_ps = 4096 * PS_PER_S // 42_000_000
    chip.run_to(17 * count_ps)
    assert chip.irq.level(0)
    assert dog.read(CR) & 0x7F == 0x40
    dog.write(SR, 0)
    dog.write(CR, 0x7F)
    assert not chip.irq.level(0)
    chip.run_for(60 * count_ps)
    assert chip.resets == []


def test_early_wake_up_repeats_after_flag_is_cleared() -> None:
    """The handler may reload before or after it clears the flag."""
    chip = Chip()
    dog = wwdg(chip)
    dog.write(CFR, 0x7F | EWI)
    count_ps = 4096 * PS_PER_S // 42_000_000
    dog.write(CR, WDGA | 0x41)
    for first, second in (((CR, 0x41), (SR, 0)), ((SR, 0), (CR, 0x41))):
        chip.run_for(count_ps)
        assert chip.irq.level(0)
        dog.write(*first)
        dog.write(*second)
        assert not chip.irq.level(0)
    chip.run_for(count_ps)
    assert len(chip.irq.rises) == 3
    assert chip.resets == []


def test_reload_before_window_resets() -> None:
    """RM0368 16.4: T is above W."""
    chip = Chip()
    dog = wwdg(chip)
    dog.write(CFR, 0x50)
    dog.write(CR, WDGA | 0x7F)
    dog.write(CR, WDGA | 0x7F)
    assert chip.resets == [(0, "WWDG")]


def test_reload_inside_window_prevents_reset() -> None:
    chip = Chip()
    dog = wwdg(chip)
    dog.write(CFR, 0x50)
    dog.write(CR, WDGA | 0x7F)
    chip.run_for(48 * 4096 * PS_PER_S // 42_000_000)
    dog.write(CR, WDGA | 0x7F)
    assert chip.resets == []
    assert dog.read(CR) == WDGA | 0x7F


def test_writing_counter_without_t6_resets_at_once() -> None:
    chip = Chip()
    wwdg(chip).write(CR, WDGA | 0x3F)
    assert chip.resets == [(0, "WWDG")]


def test_slower_bus_clock_slows_window_watchdog() -> None:
    chip = Chip()
    dog = wwdg(chip)
    dog.write(CR, WDGA | 0x7F)
    chip.clocks.set(pclk1_hz=21_000_000)
    chip.run_to(64 * 4096 * PS_PER_S // 42_000_000)
    assert dog.read(CR) & 0x7F == 0x7F - 32
    assert chip.resets == []
