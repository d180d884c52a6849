"""A board as data: pins, parts and how they are mounted, wirings, and how a real one deviates.

A board is one file with one :class:`BoardDescription` in it, such as :mod:`fcu_emulator.emulator.boards.fcu001v1`. The
board itself, the chip's pins, the keys of scenario files and the words of diagnoses follow from it; nothing
else names a bus, a LED or a timer. Beside its sensors, whose figures are theirs, a real board deviates from
an ideal one by its own iron, its oscillators and its warmth: :class:`BoardErrors`.

Decision: a Python literal, checked when it is made and by mypy, not a file format of its own: it refers to
the classes of the parts, and nobody but a developer writes one.
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
from fcu_emulator.emulator.errors import InputError
from fcu_emulator.emulator.time.clock import Clock
from fcu_emulator.emulator.trace import Trace
from fcu_emulator.sensors.errors import Grade, PartErrors, Vec3, drawn, drawn_by_axis, fixed, strength
from fcu_emulator.sensors.part import Part

Matrix: TypeAlias = NDArray[np.float64]
Numbers: TypeAlias = Mapping[str, Any]
Pin: TypeAlias = tuple[str, int]
"""Port and number: ("B", 5) is PB5."""
PinFunction: TypeAlias = tuple[str, int, int]
"""Port, number, and the alternate function that leads it to the peripheral (datasheet DocID024738 table 9)."""


# -- what is soldered ---------------------------------------------------------------------------------------


@dataclass(frozen=True)
class MountedPart:
    """A sensor and how it sits on the board: it measures matrix @ a vector in the board's axes.

    ``mountings``: the matrices that a scenario may choose from, by name, the usual one first; none for a part
    that measures scalars only. ``mounting_key``: what the choice is called in a scenario file, where there is
    one.
    """

    part: type[Part]
    mountings: Mapping[str, Matrix] = field(default_factory=dict)
    mounting_key: str = ""

    def __post_init__(self) -> None:
        measures_vectors = any(quantity.axes == 3 for quantity in self.part.SIGNALS)
        if measures_vectors and not self.mountings:
            raise InputError(
                f"the {self.part.NAME} measures vectors: give its mounting on the board", kind="no_mounting"
            )

    @property
    def key(self) -> str:
        """What the part is called in Python and in files: its name in lower case."""
        return self.part.NAME.lower()


@dataclass(frozen=True)
class I2cPins:
    """The pins of one of the chip's I2C peripherals."""

    scl: PinFunction
    sda: PinFunction


@dataclass(frozen=True)
class SerialLine:
    """The USART that the terminal is connected to, its pin, and its clock with the firmware's settings."""

    peripheral: str
    tx: PinFunction
    clock_hz: int


@dataclass(frozen=True)
class CallbackTimer:
    """The timer whose interrupt calls ``HAL_TIM_PeriodElapsedCallback``.

    ``input_hz`` and ``priority`` are as the board's own firmware sets clock and NVIC up; firmware in Python
    has no other. Built firmware sets them itself.
    """

    peripheral: str
    input_hz: int
    priority: int


@dataclass(frozen=True)
class AbsentPart:
    """A part that is on the real board and has no model: selecting it on ``spi`` leaves a note in the trace.

    ``held``: its outputs, and the level at which they stay.
    """

    name: str
    spi: str
    chip_select: Pin
    note: str
    held: Mapping[Pin, int] = field(default_factory=dict)


# -- how it is connected ------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Wiring:
    """One way the sensors are connected: all to ``bus``, one of the board's.

    ``places``: by part name, its 7-bit address on an I2C bus, or its chip select ("PA8") on an SPI bus.
    ``symbols``: names in firmware that only firmware for this wiring has.
    """

    name: str
    bus: str
    places: Mapping[str, int | str]
    description: str
    symbols: tuple[str, ...] = ()

    @property
    def addresses(self) -> dict[str, int]:
        """By part name; none on SPI."""
        return {name: place for name, place in self.places.items() if isinstance(place, int)}

    @property
    def chip_selects(self) -> dict[str, str]:
        """By part name; none on I2C."""
        return {name: place for name, place in self.places.items() if isinstance(place, str)}


@dataclass(frozen=True, eq=False)
class BoardDescription:
    """One kind of board.

    ``i2c``: the chip's I2C peripherals that lead to a bus, with their pins; ``spi``: likewise its SPI peripherals.
    ``leds``: each is lit while its pin is low. ``motors``: timer and channel of the PWM of each.
    ``wirings``: the usual one first. ``python_firmware`` and ``built_firmware``: what is shipped for it,
    names with descriptions; the latter also with the program's name in :mod:`fcu_emulator.firmware_model.arm`.
    """

    name: str
    parts: tuple[MountedPart, ...]
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
                raise InputError(f"{what}: there is no bus {wiring.bus}; known: {', '.join(self.buses())}")
            for part, place in wiring.places.items():
                if part not in names:
                    raise InputError(f"{what}: there is no part {part}; known: {', '.join(names)}")
                if isinstance(place, int) is not (wiring.bus in self.i2c):
                    wanted = "a 7-bit address" if wiring.bus in self.i2c else 'a chip select such as "PA8"'
                    raise InputError(f"{what}: {part} is at {place!r} of {wiring.bus}; give {wanted}")

    def buses(self) -> Iterator[str]:
        """Names of all buses."""
        yield from self.i2c
        yield from self.spi

    def wiring(self, name: str | None = None) -> Wiring:
        """The wiring of that name, the usual one without a name. Raises InputError naming the known ones."""
        if name is None:
            return self.wirings[0]
        for wiring in self.wirings:
            if wiring.name == name:
                return wiring
        known = ", ".join(wiring.name for wiring in self.wirings)
        raise InputError(f"unknown board wiring {name!r}; known: {known}", kind="unknown_wiring")

    def wiring_with(self, bus: str) -> Wiring | None:
        """The first wiring that has the sensors on a bus; None if there is none."""
        return next((wiring for wiring in self.wirings if wiring.bus == bus), None)

    @cached_property
    def firmware(self) -> dict[str, str]:
        """All shipped firmware, names with descriptions."""
        built = {name: text for name, (_, text) in self.built_firmware.items()}
        return {**self.python_firmware, **built}

    @cached_property
    def addresses(self) -> dict[str, int]:
        """The parts' 7-bit addresses by name, where a wiring has them on an I2C bus."""
        return {name: place for wiring in self.wirings for name, place in wiring.addresses.items()}

    @cached_property
    def identities(self) -> dict[str, int]:
        """What WHO_AM_I of each part is, by part name."""
        return {mounted.part.NAME: mounted.part.WHO_AM_I for mounted in self.parts}


