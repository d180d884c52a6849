"""Snapshots: a restored board continues as if it had never run further."""

from __future__ import annotations

import functools
import re
import types
from collections import deque
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TypeAlias

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fcu_emulator import Board, emulator, sensors
from fcu_emulator.emulator.assembly.snapshot import Snapshot
from fcu_emulator.emulator.buses.i2c import I2CFault
from fcu_emulator.emulator.clock import PS_PER_MS
from fcu_emulator.emulator.errors import I2CError, InputError
from fcu_emulator.emulator.trace import GpioEdge, TraceEvent

LSM6DSL, LIS2MDL, LPS22HB = 0x6B, 0x1E, 0x5D
SWITCHED_ON = (
    *((LSM6DSL, register, value) for register, value in ((0x12, 0x44), (0x10, 0x74), (0x11, 0x60))),
    (LIS2MDL, 0x60, 0x8C),
    *((LPS22HB, register, value) for register, value in ((0x11, 0x10), (0x10, 0x52))),
)
FUNCTIONS = (  # FIFO, events, embedded functions, timestamp, pins, one shot, reset, interrupts
    *((LSM6DSL, register, value) for register, value in ((0x06, 0x20), (0x08, 0x09), (0x0A, 0x26))),
    *((LSM6DSL, register, value) for register, value in ((0x58, 0x8E), (0x5B, 0x10), (0x5E, 0x20))),
    *((LSM6DSL, register, value) for register, value in ((0x19, 0x3C), (0x0D, 0x03), (0x12, 0x05))),
    *((LSM6DSL, register, value) for register, value in ((0x17, 0xE0), (0x15, 0x60), (0x01, 0x80))),
    *((LIS2MDL, register, value) for register, value in ((0x62, 0x01), (0x63, 0xE3), (0x60, 0x81))),
    *((LPS22HB, register, value) for register, value in ((0x14, 0x45), (0x11, 0x54), (0x0B, 0x20))),
    *((LPS22HB, register, value) for register, value in ((0x12, 0x04), (0x11, 0x94), (0x10, 0x3A))),
)
READS = (
    *(
        (LSM6DSL, register, count)
        for register, count in ((0x28, 6), (0x22, 12), (0x1E, 1), (0x3A, 6), (0x2A, 1))
    ),
    *((LIS2MDL, register, count) for register, count in ((0x68, 6), (0x67, 1), (0x69, 1), (0x64, 1))),
    *((LPS22HB, register, count) for register, count in ((0x28, 3), (0x26, 7), (0x28, 1), (0x25, 1))),
)
Act: TypeAlias = tuple[str, tuple[int, ...]]

_acts = st.one_of(
    st.sampled_from(READS).map(lambda read: ("read", read)),
    st.sampled_from(READS).map(lambda read: ("read", read)),
    st.sampled_from(SWITCHED_ON + FUNCTIONS).map(lambda write: ("write", write)),
    st.integers(0, 400).map(lambda tenths: ("pass", (tenths,))),
    st.integers(0, 400).map(lambda tenths: ("pass", (tenths,))),
    st.tuples(*(st.integers(-80, 80),) * 3).map(lambda angles: ("turn", angles)),
    st.tuples(*(st.integers(-80, 80),) * 3).map(lambda angles: ("turn slowly", angles)),
    st.integers(0, 2).map(lambda part: ("wire", (part,))),
    st.integers(0, 1).map(lambda level: ("INT2", (level,))),
    st.integers(1, 30).map(lambda count: ("type", (count,))),
    st.integers(0, 3).map(lambda kind: ("break", (kind,))),
)
acts = st.lists(_acts, max_size=25)


