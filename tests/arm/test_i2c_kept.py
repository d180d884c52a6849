"""Bytes of the sensors that C keeps have no visible effect: a bus that keeps bytes and a live bus behave the same."""

from __future__ import annotations

from typing import Any, TypeAlias
from unittest.mock import patch

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fcu_emulator.emulator.buses.i2c import I2CFault, I2CTarget
from fcu_emulator.emulator.clock import PS_PER_MS, PS_PER_S, PS_PER_US
from fcu_emulator.emulator.trace import BusTransfer
from fcu_emulator.sensors.part import SubaddressTarget
from fcu_emulator.sensors.sampling import OutputWords
from tests.contract.test_sensor_declarations import Asking
from tests.support.arm.comm_bench import RAM, CommBench
from tests.support.arm.hal_i2c import (
    ACK,
    ADDR,
    AF,
    BTF,
    CR1,
    DR,
    RXNE,
    SB,
    SR1,
    START,
    STOP,
    HalError,
    HalI2c,
)

LSM6DSL, LIS2MDL, LPS22HB = 0x6B, 0x1E, 0x5D
SWITCHED_ON = (
    (LSM6DSL, 0x12, 0x04),  # CTRL3_C.IF_INC
    (LSM6DSL, 0x10, 0x50),  # 208 Hz
    (LSM6DSL, 0x11, 0x40),  # 104 Hz
    (LIS2MDL, 0x60, 0x8C),  # 100 Hz
    (LPS22HB, 0x11, 0x10),  # IF_ADD_INC
    (LPS22HB, 0x10, 0x50),  # 75 Hz
)
SETTINGS = (
    *((LSM6DSL, 0x12, value) for value in (0x44, 0x24, 0x64, 0x04, 0x40, 0x05)),  # BDU, BLE, SW_RESET
    *((LSM6DSL, 0x14, value) for value in (0x60, 0x00)),  # ROUNDING
    *((LSM6DSL, 0x13, value) for value in (0x08, 0x04, 0x00)),  # I2C_disable
    *((LSM6DSL, 0x0A, value) for value in (0x26, 0x00)),  # FIFO
    *((LSM6DSL, 0x01, value) for value in (0x80, 0x00)),  # embedded banks
    *((LSM6DSL, 0x0D, value) for value in (0x03, 0x00)),  # INT1_CTRL
    *((LIS2MDL, 0x62, value) for value in (0x10, 0x08, 0x20, 0x00)),  # BDU, BLE, I2C_DIS
    *((LPS22HB, 0x10, value) for value in (0x52, 0x50)),  # BDU
    *((LPS22HB, 0x11, value) for value in (0x50, 0x10, 0x00)),  # FIFO, IF_ADD_INC
)
USUAL = (
    *((LSM6DSL, address, 6) for address in (0x22, 0x28)),
    *((LSM6DSL, 0x22 + n, 1) for n in range(12)),
    *((LSM6DSL, address, count) for address, count in ((0x22, 12), (0x20, 14), (0x1E, 1), (0x1E, 16))),
    *((LSM6DSL, address, 1) for address in (0x0F, 0x10, 0x12)),
    (LIS2MDL, 0x68, 6),
    *((LIS2MDL, address, 1) for address in (0x67, 0x68, 0x69, 0x6A, 0x62, 0x4F)),
    *((LPS22HB, address, count) for address, count in ((0x28, 3), (0x28, 5), (0x2B, 2), (0x27, 6))),
    *((LPS22HB, address, 1) for address in (0x28, 0x29, 0x2A, 0x27, 0x10)),
)
DEVICES = (LSM6DSL, LIS2MDL, LPS22HB)
Action: TypeAlias = tuple[str, int, int, int]


class Live:
    """A device that returns each byte only when the byte is requested."""

    def __init__(self, target: I2CTarget) -> None:
        self._target = target

    def __getattr__(self, name: str) -> Any:
        return getattr(self._target, name)


