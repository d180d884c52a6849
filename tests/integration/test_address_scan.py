"""A search for devices at all addresses of a bus is not reported as a mistake."""

from __future__ import annotations

import contextlib

from fcu_emulator import Board, I2CNackError
from fcu_emulator.emulator.cli.run_report import _bus_errors


def test_address_scan_causes_one_line_without_finding() -> None:
    board = Board(firmware="solution")
    board.run_for(1.5)
    for address in range(0x08, 0x78):
        with contextlib.suppress(I2CNackError):
            board.i2c2.write(address, b"")
    board.run_for(0.3)
    assert board.chip is not None
    assert board.chip.diagnosis() is None
    assert list(_bus_errors(board)) == ["I2C2: no answer at 109 addresses, from 0x08 to 0x77"]
