"""A board as data: pins, sensors, wirings and errors.

Decision: a board is a Python literal, which mypy and the constructor check, because only developers
write boards.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, ClassVar, TypeAlias

import numpy as np
from numpy.typing import NDArray

from fcu_emulator.emulator.buses.gpio import Gpio
from fcu_emulator.emulator.buses.i2c import I2CBus
from fcu_emulator.emulator.buses.spi import SpiBus
from fcu_emulator.emulator.buses.uart import Uart
from fcu_emulator.emulator.clock import Clock
from fcu_emulator.emulator.errors import InputError
from fcu_emulator.emulator.renamed import warn_renamed
from fcu_emulator.emulator.trace import Trace
from fcu_emulator.sensors.errors import PartErrors, Quality, Vec3, drawn, drawn_by_axis, fixed, strength
from fcu_emulator.sensors.part import Sensor

Matrix: TypeAlias = NDArray[np.float64]
Numbers: TypeAlias = Mapping[str, Any]
Pin: TypeAlias = tuple[str, int]
"""Port and number: ("B", 5) is PB5."""
PinFunction: TypeAlias = tuple[str, int, int]
"""Port, number, and alternate function of the peripheral (datasheet DocID024738 table 9)."""


CRYSTAL_HZ = 16_000_000  # of the STEVAL-FCU001V1: HSE_VALUE of STSW-FCU001
CRYSTAL_RANGE_HZ = range(4_000_000, 26_000_001)  # STM32F401xB/C datasheet, HSE


# -- soldered components ------------------------------------------------------------------------------------


@dataclass(frozen=True)
class MountedSensor:
    """A sensor that measures matrix @ vector for a vector in the board's axes.

    ``mountings``: matrices, keyed by name, the usual matrix first. ``mounting_key``: the scenario key that
    selects a mounting.
    """

    part: type[Sensor]
    mountings: Mapping[str, Matrix] = field(default_factory=dict)
    mounting_key: str = ""

    def __post_init__(self) -> None:
        measures_vectors = any(quantity.axes == 3 for quantity in self.part.SIGNALS)
        if measures_vectors and not self.mountings:
            raise InputError(
                f"the {self.part.NAME} must have a mounting, because it measures vectors", kind="no_mounting"
            )

    @property
    def key(self) -> str:
        return self.part.NAME.lower()


@dataclass(frozen=True)
class I2cPins:
    """Pins of one of the chip's I2C peripherals."""

    scl: PinFunction
    sda: PinFunction


@dataclass(frozen=True)
class SerialLine:
    """The terminal's USART, its pin, and its clock."""

    peripheral: str
    tx: PinFunction
    clock_hz: int


@dataclass(frozen=True)
class CallbackTimer:
    """The timer whose interrupt calls ``HAL_TIM_PeriodElapsedCallback``.

    Clock and priority are used by Python firmware only.
    """

    peripheral: str
    input_hz: int
    priority: int


@dataclass(frozen=True)
class AbsentPart:
    """A part without a model. If firmware selects this part, the trace reports it. ``held``: levels of the
    part's outputs."""

    name: str
    spi: str
    chip_select: Pin
    note: str
    held: Mapping[Pin, int] = field(default_factory=dict)


# -- connections --------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Wiring:
    """One way to connect all sensors to ``bus``.

    ``places``: each sensor's 7-bit address or chip select ("PA8"). ``symbols``: names that
    occur only in firmware for this wiring.
    """

    name: str
    bus: str
    places: Mapping[str, int | str]
    description: str
    symbols: tuple[str, ...] = ()

    @property
    def addresses(self) -> dict[str, int]:
        return {name: place for name, place in self.places.items() if isinstance(place, int)}

    @property
    def chip_selects(self) -> dict[str, str]:
        return {name: place for name, place in self.places.items() if isinstance(place, str)}


@dataclass(frozen=True, eq=False)
class BoardDescription:
    """One kind of board.

    ``leds``: pins of the LEDs; a low level lights an LED. ``motors``: timer and channel of each PWM
    output. ``wirings``: all wirings, the usual wiring first. ``built_firmware``: programs in
    :mod:`fcu_emulator.firmware_model.arm`.
    """

    name: str
    parts: tuple[MountedSensor, ...]
    wirings: tuple[Wiring, ...]
    serial: SerialLine
    timer: CallbackTimer
    i2c: Mapping[str, I2cPins] = field(default_factory=dict)
    spi: tuple[str, ...] = ()
    leds: Mapping[str, Pin] = field(default_factory=dict)
    motors: tuple[tuple[str, int], ...] = ()
    absent: tuple[AbsentPart, ...] = ()
    python_firmware: Mapping[str, str] = field(default_factory=dict)
    built_firmware: Mapping[str, tuple[str, str]] = field(default_factory=dict)
    default_firmware: str = ""

    def __post_init__(self) -> None:
        names = {mounted.part.NAME for mounted in self.parts}
        for wiring in self.wirings:
            what = f"board {self.name}, wiring {wiring.name}"
            if wiring.bus not in (*self.i2c, *self.spi):
                raise InputError(f"{what}: unknown bus {wiring.bus}; known: {', '.join(self.buses())}")
            for part, place in wiring.places.items():
                if part not in names:
                    raise InputError(f"{what}: unknown part {part}; known: {', '.join(names)}")
                if isinstance(place, int) is not (wiring.bus in self.i2c):
                    wanted = "a 7-bit address" if wiring.bus in self.i2c else 'a chip select such as "PA8"'
                    raise InputError(f"{what}: {part} on {wiring.bus} must be at {wanted}, not {place!r}")

    def buses(self) -> Iterator[str]:
        yield from self.i2c
        yield from self.spi

    def wiring(self, name: str | None = None) -> Wiring:
        """Return a wiring by name, or the usual wiring. Raises InputError."""
        if name is None:
            return self.wirings[0]
        for wiring in self.wirings:
            if wiring.name == name:
                return wiring
        known = ", ".join(wiring.name for wiring in self.wirings)
        raise InputError(f"unknown board wiring {name!r}; known: {known}", kind="unknown_wiring")

    def wiring_with(self, bus: str) -> Wiring | None:
        return next((wiring for wiring in self.wirings if wiring.bus == bus), None)

    @cached_property
    def firmware(self) -> dict[str, str]:
        """Descriptions of supplied firmware, keyed by name."""
        built = {name: text for name, (_, text) in self.built_firmware.items()}
        return {**self.python_firmware, **built}

    @cached_property
    def addresses(self) -> dict[str, int]:
        return {name: place for wiring in self.wirings for name, place in wiring.addresses.items()}

    @cached_property
    def identities(self) -> dict[str, int]:
        return {mounted.part.NAME: mounted.part.WHO_AM_I for mounted in self.parts}


