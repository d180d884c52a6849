"""The LPS22HB's reference, interrupt, FIFO and pin under arbitrary use, against a slow and plain oracle.

The oracle knows the sensor facts (3.3 to 3.5) and the decisions stated in the modules of ``sensors.lps22hb``;
it goes sample by sample and keeps everything as numbers and lists. Two parts are driven alike: one is left
alone until it is accessed, the other is made to catch up all the time. Both must do what the oracle says,
with every edge of the pin at its time.
"""

from __future__ import annotations

import numpy as np
from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, rule

from tests.sensor_fakes import PS_PER_S, Array, Chip

RATE_HZ = 50
PERIOD_PS = PS_PER_S // RATE_HZ
INTERRUPT_CFG, THS_P_L, CTRL_REG1, CTRL_REG2, CTRL_REG3, FIFO_CTRL = 0x0B, 0x0C, 0x10, 0x11, 0x12, 0x14
REF_P_XL, RPDS_L, INT_SOURCE, FIFO_STATUS, STATUS, PRESS_OUT_XL = 0x15, 0x18, 0x25, 0x26, 0x27, 0x28
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

SETTINGS: dict[str, st.SearchStrategy[int]] = {
    "interrupt_cfg": st.one_of(st.integers(0, 0xFF), st.sampled_from((0x0B, 0x0F, 0x8F))),
    "threshold": st.integers(0, 40),
    "offset": st.integers(0, 100),
    "fifo_ctrl": st.builds(
        lambda mode, watermark: mode << 5 | watermark, st.integers(0, 7), st.sampled_from((0, 1, 2, 5, 31))
    ),
    "control2": st.sampled_from((0x50, 0x50, 0x70, 0x10)),
    # push-pull: an open-drain pin has no rising edges
    "control3": st.sampled_from((0x00, 0x01, 0x02, 0x03, 0x04, 0x08, 0x10, 0x14, 0x20, 0x3C, 0x84, 0x90)),
}


def measured(sample: Array) -> Array:
    """Counts of sample 0, 1 ...: about 1000 hPa, up to 2 hPa off in steps of 1/16 hPa."""
    return 1000 * 4096 + (sample * 29 % 65 - 32) * 256


def pressure_hpa(t_s: Array) -> Array:
    return measured(np.rint(t_s * RATE_HZ) - 1) / 4096


def temperature_degc(t_s: Array) -> Array:
    return np.rint(t_s * RATE_HZ) / 100


class Oracle:
    """One sample, one read, one write at a time."""

    def __init__(self) -> None:
        self.number = 0  # of the next sample
        self.interrupt_cfg = self.threshold = self.control3 = self.fifo_ctrl = self.rpds = 0
        self.fifo_en = self.stop_on_fth = False
        self.ref_p = 0
        self.autozero = self.autorifp = False
        self.ph = self.pl = False
        self.status = 0
        self.latest = bytes(5)
        self.registers = bytes(5)
        self.levels: list[bytes] = []
        self.behaviour = BYPASS
        self.last_read: bytes | None = None
        self.stopped = self.overrun = False
        self.level = 0
        self.edges: list[tuple[int, int]] = []

    def run_to(self, t_ps: int) -> None:
        while (due_ps := (self.number + 1) * PERIOD_PS) <= t_ps:
            self.sample(int(measured(np.array(self.number))), self.number + 1)
            self.number += 1
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
        if self.interrupt_cfg & 0x08:
            difference = counts - self.ref_p if self.autozero or self.autorifp else counts
            latched = bool(self.interrupt_cfg & 0x04)
            high = difference > 256 * self.threshold and bool(self.interrupt_cfg & 0x01)
            low = difference < -256 * self.threshold and bool(self.interrupt_cfg & 0x02)
            if self.interrupt_cfg & 0x03:
                self.ph, self.pl = high or (latched and self.ph), low or (latched and self.pl)
        self.behave()
        self.collect()

    def behave(self) -> None:
        modes = MODES[self.fifo_ctrl >> 5] if self.fifo_en else MODES[0]
        self.behaviour = modes[self.ph or self.pl]
        if self.behaviour != FIFO:
            self.stopped = False
        if self.behaviour == BYPASS:
            self.levels, self.last_read, self.overrun = [], None, False

    def collect(self) -> None:
        depth = (self.fifo_ctrl & 0x1F) + 1 if self.stop_on_fth else 32
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

    def look(self) -> None:
        if self.behaviour == BYPASS:
            self.registers = self.latest
        elif self.levels:
            self.registers = self.levels[0]

    def read_output(self, offset: int) -> int:
        self.look()
        value = self.registers[offset]
        if offset == 2:
            self.status &= 0x22
        if offset == 4:
            self.status &= 0x11
            if self.levels:
                self.last_read, self.overrun = self.levels.pop(0), False
        return value

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

    def written(self) -> None:
        if not self.interrupt_cfg & 0x04:
            on = self.interrupt_cfg & 0x08
            self.ph = self.ph and bool(on and self.interrupt_cfg & 0x01)
            self.pl = self.pl and bool(on and self.interrupt_cfg & 0x02)
        self.behave()

    def drive(self, t_ps: int) -> None:
        select, control = self.control3 & 0x03, self.control3
        signals = self.at_watermark() << 4 | self.overrun << 3 | (len(self.levels) == 32) << 5
        signals |= (self.status & 0x01) << 2
        active = (bool(control & signals & 0x3C), self.ph, self.pl, self.ph or self.pl)[select]
        level = int(active != bool(control & 0x80))
        if level != self.level:
            self.level = level
            self.edges.append((t_ps, level))


