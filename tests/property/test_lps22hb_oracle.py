"""The LPS22HB under any use, compared with a slow and simple oracle.

The tests cover reference, interrupt, FIFO, pin, block data update, one-shot and reset. Two sensors receive the same
accesses: the first is evaluated only at accesses, the second catches up all the time. Both must do the same as the
oracle, with every edge of the pin at its time.
"""

from __future__ import annotations

import numpy as np
from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, rule

from tests.support.lps22hb_oracle import PERIOD_PS, RATE_HZ, Oracle
from tests.support.sensor_fakes import PS_PER_S, Array, Chip

INTERRUPT_CFG, THS_P_L, CTRL_REG1, CTRL_REG2, CTRL_REG3, FIFO_CTRL = 0x0B, 0x0C, 0x10, 0x11, 0x12, 0x14
REF_P_XL, RPDS_L, INT_SOURCE, FIFO_STATUS, STATUS, PRESS_OUT_XL = 0x15, 0x18, 0x25, 0x26, 0x27, 0x28

SETTINGS: dict[str, st.SearchStrategy[int]] = {
    "interrupt_cfg": st.one_of(st.integers(0, 0xFF), st.sampled_from((0x0B, 0x0F, 0x8F))),
    "threshold": st.integers(0, 40),
    "offset": st.integers(0, 100),
    "fifo_ctrl": st.builds(
        lambda mode, watermark: mode << 5 | watermark, st.integers(0, 7), st.sampled_from((0, 1, 2, 5, 31))
    ),
    "control1": st.sampled_from((0x40, 0x42, 0x42, 0x00)),
    # FIFO_EN, STOP_ON_FTH, IF_ADD_INC, ONE_SHOT
    "control2": st.sampled_from((0x50, 0x50, 0x70, 0x10, 0x40, 0x51, 0x11)),
    # push-pull: an open-drain pin has no rising edges
    "control3": st.sampled_from((0x00, 0x01, 0x02, 0x03, 0x04, 0x08, 0x10, 0x14, 0x20, 0x3C, 0x84, 0x90)),
}


def counts(sample: Array) -> Array:
    """Return the counts of the sample that comes ``sample`` periods after 0: 998 to 1002 hPa in steps of 1/16."""
    return 1000 * 4096 + (sample * 29 % 65 - 32) * 256


def pressure_hpa(t_s: Array) -> Array:
    return counts(np.rint(t_s * RATE_HZ)) / 4096


def temperature_degc(t_s: Array) -> Array:
    return np.rint(t_s * RATE_HZ) / 100


def measured(t_ps: int) -> tuple[int, int]:
    sample = np.rint(t_ps / PS_PER_S * RATE_HZ)
    return int(counts(sample)), int(sample)


def collect_edges(chip: Chip, edges: list[tuple[int, int]]) -> None:
    (pin,) = chip.part.pins()
    pin.observe(lambda t_ps, level: edges.append((t_ps, level)))