# -- what may be chosen about its sensors -------------------------------------------------------------------


@dataclass(frozen=True)
class SensorSettings:
    """How far the sensors deviate from ideal ones.

    ``grade`` fills every figure; ``figures`` replaces single ones by explicit numbers, by the part's key and
    the names of its class of errors: ``{"lps22hb": {"pressure_bias_hpa": 0.5}}``. ``mountings``: by mounting
    key, where it is not the usual one.
    """

    grade: Grade = "typical"
    figures: Mapping[str, Numbers] = field(default_factory=dict)
    mountings: Mapping[str, str] = field(default_factory=dict)


# -- how a real one deviates beside its sensors -------------------------------------------------------------


_CALIBRATIONS = "published calibrations of other boards"


@dataclass(frozen=True)
class BoardErrors(PartErrors):
    """Explicit numbers in the board's axes; the default is an ideal board.

    The steel of USB plug, battery and screws, and what it has been magnetised to, turn with the board: a
    field that is always the same (hard iron), and the Earth's field bent (soft iron). Both are drawn from the
    seed, as a part's figures are (:mod:`fcu_emulator.sensors.errors`), so that each board of a class has its own.

    Nobody has published such figures of this board. They are chosen from calibrations of eight others that
    people put into their programs: among them Adafruit_AHRS, examples/ahrs_fusion_usb (9, -75, -352 mgauss;
    0.943, 0.918, 1.156 along and 0.011, 0.020, -0.008 between the axes) and an ArduPilot autopilot on its USB
    lead alone (-203, 69, 21 mgauss; diydrones.com, "compass calibration always above 150"). Half of their
    offsets are beyond 115 mgauss, the root of the mean square of their soft iron is 6 % along an axis and
    2.4 % between two. A sensor's own offset and sensitivity are in these numbers, and are drawn for
    themselves here (LIS2MDL: 60 mgauss, 7 %), so less is taken. ArduPilot calls an offset below
    150 mgauss healthy.

    The chip's internal oscillator is trimmed to within 1 %, and firmware that runs from it has other bit
    rates and another tick than it believes. The quartz is exact unless ``hse_ppm`` says otherwise: no
    document gives its tolerance, usual ones are off by 30 ppm at most, a second in nine hours, which nobody
    sees in a lab.

    A board is warmer than the air by the power that it draws, and follows the air slowly
    (:mod:`fcu_emulator.emulator.world.warmth`).
    """

    PART: ClassVar[str] = "board"

    hard_iron_mgauss: Vec3 = drawn_by_axis(
        "field of the board's own magnetised steel", "mgauss", 300.0, _CALIBRATIONS
    )
    soft_iron_percent: Vec3 = drawn_by_axis(
        "by how much steel strengthens the field along X, Y, Z", "%", 9.0, _CALIBRATIONS
    )
    soft_iron_across_percent: Vec3 = drawn_by_axis(
        "between X and Y, X and Z, Y and Z: part of the field along the other axis", "%", 6.0, _CALIBRATIONS
    )

    hsi_percent: float = drawn(
        "by how much the internal oscillator is faster", "%", 1.0, "STM32F401xB/C datasheet, HSI, 25 degC"
    )
    hse_ppm: float = fixed(
        "by how much the quartz is faster", "ppm", 0.0, "not documented", (-1000.0, 1000.0)
    )

    heating_degc: float = strength(
        "by how much the board is warmer than the air", "degC", 5.0, "its size and supply current"
    )
    thermal_s: float = strength(
        "time constant with which it becomes so", "s", 200.0, "its size and thickness"
    )

    def soft_iron(self) -> Matrix:
        """The matrix (3, 3) by which the outer field is seen: symmetric, as of steel without hysteresis."""
        matrix = np.eye(3) + np.diag(self.soft_iron_percent) / 100.0
        for (row, column), percent in zip(
            ((0, 1), (0, 2), (1, 2)), self.soft_iron_across_percent, strict=True
        ):
            matrix[row, column] = matrix[column, row] = percent / 100.0
        return matrix


# -- a board that is there: what its chip is given -----------------------------------------------------------


@dataclass(frozen=True)
class BoardSignals:
    """What of the board the chip's pins lead to, as ``board`` lists it; ``wiring``: where its sensors are.

    ``uart`` is at the peripheral of ``board.serial``; ``i2c`` and ``spi`` are the buses by their peripherals' names.
    ``number``: of this board in its class, for the chip's unique id; ``errors``: how it deviates itself.
    """

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
