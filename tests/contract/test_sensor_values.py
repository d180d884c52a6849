"""Every channel of every part: values and back, rates, data-ready, block data update."""

from __future__ import annotations

from fractions import Fraction

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.support.sensor_fakes import (
    ACCELEROMETER,
    CHANNELS,
    GYROSCOPE,
    HUMIDITY,
    MAGNETOMETER,
    PRESSURE,
    PS_PER_S,
    Channel,
    Chip,
    Writes,
    constant,
    ramp,
    step,
)

channels = pytest.mark.parametrize("channel", CHANNELS, ids=str)
SCALES = [
    pytest.param(channel, writes, lsb, id=f"{channel}-{number}")
    for channel in CHANNELS
    for number, (writes, lsb) in enumerate(channel.scales)
]
RATES = [
    # LSM6DSL datasheet T52 and T55, the exact high rates from T3: (channel, set-up, rate)
    *(
        (channel, (register, code << 4), Fraction(rate))
        for channel, register in ((ACCELEROMETER, 0x10), (GYROSCOPE, 0x11))
        for code, rate in enumerate((12.5, 26, 52, 104, 208, 416, 833, 1666, 3332, 6664), start=1)
    ),
    (ACCELEROMETER, (0x10, 0xB0), Fraction("12.5")),  # code 11 in high performance
    # LIS2MDL datasheet T27, LPS22HB datasheet T17
    *(
        (MAGNETOMETER, (0x60, 0x80 | code << 2), Fraction(rate))
        for code, rate in enumerate((10, 20, 50, 100))
    ),
    *(
        (PRESSURE, (0x10, code << 4), Fraction(rate))
        for code, rate in enumerate((1, 10, 25, 50, 75), start=1)
    ),
    *((HUMIDITY, (0x20, 0x80 | code), Fraction(rate)) for code, rate in enumerate((1, 7, 12.5), start=1)),
]
rates = pytest.mark.parametrize(("channel", "write", "rate_hz"), RATES, ids=str)


def started(channel: Channel, writes: Writes | None = None) -> Chip:
    """Return a channel that samples from t = 0 on, each sample 40 LSB above the previous one."""
    chip = Chip(channel.part)
    lsb_per_s = float(40 * channel.rate_hz) * channel.scales[0][1]
    chip.world.signals[channel.name] = ramp(channel.value(channel.zero), channel.value(lsb_per_s))
    chip.configure(writes or channel.scales[0][0])
    return chip


# -- values -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("channel", "writes", "lsb"), SCALES)
def test_range_and_lsb_equal_datasheet(channel: Channel, writes: Writes, lsb: float) -> None:
    chip = Chip(channel.part)
    chip.configure(writes)

    low, high, found = chip.part.sample_range(channel.name)

    assert found == pytest.approx(lsb, rel=1e-12)
    if channel is PRESSURE:  # LPS22HB datasheet T3: the operating range, far inside 24 bits
        assert (low, high) == (260.0, 1260.0)
    else:
        lowest, highest = channel.limits
        assert (low, high) == pytest.approx((channel.zero + lowest * lsb, channel.zero + highest * lsb))


@pytest.mark.parametrize(("channel", "writes", "lsb"), SCALES)
@given(data=st.data())
def test_value_is_read_back_within_half_lsb(
    channel: Channel, writes: Writes, lsb: float, data: st.DataObject
) -> None:
    chip = Chip(channel.part)
    chip.configure(writes)
    low, high, _ = chip.part.sample_range(channel.name)
    values = [data.draw(st.floats(low, high)) for _ in range(channel.axes)]
    chip.set(channel.name, *values)

    chip.wait(channel.sample_ps(channel.settled))

    read = [channel.zero + count * lsb for count in chip.counts(channel)]
    assert read == pytest.approx(values, rel=0, abs=0.5001 * lsb)


@pytest.mark.parametrize(("channel", "writes", "lsb"), SCALES)
@pytest.mark.parametrize("sign", [-1, 1])
def test_value_out_of_range_saturates(channel: Channel, writes: Writes, lsb: float, sign: int) -> None:
    chip = Chip(channel.part)
    chip.configure(writes)
    chip.set(channel.name, *channel.value(sign * 1e9))

    chip.wait(channel.sample_ps(0))

    assert chip.counts(channel) == channel.value(channel.limits[sign > 0])


@channels
def test_world_change_is_visible_at_next_sample(channel: Channel) -> None:
    chip = Chip(channel.part)
    before, after = (constant(*channel.value(channel.zero + n * channel.scales[0][1])) for n in (10, 20))
    chip.world.signals[channel.name] = before
    chip.configure(channel.scales[0][0])
    chip.wait(channel.sample_ps(7))
    old = chip.counts(channel)

    chip.world.signals[channel.name] = step(before, after, chip.t_ps / PS_PER_S + 1e-6)
    chip.part.world_changed()

    assert chip.counts(channel) == old
    chip.wait(channel.sample_ps(8) - channel.sample_ps(7) - 1)
    assert chip.counts(channel) == old
    chip.wait(1)
    assert chip.counts(channel) != old


# -- time -------------------------------------------------------------------------------------------------


