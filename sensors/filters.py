"""Digital filters as biquad sections, evaluated in blocks.

Decision: every filter of the sensors is a second-order Butterworth section by the bilinear transform, with -3 dB at the
documented cut-off, because no datasheet gives order or shape.

A cascade of sections is computed as a state-space system, without a loop; scipy's ``sosfilt`` would need 30 MB more.

Decision: a filtered sample is a pure function of its number (:class:`SampledFilter`). Each segment of sixteen or more
pages begins with a warm-up. So if a reader skips an hour, only one segment is computed.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import cached_property, lru_cache
from typing import Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

Array: TypeAlias = NDArray[np.float64]
Spectrum: TypeAlias = NDArray[np.complex128]

Section: TypeAlias = tuple[float, float, float, float, float]
"""b0, b1, b2, a1, a2 of (b0 + b1/z + b2/z^2) / (1 + a1/z + a2/z^2)."""

Start: TypeAlias = Literal["settled", "zero", "reference"]
"""Assumed input before the first sample. ``settled``: the first sample. ``zero``: 0. ``reference``: the first sample,
which is also subtracted from every sample.
"""

_BLOCK = 64
_BLOCKS = 32
PAGE = _BLOCK * _BLOCKS
"""Number of samples filtered together."""

_FORGOTTEN = 1e-9  # full scale times this factor is far below one count
_GRID = 1 << 15

SLOPE: Section = (0.5, -0.5, 0.0, 0.0, 0.0)  # (x[n] - x[n-1]) / 2


def low_pass(cutoff: float) -> Section:
    """Return a second-order low-pass; ``cutoff`` is its -3 dB frequency divided by the sample rate, below 0.5."""
    k = math.tan(math.pi * cutoff)
    norm = 1 / (1 + math.sqrt(2) * k + k * k)
    gain = k * k * norm
    return gain, 2 * gain, gain, 2 * (k * k - 1) * norm, (1 - math.sqrt(2) * k + k * k) * norm


def fourth_order_low_pass(cutoff: float) -> tuple[Section, Section]:
    """Return a fourth-order Butterworth low-pass; ``cutoff`` as for :func:`low_pass`."""
    k = math.tan(math.pi * cutoff)
    sections: list[Section] = []
    for angle in (math.pi / 8, 3 * math.pi / 8):
        damping = 2 * math.cos(angle)
        norm = 1 / (1 + damping * k + k * k)
        gain = k * k * norm
        sections.append((gain, 2 * gain, gain, 2 * (k * k - 1) * norm, (1 - damping * k + k * k) * norm))
    return sections[0], sections[1]


def high_pass(cutoff: float) -> Section:
    """Return a second-order high-pass; ``cutoff`` as for :func:`low_pass`."""
    _, _, _, a1, a2 = low_pass(cutoff)
    gain = (1 - a1 + a2) / 4  # 1 at half the sample rate
    return gain, -2 * gain, gain, a1, a2


def response(sections: tuple[Section, ...], frequency: Array) -> Spectrum:
    """Return the complex gain at ``frequency`` (n,), a fraction of the sample rate."""
    delay = np.exp(-2j * np.pi * frequency)
    gain: Spectrum = np.ones_like(delay)
    for b0, b1, b2, a1, a2 in sections:
        gain *= (b0 + (b1 + b2 * delay) * delay) / (1 + (a1 + a2 * delay) * delay)
    return gain


@lru_cache(maxsize=64)  # shared by all boards; the number of settings is small
def chain(sections: tuple[Section, ...], start: Start) -> Chain:
    """Return the cascade of ``sections``, cached."""
    return Chain(sections, start)


class Chain:
    """A cascade of sections. Signals have the shape (axes, n), and states have the shape (axes, ``order``)."""

    def __init__(self, sections: tuple[Section, ...], start: Start) -> None:
        self.sections = sections
        self.start: Start = start
        a, b, c, d = _state_space(sections)
        self.order = len(b)
        powers = _powers(a, _BLOCK)
        impulse = np.array([d, *(c @ power @ b for power in powers[: _BLOCK - 1])])
        # Matrices are transposed, because signals are rows.
        self._powers = [power.T for power in powers]
        self._to_state = np.array([powers[_BLOCK - 1 - sample] @ b for sample in range(_BLOCK)])
        self._from_state = np.array([c @ power for power in powers[:_BLOCK]]).T.copy()
        self._to_output = np.zeros((_BLOCK, _BLOCK))
        for sample in range(_BLOCK):
            self._to_output[sample, sample:] = impulse[: _BLOCK - sample]
        leaps = [power.T for power in _powers(powers[_BLOCK], _BLOCKS)]
        self._leaps = np.hstack(leaps)
        carry = np.zeros((_BLOCKS, self.order, _BLOCKS + 1, self.order))
        for block in range(_BLOCKS):
            for later in range(block + 1, _BLOCKS + 1):
                carry[block, :, later] = leaps[later - block - 1]
        self._carry: Array = carry.reshape(_BLOCKS * self.order, -1)

    @cached_property
    def settling(self) -> int:
        """Number of samples after which older samples have no effect on the output."""
        slowest = max(float(np.abs(np.roots((1.0, *section[3:]))).max()) for section in self.sections)
        return math.ceil(math.log(_FORGOTTEN) / math.log(slowest)) if slowest else 2

    @cached_property
    def noise_gain(self) -> float:
        """RMS of the filter's output if its input is white noise with an RMS of 1."""
        frequency = (np.arange(_GRID) + 0.5) / (2 * _GRID)
        return float(np.sqrt(np.mean(np.abs(response(self.sections, frequency)) ** 2)))

    def at_rest(self, axes: int) -> Array:
        return np.zeros((axes, self.order))

    def run(self, page: Array, state: Array) -> tuple[Array, Array]:
        if not (state.any() or page.any()):  # the input is constant, equal to its reference value
            return np.zeros_like(page), state
        blocks = page.reshape(len(page), _BLOCKS, _BLOCK)
        states = self._states(blocks, state)
        output = blocks @ self._to_output
        output += states[:, :-1] @ self._from_state
        return output.reshape(page.shape), states[:, -1]

    def after(self, signal: Array, state: Array) -> Array:
        axes, count = signal.shape
        page = np.zeros((axes, PAGE))
        page[:, :count] = signal
        whole, rest = divmod(count, _BLOCK)
        before = self._states(page.reshape(axes, _BLOCKS, _BLOCK), state)[:, whole]
        after: Array = before @ self._powers[rest]
        if rest:
            after += signal[:, -rest:] @ self._to_state[-rest:]
        return after

    def _states(self, blocks: Array, state: Array) -> Array:
        """Return the states before and after blocks, (axes, blocks + 1, order)."""
        left = (blocks @ self._to_state).reshape(len(blocks), -1)
        states: Array = left @ self._carry + state @ self._leaps
        return states.reshape(len(blocks), -1, self.order)


