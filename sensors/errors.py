"""How a real part deviates from the ideal one: offset, scale, their drift with temperature, and noise.

These are the numbers; what they do to a signal is in ``sensors.front_end``.

Each part has a dataclass of explicit numbers in the datasheet's units. Each number is declared with what it
means, its limit or typical value and the document that says so; three named grades fill them from that:

``ideal``    no error; only the part's resolution and range remain
``typical``  this part, drawn from the seed: a normal draw that ends at three standard deviations; noise and
             other strengths, which have no sign, as the typical figure
``worst``    every offset, scale error, drift and cross-axis figure at three standard deviations, its sign
             drawn from the seed; strengths 1.5 times typical (no datasheet has a maximum of its noise)

A figure such as +-40 mg means one of three things, and each figure here says which (:data:`Kind`). Decision:
a limit, minimum and maximum of a table or what ST calls the range of a population, is three standard
deviations; what ST calls a standard deviation is one; a typical value, of which the datasheets say that it
is not guaranteed and not how many parts keep it, is one as well, the usual reading. Road not taken: every
figure as a limit, which makes boards three times better than they are.

Rates. The parts count their output data rates with oscillators of their own, and none of the three
datasheets gives a tolerance: ST calls the rates typical values. Decision: the standard deviation of the
output data rates is 2.5 % (:func:`rate_deviation`), the root of the mean square of what is known of single
parts, rounded down since exact ones are not reported: an LSM6DS3TR-C, of the LSM6DSL's registers and
identity, at 431.3 Hz for 416 (+3.7 %); two of the family at 105 and at 103 Hz for 104 (+1 and -1 %); an
ISM330DHCX, whose register INTERNAL_FREQ_FINE tells by how much its rates are off, in steps of 0.15 % up to
19 %, and which holds +4 %. Of LIS2MDL and LPS22HB nobody has published any, and the same is taken. Roads
not taken: the 19 % that the register can say, which would be parts that nobody has seen; exact rates, with
which 416 Hz and a program's 800 Hz keep step for ever.
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
"""Of a figure: no part deviates further; a standard deviation over many parts; a typical value, no more."""

SIGMAS = 3.0
"""At how many standard deviations a draw ends, and how many a limit is."""

_KINDS: dict[Kind, str] = {"limit": "limit", "sigma": "1 sigma", "typical": "typ."}
STRENGTHS = {"ideal": 0.0, "typical": 1.0, "worst": 1.5}


@dataclass(frozen=True)
class Figure:
    """What is known about one number by which a part deviates.

    ``deviation``: by how much parts deviate either way, as the source says it, 0 for a number that is the
    same in every grade; ``kind``: what the source means by it. ``typical``: of a strength, else 0.
    ``axes``: 3 for a number an axis. ``allowed``: lowest and highest value that makes sense, None for any (of
    a strength: any that is not negative).
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
        """In a real part: ``+-60 (limit)``, ``typically 80``, or ``0 to 1000`` where one may choose."""
        if self.deviation:
            return f"+-{self.deviation:g} ({_KINDS[self.kind]})"
        if self.is_strength:
            return f"typically {self.typical:g}"
        return "{:g} to {:g}".format(*self.allowed) if self.allowed else "any"

    @property
    def sigma(self) -> float:
        """The standard deviation over many parts."""
        return self.deviation / SIGMAS if self.kind == "limit" else self.deviation

    @property
    def is_strength(self) -> bool:
        """Whether the number is the strength of a noise or of another effect, which cannot be negative."""
        return self.typical > 0


def drawn(
    doc: str,
    unit: str,
    deviation: float,
    source: str,
    kind: Kind = "limit",
    allowed: tuple[float, float] | None = None,
) -> Any:
    """A field of a :class:`PartErrors`: a number of either sign, 0 in an ideal part."""
    return field(
        default=0.0, metadata={"figure": Figure(doc, unit, source, deviation, kind, allowed=allowed)}
    )


def rate_deviation() -> Any:
    """The field ``odr_percent`` of a part that counts its rates with its own oscillator; see the top."""
    return drawn("by how much every rate is faster", "%", 2.5, "measured parts", "typical", (-20.0, 20.0))