# -- options of the sensors ---------------------------------------------------------------------------------


@dataclass(frozen=True)
class SensorSettings:
    """Deviations of the sensors from ideal sensors.

    ``figures`` replaces numbers of ``quality``, as in ``{"lps22hb": {"pressure_bias_hpa": 0.5}}``.
    """

    quality: Quality = "typical"
    figures: Mapping[str, Numbers] = field(default_factory=dict)
    mountings: Mapping[str, str] = field(default_factory=dict)


# -- errors of a real board beside its sensors --------------------------------------------------------------


_CALIBRATIONS = "published calibrations of other boards"


@dataclass(frozen=True)
class BoardErrors(PartErrors):
    """The errors of one board in the board's axes; the default is an ideal board.

    Steel adds a constant field (hard iron) and distorts the Earth's field (soft iron); the seed
    selects both. Sources: published calibrations of eight other boards, such as Adafruit_AHRS,
    examples/ahrs_fusion_usb, and an ArduPilot autopilot (diydrones.com, "compass calibration always
    above 150"). Half of the offsets of these boards exceed 115 mgauss. The soft iron of these
    boards is 6 % along an axis and 2.4 % between axes. The figures here are smaller, because the
    errors of the sensor itself are selected separately. The crystal is exact unless ``hse_ppm`` is
    set.
    """

    PART: ClassVar[str] = "board"

    hard_iron_mgauss: Vec3 = drawn_by_axis(
        "field of the board's own magnetised steel", "mgauss", 300.0, _CALIBRATIONS
    )
    soft_iron_percent: Vec3 = drawn_by_axis(
        "factor by which steel strengthens the field along X, Y, Z", "%", 9.0, _CALIBRATIONS
    )
    soft_iron_across_percent: Vec3 = drawn_by_axis(
        "coupling between X and Y, X and Z, Y and Z, as a fraction of the field", "%", 6.0, _CALIBRATIONS
    )

    hsi_percent: float = drawn(
        "frequency error of the internal oscillator", "%", 1.0, "STM32F401xB/C datasheet, HSI, 25 degC"
    )
    hse_ppm: float = fixed("frequency error of the quartz", "ppm", 0.0, "not documented", (-1000.0, 1000.0))

    heating_degc: float = strength(
        "temperature difference between the board and the air",
        "degC",
        5.0,
        "the board's size and supply current",
    )
    thermal_s: float = strength(
        "time constant of the board's warming", "s", 200.0, "the board's size and thickness"
    )
    pressure_wander_hpa: float = strength(
        "RMS of the slow pressure changes in the room",
        "hPa",
        0.02,
        "an assumption, with a measured spectrum",
    )

    def soft_iron(self) -> Matrix:
        """Symmetric matrix (3, 3) that is applied to the external field."""
        matrix = np.eye(3) + np.diag(self.soft_iron_percent) / 100.0
        for (row, column), percent in zip(
            ((0, 1), (0, 2), (1, 2)), self.soft_iron_across_percent, strict=True
        ):
            matrix[row, column] = matrix[column, row] = percent / 100.0
        return matrix


# -- connections of a board's chip ---------------------------------------------------------------------------


@dataclass(frozen=True)
class BoardSignals:
    """Signals at the chip's pins. ``number`` determines the chip's unique id."""

    board: BoardDescription
    wiring: Wiring
    clock: Clock
    trace: Trace
    gpio: Gpio
    uart: Uart
    i2c: Mapping[str, I2CBus]
    spi: Mapping[str, SpiBus]
    number: int = 0
    errors: BoardErrors = field(default_factory=BoardErrors)
    crystal_hz: int = CRYSTAL_HZ

    def __post_init__(self) -> None:
        if self.crystal_hz not in CRYSTAL_RANGE_HZ:
            raise InputError(f"crystal_hz must be an integer from 4 to 26 MHz, not {self.crystal_hz!r}")


def __getattr__(name: str) -> type[MountedSensor]:
    """Return :class:`MountedSensor` for its old name."""
    if name != "MountedPart":
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    warn_renamed(name, "MountedSensor")
    return MountedSensor
