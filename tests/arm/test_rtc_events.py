"""Wake-up timer and alarms of the RTC (RM0368 17.3.3, 17.3.4, 17.6)."""

from __future__ import annotations

from datetime import UTC, datetime, timedelta

import pytest
from hypothesis import given
from hypothesis import strategies as st

from fcu_emulator.emulator.chip.chip import SystemPeripherals
from fcu_emulator.emulator.chip.peripherals.rtc import Rtc
from fcu_emulator.emulator.clock import PS_PER_S
from tests.arm.test_system_blocks import start_rtc
from tests.support.arm.chip_fakes import Chip

TR, DR, CR, ISR, WUTR, ALRMAR, ALRMBR, WPR, SSR = 0x00, 0x04, 0x08, 0x0C, 0x14, 0x1C, 0x20, 0x24, 0x28
SHIFTR, CALR, ALRMASSR = 0x2C, 0x3C, 0x44
BYPSHAD, FMT, ADD1H, SUB1H, PM, SHPF, RECALPF = (1 << bit for bit in (5, 6, 16, 17, 22, 3, 16))
ALRAE, ALRBE, WUTE, ALRAIE, ALRBIE, WUTIE = (1 << bit for bit in (8, 9, 10, 12, 13, 14))
ALRAWF, WUTWF, INITF, ALRAF, ALRBF, WUTF = (1 << bit for bit in (0, 2, 6, 8, 9, 10))
CYCLE_PS = PS_PER_S // 32_000
MSK1, MSK2, MSK3, MSK4, WDSEL = 1 << 7, 1 << 15, 1 << 23, 1 << 31, 1 << 30
EVERY_SECOND = MSK1 | MSK2 | MSK3 | MSK4
WAKE_UP, ALARM = 22, 17


class Bench:
    """An unlocked RTC on LSI with 32000 cycles a second, at 12:00:00 on Wednesday, 28 February 2024."""

    def __init__(self, time: int = 0x12_0000, date: int = 0x24_6228) -> None:
        self.chip = Chip()
        self.blocks = SystemPeripherals(self.chip.soc)
        self.rises: list[tuple[int, int]] = []
        self._levels: dict[int, bool] = {}
        self.rtc.connect(self._line)
        start_rtc(self.chip, self.blocks, time, date)
        self.started_ps = self.chip.clock.now_ps
        self.write((WPR, 0xCA), (WPR, 0x53))

    @property
    def rtc(self) -> Rtc:
        return self.blocks.rtc

    def write(self, *writes: tuple[int, int]) -> None:
        for offset, value in writes:
            self.rtc.write(offset, value)

    def _line(self, number: int, level: bool) -> None:
        if level and not self._levels.get(number):
            self.rises.append((self.chip.clock.now_ps - self.started_ps, number))
        self._levels[number] = level

    def rises_in(self, duration_ps: int, flag: int) -> list[int]:
        """Return the times of the rising edges if software clears ``flag`` after each."""
        end_ps, clock = self.chip.clock.now_ps + duration_ps, self.chip.clock
        while clock.next_ps <= end_ps:
            self.chip.run_to(clock.next_ps)
            if self.rtc.read(ISR) & flag:
                self.write((ISR, ~(flag | 1 << 7) & 0xFFFF_FFFF))
        self.chip.run_to(end_ps)
        return [at_ps for at_ps, _ in self.rises]


@pytest.mark.parametrize(
    ("wucksel", "wutr", "cycles"),
    [(0, 99, 1600), (1, 99, 800), (2, 99, 400), (3, 99, 200), (4, 0, 32_000), (4, 2, 96_000)],
)
def test_wake_up_timer_repeats_with_its_period(wucksel: int, wutr: int, cycles: int) -> None:
    bench = Bench()
    bench.write((WUTR, wutr), (CR, wucksel | WUTE | WUTIE))
    expected = [n * cycles * CYCLE_PS for n in (1, 2, 3)]
    assert bench.rises_in(expected[-1], WUTF) == expected
    assert {number for _, number in bench.rises} == {WAKE_UP}
    assert bench.chip.notes() == []


def test_wake_up_timer_can_exceed_65536_seconds() -> None:
    """WUCKSEL = 6 adds 2 ** 16 counts."""
    bench = Bench()
    bench.write((WUTR, 9), (CR, 6 | WUTE))
    bench.chip.run_to(bench.started_ps + (65_546 * PS_PER_S) - 1)
    assert not bench.rtc.read(ISR) & WUTF
    bench.chip.run_for(1)
    assert bench.rtc.read(ISR) & WUTF


