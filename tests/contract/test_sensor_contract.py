"""Every sensor of the registry as a register file: identity, reset, write masks, bursts and notes."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.support.sensor_fakes import (
    CHANNELS,
    FACTS,
    PS_PER_MS,
    PS_PER_S,
    SENSORS,
    Channel,
    Chip,
    PartFacts,
    ramp,
)

ADDRESSES = st.integers(0, 0x7F)
BYTES = st.integers(0, 0xFF)
TIMES = st.integers(0, 30 * PS_PER_MS)
parts = pytest.mark.parametrize("name", SENSORS)


def following(facts: PartFacts, address: int) -> int:
    """Return the address after ``address`` in a burst (AN5040 4.7; PX4's LIS2MDL driver; LPS22HB datasheet 5.8)."""
    return facts.next_address.get(address, (address + 1) % 0x80)


def running(name: str) -> Chip:
    """Return a sensor whose channels all measure a world in which all samples are different."""
    chip = Chip(name)
    for channel in CHANNELS:
        if channel.part == name:
            slope = channel.value(40 * channel.scales[0][1])
            chip.world.signals[channel.name] = ramp(channel.value(0.0), slope)
            chip.configure(channel.scales[0][0])
    return chip


def test_every_sensor_has_data_for_these_tests() -> None:
    assert set(FACTS) == set(SENSORS)
    assert {channel.part for channel in CHANNELS} == set(SENSORS)


@parts
def test_sensor_is_registered_under_its_own_name(name: str) -> None:
    assert name == SENSORS[name].NAME
    assert FACTS[name].who_am_i[1] == SENSORS[name].WHO_AM_I


@parts
def test_who_am_i_is_read_only_identity(name: str) -> None:
    address, identity = FACTS[name].who_am_i
    chip = Chip(name)

    assert chip.byte(address) == identity
    chip.write(address, 0x00)
    assert chip.byte(address) == identity
    assert chip.part.register_name(address) == "WHO_AM_I"


@parts
def test_every_address_reads_reset_value_after_power_up(name: str) -> None:
    chip = Chip(name)

    assert bytes(chip.byte(address) for address in range(0x80)) == chip.part.registers.map.reset


@parts
@given(data=st.data())
def test_soft_reset_restores_written_registers(name: str, data: st.DataObject) -> None:
    facts, chip = FACTS[name], Chip(name)
    image, mask = chip.part.registers.map.reset, chip.part.registers.map.write_mask
    writable = [a for a in range(0x80) if mask[a] and chip.part.register_name(a) != "FUNC_CFG_ACCESS"]
    for address, value in data.draw(st.lists(st.tuples(st.sampled_from(writable), BYTES), max_size=20)):
        chip.write(address, value)
    kept = {address: chip.byte(address) for address in facts.kept_by_reset}
    chip.wait(PS_PER_S)  # whatever these writes began is over

    chip.write(*facts.soft_reset)
    assert chip.byte(facts.soft_reset[0]) & facts.soft_reset[1], "the bit reads 1 while the part resets"
    chip.wait(facts.reset_ps)

    found = {address: chip.byte(address) for address in writable}
    assert found == {address: kept.get(address, image[address]) for address in writable}


@parts
def test_sensor_stays_silent_after_soft_reset(name: str) -> None:
    facts, chip = FACTS[name], running(name)
    chip.wait(PS_PER_S)

    chip.write(*facts.soft_reset)
    flags = {channel.ready[0] for channel in CHANNELS if channel.part == name and channel.ready}
    for channel in CHANNELS:
        if channel.part == name:
            chip.counts(channel)
    before = [chip.byte(address) for address in flags]
    chip.wait(PS_PER_S)

    assert [chip.byte(address) for address in flags] == before
    assert not any(before)


@parts
@given(writes=st.lists(st.tuples(ADDRESSES, BYTES), max_size=40))
def test_writes_change_writable_bits_only(name: str, writes: list[tuple[int, int]]) -> None:
    """The writes come at power-up, so that there is no sample between them; they may select any bank."""
    chip = Chip(name)

    for address, value in writes:
        chip.write(address, value)

    bank = chip.part.active.map
    changed = [chip.byte(address) ^ bank.reset[address] for address in range(0x80)]
    shown = FACTS[name].shows_settings
    assert not any(
        bits & ~(bank.write_mask[address] | shown.get(address, 0)) for address, bits in enumerate(changed)
    )


@parts
@given(data=st.data(), value=BYTES)
def test_writable_bits_of_written_byte_are_readable(name: str, data: st.DataObject, value: int) -> None:
    chip = Chip(name)
    bank = chip.part.registers.map
    names = ("FUNC_CFG_ACCESS", "TIMESTAMP2_REG")  # the latter reads the counter
    special = {FACTS[name].self_clearing, *(a for a in range(0x80) if bank.name(a) in names)}
    address = data.draw(ADDRESSES.filter(lambda address: address not in special))

    chip.write(address, value)

    mask = bank.write_mask[address]
    assert chip.byte(address) == bank.reset[address] & ~mask | value & mask


@parts
@given(data=st.data(), values=st.binary(min_size=1, max_size=4))
def test_reserved_addresses_read_0_and_ignore_writes(name: str, data: st.DataObject, values: bytes) -> None:
    chip = Chip(name)
    reserved = [a for a in range(0x80) if chip.part.register_name(a) == "reserved"]
    address = data.draw(st.sampled_from(reserved))

    for value in values:
        chip.write(address, value)

    assert chip.notes == [("write ignored", f"reserved (0x{address:02X}) is not writable")] * len(values)
    chip.notes.clear()
    assert chip.byte(address) == 0
    ((kind, text),) = chip.notes
    assert kind == "reserved"
    assert text.startswith(f"0x{address:02X} ")


@parts
@given(
    earlier=st.lists(st.tuples(ADDRESSES, TIMES), max_size=4),
    held=st.booleans(),
    increments=st.booleans(),
    start=ADDRESSES,
    count=st.integers(1, 200),
    wait_ps=TIMES,
)
def test_burst_equals_single_byte_reads(
    name: str,
    earlier: list[tuple[int, int]],
    held: bool,
    increments: bool,
    start: int,
    count: int,
    wait_ps: int,
) -> None:
    """This includes wraps, a switched off increment, and pairs of which earlier reads have left one byte unread."""
    facts = FACTS[name]
    goes_on = increments or facts.increment_off is None
    burst, bytewise = running(name), running(name)
    for chip in (burst, bytewise):
        for channel in CHANNELS:
            if held and channel.part == name and channel.bdu:
                chip.configure(channel.bdu)
        for address, ps in earlier:
            chip.wait(ps)
            chip.read(address)
        if not goes_on and facts.increment_off:
            chip.write(*facts.increment_off)
        chip.wait(wait_ps)

    one_by_one, address = bytearray(), start
    for _ in range(count):
        one_by_one += bytewise.read(address)
        address = following(facts, address) if goes_on else address

    assert burst.read(start, count) == one_by_one
    assert burst.part.advance(start, count) == address
    assert [burst.read(a) for a in range(0x80)] == [bytewise.read(a) for a in range(0x80)]


@parts
@given(start=ADDRESSES, values=st.binary(min_size=1, max_size=20))
def test_burst_write_equals_single_byte_writes(name: str, start: int, values: bytes) -> None:
    burst, bytewise = Chip(name), Chip(name)

    burst.write(start, *values)
    address = start
    for value in values:
        bytewise.write(address, value)
        address = bytewise.part.advance(address, 1)

    assert burst.log == bytewise.log
    assert [burst.read(a) for a in range(0x80)] == [bytewise.read(a) for a in range(0x80)]


@pytest.mark.parametrize("channel", CHANNELS, ids=str)
def test_power_down_keeps_latest_sample(channel: Channel) -> None:
    chip = running(channel.part)
    chip.wait(PS_PER_S)
    last = chip.counts(channel)

    chip.configure(channel.off)
    chip.wait(PS_PER_S)

    assert any(last)
    assert chip.counts(channel) == last


@pytest.mark.parametrize("name", [name for name in SENSORS if FACTS[name].unmodelled])
def test_unmodelled_access_is_noted_by_name(name: str) -> None:
    unmodelled = FACTS[name].unmodelled
    assert unmodelled is not None
    address, value, what = unmodelled
    chip = Chip(name)

    chip.write(address, value)
    chip.byte(address)

    register = what.split(".", maxsplit=1)[0]
    assert chip.notes == [("not modelled", f"{what} written"), ("not modelled", f"{register} read")]


@parts
def test_setting_unmodelled_bit_is_noted(name: str) -> None:
    chip = Chip(name)
    for registers in chip.part.files():
        for address, mask in enumerate(registers.map.unmodelled):
            if mask:
                chip.notes.clear()
                registers.write(address, bytes([registers.map.reset[address] ^ mask]), 0)
                assert any(registers.map.name(address) in text for _, text in chip.notes)


@parts
def test_write_log_has_register_and_both_values(name: str) -> None:
    chip = Chip(name)
    address, register = FACTS[name].plain

    chip.write(address, 0x01)
    chip.write(address, 0x00)

    assert chip.log == [(register, 0x00, 0x01), (register, 0x01, 0x00)]


@parts
def test_usual_setup_raises_no_note(name: str) -> None:
    """The sensors have the settings that the lab's firmware makes on I2C."""
    chip = Chip(name)
    chip.configure(FACTS[name].usual)

    assert chip.notes == []


@parts
def test_unknown_channel_has_no_range(name: str) -> None:
    with pytest.raises(KeyError):
        Chip(name).part.sample_range("wind_m_s")
