"""A slow and simple LPS22HB: the required behaviour, sample by sample, read by read and write by write.

It follows the datasheet and the decisions in the modules of ``sensors.lps22hb``, and stores all state as numbers and
lists. There is one data rate, 50 Hz, and one-shot in low noise.
"""

from __future__ import annotations

from collections.abc import Callable

from tests.support.sensor_fakes import PS_PER_MS, PS_PER_S

RATE_HZ = 50
PERIOD_PS = PS_PER_S // RATE_HZ
ONE_SHOT_PS = 13 * PS_PER_MS
NEVER_PS = 1 << 70
BYPASS, FIFO, STREAM, DYNAMIC = "bypass", "fifo", "stream", "dynamic"
MODES = {
    0: (BYPASS, BYPASS),
    1: (FIFO, FIFO),
    2: (STREAM, STREAM),
    3: (STREAM, FIFO),
    4: (BYPASS, STREAM),
    5: (BYPASS, BYPASS),
    6: (DYNAMIC, DYNAMIC),
    7: (BYPASS, FIFO),
}


class Oracle:
    """The oracle. ``measured(t_ps)`` returns the counts of pressure and temperature of a sample at that time."""

    def __init__(self, measured: Callable[[int], tuple[int, int]]) -> None:
        self.measured = measured
        self.rpds = 0
        self.status = 0
        self.latest = self.registers = bytes(5)
        self.levels: list[bytes] = []
        self.last_read: bytes | None = None
        self.stopped = self.overrun = self.held = False
        self.behaviour = BYPASS
        self.level = 0
        self.edges: list[tuple[int, int]] = []
        self.reset_registers()

    def reset_registers(self) -> None:
        self.interrupt_cfg = self.threshold = self.control1 = self.control3 = self.fifo_ctrl = self.ref_p = 0
        self.control2 = 0x10
        self.autozero = self.autorifp = self.ph = self.pl = False
        self.next_ps = NEVER_PS

    # -- samples ----------------------------------------------------------------------------------------

    def run_to(self, t_ps: int) -> None:
        while (due_ps := self.next_ps) <= t_ps:
            self.next_ps = due_ps + PERIOD_PS if self.control1 & 0x70 else NEVER_PS
            self.control2 &= ~0x01
            self.sample(*self.measured(due_ps))
            self.drive(due_ps)
        self.look()

    def sample(self, counts: int, temperature: int) -> None:
        self.status |= (self.status & 0x03) << 4 | 0x03
        if self.interrupt_cfg & 0xA0:
            self.ref_p = counts
            self.autozero |= bool(self.interrupt_cfg & 0x20)
            self.autorifp |= bool(self.interrupt_cfg & 0x80)
            self.interrupt_cfg &= 0x5F
        shown = counts - (self.ref_p if self.autozero else 256 * self.rpds)
        self.latest = shown.to_bytes(3, "little", signed=True) + temperature.to_bytes(2, "little")
        self.compare(counts - self.ref_p if self.autozero or self.autorifp else counts)
        self.behave()
        self.collect()

    def compare(self, difference: int) -> None:
        if not self.interrupt_cfg & 0x08 or not self.interrupt_cfg & 0x03:
            return
        latched = bool(self.interrupt_cfg & 0x04)
        high = difference > 256 * self.threshold and bool(self.interrupt_cfg & 0x01)
        low = difference < -256 * self.threshold and bool(self.interrupt_cfg & 0x02)
        self.ph, self.pl = high or (latched and self.ph), low or (latched and self.pl)

    def behave(self) -> None:
        modes = MODES[self.fifo_ctrl >> 5] if self.control2 & 0x40 else MODES[0]
        self.behaviour = modes[self.ph or self.pl]
        if self.behaviour != FIFO:
            self.stopped = False
        if self.behaviour == BYPASS:
            self.levels, self.last_read, self.overrun = [], None, False

    def collect(self) -> None:
        depth = (self.fifo_ctrl & 0x1F) + 1 if self.control2 & 0x20 else 32
        if self.behaviour == FIFO and len(self.levels) >= depth:
            self.stopped = self.overrun = True
        if self.behaviour == BYPASS or self.stopped:
            return
        if self.behaviour == STREAM and not self.levels and self.last_read:
            self.levels = [self.last_read]
        self.levels = [*self.levels, self.latest]
        if len(self.levels) > depth:
            self.levels = self.levels[-depth:]
            self.overrun = True

    # -- reading ----------------------------------------------------------------------------------------

    def look(self) -> None:
        if self.held:
            return
        if self.behaviour == BYPASS:
            self.registers = self.latest
        elif self.levels:
            self.registers = self.levels[0]

    def read_output(self, offset: int) -> int:
        self.look()
        value = self.registers[offset]
        if offset < 2:
            self.held = bool(self.control1 & 0x02)
        if offset == 2:
            self.held = False
            self.status &= 0x22
        if offset == 4:
            self.status &= 0x11
            if self.levels:
                self.last_read, self.overrun = self.levels.pop(0), False
        return value

    def following(self, offset: int) -> int:
        return (offset + 1) % 5 if self.control2 & 0x10 else offset

    def read_int_source(self) -> int:
        value = self.ph | self.pl << 1 | (self.ph or self.pl) << 2
        if self.interrupt_cfg & 0x04:
            self.ph = self.pl = False
        self.behave()
        self.look()
        return value

    def fifo_status(self) -> int:
        return len(self.levels) | self.overrun << 6 | self.at_watermark() << 7

    def at_watermark(self) -> bool:
        watermark = self.fifo_ctrl & 0x1F
        return watermark > 0 and len(self.levels) >= watermark

    # -- writing ----------------------------------------------------------------------------------------

    def write_interrupt_cfg(self, value: int) -> None:
        if value & 0x10:
            self.autozero, self.ref_p = False, 0
        if value & 0x40:
            self.autorifp = False
        self.interrupt_cfg = value & 0xAF

    def write_control1(self, value: int, t_ps: int) -> None:
        if value & 0x70:
            self.control2 &= ~0x01
            if not self.control1 & 0x70:
                self.next_ps = t_ps + PERIOD_PS
        elif self.control1 & 0x70:
            self.next_ps = NEVER_PS
        self.control1 = value
        self.held = self.held and bool(value & 0x02)

    def write_control2(self, value: int, t_ps: int) -> None:
        busy = self.control2 & 0x01
        if value & 0x01 and not busy and not self.control1 & 0x70:
            self.next_ps, busy = t_ps + ONE_SHOT_PS, 1
        self.control2 = value & 0x70 | busy

    def swreset(self) -> None:
        self.reset_registers()
        self.held = False

    def written(self, t_ps: int) -> None:
        """Apply the effects of a register write."""
        if not self.interrupt_cfg & 0x04:
            on = self.interrupt_cfg & 0x08
            self.ph = self.ph and bool(on and self.interrupt_cfg & 0x01)
            self.pl = self.pl and bool(on and self.interrupt_cfg & 0x02)
        self.behave()
        self.look()
        self.drive(t_ps)

    def drive(self, t_ps: int) -> None:
        select, control = self.control3 & 0x03, self.control3
        signals = self.at_watermark() << 4 | self.overrun << 3 | (len(self.levels) == 32) << 5
        signals |= (self.status & 0x01) << 2
        active = (bool(control & signals & 0x3C), self.ph, self.pl, self.ph or self.pl)[select]
        level = int(active != bool(control & 0x80))
        if level != self.level:
            self.level = level
            self.edges.append((t_ps, level))
