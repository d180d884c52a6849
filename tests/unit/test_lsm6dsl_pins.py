"""INT1 and INT2 of the LSM6DSL: routing, polarity and times of edges (AN5040 4.2, 4.3)."""

from __future__ import annotations

from functools import partial

import pytest

from fcu_emulator.sensors import LSM6DSL
from fcu_emulator.sensors.lsm6dsl.feature import SIGNAL_NAMES, FeatureContext, SignalName, Signals
from fcu_emulator.sensors.lsm6dsl.pins import Routing
from fcu_emulator.sensors.pin import Pin
from fcu_emulator.sensors.register_file import RegisterFile
from fcu_emulator.sensors.sampling import SampleStream
from tests.support.motion_fakes import (
    CTRL1_XL,
    CTRL2_G,
    CTRL3_C,
    CTRL4_C,
    DRDY_PULSE_CFG,
    ENABLE,
    FREE_FALL,
    INT1_CTRL,
    INT2_CTRL,
    MD1_CFG,
    MD2_CFG,
    ON,
    STILL,
    TAP_CFG,
    Bench,
    Edge,
    sample_ps,
)
from tests.support.sensor_fakes import PS_PER_MS, PS_PER_S, PS_PER_US

CTRL6_C, MASTER_CONFIG = 0x15, 0x1A
OUT_TEMP, OUT_G, OUT_XL = 0x20, 0x22, 0x28
INT1_ROUTES: list[tuple[int, int, SignalName]] = [
    # datasheet 9.9 (INT1_CTRL), 9.85 (MD1_CFG) and 9.22 (MASTER_CONFIG), bit by bit
    (INT1_CTRL, 0x80, "STEP_DETECTOR"),
    (INT1_CTRL, 0x40, "SIGN_MOT"),
    (INT1_CTRL, 0x20, "FULL_FLAG"),
    (INT1_CTRL, 0x10, "FIFO_OVR"),
    (INT1_CTRL, 0x08, "FTH"),
    (INT1_CTRL, 0x04, "BOOT"),
    (INT1_CTRL, 0x02, "DRDY_G"),
    (INT1_CTRL, 0x01, "DRDY_XL"),
    (MD1_CFG, 0x80, "INACT_STATE"),
    (MD1_CFG, 0x40, "SINGLE_TAP"),
    (MD1_CFG, 0x20, "WU"),
    (MD1_CFG, 0x10, "FF"),
    (MD1_CFG, 0x08, "DOUBLE_TAP"),
    (MD1_CFG, 0x04, "6D"),
    (MD1_CFG, 0x02, "TILT"),
    (MD1_CFG, 0x01, "TIMER"),
    (MASTER_CONFIG, 0x80, "SENSORHUB"),
    (CTRL4_C, 0x10, "DEN_DRDY"),  # 9.16
]
INT2_ROUTES: list[tuple[int, int, SignalName]] = [
    # datasheet 9.10 (INT2_CTRL), 9.86 (MD2_CFG) and 9.8 (DRDY_PULSE_CFG_G)
    (INT2_CTRL, 0x80, "STEP_DELTA"),
    (INT2_CTRL, 0x40, "STEP_COUNT_OV"),
    (INT2_CTRL, 0x20, "FULL_FLAG"),
    (INT2_CTRL, 0x10, "FIFO_OVR"),
    (INT2_CTRL, 0x08, "FTH"),
    (INT2_CTRL, 0x04, "DRDY_TEMP"),
    (INT2_CTRL, 0x02, "DRDY_G"),
    (INT2_CTRL, 0x01, "DRDY_XL"),
    (MD2_CFG, 0x80, "INACT_STATE"),
    (MD2_CFG, 0x40, "SINGLE_TAP"),
    (MD2_CFG, 0x20, "WU"),
    (MD2_CFG, 0x10, "FF"),
    (MD2_CFG, 0x08, "DOUBLE_TAP"),
    (MD2_CFG, 0x04, "6D"),
    (MD2_CFG, 0x02, "TILT"),
    (MD2_CFG, 0x01, "IRON"),
    (DRDY_PULSE_CFG, 0x01, "WRIST_TILT"),
]
WHEREVER: list[tuple[int, int, SignalName, int]] = [
    *((*route, 0) for route in INT1_ROUTES),
    *((*route, 1) for route in INT2_ROUTES),
]