def heating_share() -> Any:
    """The field ``heating_percent`` of a part with a thermometer: see :mod:`fcu_emulator.emulator.world.warmth`."""
    doc = "by how much more than the board it is warmed at its place"
    return drawn(doc, "%", 8.0, "the board's size and copper", "typical", (-100.0, 100.0))


def rate_factor(odr_percent: float) -> Fraction:
    """A part's true rates over the nominal ones."""
    return 1 + Fraction(odr_percent / 100).limit_denominator(10**6)


def drawn_by_axis(doc: str, unit: str, deviation: float, source: str, kind: Kind = "limit") -> Any:
    """Likewise three numbers, X, Y and Z in the sensor's own axes."""
    return field(default=ZERO, metadata={"figure": Figure(doc, unit, source, deviation, kind, axes=3)})


def strength(doc: str, unit: str, typical: float, source: str) -> Any:
    """A field of a :class:`PartErrors`: how strong an effect is that has no sign, 0 in an ideal part."""
    return field(default=0.0, metadata={"figure": Figure(doc, unit, source, typical=typical)})


def noise(doc: str, unit: str, typical: float, source: str) -> Any:
    """Likewise how strong a noise is."""
    return strength(doc, unit, typical, source)


def fixed(doc: str, unit: str, value: float, source: str, allowed: tuple[float, float] | None = None) -> Any:
    """A field of a :class:`PartErrors`: the same in every grade, there to be set by hand."""
    return field(default=value, metadata={"figure": Figure(doc, unit, source, allowed=allowed)})


@dataclass(frozen=True)
class PartErrors:
    """Base of a part's numbers; the default is an ideal part. ``PART``: its name, part of the draws' seed."""

    PART: ClassVar[str]

    def __post_init__(self) -> None:
        """Raises ValueError for a figure that no part can have."""
        for name, figure in self.figures().items():
            if figure.allowed is None:
                continue
            (low, high), value = figure.allowed, getattr(self, name)
            if not low <= value <= high:
                raise ValueError(f"{type(self).__name__}.{name} is {value:g}; give {low:g} to {high:g}")

    @classmethod
    def figures(cls) -> dict[str, Figure]:
        """Every number's declaration by its name, in the order of declaration."""
        return {entry.name: entry.metadata["figure"] for entry in fields(cls)}

    def mounted(self) -> NDArray[np.float64]:
        """How the part sits on its board, (3, 3): what it measures = this @ the vector where it should sit.

        To first order in the small angles of ``misalignment_deg``, which a part need not have. Decision: they
        are 1 degree at most, for which there is no source: 50 um at one end of a package of 3 mm.
        """
        x, y, z = np.radians(getattr(self, "misalignment_deg", ZERO)).tolist()
        return np.array([[1.0, z, -y], [-z, 1.0, x], [y, -x, 1.0]])

    @property
    def heating(self) -> float:
        """Which part of the board's heating comes on top of it at the part's place; a part need not say."""
        return float(getattr(self, "heating_percent", 0.0)) / 100.0

    @classmethod
    def of_grade(cls, grade: Grade, seed: int) -> Self:
        """One part of the given grade; the same seed always gives the same part. ValueError for no grade."""
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
    """Draws one part's deviations for a grade; the same seed and part always give the same part."""

    def __init__(self, grade: Grade, part: str, seed: int) -> None:
        if grade not in GRADES:
            raise ValueError(f"unknown error grade {grade!r}; known: {', '.join(GRADES)}")
        self._grade = grade
        self._random = np.random.default_rng([seed & (2**63 - 1), zlib.crc32(part.encode())])

    def scalar(self, sigma: float) -> float:
        """A deviation of the standard deviation ``sigma``, in its unit."""
        normal, is_positive = self._random.standard_normal(), self._random.integers(2)
        while abs(normal) > SIGMAS:
            normal = self._random.standard_normal()
        if self._grade == "ideal":
            return 0.0
        if self._grade == "worst":
            return SIGMAS * sigma if is_positive else -SIGMAS * sigma
        return normal * sigma

    def vector(self, sigma: float) -> Vec3:
        """Three independent deviations, one an axis."""
        return self.scalar(sigma), self.scalar(sigma), self.scalar(sigma)

    def strength(self, typical: float) -> float:
        """The grade's figure from the typical one."""
        return typical * STRENGTHS[self._grade]
