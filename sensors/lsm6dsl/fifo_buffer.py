"""The 4 kB of the LSM6DSL's FIFO: 16-bit words in, 16-bit words out (AN5040 Rev 3, section 8).

The memory holds 2048 words (the datasheet's section 5.5.2 says 4096, against its own 4 kB). When a data set
does not fit any more, its words overwrite the oldest ones, word by word. The count has 11 bits, so that a
full memory reads 0: AN5040 Table 64 shows exactly that beside OVER_RUN.

A word leaves when its high byte has been read. Its low byte takes the whole word to the output buffer, so
that the two bytes belong together also when the word is overwritten in between.

Decision: an empty FIFO shows the word read last, which is what an output buffer would do. The road not taken
is 0; the documents forbid reading it and do not say.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable

WORDS = 2048


class FifoBuffer:
    """The words, oldest first. ``depth``: how many it holds before it overwrites.

    ``gone``: how many words have left since it was cleared, by reading or by being overwritten.
    ``overrun``: it is full and words have been overwritten.
    """

    def __init__(self) -> None:
        self.depth = WORDS
        self.clear()

    def clear(self) -> None:
        """Empty it, the output buffer too."""
        self._words: deque[int] = deque()
        self.gone = 0
        self.overrun = False
        self._output = 0
        self._taken: int | None = None  # number of the word whose low byte has been read

    @property
    def fill(self) -> int:
        """Unread words."""
        return len(self._words)

    def store(self, words: Iterable[int]) -> None:
        """Append words; the oldest make room."""
        self._words.extend(words)
        lost = len(self._words) - self.depth
        if lost > 0:
            for _ in range(lost):
                self._words.popleft()
            self.gone += lost
            self.overrun = True

    def skip(self, words: int) -> None:
        """So many words came and went unseen, while the FIFO was full and is to be filled anew."""
        self.gone += words

    def readable(self) -> bool:
        """Whether the next byte read is one of a word that was stored."""
        return bool(self._words) or self._taken is not None

    def low(self) -> int:
        """FIFO_DATA_OUT_L is read."""
        self._take()
        return self._output & 0xFF

    def high(self) -> int:
        """FIFO_DATA_OUT_H is read: the word leaves, unless it has been overwritten meanwhile."""
        self._take()
        if self._taken == self.gone and self._words:
            self._words.popleft()
            self.gone += 1
            self.overrun = False
        self._taken = None
        return self._output >> 8

    def _take(self) -> None:
        if self._taken is None and self._words:
            self._output = self._words[0]
            self._taken = self.gone
