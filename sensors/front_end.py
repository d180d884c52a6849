"""What comes before a sample: the analog stage, the converter that clips, the filter before decimation, and
what a part adds of its own: deviation, noise, bias instability. ``sensors.errors`` says how large these are.

A sensor does not look at the world once a sample. It converts much faster, and filters before it leaves most
of that out, so that what moves faster than half the output rate does not come back as something slow. So does
this module. The world is asked at :data:`ANALOG_OVER` times the converter's rate, which stands for the analog
side; then comes an analog low-pass; the converter takes every so-manyth value and clips it at full scale; a
digital low-pass; and the output rate takes every so-manyth of these.

No document of the parts gives the converter's rate, the order of the filters, or where a part clips.
Decisions:

* The converter of the LSM6DSL runs at its highest output rate, 6664 Hz by its own oscillator.
* An analog stage is a second-order Butterworth low-pass, as all filters here (``sensors.filters``); the
  digital one before decimation has two such sections, the fourth-order Butterworth's, with its -3 dB at half
  the output rate: narrower filters that follow it at the output rate then keep their documented cut-off
  within 0.2 dB. Another order would change what is left above half the output rate: 104 Hz at an output of
  104 Hz is weakened 16 times.
* A signal is clipped where the converter's 16 bits end, before any digital filter. Vibration beyond full
  scale is then measured wrong, as on a real part. Road not taken: a clip at the output alone, which averages
  such vibration to a value that looks right.

The filters are finite impulse responses, so a sample is a pure function of the signal before it, whoever
asks when. Where the world moves slowly against the filter, all of this is a delay, and that is what is
computed: the world is asked once a sample, a little earlier. When it moves fast is the world's to say
(:class:`fcu_emulator.sensors.part.DynamicSignal`). A plain function cannot say it: it gives the samples as the converter's
filter would, and is taken at its word.

Noise is white, and a pure function of a key and the sample index. A counter-based generator (Philox) is asked
for fixed pages of samples; page ``p`` of a key always holds the same numbers, whatever was drawn before. So a
run does not depend on who reads which sample when, a world change does not shift the noise, and hundreds of
boards need no shared state. The numbers are those of numpy's ``Generator.standard_normal``; numpy keeps the
bit stream for ever and the normal transform in practice (it reserves the right to change it between
releases).

Bias instability is the slow wandering of an offset, which averaging does not take away. Its power is the same
in every octave of frequency (flicker noise, density proportional to 1/f). Here it is a sum of twelve slow
noises, one for each octave: normally distributed values 1 s, 2 s, 4 s ... 2048 s apart, joined by straight
lines. Values of standard deviation w that are T apart have the two-sided power density w^2 T sinc^4(f T);
over all octaves that adds up to w^2 / (3 ln 2 f). IEEE Std 952 calls B the bias instability of a density
B^2 / (2 pi f), whose Allan deviation is sqrt(2 ln 2 / pi) B = 0.664 B at every averaging time, so
w = sqrt(3 ln 2 / (2 pi)) B. Below 1 s and beyond half an hour there is less of it; there white noise and
drift with temperature hide that. Road not taken: the sum of first-order Gauss-Markov processes that
simulations usually take, each of whose values needs the one before. This one is a function of time alone, and
costs one interpolation of each channel for a block of samples.
"""

from __future__ import annotations

import math
import zlib
from collections.abc import Callable
from dataclasses import dataclass, replace
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

# -- from the signal to a sample ----------------------------------------------------------------------------


CONVERTER_HZ = 6664
ANALOG_OVER = 4
"""Times the converter's rate at which the world is looked at: fast enough for 10 kHz, the fastest shake."""

_FORGOTTEN = 1e-7  # of a filter's response, what is cut off
_SLOW = 25.0  # a motion that takes so many times the filters' delay passes them with an error below 1e-3
_LOOKS_AT_ONCE = 1 << 18  # this and the next bound the memory that shaking at a low output rate takes
_PRODUCTS_AT_ONCE = 1 << 16


