"""Timeline entries that happen at one moment, and the union of all kinds of entries."""

from __future__ import annotations

from typing import Annotated, ClassVar, Literal

from pydantic import Field, PlainSerializer, PlainValidator, WithJsonSchema, model_validator

from emulator.boards.fcu001v1 import profile
from emulator.buses.i2c import FaultKind, I2CFault
from emulator.scenario.board_view import BoardView
from emulator.scenario.entry import Entry
from emulator.scenario.motions import (
    ATTITUDE,
    DisturbField,
    FigureEight,
    FreeFall,
    Hold,
    Lift,
    PassMagnet,
    Replay,
    RotateTo,
    Shake,
    Sweep,
)
from emulator.scenario.setup import FieldTable
from emulator.scenario.tables import within
from emulator.scenario.units import Length
from emulator.time.clock import NEVER_PS
from emulator.time.durations import shown
from emulator.world import World, limits

ADDRESSES = profile("lab3").i2c2
LONGEST_INPUT = 4096  # characters of one send


class Jump(Entry):
    """A change of the world at one moment."""

    LIVE: ClassVar[bool] = True


class SetAttitude(Jump):
    """Another attitude without a motion in between."""

    do: Literal["set_attitude"]
    roll_deg: Annotated[float, within(limits.ANGLE)] = 0.0
    pitch_deg: Annotated[float, within(limits.ANGLE)] = 0.0
    yaw_deg: Annotated[float, within(limits.ANGLE)] = 0.0

    @property
    def moves(self) -> frozenset[str]:
        """The attitude."""
        return ATTITUDE

    def plan(self, world: World, start_s: float) -> None:
        """World.set_attitude."""
        del start_s
        world.set_attitude(self.roll_deg, self.pitch_deg, self.yaw_deg)


class SetPressure(Jump):
    """The weather's pressure at the board's altitude of that moment."""

    do: Literal["set_pressure"]
    pressure_hpa: Annotated[float, within(limits.PRESSURE)]

    def plan(self, world: World, start_s: float) -> None:
        """World.set_pressure."""
        del start_s
        world.set_pressure(self.pressure_hpa)


class SetTemperature(Jump):
    """The air's temperature."""

    do: Literal["set_temperature"]
    temperature_degc: Annotated[float, within(limits.TEMPERATURE)]

    def plan(self, world: World, start_s: float) -> None:
        """World.set_temperature."""
        del start_s
        world.set_temperature(self.temperature_degc)


class SetField(Jump):
    """Another field of the Earth."""

    do: Literal["set_field"]
    field: FieldTable

    def plan(self, world: World, start_s: float) -> None:
        """World.set_magnetic_field."""
        del start_s
        world.set_magnetic_field(self.field.north_ut, self.field.east_ut, self.field.down_ut)


def _parse_address(value: object) -> int:
    if isinstance(value, str) and value in ADDRESSES:
        return ADDRESSES[value]
    if isinstance(value, int) and not isinstance(value, bool) and 0 <= value <= 0x7F:
        return value
    names = ", ".join(f'"{name}"' for name in ADDRESSES)
    raise ValueError(f"is {shown(value)}; give {names}, or a 7-bit address such as 0x6B")


class Fault(Entry):
    """Break the sensor bus, for a time or for good; see I2CFault for the kinds."""

    do: Literal["fault"]
    kind: FaultKind
    for_: Length | None = Field(None, alias="for")
    address: (
        Annotated[
            int,
            PlainValidator(_parse_address),
            WithJsonSchema({"anyOf": [{"enum": [*ADDRESSES]}, {"type": "integer"}]}),
        ]
        | None
    ) = None
    byte_index: int = Field(0, ge=0, le=255)

    @property
    def length_ps(self) -> int:
        """As given; for good counts as a moment, so that the timeline goes on."""
        return self.for_ or 0

    def act(self, board: BoardView, from_ps: int) -> None:
        """Inject the rule."""
        until_ps = from_ps + self.for_ if self.for_ else NEVER_PS
        board.bus.inject(I2CFault(self.kind, from_ps, until_ps, self.address, self.byte_index))


def _parse_hex(value: object) -> bytes:
    try:
        if isinstance(value, str) and len(value) <= 3 * LONGEST_INPUT:
            return bytes.fromhex(value)
    except ValueError:
        pass
    raise ValueError(f'is {shown(value)}; give bytes in hexadecimal, such as "0d 0a"')


class Send(Entry):
    """Type on the terminal: a text (Latin-1) or bytes."""

    do: Literal["send"]
    text: str | None = Field(None, max_length=LONGEST_INPUT)
    hex: (
        Annotated[
            bytes,
            PlainValidator(_parse_hex),
            PlainSerializer(lambda data: data.hex(" ")),
            WithJsonSchema({"type": "string"}),
        ]
        | None
    ) = None

    @model_validator(mode="after")
    def _one_input(self) -> Send:
        if (self.text is None) == (self.hex is None):
            raise ValueError('needs either text = "..." or hex = "0d 0a"')
        if self.text is not None and any(ord(character) > 0xFF for character in self.text):
            raise ValueError("text has a character that is not Latin-1; send its bytes with hex")
        return self

    def act(self, board: BoardView, from_ps: int) -> None:
        """Type."""
        del from_ps
        board.terminal.write(self.text or self.hex or b"")


AnyEntry = Annotated[
    Hold
    | RotateTo
    | Sweep
    | FigureEight
    | Lift
    | FreeFall
    | Shake
    | DisturbField
    | PassMagnet
    | Replay
    | SetAttitude
    | SetPressure
    | SetTemperature
    | SetField
    | Fault
    | Send,
    Field(discriminator="do"),
]
