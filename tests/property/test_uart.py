"""The serial line agrees with a slow oracle that moves each byte separately.

The oracle has two registers (RM0368 19.3.2): the sender may write the data register when it is empty, and the shift
register receives a byte when the shift register is free. The sender is interrupted during given intervals.
"""

from __future__ import annotations

from fractions import Fraction

from hypothesis import given
from hypothesis import strategies as st

from fcu_emulator import Board
from fcu_emulator.emulator.clock import PS_PER_S, PS_PER_US
from fcu_emulator.emulator.python_cpu.hal import VirtualHal
from tests.support.board_fakes import script, start_timer

FRAME = Fraction(10 * 729 * PS_PER_S, 84_000_000)  # BRR 0x2D9


def completion_times(count: int, away: list[tuple[Fraction, Fraction]]) -> list[Fraction]:
    """Return the times at which each of ``count`` bytes has left, if the sender is interrupted in these intervals."""
    times: list[Fraction] = []
    shift_free, data_free = Fraction(0), Fraction(0)
    for _ in range(count):
        written = data_free
        for begin, end in away:
            if begin <= written < end:
                written = end
        start = max(written, shift_free)
        data_free, shift_free = start, start + FRAME
        times.append(shift_free)
    return times


@given(st.binary(min_size=1, max_size=60), st.integers(1000, 3000), st.integers(1, 38))
def test_byte_times_equal_two_register_oracle(data: bytes, period_us: int, length: int) -> None:
    """During a transmission, a timer repeatedly interrupts the processor for the time of an I2C read."""

    def send(hal: VirtualHal) -> None:
        start_timer(hal, prescaler=83, period=period_us - 1)  # 1 MHz count: a period in us
        hal.HAL_UART_Transmit(data, 1000)

    board = Board(firmware=script(send, lambda hal: hal.HAL_I2C_Mem_Read(0xD6, 0x0F, length) and None))
    away_ps = (
        (30 + 9 * length) * PS_PER_S // 400_000
    )  # start, address, register, restart, address, data, stop
    # The first callback is over before the counter starts: HAL enables the interrupt first.
    starts_ps = [0, *(away_ps + number * period_us * PS_PER_US for number in range(1, 200))]
    away = [(Fraction(start_ps), Fraction(start_ps + away_ps)) for start_ps in starts_ps]
    for number, time in enumerate(completion_times(len(data), away), start=1):
        board.run_until_ps(int(time) - 100)  # the board rounds each piece of the line down to a picosecond
        assert board.terminal.position == number - 1
        board.run_until_ps(int(time) + 100)
        assert bytes(board.terminal.uart.received()) == data[:number]