class Board:
    """The bench with its bus. If ``live`` is true, no bytes are kept."""

    def __init__(self, *, live: bool) -> None:
        self.bench = bench = CommBench()
        self.seen: list[object] = []
        self.targets = {address: bench.board.i2c2.bus.target(address) for address in DEVICES}
        for address, target in self.targets.items():
            assert isinstance(target, SubaddressTarget)
            if live:
                bench.board.i2c2.bus.attach(address, Live(target))
        self.hal = HalI2c(bench)
        bench.wait(PS_PER_S // 20)
        for one in SWITCHED_ON:
            self.act(("write", *one))

    def act(self, action: Action) -> None:
        """Do the action, and record the data that firmware reads."""
        name, *numbers = action
        try:
            self.seen.append(getattr(self, f"_{name}")(*numbers))
        except HalError:
            self.hal.wait_idle()
            self.seen.append("no acknowledge")

    def _read(self, address: int, register: int, count: int) -> bytes:
        return self.hal.mem_read(address, register, count)

    def _write(self, address: int, register: int, value: int) -> None:
        self.hal.mem_write(address, register, bytes((value,)))
        self.hal.wait_idle()

    def _interrupt(self, address: int, register: int, count: int) -> bytes:
        """Write the sub-address and read in two messages, the second by interrupts."""
        self.hal.mem_write(address, register, b"")
        self.hal.wait_idle()
        return self._again(address, register, count)

    def _again(self, address: int, _: int, count: int) -> bytes:
        """Continue reading after the end of the previous read."""
        return self.hal.receive_interrupt(address, count)

    def _dma(self, address: int, register: int, count: int) -> bytes:
        bench, hal, stream = self.bench, self.hal, 0x10 + 0x18 * 3
        count = max(count, 2)
        for offset, value in [(4, count), (8, 0x4000_5810), (12, RAM)]:
            bench.write(bench.dma1, stream + offset, value)
        bench.write(bench.dma1, stream, 7 << 25 | 1 << 10 | 1 << 4 | 1)
        hal.mem_read_dma_address(address, register)
        clear_flags = 0x3D << 22
        bench.serve(
            14, lambda: bench.write(bench.dma1, 0x08, clear_flags), lambda: not bench.dma1.peek(stream + 4)
        )
        hal.mem_read_dma_complete()
        hal.wait_idle()
        return bytes(bench.ram[:count])

    def _ready(self, address: int, _: int, __: int) -> bool:
        return self.hal.is_ready(address)

    def _pass(self, us: int, _: int, __: int) -> None:
        self.bench.wait(us * PS_PER_US)

    def _disable(self, address: int, register: int, count: int) -> None:
        """Set PE = 0 in the middle of a message."""
        bench, hal = self.bench, self.hal
        hal.wait_idle()
        hal._set(CR1, ACK)
        hal._send_address(address << 1)
        hal._clear_addr()
        bench.write(bench.i2c2, DR, register)
        if bench.poll(bench.i2c2, SR1, BTF | AF) & AF:
            hal._give_up()
        hal._send_address(address << 1 | 1)
        hal._clear_addr()
        for _ in range(count):
            bench.poll(bench.i2c2, SR1, RXNE)
            bench.read(bench.i2c2, DR)
        hal._clear(CR1, 1)
        hal._set(CR1, 1)

    def _restart(self, address: int, register: int, other: int) -> bytes:
        """Read one byte of one device, then with a repeated start one byte of another device."""
        bench, hal, data = self.bench, self.hal, b""
        hal.wait_idle()
        hal._set(CR1, ACK)
        for device in (address, DEVICES[other % 3]):
            hal._send_address(device << 1)
            hal._clear_addr()
            bench.write(bench.i2c2, DR, register)
            if bench.poll(bench.i2c2, SR1, BTF | AF) & AF:
                hal._give_up()
            hal._set(CR1, START)
            bench.poll(bench.i2c2, SR1, SB)
            bench.write(bench.i2c2, DR, device << 1 | 1)
            if bench.poll(bench.i2c2, SR1, ADDR | AF) & AF:
                hal._give_up()
            hal._clear(CR1, ACK)
            hal._clear_addr()
            bench.poll(bench.i2c2, SR1, RXNE)
            data += bytes((bench.read(bench.i2c2, DR),))
            hal._set(CR1, ACK)
        hal._set(CR1, STOP)
        hal.wait_idle()
        return data

    def _debugger(self, address: int, register: int, us: int) -> None:
        """Read the sensor in Python after ``us`` microseconds, even in the middle of a message."""
        clock, part = self.bench.clock, self.part(address)
        clock.schedule(
            clock.now_ps + us * PS_PER_US, lambda: self.seen.append(part.read(register, 2, clock.now_ps))
        )

    def _turn(self, degrees: int, _: int, __: int) -> None:
        self.bench.board.world.set_attitude(roll_deg=degrees, pitch_deg=5, yaw_deg=30)

    def _detail(self, _: int, __: int, ___: int) -> None:
        self.bench.trace.record_all()

    def _fault(self, address: int, us: int, index: int) -> None:
        now_ps = self.bench.clock.now_ps
        until_ps = now_ps + 2 * PS_PER_MS
        from_ps = now_ps + us * PS_PER_US
        fault = I2CFault.in_ps("nack", from_ps, until_ps, address=address, byte_index=index % 3)
        self.bench.board.i2c2.inject(fault)

    def part(self, address: int) -> Any:
        target = self.targets[address]
        assert isinstance(target, SubaddressTarget)
        return target.part

    def state(self) -> list[object]:
        """Return everything that can be observed afterwards."""
        bench = self.bench
        bench.wait(3 * PS_PER_MS)  # no fault lasts longer
        parts = [self.part(address) for address in DEVICES]
        now_ps = bench.clock.now_ps
        return [
            self.seen,
            now_ps,
            list(bench.trace),
            bench.board.i2c2.bus.recent_transfers(),
            [part.registers.held[0] for part in parts],
            # Read, and not looked up in the memory, which is filled in when somebody reads it.
            [[part.read(address, 1, now_ps) for address in range(0x80)] for part in parts],
            [self.hal.receive_interrupt(address, 3) for address in DEVICES if self.hal.is_ready(address)],
        ]


def actions() -> st.SearchStrategy[list[Action]]:
    usual = st.sampled_from(USUAL)
    device = st.sampled_from(DEVICES)
    kinds: dict[str, st.SearchStrategy[Action]] = {
        "read": usual.map(lambda read: ("read", *read)),
        "interrupt": usual.map(lambda read: ("interrupt", *read)),
        "dma": usual.map(lambda read: ("dma", *read)),
        "anywhere": st.tuples(st.just("read"), device, st.integers(0, 0xFF), st.integers(1, 40)),
        "again": st.tuples(st.just("again"), device, st.just(0), st.integers(1, 8)),
        "disable": usual.map(lambda read: ("disable", *read)),
        "restart": usual.map(lambda read: ("restart", *read)),
        "ready": st.tuples(st.just("ready"), device, st.just(0), st.just(0)),
        "pass": st.tuples(st.just("pass"), st.integers(0, 12_000), st.just(0), st.just(0)),
        "write": st.sampled_from(SETTINGS).map(lambda write: ("write", *write)),
        "debugger": st.tuples(st.just("debugger"), device, st.integers(0, 0x7E), st.integers(0, 600)),
        "turn": st.tuples(st.just("turn"), st.integers(-80, 80), st.just(0), st.just(0)),
        "detail": st.just(("detail", 0, 0, 0)),
    }
    weighted = ["read"] * 10 + ["interrupt", "dma", "again", "write", "debugger"] * 2 + ["pass"] * 6
    weighted += ["anywhere", "disable", "restart", "ready", "turn", "detail"]
    return st.lists(st.sampled_from(weighted).flatmap(kinds.__getitem__), min_size=10, max_size=40)


@settings(max_examples=25, deadline=None)
@given(actions())
def test_kept_bytes_equal_live_reads(actions: list[Action]) -> None:
    kept, live = Board(live=False), Board(live=True)
    for action in actions:
        kept.act(action)
        live.act(action)
    for one, other in zip(kept.state(), live.state(), strict=True):
        assert one == other


@settings(max_examples=15, deadline=None)
@given(actions(), st.integers(0, 20), st.sampled_from(DEVICES), st.integers(0, 400), st.integers(0, 2))
def test_kept_bytes_equal_live_reads_with_faults(
    actions: list[Action], after: int, device: int, us: int, index: int
) -> None:
    kept, live = Board(live=False), Board(live=True)
    for action in [*actions[:after], ("fault", device, us, index), *actions[after:]]:
        kept.act(action)
        live.act(action)
    for one, other in zip(kept.state(), live.state(), strict=True):
        assert one == other


class Calls:
    """Count of the calls to the sensors."""

    def __init__(self, board: Board) -> None:
        self.count = 0
        for target in board.targets.values():
            assert isinstance(target, SubaddressTarget)
            for name in ("start", "write", "read", "shared_bank"):
                self._count(target, name)

    def _count(self, target: SubaddressTarget, name: str) -> None:
        method = getattr(target, name)

        def counted(*arguments: Any, **named: Any) -> Any:
            self.count += 1
            return method(*arguments, **named)

        setattr(target, name, counted)


@pytest.mark.parametrize("kind", ["read", "interrupt", "dma"])
def test_sample_is_requested_once(kind: str) -> None:
    """The first message loads all bytes; later messages need no call."""
    board = Board(live=False)
    for _ in range(2):
        board.act((kind, LIS2MDL, 0x68, 6))
    board.bench.wait(15 * PS_PER_MS)  # a new sample has been taken
    calls = Calls(board)
    with patch.object(OutputWords, "fill", autospec=True, side_effect=OutputWords.fill) as fill:
        for _ in range(3):
            board.act((kind, LIS2MDL, 0x68, 6))
    assert (calls.count, fill.call_count) == (0, 1)
    assert len(set(map(str, board.seen[-3:]))) == 1


def test_configuration_read_needs_no_sensor_call() -> None:
    board = Board(live=False)
    board.act(("read", LSM6DSL, 0x10, 1))
    calls = Calls(board)
    for _ in range(5):
        board.act(("read", LSM6DSL, 0x10, 1))
    assert calls.count == 0
    board.act(("write", LSM6DSL, 0x10, 0x60))
    board.act(("read", LSM6DSL, 0x10, 1))
    assert board.seen[-1] == b"\x60"


def test_recent_transfers_include_messages_with_kept_bytes() -> None:
    board = Board(live=False)
    for register in (0x10, 0x0F, 0x10, 0x0F):
        board.act(("read", LSM6DSL, register, 1))
    board.hal.wait_idle()
    last = board.bench.board.i2c2.bus.recent_transfers()[-4:]
    assert [(event.register, event.read, event.result) for event in last] == [
        ("CTRL1_XL", b"\x50", "ok"),
        ("WHO_AM_I", b"\x6a", "ok"),
    ] * 2
    assert not board.bench.trace.of(BusTransfer)


@pytest.mark.parametrize("start", [0x20, 0xA0])
def test_sensor_receives_its_increment_bit(start: int) -> None:
    """A burst increments the address only if this bit is set. The same is true for kept bytes."""
    board = Board(live=False)
    bench, part = board.bench, Asking()
    part.write(0x20, bytes(range(1, 9)), 0)
    bench.board.i2c2.bus.attach(0x5F, SubaddressTarget(part, lambda: bench.clock.now_ps))
    wanted = bytes(range(1, 5)) if start & 0x80 else b"\1\1\1\1"
    assert [board.hal.mem_read(0x5F, start, 4) for _ in range(4)] == [wanted] * 4
