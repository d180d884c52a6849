"""A master that keeps bytes sees the same and leaves the same state as a master that reads the sensor each time."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeAlias

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fcu_emulator.emulator.assembly.snapshot import Snapshot
from fcu_emulator.sensors import LIS2MDL, LPS22HB, LSM6DSL
from fcu_emulator.sensors.errors import Quality
from fcu_emulator.sensors.lis2mdl import LIS2MDLErrors
from fcu_emulator.sensors.lps22hb import LPS22HBErrors
from fcu_emulator.sensors.lsm6dsl import LSM6DSLErrors
from fcu_emulator.sensors.part import Sensor
from fcu_emulator.sensors.sampling import PS_PER_S, Times
from fcu_emulator.sensors.shared_registers import LIVE, MEMORY, STATUS, Bank
from tests.support.keeping_masters import BurstKeeper, LiveBursts, LiveBytes, Master, TrainReader

GRADE: Quality = "typical"
SENSORS = ("LSM6DSL", "LIS2MDL", "LPS22HB")
SWITCHED_ON = {
    "LSM6DSL": ((0x12, 0x04), (0x10, 0x50), (0x11, 0x40)),  # IF_INC, 208 Hz, 104 Hz
    "LIS2MDL": ((0x60, 0x8C),),  # 100 Hz
    "LPS22HB": ((0x11, 0x10), (0x10, 0x50)),  # IF_ADD_INC, 75 Hz
}
STARTS = {  # what is set up beside that: nothing, or words held back while they are read
    "LSM6DSL": ((), ((0x12, 0x44),), ((0x12, 0x64),)),
    "LIS2MDL": ((), ((0x62, 0x10),), ((0x62, 0x18),)),
    "LPS22HB": ((), ((0x10, 0x52),)),
}
FORMATS = {  # registers and values that change how output is read
    "LSM6DSL": (
        *((0x12, value) for value in (0x44, 0x24, 0x64, 0x04, 0x40, 0x05, 0x84)),  # CTRL3_C
        *((0x14, value) for value in (0x20, 0x60, 0xE0, 0x00)),  # CTRL5_C.ROUNDING
        *((0x13, value) for value in (0x00, 0x08, 0x40, 0x04)),  # CTRL4_C: DRDY_MASK, sleep, I2C_disable
        *((0x0A, value) for value in (0x00, 0x26, 0x21)),  # FIFO
        *((0x15, value) for value in (0x00, 0x40, 0x60, 0x80, 0x10)),  # CTRL6_C: data enable, low power
        *((0x58, value) for value in (0x00, 0xE0)),  # TAP_CFG: inactivity
        *((0x0D, value) for value in (0x00, 0x03)),  # INT1_CTRL
        *((0x01, value) for value in (0x00, 0x80, 0xA0)),  # the embedded banks
        (0x5C, 0x00),
        (0x08, 0x09),
        (0x10, 0xA0),
        (0x11, 0x00),
    ),
    "LIS2MDL": (
        *((0x62, value) for value in (0x10, 0x08, 0x18, 0x01, 0x20, 0x00)),  # CFG_REG_C
        *((0x60, value) for value in (0x8D, 0x01, 0x83, 0xAC, 0xCC, 0x80)),  # CFG_REG_A
        *((0x63, value) for value in (0xE3, 0x00)),
        (0x61, 0x02),
    ),
    "LPS22HB": (
        *((0x10, value) for value in (0x52, 0x50, 0x3A, 0x00)),  # CTRL_REG1
        *((0x11, value) for value in (0x50, 0x10, 0x11, 0x00, 0x14, 0x94)),  # CTRL_REG2
        *((0x14, value) for value in (0x00, 0x20, 0x45, 0x62)),  # FIFO_CTRL
        *((0x0B, value) for value in (0x20, 0x80, 0x40, 0x0F, 0x00)),  # INTERRUPT_CFG
        *((0x12, value) for value in (0x00, 0x04, 0x08)),  # CTRL_REG3
    ),
}
OUTPUT = {"LSM6DSL": range(0x1E, 0x30), "LIS2MDL": range(0x66, 0x70), "LPS22HB": range(0x26, 0x2D)}
USUAL = {
    "LSM6DSL": ((0x28, 6), (0x22, 6), (0x22, 12), (0x20, 14), (0x10, 1), (0x0F, 1), (0x1E, 1)),
    "LIS2MDL": ((0x68, 6), (0x6E, 2), (0x62, 1), (0x67, 1), (0x4F, 1)),
    "LPS22HB": ((0x28, 3), (0x2B, 2), (0x28, 5), (0x10, 2), (0x27, 1), (0x27, 6)),
}

_PAUSE_PS = 125 * 10**6 + 1  # up to 32 ms

Action: TypeAlias = tuple[str, int, int]
"""read: address, count; write: address, value; pass: pauses, 0; pin, world, save, restore: level, 0."""


def actions(part: str) -> st.SearchStrategy[list[Action]]:
    """Return a strategy for actions: mostly reads and pauses of about a sample, so that bytes can be kept."""
    write = st.one_of(st.sampled_from(FORMATS[part]), st.sampled_from(SWITCHED_ON[part]))
    kinds: dict[str, st.SearchStrategy[Action]] = {
        "usual": st.sampled_from(USUAL[part]).map(lambda read: ("read", *read)),
        "output": st.tuples(st.just("read"), st.sampled_from(OUTPUT[part]), st.integers(1, 8)),
        "byte": st.tuples(st.just("read"), st.sampled_from(OUTPUT[part]), st.just(1)),
        "anywhere": st.tuples(st.just("read"), st.integers(0, 0x7F), st.integers(1, 20)),
        "pass": st.tuples(st.just("pass"), st.integers(0, 255), st.just(0)),
        "write": write.map(lambda write: ("write", *write)),
        "outside": st.tuples(
            st.sampled_from(("pin", "world", "world", "save", "restore")), st.integers(0, 1), st.just(0)
        ),
    }
    weighted = (
        ["usual"] * 8
        + ["output", "byte"] * 4
        + ["anywhere"]
        + ["pass"] * 6
        + ["write", "write", "outside", "outside"]
    )
    traffic = st.lists(st.sampled_from(weighted).flatmap(kinds.__getitem__), min_size=30, max_size=60)
    starts = st.sampled_from(STARTS[part]).map(lambda writes: [("write", *write) for write in writes])
    return st.tuples(starts, traffic).map(lambda both: [*both[0], *both[1]])


class Bench:
    """Two copies of a sensor in one world, each with its master, and the data that both have read."""

    def __init__(
        self, name: str, live: Callable[[Sensor], Master], keeper: Callable[[Sensor], Master]
    ) -> None:
        self.now_ps = PS_PER_S // 10
        self._slope = 1.0
        self._since_s = 0.0
        self.masters = live(self._make(name)), keeper(self._make(name))
        self._saved: tuple[int, float, list[Snapshot]] | None = None
        self.noted: tuple[list[str], list[str]] = ([], [])
        for master, noted in zip(self.masters, self.noted, strict=True):
            master.part.observe(
                lambda _, what, problem, text, noted=noted, **_data: noted.append(f"{what}: {text}"), None
            )
            for address, value in SWITCHED_ON[name]:
                master.write(address, bytes((value,)), self.now_ps)

    def _make(self, name: str) -> Sensor:
        if name == "LSM6DSL":
            lsm_errors = LSM6DSLErrors.of_quality(GRADE, 1)
            return LSM6DSL(self._vector, self._vector, self._scalar, lsm_errors, 1)
        if name == "LIS2MDL":
            return LIS2MDL(self._vector, self._scalar, LIS2MDLErrors.of_quality(GRADE, 1), 1)
        return LPS22HB(
            lambda t_s: 900 + self._scalar(t_s), self._scalar, LPS22HBErrors.of_quality(GRADE, 1), 1
        )

    def _scalar(self, t_s: Times) -> Times:
        return 20 + self._slope * np.sin(40 * t_s) * (t_s >= self._since_s)

    def _vector(self, t_s: Times) -> Times:
        return np.stack([self._scalar(t_s) / 20, np.cos(30 * t_s), 0.2 * np.sin(70 * t_s)], axis=1)

    def both_do(self, action: Action) -> None:
        """Do an action on both copies, and compare the results."""
        what, number, other = action
        if what == "pass":
            self.now_ps += number * _PAUSE_PS
        elif what == "world":
            self._slope = -self._slope
            for master in self.masters:
                master.part.world_changed(self.now_ps)
        elif what == "save":
            snapshots = [Snapshot(master) for master in self.masters]
            self._saved = self.now_ps, self._slope, snapshots
        elif what == "restore" and self._saved is not None:
            self.now_ps, self._slope, snapshots = self._saved
            for master, snapshot in zip(self.masters, snapshots, strict=True):
                snapshot.restore(master)
        elif what == "read":
            answers = [master.read(number, other, self.now_ps).hex() for master in self.masters]
            assert answers[0] == answers[1], action
            self.now_ps += 30 * 10**7
        elif what in {"write", "pin"}:
            for master in self.masters:
                self._change(master, what, number, other)
            self.now_ps += 10**8

    def _change(self, master: Master, what: str, number: int, other: int) -> None:
        if what == "write":
            master.write(number, bytes((other,)), self.now_ps)
        elif isinstance(master.part, LSM6DSL):
            master.part.int2.apply(number, self.now_ps)

    def compare(self) -> None:
        """Compare the state of both copies: every register, held words, pins, notes."""
        parts = [master.part for master in self.masters]
        assert parts[0].registers.held[0] == parts[1].registers.held[0]
        assert [pin.level for pin in parts[0].pins()] == [pin.level for pin in parts[1].pins()]
        for address in range(128):
            answers = [part.read(address, 1, self.now_ps) for part in parts]
            assert answers[0] == answers[1], f"0x{address:02X}"
        assert [pin.level for pin in parts[0].pins()] == [pin.level for pin in parts[1].pins()]
        assert self.noted[0] == self.noted[1]


@pytest.mark.parametrize("name", SENSORS)
@settings(max_examples=60, deadline=None)
@given(st.data())
def test_kept_bytes_equal_reads_of_sensor(name: str, data: st.DataObject) -> None:
    bench = Bench(name, LiveBytes, TrainReader)
    for action in data.draw(actions(name)):
        bench.both_do(action)
    bench.compare()


@pytest.mark.parametrize("name", SENSORS)
@settings(max_examples=60, deadline=None)
@given(st.data())
def test_kept_bursts_equal_reads_of_sensor(name: str, data: st.DataObject) -> None:
    bench = Bench(name, LiveBursts, BurstKeeper)
    for action in data.draw(actions(name)):
        bench.both_do(action)
    bench.compare()


def measuring(*writes: tuple[int, int]) -> LSM6DSL:
    """Return an accelerometer at 208 Hz with an unread sample, at ``_AT_PS``."""
    part = LSM6DSL(lambda t_s: np.ones((len(t_s), 3)), lambda t_s: np.zeros((len(t_s), 3)), np.ones_like)
    for address, value in ((0x12, 0x04), (0x10, 0x50), *writes):
        part.write(address, bytes((value,)), 0)
    return part


_AT_PS = PS_PER_S // 100


def access(part: Sensor, address: int) -> int:
    return Bank.from_address(part.shared_bank()).access[address]


def test_train_of_bytes_equals_single_reads() -> None:
    part, other = measuring(), measuring()
    reader, live = TrainReader(part), LiveBytes(other)
    for n in range(500):
        now_ps = _AT_PS + n * 3 * PS_PER_S // 1000
        assert reader.read(0x1E, 16, now_ps) == live.read(0x1E, 16, now_ps)
    assert reader.served == 500 * 15  # 0x1F is reserved


def test_change_of_world_ends_train_of_bytes() -> None:
    level = 1.0
    part = LSM6DSL(
        lambda t_s: np.full((len(t_s), 3), level), lambda t_s: np.zeros((len(t_s), 3)), np.ones_like
    )
    for address, value in ((0x12, 0x04), (0x10, 0x50)):
        part.write(address, bytes((value,)), 0)
    reader = TrainReader(part)
    before = [reader.read(0x28, 6, _AT_PS * n) for n in range(1, 30)]
    level = -1.0
    part.world_changed(30 * _AT_PS)
    after = [reader.read(0x28, 6, _AT_PS * n) for n in range(40, 50)]
    assert before[-1] not in after
    assert len(set(after)) == 1


@pytest.mark.parametrize("address", [0x12, 0x3A, 0x3E, 0x40, 0x53, 0x1B, 0x2E], ids=hex)
def test_self_changing_register_is_read_from_sensor(address: int) -> None:
    part = measuring()
    assert access(part, address) == LIVE
    assert part.burst_reader(address, 1)(_AT_PS)[1] == 0


def test_masked_status_is_read_from_sensor() -> None:
    part = measuring()
    assert access(part, 0x1E) == STATUS
    part.write(0x13, b"\x08", _AT_PS)
    assert access(part, 0x1E) == LIVE
    part.write(0x13, b"\x00", _AT_PS)
    assert access(part, 0x1E) == STATUS


def test_wired_sensor_has_no_kept_bytes() -> None:
    part = measuring()
    assert access(part, 0x10) == MEMORY
    version = part.version[0]
    part.watch(lambda: None)
    assert (part.shared_bank(), part.burst_reader(0x28, 6)(_AT_PS)[1]) == (0, 0)
    assert part.version[0] != version


def test_bank_change_updates_version_of_sensor() -> None:
    part = measuring()
    assert access(part, 0x02) == LIVE
    version, address = part.version[0], part.version.buffer_info()[0]
    part.write(0x01, b"\x80", _AT_PS)
    assert part.version[0] != version
    version = part.version[0]
    part.write(0x02, b"\x3d", _AT_PS)
    assert part.version[0] != version
    assert part.version.buffer_info()[0] == address
    assert TrainReader(part).read(0x02, 1, _AT_PS) == b"\x3d"
    assert access(part, 0x02) == MEMORY
