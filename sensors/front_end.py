"""The signal chain before a sample: analog stage, clipping converter, filter before decimation, deviation and noise.

Decisions where the documents are silent:

* The converter of the LSM6DSL runs at the highest output rate, 6664 Hz, and is timed by the sensor's oscillator.
* Analog stages are second-order Butterworth low-passes; the digital filter has fourth order and -3 dB at half the
  output rate, so that later filters keep their cut-off within 0.2 dB.
* A signal is clipped at the limits of the converter's 16 bits, before any digital filter. Clipping at the
  output instead would turn strong vibration into a plausible mean value.

For slow signals the chain is a pure delay. If a signal is a plain function, the function must return filtered values.

Noise is a pure function of a key and the sample index (Philox). Bias instability has the same strength in
every octave. It is a sum of twelve interpolated noises, whose values are T = 1 s, 2 s ... 2048 s apart. Each
noise has the density w^2 T sinc^4(f T); their sum has w^2 / (3 ln 2 f). IEEE Std 952 defines B by B^2 / (2 pi
f), so w = sqrt(3 ln 2 / (2 pi)) B.
"""

from __future__ import annotations

import math
import zlib
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import TypeAlias

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from fcu_emulator.sensors.errors import ZERO, Vec3
from fcu_emulator.sensors.filters import Section, fourth_order_low_pass, low_pass
from fcu_emulator.sensors.part import DynamicSignal, Signal
from fcu_emulator.sensors.sampling import Times

Array: TypeAlias = NDArray[np.float64]

Measured: TypeAlias = Callable[[Array, Times], Array]
"""``measured(signal, t_s)``: the signal (n, axes), or a single row, with the sensor's offset and scale errors."""

# -- from the signal to a sample ----------------------------------------------------------------------------


CONVERTER_HZ = 6664
ANALOG_OVER = 4
"""Signal values per conversion, enough for vibration of 10 kHz."""

USUAL_DECIMATION = 0.5
"""Cut-off of the low-pass before decimation, as a fraction of the output rate."""

_FORGOTTEN = 1e-7  # fraction of a filter's impulse response that is truncated
_ALL_CLIPPED = 1 - 1e-9  # fraction of full scale; the tolerance for rounding of the filter weights
_SLOW = (
    25.0  # if motion is this many times slower than the filters' delay, a pure delay has an error below 1e-3
)
_LOOKS_AT_ONCE = 1 << 18  # signal values per block, to limit the memory
_PRODUCTS_AT_ONCE = 1 << 16