def collect_edges(chip: Chip, edges: list[tuple[int, int]]) -> None:
    (pin,) = chip.part.pins()
    pin.listen(lambda t_ps, level: edges.append((t_ps, level)))


class Lps22hbMachine(RuleBasedStateMachine):
    @initialize(
        fifo_ctrl=SETTINGS["fifo_ctrl"],
        control3=SETTINGS["control3"],
        interrupt_cfg=st.sampled_from((0x00, 0x8B, 0x8F)),
    )
    def power_up(self, fifo_ctrl: int, control3: int, interrupt_cfg: int) -> None:
        self.oracle = Oracle()
        self.chips = Chip("LPS22HB"), Chip("LPS22HB")
        self.edges: tuple[list[tuple[int, int]], ...] = ([], [])
        for chip, edges in zip(self.chips, self.edges, strict=True):
            chip.world.signals["pressure_hpa"] = pressure_hpa
            chip.world.signals["temperature_degc"] = temperature_degc
            collect_edges(chip, edges)
            chip.write(CTRL_REG1, 0x40)
        self.control2(0x50)
        self.fifo_ctrl(fifo_ctrl)
        self.control3(control3)
        self.interrupt_cfg(interrupt_cfg)

    def write(self, address: int, *values: int) -> None:
        for chip in self.chips:
            chip.write(address, *values)
        self.oracle.written()
        self.oracle.look()
        self.oracle.drive(self.chips[0].t_ps)

    def read(self, address: int, count: int) -> bytes:
        lazy, eager = (chip.read(address, count) for chip in self.chips)
        assert lazy == eager
        return lazy

    @rule(periods=st.one_of(st.integers(0, 3), st.integers(0, 45), st.floats(0, 3)))
    def time_passes(self, periods: float) -> None:
        lazy, eager = self.chips
        lazy.wait(int(periods * PERIOD_PS))
        while eager.part.next_event_ps() <= lazy.t_ps:
            eager.part.catch_up(eager.part.next_event_ps())
        eager.t_ps = lazy.t_ps
        eager.part.catch_up(eager.t_ps)
        self.oracle.run_to(lazy.t_ps)
        assert self.edges[1] == self.oracle.edges

    @rule(first=st.integers(0, 4), count=st.sampled_from((1, 2, 3, 5, 6, 20, 160)))
    def read_output(self, first: int, count: int) -> None:
        expected = []
        for offset in range(first, first + count):
            expected.append(self.oracle.read_output(offset % 5))
            self.oracle.drive(self.chips[0].t_ps)
        assert self.read(PRESS_OUT_XL + first, count) == bytes(expected)

    @rule()
    def read_int_source(self) -> None:
        assert self.read(INT_SOURCE, 1)[0] == self.oracle.read_int_source()
        self.oracle.drive(self.chips[0].t_ps)

    @rule()
    def read_states(self) -> None:
        assert self.read(FIFO_STATUS, 2) == bytes((self.oracle.fifo_status(), self.oracle.status))
        assert self.read(REF_P_XL, 3) == self.oracle.ref_p.to_bytes(3, "little")
        assert self.read(INTERRUPT_CFG, 1)[0] & 0xAF == self.oracle.interrupt_cfg

    @rule()
    def drain(self) -> None:
        self.read_output(0, 5 * max(len(self.oracle.levels), 1))

    @rule()
    def compare_edges(self) -> None:
        self.chips[0].part.catch_up(self.chips[0].t_ps)
        assert self.edges[0] == self.edges[1] == self.oracle.edges

    @rule(data=st.data())
    def reconfigure(self, data: st.DataObject) -> None:
        """One rule for all settings, so that more is done under each than setting others."""
        setting = data.draw(st.sampled_from(tuple(SETTINGS)))
        value = data.draw(SETTINGS[setting])
        getattr(self, setting)(value)

    def interrupt_cfg(self, value: int) -> None:
        oracle = self.oracle
        if value & 0x10:
            oracle.autozero, oracle.ref_p = False, 0
        if value & 0x40:
            oracle.autorifp = False
        oracle.interrupt_cfg = value & 0xAF
        self.write(INTERRUPT_CFG, value)

    def threshold(self, value: int) -> None:
        self.oracle.threshold = value
        self.write(THS_P_L, value, 0)

    def offset(self, value: int) -> None:
        self.oracle.rpds = value
        self.write(RPDS_L, value)

    def fifo_ctrl(self, value: int) -> None:
        self.oracle.fifo_ctrl = value
        self.write(FIFO_CTRL, value)

    def control2(self, value: int) -> None:
        self.oracle.fifo_en, self.oracle.stop_on_fth = bool(value & 0x40), bool(value & 0x20)
        self.write(CTRL_REG2, value)

    def control3(self, value: int) -> None:
        self.oracle.control3 = value
        self.write(CTRL_REG3, value)


Lps22hbMachine.TestCase.settings = settings(max_examples=150, stateful_step_count=50)
TestLps22hb = Lps22hbMachine.TestCase
