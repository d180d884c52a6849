"""A sample depends only on its time, the world and the registers: reads of other samples never change it."""

from __future__ import annotations

from collections.abc import Callable

from hypothesis import given, settings
from hypothesis import strategies as st

from fcu_emulator.emulator.assembly.board import Board
from fcu_emulator.emulator.world import World

LSM6DSL, LIS2MDL, LPS22HB = 0x6B, 0x1E, 0x5D
OUTPUTS = ((LSM6DSL, 0x20, 14), (LIS2MDL, 0x68, 8), (LPS22HB, 0x28, 5))
CTRL1_XL, CTRL2_G, CTRL7_G, CTRL8_XL = 0x10, 0x11, 0x16, 0x17
SETTINGS = st.fixed_dictionaries(
    {
        CTRL1_XL: st.sampled_from((0x00, 0x10, 0x30, 0x62, 0x7C)),
        CTRL2_G: st.sampled_from((0x00, 0x10, 0x30, 0x62, 0x7C)),
        CTRL7_G: st.sampled_from((0x00, 0x40, 0x50, 0x70)),  # no high-pass, 16, 65 mHz, 1.04 Hz
        CTRL8_XL: st.sampled_from((0x00, 0xA0, 0xE0, 0x64, 0x84)),  # LPF2 at ODR/100, ODR/400; high-pass
    }
)
"""Rates from 12.5 to 833 Hz, and filters whose memory is up to a minute."""

ACTIONS: tuple[Callable[[World], object], ...] = (
    lambda world: world.set_attitude(40, 20, 10),
    lambda world: world.set_attitude(0, 0, 0),
    lambda world: world.set_altitude(2),
    lambda world: world.set_temperature(30),
    lambda world: world.set_pressure(950),
    lambda world: world.rotate_to(10, 60, 0, 1.5),
    lambda world: world.shake("up", 0.5, 5, 2.0),
    lambda world: world.run_motors(0.3),
    lambda world: world.run_motors(0),
    lambda world: world.blow_wind(8, 3),
)
STEPS = st.lists(
    st.tuples(
        st.floats(0.05, 9.0),
        st.one_of(st.sampled_from(ACTIONS), st.none(), st.dictionaries(st.just(CTRL8_XL), st.just(0xE0))),
        st.booleans(),
    ),
    min_size=1,
    max_size=6,
)


def outputs(board: Board) -> list[bytes]:
    bus = board.i2c("I2C2")
    return [bus.write_read(address, bytes([first]), count) for address, first, count in OUTPUTS]


def put(board: Board, registers: dict[int, int]) -> None:
    for address, value in registers.items():
        board.i2c("I2C2").write(LSM6DSL, bytes([address, value]))


@given(registers=SETTINGS, steps=STEPS, ideal=st.booleans())
@settings(deadline=None, max_examples=15)
def test_sensor_samples_do_not_depend_on_reads(
    registers: dict[int, int],
    steps: list[tuple[float, Callable[[World], object] | dict[int, int] | None, bool]],
    ideal: bool,
) -> None:
    """One board is read after each step, one board sometimes, and one board only at the end. Final reads are equal."""
    read, sometimes, _unread = boards = [Board(firmware=None, ideal=ideal) for _ in range(3)]
    for board in boards:
        put(board, registers)
        board.i2c("I2C2").write(LIS2MDL, b"\x60\x8c")  # CFG_REG_A: 100 Hz, temperature compensation
        board.i2c("I2C2").write(LPS22HB, b"\x10\x40")  # CTRL_REG1: 50 Hz
    at_s = 1.0
    for after_s, action, looked in steps:
        at_s += after_s
        for board in boards:
            board.run_until(at_s)
            if isinstance(action, dict):
                put(board, action)
            elif action is not None:
                action(board.world)
            if board is read or (board is sometimes and looked):
                board.run_until(at_s + 0.02)
                outputs(board)
    for board in boards:
        board.run_until(at_s + 0.04)
    last = [outputs(board) for board in boards]
    assert last[0] == last[1] == last[2]
