"""A sensor on a bench, with a world and a virtual time that tests control, and the facts about each sensor.

The facts are written from the datasheets (LSM6DSL DocID028475 Rev 7, LIS2MDL DocID030621 Rev 3, LPS22HB DocID027083
Rev 6) and not taken from ``sensors``, so that a wrong constant there does not agree with itself.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from fractions import Fraction
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from fcu_emulator import sensors
from fcu_emulator.sensors import LIS2MDL, LPS22HB, LSM6DSL, Sensor
from tests.support.recipe import HTX221

SENSORS: dict[str, type[Sensor]] = {**sensors.SENSORS, HTX221.NAME: HTX221}
"""The sensors of the product, and the sensor of docs/recipes.md, which has the same properties."""
PS_PER_US, PS_PER_MS, PS_PER_S = 10**6, 10**9, 10**12

Array: TypeAlias = NDArray[np.float64]
Signal: TypeAlias = Callable[[Array], Array]
Writes: TypeAlias = tuple[tuple[int, int], ...]
"""(address, value) in the order in which they are written."""


def constant(*values: float) -> Signal:
    """Return a constant signal: one value for a scalar, three for a vector."""
    return ramp(values, (0.0,) * len(values))


def ramp(start: tuple[float, ...], per_s: tuple[float, ...]) -> Signal:
    """Return a signal that grows linearly with time, so that all samples are different."""

    def signal(t_s: Array) -> Array:
        rows: Array = np.asarray(start) + np.outer(t_s, per_s)
        return rows if len(start) > 1 else rows[:, 0]

    return signal


def step(before: Signal, after: Signal, at_s: float) -> Signal:
    """Return a signal that is ``before`` up to ``at_s`` and ``after`` from then on. Past values do not change."""

    def signal(t_s: Array) -> Array:
        later = t_s >= at_s
        chosen = later if before(t_s).ndim == 1 else later[:, np.newaxis]
        return np.where(chosen, after(t_s), before(t_s))

    return signal


class Moving:
    """A signal that states that it always moves fast."""

    def __init__(self, signal: Signal) -> None:
        self._signal = signal

    def __call__(self, t_s: Array) -> Array:
        return self._signal(t_s)

    def agitated(self, from_s: float, to_s: float, pace_s: float) -> list[tuple[float, float]]:
        return [(from_s, to_s)]


class FakeWorld:
    """The signals of all sensors by channel name, which can be replaced at any time.

    Plain functions are the outputs of the sensors' converters; with ``agitated`` they are signals of the world.
    """

    def __init__(self, agitated: bool = False) -> None:
        self._agitated = agitated
        self.signals: dict[str, Signal] = {
            "acceleration_g": constant(0.0, 0.0, 1.0),
            "angular_rate_dps": constant(0.0, 0.0, 0.0),
            "magnetic_field_mgauss": constant(200.0, 0.0, -400.0),
            "pressure_hpa": constant(1013.25),
            "temperature_degc": constant(25.0),
            "relative_humidity_percent": constant(45.0),
        }

    def __getitem__(self, channel: str) -> Signal:
        def now_connected(t_s: Array) -> Array:
            return self.signals[channel](t_s)

        return Moving(now_connected) if self._agitated else now_connected


@dataclass(frozen=True)
class Channel:
    """Output words of one physical quantity, named as in ``sample_range``."""

    part: str
    name: str
    address: int
    scales: tuple[tuple[Writes, float], ...]  # set-up of each full scale, which starts sampling; its LSB
    off: Writes
    rate_hz: Fraction
    first_ps: int | None = None  # to the first sample; one period if None
    turn_on_ps: int = 0  # before that
    settled: int = 0  # number of the first sample that shows nothing of the start
    ready: tuple[int, int] | None = None  # status register and flag
    overrun: int = 0  # flag in the same register
    axes: int = 3
    width: int = 2  # bytes per word
    zero: float = 0.0  # the value that reads 0
    bits: int = 16
    bdu: Writes | None = None  # after the set-up; None: nothing holds this channel

    def __str__(self) -> str:
        return f"{self.part}-{self.name}"

    @property
    def limits(self) -> tuple[int, int]:
        """Return the lowest and the highest count."""
        return -(1 << (self.bits - 1)), (1 << (self.bits - 1)) - 1

    @property
    def size(self) -> int:
        """Return the number of bytes of the whole channel."""
        return self.axes * self.width

    def sample_ps(self, number: int) -> int:
        """Return the time of sample ``number`` (0, 1 ...) after the start, which is never before its exact time."""
        period = PS_PER_S / self.rate_hz
        first = -int(-period // 1) if self.first_ps is None else self.first_ps
        return self.turn_on_ps + first - int(-number * period // 1)

    def value(self, number: float) -> tuple[float, ...]:
        """Return ``number`` for every axis, as a value of a signal."""
        return (number,) * self.axes


# AN5040 Table 1 and datasheet Table 3; FS_XL's order is 2, 16, 4, 8 g.
ACCELEROMETER = Channel(
    "LSM6DSL",
    "acceleration_g",
    0x28,
    scales=tuple(
        (((0x10, 0x40 | code << 2),), mg / 1000) for code, mg in enumerate((0.061, 0.488, 0.122, 0.244))
    ),
    off=((0x10, 0x00),),
    rate_hz=Fraction(104),
    ready=(0x1E, 0x01),
    bdu=((0x12, 0x44),),
)
GYROSCOPE = Channel(
    "LSM6DSL",
    "angular_rate_dps",
    0x22,
    scales=tuple(
        (((0x11, 0x40 | bits),), mdps / 1000)
        for bits, mdps in ((0x00, 8.75), (0x04, 17.5), (0x08, 35.0), (0x0C, 70.0), (0x02, 4.375))
    ),
    off=((0x11, 0x00),),
    rate_hz=Fraction(104),
    turn_on_ps=35 * PS_PER_MS,  # datasheet Table 4
    settled=20,  # AN5040 Table 16: the filters start from rest
    ready=(0x1E, 0x02),
    bdu=((0x12, 0x44),),
)
LSM6DSL_TEMPERATURE = Channel(
    "LSM6DSL",
    "temperature_degc",
    0x20,
    scales=((((0x10, 0x40),), 1 / 256),),
    off=((0x10, 0x00), (0x11, 0x00)),
    rate_hz=Fraction(52),
    ready=(0x1E, 0x04),
    axes=1,
    zero=25.0,
    bdu=((0x12, 0x44),),
)
MAGNETOMETER = Channel(
    "LIS2MDL",
    "magnetic_field_mgauss",
    0x68,
    scales=((((0x60, 0x8C),), 1.5),),
    off=((0x60, 0x8F),),
    rate_hz=Fraction(100),
    first_ps=9400 * PS_PER_US,  # AN5069 Table 8
    ready=(0x67, 0x08),
    overrun=0x80,
    bdu=((0x62, 0x10),),
)
LIS2MDL_TEMPERATURE = replace(
    MAGNETOMETER,
    name="temperature_degc",
    address=0x6E,
    scales=((((0x60, 0x8C),), 1 / 8),),
    ready=None,
    overrun=0,
    axes=1,
    zero=25.0,
    bits=12,
)
PRESSURE = Channel(
    "LPS22HB",
    "pressure_hpa",
    0x28,
    scales=((((0x10, 0x50),), 1 / 4096),),
    off=((0x10, 0x00),),
    rate_hz=Fraction(75),
    ready=(0x27, 0x01),
    overrun=0x10,
    axes=1,
    width=3,
    bits=24,
    bdu=((0x10, 0x52),),
)
LPS22HB_TEMPERATURE = replace(
    PRESSURE,
    name="temperature_degc",
    address=0x2B,
    scales=((((0x10, 0x50),), 0.01),),
    ready=(0x27, 0x02),
    overrun=0x20,
    width=2,
    bits=16,
    bdu=None,  # datasheet 9.5: PRESS_OUT_H releases both, the temperature has no hold of its own
)
HUMIDITY = Channel(
    "HTX221",
    "relative_humidity_percent",
    0x28,
    scales=((((0x20, 0x83),), 1 / 256),),
    off=((0x20, 0x00),),
    rate_hz=Fraction("12.5"),
    ready=(0x27, 0x02),
    axes=1,
    bdu=((0x20, 0x87),),
)
HTX221_TEMPERATURE = replace(
    HUMIDITY,
    name="temperature_degc",
    address=0x2A,
    scales=((((0x20, 0x83),), 1 / 64),),
    ready=(0x27, 0x01),
)
CHANNELS = (
    ACCELEROMETER,
    GYROSCOPE,
    LSM6DSL_TEMPERATURE,
    MAGNETOMETER,
    LIS2MDL_TEMPERATURE,
    PRESSURE,
    LPS22HB_TEMPERATURE,
    HUMIDITY,
    HTX221_TEMPERATURE,
)


@dataclass(frozen=True)
class PartFacts:
    """Facts that the contract needs about a sensor, except its channels."""

    who_am_i: tuple[int, int]  # address and value
    soft_reset: tuple[int, int]
    reset_ps: int  # its bit reads 0 again
    kept_by_reset: frozenset[int]
    next_address: dict[int, int]  # where a burst does not simply go on
    increment_off: tuple[int, int] | None
    self_clearing: int  # a register that changes by itself after a write
    unmodelled: tuple[int, int, str] | None  # a write asking for something not modelled, the name in the note
    build: Callable[[FakeWorld, Any, int], Sensor]
    plain: tuple[int, str]  # a register without effect on others: its address and name
    usual: Writes  # a usual set-up, which nothing in the documents speaks against
    shows_settings: dict[int, int] = field(default_factory=dict)  # bits nobody can write that follow others


FACTS = {
    "LSM6DSL": PartFacts(
        who_am_i=(0x0F, 0x6A),
        soft_reset=(0x12, 0x05),
        reset_ps=50 * PS_PER_US,
        kept_by_reset=frozenset(),
        next_address={0x3F: 0x3E},
        increment_off=(0x12, 0x00),
        self_clearing=0x12,
        unmodelled=(0x04, 0x01, "SENSOR_SYNC_TIME_FRAME.TPH"),
        shows_settings={
            0x3B: 0x20,  # FIFO_FULL_SMART: a depth of less than one data set
            0x53: 0x01,  # SENSORHUB_END_OP: the sensor hub is on, and idle
        },
        plain=(0x10, "CTRL1_XL"),
        usual=((0x12, 0x44), (0x10, 0xA8), (0x17, 0xE0), (0x11, 0x6C)),
        build=lambda world, errors, seed: LSM6DSL(
            world["acceleration_g"], world["angular_rate_dps"], world["temperature_degc"], errors, seed
        ),
    ),
    "LIS2MDL": PartFacts(
        who_am_i=(0x4F, 0x40),
        soft_reset=(0x60, 0x20),
        reset_ps=5 * PS_PER_US,
        kept_by_reset=frozenset(),
        next_address={0x6D: 0x68},
        increment_off=None,
        self_clearing=0x60,
        unmodelled=None,
        plain=(0x61, "CFG_REG_B"),
        usual=((0x60, 0x8C), (0x61, 0x02), (0x62, 0x10)),
        build=lambda world, errors, seed: LIS2MDL(
            world["magnetic_field_mgauss"], world["temperature_degc"], errors, seed
        ),
        shows_settings={0x64: 0x01},  # INT_SOURCE_REG.INT idles at the level IEA gives it
    ),
    "LPS22HB": PartFacts(
        who_am_i=(0x0F, 0xB1),
        soft_reset=(0x11, 0x04),
        reset_ps=10 * PS_PER_US,
        kept_by_reset=frozenset({0x18, 0x19, 0x1A, 0x43}),  # section 9.6 lists neither RPDS nor RES_CONF
        next_address={0x2C: 0x28},
        increment_off=(0x11, 0x00),
        self_clearing=0x11,
        unmodelled=(0x43, 0x00, "CLOCK_TREE_CONFIGURATION.CTE"),
        plain=(0x1A, "RES_CONF"),
        usual=((0x11, 0x10), (0x10, 0x32)),
        build=lambda world, errors, seed: LPS22HB(
            world["pressure_hpa"], world["temperature_degc"], errors, seed
        ),
    ),
    "HTX221": PartFacts(
        who_am_i=(0x0F, 0xBD),
        soft_reset=(0x21, 0x80),
        reset_ps=10 * PS_PER_US,
        kept_by_reset=frozenset(),
        next_address={},
        increment_off=None,  # bursts are the sub-address protocol's affair, not the registers'
        self_clearing=0x21,
        unmodelled=(0x10, 0x00, "AV_CONF.AVG"),
        plain=(0x20, "CTRL_REG1"),
        usual=((0x20, 0x87),),
        build=lambda world, errors, seed: HTX221(
            world["relative_humidity_percent"], world["temperature_degc"], errors, seed
        ),
    ),
}


class Chip:
    """One sensor with its world and its time; ``read`` and ``write`` happen at ``t_ps``."""

    def __init__(self, name: str, errors: Any = None, seed: int = 0, *, agitated: bool = False) -> None:
        self.world = FakeWorld(agitated)
        self.part = FACTS[name].build(self.world, errors, seed)
        self.t_ps = 0
        self.notes: list[tuple[str, str]] = []
        self.log: list[tuple[str, int, int]] = []
        self.part.observe(
            lambda now_ps, what, problem, text, **_: self.notes.append((what, text)),
            lambda now_ps, register, old, new: self.log.append((register, old, new)),
        )

    def wait(self, ps: int) -> None:
        """Let time pass."""
        self.t_ps += ps

    def read(self, address: int, count: int = 1) -> bytes:
        """Read registers in a burst."""
        return self.part.read(address, count, self.t_ps)

    def byte(self, address: int) -> int:
        """Read a single byte."""
        return self.read(address)[0]

    def write(self, address: int, *values: int) -> None:
        """Write registers in a burst."""
        self.part.write(address, bytes(values), self.t_ps)

    def configure(self, writes: Writes) -> None:
        """Write several registers one by one."""
        for address, value in writes:
            self.write(address, value)

    def set(self, channel: str, *values: float) -> None:
        """Set the world to constant ``values``."""
        self.world.signals[channel] = constant(*values)
        self.part.world_changed()

    def counts(self, channel: Channel) -> tuple[int, ...]:
        """Return the words of the channel, read in one burst."""
        return decode(self.read(channel.address, channel.size), channel.width)

    def is_ready(self, channel: Channel) -> bool:
        """Return the channel's data-ready flag."""
        assert channel.ready is not None
        status, flag = channel.ready
        return bool(self.byte(status) & flag)


def decode(data: bytes, width: int = 2) -> tuple[int, ...]:
    """Return little-endian two's complement words."""
    return tuple(
        int.from_bytes(data[first : first + width], "little", signed=True)
        for first in range(0, len(data), width)
    )
