"""The LSM6DSL's FIFO: triggered modes, flags on signals and pins, impossible settings (AN5040 Rev 3, 8)."""

from __future__ import annotations

import pytest

from fcu_emulator.sensors.lsm6dsl.feature import SignalName
from tests.support.fifo_fakes import (
    BOTH,
    BYPASS,
    BYPASS_TO_CONTINUOUS,
    CONTINUOUS,
    CONTINUOUS_TO_FIFO,
    CTRL1_XL,
    CTRL3_C,
    EMPTY,
    FIFO_CTRL1,
    FIFO_CTRL2,
    FIFO_CTRL3,
    FIFO_CTRL4,
    FIFO_CTRL5,
    FIFO_DATA_OUT,
    FIFO_STATUS1,
    FULL,
    HZ_104,
    INT1_CTRL,
    MD2_CFG,
    ONLY_HIGH_DATA,
    OVERRUN,
    PERIOD_PS,
    STOP_ON_FTH,
    TIMER_PEDO_FIFO_DRDY,
    WATERMARK,
    XL,
    XL_ONLY,
    Bench,
    bench_of,
    fifo_of,
    sample_ps,
    sample_word,
    samples,
    status,
)
from tests.support.notes import kinds, texts
from tests.support.sensor_fakes import PS_PER_MS, PS_PER_S, Chip, ramp, step
from tests.support.words import Words

# -- triggered modes ------------------------------------------------------------------------------------

ROUTED: tuple[tuple[SignalName, int, int], ...] = (
    ("SIGN_MOT", INT1_CTRL, 0x40),
    ("STEP_DETECTOR", INT1_CTRL, 0x80),
    ("TILT", MD2_CFG, 0x02),
    ("SINGLE_TAP", MD2_CFG, 0x40),
    ("DOUBLE_TAP", MD2_CFG, 0x08),
    ("FF", MD2_CFG, 0x10),
    ("WU", MD2_CFG, 0x20),
    ("6D", MD2_CFG, 0x04),
)


def triggered(mode: int, register: int, mask: int) -> Bench:
    bench = bench_of(BYPASS)
    bench.write(register, mask)
    bench.write(FIFO_CTRL1, 21)
    bench.write(FIFO_CTRL4, STOP_ON_FTH)
    bench.write(FIFO_CTRL5, HZ_104 << 3 | mode)
    return bench


@pytest.mark.parametrize(("name", "register", "mask"), ROUTED)
def test_bypass_to_continuous_starts_with_event_sample(name: SignalName, register: int, mask: int) -> None:
    bench = triggered(BYPASS_TO_CONTINUOUS, register, mask)
    bench.wait(5 * PERIOD_PS)
    assert bench.read(FIFO_STATUS1, 2) == bytes((0, EMPTY))
    bench.t_ps = sample_ps(0, 104, 6)
    bench.pulse(name)
    bench.wait(2 * PERIOD_PS)

    assert bench.words(3) == [sample_word(XL, 6 / 104, axis) for axis in range(3)]
    assert bench.fill() == 6


@pytest.mark.parametrize(("name", "register", "mask"), ROUTED)
def test_continuous_to_fifo_stops_after_event(name: SignalName, register: int, mask: int) -> None:
    bench = triggered(CONTINUOUS_TO_FIFO, register, mask)
    bench.wait(30 * PERIOD_PS)
    bench.pulse(name)
    bench.wait(PS_PER_S)

    assert bench.fill() == 21
    assert bench.words(21)[-3:] == [sample_word(XL, 30 / 104, axis) for axis in range(3)]


@pytest.mark.parametrize(("name", "register", "mask"), ROUTED)
def test_unrouted_event_does_not_switch_fifo(name: SignalName, register: int, mask: int) -> None:
    bench = triggered(BYPASS_TO_CONTINUOUS, register, 0xFF & ~mask)
    bench.write(0x5E, 0xFF)  # MD1_CFG: the same events on the other pin
    bench.wait(5 * PERIOD_PS)
    bench.pulse(name)
    bench.wait(5 * PERIOD_PS)

    assert bench.fill() == 0