class ActionRecorder:
    """Recorder that performs actions on a board and stores their visible results."""

    def __init__(self, board: Board) -> None:
        self.board = board
        board.trace.record_all()
        for address, register, value in SWITCHED_ON:
            board.i2c2.write(address, bytes((register, value)))

    def do(self, some: list[Act]) -> list[object]:
        first = len(self.board.trace)
        seen: list[object] = [self._do(what, numbers) for what, numbers in some]
        return [*seen, *list(self.board.trace)[first:], *picture(self.board)]

    def _do(self, what: str, numbers: tuple[int, ...]) -> object:
        board = self.board
        try:
            if what == "read":
                address, register, count = numbers
                return board.i2c2.write_read(address, bytes((register,)), count)
            if what == "write":
                board.i2c2.write(numbers[0], bytes(numbers[1:]))
        except I2CError as error:
            return str(error)
        if what == "pass":
            board.run_for(numbers[0] / 10_000)
        elif what == "turn":
            board.world.set_attitude(*numbers)
        elif what == "turn slowly":
            board.world.rotate_to(*numbers, duration_s=0.02)
        elif what == "wire":
            board.sensors.parts[numbers[0]].pins()[0].observe(lambda _at_ps, _level: None)
        elif what == "INT2":
            board.sensors.lsm6dsl.int2.apply(numbers[0], board.clock.now_ps)
        elif what == "type":
            board.terminal.write(b"x" * numbers[0])
        elif what == "break":
            self._break(numbers[0])
        return None

    def _break(self, kind: int) -> None:
        now_ps = self.board.clock.now_ps
        until_ps = now_ps + 5 * PS_PER_MS
        if kind == 0:
            self.board.i2c2.inject(I2CFault.in_ps("nack", now_ps, until_ps, address=LSM6DSL, byte_index=1))
        elif kind == 1:
            self.board.i2c2.inject(I2CFault.in_ps("stuck", now_ps, until_ps))


def picture(board: Board) -> list[object]:
    """Return the state of a board that can be read without a change."""
    return [
        board.clock.now_ps,
        board.clock.next_ps,
        board.terminal.text,
        board.terminal.read(),
        *(bytes(file.mem) for part in board.sensors.parts for file in part.files()),
        *(pin.level for part in board.sensors.parts for pin in part.pins()),
        board.led1.on,
        board.led2.on,
    ]


@settings(max_examples=60, deadline=None)
@given(acts, acts, acts)
def test_restored_board_repeats_its_run(before: list[Act], away: list[Act], after: list[Act]) -> None:
    plain, put_back = ActionRecorder(Board(seed=3)), ActionRecorder(Board(seed=3))
    assert plain.do(before) == put_back.do(before)
    snapshot = put_back.board.snapshot()
    put_back.do(away)
    put_back.board.restore(snapshot)
    put_back.do(after)
    put_back.board.restore(snapshot)
    assert plain.do(after) == put_back.do(after)


@settings(max_examples=20, deadline=None)
@given(acts, acts, acts)
def test_snapshots_may_be_restored_in_any_order(
    first: list[Act], second: list[Act], third: list[Act]
) -> None:
    doer = ActionRecorder(Board(ideal=True))
    early = doer.board.snapshot()
    one = doer.do(first)
    late = doer.board.snapshot()
    two = doer.do(second)
    doer.board.restore(early)
    assert doer.do(first) == one
    doer.do(third)
    doer.board.restore(late)
    assert doer.do(second) == two


WIRINGS = ("lab3", "fcu001v1")


def run_on(board: Board, seconds: float) -> list[object]:
    """Run the board; return the events of the trace and the state of the board, with chip and RAM."""
    first = len(board.trace)
    board.run_for(seconds)
    assert board.chip is not None
    core = board.chip.core
    return [*list(board.trace)[first:], *picture(board), core.core_state(), bytes(core.ram), core.retired]


@pytest.mark.parametrize("wiring", WIRINGS)
@pytest.mark.parametrize("detailed", [False, True], ids=["plain", "traced"])
@pytest.mark.parametrize("scenario", [None, "figure_eight"])
def test_restored_built_firmware_repeats_its_run(wiring: str, scenario: str | None, detailed: bool) -> None:
    boards = [Board("solution", wiring=wiring, scenario=scenario, seed=2) for _ in range(2)]
    for board in boards:
        if detailed:
            board.trace.record_all()
        if scenario is None:
            board.world.rotate_to(30, 20, 40, 2.0)
        run_on(board, 1.1003)
    plain, put_back = boards
    snapshot = put_back.snapshot()
    put_back.world.set_attitude(0, 85, 0)
    put_back.sensors.lis2mdl.write(0x62, b"\x00", put_back.clock.now_ps)
    run_on(put_back, 0.05)
    for _ in range(2):
        put_back.restore(snapshot)
        again = run_on(put_back, 0.04)
    assert again == run_on(plain, 0.04)
    assert run_on(put_back, 0.9) == run_on(plain, 0.9)


def test_restore_removes_faults_drivers_and_typing() -> None:
    """A fault on the bus, a driven pin and text in transmission are removed by restoring."""
    boards = [Board(firmware="solution") for _ in range(2)]
    for board in boards:
        board.run_for(1.1)
    plain, put_back = boards
    snapshot = put_back.snapshot()
    put_back.i2c2.inject(I2CFault.in_ps("stuck", put_back.clock.now_ps, 1 << 60))
    put_back.gpio.drive("B", 5, 0)
    put_back.terminal.write(b"typed")
    put_back.run_for(0.2)
    put_back.restore(snapshot)
    assert run_on(put_back, 0.3) == run_on(plain, 0.3)


