"""The LIS2MDL's INT/DRDY pin: its level, and the times of its edges (datasheet 8.7; AN5069 6.3 and 10)."""

from __future__ import annotations

import pytest

from fcu_emulator.sensors.register_file import NEVER_PS
from tests.support.lis2mdl_fakes import (
    CFG_REG_A,
    CFG_REG_C,
    DRDY_ON_PIN,
    FOURWSPI,
    IEA,
    IEL,
    IEN,
    INT_ON_PIN,
    INT_SOURCE_REG,
    OUTX_H_REG,
    XYZ,
    at,
    threshold,
    watched,
    x_counts,
)
from tests.support.notes import kinds, texts
from tests.support.sensor_fakes import MAGNETOMETER
from tests.support.words import Words


def test_pin_is_high_impedance_without_routing() -> None:
    chip = x_counts(200)
    threshold(chip, 100, XYZ | IEA | IEN)
    edges = watched(chip, 0x00)

    chip.t_ps = at(9)
    chip.part.catch_up(chip.t_ps)

    (pin,) = chip.part.pins()
    assert (pin.name, pin.level, edges) == ("INT/DRDY", None, [])
    assert chip.part.next_event_ps() == NEVER_PS


@pytest.mark.parametrize(("polarity", "active"), [(IEA, 1), (0, 0)])
def test_int_pin_edges_have_sample_times(polarity: int, active: int) -> None:
    """The times of edges are exact although the sensor is not read before the tenth sample."""
    chip = x_counts(0, 0, 200, 200, 0, -200, 0)
    threshold(chip, 100, XYZ | polarity | IEN)
    edges = watched(chip, INT_ON_PIN)

    chip.t_ps = at(10)
    chip.part.catch_up(chip.t_ps)

    idle = 1 - active
    assert edges == [(0, idle), (at(2), active), (at(4), idle), (at(5), active), (at(6), idle)]


@pytest.mark.parametrize(("polarity", "active"), [(IEA, 1), (0, 0)])
def test_latched_int_pin_falls_on_register_read(polarity: int, active: int) -> None:
    chip = x_counts(0, 200, 0)
    threshold(chip, 100, XYZ | polarity | IEL | IEN)
    edges = watched(chip, INT_ON_PIN)
    chip.t_ps = read_ps = at(7) + 12345
    chip.byte(INT_SOURCE_REG)

    assert edges == [(0, 1 - active), (at(1), active), (read_ps, 1 - active)]


def test_latched_int_pin_stays_high_between_polled_samples() -> None:
    chip = x_counts(0, 200, 0, 0)
    threshold(chip, 100, XYZ | IEA | IEL | IEN)
    edges = watched(chip, INT_ON_PIN)
    for number in range(4):
        chip.part.catch_up(at(number))

    assert edges == [(0, 0), (at(1), 1)]


def test_data_ready_falls_on_high_byte_read() -> None:
    """AN5069 6.3: the pin stays high until a read."""
    chip = x_counts(1, 2, 3)
    chip.write(CFG_REG_A, 0x8C)
    edges = watched(chip, DRDY_ON_PIN)

    chip.t_ps = at(2) + 500
    chip.read(0x68)
    chip.read(OUTX_H_REG)
    chip.t_ps = at(5)
    chip.counts(MAGNETOMETER)

    assert edges == [(0, 0), (at(0), 1), (at(2) + 500, 0), (at(3), 1), (at(5), 0)]


def test_single_measurement_raises_data_ready_pin() -> None:
    chip = x_counts(1)
    edges = watched(chip, DRDY_ON_PIN)
    chip.write(CFG_REG_A, 0x81)

    assert chip.part.next_event_ps() == at(0)
    chip.t_ps = at(30)
    chip.part.catch_up(chip.t_ps)

    assert edges == [(0, 0), (at(0), 1)]
    assert chip.part.next_event_ps() == NEVER_PS


def test_pending_data_ready_appears_on_pin_when_routed() -> None:
    chip = x_counts(1)
    chip.write(CFG_REG_A, 0x8C)
    chip.t_ps = at(0) + 1

    assert watched(chip, DRDY_ON_PIN) == [(at(0) + 1, 1)]


def test_int_has_priority_over_data_ready() -> None:
    """Datasheet T29: with both bits set the pin shows INT."""
    chip = x_counts(0, 200)
    threshold(chip, 100, XYZ | IEA | IEN)
    edges = watched(chip, INT_ON_PIN | DRDY_ON_PIN)

    chip.t_ps = at(3)
    chip.part.catch_up(chip.t_ps)
    chip.counts(MAGNETOMETER)

    assert edges == [(0, 0), (at(1), 1)]


def test_pin_is_sdo_with_4_wire_spi(words: Words) -> None:
    chip = x_counts(200)
    threshold(chip, 100, XYZ | IEA | IEN)
    edges = watched(chip, FOURWSPI | INT_ON_PIN)

    chip.t_ps = at(1)
    chip.part.catch_up(chip.t_ps)

    assert (chip.part.pins()[0].level, edges) == (None, [])
    assert kinds(chip.notes) == ["forbidden"]
    words("sensors", texts(chip.notes))


def test_catch_up_reports_every_edge_at_its_time() -> None:
    """A board catches up in this way if the pin is connected."""
    chip = x_counts(0, 200, 0, 200, 0)
    threshold(chip, 100, XYZ | IEA | IEN)
    edges = watched(chip, INT_ON_PIN)
    seen_at = []
    for number in range(6):
        due_ps = chip.part.next_event_ps()
        assert due_ps == at(number)
        chip.part.catch_up(due_ps)
        if len(edges) > len(seen_at) + 1:
            seen_at.append(due_ps)

    assert edges == [(0, 0), (at(1), 1), (at(2), 0), (at(3), 1), (at(4), 0)]
    assert seen_at == [at(1), at(2), at(3), at(4)]


def test_unwired_pin_needs_no_events() -> None:
    chip = x_counts(200)
    threshold(chip, 100, XYZ | IEA | IEN)
    chip.write(CFG_REG_C, INT_ON_PIN)

    assert chip.part.next_event_ps() == NEVER_PS


def test_wired_pin_of_disabled_generator_needs_no_events() -> None:
    chip = x_counts(200)
    threshold(chip, 100, XYZ | IEA)
    watched(chip, INT_ON_PIN)

    assert chip.part.next_event_ps() == NEVER_PS