def test_shallow_fifo_is_not_full_before_event() -> None:
    bench = triggered(BYPASS_TO_CONTINUOUS, MD2_CFG, 0x20)
    bench.write(FIFO_CTRL1, 2)
    assert bench.read(FIFO_STATUS1, 2) == bytes((0, EMPTY))
    bench.pulse("WU")

    assert bench.read(FIFO_STATUS1, 2) == bytes((0, EMPTY | FULL))


def test_mode_switch_lasts_until_bypass() -> None:
    bench = triggered(BYPASS_TO_CONTINUOUS, MD2_CFG, 0x20)
    bench.pulse("WU")
    bench.write(FIFO_CTRL5, 0)
    bench.write(FIFO_CTRL5, HZ_104 << 3 | BYPASS_TO_CONTINUOUS)
    bench.wait(5 * PERIOD_PS)

    assert bench.fill() == 0


def test_events_reported_late_act_at_their_times() -> None:
    bench = triggered(BYPASS_TO_CONTINUOUS, MD2_CFG, 0x60)
    bench.t_ps = 20 * PERIOD_PS
    bench.signals.set("WU", True, 17 * PERIOD_PS + 1)
    bench.signals.set("SINGLE_TAP", True, 15 * PERIOD_PS + 1)

    assert bench.fill() == 15  # samples 16 to 20


def test_data_sets_are_stored_at_every_step() -> None:
    bench = bench_of(CONTINUOUS, dec=(0, 1, 0, 0), ctrl2=TIMER_PEDO_FIFO_DRDY)
    for _ in range(3):
        bench.wait(PERIOD_PS * 5 // 2)
        bench.pulse("STEP_DETECTOR")
        bench.pulse("SENSORHUB")

    assert bench.fill() == 9
    latest = [sample_word(XL, sample / 104, axis) for sample in (2, 5, 7) for axis in range(3)]
    assert bench.words(9) == latest


def test_data_sets_are_stored_after_reads_of_hub() -> None:
    bench = bench_of(BYPASS, dec=(0, 0, 1, 0))
    bench.write(0x1A, 0x40)  # DATA_VALID_SEL_FIFO
    bench.write(FIFO_CTRL5, HZ_104 << 3 | CONTINUOUS)
    for number in range(3):
        bench.wait(PERIOD_PS * 5)
        bench.pulse("STEP_DETECTOR")
        bench.catch_up(bench.t_ps - 1)
        bench.registers.mem[0x2E] = number
        bench.pulse("SENSORHUB")

    assert bench.words(9)[::3] == [0, 1, 2]


# -- signals and pins -----------------------------------------------------------------------------------


def test_flag_signals_change_at_sample_or_read_time() -> None:
    bench = bench_of(BYPASS)
    bench.write(FIFO_CTRL1, 9)
    bench.write(FIFO_CTRL5, HZ_104 << 3 | CONTINUOUS)
    bench.wait(700 * PERIOD_PS)
    bench.words(1)
    assert bench.heard == [
        ("FTH", True, sample_ps(0, 104, 3)),
        ("FULL_FLAG", True, sample_ps(0, 104, 682)),
        ("FIFO_OVR", True, sample_ps(0, 104, 683)),
        ("FIFO_OVR", False, bench.t_ps),
    ]


def test_watermark_on_int1_rises_with_its_sample() -> None:
    """The reader reads only when the sensor reports that a pin may change."""
    chip = fifo_of(CONTINUOUS, watermark=30)
    edges: list[tuple[int, int]] = []
    chip.part.pins()[0].observe(lambda at_ps, level: edges.append((at_ps, level)))
    chip.write(INT1_CTRL, 0x08)
    looks = 0
    while not edges:
        looks += 1
        chip.t_ps = chip.part.next_event_ps()
        chip.part.catch_up(chip.t_ps)

    assert edges == [(chip.t_ps, 1)] == [(sample_ps(0, 104, 10), 1)]
    assert looks == 1


def test_full_fifo_predicts_one_overrun() -> None:
    chip = fifo_of(CONTINUOUS, ctrl4=STOP_ON_FTH, watermark=21)
    chip.write(INT1_CTRL, 0x38)
    samples(chip, 7)
    assert status(chip)[0] == 21
    assert chip.part.next_event_ps() == sample_ps(0, 104, 8)
    samples(chip, 1)
    assert status(chip)[1] & OVERRUN
    assert chip.part.next_event_ps() > 1000 * PS_PER_S


def test_unrouted_fifo_schedules_no_event() -> None:
    chip = fifo_of(CONTINUOUS, watermark=30)

    assert chip.part.next_event_ps() > 1000 * PS_PER_S


# -- impossible settings --------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "writes",
    [
        ((FIFO_CTRL5, 0x22),),
        ((FIFO_CTRL5, 0x25),),
        ((FIFO_CTRL5, 0x27),),
        ((FIFO_CTRL5, 0x58),),
        ((FIFO_CTRL2, 0x88), (FIFO_CTRL5, 0x26)),
        ((FIFO_CTRL3, BOTH), (FIFO_CTRL4, ONLY_HIGH_DATA), (FIFO_CTRL5, 0x26)),
        ((FIFO_CTRL4, STOP_ON_FTH), (FIFO_CTRL5, 0x26)),
        ((CTRL3_C, 0x04), (FIFO_CTRL5, 0x26)),
        ((FIFO_CTRL5, 0x26), (CTRL3_C, 0x40)),
        ((FIFO_CTRL5, 0x26), (FIFO_CTRL3, XL_ONLY)),
        ((FIFO_CTRL5, 0x26), (FIFO_CTRL5, 0x21)),
        ((FIFO_CTRL5, 0x26), (CTRL1_XL, 0x50)),
    ],
)
def test_impossible_setting_is_noted_once(writes: tuple[tuple[int, int], ...], words: Words) -> None:
    chip = Chip("LSM6DSL")
    chip.configure(((CTRL3_C, 0x44), (CTRL1_XL, 0x40)))
    chip.configure(writes)
    chip.write(0x73, 0x01)  # something else

    assert kinds(chip.notes) == ["forbidden"]
    words("sensors", texts(chip.notes))