def _powers(matrix: Array, highest: int) -> list[Array]:
    powers = [np.eye(len(matrix))]
    for _ in range(highest):
        powers.append(powers[-1] @ matrix)
    return powers


def _state_space(sections: tuple[Section, ...]) -> tuple[Array, Array, Array, float]:
    """Return A, B, C, D of the cascade: s' = A s + B x, y = C s + D x."""
    a, b, c, d = np.zeros((0, 0)), np.zeros(0), np.zeros(0), 1.0
    for b0, b1, b2, a1, a2 in sections:
        # one section in transposed direct form II, fed by the sections before it
        own = np.array([[-a1, 1.0], [-a2, 0.0]])
        entry = np.array([b1 - a1 * b0, b2 - a2 * b0])
        a = np.block([[a, np.zeros((len(b), 2))], [np.outer(entry, c), own]])
        b = np.concatenate((b, entry * d))
        c = np.concatenate((b0 * c, (1.0, 0.0)))
        d *= b0
    return a, b, c, d


# -- a filter on a stream of samples ------------------------------------------------------------------------

Source: TypeAlias = Callable[[int, int], Array]
"""``source(number, count)``: unfiltered samples, (axes, count)."""

_SEGMENT = 16  # length in multiples of the warm-up pages
_KEPT = 4  # pages in memory: one for the stream's block, three for a second, slower reader


