"""Digital filters as biquad sections, evaluated in blocks.

Decision: every filter of the parts is a second-order Butterworth section by the bilinear transform, -3 dB
exactly at the documented cut-off; no datasheet of the three gives order or shape. A cut-off at or above half
the sample rate filters nothing that samples at that rate could show, and its section is left out.

A cascade of sections runs as a state-space system over pages of 32 blocks of 64 samples: what each block
leaves in the state, then the state before each block, then the output of all blocks; a handful of matrix
products and no loop. Road not taken: scipy's ``sosfilt``, 30 MB of dependency for one loop in C.
"""

from __future__ import annotations

import math
from functools import cached_property, lru_cache
from typing import Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

Array: TypeAlias = NDArray[np.float64]
Spectrum: TypeAlias = NDArray[np.complex128]

Section: TypeAlias = tuple[float, float, float, float, float]
"""b0, b1, b2, a1, a2 of (b0 + b1/z + b2/z^2) / (1 + a1/z + a2/z^2)."""

Start: TypeAlias = Literal["settled", "zero", "reference"]
"""What a filter takes to have been before its first sample.

``settled``: its first sample, for ever; ``zero``: nothing; ``reference``: as ``settled``, and the first
sample is subtracted from every output.
"""

_BLOCK = 64
_BLOCKS = 32
PAGE = _BLOCK * _BLOCKS
"""Samples that are filtered at once."""

_FORGOTTEN = 1e-9  # full scale times this is far below one count
_GRID = 1 << 15

SLOPE: Section = (0.5, -0.5, 0.0, 0.0, 0.0)  # (x[n] - x[n-1]) / 2


def low_pass(cutoff: float) -> Section:
    """Second-order low-pass; ``cutoff`` is its -3 dB frequency over the sample rate, below 0.5."""
    k = math.tan(math.pi * cutoff)
    norm = 1 / (1 + math.sqrt(2) * k + k * k)
    gain = k * k * norm
    return gain, 2 * gain, gain, 2 * (k * k - 1) * norm, (1 - math.sqrt(2) * k + k * k) * norm


def high_pass(cutoff: float) -> Section:
    """Second-order high-pass; ``cutoff`` is its -3 dB frequency over the sample rate, below 0.5."""
    _, _, _, a1, a2 = low_pass(cutoff)
    gain = (1 - a1 + a2) / 4  # 1 at half the sample rate
    return gain, -2 * gain, gain, a1, a2


def response(sections: tuple[Section, ...], frequency: Array) -> Spectrum:
    """Complex gain of a cascade at ``frequency`` (n,), as a part of the sample rate."""
    delay = np.exp(-2j * np.pi * frequency)
    gain: Spectrum = np.ones_like(delay)
    for b0, b1, b2, a1, a2 in sections:
        gain *= (b0 + (b1 + b2 * delay) * delay) / (1 + (a1 + a2 * delay) * delay)
    return gain


@lru_cache(maxsize=64)  # boards share them; there are only so many settings
def chain(sections: tuple[Section, ...], start: Start) -> Chain:
    """The cascade of ``sections`` in the order given; the same object for the same arguments."""
    return Chain(sections, start)


class Chain:
    """A cascade of sections. Signals are axis-major, (axes, n); a state is (axes, ``order``), 0 at rest."""

    def __init__(self, sections: tuple[Section, ...], start: Start) -> None:
        self.sections = sections
        self.start: Start = start
        a, b, c, d = _state_space(sections)
        self.order = len(b)
        powers = _powers(a, _BLOCK)
        impulse = np.array([d, *(c @ power @ b for power in powers[: _BLOCK - 1])])
        # All transposed, since signals are rows: row times matrix.
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
        """Samples until what came before them no longer shows in the output."""
        slowest = max(float(np.abs(np.roots((1.0, *section[3:]))).max()) for section in self.sections)
        return math.ceil(math.log(_FORGOTTEN) / math.log(slowest)) if slowest else 2

    @cached_property
    def noise_gain(self) -> float:
        """RMS of the output for white noise of RMS 1 at the input."""
        frequency = (np.arange(_GRID) + 0.5) / (2 * _GRID)
        return float(np.sqrt(np.mean(np.abs(response(self.sections, frequency)) ** 2)))

    def at_rest(self, axes: int) -> Array:
        """The state before anything came."""
        return np.zeros((axes, self.order))

    def run(self, page: Array, state: Array) -> tuple[Array, Array]:
        """Output of ``PAGE`` samples, and the state after them."""
        if not (state.any() or page.any()):  # a still world less its reference
            return np.zeros_like(page), state
        blocks = page.reshape(len(page), _BLOCKS, _BLOCK)
        states = self._states(blocks, state)
        output = blocks @ self._to_output
        output += states[:, :-1] @ self._from_state
        return output.reshape(page.shape), states[:, -1]

    def after(self, signal: Array, state: Array) -> Array:
        """The state after at most ``PAGE`` samples."""
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
        """The state before each block and after the last, (axes, blocks + 1, order)."""
        left = (blocks @ self._to_state).reshape(len(blocks), -1)
        states: Array = left @ self._carry + state @ self._leaps
        return states.reshape(len(blocks), -1, self.order)


def _powers(matrix: Array, highest: int) -> list[Array]:
    """Powers 0 to ``highest``."""
    powers = [np.eye(len(matrix))]
    for _ in range(highest):
        powers.append(powers[-1] @ matrix)
    return powers


def _state_space(sections: tuple[Section, ...]) -> tuple[Array, Array, Array, float]:
    """A, B, C, D of the cascade: s' = A s + B x, y = C s + D x; two states a section."""
    a, b, c, d = np.zeros((0, 0)), np.zeros(0), np.zeros(0), 1.0
    for b0, b1, b2, a1, a2 in sections:
        # one section in transposed direct form II, fed by the output of those before it
        own = np.array([[-a1, 1.0], [-a2, 0.0]])
        entry = np.array([b1 - a1 * b0, b2 - a2 * b0])
        a = np.block([[a, np.zeros((len(b), 2))], [np.outer(entry, c), own]])
        b = np.concatenate((b, entry * d))
        c = np.concatenate((b0 * c, (1.0, 0.0)))
        d *= b0
    return a, b, c, d
