"""Motion of the world faster than the samples: filtered before sampling, and clipped at the converter.

The reference is scipy: the documented analog stage as an analog filter (``scipy.signal.butter``), and convolution.
"""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import signal as scipy_signal

from fcu_emulator.emulator.assembly.board import Board
from fcu_emulator.emulator.world import Recording, World
from fcu_emulator.sensors.front_end import CONVERTER_HZ, FrontEnd, averaged, kernel
from fcu_emulator.sensors.lis2mdl import LIS2MDL
from fcu_emulator.sensors.lps22hb import LPS22HB
from fcu_emulator.sensors.lsm6dsl import LSM6DSL
from tests.support.sensor_fakes import Moving

PS_PER_S = 10**12
G = 9.80665
CTRL1_XL, CTRL6_C, OUTX_L_XL = 0x10, 0x15, 0x28
MG_PER_LSB = 0.061


def shaken(hz: float, amplitude_g: float) -> Moving:
    """Return a signal that swings along X."""

    def force_g(t_s: np.ndarray) -> np.ndarray:
        return np.stack([amplitude_g * np.cos(2 * np.pi * hz * t_s), 0 * t_s, 0 * t_s], axis=1)

    return Moving(force_g)


def still(axes: int) -> Moving:
    return Moving(lambda t_s: np.zeros((len(t_s), axes)) if axes > 1 else np.full(len(t_s), 25.0))


def acceleration_mg(force: Moving, ctrl1_xl: int, odr_hz: float, count: int, ctrl6_c: int = 0) -> np.ndarray:
    """Return X of ``count`` samples after the hundredth."""
    part = LSM6DSL(force, still(3), still(1))
    part.write(CTRL6_C, bytes([ctrl6_c]), 0)
    part.write(CTRL1_XL, bytes([ctrl1_xl]), 0)
    times_ps = [int((n + 0.5) / odr_hz * PS_PER_S) for n in range(100, 100 + count)]
    return np.array([np.frombuffer(part.read(OUTX_L_XL, 2, t), "<i2")[0] for t in times_ps]) * MG_PER_LSB


def butterworth(order: int, cutoff_hz: float, hz: float) -> float:
    b, a = scipy_signal.butter(order, 2 * np.pi * cutoff_hz, analog=True)
    return float(abs(scipy_signal.freqs(b, a, [2 * np.pi * hz])[1][0]))


@pytest.mark.parametrize(
    ("ctrl1_xl", "odr_hz", "analog_hz"),
    [(0x20, 26, 400), (0x40, 104, 400), (0x70, 833, 400), (0x80, 1666, 1500), (0x90, 3332, 1500)],
)
@pytest.mark.parametrize("of_odr", [0.11, 0.37, 0.58, 1.37])
def test_accelerometer_response_has_documented_bandwidth(
    ctrl1_xl: int, odr_hz: float, analog_hz: float, of_odr: float
) -> None:
    """Analog stage and LPF1 at ODR/2 (AN5040 3.7), also above half the output rate, at which samples alias."""
    hz = of_odr * odr_hz
    converter_hz = odr_hz * round(CONVERTER_HZ / odr_hz)
    digital = scipy_signal.butter(4, odr_hz / 2, fs=converter_hz)
    lpf1 = abs(scipy_signal.freqz(*digital, [hz], fs=converter_hz)[1][0])
    expected = butterworth(2, analog_hz, hz) * lpf1
    mg = acceleration_mg(shaken(hz, 1.9), ctrl1_xl, odr_hz, 150)
    assert np.sqrt(2 * np.mean(mg**2)) / 1900 == pytest.approx(expected, abs=0.02 + 0.03 * expected)


@pytest.mark.parametrize("hz", [300.0, 1000.0, 6664.0, 9999.0])
def test_vibration_far_above_output_rate_is_suppressed(hz: float) -> None:
    assert np.abs(acceleration_mg(shaken(hz, 1.9), 0x40, 104, 100)).max() < 10


