"""The declarations of every sensor agree with its construction, its buses and its deviations."""

from __future__ import annotations

from typing import ClassVar

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fcu_emulator.sensors import LIS2MDL, LPS22HB, LSM6DSL
from fcu_emulator.sensors.declaration import Bus
from fcu_emulator.sensors.part import Sensor, SubaddressTarget
from fcu_emulator.sensors.register import ADDRESSES, Register, RegisterMap
from fcu_emulator.sensors.spi import READ, SpiTarget
from tests.support.sensor_fakes import CHANNELS, SENSORS, Channel

parts = pytest.mark.parametrize("part", SENSORS.values(), ids=list(SENSORS))
WORLD = {
    "acceleration_g": lambda t_s: np.tile((0.0, 0.0, 1.0), (len(t_s), 1)),
    "angular_rate_dps": lambda t_s: np.zeros((len(t_s), 3)),
    "magnetic_field_mgauss": lambda t_s: np.tile((200.0, 0.0, 400.0), (len(t_s), 1)),
    "pressure_hpa": lambda t_s: np.full(len(t_s), 1000.0),
    "temperature_degc": lambda t_s: np.full(len(t_s), 25.0),
    "relative_humidity_percent": lambda t_s: np.full(len(t_s), 45.0),
}


@parts
def test_sensor_is_built_from_its_declared_signals(part: type[Sensor]) -> None:
    chip = part.build(WORLD, part.ERRORS.of_quality("worst", 3), 3, powered_on_ps=None)

    for quantity in part.SIGNALS:
        low, high, lsb = chip.sample_range(quantity.name)
        assert low < high
        assert lsb > 0
        assert quantity.name.endswith(quantity.unit.lower())


@parts
def test_measured_quantities_have_readable_registers(part: type[Sensor]) -> None:
    for quantity in part.SIGNALS:
        first = quantity.output.address
        for address in range(first, first + quantity.output.size * quantity.axes):
            register = part.MAP.at[address]
            assert register is not None
            assert register.access == "r"


@pytest.mark.parametrize("channel", CHANNELS, ids=str)
def test_outputs_have_datasheet_addresses(channel: Channel) -> None:
    (quantity,) = (one for one in SENSORS[channel.part].SIGNALS if one.name == channel.name)
    output = quantity.output
    assert (output.address, output.size, output.zero) == (channel.address, channel.width, channel.zero)


@parts
def test_missing_signal_is_reported(part: type[Sensor]) -> None:
    missing = part.SIGNALS[0].name

    with pytest.raises(KeyError, match=missing):
        part.build({name: signal for name, signal in WORLD.items() if name != missing})


@parts
def test_every_deviation_has_description_unit_and_source(part: type[Sensor]) -> None:
    assert part.ERRORS.PART == part.NAME
    for figure in part.ERRORS.figures().values():
        assert figure.doc
        assert figure.unit
        assert figure.source


def test_addresses_equal_datasheet() -> None:
    """LSM6DSL datasheet Table 12, LIS2MDL 6.1.1, LPS22HB Table 11."""
    assert LSM6DSL.BUS.i2c_addresses == (0x6A, 0x6B)
    assert LIS2MDL.BUS.i2c_addresses == (0x1E,)
    assert LPS22HB.BUS.i2c_addresses == (0x5C, 0x5D)


@parts
def test_sensor_uses_declared_wires_after_reset(part: type[Sensor]) -> None:
    chip = part.build(WORLD)

    assert part.BUS.spi_wires in (None, chip.spi_wires())


# -- bursts that go on only if the sub-address says so ----------------------------------------------------


class CELL(Register, addr=0, size=ADDRESSES // 2, names=tuple(f"CELL{n}" for n in range(ADDRESSES // 2))):
    """A device of 64 plain bytes."""


class Asking(Sensor):
    """A sensor whose bursts increment only if bit 7 (I2C) or bit 6 (SPI) is set, as ST's HTS221."""

    NAME: ClassVar[str] = "ASKING"
    BUS: ClassVar[Bus] = Bus(
        i2c_addresses=(0x5F,), spi_wires=4, source="here", i2c_increment_bit=0x80, spi_increment_bit=0x40
    )

    def __init__(self) -> None:
        super().__init__(RegisterMap([CELL]))
        self.registers.mem[: ADDRESSES // 2] = bytes(range(100, 164))


ADDRESS, COUNT = st.integers(0, 40), st.integers(1, 20)


def i2c_read(target: SubaddressTarget, subaddress: int, counts: list[int]) -> bytes:
    assert target.start(read=False)
    target.write(bytes([subaddress]))
    data = b""
    for count in counts:
        assert target.start(read=True)
        data += target.read(count)
        target.stop()
    return data


@given(ADDRESS, st.lists(COUNT, min_size=1, max_size=3))
def test_i2c_read_increments_only_with_bit_7(start: int, counts: list[int]) -> None:
    """This also applies to the next message: a read continues at the previous sub-address."""
    target = SubaddressTarget(Asking(), lambda: 0)
    counts = [count % 7 + 1 for count in counts]
    total = sum(counts)

    assert i2c_read(target, start | 0x80, counts) == bytes(range(100 + start, 100 + start + total))
    assert i2c_read(target, start, counts) == bytes([100 + start]) * total
    assert target.read_from(start | 0x80, total, 0) == bytes(range(100 + start, 100 + start + total))
    assert target.read_from(start, total, 0) == bytes([100 + start]) * total
    assert target.register_name(start | 0x80) == target.register_name(start) == f"CELL{start}"


@given(ADDRESS, COUNT)
def test_spi_read_increments_only_with_bit_6(start: int, count: int) -> None:
    target = SpiTarget(Asking(), lambda: 0)
    found = []
    for command in (READ | 0x40 | start, READ | start):
        target.select()
        target.write(bytes([command]), 3)
        found.append(target.read(count, 3, 4))

    assert found == [bytes(range(100 + start, 100 + start + count)), bytes([100 + start]) * count]


@given(ADDRESS, st.binary(min_size=1, max_size=10))
def test_write_without_increment_bit_stays_at_first_register(start: int, data: bytes) -> None:
    part = Asking()
    target = SubaddressTarget(part, lambda: 0)
    before = bytes(part.registers.mem)

    target.start(read=False)
    target.write(bytes([start]) + data)
    target.stop()
    assert part.registers.mem[start] == data[-1]
    assert part.registers.mem[start + 1 :] == before[start + 1 :]

    target.start(read=False)
    target.write(bytes([start | 0x80]) + data)
    target.stop()
    assert part.registers.mem[start : start + len(data)] == data