@pytest.mark.parametrize("firmware", [None, "solution"])
@pytest.mark.parametrize("wiring", WIRINGS)
def test_board_arrays_are_never_changed_in_place(firmware: str | None, wiring: str) -> None:
    """Snapshots keep the arrays of a board by reference, so no array may be changed in place."""
    board = Board(firmware=firmware, wiring=wiring)
    doer = ActionRecorder(Board()) if firmware is None and wiring == "lab3" else None
    board = doer.board if doer else board
    for _ in range(3):
        board.run_for(0.6)
        for array in arrays_of(board):
            array.flags.writeable = False
        board.world.rotate_to(10, 20, 30, 0.3)
        if doer:
            doer.do([("write", write) for write in FUNCTIONS] + [("read", read) for read in READS])


def test_objects_outside_snapshot_are_known() -> None:
    """There is no generator, no random source and no iterator, whose state a snapshot would not restore."""
    boards = [Board(), Board(firmware="solution"), Board(scenario="figure_eight", firmware="solution")]
    left = {f"{kind.__module__}.{kind.__name__}" for board in boards for kind in foreign_to(board)}
    assert left <= {
        "_ctypes.CFunctionType",
        "array.array",  # the parts' versions, which go on counting: no number comes twice
        "builtins.builtin_function_or_method",
        "builtins.ellipsis",
        "builtins.frozenset",
        "builtins.mappingproxy",
        "builtins.memoryview",
        "builtins.weakproxy",
        "builtins.wrapper_descriptor",
        "ctypes.CDLL",
        "ctypes.CFunctionType",
        "ctypes.PyDLL",
        "ctypes._FuncPtr",
        "ctypes.c_void_p",
        "fractions.Fraction",
        "numpy.ndarray",
        "numpy.float64",
        "pathlib.PosixPath",
        "re.Pattern",
        "weakref.ProxyType",
        "weakref.finalize",  # gives back what the chip has in C
        "weakref.WeakKeyDictionary",  # the scenario's recorders, which the clock's queue leads to
    }


def test_subscriptions_survive_restore() -> None:
    board = Board(firmware="solution")
    heard: list[TraceEvent] = []
    levels: list[int] = []
    board.trace.subscribe(heard.append, detail=False)
    board.gpio.listen("B", 5, levels.append)
    board.run_for(0.01)
    snapshot = board.snapshot()
    board.world.set_attitude(0, 85, 0)
    board.run_for(1.5)
    edges = board.trace.of(GpioEdge)
    before = len(heard), len(levels)
    board.restore(snapshot)
    assert len(board.trace.of(GpioEdge)) < len(edges)
    assert (len(heard), len(levels)) == before
    board.run_for(0.1)
    assert len(levels) >= before[1]


def test_impossible_snapshot_is_refused() -> None:
    with pytest.raises(InputError) as refused:
        Board(firmware="lab3").snapshot()
    assert refused.value.kind == "not_copied"
    other = Board().snapshot()
    with pytest.raises(InputError, match="of this board"):
        Board().restore(other)


def test_no_function_uses_nonlocal() -> None:
    """A snapshot walks the variables in closures, but only restores their contents."""
    sources = [*Path(sensors.__path__[0]).rglob("*.py"), *Path(emulator.__path__[0]).rglob("*.py")]
    found = [
        source.name for source in sources if re.search(r"^\s+nonlocal ", source.read_text("utf-8"), re.M)
    ]
    assert found == []


def reached_from(root: object) -> Iterator[object]:
    """Return all objects that a snapshot of ``root`` has visited, and the objects to which they refer."""
    return iter(Snapshot(root)._seen.values())


def arrays_of(root: object) -> Iterator[np.ndarray[tuple[int, ...], np.dtype[np.float64]]]:
    return (one for one in reached_from(root) if isinstance(one, np.ndarray))


_WALKED: tuple[Callable[..., object] | type, ...] = (
    *(list, bytearray, dict, set, deque, tuple, functools.partial),
    *(types.MethodType, types.FunctionType, types.CellType),
)


def foreign_to(root: object) -> set[type]:
    return {
        type(one)
        for one in reached_from(root)
        if not isinstance(one, _WALKED) and not type(one).__module__.startswith("fcu_emulator")
    }
