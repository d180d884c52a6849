"""After a bus fault, with a missing sensor and with typed input, both firmwares behave the same."""

from __future__ import annotations

from collections import Counter
from pathlib import Path

import pytest

from fcu_emulator import Board
from fcu_emulator.emulator.analysis.compare import compare
from fcu_emulator.emulator.trace import BusTransfer, Fault
from tests.support.arm.agreement import ran, text_of
from tests.support.scenario_files import IDEAL, write

FAULT = "[[timeline]]\ndo = 'inject_fault'\nkind = '{}'\nat = '{}'\nfor = '{}'\n{}\n"


def failures(board: Board) -> Counter[str]:
    return Counter(event.result for event in board.trace.of(BusTransfer) if event.result != "ok")


@pytest.mark.parametrize(
    ("fault", "per_tick", "milliseconds"),
    [
        (FAULT.format("absent", "1.2s", "30ms", "address = 'LIS2MDL'"), 1, 30),
        (FAULT.format("nack", "1.2s", "20ms", "address = 'LPS22HB'\nbyte_index = 1"), 1, 20),
        (FAULT.format("bus_error", "1.2s", "10ms", ""), 4, 10),
        (FAULT.format("arbitration", "1.2s", "10ms", ""), 4, 10),
    ],
    ids=["absent", "nack", "bus_error", "arbitration"],
)
def test_both_firmwares_keep_old_values_during_bus_fault(
    tmp_path: Path, fault: str, per_tick: int, milliseconds: int
) -> None:
    """The drivers return an error, and the callback continues with the next sensor, 800 times a second.

    The fault may begin or end within a callback of one firmware and between two callbacks of the other firmware. So
    the number of failures may differ by one for each kind of failure.
    """
    scenario = write(tmp_path, IDEAL + fault)
    board, in_c = ran("solution", scenario, 1.3)
    other, in_python = ran("lab3", scenario, 1.3)

    counts, others = failures(board), failures(other)
    assert counts.keys() == others.keys()
    assert all(abs(counts[result] - others[result]) <= 1 for result in counts)
    assert counts.total() == pytest.approx(per_tick * milliseconds * 800 / 1000, abs=per_tick)
    assert not compare(in_python, in_c)


def test_both_firmwares_wait_for_timeout_at_stuck_line(tmp_path: Path) -> None:
    """HAL V1.6.0 waits 25 ms until BUSY is cleared (I2C_TIMEOUT_BUSY_FLAG), which is 20 ticks per transfer.

    If the line is released earlier, the C firmware continues immediately, but the Python model waits for 25 ms.
    """
    scenario = write(tmp_path, IDEAL + FAULT.format("stuck", "1.2s", "100ms", ""))
    board, in_c = ran("solution", scenario, 1.4)
    other, in_python = ran("lab3", scenario, 1.4)

    assert 60 <= board.tim9.lost <= other.tim9.lost <= board.tim9.lost + 20
    assert not compare(in_python, in_c)


@pytest.mark.parametrize("part", ["LSM6DSL", "LIS2MDL", "LPS22HB"])
def test_missing_sensor_stops_both_firmwares_after_banner(tmp_path: Path, part: str) -> None:
    """ST's start-up then stays in a loop without a message."""
    missing = f"[[timeline]]\ndo = 'inject_fault'\nkind = 'absent'\naddress = '{part}'\n"
    scenario = write(tmp_path, IDEAL + missing)
    texts = {text_of(ran(firmware, scenario, 1.2)[1]) for firmware in ("solution", "lab3")}

    assert texts == {"STEVAL-FCU001V1 FH rev.1.0 - Sep 2017\n\n"}


def test_typed_bytes_cause_overrun_in_both_firmwares(tmp_path: Path) -> None:
    """Neither firmware reads USART1. The first byte stays in DR, and the other bytes are overruns (RM0368 19.3.3)."""
    send = "[[timeline]]\ndo = 'send'\ntext = 'hello'\nat = '1.1s'\n"
    scenario = write(tmp_path, IDEAL + send)
    board, in_c = ran("solution", scenario, 1.2)
    other, in_python = ran("lab3", scenario, 1.2)

    assert [event.text for event in board.trace.of(Fault)] == [event.text for event in other.trace.of(Fault)]
    assert board.terminal.uart.rx_lost == len("hello") - 1
    assert not compare(in_python, in_c)
