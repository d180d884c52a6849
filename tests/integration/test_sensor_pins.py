"""Sensor pins on the board: edges come at their time, for any state of the firmware."""

from __future__ import annotations

from fcu_emulator import Board
from fcu_emulator.emulator.trace import GpioEdge
from fcu_emulator.sensors.front_end import kernel

LSM6DSL, LIS2MDL = 0x6B, 0x1E
PS_PER_S = 10**12
PERIOD_104_PS = -(-PS_PER_S // 104)


def wired(board: Board, pin: str = "int1") -> list[tuple[int, int]]:
    """Listen to a pin of the LSM6DSL; the time of each edge must be the present time."""
    edges: list[tuple[int, int]] = []

    def edge(at_ps: int, level: int) -> None:
        assert at_ps == board.clock.now_ps, "an edge comes when it happens"
        edges.append((at_ps, level))

    getattr(board.sensors.lsm6dsl, pin).observe(edge)
    return edges


def test_pulsed_data_ready_comes_at_every_sample() -> None:
    board = Board(ideal=True)
    edges = wired(board)
    board.i2c2.write(LSM6DSL, b"\x0b\x80")
    board.i2c2.write(LSM6DSL, b"\x0d\x01")
    on_ps = board.clock.now_ps
    board.i2c2.write(LSM6DSL, b"\x10\x40")
    board.run_for(0.025)

    samples = [on_ps + PERIOD_104_PS, on_ps + 2 * PERIOD_104_PS]
    assert edges == [edge for at in samples for edge in ((at, 1), (at + 75 * 10**6, 0))]


def test_latched_data_ready_falls_with_read() -> None:
    board = Board(ideal=True)
    edges = wired(board, "int2")
    board.i2c2.write(LSM6DSL, b"\x0e\x01")
    on_ps = board.clock.now_ps
    board.i2c2.write(LSM6DSL, b"\x10\x40")
    board.run_for(0.05)
    read_ps = board.clock.now_ps
    board.i2c2.write_read(LSM6DSL, b"\x28", 6)
    board.run_for(0.05)

    assert edges[:2] == [(on_ps + PERIOD_104_PS, 1), (read_ps, 0)]
    assert len(edges) == 3
    assert 0 < edges[2][0] - read_ps <= PERIOD_104_PS
    assert (edges[2][0] - on_ps) * 104 % PS_PER_S < 104, "on the raster of the samples"


def test_free_fall_pin_is_high_during_fall() -> None:
    """208 Hz, 312 mg, five periods: AN5040 5.1. The analog stage and LPF1 delay the fall a little."""
    board = Board(ideal=True)
    edges = wired(board)
    for register, value in ((0x5D, 5 << 3 | 3), (0x5E, 0x10), (0x58, 0x80), (0x10, 0x50)):
        board.i2c2.write(LSM6DSL, bytes((register, value)))
    board.world.lift(2.0, duration_s=1.0)
    board.run_for(1.5)
    before = len(edges)
    begins_s = board.now_s
    board.world.free_fall(0.3)
    board.run_for(1.0)

    (rises_ps, up), (falls_ps, down) = edges[before : before + 2]
    assert (up, down) == (1, 0)
    late_s = kernel(208.0, 400.0, None, 2.0).delay_s
    assert 0.004 < late_s < 0.006
    assert 5 / 208 + late_s <= rises_ps / PS_PER_S - begins_s <= 6 / 208 + 1.5 * late_s  # 69 % of the step
    assert 0.3 <= falls_ps / PS_PER_S - begins_s <= 0.3 + 1 / 208 + late_s


def test_edges_of_wired_pin_are_traced() -> None:
    board = Board(ideal=True)
    edges = wired(board)
    board.i2c2.write(LSM6DSL, b"\x0d\x01")
    board.i2c2.write(LSM6DSL, b"\x10\x40")
    board.run_for(0.1)

    recorded = [event for event in board.trace.of(GpioEdge) if event.pin.startswith("LSM6DSL")]
    assert recorded == [GpioEdge(at_ps, "LSM6DSL.INT1", level) for at_ps, level in edges]
    assert len(recorded) == 1


def test_level_before_wiring_is_not_reported_as_edge() -> None:
    board = Board(ideal=True)
    board.i2c2.write(LSM6DSL, b"\x0d\x01")
    board.i2c2.write(LSM6DSL, b"\x10\x40")
    board.run_for(0.1)
    edges = wired(board)
    board.run_for(0.1)

    assert edges == []
    assert board.sensors.lsm6dsl.int1.level == 1


def test_unwired_pin_schedules_no_events() -> None:
    board = Board(ideal=True)
    board.i2c2.write(LSM6DSL, b"\x0d\x01")
    board.i2c2.write(LSM6DSL, b"\x10\x40")
    board.run_for(0.001)

    assert board.clock.next_ps > 10**6 * PS_PER_S


def test_pin_edges_come_on_time_while_firmware_runs() -> None:
    """The firmware reads the accelerometer 800 times a second, and every read lowers INT1."""
    board = Board(firmware="lab3", ideal=True)
    board.run_for(2.0)
    edges = wired(board)
    board.i2c2.bus.transfer(LSM6DSL, b"\x0d\x01")
    board.run_for(0.1)

    rises = sum(level for _, level in edges)
    assert 79 <= rises <= 81
    assert [level for _, level in edges[:4]] == [1, 0, 1, 0]


def test_every_sensor_of_board_reports_its_pin() -> None:
    """The magnetometer's data-ready, 100 Hz (LIS2MDL datasheet 8.7)."""
    board = Board(ideal=True)
    (pin,) = board.sensors.lis2mdl.pins()
    edges: list[tuple[float, int]] = []
    pin.listen(lambda at_s, level: edges.append((at_s, level)))
    board.i2c2.write(LIS2MDL, b"\x62\x01")
    board.i2c2.write(LIS2MDL, b"\x60\x0c")
    for _ in range(5):
        board.run_for(0.01)
        board.i2c2.write_read(LIS2MDL, b"\x68", 6)

    levels = [level for _, level in edges]
    assert levels[-4:] == [1, 0, 1, 0]
    assert 0.04 < edges[-1][0] < 0.06, "in seconds"
    assert {event.pin for event in board.trace.of(GpioEdge)} == {"LIS2MDL.INT/DRDY"}


def test_den_input_on_int2_is_signalled_on_int1() -> None:
    """CTRL6_C: level; CTRL9_XL: the accelerometer; CTRL4_C: DEN_DRDY_INT1 (AN5040 4.8)."""
    board = Board(ideal=True)
    edges = wired(board)
    for register, value in ((0x15, 0x40), (0x14, 0x10), (0x18, 0xF0), (0x13, 0x10), (0x10, 0x40)):
        board.i2c2.write(LSM6DSL, bytes((register, value)))
    board.run_for(0.05)
    driven_ps = board.clock.now_ps
    board.sensors.lsm6dsl.int2.apply(1, driven_ps)
    board.run_for(0.05)

    assert [level for _, level in edges] == [1]
    assert 0 < edges[0][0] - driven_ps <= PERIOD_104_PS
    assert board.i2c2.write_read(LSM6DSL, b"\x28", 6)[0] & 1