class _Page:
    """One page. Its arrays are never changed, because snapshots refer to them."""

    __slots__ = ("after", "known", "output", "samples")

    def __init__(self, axes: int) -> None:
        self.samples = np.empty((axes, 0))
        self.known = 0  # number of ``samples`` taken so far
        self.output: Array | None = None
        self.after: Array | None = None


class SampledFilter:
    """The filtered samples of ``source``, identified by their numbers."""

    def __init__(self, source: Source, axes: int = 3) -> None:
        self._source = source
        self._axes = axes
        self._chain: Chain | None = None
        self._started = 0  # number of the chain's first sample
        self._first = 0  # number of the first sample under the present settings
        self._initial = np.empty((axes, 0))  # the state before sample ``_first``
        self._reference: Array | None = None
        self._warm = self._segment = 1
        self._pages: dict[int, _Page] = {}

    def restart(self, chain: Chain | None, number: int) -> None:
        """Filter with another chain from ``number`` on."""
        self._chain = chain
        self._started = self._first = number
        self._reference = None
        self._pages.clear()
        if chain is not None:
            self._initial = chain.at_rest(self._axes)
            self._warm = -(-chain.settling // PAGE)
            self._segment = _SEGMENT * self._warm

    def split(self, number: int) -> None:
        """Save the filter's state before the settings change."""
        if self._chain is None or number == self._first:
            return
        page, offset = divmod(number - self._first, PAGE)
        state = self._state_before(page)
        self._initial = self._chain.after(self._input(page).samples[:, :offset], state)
        self._first = number
        self._pages.clear()

    def forget(self, number: int) -> None:
        if number <= self._started:
            self._reference = None
            self._pages.clear()
        page, offset = divmod(number - self._first, PAGE)
        for key, entry in self._pages.items():
            if key >= page:
                entry.output = entry.after = None
                entry.known = min(entry.known, offset) if key == page else 0

    def block(self, number: int, count: int) -> Array:
        """Return ``count`` filtered samples from ``number`` on, (axes, count)."""
        first = number - self._first
        end = first + count
        pieces = []
        while first < end:
            page, inside = divmod(first, PAGE)
            stop = min(end, (page + 1) * PAGE)
            pieces.append(self._output(page)[:, inside : inside + stop - first])
            first = stop
        return np.concatenate(pieces, axis=1)

    def _output(self, page: int) -> Array:
        entry = self._pages.get(page)
        if entry is not None and entry.output is not None:
            return entry.output
        assert self._chain is not None
        state = self._state_before(page)
        entry = self._input(page)
        output, entry.after = self._chain.run(entry.samples, state)
        if self._chain.start == "settled":
            output += self._reference_value()
        entry.output = output
        return output

    def _state_before(self, page: int) -> Array:
        assert self._chain is not None
        segment = page - page % self._segment
        for begin in range(page, segment, -1):
            entry = self._pages.get(begin - 1)
            if entry is not None and entry.after is not None:
                state = entry.after
                break
        else:
            begin = max(segment - self._warm, 0)
            state = self._chain.at_rest(self._axes) if begin else self._initial
        for number in range(begin, page):
            entry = self._input(number)
            state = self._chain.run(entry.samples, state)[1]
            if number >= segment:
                entry.after = state
        return state

    def _input(self, page: int) -> _Page:
        entry = self._pages.get(page)
        if entry is None:
            while len(self._pages) >= _KEPT:
                self._pages.pop(next(iter(self._pages)))
            entry = self._pages[page] = _Page(self._axes)
        known = entry.known
        if known < PAGE:
            reference = self._reference_value()
            taken = self._source(self._first + page * PAGE + known, PAGE - known)
            samples = np.empty((self._axes, PAGE))
            samples[:, :known] = entry.samples[:, :known]
            np.subtract(taken, reference, out=samples[:, known:])
            entry.samples, entry.known = samples, PAGE
        return entry

    def _reference_value(self) -> Array:
        """Return the input's reference, (axes, 1)."""
        if self._reference is None:
            assert self._chain is not None
            zero = self._chain.start == "zero"
            self._reference = np.zeros((self._axes, 1)) if zero else self._source(self._started, 1)
        return self._reference
