"""A board with firmware for the chip, and a server for debuggers in front of it::

server = serve(board, 3333)
while not server.killed:
    server.run_until(board.clock.now_ps + 10**9)        # instead of board.run_until
"""

from __future__ import annotations

from emulator.board.board import Board
from emulator.chip.cpu.memory_map import RAM
from emulator.chip.firmware import ArmFirmware
from emulator.chip.gdb.core_target import CoreTarget
from emulator.chip.gdb.monitor import Monitor
from emulator.chip.gdb.server import GdbServer
from emulator.errors import InputError


def serve(board: Board, port: int, halted: bool = False) -> GdbServer:
    """Listen for a debugger on ``port`` of 127.0.0.1, 0 for one that is free (``server.port``).

    ``halted``: the firmware waits for the debugger before its first instruction. Raises InputError when the
    board's firmware is not for the chip, LinkError when the port cannot be had.
    """
    firmware = board.arm
    if firmware is None:
        raise InputError("--gdb: a debugger needs firmware built for the chip (ELF, HEX or BIN), not Python")
    core = firmware.chip.core
    target = CoreTarget(core, board.clock, board.run_until)
    monitor = Monitor(board.world, board.clock, core.all_blocks, lambda: where(firmware), target.reset)
    return GdbServer(target, monitor, port, halted)


def where(firmware: ArmFirmware) -> str:
    """The next instruction as address, function and source line, as far as the firmware's file tells."""
    core = firmware.chip.core
    address = core.pc
    known = firmware.image.symbols
    if known is None or _replaced(firmware):
        return f"0x{address:08X}"
    function, line = known.function_at(address), known.line_at(address)
    parts = [f"0x{address:08X}"]
    if function is not None:
        parts.append(f"in {function.name}")
    if line is not None:
        parts.append(f"at {line}")
    return " ".join(parts)


def _replaced(firmware: ArmFirmware) -> bool:
    """Whether a debugger has loaded another program into the flash."""
    engine = firmware.chip.core
    flashed = (segment for segment in firmware.image.segments if segment.address < RAM)
    return any(bytes(engine.memory(one.address, len(one.data)) or b"") != one.data for one in flashed)