def test_vibration_at_output_rate_causes_no_constant_offset() -> None:
    """Before this was fixed, 0.5 g at 104 Hz gave a constant 480 mg."""
    mg = acceleration_mg(shaken(104.0, 0.5), 0x40, 104, 100)
    assert np.abs(mg).max() < 500 * butterworth(4, 52, 104) * 1.05


def test_low_power_bandwidth_is_740_hz() -> None:
    mg = acceleration_mg(shaken(313.0, 1.9), 0x50, 208, 300, ctrl6_c=0x10)
    assert np.sqrt(2 * np.mean(mg**2)) / 1900 == pytest.approx(butterworth(2, 740, 313), rel=0.05)


def test_vibration_is_clipped_before_averaging() -> None:
    """1 g with a swing of 3 g at 2 g full scale: values above 2 g are clipped, so the mean is far below 1 g."""
    hz, fine_hz = 200.0, CONVERTER_HZ * 16
    t_s = np.arange(0, 1, 1 / fine_hz)
    analog = butterworth(2, 400, hz)
    clipped = np.clip(1.0 + 3.0 * analog * np.cos(2 * np.pi * hz * t_s), -2.0, 2.0)
    around_1_g = Moving(lambda t: shaken(hz, 3.0)(t) + np.array([1.0, 0.0, 0.0]))
    mg = acceleration_mg(around_1_g, 0x40, 104, 100)
    assert clipped.mean() < 0.75
    assert mg.mean() == pytest.approx(1000 * clipped.mean(), abs=10)


@given(
    st.integers(0, 300), st.lists(st.integers(1, 70), min_size=1, max_size=8), st.sampled_from([52.0, 833.0])
)
@settings(max_examples=25)
def test_sample_does_not_depend_on_its_block(first: int, counts: list[int], rate_hz: float) -> None:
    world = World()
    world.shake("up", 0.7, 61.0, 0.5)
    world.sweep("roll", 300, 0.3)

    def times_s(number: int, count: int) -> np.ndarray:
        return np.arange(number, number + count) / rate_hz

    def front_end() -> FrontEnd:
        made = FrontEnd(world.sensed("acceleration_g", one_row=True), times_s)
        made.configure(kernel(rate_hz, 400.0, None, 2.0))
        return made

    total = sum(counts)
    whole = np.broadcast_to(front_end().block(first, times_s(first, total)), (total, 3))
    pieces, at = [], first
    for count in counts:
        piece = front_end().block(at, times_s(at, count))
        pieces.append(np.broadcast_to(piece, (count, 3)))
        at += count
    np.testing.assert_array_equal(np.concatenate(pieces), whole)


@pytest.mark.parametrize("rate_hz", [52.0, 833.0])
def test_shortcut_for_slow_signal_is_nearly_exact(rate_hz: float) -> None:
    world = World()
    use = kernel(rate_hz, 400.0, None, 2.0)
    duration_s = use.delay_s * 26
    world.lift(duration_s**2, duration_s, start_s=1.0)  # 5.8 m/s2 at most, whatever it lasts
    sensed = world.sensed("acceleration_g", one_row=True)
    numbers = np.arange(int((1.0 + 0.4 * duration_s) * rate_hz), int((1.0 + 0.9 * duration_s) * rate_hz))
    t_s = numbers / rate_hz
    assert sensed.agitated(t_s[0], t_s[-1], use.delay_s * 25) == []
    closely = FrontEnd(Moving(sensed), lambda number, count: np.arange(number, number + count) / rate_hz)
    closely.configure(use)
    at_once = sensed(t_s - use.delay_s)
    np.testing.assert_allclose(closely.block(int(numbers[0]), t_s)[:, 2], at_once[:, 2], atol=2e-3)


def test_signal_set_at_start_also_applies_before_start() -> None:
    """The first attitude of a scenario is not a jump: the first sample equals all other samples."""
    world = World()
    world.set_attitude(0, -30, 0)
    part = LSM6DSL(world.sensed("acceleration_g", one_row=True), still(3), still(1))
    part.write(CTRL1_XL, b"\x40", 0)
    readings = [part.read(OUTX_L_XL, 6, int(n * PS_PER_S / 104) + 1) for n in range(1, 30)]
    assert set(readings[1:]) == {readings[0]}
    assert np.frombuffer(readings[0], "<i2")[0] * MG_PER_LSB == pytest.approx(500, abs=0.1)