@rates
@given(data=st.data())
def test_samples_come_at_exact_multiples_of_period(
    channel: Channel, write: tuple[int, int], rate_hz: Fraction, data: st.DataObject
) -> None:
    """A sample does not exist one picosecond before its time, but exists at its time; also after an hour."""
    chip = started(channel, (write,))
    first_ps = channel.turn_on_ps
    first_ps += -(-PS_PER_S // rate_hz) if channel.first_ps is None else channel.first_ps
    for sample in sorted(data.draw(st.sets(st.integers(1, int(3600 * rate_hz)), min_size=1, max_size=5))):
        due_ps = first_ps - int(-sample * PS_PER_S / rate_hz // 1)
        chip.t_ps = due_ps - 1
        chip.counts(channel)
        assert not chip.is_ready(channel)
        chip.t_ps = due_ps
        assert chip.is_ready(channel)


@rates
def test_ten_seconds_have_expected_number_of_samples(
    channel: Channel, write: tuple[int, int], rate_hz: Fraction
) -> None:
    chip = started(channel, (write,))
    step_ps = int(PS_PER_S / rate_hz / 2)
    seen = 0

    while chip.t_ps + step_ps < min(Fraction(10), 2000 / rate_hz) * PS_PER_S:
        chip.wait(step_ps)
        if chip.is_ready(channel):
            chip.counts(channel)
            seen += 1

    first_ps = channel.turn_on_ps + (PS_PER_S / rate_hz if channel.first_ps is None else channel.first_ps)
    assert seen == (chip.t_ps - first_ps) * rate_hz // PS_PER_S + 1


# -- data-ready and overrun ----------------------------------------------------------------------------------


@pytest.mark.parametrize("channel", [channel for channel in CHANNELS if channel.ready], ids=str)
@given(data=st.data())
def test_data_ready_clears_on_any_high_byte_read(channel: Channel, data: st.DataObject) -> None:
    """AN5040 4.3, AN5069 6.3; the LPS22HB has only one high byte."""
    chip = started(channel)
    axis = data.draw(st.integers(0, channel.axes - 1))
    high = channel.address + axis * channel.width + channel.width - 1

    assert not chip.is_ready(channel)
    chip.wait(channel.sample_ps(0))
    assert chip.is_ready(channel)
    for low in range(channel.address, channel.address + channel.size):
        if (low - channel.address) % channel.width != channel.width - 1:
            chip.read(low)
    assert chip.is_ready(channel), "low bytes keep it"
    chip.read(high)
    assert not chip.is_ready(channel)
    chip.wait(channel.sample_ps(1) - channel.sample_ps(0))
    assert chip.is_ready(channel)


@pytest.mark.parametrize("channel", [channel for channel in CHANNELS if channel.overrun], ids=str)
@pytest.mark.parametrize("looked_at_between", [False, True])
def test_overwriting_unread_sample_sets_overrun(channel: Channel, looked_at_between: bool) -> None:
    chip = started(channel)
    assert channel.ready is not None
    status = channel.ready[0]

    chip.t_ps = channel.sample_ps(0)
    if looked_at_between:
        assert not chip.byte(status) & channel.overrun
    chip.t_ps = channel.sample_ps(1)
    assert chip.byte(status) & channel.overrun
    chip.counts(channel)
    assert not chip.byte(status) & channel.overrun
    chip.t_ps = channel.sample_ps(2)
    assert not chip.byte(status) & channel.overrun


# -- block data update --------------------------------------------------------------------------------------

HELD = [channel for channel in CHANNELS if channel.bdu]


def word(channel: Channel, axis: int) -> range:
    """Return the addresses of one word."""
    first = channel.address + axis * channel.width
    return range(first, first + channel.width)


@pytest.mark.parametrize("channel", HELD, ids=str)
@pytest.mark.parametrize("status_looked_at", [False, True])
@given(data=st.data())
def test_bdu_keeps_both_bytes_from_one_sample(
    channel: Channel, status_looked_at: bool, data: st.DataObject
) -> None:
    """AN5040 4.4, AN5069 6.4, LPS22HB datasheet 9.5. Afterwards the word shows the latest sample immediately."""
    chip = started(channel, channel.scales[0][0] + (channel.bdu or ()))
    addresses = word(channel, data.draw(st.integers(0, channel.axes - 1)))
    samples = data.draw(st.integers(1, 40))
    chip.wait(channel.sample_ps(3))
    whole = [chip.byte(address) for address in addresses]
    begun = chip.byte(addresses[0])

    chip.wait(channel.sample_ps(3 + samples) - channel.sample_ps(3))
    if status_looked_at and channel.ready:
        chip.byte(channel.ready[0])

    assert [begun, *(chip.byte(address) for address in addresses[1:])] == whole
    latest = [chip.byte(address) for address in addresses]
    undisturbed = started(channel, channel.scales[0][0])
    undisturbed.wait(channel.sample_ps(3 + samples))
    assert bytes(latest) == undisturbed.read(addresses[0], len(addresses))
    assert latest != whole


@pytest.mark.parametrize("channel", HELD, ids=str)
def test_word_without_bdu_can_mix_two_samples(channel: Channel) -> None:
    """BDU prevents this: without BDU, a read between 0x00FF and 0x0100 gives 0x01FF or 0x0000."""
    chip = Chip(channel.part)
    lsb = channel.scales[0][1]
    below, above = (constant(*channel.value(channel.zero + count * lsb)) for count in (0x00FF, 0x0100))
    last_below_ps = channel.sample_ps(channel.settled)
    chip.world.signals[channel.name] = step(below, above, (last_below_ps + 1000) / PS_PER_S)
    chip.configure(channel.scales[0][0])
    low, high = word(channel, 0)[:2]

    chip.wait(last_below_ps)
    first = chip.byte(low)
    chip.wait(channel.sample_ps(channel.settled + 20) - last_below_ps)  # the gyroscope's filter has settled

    assert (first, chip.byte(high)) == (0xFF, 0x01)
