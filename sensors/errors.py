"""Deviations of a real sensor from the ideal one: offset, scale, their drift with temperature, and noise.

This module has the numbers; ``sensors.front_end`` applies them to a signal.

Each sensor has a dataclass of explicit numbers in the datasheet's units. Each number is declared with its
meaning, its limit or typical value, and the source. Three named grades fill them:

``ideal``    no error; only the sensor's resolution and range remain
``typical``  one sensor, drawn from the seed: a normal distribution cut at three standard deviations; noise and
             other strengths, which have no sign, at their typical figure
``worst``    every offset, scale error, drift and cross-axis figure at three standard deviations, its sign
             drawn from the seed; strengths 1.5 times typical (no datasheet has a maximum noise)

A figure such as +-40 mg has one of three meanings, which each figure here declares (:data:`Kind`). Decision:
a limit (minimum and maximum of a table, or ST's "range" of a population) counts as three standard deviations,
and ST's "standard deviation" as one. A typical value also counts as one, the usual reading: the datasheets do
not guarantee it, and do not say how many sensors meet it. Reading every figure as a limit was rejected,
because it makes boards three times better than real ones.

Rates. The sensors derive their output data rates from internal oscillators, and none of the three datasheets
gives a tolerance: ST calls the rates typical values. Decision: the standard deviation of the output data
rates is 2.5 % (:func:`rate_deviation`). This is the root mean square of published single sensors, rounded
down since exact ones are not reported. They are: an LSM6DS3TR-C, with the LSM6DSL's registers and identity,
at 431.3 Hz for 416 (+3.7 %); two of the family at 105 and at 103 Hz for 104 (+1 and -1 %); an ISM330DHCX,
whose register INTERNAL_FREQ_FINE gives the deviation of its rates in steps of 0.15 % up to 19 %, with +4 %.
For LIS2MDL and LPS22HB no figures are published; the same value is used. Two alternatives were rejected: the
19 % limit of the register, which no known sensor reaches; and exact rates, which keep 416 Hz and a program's
800 Hz in phase for ever.
"""

from __future__ import annotations

import zlib
from collections.abc import Callable
from dataclasses import dataclass, field, fields
from fractions import Fraction
from typing import Any, ClassVar, Literal, Self, TypeAlias, get_args

import numpy as np
from numpy.typing import NDArray

Vec3: TypeAlias = tuple[float, float, float]
Grade: TypeAlias = Literal["ideal", "typical", "worst"]
GRADES: tuple[Grade, ...] = get_args(Grade)
ZERO: Vec3 = (0.0, 0.0, 0.0)

Kind: TypeAlias = Literal["limit", "sigma", "typical"]
"""Meaning of a figure: a limit for all sensors; a standard deviation over many; or just a typical value."""

SIGMAS = 3.0
"""Limit of a draw in standard deviations, and the number of standard deviations in a limit."""

_KINDS: dict[Kind, str] = {"limit": "limit", "sigma": "1 sigma", "typical": "typ."}
STRENGTHS = {"ideal": 0.0, "typical": 1.0, "worst": 1.5}


@dataclass(frozen=True)
class Figure:
    """Declaration of one number by which a sensor deviates.

    ``deviation``: deviation in both directions, as in the source, 0 for a number that is the same in every
    grade;
    ``kind``: its meaning in the source.
    ``typical``: for a strength, else 0.
    ``axes``: 3 for one number per axis.
    ``allowed``: lowest and highest valid value, None for any (of a strength: any that is not negative).
    """

    doc: str
    unit: str
    source: str
    deviation: float = 0.0
    kind: Kind = "limit"
    typical: float = 0.0
    axes: Literal[1, 3] = 1
    allowed: tuple[float, float] | None = None

    @property
    def size(self) -> str:
        """Size in a real sensor: ``+-60 (limit)``, ``typically 80``, or ``0 to 1000`` for a free choice."""
        if self.deviation:
            return f"+-{self.deviation:g} ({_KINDS[self.kind]})"
        if self.is_strength:
            return f"typically {self.typical:g}"
        return "{:g} to {:g}".format(*self.allowed) if self.allowed else "any"

    @property
    def sigma(self) -> float:
        """Standard deviation over many sensors."""
        return self.deviation / SIGMAS if self.kind == "limit" else self.deviation

    @property
    def is_strength(self) -> bool:
        """Return whether the number is the strength of a noise or of another effect, which cannot be negative."""
        return self.typical > 0


def drawn(
    doc: str,
    unit: str,
    deviation: float,
    source: str,
    kind: Kind = "limit",
    allowed: tuple[float, float] | None = None,
) -> Any:
    """Return a field of a :class:`PartErrors`: a number of either sign, 0 in an ideal sensor."""
    return field(
        default=0.0, metadata={"figure": Figure(doc, unit, source, deviation, kind, allowed=allowed)}
    )


def rate_deviation() -> Any:
    """Return the field ``odr_percent`` of a sensor with its own oscillator; see the module's docstring."""
    return drawn("relative error of every rate", "%", 2.5, "measured parts", "typical", (-20.0, 20.0))


