"""What a scenario needs of a board: enough to play the timeline and to judge what the firmware did.

Decision: the board loads a scenario by its name and brings itself to it, so a scenario knows a board only as
this. The road not taken, a board that knows a scenario only as a protocol, leaves nobody who may turn
``Board(scenario="stairs")`` into a file; a third room above both would be there for that one call.
"""

from __future__ import annotations

from typing import Any, Protocol

from emulator.buses.gpio import Led
from emulator.buses.i2c import I2CMaster
from emulator.buses.uart import Uart
from emulator.time.clock import Clock
from emulator.time.ticks import TickCounts
from emulator.trace import Trace
from emulator.world import World


class TerminalView(Protocol):
    """What has been printed, and a keyboard."""

    uart: Uart

    @property
    def text(self) -> str:
        """Everything printed since power-on, in Latin-1."""
        ...

    def since(self, position: int) -> tuple[bytes, int]:
        """The bytes printed after ``position``, and the position after them."""
        ...

    @property
    def typing_left(self) -> int:
        """How many typed bytes have not arrived yet."""
        ...

    def write(self, data: bytes | str) -> None:
        """Type."""
        ...


class BoardView(Protocol):
    """A board that plays a scenario; :class:`emulator.board.board.Board` is one."""

    clock: Clock
    world: World
    trace: Trace

    def i2c(self) -> I2CMaster:
        """The master of the board's first I2C bus, which a scenario may break."""
        ...

    def led(self, name: str) -> Led:
        """A LED by its name in the board's file."""
        ...

    @property
    def terminal(self) -> TerminalView:
        """At the other end of the serial line."""
        ...

    @property
    def timer(self) -> TickCounts:
        """The timer of the callback."""
        ...

    def motor_duties(self) -> tuple[float, ...]:
        """The duty of the PWM of each motor, 0 to 1."""
        ...

    def run_until_ps(self, at_ps: int) -> None:
        """Run up to and including ``at_ps`` picoseconds since power-on."""
        ...

    def variable(self, name: str) -> Any:
        """A global variable of the firmware by its C name. Raises KeyError."""
        ...
