"""A debugger's server for compiled firmware, and the ``monitor`` commands."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from typing import Protocol

from fcu_emulator.emulator.chip.firmware import ArmFirmware
from fcu_emulator.emulator.chip.gdb.core_target import CoreTarget
from fcu_emulator.emulator.chip.gdb.server import GdbServer
from fcu_emulator.emulator.chip.history import History, RestorableBoard
from fcu_emulator.emulator.chip.memory_map import RAM
from fcu_emulator.emulator.chip.peripherals.peripheral import Peripheral
from fcu_emulator.emulator.clock import PS_PER_S, Clock
from fcu_emulator.emulator.errors import InputError
from fcu_emulator.emulator.world import World


class DebuggedBoard(RestorableBoard, Protocol):
    """A board such as :class:`fcu_emulator.emulator.assembly.board.Board`."""

    chip: ArmFirmware | None
    world: World


def serve(board: DebuggedBoard, port: int, halted: bool = False) -> GdbServer:
    """Listen for a debugger on ``port`` of 127.0.0.1; 0 selects a free port.

    Call the server's ``run_until`` instead of the board's. If ``halted`` is set, the chip waits
    before its first instruction. Raises InputError without compiled firmware, and LinkError for an
    unavailable port.
    """
    firmware = board.chip
    if firmware is None:
        raise InputError(
            "--gdb must have firmware built for the chip (ELF, HEX or BIN), not in Python",
            kind="no_chip",
        )
    core = firmware.chip.core
    target = CoreTarget(core, board.clock, board.run_until_ps, lambda: History(board, firmware))
    monitor = Monitor(board.world, board.clock, core.all_peripherals, lambda: where(firmware), target.reset)
    return GdbServer(target, monitor, port, halted)


def where(firmware: ArmFirmware) -> str:
    """Return the next instruction's address, function and source line."""
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
    engine = firmware.chip.core
    flashed = (segment for segment in firmware.image.segments if segment.address < RAM)
    return any(bytes(engine.memory(one.address, len(one.data)) or b"") != one.data for one in flashed)


# -- the ``monitor`` commands -------------------------------------------------------------------------------

_HELP = """\
attitude ROLL PITCH YAW  turn the board (degrees); without angles: print the attitude
time                     virtual time since power-on
where                    function and source line of the next instruction
regs PERIPHERAL          registers of a peripheral, read without side effects; without a name: list the peripherals
reset                    reset the chip and halt it; then: maintenance flush register-cache
"""


class Monitor:
    """Executes ``monitor`` commands. The answer to an invalid command is an error message."""

    def __init__(
        self,
        world: World,
        clock: Clock,
        peripherals: Iterable[Peripheral],
        where: Callable[[], str],
        reset: Callable[[], None],
    ) -> None:
        self._world = world
        self._clock = clock
        self._peripherals: Mapping[str, Peripheral] = {
            peripheral.name.upper(): peripheral for peripheral in peripherals
        }
        self._where = where
        self._reset = reset
        self._commands: dict[str, Callable[[list[str]], str]] = {
            "help": lambda _: _HELP,
            "attitude": self._attitude,
            "time": lambda _: self._time(),
            "where": lambda _: f"{self._where()}\n",
            "regs": self._registers,
            "reset": self._reset_chip,
        }

    def __call__(self, command: str) -> str:
        name, *arguments = command.split() or ["help"]
        carry_out = self._commands.get(name)
        if carry_out is None:
            return f"unknown command {name[:40]!r}; known: {', '.join(self._commands)}\n"
        try:
            return carry_out(arguments)
        except InputError as error:
            return f"{error}\n"

    def _attitude(self, arguments: list[str]) -> str:
        if arguments:
            try:
                roll_deg, pitch_deg, yaw_deg = map(float, arguments)
            except ValueError:
                return "attitude must have three angles in degrees: monitor attitude ROLL PITCH YAW\n"
            self._world.set_attitude(roll_deg, pitch_deg, yaw_deg)
        now_s = self._clock.now_s
        roll_deg, pitch_deg, yaw_deg = self._world.attitude_deg(now_s)[0]
        return f"roll {roll_deg:.3f} deg, pitch {pitch_deg:.3f} deg, yaw {yaw_deg:.3f} deg\n"

    def _time(self) -> str:
        return f"{self._clock.now_ps / PS_PER_S:.9f} s\n"

    def _registers(self, arguments: list[str]) -> str:
        if not arguments:
            return f"{' '.join(self._peripherals)}\n"
        peripheral = self._peripherals.get(arguments[0].upper())
        if peripheral is None:
            return f"unknown peripheral {arguments[0][:40]!r}; known: {', '.join(self._peripherals)}\n"
        names = peripheral.NAMES or {offset: f"0x{offset:03X}" for offset in peripheral.REGISTERS}
        lines = [f"{name:<10} 0x{peripheral.peek(offset):08X}" for offset, name in names.items()]
        if not peripheral.clocked:
            lines.insert(0, f"{peripheral.name} has no clock: its enable bit in RCC is not set")
        return "".join(f"{line}\n" for line in lines or [f"{peripheral.name} is not modelled"])

    def _reset_chip(self, arguments: list[str]) -> str:
        """Reset the chip and halt it; ``reset halt`` and ``reset init`` do the same."""
        del arguments
        self._reset()
        return "the chip has been reset and is halted\n"