class Wires:
    """The routing alone; the test raises the signals."""

    def __init__(self, *writes: tuple[int, int]) -> None:
        registers = RegisterFile(LSM6DSL.MAP)
        xl, g, temperature = (SampleStream(size, lambda number, t_s: b"") for size in (6, 6, 2))
        self.signals = Signals()
        self.pins = Pin("INT1"), Pin("INT2")
        self.edges: list[Edge] = []
        for pin in self.pins:
            pin.observe(partial(self._edge, pin.name))
        chip = FeatureContext(
            registers, {}, xl, g, temperature, self.signals, *self.pins, lambda now_ps: None
        )
        self.routing = Routing(chip)
        for address, value in writes:
            registers.write(address, bytes([value]), 0)
        self.routing.configure(0)

    def _edge(self, name: str, at_ps: int, level: int) -> None:
        self.edges.append((name, at_ps, level))

    def raise_all(self, names: tuple[SignalName, ...], at_ps: int) -> list[int | None]:
        """Raise signals one after the other; return the levels of the pins."""
        for name in names:
            self.signals.set(name, True, at_ps)
        self.routing.catch_up(at_ps)
        return [pin.level for pin in self.pins]


def others(name: SignalName) -> tuple[SignalName, ...]:
    return tuple(signal for signal in SIGNAL_NAMES if signal != name)


@pytest.mark.parametrize(("address", "bit", "name", "pin"), WHEREVER)
def test_each_bit_routes_its_signal_and_no_other(address: int, bit: int, name: SignalName, pin: int) -> None:
    wires = Wires((address, bit))

    assert wires.raise_all(others(name), 1) == [0, 0]
    assert wires.raise_all((name,), 2) == [int(pin == 0), int(pin == 1)]


@pytest.mark.parametrize(("address", "bit", "name", "pin"), WHEREVER)
def test_int2_on_int1_routes_every_signal_to_int1(address: int, bit: int, name: SignalName, pin: int) -> None:
    wires = Wires((address, bit), (CTRL4_C, 0x20 | (bit if address == CTRL4_C else 0)))

    assert wires.raise_all(others(name), 1) == [0, 0]
    assert wires.raise_all((name,), 2) == [1, 0]


def test_every_signal_can_be_routed() -> None:
    assert {name for _, _, name, _ in WHEREVER} == set(SIGNAL_NAMES)


@pytest.mark.parametrize(
    ("ctrl3", "levels"),
    [(0x04, (0, 1)), (0x24, (1, 0)), (0x14, (None, 1)), (0x34, (None, 0))],
    ids=["push-pull", "active low", "open drain", "open drain, active low"],
)
def test_polarity_and_open_drain_determine_pin_levels(
    ctrl3: int, levels: tuple[int | None, int | None]
) -> None:
    """H_LACTIVE and PP_OD (datasheet 9.15): with open drain, only the active level is driven."""
    wires = Wires((INT1_CTRL, 0x08), (CTRL3_C, ctrl3))

    assert [pin.level for pin in wires.pins] == [levels[0]] * 2
    assert wires.raise_all(("FTH",), 1) == [levels[1], levels[0]]


def test_signals_of_pin_are_combined_by_or() -> None:
    wires = Wires((INT1_CTRL, 0x18))
    wires.signals.set("FTH", True, 10)
    wires.signals.set("FIFO_OVR", True, 20)
    wires.signals.set("FTH", False, 30)
    wires.signals.set("FIFO_OVR", False, 40)
    wires.routing.catch_up(50)

    assert wires.edges == [("INT1", 10, 1), ("INT1", 40, 0)]


def test_late_signals_are_reported_in_time_order() -> None:
    """Functions report one after the other. Reports for the same time must not cause a glitch."""
    wires = Wires((INT1_CTRL, 0x18), (INT2_CTRL, 0x08))
    wires.signals.set("FTH", True, 10)
    wires.signals.set("FTH", False, 30)
    wires.signals.set("FIFO_OVR", True, 30)
    wires.signals.set("FIFO_OVR", False, 40)
    wires.signals.set("FIFO_OVR", True, 50)
    wires.signals.set("FTH", True, 45)
    wires.routing.catch_up(49)

    assert wires.edges == [
        ("INT1", 10, 1),
        ("INT2", 10, 1),
        ("INT2", 30, 0),
        ("INT1", 40, 0),
        ("INT1", 45, 1),
        ("INT2", 45, 1),
    ]
    assert wires.routing.next_event_ps() == 50


@pytest.mark.parametrize("writes", [((CTRL6_C, 0x80),), ((CTRL6_C, 0x40),), ((MASTER_CONFIG, 0x11),)])
def test_int2_as_input_is_not_driven(writes: tuple[tuple[int, int], ...]) -> None:
    """It is an input in any DEN mode, and as the sensor hub's external trigger."""
    wires = Wires((INT1_CTRL, 0x08), (INT2_CTRL, 0x08), *writes)

    assert wires.raise_all(("FTH",), 1) == [1, None]


def test_active_signal_appears_on_pin_when_routed() -> None:
    bench = Bench([STILL], (FREE_FALL, 3), (TAP_CFG, ENABLE)).at(10)
    bench.wait(5)
    bench.byte(0x1B)
    bench.write(MD2_CFG, 0x10)
    assert bench.look() == [("INT2", bench.t_ps, 1)]

    bench.wait(5)
    bench.write(CTRL3_C, 0x24)
    assert bench.look()[1:] == [("INT1", bench.t_ps, 1), ("INT2", bench.t_ps, 0)]