@pytest.mark.parametrize("mode", [2, 5, 7])
def test_reserved_mode_acts_as_bypass(mode: int) -> None:
    chip = fifo_of(mode)
    samples(chip, 10)

    assert chip.read(FIFO_STATUS1, 4) == bytes((0, EMPTY, 0, 0))


def test_change_outside_bypass_restarts_pattern() -> None:
    chip = fifo_of(CONTINUOUS)
    samples(chip, 2)
    chip.write(FIFO_CTRL3, BOTH)
    samples(chip, 2)

    assert status(chip) == (6 + 12, 0, 0)
    chip.read(FIFO_DATA_OUT, 2)
    assert status(chip)[2] == (1 - 6) % 6
    chip.read(FIFO_DATA_OUT, 10)
    assert status(chip) == (12, 0, 0)


def test_watermark_change_does_not_affect_other_state() -> None:
    chip = fifo_of(CONTINUOUS, odr=2)
    samples(chip, 6)
    chip.write(FIFO_CTRL1, 6)
    assert status(chip)[:2] == (6, WATERMARK)
    samples(chip, 3)

    assert status(chip)[0] == 9
    assert chip.notes == []


def left_words(looks: int) -> bytes:
    """Return the contents of a FIFO after a second in which the world changes, with this number of reads."""
    chip = fifo_of(CONTINUOUS)
    for look in range(looks):
        chip.t_ps = look * 10 * PS_PER_MS
        status(chip)
    chip.t_ps = 500 * PS_PER_MS
    before, after = chip.world.signals["acceleration_g"], ramp((1.0, 0.0, 0.5), (0.0, 0.1, 0.0))
    chip.world.signals["acceleration_g"] = step(before, after, 0.5)
    chip.part.world_changed(chip.t_ps)
    chip.t_ps = PS_PER_S
    return chip.read(FIFO_DATA_OUT, 2 * status(chip)[0])


def test_fifo_does_not_depend_on_reads() -> None:
    assert left_words(0) == left_words(50) == left_words(7)
    assert len(left_words(0)) == 6 * 103  # the 104th comes a ps later
