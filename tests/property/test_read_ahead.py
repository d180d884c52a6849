"""A device that tells bytes ahead does nothing else than one that is read byte by byte."""

from __future__ import annotations

from collections.abc import Iterable

from hypothesis import given, settings
from hypothesis import strategies as st

from emulator import Board
from emulator.clock import PS_PER_S
from emulator.i2c_wire import I2CWire
from sensors.subaddress import SubaddressTarget

LSM6DSL, LIS2MDL, LPS22HB = 0x6B, 0x1E, 0x5D
CTRL1_XL, CTRL2_G, CTRL3_C, CFG_REG_A, CFG_REG_C, CTRL_REG1 = 0x10, 0x11, 0x12, 0x60, 0x62, 0x10
SWITCHED_ON = (
    (LSM6DSL, CTRL1_XL, 0x70),  # 833 Hz
    (LSM6DSL, CTRL2_G, 0x70),
    (LIS2MDL, CFG_REG_A, 0x8C),  # 100 Hz
    (LPS22HB, CTRL_REG1, 0x50),  # 75 Hz
)
BDU_LSM6DSL, BLE_LSM6DSL, IF_INC = 0x40, 0x20, 0x04
BDU_LIS2MDL, BLE_LIS2MDL = 0x10, 0x08
OUTPUTS = {LSM6DSL: range(0x20, 0x30), LIS2MDL: range(0x66, 0x70), LPS22HB: range(0x26, 0x2D)}
_BYTE_PS = 22_500_000  # nine bits at 400 kHz


class Master:
    """An I2C master; ``ahead``: it takes what it is told, as the native engine does."""

    def __init__(self, settings: Iterable[tuple[int, int, int]], *, ahead: bool) -> None:
        self.board = Board("lab3", firmware="lab3", seed=5)  # which is never run
        self.board.clock.advance_to(PS_PER_S // 20)
        self.wire = I2CWire(self.board.bus)
        self._ahead = ahead
        for address, register, value in (*SWITCHED_ON, *settings):
            self.message(address, register, 0, write=bytes((value,)))
        self.pass_time(PS_PER_S // 5)

    def pass_time(self, ps: int) -> None:
        self.board.clock.advance_to(self.board.clock.now_ps + ps)

    def message(self, address: int, register: int, count: int, write: bytes = b"") -> bytes:
        wire, clock = self.wire, self.board.clock
        assert wire.start(address, read=False, start_ps=clock.now_ps) == "ack"
        for value in (register, *write):
            self.pass_time(_BYTE_PS)
            assert wire.write_byte(value)
        data = b""
        if count:
            self.pass_time(_BYTE_PS)
            assert wire.start(address, read=True, start_ps=clock.now_ps) == "ack"
            data = self._read(count)
        self.pass_time(_BYTE_PS // 9)
        wire.stop()
        return data

    def _read(self, count: int) -> bytes:
        wire, clock = self.wire, self.board.clock
        told, until_ps = wire.read_ahead() if self._ahead else (b"", 0)
        taken, data = 0, bytearray()
        for _ in range(count):
            self.pass_time(_BYTE_PS)
            if taken < len(told) and clock.now_ps < until_ps:
                data.append(told[taken])
                taken += 1
                continue
            if taken:
                wire.taken(told[:taken])
            data.append(wire.read_byte())
            told, until_ps = wire.read_ahead() if self._ahead else (b"", 0)
            taken = 0
        if taken:
            wire.taken(told[:taken])
        return bytes(data)

    def state(self) -> list[tuple[bytes, set[int]]]:
        """Registers and held bytes of all parts."""
        return [
            (bytes(part.registers.mem), set(part.registers.half_read)) for part in self.board.sensors.parts
        ]


@st.composite
def messages(draw: st.DrawFn) -> list[tuple[int, int, int, int]]:
    """Pauses in ps, device, register, count."""
    one = st.sampled_from(list(OUTPUTS)).flatmap(
        lambda address: st.tuples(
            st.integers(0, 3_000_000_000),
            st.just(address),
            st.sampled_from(OUTPUTS[address]),
            st.integers(1, 14),
        )
    )
    return draw(st.lists(one, min_size=1, max_size=12))


@settings(max_examples=40, deadline=None)
@given(
    messages(),
    st.sampled_from([0, BDU_LSM6DSL, BLE_LSM6DSL, BDU_LSM6DSL | BLE_LSM6DSL]),
    st.sampled_from([0, BDU_LIS2MDL, BLE_LIS2MDL, BDU_LIS2MDL | BLE_LIS2MDL]),
)
def test_bytes_told_ahead_are_those_that_are_read(
    reads: list[tuple[int, int, int, int]], accelerometer: int, magnetometer: int
) -> None:
    configured = ((LSM6DSL, CTRL3_C, accelerometer | IF_INC), (LIS2MDL, CFG_REG_C, magnetometer))
    plain, ahead = (Master(configured, ahead=on) for on in (False, True))
    for pause_ps, address, register, count in reads:
        answers = []
        for master in (plain, ahead):
            master.pass_time(pause_ps)
            answers.append(master.message(address, register, count))
        assert answers[0] == answers[1]
        assert plain.state() == ahead.state()


def test_something_is_told_ahead() -> None:
    """Six bytes of each output, from its first register on."""
    master = Master((), ahead=True)
    for address, register in ((LSM6DSL, 0x22), (LSM6DSL, 0x28), (LIS2MDL, 0x68)):
        target = master.board.bus.target(address)
        assert isinstance(target, SubaddressTarget)
        assert target.start(read=False)
        target.write(bytes((register,)))
        data, until_ps = target.read_ahead(master.board.clock.now_ps)

        assert len(data) == 6
        assert any(data)
        assert until_ps > master.board.clock.now_ps
