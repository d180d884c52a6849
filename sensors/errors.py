"""Deviations of a real sensor: offset, scale, drift with temperature, and noise.

With the quality ``ideal``, a sensor has no errors. In ``typical`` the seed determines normally distributed
errors, limited to three standard deviations, and noise has its typical strength. In ``worst`` each error is
three standard deviations, with random sign; each strength is 1.5 times the typical strength.

Decision: a datasheet limit counts as three standard deviations; ST's "standard deviation" and a typical value count as
one standard deviation. If all figures counted as limits, the simulated errors would be too small.

Decision: the standard deviation of output data rates is 2.5 % (:func:`rate_deviation`), because ST gives no tolerance.
Published deviations are +3.7, +1 and -1 % (LSM6DSL family), and +4 % (ISM330DHCX).
"""

from __future__ import annotations

import warnings
import zlib
from collections.abc import Callable
from dataclasses import dataclass, field, fields
from fractions import Fraction
from typing import Any, ClassVar, Literal, Self, TypeAlias, get_args

import numpy as np
from numpy.typing import NDArray

Vec3: TypeAlias = tuple[float, float, float]
Quality: TypeAlias = Literal["ideal", "typical", "worst"]
QUALITIES: tuple[Quality, ...] = get_args(Quality)
ZERO: Vec3 = (0.0, 0.0, 0.0)

Kind: TypeAlias = Literal["limit", "sigma", "typical"]
"""Meaning of a datasheet figure: limit for every sensor, standard deviation, or typical value."""

SIGMAS = 3.0
"""Largest random error in standard deviations; a datasheet limit is this many standard deviations."""

_KINDS: dict[Kind, str] = {"limit": "limit", "sigma": "1 sigma", "typical": "typ."}
STRENGTHS = {"ideal": 0.0, "typical": 1.0, "worst": 1.5}


@dataclass(frozen=True)
class Figure:
    """Declaration of one error parameter of a sensor.

    ``deviation``: magnitude of an error that can have either sign, else 0; ``typical``: value of a strength, such as a
    noise density, else 0; ``axes``: 3 for one number per axis.
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
        """Return, as text, the error of a real sensor: ``+-60 (limit)``, ``typically 80``, or ``0 to 1000``."""
        if self.deviation:
            return f"+-{self.deviation:g} ({_KINDS[self.kind]})"
        if self.is_strength:
            return f"typically {self.typical:g}"
        return "{:g} to {:g}".format(*self.allowed) if self.allowed else "any"

    @property
    def sigma(self) -> float:
        return self.deviation / SIGMAS if self.kind == "limit" else self.deviation

    @property
    def is_strength(self) -> bool:
        """Return whether this parameter is the strength of an effect, which is never negative."""
        return self.typical > 0


def drawn(
    doc: str,
    unit: str,
    deviation: float,
    source: str,
    kind: Kind = "limit",
    allowed: tuple[float, float] | None = None,
) -> Any:
    """Return a :class:`PartErrors` field for an error that can have either sign."""
    return field(
        default=0.0, metadata={"figure": Figure(doc, unit, source, deviation, kind, allowed=allowed)}
    )


def rate_deviation() -> Any:
    """Return the field ``odr_percent`` for a sensor with its own oscillator."""
    return drawn("relative error of every rate", "%", 2.5, "measured parts", "typical", (-20.0, 20.0))


def heating_share() -> Any:
    """Return the field ``heating_percent`` (:mod:`fcu_emulator.emulator.world.warmth` explains it)."""
    doc = "warming of the sensor's place, in addition to the board's"
    return drawn(doc, "%", 8.0, "the board's size and copper", "typical", (-100.0, 100.0))


def rate_factor(odr_percent: float) -> Fraction:
    """Return the ratio of the true output data rate to the nominal rate."""
    return 1 + Fraction(odr_percent / 100).limit_denominator(10**6)


def drawn_by_axis(doc: str, unit: str, deviation: float, source: str, kind: Kind = "limit") -> Any:
    """Return the field of :func:`drawn`, with one number for each of X, Y and Z."""
    return field(default=ZERO, metadata={"figure": Figure(doc, unit, source, deviation, kind, axes=3)})


def strength(doc: str, unit: str, typical: float, source: str) -> Any:
    """Return a field for the strength of an effect."""
    return field(default=0.0, metadata={"figure": Figure(doc, unit, source, typical=typical)})


def noise(doc: str, unit: str, typical: float, source: str) -> Any:
    """Return the field of :func:`strength` for a noise density."""
    return strength(doc, unit, typical, source)


def fixed(doc: str, unit: str, value: float, source: str, allowed: tuple[float, float] | None = None) -> Any:
    """Return a field with the same value in all qualities; only the user can change it."""
    return field(default=value, metadata={"figure": Figure(doc, unit, source, allowed=allowed)})


@dataclass(frozen=True)
class PartErrors:
    """Base class of a sensor's errors, by default ideal. ``PART``: the sensor's name, which is a part of the
    random seed."""

    PART: ClassVar[str]

    def __post_init__(self) -> None:
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
        return {entry.name: entry.metadata["figure"] for entry in fields(cls)}

    def mounted(self) -> NDArray[np.float64]:
        """Return the mounting error (3, 3), to first order: measured vector = matrix @ vector in the nominal axes.

        Decision: mounting errors are at most 1 degree, an assumption.
        """
        x, y, z = np.radians(getattr(self, "misalignment_deg", ZERO)).tolist()
        return np.array([[1.0, z, -y], [-z, 1.0, x], [y, -x, 1.0]])

    @property
    def heating(self) -> float:
        """Fraction of the board's temperature rise that reaches this sensor."""
        return float(getattr(self, "heating_percent", 0.0)) / 100.0

    @classmethod
    def of_quality(cls, quality: Quality, seed: int) -> Self:
        """Return one sensor's errors; equal seeds give equal errors. Raises ValueError for an unknown quality."""
        draw = QualityDraw(quality, cls.PART, seed)
        numbers: dict[str, float | Vec3] = {}
        for name, figure in cls.figures().items():
            if figure.deviation:
                numbers[name] = draw.vector(figure.sigma) if figure.axes == 3 else draw.scalar(figure.sigma)
            elif figure.is_strength:
                numbers[name] = draw.strength(figure.typical)
        factory: Callable[..., Self] = cls
        return factory(**numbers)

    @classmethod
    def of_grade(cls, quality: Quality, seed: int) -> Self:
        """Return the result of :meth:`of_quality`; this is the method's former name."""
        warnings.warn("of_grade is now called of_quality; use that name", DeprecationWarning, stacklevel=2)
        return cls.of_quality(quality, seed)


class QualityDraw:
    """Random generator of one sensor's errors."""

    def __init__(self, quality: Quality, part: str, seed: int) -> None:
        if quality not in QUALITIES:
            raise ValueError(f"unknown quality {quality!r}; known: {', '.join(QUALITIES)}")
        self._quality = quality
        self._random = np.random.default_rng([seed & (2**63 - 1), zlib.crc32(part.encode())])

    def scalar(self, sigma: float) -> float:
        normal, is_positive = self._random.standard_normal(), self._random.integers(2)
        while abs(normal) > SIGMAS:
            normal = self._random.standard_normal()
        if self._quality == "ideal":
            return 0.0
        if self._quality == "worst":
            return SIGMAS * sigma if is_positive else -SIGMAS * sigma
        return normal * sigma

    def vector(self, sigma: float) -> Vec3:
        return self.scalar(sigma), self.scalar(sigma), self.scalar(sigma)

    def strength(self, typical: float) -> float:
        return typical * STRENGTHS[self._quality]
