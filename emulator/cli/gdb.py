"""``fcu run --gdb PORT [--halt]``: a debugger for the firmware of the run."""

from __future__ import annotations

from contextlib import ExitStack
from typing import TYPE_CHECKING

from emulator.board.board import Board
from emulator.errors import InputError

if TYPE_CHECKING:
    from emulator.chip.gdb.server import GdbServer


def open_debugger(board: Board, port: int | None, halt: bool, stack: ExitStack) -> GdbServer | None:
    """The server, closed with ``stack``; None if nobody wants one.

    Raises InputError if there is nothing to debug, or the port cannot be had.
    """
    if port is None:
        if halt:
            raise InputError("--halt waits for a debugger; give --gdb PORT as well, such as --gdb 3333")
        return None
    from emulator.chip.gdb.attach import serve

    server = serve(board, port, halt)
    stack.callback(server.close)
    return server


def announcement(server: GdbServer) -> str:
    """What the user has to type in gdb."""
    waits = ", the firmware waits for it" if server.halted else ""
    return f"gdb: target remote 127.0.0.1:{server.port}{waits}"