def test_wutwf_is_set_while_timer_is_off() -> None:
    """HAL_RTCEx_SetWakeUpTimer_IT polls this flag before it writes WUTR."""
    bench = Bench()
    bench.write((WUTR, 99), (CR, WUTE))
    assert not bench.rtc.read(ISR) & WUTWF
    bench.write((WUTR, 5))
    assert bench.rtc.read(WUTR) == 99
    assert [what for what, _ in bench.chip.notes()] == ["refused"]
    bench.write((CR, 0))
    assert bench.rtc.read(ISR) & WUTWF
    bench.write((WUTR, 5))
    assert bench.rtc.read(WUTR) == 5


def test_flags_are_cleared_without_unlock_keys() -> None:
    """RM0368 17.3.5: ISR[13:8] are not protected, so a handler can clear them without keys."""
    bench = Bench()
    bench.write((WUTR, 9), (CR, WUTE | WUTIE), (WPR, 0xFF))
    bench.chip.run_for(160 * CYCLE_PS)
    assert bench.rtc.read(ISR) & WUTF
    bench.write((ISR, ~(WUTF | 1 << 7) & 0xFFFF_FFFF))
    assert not bench.rtc.read(ISR) & WUTF
    assert bench.chip.notes() == []


def test_alarm_with_masked_fields_comes_every_second() -> None:
    bench = Bench()
    bench.write((ALRMAR, EVERY_SECOND), (CR, ALRAE | ALRAIE))
    assert bench.rises_in(3 * PS_PER_S, ALRAF) == [PS_PER_S, 2 * PS_PER_S, 3 * PS_PER_S]
    assert {number for _, number in bench.rises} == {ALARM}


def test_alarm_b_compares_weekday_and_time() -> None:
    """Thursday, 00:00:01."""
    bench = Bench(time=0x23_5955)
    bench.write((ALRMBR, WDSEL | 4 << 24 | 1), (CR, ALRBE | ALRBIE))
    assert bench.rises_in(20 * PS_PER_S, ALRBF) == [6 * PS_PER_S]


def test_alarm_with_subseconds_repeats_within_second() -> None:
    """MASKSS = 6 compares six bits of SSR, which counts down from 249: the alarm comes four times a second."""
    bench = Bench()
    bench.write((ALRMASSR, 6 << 24), (ALRMAR, EVERY_SECOND), (CR, ALRAE | ALRAIE))
    steps = [249 - value for value in (192, 128, 64, 0)]
    assert bench.rises_in(PS_PER_S - 1, ALRAF) == [step * 128 * CYCLE_PS for step in steps]


def test_alarm_is_off_in_initialisation_mode() -> None:
    bench = Bench()
    bench.write((ALRMAR, EVERY_SECOND), (CR, ALRAE | ALRAIE), (ISR, 1 << 7))
    assert bench.rises_in(3 * PS_PER_S, ALRAF) == []
    bench.write((ISR, 0))
    assert len(bench.rises_in(PS_PER_S, ALRAF)) == 1


# -- calendar settings (17.3.6, 17.3.8, 17.3.11, 17.6.1, 17.6.3) -----------------------------------------------


def test_read_of_subseconds_locks_time_until_date() -> None:
    """17.3.6: a program that reads the time without the date always gets the same time."""
    bench = Bench()
    seen = []
    for _ in range(3):
        bench.rtc.read(SSR)
        seen.append(bench.rtc.read(TR))
        bench.chip.run_for(PS_PER_S)
    assert seen == [0x12_0000] * 3
    bench.rtc.read(DR)
    assert bench.rtc.read(TR) == 0x12_0003


def test_read_of_time_locks_only_the_date() -> None:
    bench = Bench(time=0x23_5959)
    assert bench.rtc.read(TR) == 0x23_5959
    bench.chip.run_for(PS_PER_S)
    assert bench.rtc.read(TR) == 0
    assert [bench.rtc.read(DR), bench.rtc.read(DR)] == [0x24_6228, 0x24_8229]


def test_bypass_of_shadow_registers_locks_nothing() -> None:
    bench = Bench()
    bench.write((CR, BYPSHAD))
    bench.rtc.read(SSR)
    bench.chip.run_for(PS_PER_S)
    assert bench.rtc.read(TR) == 0x12_0001


