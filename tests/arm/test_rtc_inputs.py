"""Time stamp and tamper detection at PC13, RTC_AF1 (RM0368 17.3.12, 17.3.13, 17.6)."""

from __future__ import annotations

import pytest

from fcu_emulator.emulator.clock import PS_PER_MS, PS_PER_S
from tests.arm.test_rtc_events import Bench

CR, ISR, TSTR, TSDR, TSSSR, TAFCR, BKP0R, BKP19R = 0x08, 0x0C, 0x30, 0x34, 0x38, 0x40, 0x50, 0x9C
TSEDGE, TSE, TSIE = 1 << 3, 1 << 11, 1 << 15
TSF, TSOVF, TAMP1F = 1 << 11, 1 << 12, 1 << 13
TAMP1E, TAMP1TRG, TAMPIE, TAMPTS, TAMPPUDIS = 1 << 0, 1 << 1, 1 << 2, 1 << 7, 1 << 15
STAMP_LINE = 21


def drive(bench: Bench, *levels: int) -> None:
    for level in levels:
        bench.chip.gpio.drive("C", 13, level)


def clear(bench: Bench, flags: int) -> None:
    bench.write((ISR, ~(flags | 1 << 7) & 0xFFFF_FFFF))


def test_rising_edge_stores_the_time() -> None:
    """28 February 2024 is a Wednesday; TSDR has no year."""
    bench = Bench()
    bench.write((CR, TSE | TSIE))
    bench.chip.run_for(2 * PS_PER_S + PS_PER_S // 2)
    drive(bench, 1)
    bench.chip.run_for(PS_PER_S)

    assert bench.rtc.read(ISR) & (TSF | TSOVF) == TSF
    assert [bench.rtc.read(offset) for offset in (TSTR, TSDR, TSSSR)] == [0x12_0002, 0x6228, 249 - 125]
    assert [number for _, number in bench.rises] == [STAMP_LINE]
    assert bench.chip.notes() == []


def test_falling_edge_is_selected_by_tsedge() -> None:
    bench = Bench()
    bench.write((CR, TSE | TSEDGE))
    drive(bench, 1)
    assert not bench.rtc.read(ISR) & TSF
    drive(bench, 0)
    assert bench.rtc.read(ISR) & TSF
    assert bench.rises == []


def test_second_edge_sets_overflow_and_keeps_time() -> None:
    bench = Bench()
    bench.write((CR, TSE))
    drive(bench, 1, 0)
    bench.chip.run_for(PS_PER_S)
    drive(bench, 1)

    assert bench.rtc.read(ISR) & (TSF | TSOVF) == TSF | TSOVF
    assert bench.rtc.read(TSTR) == 0x12_0000
    clear(bench, TSF | TSOVF)
    assert [bench.rtc.read(offset) for offset in (ISR, TSTR, TSDR)][1:] == [0, 0]
    assert not bench.rtc.read(ISR) & (TSF | TSOVF)


def test_tamper_edge_erases_backup_registers() -> None:
    bench = Bench()
    bench.write((BKP0R, 1), (BKP19R, 2), (TAFCR, TAMP1E | TAMPIE))
    assert bench.rtc.read(BKP0R) == 1
    drive(bench, 1)

    assert bench.rtc.read(ISR) & (TAMP1F | TSF) == TAMP1F
    assert [bench.rtc.read(BKP0R), bench.rtc.read(BKP19R)] == [0, 0]
    assert [number for _, number in bench.rises] == [STAMP_LINE]
    clear(bench, TAMP1F)
    assert not bench.rtc.read(ISR) & TAMP1F


def test_already_active_tamper_input_is_detected() -> None:
    """17.3.12: the edge is also detected if it came before TAMP1E was set."""
    bench = Bench()
    bench.write((BKP0R, 1), (TAFCR, TAMP1TRG))
    assert not bench.rtc.read(ISR) & TAMP1F
    bench.write((TAFCR, TAMP1TRG | TAMP1E))
    assert bench.rtc.read(ISR) & TAMP1F
    assert bench.rtc.read(BKP0R) == 0


def test_tamper_can_store_the_time() -> None:
    bench = Bench()
    bench.write((TAFCR, TAMP1E | TAMPTS))
    bench.chip.run_for(PS_PER_S)
    drive(bench, 1)
    assert bench.rtc.read(ISR) & TSF
    assert bench.rtc.read(TSTR) == 0x12_0001


@pytest.mark.parametrize(("filter_", "samples"), [(1, 2), (2, 4), (3, 8)])
def test_tamper_level_needs_consecutive_samples(filter_: int, samples: int) -> None:
    """With TAMPFREQ = 7, the pin is sampled at RTCCLK / 256, which is 125 Hz with LSI: every 8 ms."""
    bench = Bench()
    drive(bench, 1)
    bench.write((TAFCR, TAMPPUDIS | filter_ << 11 | 7 << 8 | TAMP1E))
    drive(bench, 0)
    bench.chip.run_for((samples - 1) * 8 * PS_PER_MS)
    drive(bench, 1, 0)
    bench.chip.run_for((samples - 1) * 8 * PS_PER_MS)
    assert not bench.rtc.read(ISR) & TAMP1F
    bench.chip.run_for(2 * 8 * PS_PER_MS)
    assert bench.rtc.read(ISR) & TAMP1F


def test_floating_tamper_pin_is_pulled_up() -> None:
    """TAMPPUDIS = 0: the pull-up precharges the pin before each sample."""
    bench = Bench()
    bench.write((TAFCR, 1 << 11 | 7 << 8 | TAMP1E))
    bench.chip.run_for(PS_PER_S)
    assert not bench.rtc.read(ISR) & TAMP1F


def test_second_alternate_pin_causes_note() -> None:
    bench = Bench()
    bench.write((TAFCR, 1 << 16 | 1 << 17))
    assert [what for what, _ in bench.chip.notes()] == ["not modelled"]


def test_tamper_event_is_a_wake_up_event() -> None:
    """5.4.2: WUF."""
    bench = Bench()
    bench.write((TAFCR, TAMP1E | TAMPIE))
    drive(bench, 1)
    assert bench.blocks.pwr.read(0x04) & 1