# -- data-ready (AN5040 4.3) --------------------------------------------------------------------------------


@pytest.mark.parametrize("high_byte", [0x29, 0x2B, 0x2D])
def test_latched_data_ready_follows_flag(high_byte: int) -> None:
    bench = Bench([STILL], (INT1_CTRL, 0x01)).at(2)
    bench.wait(PS_PER_US)
    bench.read(0x28)  # a low byte clears nothing
    bench.wait(PS_PER_US)
    bench.read(high_byte)
    read_ps = bench.t_ps
    bench.at(7)

    assert bench.look() == [("INT1", sample_ps(0), 1), ("INT1", read_ps, 0), ("INT1", sample_ps(3), 1)]


def test_each_sensor_has_its_own_data_ready() -> None:
    bench = Bench([STILL], (INT1_CTRL, 0x02), (INT2_CTRL, 0x04), (CTRL2_G, 0x40))
    bench.wait(PS_PER_S)
    bench.read(OUT_XL, 6)
    assert [name for name, _, _ in bench.look()] == ["INT2", "INT1"], "52 Hz, and the gyroscope after 70 ms"

    bench.read(OUT_G, 6)
    assert bench.look()[2:] == [("INT1", PS_PER_S, 0)]
    bench.wait(1)
    bench.read(OUT_TEMP, 2)
    assert bench.look()[3:] == [("INT2", PS_PER_S + 1, 0)]


def test_pulsed_data_ready_lasts_75_us_despite_reads() -> None:
    bench = Bench([STILL], (DRDY_PULSE_CFG, 0x80), (INT2_CTRL, 0x01)).at(1)
    bench.read(OUT_XL, 6)
    bench.at(3)

    expected = [
        edge
        for number in range(3)
        for edge in (("INT2", sample_ps(number), 1), ("INT2", sample_ps(number) + 75 * PS_PER_US, 0))
    ]
    assert bench.look() == [*expected, ("INT2", sample_ps(3), 1)]
    assert bench.byte(0x1E) & 0x01, "the flag in STATUS_REG is latched all the same"


def test_data_ready_has_no_edges_after_power_down() -> None:
    bench = Bench([STILL], (INT1_CTRL, 0x01)).at(3)
    bench.write(CTRL1_XL, 0x00)
    bench.read(OUT_XL, 6)
    bench.wait(PS_PER_S)

    assert bench.look() == [("INT1", sample_ps(0), 1), ("INT1", sample_ps(3), 0)]


def test_rate_change_restarts_sampling_at_its_time() -> None:
    bench = Bench([STILL], (DRDY_PULSE_CFG, 0x80), (INT1_CTRL, 0x01)).at(2)
    bench.wait(PS_PER_MS)
    bench.write(CTRL1_XL, 0x40)
    changed_ps = bench.t_ps
    bench.wait(PS_PER_S // 50)

    rises = [at_ps for _, at_ps, level in bench.look() if level]
    assert rises == [*(sample_ps(n) for n in range(3)), *(sample_ps(n, 104, changed_ps) for n in range(2))]


def test_pins_without_routing_need_no_events() -> None:
    bench = Bench([STILL], (TAP_CFG, ENABLE))
    assert bench.part.next_event_ps() > 10**6 * PS_PER_S

    bench.write(INT1_CTRL, 0x01)
    assert bench.part.next_event_ps() == sample_ps(0)


def test_latched_data_ready_schedules_no_events_until_read() -> None:
    bench = Bench([STILL], (INT1_CTRL, 0x01)).at(0)
    bench.look()
    assert bench.part.next_event_ps() > 10**6 * PS_PER_S

    bench.read(OUT_XL, 6)
    assert bench.part.next_event_ps() == sample_ps(1)


# -- boot and reset -----------------------------------------------------------------------------------------


def test_int1_boot_is_high_for_15_ms() -> None:
    """AN5040 5.7."""
    bench = Bench([STILL], (INT1_CTRL, 0x04))
    bench.wait(PS_PER_MS)
    bench.write(CTRL3_C, 0x84)
    bench.wait(PS_PER_S)

    assert bench.look() == [("INT1", PS_PER_MS, 1), ("INT1", 16 * PS_PER_MS, 0)]


def test_sw_reset_releases_pins() -> None:
    bench = Bench([STILL], (INT1_CTRL, 0x01), (CTRL3_C, 0x24), xl=ON).at(3)
    bench.wait(1)
    bench.write(CTRL3_C, 0x25)

    idle_high = [("INT1", 0, 1), ("INT2", 0, 1)]
    edges = [
        *idle_high,
        ("INT1", sample_ps(0), 0),
        ("INT2", bench.t_ps, 0),
    ]  # INT1 goes from active to idle low
    assert bench.look() == edges
    bench.wait(PS_PER_S)
    assert bench.look() == edges