class Lps22hbMachine(RuleBasedStateMachine):
    @initialize(
        fifo_ctrl=SETTINGS["fifo_ctrl"],
        control3=SETTINGS["control3"],
        interrupt_cfg=st.sampled_from((0x00, 0x0B, 0x8B, 0x8F, 0xAB)),
    )
    def power_up(self, fifo_ctrl: int, control3: int, interrupt_cfg: int) -> None:
        self.oracle = Oracle(measured)
        self.chips = Chip("LPS22HB"), Chip("LPS22HB")
        self.edges: tuple[list[tuple[int, int]], ...] = ([], [])
        for chip, edges in zip(self.chips, self.edges, strict=True):
            chip.world.signals["pressure_hpa"] = pressure_hpa
            chip.world.signals["temperature_degc"] = temperature_degc
            collect_edges(chip, edges)
        self.control1(0x40)
        self.control2(0x50)
        self.fifo_ctrl(fifo_ctrl)
        self.control3(control3)
        self.interrupt_cfg(interrupt_cfg)

    @property
    def t_ps(self) -> int:
        return self.chips[0].t_ps

    def write(self, address: int, *values: int) -> None:
        for chip in self.chips:
            chip.write(address, *values)
        self.oracle.written(self.t_ps)

    def read(self, address: int, count: int = 1) -> bytes:
        lazy, eager = (chip.read(address, count) for chip in self.chips)
        assert lazy == eager
        return lazy

    # -- time and reading -------------------------------------------------------------------------------

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

    @rule(offset=st.integers(0, 4), count=st.sampled_from((1, 2, 3, 5, 6, 20, 160)))
    def read_output(self, offset: int, count: int) -> None:
        first, expected = offset, []
        for _ in range(count):
            expected.append(self.oracle.read_output(offset))
            self.oracle.drive(self.t_ps)
            offset = self.oracle.following(offset)
        assert self.read(PRESS_OUT_XL + first, count) == bytes(expected)

    @rule()
    def drain(self) -> None:
        self.read_output(0, 5 * max(len(self.oracle.levels), 1))

    @rule(times=st.integers(1, 2))
    def read_int_source(self, times: int) -> None:
        for _ in range(times):
            assert self.read(INT_SOURCE)[0] == self.oracle.read_int_source()
            self.oracle.drive(self.t_ps)

    @rule()
    def read_states(self) -> None:
        assert self.read(FIFO_STATUS)[0] == self.oracle.fifo_status()
        assert self.read(STATUS)[0] == self.oracle.status
        ref_p = bytes(self.read(address)[0] for address in range(REF_P_XL, REF_P_XL + 3))
        assert ref_p == self.oracle.ref_p.to_bytes(3, "little")
        assert self.read(INTERRUPT_CFG)[0] & 0xAF == self.oracle.interrupt_cfg
        assert self.read(CTRL_REG2)[0] & 0x71 == self.oracle.control2, "ONE_SHOT ends by itself"

    @rule()
    def compare_edges(self) -> None:
        self.chips[0].part.catch_up(self.t_ps)
        assert self.edges[0] == self.edges[1] == self.oracle.edges

    # -- writing ----------------------------------------------------------------------------------------

    @rule(data=st.data())
    def reconfigure(self, data: st.DataObject) -> None:
        """Use one rule for all settings, so that most steps are not settings."""
        for setting in data.draw(st.lists(st.sampled_from(tuple(SETTINGS)), min_size=1, max_size=4)):
            getattr(self, setting)(data.draw(SETTINGS[setting]))

    @rule(offset=st.integers(0, 1))
    def begin_reading_under_bdu(self, offset: int) -> None:
        """Datasheet 9.5: no output changes until PRESS_OUT_H has been read."""
        self.control1(0x42)
        self.read_output(offset, 1)

    @rule(rarely=st.integers(0, 4), then=st.sampled_from((0x50, 0x51, 0x71)), periods=st.floats(0, 1))
    def one_shot(self, rarely: int, then: int, periods: float) -> None:
        """Datasheet 9.6. ``then`` is written during the conversion, or after its end."""
        if rarely == 0:
            self.control1(0x00)
            self.control2(0x51)
            self.time_passes(periods)
            self.control2(then)
            self.read_states()
            self.control1(0x40)

    @rule(rarely=st.integers(0, 9))
    def swreset(self, rarely: int) -> None:
        """Datasheet 9.6. The rate is set again, because otherwise there are no samples."""
        if rarely == 0:
            self.oracle.swreset()
            self.write(CTRL_REG2, 0x14)
            self.control1(0x40)

    def interrupt_cfg(self, value: int) -> None:
        self.oracle.write_interrupt_cfg(value)
        self.write(INTERRUPT_CFG, value)

    def threshold(self, value: int) -> None:
        self.oracle.threshold = value
        self.write(THS_P_L, value)

    def offset(self, value: int) -> None:
        self.oracle.rpds = value
        self.write(RPDS_L, value)

    def fifo_ctrl(self, value: int) -> None:
        self.oracle.fifo_ctrl = value
        self.write(FIFO_CTRL, value)

    def control1(self, value: int) -> None:
        self.oracle.write_control1(value, self.t_ps)
        self.write(CTRL_REG1, value)

    def control2(self, value: int) -> None:
        self.oracle.write_control2(value, self.t_ps)
        self.write(CTRL_REG2, value)

    def control3(self, value: int) -> None:
        self.oracle.control3 = value
        self.write(CTRL_REG3, value)


Lps22hbMachine.TestCase.settings = settings(max_examples=300, stateful_step_count=50)
TestLps22hb = Lps22hbMachine.TestCase