@dataclass(frozen=True)
class Kernel:
    """Weights that compute samples from a signal.

    ``look_s``: time between signal values; ``analog``: low-pass on signal values; ``digital``: low-pass on conversions;
    ``late_s``: extra delay; ``highest``: largest absolute value before clipping.
    """

    look_s: float
    analog: tuple[Section, ...]
    digital: tuple[Section, ...]
    conversions: int
    late_s: float
    highest: float

    @cached_property
    def delay_s(self) -> float:
        """Delay of a slow signal in seconds."""
        looks = _delay(self.analog) + _delay(self.digital) * ANALOG_OVER
        return looks * self.look_s + self.late_s

    @cached_property
    def memory_s(self) -> float:
        """Time from the earliest signal value that affects a sample to this sample."""
        looks = _length(self.digital) * ANALOG_OVER + _length(self.analog)
        return looks * self.look_s + self.late_s

    @property
    def looks(self) -> int:
        return self.conversions * ANALOG_OVER

    @property
    def lead(self) -> int:
        """``memory_s`` in sample periods, rounded up."""
        return math.ceil(self.memory_s / (self.looks * self.look_s))

    def samples(self, signal: Signal, t_s: Times, measured: Measured) -> Array:
        """Return the samples at ``t_s[lead:]``, (n, axes)."""
        at_once = max(_LOOKS_AT_ONCE // self.looks, self.lead)
        groups = range(self.lead, len(t_s), at_once)
        return np.concatenate(
            [self._samples(signal, t_s[first - self.lead : first + at_once], measured) for first in groups]
        )

    def _samples(self, signal: Signal, t_s: Times, measured: Measured) -> Array:
        earlier_s = np.arange(1 - self.looks, 1) * self.look_s - self.late_s
        times_s = (t_s[:, np.newaxis] + earlier_s).ravel()
        looked = signal(times_s)
        if looked.shape[0] == 1:
            still = np.clip(measured(looked, t_s[self.lead :]), -self.highest, self.highest)
            return np.broadcast_to(still, (len(t_s) - self.lead, *still.shape[1:]))
        weights = self._analog_weights
        converted_s = times_s[len(weights) - 1 + (len(times_s) - len(weights)) % ANALOG_OVER :: ANALOG_OVER]
        converted = measured(_filtered(looked, weights, ANALOG_OVER), converted_s)
        clipped = np.clip(converted, -self.highest, self.highest)
        return _filtered(clipped, self._digital_weights, self.conversions)[self.lead - len(t_s) :]

    @cached_property
    def _analog_weights(self) -> Array:
        return _weights(self.analog)

    @cached_property
    def _digital_weights(self) -> Array:
        return _weights(self.digital)


def _filtered(values: Array, weights: Array, step: int) -> Array:
    """Return weighted sums of ``values`` (n, axes), at every ``step``-th value, counted back from the last value."""
    begin = (len(values) - len(weights)) % step
    sums = []
    for axis in values[begin:].T:
        windows = sliding_window_view(np.ascontiguousarray(axis), len(weights))[::step]
        rows = max(_PRODUCTS_AT_ONCE // len(weights), 1)
        pieces = [(windows[at : at + rows] * weights).sum(axis=1) for at in range(0, len(windows), rows)]
        sums.append(np.concatenate(pieces))
    return np.stack(sums, axis=1)


@lru_cache(maxsize=64)  # shared by all boards; the number of settings is small
def kernel(
    output_hz: float,
    analog_hz: float | None,
    digital_hz: float | None,
    highest: float,
    late_s: float = 0.0,
    rate_factor: float = 1.0,
    decimation: float = USUAL_DECIMATION,
) -> Kernel:
    """Return the kernel for a nominal output data rate.

    ``analog_hz``: None for no analog stage; ``digital_hz``: None for the usual low-pass; ``late_s``: delay before the
    filters; ``rate_factor``: true clock / nominal clock; ``decimation``: cut-off of the usual low-pass / output rate.
    """
    conversions = conversions_per_sample(output_hz)
    converter_hz = output_hz * rate_factor * conversions
    look_s = 1 / (converter_hz * ANALOG_OVER)
    analog = (low_pass(analog_hz * look_s),) if analog_hz else ()
    digital: tuple[Section, ...] = ()
    if digital_hz is not None:
        digital = (low_pass(digital_hz * rate_factor / converter_hz),)
    else:
        digital = before_decimation(conversions, decimation)
    return Kernel(look_s, analog, digital, conversions, late_s, highest)


def conversions_per_sample(output_hz: float) -> int:
    """Return the number of conversions per sample at a nominal output rate."""
    return max(round(CONVERTER_HZ / output_hz), 1)


def before_decimation(conversions: int, cutoff: float = USUAL_DECIMATION) -> tuple[Section, ...]:
    """Return the low-pass on the conversions before decimation; ``cutoff`` is a fraction of the output rate."""
    return fourth_order_low_pass(cutoff / conversions) if conversions > 1 else ()


def _delay(sections: tuple[Section, ...]) -> float:
    """Return the delay in steps: the centre of the impulse response."""
    return sum(
        (b1 + 2 * b2) / (b0 + b1 + b2) - (a1 + 2 * a2) / (1 + a1 + a2) for b0, b1, b2, a1, a2 in sections
    )


def _length(sections: tuple[Section, ...]) -> int:
    if not sections:
        return 1
    slowest = math.sqrt(max(section[4] for section in sections))
    return math.ceil(math.log(_FORGOTTEN) / math.log(slowest)) + 8


def _weights(sections: tuple[Section, ...]) -> Array:
    weights = np.zeros(_length(sections))
    weights[0] = 1.0
    for b0, b1, b2, a1, a2 in sections:
        first = second = 0.0
        for n, value in enumerate(weights.tolist()):
            weights[n] = b0 * value + first
            first = b1 * value - a1 * weights[n] + second
            second = b2 * value - a2 * weights[n]
    response: Array = weights[::-1] / weights.sum()
    return response


class FrontEnd:
    """A sensor's samples with its offset and scale errors, without noise."""

    def __init__(
        self, signal: Signal, times_s: Callable[[int, int], Times], measured: Measured | None = None
    ) -> None:
        self._signal = signal
        self._measured: Measured = measured or _unchanged
        self._world = signal if isinstance(signal, DynamicSignal) else None
        self._times_s = times_s
        self._kernel: Kernel | None = None
        self._delay_s = 0.0

    def configure(self, use: Kernel, delay_s: float = 0.0) -> None:
        """Set the kernel; ``delay_s`` is the delay if the signal is a plain function."""
        self._kernel, self._delay_s = use, delay_s

    def block(self, number: int, t_s: Times) -> Array:
        """Return the samples at ``t_s``, (n, axes), or (1, axes) if all are equal."""
        use, world = self._kernel, self._world
        if use is None or world is None:
            return self._measured(self._signal(t_s - self._delay_s), t_s)
        slow = np.clip(self._measured(self._signal(t_s - use.delay_s), t_s), -use.highest, use.highest)
        moving = world.agitated(t_s[0] - use.memory_s, t_s[-1], use.delay_s * _SLOW)
        if not moving:
            return slow
        samples = np.array(np.broadcast_to(slow, (len(t_s), *slow.shape[1:])))
        for first, end in _runs(_touched(moving, t_s, use.memory_s)):
            times_s = self._times_s(number + first - use.lead, end - first + use.lead)
            samples[first:end] = use.samples(self._signal, times_s, self._measured)
        return samples


def add_noise(values: Array, noise: Array, highest: float) -> Array:
    """Return ``values + noise``; if all conversions of a sample were clipped, the sample gets no noise."""
    overload = np.abs(values) >= highest * _ALL_CLIPPED
    noisy = values + noise
    return np.where(overload, values, noisy) if overload.any() else noisy


def _unchanged(signal: Array, _t_s: Times) -> Array:
    return signal


def _touched(moving: list[tuple[float, float]], t_s: Times, memory_s: float) -> NDArray[np.bool_]:
    touched = np.zeros(len(t_s), dtype=bool)
    for begin_s, end_s in moving:
        touched |= (t_s >= begin_s) & (t_s - memory_s <= end_s)
    return touched


def _runs(flags: NDArray[np.bool_]) -> list[tuple[int, int]]:
    edges = np.flatnonzero(np.diff(flags, prepend=False, append=False))
    return list(zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True))


_AVERAGED, _FEW_AVERAGED = (
    32,
    4,
)  # signal values per conversion, for a signal that does not report its fast intervals
_SLOW_CONVERSIONS = 50.0  # like _SLOW, but counted in conversion times, for averaged conversions


def averaged(signal: Signal, t_s: Times, conversion_s: float) -> Array:
    """Return the mean of a :class:`DynamicSignal` over conversions before ``t_s`` (n,)."""
    if not isinstance(signal, DynamicSignal):
        return signal(t_s)
    samples = signal(t_s - conversion_s / 2)
    # slower motion needs fewer signal values
    for looks, enough in ((_FEW_AVERAGED, 1), (_AVERAGED, _FEW_AVERAGED)):
        pace_s = conversion_s * _SLOW_CONVERSIONS / enough
        moving = signal.agitated(t_s[0] - conversion_s, t_s[-1], pace_s)
        if not moving:
            break
        touched = _touched(moving, t_s, conversion_s)
        earlier_s = (np.arange(looks) + 0.5) / looks * conversion_s
        looked = signal((t_s[touched, np.newaxis] - earlier_s).ravel())
        samples = samples.repeat(len(t_s), axis=0) if len(samples) == 1 else samples.copy()
        samples[touched] = looked.reshape(-1, looks, *looked.shape[1:]).mean(axis=1)
    return samples


# -- the sensor's own errors: deviation ---------------------------------------------------------------------


_REFERENCE_DEGC = 25.0  # all three datasheets give their figures at 25 degC


class Deviation:
    """Offset, scale and cross-axis errors of three axes.

    ``bias`` is in the signal's unit, drifts are per degC. Blocks are (3, n), which numpy handles five times faster.
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
        signal: Array,
        t_s: Times,
        temperature_degc: Callable[[Times], Array],
    ) -> Array:
        """Return ``signal`` (n, 3) with the errors added, shape (3, n)."""
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

    def _seen_across(self, rows: Array) -> Array:
        """Return the cross-axis terms. A matrix product is not used, because its rounding would depend on n."""
        xy, xz, yz = self._cross_axis
        x, y, z = rows
        return np.stack((xy * y + xz * z, xy * x + yz * z, xz * x + yz * y))


# -- noise --------------------------------------------------------------------------------------------------


_NOISE_PAGE = 4096  # samples


def noise_key(seed: int, *names: str | int) -> int:
    """Return a 128-bit key for one noise source."""
    text = "/".join(str(name) for name in (seed, *names)).encode()
    return (seed & 0xFFFFFFFF) << 64 | zlib.crc32(text) << 32 | zlib.adler32(text)


class NoiseSource:
    """Standard normal noise of independent channels, in pages."""

    def __init__(self, key: int, channels: int, page: int = _NOISE_PAGE) -> None:
        self._key = key
        self._channels = channels
        self._length = page
        self._pages: dict[int, Array] = {}

    def block(self, first: int, count: int) -> Array:
        """Return ``count`` samples, shape (channels, count)."""
        start, end = first // self._length, (first + count - 1) // self._length
        pages = [self._page(number) for number in range(start, end + 1)]
        offset = first - start * self._length
        drawn = pages[0] if len(pages) == 1 else np.concatenate(pages, axis=1)
        return drawn[:, offset : offset + count]

    def _page(self, number: int) -> Array:
        page = self._pages.get(number)
        if page is None:
            if len(self._pages) >= 2:  # a block usually spans two pages; older pages can be generated again
                self._pages.pop(next(iter(self._pages)))
            bits = np.random.Philox(key=self._key, counter=[0, 0, 0, number])
            page = np.random.Generator(bits).standard_normal((self._channels, self._length))
            self._pages[number] = page
        return page


# -- bias instability ---------------------------------------------------------------------------------------


_OCTAVES = 12
_DRAWN_AT_ONCE = 64  # values of one octave that are drawn together
_SECONDS_AT_ONCE = 64
_BEFORE_S = 1 << 20  # numbering starts 12 days before time 0, because filters need values from before time 0
_SIGMA = math.sqrt(3 * math.log(2) / (2 * math.pi))  # standard deviation of an octave's values: w / B


class Flicker:
    """Slow drift of offsets; ``bias_instability`` is B, in the unit of the result."""

    def __init__(self, seed: int, *names: str, channels: int, bias_instability: float) -> None:
        self._octaves = [
            NoiseSource(noise_key(seed, *names, "flicker", octave), channels, _DRAWN_AT_ONCE)
            for octave in range(_OCTAVES)
        ]
        self._sigma = _SIGMA * bias_instability
        self._first_s = self._end_s = 0
        self._at_seconds: Array = np.empty((channels, 0))  # values from ``_first_s`` to ``_end_s``

    def block(self, t_s: Times) -> Array:
        """Return values at ascending times (n,), shape (channels, n)."""
        first, end = math.floor(t_s[0]), math.floor(t_s[-1]) + 2
        if not self._first_s <= first < end <= self._end_s:
            self._first_s, self._end_s = first, max(end, first + _SECONDS_AT_ONCE)
            self._at_seconds = self._at(np.arange(self._first_s, self._end_s) + _BEFORE_S)
        values = self._at_seconds[:, first - self._first_s : end - self._first_s]
        return np.stack([np.interp(t_s, np.arange(first, end), row) for row in values])

    def _at(self, seconds: NDArray[np.int64]) -> Array:
        total = np.zeros((len(self._at_seconds), len(seconds)))
        for octave, source in enumerate(self._octaves):
            apart_s = 1 << octave
            # the offset separates the interpolation points of the octaves in time
            shifted = seconds + apart_s * octave // _OCTAVES
            before, part = shifted // apart_s, shifted % apart_s / apart_s
            drawn = source.block(int(before[0]), int(before[-1] - before[0]) + 2)
            index = before - before[0]
            total += drawn[:, index] * (1 - part) + drawn[:, index + 1] * part
        return self._sigma * total
