"""Data enable of the LSM6DSL: the level of INT2 marks samples or enables them (AN5040 4.8)."""

from __future__ import annotations

from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from fcu_emulator.sensors import LSM6DSL
from tests.support.fifo_fakes import sample_ps
from tests.support.notes import kinds, texts
from tests.support.sensor_fakes import PS_PER_MS, PS_PER_S, Chip, FakeWorld, decode, ramp
from tests.support.words import Words

FIFO_CTRL3, FIFO_CTRL5, INT1_CTRL, INT2_CTRL = 0x08, 0x0A, 0x0D, 0x0E
CTRL1_XL, CTRL2_G, CTRL3_C, CTRL4_C, CTRL5_C, CTRL6_C, CTRL8_XL, CTRL9_XL = (
    0x10,
    0x11,
    0x12,
    0x13,
    0x14,
    0x15,
    0x17,
    0x18,
)
D6D_SRC, STATUS_REG, OUT_G, OUT_XL, FIFO_STATUS1, FIFO_DATA_OUT = 0x1D, 0x1E, 0x22, 0x28, 0x3A, 0x3E
LEVEL, LATCHED, EDGE, FIFO = 0x40, 0x60, 0x80, 0xC0
DEN_LH, DEN_XL_EN, DEN_DRDY_INT1, DEN_DRDY = 0x10, 0x80, 0x10, 0x80
ON_XL, ALL_AXES = 0x10, 0xE0
HZ_104, CONTINUOUS = 0x40, 0x26
PERIOD_PS = -(-PS_PER_S // 104)


class Bench(Chip):
    """A sensor with an acceleration that changes by some counts per sample, at 104 Hz; ``edges`` of INT1."""

    def __init__(self, *writes: tuple[int, int]) -> None:
        super().__init__("LSM6DSL")
        assert isinstance(self.part, LSM6DSL)
        self.pin = self.part.int2
        self.edges: list[tuple[int, int]] = []
        self.part.int1.observe(lambda at_ps, level: self.edges.append((at_ps, level)))
        self.world.signals["acceleration_g"] = ramp((0.1, 0.2, 0.3), (0.05, -0.04, 0.03))
        self.world.signals["angular_rate_dps"] = ramp((10.0, 20.0, 30.0), (9.0, -8.0, 7.0))
        self.configure(((CTRL3_C, 0x44), (CTRL5_C, DEN_LH), *writes))

    def drive(self, *levels: int) -> None:
        """Set levels one after the other at the present time."""
        for level in levels:
            self.pin.apply(level, self.t_ps)

    def after(self, sample: int) -> None:
        """Go to a time between ``sample`` (1, 2 ...) and the next sample."""
        self.t_ps = sample_ps(0, 104, sample) + PERIOD_PS // 2

    def stamps(self, axis: int = 0) -> int:
        return decode(self.read(OUT_XL, 6))[axis] & 1

    def fill(self) -> int:
        return self.read(FIFO_STATUS1)[0]


def stamping(mode: int, *writes: tuple[int, int]) -> Bench:
    """Return a sensor whose accelerometer marks the samples of all axes."""
    return Bench((CTRL6_C, mode), (CTRL9_XL, ON_XL | ALL_AXES), *writes, (CTRL1_XL, HZ_104))


# -- level and latched --------------------------------------------------------------------------------------


@pytest.mark.parametrize(("polarity", "active"), [(DEN_LH, 1), (0, 0)])
def test_den_level_is_stamped_in_lsb(polarity: int, active: int) -> None:
    bench = stamping(LEVEL, (CTRL5_C, polarity))
    assert bench.pin.level is None, "INT2 is an input"
    seen = []
    for sample, level in enumerate((0, 0, 1, 1, 0, 1, 0, 0), start=1):
        bench.t_ps = sample_ps(0, 104, sample) - 1
        bench.drive(level)
        bench.after(sample)
        seen.append([bench.stamps(axis) for axis in range(3)])

    assert seen == [[int(level == active)] * 3 for level in (0, 0, 1, 1, 0, 1, 0, 0)]


def test_sample_at_den_change_has_previous_level() -> None:
    bench = stamping(LEVEL)
    bench.t_ps = sample_ps(0, 104, 3)
    bench.drive(1)
    assert bench.stamps() == 0
    bench.after(4)
    assert bench.stamps() == 1


@pytest.mark.parametrize("axis", range(3))
def test_only_chosen_axes_are_stamped(axis: int) -> None:
    """DEN_X, DEN_Y, DEN_Z; the other axes keep their own LSB."""
    plain, stamped = Bench((CTRL1_XL, HZ_104)), Bench((CTRL6_C, LEVEL), (CTRL1_XL, HZ_104))
    stamped.write(CTRL9_XL, ON_XL | 0x80 >> axis)
    stamped.drive(1)
    for sample in range(1, 20):
        plain.after(sample)
        stamped.after(sample)
        before, after = decode(plain.read(OUT_XL, 6)), decode(stamped.read(OUT_XL, 6))
        assert after == tuple(word | 1 if number == axis else word for number, word in enumerate(before))


def test_gyroscope_is_stamped_unless_den_xl_g() -> None:
    bench = Bench((CTRL6_C, LEVEL), (CTRL9_XL, ALL_AXES), (CTRL1_XL, HZ_104), (CTRL2_G, HZ_104))
    plain = Bench((CTRL1_XL, HZ_104), (CTRL2_G, HZ_104))
    for chip in (bench, plain):
        chip.t_ps = PS_PER_S
    bench.t_ps = PS_PER_S - 100 * PS_PER_MS
    bench.drive(1)
    bench.t_ps = PS_PER_S

    assert decode(bench.read(OUT_G, 6)) == tuple(word | 1 for word in decode(plain.read(OUT_G, 6)))
    assert bench.read(OUT_XL, 6) == plain.read(OUT_XL, 6)


def test_den_latched_marks_first_sample_after_pulse() -> None:
    bench = stamping(LATCHED)
    seen = []
    for sample in range(1, 9):
        bench.after(sample)
        seen.append(bench.stamps())
        if sample in {3, 6}:
            bench.drive(1, 0)

    assert seen == [0, 0, 0, 1, 0, 0, 1, 0]


# -- the FIFO -----------------------------------------------------------------------------------------------


def test_den_fifo_windows_have_alternating_marks() -> None:
    """The mark is 0 in the first window and 1 in the second."""
    bench = stamping(FIFO, (FIFO_CTRL3, 0x01), (FIFO_CTRL5, CONTINUOUS))
    for sample, level in ((2, 1), (5, 0), (9, 1), (11, 0), (14, 1), (15, 0)):
        bench.after(sample)
        bench.drive(level)
    bench.after(30)

    words = decode(bench.read(FIFO_DATA_OUT, 2 * bench.fill()))
    assert [word & 1 for word in words[::3]] == [0, 0, 0, 1, 1, 0]
    assert bench.fill() == 0


def test_words_do_not_change_while_window_is_closed() -> None:
    bench = stamping(FIFO, (FIFO_CTRL3, 0x01), (FIFO_CTRL5, CONTINUOUS))
    bench.drive(1)
    bench.after(4)
    bench.drive(0)
    bench.after(9)

    assert bench.fill() == 12
    bench.read(FIFO_DATA_OUT, 6)
    assert bench.fill() == 9


# -- edge ---------------------------------------------------------------------------------------------------


def test_den_edge_shows_only_first_sample_after_edge() -> None:
    bench = stamping(EDGE, (CTRL4_C, DEN_XL_EN), (FIFO_CTRL3, 0x01), (FIFO_CTRL5, CONTINUOUS))
    plain = Bench((CTRL1_XL, HZ_104))
    shown = []
    for sample in range(1, 10):
        for chip in (bench, plain):
            chip.after(sample)
        ready = bench.byte(STATUS_REG) & 1
        assert ready == (sample in {4, 7})
        if ready:
            shown.append(plain.read(OUT_XL, 6))
            assert bench.read(OUT_XL, 6) == shown[-1]
        if sample in {3, 6}:
            bench.drive(1, 0)

    assert bench.fill() == 6
    assert bench.read(FIFO_DATA_OUT, 12) == b"".join(shown)
    assert bench.read(OUT_XL, 6) == shown[-1], "held until the next edge"


def test_den_edge_without_den_xl_en_skips_accelerometer() -> None:
    bench = Bench((CTRL6_C, EDGE), (CTRL1_XL, HZ_104), (CTRL2_G, HZ_104))
    bench.t_ps = PS_PER_S
    assert bench.byte(STATUS_REG) & 0x03 == 0x01
    bench.drive(1)
    bench.wait(2 * PERIOD_PS)

    assert bench.byte(STATUS_REG) & 0x03 == 0x03
    bench.read(OUT_G, 6)
    bench.wait(PS_PER_S)
    assert bench.byte(STATUS_REG) & 0x03 == 0x01


def test_data_ready_follows_den() -> None:
    bench = stamping(EDGE, (CTRL4_C, DEN_XL_EN), (INT1_CTRL, 0x01))
    bench.after(3)
    bench.drive(1)
    assert bench.part.next_event_ps() == sample_ps(0, 104, 4)
    bench.after(8)
    bench.part.catch_up(bench.t_ps)

    assert bench.edges == [(sample_ps(0, 104, 4), 1)]


def test_den_edge_before_rate_change_passes_first_sample() -> None:
    bench = stamping(EDGE, (CTRL4_C, DEN_XL_EN))
    bench.after(3)
    bench.drive(1)
    bench.wait(PERIOD_PS // 8)  # the samples of both rates come at other times
    bench.write(CTRL1_XL, 0x50)
    changed_ps = bench.t_ps
    bench.t_ps = sample_ps(changed_ps, 208, 1) - 1
    assert bench.byte(STATUS_REG) & 1 == 0
    bench.wait(1)
    assert bench.byte(STATUS_REG) & 1 == 1


def test_leaving_den_mode_shows_every_sample_again() -> None:
    bench = stamping(EDGE, (CTRL4_C, DEN_XL_EN))
    bench.after(5)
    bench.write(CTRL6_C, 0x00)
    assert bench.read(OUT_XL, 6) == bytes(6), "nothing has come through"
    bench.after(6)

    assert bench.byte(STATUS_REG) & 1
    assert bench.read(OUT_XL, 6) != bytes(6)


# -- DEN_DRDY -----------------------------------------------------------------------------------------------


def test_den_drdy_follows_enabled_samples() -> None:
    bench = stamping(LEVEL, (CTRL4_C, DEN_DRDY_INT1))
    bench.after(3)
    bench.drive(1)
    bench.after(5)
    assert bench.byte(D6D_SRC) == DEN_DRDY
    bench.drive(0)
    bench.after(8)

    assert bench.byte(D6D_SRC) == 0
    assert bench.edges == [(sample_ps(0, 104, 4), 1), (sample_ps(0, 104, 6), 0)]


def test_den_drdy_falls_on_high_byte_read() -> None:
    bench = stamping(EDGE, (CTRL4_C, DEN_XL_EN | DEN_DRDY_INT1), (INT2_CTRL, 0x01))
    bench.after(3)
    bench.drive(1)
    bench.after(5)
    bench.read(OUT_XL)
    assert bench.byte(D6D_SRC) == DEN_DRDY, "a low byte clears nothing"
    bench.read(OUT_XL + 1)
    read_ps = bench.t_ps
    bench.wait(PS_PER_S)

    assert bench.byte(D6D_SRC) == 0
    assert bench.edges == [(sample_ps(0, 104, 4), 1), (read_ps, 0)]


def test_den_drdy_of_latched_pulse_lasts_one_period() -> None:
    bench = stamping(LATCHED, (CTRL4_C, DEN_DRDY_INT1))
    bench.after(3)
    bench.drive(1, 0)
    bench.after(20)
    bench.part.catch_up(bench.t_ps)

    assert bench.edges == [(sample_ps(0, 104, 4), 1), (sample_ps(0, 104, 5), 0)]


# -- settings -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("mode", [0x20, 0xA0, 0xE0])
def test_undefined_den_mode_is_noted_and_off(mode: int, words: Words) -> None:
    bench = stamping(mode)
    bench.drive(1)
    plain = Bench((CTRL1_XL, HZ_104))
    for chip in (bench, plain):
        chip.after(8)

    assert kinds(bench.notes) == ["forbidden"]
    assert f"{mode >> 5:03b}b" in texts(bench.notes)
    words("sensors", texts(bench.notes))
    assert bench.read(OUT_XL, 6) == plain.read(OUT_XL, 6)


def test_den_edge_mode_with_lpf2_is_noted(words: Words) -> None:
    bench = stamping(EDGE, (CTRL4_C, DEN_XL_EN), (CTRL8_XL, 0x80))

    assert kinds(bench.notes) == ["forbidden"]
    words("sensors", texts(bench.notes))


def test_driving_int2_as_output_is_noted(words: Words) -> None:
    bench = Bench((CTRL1_XL, HZ_104))
    bench.drive(1)

    assert kinds(bench.notes) == ["forbidden"]
    words("sensors", texts(bench.notes))


def test_invalid_level_of_den_pin_raises_error() -> None:
    with pytest.raises(ValueError, match=r"INT2.* 2 .*0 or 1"):
        Bench().drive(2)


@pytest.mark.parametrize(("on", "value"), [(False, 0x00), (True, 0xE0)])
def test_reset_value_of_den_axes_is_configurable(on: bool, value: int) -> None:
    """Datasheet Table 19 has 0x00, but Table 75 and AN5040 4.8.5 have 0xE0."""
    world = FakeWorld()
    part = LSM6DSL(
        world["acceleration_g"], world["angular_rate_dps"], world["temperature_degc"], den_axes_on=on
    )

    assert part.read(CTRL9_XL, 1, 0) == bytes((value,))
    part.write(CTRL9_XL, b"\x40", 0)
    part.write(CTRL3_C, b"\x05", 0)
    assert part.read(CTRL9_XL, 1, PS_PER_S) == bytes((value,))


# -- laziness -----------------------------------------------------------------------------------------------

MOMENTS = st.integers(1, 300 * PS_PER_MS)


@given(
    mode=st.sampled_from((LEVEL, LATCHED, EDGE, FIFO)),
    changes=st.lists(MOMENTS, max_size=12, unique=True),
    looks=st.lists(st.tuples(MOMENTS, st.sampled_from((D6D_SRC, STATUS_REG, FIFO_STATUS1))), max_size=12),
)
def test_den_does_not_depend_on_reads(mode: int, changes: list[int], looks: list[tuple[int, int]]) -> None:
    def bench() -> Bench:
        fifo = (FIFO_CTRL3, 0x09), (FIFO_CTRL5, CONTINUOUS | 0x50), (CTRL2_G, 0x20)
        return stamping(mode, (CTRL4_C, DEN_XL_EN | DEN_DRDY_INT1), *fifo)

    watched, alone = bench(), bench()
    steps = [(at_ps, 0) for at_ps in changes] + looks
    for at_ps, address in sorted(steps):
        watched.t_ps = alone.t_ps = at_ps
        if address:
            watched.read(address)
        else:
            for chip in (watched, alone):
                chip.drive(1 - chip.pin.applied)
    watched.t_ps = alone.t_ps = 400 * PS_PER_MS

    assert watched.fill() == alone.fill()
    for chip in (watched, alone):
        chip.part.catch_up(chip.t_ps)
    assert watched.edges == alone.edges
    assert all(later > earlier for (earlier, _), (later, _) in pairwise(watched.edges))
    count = alone.fill()
    if count:
        assert watched.read(FIFO_DATA_OUT, 2 * count) == alone.read(FIFO_DATA_OUT, 2 * count)
    assert watched.read(OUT_G, 12) == alone.read(OUT_G, 12)