def heating_share() -> Any:
    """Return the field ``heating_percent`` of a sensor with a thermometer: see
    :mod:`fcu_emulator.emulator.world.warmth`.
    """
    doc = "warming at its place, above that of the board"
    return drawn(doc, "%", 8.0, "the board's size and copper", "typical", (-100.0, 100.0))


def rate_factor(odr_percent: float) -> Fraction:
    """Return the ratio of a sensor's true rates to the nominal ones."""
    return 1 + Fraction(odr_percent / 100).limit_denominator(10**6)


def drawn_by_axis(doc: str, unit: str, deviation: float, source: str, kind: Kind = "limit") -> Any:
    """Return a field as of :func:`drawn` with three numbers, X, Y and Z in the sensor's own axes."""
    return field(default=ZERO, metadata={"figure": Figure(doc, unit, source, deviation, kind, axes=3)})


def strength(doc: str, unit: str, typical: float, source: str) -> Any:
    """Return a field of a :class:`PartErrors`: the strength of an effect without sign, 0 in an ideal sensor."""
    return field(default=0.0, metadata={"figure": Figure(doc, unit, source, typical=typical)})


def noise(doc: str, unit: str, typical: float, source: str) -> Any:
    """Return a field as of :func:`strength` for a noise."""
    return strength(doc, unit, typical, source)


def fixed(doc: str, unit: str, value: float, source: str, allowed: tuple[float, float] | None = None) -> Any:
    """Return a field of a :class:`PartErrors` with the same value in every grade, for the user to set."""
    return field(default=value, metadata={"figure": Figure(doc, unit, source, allowed=allowed)})


@dataclass(frozen=True)
class PartErrors:
    """Base of a sensor's numbers; the default is an ideal sensor. ``PART``: its name, part of the draws' seed."""

    PART: ClassVar[str]

    def __post_init__(self) -> None:
        """Raises ValueError for a figure that no sensor can have."""
        for name, figure in self.figures().items():
            if figure.allowed is None:
                continue
            (low, high), value = figure.allowed, getattr(self, name)
            if not low <= value <= high:
                raise ValueError(
                    f"{type(self).__name__}.{name} must be from {low:g} to {high:g}, not {value:g}"
                )

    @classmethod
    def figures(cls) -> dict[str, Figure]:
        """Return every number's declaration by its name, in the order of declaration."""
        return {entry.name: entry.metadata["figure"] for entry in fields(cls)}

    def mounted(self) -> NDArray[np.float64]:
        """Mounting error as a matrix (3, 3): measured vector = matrix @ vector in the nominal axes.

        To first order in the small angles of ``misalignment_deg``, which is optional. Decision: mounting
        errors are at most 1 degree, an assumption without a source: 50 um at one end of a package of 3 mm.
        """
        x, y, z = np.radians(getattr(self, "misalignment_deg", ZERO)).tolist()
        return np.array([[1.0, z, -y], [-z, 1.0, x], [y, -x, 1.0]])

    @property
    def heating(self) -> float:
        """Share of the board's heating that is added at the sensor's place; 0 if the sensor declares none."""
        return float(getattr(self, "heating_percent", 0.0)) / 100.0

    @classmethod
    def of_grade(cls, grade: Grade, seed: int) -> Self:
        """Return one sensor of the given grade; equal seeds give equal sensors. Raises ValueError for an unknown grade."""
        draw = GradeDraw(grade, cls.PART, seed)
        numbers: dict[str, float | Vec3] = {}
        for name, figure in cls.figures().items():
            if figure.deviation:
                numbers[name] = draw.vector(figure.sigma) if figure.axes == 3 else draw.scalar(figure.sigma)
            elif figure.is_strength:
                numbers[name] = draw.strength(figure.typical)
        factory: Callable[..., Self] = cls
        return factory(**numbers)


class GradeDraw:
    """Draws one sensor's deviations for a grade; equal seeds and sensors give equal deviations."""

    def __init__(self, grade: Grade, part: str, seed: int) -> None:
        if grade not in GRADES:
            raise ValueError(f"unknown error grade {grade!r}; known: {', '.join(GRADES)}")
        self._grade = grade
        self._random = np.random.default_rng([seed & (2**63 - 1), zlib.crc32(part.encode())])

    def scalar(self, sigma: float) -> float:
        """Draw a deviation of standard deviation ``sigma``, in its unit."""
        normal, is_positive = self._random.standard_normal(), self._random.integers(2)
        while abs(normal) > SIGMAS:
            normal = self._random.standard_normal()
        if self._grade == "ideal":
            return 0.0
        if self._grade == "worst":
            return SIGMAS * sigma if is_positive else -SIGMAS * sigma
        return normal * sigma

    def vector(self, sigma: float) -> Vec3:
        """Draw three independent deviations, one per axis."""
        return self.scalar(sigma), self.scalar(sigma), self.scalar(sigma)

    def strength(self, typical: float) -> float:
        """Return the grade's figure for a typical one."""
        return typical * STRENGTHS[self._grade]
