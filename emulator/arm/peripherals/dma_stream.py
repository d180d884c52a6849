"""One stream of a DMA controller: its registers and one transfer at a time (RM0368 sections 9.3.5 to 9.3.12).

A transfer happens at once when its request is made. In FIFO mode data would wait in the FIFO until its
threshold is reached; here it goes through, which a program can see only by reading memory before the end.
Packing (PSIZE and MSIZE different, 9.3.10) then is what little-endian byte order makes of it: items follow
one another in memory in the size they have at the peripheral. Priorities, bursts and PINCOS are stored and
without effect.

Memory to memory is done at its end, when 4 cycles of HCLK an item have passed (an estimate, the manual gives
no figure); NDTR shows the whole length until then.
"""

from __future__ import annotations

from collections.abc import Callable

from emulator.arm.peripherals.dma_requests import DmaLines
from emulator.arm.soc import Soc
from emulator.clock import PS_PER_S, Event

EN, DMEIE, TEIE, HTIE, TCIE = 1 << 0, 1 << 1, 1 << 2, 1 << 3, 1 << 4
CIRC, PINC, MINC, DBM, CT = 1 << 8, 1 << 9, 1 << 10, 1 << 18, 1 << 19
FEIF, DMEIF, TEIF, HTIF, TCIF = 1 << 0, 1 << 2, 1 << 3, 1 << 4, 1 << 5

PERIPHERAL_TO_MEMORY, MEMORY_TO_PERIPHERAL, MEMORY_TO_MEMORY = range(3)
_CYCLES_PER_ITEM = 4
_SIZE = (1, 2, 4, 4)  # PSIZE: byte, half-word, word, reserved
_CHANGEABLE_WHILE_ON = EN | DMEIE | TEIE | HTIE | TCIE


class Stream:
    """A stream. ``flags`` are its five bits of LISR or HISR; ``raised`` is called when one has been set."""

    def __init__(self, soc: Soc, lines: DmaLines, raised: Callable[[], None]) -> None:
        self._soc = soc
        self._lines = lines
        self._raised = raised
        self._event: Event | None = None
        self.control = 0
        self.items = 0
        """NDTR: items left."""
        self.peripheral = 0
        self.memory = [0, 0]
        self.fifo_control = 0x21
        self.flags = 0
        self.names: tuple[str, ...] = ()
        self._begin()

    def reset(self) -> None:
        """Back to the state after reset."""
        self._stop()
        self.control = self.items = self.peripheral = self.flags = 0
        self.memory = [0, 0]
        self.fifo_control = 0x21

    def remaining(self) -> int:
        """Items left."""
        return self.items

    @property
    def direction(self) -> int:
        """DIR: where the data goes."""
        return self.control >> 6 & 3

    def interrupt(self) -> bool:
        """Whether a flag is set whose interrupt is enabled; a FIFO error never occurs here."""
        enabled = (TCIF if self.control & TCIE else 0) | (HTIF if self.control & HTIE else 0)
        return bool(self.flags & (enabled | (TEIF if self.control & TEIE else 0)))

    def write_control(self, value: int, names: tuple[str, ...]) -> bool:
        """Write CR; ``names`` are the lines of the channel selected. False: bits were protected by EN."""
        was_on = self.control & EN
        allowed = not was_on or not (value ^ self.control) & ~_CHANGEABLE_WHILE_ON
        self.control = (
            value if not was_on else self.control & ~_CHANGEABLE_WHILE_ON | value & _CHANGEABLE_WHILE_ON
        )
        if value & EN and not was_on:
            self._start(names)
        elif was_on and not value & EN:
            self._suspend()
        return allowed

    # -- a run of transfers -----------------------------------------------------------------------------

    def _start(self, names: tuple[str, ...]) -> None:
        if self.items == 0:  # 9.3.14: nothing to transfer, the stream does not start
            self.control &= ~EN
            return
        self._begin()
        if self.direction == MEMORY_TO_MEMORY:
            cycles = self.items * _CYCLES_PER_ITEM
            at_ps = self._soc.clock.now_ps + cycles * PS_PER_S // self._soc.clocks.hclk_hz
            self._event = self._soc.clock.schedule(at_ps, self._copy)
        else:
            self.names = names
            self._lines.serve(names, self)

    def _begin(self) -> None:
        """Latch what a run starts from, and a circular one starts from again."""
        self._length = self.items
        self._moved = 0
        self._size = _SIZE[self.control >> 11 & 3]
        self._peripheral_step = self._size if self.control & PINC else 0
        self._memory_step = self._size if self.control & MINC else 0

    def _stop(self) -> None:
        self.control &= ~EN
        self._lines.leave(self.names, self)
        if self._event is not None:
            self._event.cancel()
            self._event = None

    def _suspend(self) -> None:
        """EN cleared by software with items left: the transfer ends, and TCIF says so (9.3.15)."""
        self._stop()
        self._raise(TCIF)

    def transfer(self) -> None:
        """One item between peripheral and memory."""
        if not self._move():
            self._stop()
            self._raise(TEIF)
            return
        self.items -= 1
        if self.items == self._length // 2 and self.items:
            self._raise(HTIF)
        if self.items == 0:
            self._complete()

    def _move(self) -> bool:
        memory = self._soc.memory
        outside = self.peripheral + self._moved * self._peripheral_step
        inside = self.memory[1 if self.control & CT else 0] + self._moved * self._memory_step
        self._moved += 1
        source, target = (outside, inside) if self.direction != MEMORY_TO_PERIPHERAL else (inside, outside)
        data = memory.read(source, self._size)
        return data is not None and memory.write(target, data)

    def _complete(self) -> None:
        if self.control & (CIRC | DBM):
            self.items, self._moved = self._length, 0
            if self.control & DBM:
                self.control ^= CT
        else:
            self._stop()
        self._raise(TCIF)

    def _copy(self) -> None:
        self._event = None
        while self.items:
            if not self._move():
                self._stop()
                self._raise(TEIF)
                return
            self.items -= 1
        self._stop()
        self._raise(HTIF | TCIF)

    def _raise(self, flags: int) -> None:
        self.flags |= flags
        self._raised()