@dataclass(frozen=True)
class Kernel:
    """How a sample comes from the signal before it. Times are in seconds.

    ``look_s``: between two looks at the signal; ``analog``: the low-pass on the looks, of which every
    :data:`ANALOG_OVER`-th is converted; ``digital``: the low-pass on the conversions, of which every
    ``conversions``-th is a sample; ``late_s``: a delay before all of this; ``highest``: where the converter
    ends, either way.
    """

    look_s: float
    analog: tuple[Section, ...]
    digital: tuple[Section, ...]
    conversions: int
    late_s: float
    highest: float

    @cached_property
    def delay_s(self) -> float:
        """By how much a slow signal is delayed."""
        looks = _delay(self.analog) + _delay(self.digital) * ANALOG_OVER
        return looks * self.look_s + self.late_s

    @cached_property
    def memory_s(self) -> float:
        """How long before a sample the first look lies that it depends on."""
        looks = _length(self.digital) * ANALOG_OVER + _length(self.analog)
        return looks * self.look_s + self.late_s

    @property
    def looks(self) -> int:
        """At the signal, in a sample period."""
        return self.conversions * ANALOG_OVER

    @property
    def lead(self) -> int:
        """``memory_s`` in sample periods, rounded up."""
        return math.ceil(self.memory_s / (self.looks * self.look_s))

    def samples(self, signal: Signal, t_s: Times) -> Array:
        """The samples at ``t_s[lead:]``, (n, axes); ``t_s`` are the times of consecutive samples."""
        at_once = max(_LOOKS_AT_ONCE // self.looks, self.lead)
        groups = range(self.lead, len(t_s), at_once)
        return np.concatenate(
            [self._samples(signal, t_s[first - self.lead : first + at_once]) for first in groups]
        )

    def _samples(self, signal: Signal, t_s: Times) -> Array:
        earlier_s = np.arange(1 - self.looks, 1) * self.look_s - self.late_s
        looked = signal((t_s[:, np.newaxis] + earlier_s).ravel())
        count = len(t_s) - self.lead
        if looked.shape[0] == 1:
            return np.broadcast_to(self._clipped(looked), (count, *looked.shape[1:]))
        converted = self._clipped(_filtered(looked, self._analog_weights, ANALOG_OVER))
        return _filtered(converted, self._digital_weights, self.conversions)[-count:]

    def _clipped(self, values: Array) -> Array:
        return np.clip(values, -self.highest, self.highest)

    @cached_property
    def _analog_weights(self) -> Array:
        return _weights(self.analog)

    @cached_property
    def _digital_weights(self) -> Array:
        return _weights(self.digital)


def _filtered(values: Array, weights: Array, step: int) -> Array:
    """The weighted sums of values (n, axes) that end with the last value and every ``step``-th before it.

    Not as a matrix product, whose rounding depends on how many rows there are.
    """
    begin = (len(values) - len(weights)) % step
    sums = []
    for axis in values[begin:].T:
        windows = sliding_window_view(np.ascontiguousarray(axis), len(weights))[::step]
        rows = max(_PRODUCTS_AT_ONCE // len(weights), 1)
        pieces = [(windows[at : at + rows] * weights).sum(axis=1) for at in range(0, len(windows), rows)]
        sums.append(np.concatenate(pieces))
    return np.stack(sums, axis=1)


@lru_cache(maxsize=64)  # boards share them; there are only so many settings
def kernel(
    output_hz: float,
    analog_hz: float | None,
    digital_hz: float | None,
    highest: float,
    delay_s: float = 0.0,
    rate_factor: float = 1.0,
) -> Kernel:
    """The kernel for ``output_hz`` samples a second, nominally.

    ``analog_hz``: cut-off of the analog stage, None without; ``digital_hz``: of a second-order low-pass
    before decimation, None for the usual one at half the output rate; ``delay_s``: of all together, if it is
    more than that of the filters; ``rate_factor``: by how much the part's clock is faster, and with it
    all but the analog stage.
    """
    conversions = max(round(CONVERTER_HZ / output_hz), 1)
    converter_hz = output_hz * rate_factor * conversions
    look_s = 1 / (converter_hz * ANALOG_OVER)
    analog = (low_pass(analog_hz * look_s),) if analog_hz else ()
    digital: tuple[Section, ...] = ()
    if digital_hz is not None:
        digital = (low_pass(digital_hz * rate_factor / converter_hz),)
    elif conversions > 1:
        digital = fourth_order_low_pass(0.5 / conversions)
    own = Kernel(look_s, analog, digital, conversions, 0.0, highest)
    return replace(own, late_s=max(delay_s - own.delay_s, 0.0))


def _delay(sections: tuple[Section, ...]) -> float:
    """By how many steps low-pass sections delay a slow signal: the centre of their impulse response."""
    return sum(
        (b1 + 2 * b2) / (b0 + b1 + b2) - (a1 + 2 * a2) / (1 + a1 + a2) for b0, b1, b2, a1, a2 in sections
    )


def _length(sections: tuple[Section, ...]) -> int:
    """How many steps the impulse response lasts; the poles are complex, of modulus sqrt(a2)."""
    if not sections:
        return 1
    slowest = math.sqrt(max(section[4] for section in sections))
    return math.ceil(math.log(_FORGOTTEN) / math.log(slowest)) + 8


def _weights(sections: tuple[Section, ...]) -> Array:
    """The impulse response, the latest weight last, with a sum of 1."""
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
    """A sensor's samples without what it adds itself; ``times_s(number, count)`` tells when they come."""

    def __init__(self, signal: Signal, times_s: Callable[[int, int], Times]) -> None:
        self._signal = signal
        self._world = signal if isinstance(signal, DynamicSignal) else None
        self._times_s = times_s
        self._kernel: Kernel | None = None
        self._delay_s = 0.0

    def configure(self, use: Kernel, delay_s: float = 0.0) -> None:
        """Use another kernel from the next sample on; a plain function is delayed by ``delay_s``."""
        self._kernel, self._delay_s = use, delay_s

    def block(self, number: int, t_s: Times) -> Array:
        """The samples from ``number`` on, taken at ``t_s``: (n, axes), or (1, axes) where all are one."""
        use, world = self._kernel, self._world
        if use is None or world is None:
            return self._signal(t_s - self._delay_s)
        slow = self._signal(t_s - use.delay_s)
        moving = world.agitated(t_s[0] - use.memory_s, t_s[-1], use.delay_s * _SLOW)
        if not moving:
            return slow
        samples = np.array(np.broadcast_to(slow, (len(t_s), *slow.shape[1:])))
        for first, end in _runs(_touched(moving, t_s, use.memory_s)):
            times_s = self._times_s(number + first - use.lead, end - first + use.lead)
            samples[first:end] = use.samples(self._signal, times_s)
        return samples


def _touched(moving: list[tuple[float, float]], t_s: Times, memory_s: float) -> NDArray[np.bool_]:
    """Which of the samples at ``t_s`` (n,) depend on any of these times."""
    touched = np.zeros(len(t_s), dtype=bool)
    for begin_s, end_s in moving:
        touched |= (t_s >= begin_s) & (t_s - memory_s <= end_s)
    return touched


def _runs(flags: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """Begin and end of each run of true flags."""
    edges = np.flatnonzero(np.diff(flags, prepend=False, append=False))
    return list(zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True))


_AVERAGED, _FEW_AVERAGED = 32, 4  # looks at the world in a conversion whose inside is not known
_SLOW_CONVERSIONS = 50.0  # as _SLOW: how many conversions such a motion takes, where they are averaged


def averaged(signal: Signal, t_s: Times, conversion_s: float) -> Array:
    """The signal's mean over a conversion that ends at each of ``t_s`` (n,); rows as the signal gives them.

    For parts of which no document says what happens inside a conversion. A plain function is taken at
    ``t_s``.
    """
    if not isinstance(signal, DynamicSignal):
        return signal(t_s)
    samples = signal(t_s - conversion_s / 2)
    for looks, enough in ((_FEW_AVERAGED, 1), (_AVERAGED, _FEW_AVERAGED)):  # enough: for what is slower
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


# -- what the part adds of its own: deviation ---------------------------------------------------------------


_REFERENCE_DEGC = 25.0  # all three datasheets give their figures at 25 degC


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
        signal: Array,
        t_s: Times,
        temperature_degc: Callable[[Times], Array],
    ) -> Array:
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

    def _seen_across(self, rows: Array) -> Array:
        """What each axis sees of the other two; not as a matrix product, whose rounding depends on n."""
        xy, xz, yz = self._cross_axis
        x, y, z = rows
        return np.stack((xy * y + xz * z, xy * x + yz * z, xz * x + yz * y))


# -- noise --------------------------------------------------------------------------------------------------


_NOISE_PAGE = 4096  # samples


def noise_key(seed: int, *names: str | int) -> int:
    """A 128-bit key for one noise source of one part of one board."""
    text = "/".join(str(name) for name in (seed, *names)).encode()
    return (seed & 0xFFFFFFFF) << 64 | zlib.crc32(text) << 32 | zlib.adler32(text)


class NoiseSource:
    """Standard normal noise with ``channels`` independent channels, drawn ``page`` samples at a time."""

    def __init__(self, key: int, channels: int, page: int = _NOISE_PAGE) -> None:
        self._key = key
        self._channels = channels
        self._length = page
        self._pages: dict[int, Array] = {}

    def block(self, first: int, count: int) -> Array:
        """Samples ``first`` to ``first + count - 1``, shape (channels, count), unit variance."""
        start, end = first // self._length, (first + count - 1) // self._length
        pages = [self._page(number) for number in range(start, end + 1)]
        offset = first - start * self._length
        drawn = pages[0] if len(pages) == 1 else np.concatenate(pages, axis=1)
        return drawn[:, offset : offset + count]

    def _page(self, number: int) -> Array:
        page = self._pages.get(number)
        if page is None:
            if len(self._pages) >= 2:  # a block mostly spans two; older ones are drawn again if asked
                self._pages.pop(next(iter(self._pages)))
            bits = np.random.Philox(key=self._key, counter=[0, 0, 0, number])
            page = np.random.Generator(bits).standard_normal((self._channels, self._length))
            self._pages[number] = page
        return page


# -- bias instability ---------------------------------------------------------------------------------------


_OCTAVES = 12
_DRAWN_AT_ONCE = 64  # values of an octave
_SECONDS_AT_ONCE = 64
_BEFORE_S = 1 << 20  # filters look back before time 0, and values are numbered from 0: 12 days are enough
_SIGMA = math.sqrt(3 * math.log(2) / (2 * math.pi))  # of an octave's values, w over B


class Flicker:
    """The wandering of ``channels`` independent offsets.

    ``bias_instability``: B of each, whose unit is that of the values. ``seed`` and ``names`` say which noise.
    """

    def __init__(self, seed: int, *names: str, channels: int, bias_instability: float) -> None:
        self._octaves = [
            NoiseSource(noise_key(seed, *names, "flicker", octave), channels, _DRAWN_AT_ONCE)
            for octave in range(_OCTAVES)
        ]
        self._sigma = _SIGMA * bias_instability
        self._first_s = self._end_s = 0
        self._at_seconds: Array = np.empty((channels, 0))  # of the seconds between these

    def block(self, t_s: Times) -> Array:
        """Values at ascending times (n,), shape (channels, n)."""
        first, end = math.floor(t_s[0]), math.floor(t_s[-1]) + 2
        if not self._first_s <= first < end <= self._end_s:
            self._first_s, self._end_s = first, max(end, first + _SECONDS_AT_ONCE)
            self._at_seconds = self._at(np.arange(self._first_s, self._end_s) + _BEFORE_S)
        values = self._at_seconds[:, first - self._first_s : end - self._first_s]
        return np.stack([np.interp(t_s, np.arange(first, end), row) for row in values])

    def _at(self, seconds: NDArray[np.int64]) -> Array:
        """Values at consecutive whole seconds, counted from ``_BEFORE_S`` before time 0; (channels, n)."""
        total = np.zeros((len(self._at_seconds), len(seconds)))
        for octave, source in enumerate(self._octaves):
            apart_s = 1 << octave
            shifted = seconds + apart_s * octave // _OCTAVES  # so that not all octaves bend at once
            before, part = shifted // apart_s, shifted % apart_s / apart_s
            drawn = source.block(int(before[0]), int(before[-1] - before[0]) + 2)
            index = before - before[0]
            total += drawn[:, index] * (1 - part) + drawn[:, index + 1] * part
        return self._sigma * total
