"""IWDG: the independent watchdog, counting LSI (RM0368 section 15).

LSI is exactly 32 kHz here, on the board 17 to 47 kHz: firmware that only just makes it needs a margin
there. New prescaler and reload values are taken over at the next reload; the manual's few LSI cycles for
that (PVU, RVU) are not modelled.
"""

from __future__ import annotations

from typing import ClassVar

from emulator.chip.peripherals.clock_tree import LSI_HZ
from emulator.chip.peripherals.peripheral import WORD, Peripheral
from emulator.chip.soc import Soc
from emulator.time.clock import PS_PER_S, Event

KR, PR, RLR, SR = 0x00, 0x04, 0x08, 0x0C

_UNLOCK, _RELOAD, _START = 0x5555, 0xAAAA, 0xCCCC


class Iwdg(Peripheral):
    """Once started, resets the chip unless it is reloaded in time; only that reset stops it."""

    REGISTERS: ClassVar[dict[int, int]] = {KR: 0, PR: 0, RLR: 0xFFF, SR: 0}
    NAMES: ClassVar[dict[int, str]] = {KR: "KR", PR: "PR", RLR: "RLR", SR: "SR"}
    WRITABLE: ClassVar[dict[int, int]] = {KR: 0, PR: 0x7, RLR: 0xFFF, SR: 0}

    def __init__(self, soc: Soc, name: str, base: int) -> None:
        super().__init__(soc, name, base)
        self._unlocked = False
        self._deadline_ps: int | None = None
        self._event: Event | None = None
        self._event_ps = 0

    def reset(self) -> None:
        """Not started."""
        super().reset()
        self._unlocked = False
        self._deadline_ps = None
        if self._event is not None:
            self._event.cancel()
            self._event = None

    def write(self, offset: int, value: int, mask: int = WORD) -> None:
        """KR takes keys; PR and RLR are open after the key 0x5555 only (15.3.2)."""
        if offset == KR:
            self._take_key(value & mask & 0xFFFF)
        elif not self._unlocked:
            name = self.NAMES.get(offset, f"0x{offset:02X}")
            self.note("refused", f"{name} written without the key 0x5555 in KR")
        else:
            super().write(offset, value, mask)

    def _take_key(self, key: int) -> None:
        self._unlocked = key == _UNLOCK
        if key == (_START if self._deadline_ps is None else _RELOAD):
            self._reload()

    def _reload(self) -> None:
        """The event moves on when it fires: a reload in every millisecond would fill the clock's queue."""
        cycles = (4 << min(self.registers[PR], 6)) * (self.registers[RLR] + 1)
        self._deadline_ps = self.soc.clock.now_ps + cycles * PS_PER_S // LSI_HZ
        if self._event is None:
            self._event = self.soc.clock.schedule(self._deadline_ps, self._due)
        elif self._deadline_ps < self._event_ps:
            self._event.cancel()
            self._event = self.soc.clock.schedule(self._deadline_ps, self._due)
        else:
            return
        self._event_ps = self._deadline_ps

    def _due(self) -> None:
        assert self._event is not None
        assert self._deadline_ps is not None
        if self._deadline_ps > self.soc.clock.now_ps:
            self._event_ps = self._deadline_ps
            self.soc.clock.repeat(self._event, self._deadline_ps)
            return
        self._event = None
        self.soc.reset("IWDG")