@pytest.mark.parametrize(
    ("time", "after_s", "shown"),
    [
        (0x12_0000, 0, 0x12_0000),  # midnight
        (0x11_5959, 1, PM | 0x12_0000),
        (PM | 0x12_5959, 1, PM | 0x01_0000),
        (PM | 0x11_5959, 1, 0x12_0000),
    ],
)
def test_twelve_hour_format_shows_am_and_pm(time: int, after_s: int, shown: int) -> None:
    bench = Bench()
    bench.write((ISR, 1 << 7), (CR, FMT), (TR, time), (ISR, 0))
    bench.chip.run_for(after_s * PS_PER_S)
    assert bench.rtc.read(TR) == shown
    assert bench.chip.notes() == []


def test_format_is_written_in_initialisation_mode_only() -> None:
    bench = Bench()
    bench.write((CR, FMT))
    assert bench.rtc.read(CR) == 0
    assert [what for what, _ in bench.chip.notes()] == ["refused"]


def test_alarm_compares_afternoon_in_twelve_hour_format() -> None:
    bench = Bench()
    bench.write((ISR, 1 << 7), (CR, FMT), (TR, 0x11_5958), (ISR, 0))
    bench.write((ALRMAR, MSK4 | PM | 0x12_0000), (CR, FMT | ALRAE | ALRAIE))
    assert bench.rises_in(5 * PS_PER_S, ALRAF) == [2 * PS_PER_S]


def test_summer_time_moves_clock_by_an_hour() -> None:
    """17.6.3: ADD1H and SUB1H read as 0; SUB1H has no effect while the hour is 0."""
    bench = Bench()
    bench.write((CR, ADD1H))
    assert (bench.rtc.read(TR), bench.rtc.read(CR)) == (0x13_0000, 0)
    bench.write((CR, SUB1H), (CR, SUB1H))
    assert bench.rtc.read(TR) == 0x11_0000
    midnight = Bench(time=0x00_3000)
    midnight.write((CR, SUB1H))
    assert midnight.rtc.read(TR) == 0x00_3000


def test_shift_moves_clock_by_subseconds() -> None:
    """17.3.8: SUBFS delays the clock, and ADD1S with SUBFS advances it, in steps of 1 / 250 s."""
    bench = Bench()
    bench.write((SHIFTR, 100))
    assert bench.rtc.read(SSR) == 249 - 150
    assert [bench.rtc.read(TR), bench.rtc.read(DR)] == [0x11_5959, 0x24_6228]
    bench.write((SHIFTR, 1 << 31 | 50))
    assert bench.rtc.read(SSR) == 249 - 100
    assert bench.rtc.read(TR) == 0x12_0000
    assert not bench.rtc.read(ISR) & SHPF


@pytest.mark.parametrize(("calr", "ppm"), [(0x1FF, -487.1), (1 << 15, 488.5), (1 << 15 | 0x1FF, 0.954)])
def test_smooth_calibration_changes_the_rate(calr: int, ppm: float) -> None:
    """17.3.11: the correction is from -487.1 to +488.5 ppm, in steps of 0.954 ppm."""
    bench = Bench()
    bench.write((CALR, calr), (ALRMAR, EVERY_SECOND), (CR, ALRAE | ALRAIE))
    (*_, last_ps) = bench.rises_in(1000 * PS_PER_S + PS_PER_S // 2, ALRAF)
    assert len(bench.rises) == 1000
    assert (1000 * PS_PER_S / last_ps - 1) * 1e6 == pytest.approx(ppm, abs=0.05)
    assert not bench.rtc.read(ISR) & RECALPF


@given(
    st.datetimes(datetime(2024, 1, 1), datetime(2024, 1, 5)).map(lambda day: day.replace(microsecond=0)),
    st.integers(1, 4000),
    st.integers(0, 15),
)
def test_alarm_agrees_with_standard_library(start: datetime, after_s: int, masked: int) -> None:
    """The alarm is for a later second; fields with a mask are not compared."""
    start = start.replace(tzinfo=UTC)
    wanted = start + timedelta(seconds=after_s)
    fields = [int(start.strftime(one), 16) for one in ("%H%M%S", "%y", "%m", "%d")]
    bench = Bench(fields[0], fields[1] << 16 | start.isoweekday() << 13 | fields[2] << 8 | fields[3])
    masks = [bit for n, bit in enumerate((MSK1, MSK2, MSK3, MSK4)) if masked >> n & 1]
    alarm = int(wanted.strftime("%d%H%M%S"), 16) | sum(masks)
    bench.write((ALRMAR, alarm), (CR, ALRAE))
    bench.chip.run_to(bench.started_ps + after_s * PS_PER_S)
    assert bench.rtc.read(ISR) & ALRAF
