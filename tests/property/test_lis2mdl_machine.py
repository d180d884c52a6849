"""The whole LIS2MDL agrees with a slow and simple oracle that takes every sample at its time.

The oracle has the rules (datasheet DocID030621 Rev 3; AN5069 Rev 2; otherwise the decisions at the top of the model's
files) and computes with integer counts, one sample at a time, in plain Python. Two sensors are compared with the
oracle. The first is evaluated only when the test reads it; the second is evaluated at every event, as on a board with a
connected pin. All three must agree in every byte and every edge.
"""

from __future__ import annotations

import numpy as np
from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, rule

from fcu_emulator.sensors.lis2mdl import LIS2MDLErrors
from tests.support.sensor_fakes import PS_PER_MS, PS_PER_US, Array, Chip

A, B, C, CONTROL, SOURCE, THRESHOLD, STATUS, OUT, OFFSET = (
    0x60,
    0x61,
    0x62,
    0x63,
    0x64,
    0x65,
    0x67,
    0x68,
    0x45,
)
CELL_PS = 3_777_777_777  # the field changes every 3.8 ms
HOFF = (40, -60, 50)  # counts
SELF_TEST = 100  # counts: 150 mgauss
PERIOD_MS = {0: 100, 1: 50, 2: 20, 3: 10}
ALL_READY = 0x0F


def field_counts(t_ps: int, axis: int) -> int:
    """Return small counts in most cells, large counts in some, and sometimes counts beyond the range.

    All are even, so that means are integers.
    """
    cell = t_ps // CELL_PS
    count = 2 * ((cell * 7919 + axis * 3571) % 41 - 20)
    return {0: 10, 7: 1000}.get((cell + 5 * axis) % 31, 1) * count


def field_mgauss(t_s: Array) -> Array:
    """Return the same field as a signal."""
    times = np.rint(t_s * 1e12).astype(np.int64)
    return 1.5 * np.array([[field_counts(int(t_ps), axis) for axis in range(3)] for t_ps in times])


def cut(count: int) -> int:
    """Return the counts saturated at 16 bits."""
    return max(-32768, min(32767, count))


