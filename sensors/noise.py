"""White noise as a pure function of a key and the sample index.

A counter-based generator (Philox) is asked for fixed pages of samples; page ``p`` of a key always holds the
same numbers, whatever was drawn before. So a run does not depend on who reads which sample when, a world
change does not shift the noise, and hundreds of boards need no shared state.

The numbers are those of numpy's ``Generator.standard_normal``; numpy keeps the bit stream for ever and the
normal transform in practice (it reserves the right to change it between releases).
"""

from __future__ import annotations

import zlib

import numpy as np
from numpy.typing import NDArray

_PAGE = 4096


def noise_key(seed: int, *names: str | int) -> int:
    """A 128-bit key for one noise source of one part of one board."""
    text = "/".join(str(name) for name in (seed, *names)).encode()
    return (seed & 0xFFFFFFFF) << 64 | zlib.crc32(text) << 32 | zlib.adler32(text)


class NoiseSource:
    """Standard normal noise with ``channels`` independent channels."""

    def __init__(self, key: int, channels: int) -> None:
        self._key = key
        self._channels = channels
        self._pages: dict[int, NDArray[np.float64]] = {}

    def block(self, first: int, count: int) -> NDArray[np.float64]:
        """Samples ``first`` to ``first + count - 1``, shape (channels, count), unit variance."""
        start, end = first // _PAGE, (first + count - 1) // _PAGE
        pages = [self._page(number) for number in range(start, end + 1)]
        offset = first - start * _PAGE
        drawn = pages[0] if len(pages) == 1 else np.concatenate(pages, axis=1)
        return drawn[:, offset : offset + count]

    def _page(self, number: int) -> NDArray[np.float64]:
        page = self._pages.get(number)
        if page is None:
            if len(self._pages) >= 2:  # a block spans two pages at most; older ones are drawn again if asked
                self._pages.pop(next(iter(self._pages)))
            bits = np.random.Philox(key=self._key, counter=[0, 0, 0, number])
            page = np.random.Generator(bits).standard_normal((self._channels, _PAGE))
            self._pages[number] = page
        return page