def test_shaking_at_low_rate_takes_little_memory() -> None:
    """A sample at 12.5 Hz needs 2,132 values of the world. Those of 400 samples are not stored together."""
    asked: list[int] = []

    def force_g(t_s: np.ndarray) -> np.ndarray:
        asked.append(len(t_s))
        return np.stack([np.cos(2 * np.pi * 3 * t_s), 0 * t_s, 0 * t_s], axis=1)

    use = kernel(12.5, 400.0, None, 2.0)
    samples = use.samples(force_g, np.arange(use.lead + 400) / 12.5, lambda force, _: force)
    assert samples.shape == (400, 3)
    assert sum(asked) > 400 * 2132
    assert max(asked) < 400_000


class Counted(Moving):
    """A signal of a world that counts the requested times of each call."""

    def __init__(self, world: World) -> None:
        sensed = world.sensed("acceleration_g", one_row=True)
        super().__init__(sensed)
        self.sensed = sensed
        self.asked: list[int] = []

    def __call__(self, t_s: np.ndarray) -> np.ndarray:
        self.asked.append(len(t_s))
        return self.sensed(t_s)

    def agitated(self, from_s: float, to_s: float, pace_s: float) -> list[tuple[float, float]]:
        return self.sensed.agitated(from_s, to_s, pace_s)


def test_motionless_world_is_evaluated_once_per_block() -> None:
    """A board at rest costs the same as without a front end."""
    world = World()
    world.set_attitude(20, 30, 40)
    counted = Counted(world)
    front_end = FrontEnd(counted, lambda number, count: np.arange(number, number + count) / 104)
    front_end.configure(kernel(104.0, 400.0, None, 2.0))
    assert front_end.block(1000, np.arange(1000, 1500) / 104).shape == (1, 3)
    assert counted.asked == [500]


@pytest.mark.parametrize(("delays", "is_slow"), [(26, True), (24, False)])
def test_slow_motion_is_evaluated_once_per_sample(delays: float, is_slow: bool) -> None:
    world, use = World(), kernel(104.0, 400.0, None, 2.0)
    duration_s = delays * use.delay_s
    world.lift(0.1, duration_s, start_s=1.0)
    counted = Counted(world)
    front_end = FrontEnd(counted, lambda number, count: np.arange(number, number + count) / 104)
    front_end.configure(use)
    # The acceleration jumps at its beginning and at its end, which are filtered in any case.
    numbers = np.arange(int((1.0 + use.memory_s) * 104) + 1, int((1.0 + 0.95 * duration_s) * 104))
    front_end.block(int(numbers[0]), numbers / 104)
    assert counted.asked[0] == len(numbers) > 3
    assert (len(counted.asked) == 1) is is_slow


def test_magnetometer_and_barometer_average_over_their_conversion() -> None:
    """A field turns 30 times in 9.4 ms, and a pressure swings 6 times in 13 ms: the sensors measure the means."""

    def field(t_s: np.ndarray) -> np.ndarray:
        turning = 2 * np.pi * t_s * 30 / 0.0094
        return np.stack([100 + 900 * np.cos(turning), 900 * np.sin(turning), 0 * t_s], axis=1)

    magnetometer = LIS2MDL(Moving(field), still(1))
    magnetometer.write(0x60, b"\x8c", 0)
    x, y, _ = np.frombuffer(magnetometer.read(0x68, 6, PS_PER_S), "<i2") * 1.5
    assert (x, y) == (pytest.approx(100, abs=2), pytest.approx(0, abs=2))
    barometer = LPS22HB(Moving(lambda t_s: 1000 + 5 * np.cos(2 * np.pi * 6 / 0.013 * t_s)), still(1))
    barometer.write(0x10, b"\x50", 0)
    low, middle, high = barometer.read(0x28, 3, PS_PER_S)
    assert (low | middle << 8 | high << 16) / 4096 == pytest.approx(1000, abs=0.1)


