"""How a real part deviates from the ideal one: offset, scale, their drift with temperature, and noise.

Each part has a dataclass of explicit numbers in the datasheet's units, and three named grades that fill it:

``ideal``    no error; only the part's resolution and range remain
``typical``  this part, drawn from the seed: a normal draw with a third of the datasheet's limit as its
             standard deviation, cut at the limit; noise as the datasheet's typical figure
``worst``    every offset, scale error, drift and cross-axis figure at the datasheet's limit, its sign drawn
             from the seed; noise 1.5 times typical (no datasheet of the three gives a maximum for noise)

Rates are exact in every grade: none of the three datasheets gives a tolerance for them.
"""

from __future__ import annotations

import zlib
from collections.abc import Callable
from typing import Literal, TypeAlias, get_args

import numpy as np
from numpy.typing import NDArray

Vec3: TypeAlias = tuple[float, float, float]
Grade: TypeAlias = Literal["ideal", "typical", "worst"]
GRADES: tuple[Grade, ...] = get_args(Grade)
ZERO: Vec3 = (0.0, 0.0, 0.0)

_REFERENCE_DEGC = 25.0  # all three datasheets give their figures at 25 degC
_NOISE_FACTOR = {"ideal": 0.0, "typical": 1.0, "worst": 1.5}


class GradeDraw:
    """Draws one part's deviations for a grade; the same seed and part always give the same part."""

    def __init__(self, grade: Grade, part: str, seed: int) -> None:
        if grade not in GRADES:
            raise ValueError(f"unknown error grade {grade!r}; known: {', '.join(GRADES)}")
        self._grade = grade
        self._random = np.random.default_rng([seed & (2**63 - 1), zlib.crc32(part.encode())])

    def scalar(self, limit: float) -> float:
        """A deviation within +-``limit``, in its unit."""
        normal, sign = self._random.standard_normal(), self._random.choice((-1.0, 1.0))
        if self._grade == "ideal":
            return 0.0
        if self._grade == "worst":
            return float(sign * limit)
        return float(np.clip(normal * limit / 3, -limit, limit))

    def vector(self, limit: float) -> Vec3:
        """Three independent deviations, one an axis."""
        return self.scalar(limit), self.scalar(limit), self.scalar(limit)

    def noise(self, typical: float) -> float:
        """The grade's noise figure from the typical one."""
        return typical * _NOISE_FACTOR[self._grade]


class Deviation:
    """Offset, scale and cross-axis errors of a three-axis channel, ready to be applied to blocks.

    ``bias`` and ``bias_drift`` (per degC) in the signal's unit; ``scale_percent`` and ``scale_drift_percent``
    (per degC) relative to the signal. ``cross_axis_percent``: how much of Y is seen in X and of X in Y, the
    same of X and Z, of Y and Z; an axis that is tilted in the package does this, before its own scale error.

    Blocks are axis-major inside a part, shape (3, n): numpy applies one number an axis five times faster than
    along rows of three.
    """

    def __init__(
        self,
        bias: Vec3,
        scale_percent: Vec3,
        bias_drift: Vec3 = ZERO,
        scale_drift_percent: float = 0.0,
        cross_axis_percent: Vec3 = ZERO,
    ) -> None:
        self._bias = np.array(bias).reshape(3, 1)
        self._gain = 1.0 + np.array(scale_percent).reshape(3, 1) / 100
        self._bias_drift = np.array(bias_drift).reshape(3, 1)
        self._gain_drift = scale_drift_percent / 100
        self._drifts = any(bias_drift) or scale_drift_percent != 0
        self._cross_axis = tuple(percent / 100 for percent in cross_axis_percent)
        self._crosses = any(cross_axis_percent)

    def apply(
        self,
        signal: NDArray[np.float64],
        t_s: NDArray[np.float64],
        temperature_degc: Callable[[NDArray[np.float64]], NDArray[np.float64]],
    ) -> NDArray[np.float64]:
        """The deviating signal of shape (3, n), a new array, from one of shape (n, 3) at the times ``t_s``.

        The temperature is asked for only where something drifts.
        """
        rows = np.ascontiguousarray(signal.T)
        if self._crosses:
            rows = rows + self._seen_across(rows)
        if not self._drifts:
            deviating = rows * self._gain
            deviating += self._bias
            return deviating
        warmer = temperature_degc(t_s) - _REFERENCE_DEGC
        if warmer.size and warmer[0] == warmer[-1] and np.all(warmer == warmer[0]):
            warmer = warmer[:1]  # one temperature for the whole block, the usual case
        deviating = rows * (self._gain + self._gain_drift * warmer)
        deviating += self._bias + self._bias_drift * warmer
        return deviating

    def _seen_across(self, rows: NDArray[np.float64]) -> NDArray[np.float64]:
        """What each axis sees of the other two; not as a matrix product, whose rounding depends on n."""
        xy, xz, yz = self._cross_axis
        x, y, z = rows
        return np.stack((xy * y + xz * z, xy * x + yz * z, xz * x + yz * y))


def to_int16(counts: NDArray[np.float64]) -> NDArray[np.int16]:
    """Rounded to the nearest count and saturated at the ends of 16 bits, the shape unchanged."""
    return _whole(counts).astype("<i2")


def words(counts: NDArray[np.float64], samples: int | None = None) -> bytes:
    """Register bytes of axis-major counts, shape (3, n): little-endian X, Y, Z of each sample in turn.

    ``samples``: how many, where one column may stand for all of them.
    """
    in_turn = np.empty(counts.shape[::-1], dtype="<i2")
    np.copyto(in_turn, _whole(counts).T, casting="unsafe")
    data = in_turn.tobytes()
    return data if samples is None or samples == counts.shape[1] else data * samples


def _whole(counts: NDArray[np.float64]) -> NDArray[np.float64]:
    whole = np.rint(counts)
    np.minimum(whole, 32767, out=whole)
    return np.maximum(whole, -32768, out=whole)
