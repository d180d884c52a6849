"""The FIFO of the LSM6DSL (AN5040 8; datasheet 5.5).

Lazy evaluation: a read processes all due triggers and events. Decisions where the documents are silent or disagree:

* FIFO mode stops as soon as the next trigger's sets would fill the memory (AN5040 figures 28 and 29 against Table 64),
  and stays stopped until bypass.
* The sample that raises the event is the first of the new mode.
* A change of the configuration outside bypass causes a note; stored words remain, and the pattern restarts after them.
* An empty FIFO shows the latest word that was read, as an output buffer would.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable
from functools import partial
from typing import NamedTuple

from fcu_emulator.sensors.lsm6dsl.feature import FeatureContext, SignalName, Signals, Violations
from fcu_emulator.sensors.lsm6dsl.fifo_sets import (
    CONFIGURATION,
    TRIGGERS,
    WORDS,
    DataSets,
    FifoMode,
    FifoPattern,
    FifoSettings,
    SampleTriggers,
    Writer,
    violations,
)
from fcu_emulator.sensors.lsm6dsl.registers import (
    FIFO_DATA_OUT,
    FIFO_STATUS1,
    FIFO_STATUS2,
    FIFO_STATUS3,
    FIFO_STATUS4,
)
from fcu_emulator.sensors.lsm6dsl.timestamp import Timestamp
from fcu_emulator.sensors.register_file import NEVER_PS

# -- memory -------------------------------------------------------------------------------------------------


class FifoBuffer:
    """Words, oldest first; if the memory is full, new words overwrite the oldest.

    The count of a full memory reads 0 with OVER_RUN, because the count has 11 bits (AN5040 Table 64). ``gone``:
    number of removed words.
    """

    def __init__(self) -> None:
        self.depth = WORDS
        self.clear()

    def clear(self) -> None:
        self._words: deque[int] = deque()
        self.gone = 0
        self.overrun = False
        self._output = 0
        self._taken: int | None = None  # number of the word whose low byte has been read

    @property
    def fill(self) -> int:
        return len(self._words)

    def store(self, words: Iterable[int]) -> None:
        self._words.extend(words)
        lost = len(self._words) - self.depth
        if lost > 0:
            for _ in range(lost):
                self._words.popleft()
            self.gone += lost
            self.overrun = True

    def skip(self, words: int) -> None:
        """Count words that were stored in a full FIFO and have been overwritten."""
        self.gone += words

    def readable(self) -> bool:
        return bool(self._words) or self._taken is not None

    def low(self) -> int:
        """Take the next word (FIFO_DATA_OUT_L)."""
        self._take()
        return self._output & 0xFF

    def high(self) -> int:
        """Return the high byte and remove the word, unless overwritten."""
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


# -- flags of FIFO_STATUS2 and their signals FTH, FULL_FLAG and FIFO_OVR (AN5040 8.2.2) ---------------------

_WATERMARK, _OVERRUN = FIFO_STATUS2.WaterM.mask, FIFO_STATUS2.OVER_RUN.mask
_FULL, _EMPTY = FIFO_STATUS2.FIFO_FULL_SMART.mask, FIFO_STATUS2.FIFO_EMPTY.mask


class FifoFlags:
    """Status flags as in FIFO_STATUS2; ``watermark``: FTH, 0 for none."""

    def __init__(self, buffer: FifoBuffer, signals: Signals) -> None:
        self._buffer = buffer
        self._signals = signals
        self.watermark = 0
        self.bits = _EMPTY

    @property
    def full(self) -> bool:
        return bool(self.bits & _FULL)

    def update(self, ahead: int | None, at_ps: int) -> None:
        """Update the flags. ``ahead``: number of words of the next trigger; None in bypass, or while waiting."""
        buffer, bits = self._buffer, 0
        fill = buffer.fill
        if not fill:
            bits |= _EMPTY
        if 0 < self.watermark <= fill:
            bits |= _WATERMARK
        if buffer.overrun:
            bits |= _OVERRUN
        if ahead is not None and fill + ahead >= buffer.depth:
            bits |= _FULL
        if bits != self.bits:
            self.bits = bits
            self._signals.set("FTH", bool(bits & _WATERMARK), at_ps)
            self._signals.set("FULL_FLAG", bool(bits & _FULL), at_ps)
            self._signals.set("FIFO_OVR", bool(bits & _OVERRUN), at_ps)

    def triggers_to_next(self, widest: int) -> int:
        """Return a lower bound of the number of triggers until a flag changes, or 0.

        ``widest``: maximum words per trigger.
        """
        buffer = self._buffer
        if buffer.overrun or not widest:
            return 0
        levels = (self.watermark, buffer.depth - widest, buffer.depth, buffer.depth + 1)
        missing = min(level - buffer.fill for level in levels if level > buffer.fill)
        return -(-missing // widest)


# -- the FIFO -----------------------------------------------------------------------------------------------

_TRIGGERS_AT_ONCE = 512
_HEARD: tuple[SignalName, ...] = (*TRIGGERS, "SENSORHUB")


class FifoEvent(NamedTuple):
    """A signal that has been received but not yet processed."""

    at_ps: int
    name: SignalName


class Fifo:
    """The FIFO; ``active`` in every mode except bypass."""

    CONFIGURATION = CONFIGURATION

    def __init__(self, chip: FeatureContext, timestamp: Timestamp) -> None:
        self.active = False
        self._chip = chip
        self._mem = chip.registers.mem
        self._buffer = FifoBuffer()
        self._sets = DataSets(chip, timestamp)
        self._violations = Violations(chip)
        self._settings = FifoSettings.decode(self._mem)
        self._contents = self._sets.contents(self._settings.layout)
        self._pattern = FifoPattern(self._settings.layout.decimations)
        self._pattern_first = 0  # number of the pattern's first word
        self._trigger = 0  # number of the next trigger in the pattern
        self._samples = SampleTriggers(chip)
        self._switched = self._stopped = (
            False  # the event of a triggered mode has occurred, or FIFO mode has stopped
        )
        self._flags = FifoFlags(self._buffer, chip.signals)
        self._open = True  # gate of data enable
        self._done_ps = -1  # all work until this time is done
        self._events: list[FifoEvent] = []
        self._wire()

    def _wire(self) -> None:
        registers = self._chip.registers
        for status in (FIFO_STATUS1, FIFO_STATUS2, FIFO_STATUS3, FIFO_STATUS4):
            registers.before_read(status, self._show_status)
        registers.before_read(FIFO_DATA_OUT, self._read)
        for name in _HEARD:
            self._chip.signals.listen(name, partial(self._hear, name))

    # -- feature interface ------------------------------------------------------------------------------

    def configure(self, now_ps: int) -> None:
        old, new = self._settings, FifoSettings.decode(self._mem)
        changed = (old.mode, old.layout) != (new.mode, new.layout)
        self._settings = new
        self._buffer.depth, self._flags.watermark = new.depth, new.watermark
        self._sets.mark()
        self.active = new.mode is not FifoMode.BYPASS
        if not self.active or old.mode is FifoMode.BYPASS:
            self._clear()
        elif changed:
            self._chip.note(
                now_ps, "forbidden", "fifo-changed", "FIFO configuration changed without going through bypass"
            )
            self._stopped = False
        if old.layout != new.layout:
            self._take_layout()
        was_open, self._open = self._open, self._chip.gates.fifo_open
        opened = self._open and not was_open
        self._samples.follow(new.layout.odr_fifo, now_ps, restart=changed or opened)
        self._update_flags(now_ps)
        self._violations.report(violations(self._mem), now_ps)

    def catch_up(self, now_ps: int) -> None:
        """Store data sets and process events, in the order of time."""
        heard = sorted(self._events)
        # another function may have processed later samples than the FIFO, so that its events are still to
        # come
        self._events = [event for event in heard if event.at_ps > now_ps]
        for event in heard[: len(heard) - len(self._events)]:
            self._collect(event.at_ps - 1)
            self._deal_with(event)
        self._collect(now_ps)
        self._done_ps = now_ps

    def reset(self, now_ps: int) -> None:
        self.active = False
        self._clear()
        self._update_flags(now_ps)

    def next_event_ps(self) -> int:
        """Return the earliest time at which a routed flag may change."""
        settings = self._settings
        if not settings.on_pin or settings.layout.writer is not Writer.DATA_READY or not self._collects():
            return NEVER_PS  # the FIFO waits for another function's event; that function knows the time
        triggers = self._flags.triggers_to_next(self._pattern.widest)
        return self._samples.time_ps(triggers - 1) if triggers else NEVER_PS

    # -- configuration ----------------------------------------------------------------------------------

    def _clear(self) -> None:
        self._buffer.clear()
        self._events.clear()
        self._switched = self._stopped = False
        self._begin_pattern()

    def _begin_pattern(self) -> None:
        self._pattern_first = self._buffer.gone + self._buffer.fill
        self._trigger = 0

    def _take_layout(self) -> None:
        layout = self._settings.layout
        self._pattern = FifoPattern(layout.decimations)
        self._contents = self._sets.contents(layout)
        self._begin_pattern()

    # -- events -----------------------------------------------------------------------------------------

    def _hear(self, name: SignalName, on: bool, at_ps: int) -> None:
        if on and self.active:
            self._events.append(FifoEvent(at_ps, name))

    def _deal_with(self, event: FifoEvent) -> None:
        settings = self._settings
        if event.name in settings.triggers and not self._switched:
            self._switched = True
            if settings.mode is FifoMode.BYPASS_TO_CONTINUOUS:
                self._samples.begin(event.at_ps)
            self._update_flags(event.at_ps)
        if event.name == settings.layout.writer.value and settings.layout.odr_fifo and self._collects():
            self._store([event.at_ps])

    # -- writing ----------------------------------------------------------------------------------------

    def _waits(self) -> bool:
        return self._settings.mode is FifoMode.BYPASS_TO_CONTINUOUS and not self._switched

    def _collects(self) -> bool:
        return self._open and not (self._stopped or self._waits())

    def _stops_when_full(self) -> bool:
        mode = self._settings.mode
        return mode is FifoMode.FIFO or (mode is FifoMode.CONTINUOUS_TO_FIFO and self._switched)

    def _collect(self, until_ps: int) -> None:
        if self._settings.layout.writer is not Writer.DATA_READY:
            return
        while self._collects() and (due := self._samples.due(until_ps)):
            due -= self._skip(due)
            self._store(self._samples.take(min(due, _TRIGGERS_AT_ONCE)))

    def _skip(self, due: int) -> int:
        pattern = self._pattern
        if not self._buffer.overrun or not pattern.length:
            return 0
        kept = (self._buffer.depth // pattern.length + 1) * pattern.period
        repeats = max(0, due - kept) // pattern.period
        self._buffer.skip(repeats * pattern.length)
        self._samples.skip(repeats * pattern.period)
        return repeats * pattern.period

    def _store(self, times_ps: list[int]) -> None:
        rows = {number: self._contents[number](times_ps) for number in self._pattern.sets(0)}
        for position, at_ps in enumerate(times_ps):
            for number in self._pattern.sets(self._trigger):
                self._buffer.store(rows[number][position])
            self._trigger += 1
            self._update_flags(at_ps)
            if self._stopped:
                return

    # -- reading ----------------------------------------------------------------------------------------

    def _update_flags(self, at_ps: int) -> None:
        ahead = self._pattern.words(self._trigger) if self.active and not self._waits() else None
        self._flags.update(ahead, at_ps)
        self._stopped = self._stopped or (self._flags.full and self._stops_when_full())

    def _catch_up(self, now_ps: int) -> None:
        if now_ps > self._done_ps or self._events:  # called once per word of a burst
            self._chip.catch_up(now_ps)

    def _show_status(self, first: int, end: int, now_ps: int) -> None:
        del first, end
        self._catch_up(now_ps)
        buffer, mem = self._buffer, self._mem
        place = (buffer.gone - self._pattern_first) % self._pattern.length if self._pattern.length else 0
        mem[FIFO_STATUS1.addr] = buffer.fill & 0xFF
        mem[FIFO_STATUS2.addr] = self._flags.bits | FIFO_STATUS2.DIFF_FIFO_10_8.put(0, buffer.fill >> 8)
        mem[FIFO_STATUS3.addr] = place & 0xFF
        mem[FIFO_STATUS4.addr] = place >> 8

    def _read(self, first: int, end: int, now_ps: int) -> bytes:
        self._catch_up(now_ps)
        buffer = self._buffer
        data = bytearray()
        for address in range(first, end):
            if not buffer.readable():
                self._chip.note(
                    now_ps, "forbidden", "fifo-empty", "FIFO_DATA_OUT read while the FIFO is empty"
                )
            data.append(buffer.low() if address == FIFO_DATA_OUT.addr else buffer.high())
        bits = self._flags.bits
        self._update_flags(now_ps)
        if bits != self._flags.bits:
            self._chip.catch_up(now_ps)  # for the pins
        return bytes(data)