def test_mean_of_ramp_is_its_middle_value() -> None:
    ramp = Moving(lambda t_s: 3.0 * t_s)
    np.testing.assert_allclose(averaged(ramp, np.array([1.0, 2.0]), 0.02), [2.97, 5.97])


def test_mean_does_not_depend_on_other_samples() -> None:
    """The board is turned, lifted, tapped and slowly turned.

    The mean is compared with 500 values and with single samples.
    """
    world = World()
    world.rotate_to(60, 0, 0, 0.3, start_s=1.0)
    world.lift(0.2, 0.2, start_s=1.5)  # with 3 g
    world.tap(start_s=2.0)
    world.rotate_to(0, 0, 0, 5.0, start_s=3.0)
    sensed = world.sensed("acceleration_g")
    t_s, conversion_s = np.arange(0.5, 9.0, 0.01), 0.0094
    together = averaged(sensed, t_s, conversion_s)
    alone = np.concatenate([averaged(sensed, one, conversion_s) for one in t_s[:, np.newaxis]])
    np.testing.assert_array_equal(together, alone)
    earlier_s = (np.arange(500) + 0.5) / 500 * conversion_s
    exact = sensed((t_s[:, np.newaxis] - earlier_s).ravel()).reshape(-1, 500, 3).mean(axis=1)
    tapped = (t_s > 1.99) & (t_s < 2.03)
    np.testing.assert_allclose(together[~tapped], exact[~tapped], atol=1e-3)
    np.testing.assert_allclose(together[tapped], exact[tapped], atol=2e-2)


def test_recorded_vibration_is_filtered() -> None:
    world = World()
    t_s = np.arange(0, 1, 1e-3)
    rows = np.stack([0 * t_s, 0 * t_s, 1 + np.cos(2 * np.pi * 250 * t_s)], axis=1)
    world.replay(Recording("vibration.csv", t_s, {"acc": rows}))
    front_end = FrontEnd(
        world.sensed("acceleration_g"), lambda number, count: np.arange(number, number + count) / 104
    )
    front_end.configure(kernel(104.0, 400.0, None, 4.0))
    felt = front_end.block(20, np.arange(20, 80) / 104)
    np.testing.assert_allclose(felt[:, 2], 1.0, atol=5e-3)


@pytest.mark.parametrize("seed", range(10))
@pytest.mark.parametrize("moving", [False, True])
def test_overload_gives_full_scale_on_every_board(seed: int, moving: bool) -> None:
    """At four times full scale, the converter clips as the final step, after the sensor's offset and scale."""
    board = Board(seed=seed)
    board.world.set_gravity(8 * 9.80665)
    for bus_write in (b"\x10\x40", b"\x11\x40"):  # CTRL1_XL: 104 Hz, 2 g; CTRL2_G: 104 Hz, 250 dps
        board.i2c2.write(0x6B, bus_write)
    if moving:
        board.world.sweep("yaw", 4000, 4.0)  # 1,000 dps
        board.world.shake("north", 0.01, 50, 4.0)
        board.run_for(0.5)
    else:
        board.run_for(0.5)
    data = board.i2c2.write_read(0x6B, b"\x22", 12)
    gyro_z, acc_z = np.frombuffer(data, "<i2")[[2, 5]]
    assert acc_z == 0x7FFF
    if moving:
        assert gyro_z == 0x7FFF


def test_constant_overload_is_clipped_before_user_offset() -> None:
    """3 g at a full scale of 2 g, with Z_OFS_USR = 1 g, which is subtracted: the clipped 2 g become 1 g."""
    board = Board(ideal=True)
    board.world.set_gravity(3 * 9.80665)
    for write in (b"\x15\x08", b"\x75\x40", b"\x10\x40"):  # USR_OFF_W: 2^-6 g; 64 of them; 104 Hz, 2 g
        board.i2c2.write(0x6B, write)
    board.run_for(0.5)
    z_mg = int.from_bytes(board.i2c2.write_read(0x6B, b"\x2c", 2), "little", signed=True) * 0.061
    assert z_mg == pytest.approx(2000 - 1000, abs=2)
