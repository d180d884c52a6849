"""A slow, simple timer that counts one clock tick after the other, written only from RM0368 12.3."""

from __future__ import annotations


class SlowTimer:
    """A timer with its registers as plain numbers. ``tick()`` is one cycle of its clock. It has one compare channel."""

    def __init__(self, direction: str, top: int = 0xFFFF) -> None:
        self.direction = direction
        self.top = top
        self.cen = self.opm = self.udis = self.urs = self.arpe = self.ocpe = False
        self.psc = self.active_psc = self._divided = 0
        self.arr = self.active_arr = top
        self.ccr = self.active_ccr = 0
        self.cnt = 0
        self.falling = direction == "down"
        self.uif = self.cc1if = False
        self.updates = 0

    def write_arr(self, value: int) -> None:
        self.arr = value
        if not self.arpe:
            self.active_arr = value

    def write_ccr(self, value: int) -> None:
        self.ccr = value
        if not self.ocpe:
            self.active_ccr = value

    def update_by_software(self) -> None:
        if not self.udis:
            self._load()
            self.uif |= not self.urs
        self._divided = 0
        self.cnt = self.active_arr if self.direction == "down" else 0
        self.falling = self.direction == "down"

    def tick(self) -> None:
        if not self.cen:
            return
        if self.active_arr == 0:  # the counter is blocked
            self._divided = 0
            return
        self._divided += 1
        if self._divided <= self.active_psc:
            return
        self._divided = 0
        overflow = self._count()
        self.cc1if |= self.cnt == self.active_ccr or (overflow and self.active_ccr > self.active_arr)
        if overflow and not self.udis:
            self._load()
            if self.direction == "down" or (self.direction == "centre" and self.cnt):
                self.cnt = self.active_arr  # the new ARR is there before the counter is reloaded
            self.uif = True
            self.updates += 1
            self.cen &= not self.opm

    def _count(self) -> bool:
        if self.direction == "up":
            overflow = self.cnt == self.active_arr
            self.cnt = 0 if overflow else (self.cnt + 1) & self.top
            return overflow
        if self.direction == "down":
            overflow = self.cnt == 0
            self.cnt = self.active_arr if overflow else self.cnt - 1
            return overflow
        self.cnt += -1 if self.falling else 1
        overflow = self.cnt == (0 if self.falling else self.active_arr)
        if overflow:
            self.falling = not self.falling
        return overflow

    def _load(self) -> None:
        self.active_psc, self.active_arr, self.active_ccr = self.psc, self.arr, self.ccr
