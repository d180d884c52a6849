"""What comes before a sample: the analog stage, the converter that clips, and the filter before decimation.

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
(:class:`sensors.part.Agitated`). A plain function cannot say it: it gives the samples as the converter's
filter would, and is taken at its word.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from typing import TypeAlias

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from sensors.filters import Section, fourth_order_low_pass, low_pass
from sensors.part import Agitated, Signal
from sensors.sampling import Times

Array: TypeAlias = NDArray[np.float64]

CONVERTER_HZ = 6664
ANALOG_OVER = 4
"""Times the converter's rate at which the world is looked at: fast enough for 10 kHz, the fastest shake."""

_FORGOTTEN = 1e-7  # of a filter's response, what is cut off
_SLOW = 25.0  # a motion that takes so many times the filters' delay passes them with an error below 1e-3
_AVERAGED, _FEW_AVERAGED = 32, 4  # looks at the world in a conversion whose inside is not known
_SLOW_CONVERSIONS = 50.0  # likewise of a mean
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
        converted = self._clipped(_every(looked, self._analog_weights, ANALOG_OVER))
        return _every(converted, self._digital_weights, self.conversions)[-count:]

    def _clipped(self, values: Array) -> Array:
        return np.clip(values, -self.highest, self.highest)

    @cached_property
    def _analog_weights(self) -> Array:
        return _weights(self.analog)

    @cached_property
    def _digital_weights(self) -> Array:
        return _weights(self.digital)


def _every(values: Array, weights: Array, step: int) -> Array:
    """Weighted sums of values (n, axes): one that ends with the last value, and one every ``step`` before it.

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
    """A sensor's samples before its own deviations: ``times_s(number, count)`` tells when they are taken."""

    def __init__(self, signal: Signal, times_s: Callable[[int, int], Times]) -> None:
        self._signal = signal
        self._world = signal if isinstance(signal, Agitated) else None
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


def averaged(signal: Signal, t_s: Times, conversion_s: float) -> Array:
    """The signal's mean over a conversion that ends at each of ``t_s`` (n,); rows as the signal gives them.

    For parts of which no document says what happens inside a conversion. A plain function is taken at
    ``t_s``.
    """
    if not isinstance(signal, Agitated):
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