class Oracle:
    """The oracle of the sensor, one sample at a time."""

    def __init__(self) -> None:
        self.now_ps = 0
        self.polarity = 1
        self.booted_ps = self.reset_until_ps = self.boot_until_ps = 0
        self.edges: list[tuple[int, int]] = []
        self.pin: int | None = None
        self.clear()

    def clear(self) -> None:
        self.register = {A: 0x03, B: 0, C: 0, CONTROL: 0xE0, **dict.fromkeys((0x65, 0x66), 0)}
        self.register |= dict.fromkeys(range(OFFSET, OFFSET + 6), 0)
        self.status = self.source = 0
        self.output = (0, 0, 0)
        self.mode = "idle"
        self.due_ps: int | None = None
        self.taken = 0  # samples since idle was left

    # -- time ---------------------------------------------------------------------------------------

    def run_to(self, t_ps: int) -> None:
        while self.due_ps is not None and self.due_ps <= t_ps:
            self.now_ps = self.due_ps
            self.sample()
        self.now_ps = t_ps

    def sample(self) -> None:
        averaging = self.mode == "continuous" and bool(self.register[B] & 0x03)
        cancelling = bool(self.register[B] & 0x02)
        alternating = cancelling and (self.mode == "continuous" or bool(self.register[B] & 0x10))
        before = self.polarity
        if alternating:
            self.polarity = -self.polarity
        elif self.taken == 0 or (not self.register[B] & 0x04 and self.taken % 63 == 0):
            self.polarity = 1
        values = [self.measured(self.now_ps, axis, self.polarity) for axis in range(3)]
        if averaging and (self.taken or alternating):
            earlier_ps = self.now_ps - self.period_ps()
            earlier = [self.measured(earlier_ps, axis, before) for axis in range(3)]
            values = [(value + old) // 2 for value, old in zip(values, earlier, strict=True)]
        self.output = tuple(cut(cut(value) - self.offset(axis)) for axis, value in enumerate(values))
        self.status |= (self.status & ALL_READY) << 4 | ALL_READY
        if self.register[CONTROL] & 0x01:
            self.compare(values)
        self.taken += 1
        if self.mode == "continuous":
            self.due_ps = self.now_ps + self.period_ps()
        else:
            self.mode, self.due_ps = "idle", None
            self.register[A] |= 0x03
        self.show()

    def measured(self, t_ps: int, axis: int, polarity: int) -> int:
        return field_counts(t_ps, axis) + polarity * HOFF[axis] + (self.register[C] >> 1 & 1) * SELF_TEST

    def offset(self, axis: int) -> int:
        low, high = self.register[OFFSET + 2 * axis], self.register[OFFSET + 2 * axis + 1]
        return int.from_bytes((low, high), "little", signed=True)

    def period_ps(self) -> int:
        return PERIOD_MS[self.register[A] >> 2 & 3] * PS_PER_MS

    def compare(self, values: list[int]) -> None:
        threshold = self.register[0x66] << 8 | self.register[0x65]
        found = 0x02 if any(value != cut(value) for value in values) else 0
        for axis, value in enumerate(values):
            compared = self.output[axis] if self.register[B] & 0x08 else cut(value)
            if self.register[CONTROL] & 0x80 >> axis:
                found |= (0x80 >> axis) * (compared > threshold) | (0x10 >> axis) * (compared < -threshold)
        kept = self.source if self.register[CONTROL] & 0x02 else self.source & 0x02
        self.source = kept | found

    # -- bus ----------------------------------------------------------------------------------------

    def write(self, address: int, value: int) -> None:
        rate = self.register[A] & 0x0C
        if address == A:
            if value & 0x20:
                self.clear()
                self.reset_until_ps = self.now_ps + 5 * PS_PER_US
                value = 0x03 | value & 0x40
            if value & 0x40 and self.now_ps >= self.boot_until_ps:
                self.register[A] = value & 0x9F | 0x03
                self.booted_ps = self.boot_until_ps = self.now_ps + 20 * PS_PER_MS
                self.mode, self.taken, self.due_ps = "boot", 0, self.booted_ps
            else:
                self.register[A] = value & 0x9F
                self.change_mode(rate)
        else:
            self.register[address] = value
        if not self.register[CONTROL] & 0x01:
            self.source = 0
        self.show()

    def change_mode(self, old_rate: int) -> None:
        wanted = {0: "continuous", 1: "single"}.get(self.register[A] & 0x03, "idle")
        if wanted == "idle":
            if self.mode != "boot":
                self.mode, self.due_ps = "idle", None
        elif wanted != self.mode or (wanted == "continuous" and self.register[A] & 0x0C != old_rate):
            self.mode, self.taken = wanted, 0
            turn_on_us = 6400 if self.register[A] & 0x10 else 9400
            turn_on_ps = turn_on_us * PS_PER_US + (self.period_ps() if self.register[B] & 0x02 else 0)
            self.due_ps = max(self.now_ps, self.booted_ps) + turn_on_ps

    def read(self, address: int) -> int:
        if address == A:
            resetting = 0x20 * (self.now_ps < self.reset_until_ps)
            return self.register[A] | resetting | 0x40 * (self.now_ps < self.boot_until_ps)
        if address == SOURCE:
            shown = self.source | self.interrupt() if self.register[CONTROL] & 0x01 else 0
            self.source &= 0x00 if self.register[CONTROL] & 0x02 else 0xFC
            self.show()
            return shown
        if address == STATUS:
            return self.status
        axis, half = divmod(address - OUT, 2)
        if half:
            self.status &= ~(0x88 | 0x11 << axis)
            self.show()
        return self.output[axis].to_bytes(2, "little", signed=True)[half]

    # -- pin ----------------------------------------------------------------------------------------

    def interrupt(self) -> int:
        active = self.register[CONTROL] >> 2 & 1
        return active if self.source & 0xFC else 1 - active

    def show(self) -> None:
        level: int | None = None
        if not self.register[C] & 0x04:
            if self.register[C] & 0x40:
                level = self.interrupt()
            elif self.register[C] & 0x01:
                level = self.status >> 3 & 1
        if level != self.pin and level is not None:
            self.edges.append((self.now_ps, level))
        self.pin = level


class Watched:
    """A sensor with a connected pin."""

    def __init__(self) -> None:
        self.chip = Chip("LIS2MDL", LIS2MDLErrors(set_reset_offset_mgauss=(60.0, -90.0, 75.0)))
        self.chip.world.signals["magnetic_field_mgauss"] = field_mgauss
        self.edges: list[tuple[int, int]] = []
        self.chip.part.pins()[0].observe(lambda at_ps, level: self.edges.append((at_ps, level)))


CONFIG_A = [0x8C, 0x88, 0x9C, 0x84, 0x81, 0x91, 0x8D, 0x83, 0x82, 0x0C]
WRITES = st.one_of(
    st.tuples(st.just(A), st.sampled_from(CONFIG_A)),
    st.tuples(st.just(A), st.sampled_from((0x8C, 0x8C, 0xC3, 0xCC, 0x20, 0x63, 0xC1))),
    st.tuples(st.just(B), st.integers(0, 0x1F)),
    st.tuples(st.just(C), st.sampled_from((0x40, 0x01, 0x41, 0x42, 0x43, 0x02, 0x00, 0x44))),
    st.tuples(st.just(CONTROL), st.sampled_from((0xE5, 0xE1, 0xE7, 0xE3, 0xA7, 0x45, 0x21, 0xE0, 0xE4))),
    st.tuples(st.just(THRESHOLD), st.sampled_from((0, 100, 255))),
    st.tuples(st.just(THRESHOLD + 1), st.sampled_from((0, 1, 0x7F, 0x80, 0xFF))),
    st.tuples(st.integers(OFFSET, OFFSET + 5), st.integers(0, 255)),
)
WAITS = st.one_of(
    st.integers(0, 40 * PS_PER_MS),
    st.sampled_from((1, 2 * PS_PER_US, 10 * PS_PER_MS, 9400 * PS_PER_US, 20 * PS_PER_MS, 3000 * PS_PER_MS)),
)


class Lis2mdlMachine(RuleBasedStateMachine):
    @initialize(control=st.sampled_from((0xE7, 0xE5, 0xE3, 0xE0)), pin=st.sampled_from((0x40, 0x01, 0x00)))
    def power_up(self, control: int, pin: int) -> None:
        self.oracle, self.lazy, self.eager = Oracle(), Watched(), Watched()
        for write in ((THRESHOLD, 200), (CONTROL, control), (C, pin), (A, 0x8C)):
            self.write(write)

    @rule(wait_ps=WAITS)
    def time_passes(self, wait_ps: int) -> None:
        until_ps = self.oracle.now_ps + wait_ps
        self.oracle.run_to(until_ps)
        part = self.eager.chip.part
        while (due_ps := part.next_event_ps()) <= until_ps:
            part.catch_up(due_ps)
        part.catch_up(until_ps)
        self.lazy.chip.t_ps = self.eager.chip.t_ps = until_ps
        assert self.eager.edges == self.oracle.edges

    @rule(write=WRITES)
    def write(self, write: tuple[int, int]) -> None:
        address, value = write
        self.oracle.write(address, value)
        for watched in (self.lazy, self.eager):
            watched.chip.write(address, value)

    @rule(address=st.sampled_from((A, SOURCE, STATUS, *range(OUT, OUT + 6))))
    def read(self, address: int) -> None:
        expected = self.oracle.read(address)
        assert self.lazy.chip.byte(address) == expected
        assert self.eager.chip.byte(address) == expected

    @rule()
    def read_output(self) -> None:
        expected = bytes(self.oracle.read(address) for address in range(OUT, OUT + 6))
        assert self.lazy.chip.read(OUT, 6) == expected
        assert self.eager.chip.read(OUT, 6) == expected

    def teardown(self) -> None:
        self.lazy.chip.part.catch_up(self.lazy.chip.t_ps)
        assert self.lazy.edges == self.eager.edges == self.oracle.edges
        assert self.lazy.chip.part.pins()[0].level == self.oracle.pin


Lis2mdlMachine.TestCase.settings = settings(max_examples=150, stateful_step_count=40, deadline=None)
TestLis2mdl = Lis2mdlMachine.TestCase
