"""Timeline entries: motions, jumps of the world, bus faults, typing.

Most entries are calls of a method of :class:`fcu_emulator.emulator.world.World`.
"""

from __future__ import annotations

from functools import partial
from typing import Annotated, Any, ClassVar, Literal

from pydantic import (
    AfterValidator,
    BeforeValidator,
    Field,
    PlainSerializer,
    PlainValidator,
    Strict,
    WithJsonSchema,
    model_validator,
)

from fcu_emulator.emulator.buses.gpio import BUTTON_S, parse_pin
from fcu_emulator.emulator.buses.i2c import FaultKind, I2CFault
from fcu_emulator.emulator.clock import NEVER_PS, PS_PER_S, to_ps
from fcu_emulator.emulator.renamed import current_name
from fcu_emulator.emulator.scenario.fields import (
    Address,
    Duration,
    FieldTable,
    Length,
    RecordingFile,
    Table,
    Vector,
    within,
)
from fcu_emulator.emulator.scenario.run_view import BoardView
from fcu_emulator.emulator.text import shown
from fcu_emulator.emulator.world import World, limits
from fcu_emulator.emulator.world.air import DOOR_HPA
from fcu_emulator.emulator.world.hand import TREMOR_HZ, TREMOR_MG, WRIST_M
from fcu_emulator.emulator.world.magnetism import MOMENT_AM2, Magnet

# -- Shared by all entries: start time, duration, moved quantities, action ----------------------------------


class TimelineAction(Table):
    """One entry ``[[timeline]]`` of a scenario."""

    LIVE: ClassVar[bool] = False
    """Whether the action must be performed at its time and not planned (a jump)."""

    MOVES: ClassVar[frozenset[str]] = frozenset()
    """Quantities that every entry of this kind moves."""

    at: Duration | None = None
    """Virtual time; by default the end of the previous entry."""

    interrupts: bool = False
    """Whether the entry may end another motion early."""

    @property
    def length_ps(self) -> int:
        """Return the duration, 0 for a jump."""
        return 0

    @property
    def moves(self) -> frozenset[str]:
        """Return the moved quantities. Motions of the same quantity must not overlap."""
        return self.MOVES

    def plan(self, world: World, start_s: float) -> None:
        """Change the world from the time ``start_s`` on. Raises InputError."""

    def act(self, board: BoardView, from_ps: int) -> None:
        """Perform the part of the action that does not change the world."""

    def perform(self, board: BoardView, at_ps: int) -> None:
        """Perform the whole action now. Raises InputError."""
        self.plan(board.world, at_ps / PS_PER_S)
        self.act(board, at_ps)


DURATIONS = {"for_": "duration_s", "catch": "catch_s", "time_constant": "time_constant_s"}
"""Keys of durations, with the names of the world's arguments in seconds."""


class WorldAction(TimelineAction):
    """A call of the world's method with the name of this action."""

    def arguments(self) -> dict[str, Any]:
        """Return the method's arguments without the time."""
        found: dict[str, Any] = {}
        for key, value in self:
            if isinstance(value, FieldTable):
                found.update(value)
            elif key in DURATIONS:
                found[DURATIONS[key]] = value / PS_PER_S
            elif key != "do" and key not in TimelineAction.model_fields:
                found[key] = value
        return found

    def plan(self, world: World, start_s: float) -> None:
        getattr(world, dict(self)["do"])(**self.arguments(), start_s=start_s)


# -- Motions ------------------------------------------------------------------------------------------------


ATTITUDE = frozenset({"attitude"})
ALTITUDE = frozenset({"altitude"})
PLACE = frozenset({"place"})
MAGNET = frozenset({"magnet"})
CATCH_PS = 50 * PS_PER_S // 1000
TAP_PS = 10 * PS_PER_S // 1000
HAND_PS = 100 * PS_PER_S // 1000


class MotionAction(WorldAction):
    """An action with a given duration."""

    for_: Length = Field(alias="for")

    @property
    def length_ps(self) -> int:
        return self.for_


class Hold(MotionAction):
    """Let time pass without a motion."""

    do: Literal["hold"]

    def plan(self, world: World, start_s: float) -> None:
        """Change nothing, because only time passes."""


class RotateTo(MotionAction):
    """Rotate by the shortest arc, as a hand does."""

    MOVES: ClassVar[frozenset[str]] = ATTITUDE
    do: Literal["rotate_to"]
    roll_deg: Annotated[float, within(limits.ANGLE)] = 0.0
    pitch_deg: Annotated[float, within(limits.ANGLE)] = 0.0
    yaw_deg: Annotated[float, within(limits.ANGLE)] = 0.0


class Sweep(MotionAction):
    """Change one Euler angle over time."""

    MOVES: ClassVar[frozenset[str]] = ATTITUDE
    do: Literal["sweep"]
    axis: Literal["roll", "pitch", "yaw"]
    to_deg: Annotated[float, within(limits.ANGLE)]
    profile: Literal["linear", "minimum_jerk"] = "linear"


class TurnOver(MotionAction):
    """Rotate by half a turn about the board's X axis."""

    MOVES: ClassVar[frozenset[str]] = ATTITUDE
    do: Literal["turn_over"]


class FigureEight(MotionAction):
    """Perform the figure-of-eight of the calibration ``turns`` times."""

    MOVES: ClassVar[frozenset[str]] = ATTITUDE
    do: Literal["figure_eight"]
    turns: int = Field(1, ge=1, le=100)
    by: Literal["field", "hand"] = "field"


class Lift(MotionAction):
    """Raise the board, or lower it by negative metres."""

    MOVES: ClassVar[frozenset[str]] = ALTITUDE
    do: Literal["lift"]
    metres: Annotated[float, within(limits.ALTITUDE)]


class Move(MotionAction):
    """Push the board in a straight line by a distance."""

    do: Literal["move"]
    north_m: Annotated[float, within(limits.WAY)] = 0.0
    east_m: Annotated[float, within(limits.WAY)] = 0.0
    up_m: Annotated[float, within(limits.ALTITUDE)] = 0.0

    @property
    def moves(self) -> frozenset[str]:
        return PLACE | ALTITUDE if self.up_m else PLACE


class FreeFall(MotionAction):
    """Let the board fall, then catch it within ``catch``."""

    MOVES: ClassVar[frozenset[str]] = ALTITUDE
    do: Literal["free_fall"]
    catch: Length = CATCH_PS

    @property
    def length_ps(self) -> int:
        return self.for_ + self.catch


class Shake(MotionAction):
    """Add an acceleration back and forth along a world axis."""

    do: Literal["shake"]
    axis: Literal["north", "west", "up"]
    amplitude_g: Annotated[float, within(limits.AMPLITUDE)]
    frequency_hz: Annotated[float, within(limits.FREQUENCY)]


class Tap(MotionAction):
    """Add the tap of a fingertip along a world axis."""

    do: Literal["tap"]
    for_: Length = Field(TAP_PS, alias="for")
    axis: Literal["north", "west", "up"] = "up"
    amplitude_g: Annotated[float, within(limits.AMPLITUDE)] = 3.0


class DisturbField(MotionAction):
    """Add a constant field to the Earth's field for a time."""

    do: Literal["disturb_field"]
    field: FieldTable


class PassMagnet(WorldAction):
    """Move a magnet past the board. Distance and speed determine the duration."""

    do: Literal["pass_magnet"]
    moment_am2: Annotated[float, within(limits.MOMENT)]
    distance_m: Annotated[float, within(limits.DISTANCE)]
    speed_m_s: Annotated[float, within(limits.SPEED)]

    @property
    def length_ps(self) -> int:
        """Return the time in which the magnet is in range."""
        magnet = Magnet.starting_at(0.0, self.moment_am2, self.distance_m, self.speed_m_s)
        return to_ps(2.0 * magnet.closest_s)


class ChangePressure(MotionAction):
    """Raise or lower the air pressure smoothly."""

    MOVES: ClassVar[frozenset[str]] = frozenset({"weather"})
    do: Literal["change_pressure"]
    change_hpa: Annotated[float, within(limits.PRESSURE_CHANGE)]


class BlowWind(MotionAction):
    """Add the pressure noise of a gusty wind."""

    do: Literal["blow_wind"]
    speed_m_s: Annotated[float, within(limits.WIND)]


class SlamDoor(WorldAction):
    """Shut a door, or open it suddenly with a negative push."""

    do: Literal["slam_door"]
    push_hpa: Annotated[float, within(limits.PUSH)] = DOOR_HPA


class Replay(WorldAction):
    """Replay the signals of a recording, or follow the recording's attitude."""

    do: Literal["replay"]
    csv: RecordingFile

    @property
    def length_ps(self) -> int:
        return to_ps(float(self.csv.content.t_s[-1]))

    @property
    def moves(self) -> frozenset[str]:
        """Return the quantities of the columns. Measured signals count as separate motions."""
        return frozenset(self.csv.content.groups)

    def plan(self, world: World, start_s: float) -> None:
        world.replay(self.csv.content, start_s)


class TakeInHand(WorldAction):
    """Let a trembling hand hold the board and turn it about the wrist."""

    MOVES: ClassVar[frozenset[str]] = PLACE | ALTITUDE
    do: Literal["take_in_hand"]
    wrist_m: Vector = WRIST_M
    tremor_mg: Annotated[float, within(limits.TREMOR)] = TREMOR_MG
    tremor_hz: Annotated[float, within(limits.TREMOR_FREQUENCY)] = TREMOR_HZ


class PutDown(WorldAction):
    """Put the board down, out of the hand."""

    MOVES: ClassVar[frozenset[str]] = PLACE | ALTITUDE
    do: Literal["put_down"]


Share = Annotated[float, within(limits.THROTTLE)]
FOLLOWED_EVERY_PS = 10 * PS_PER_S // 1000


class RunMotors(WorldAction):
    """Run the motors from now on with one throttle, with four throttles, or with the firmware's PWM."""

    LIVE: ClassVar[bool] = True
    MOVES: ClassVar[frozenset[str]] = frozenset({"motors"})
    do: Literal["run_motors"]
    throttle: Share | Annotated[tuple[Share, Share, Share, Share], Strict(False)] | Literal["firmware"]

    def plan(self, world: World, start_s: float) -> None:
        """Plan the throttles of the file. The firmware's PWM is not known in advance."""
        world.run_motors(0.0 if self.throttle == "firmware" else self.throttle, start_s)

    def act(self, board: BoardView, from_ps: int) -> None:
        """Set the throttles from the firmware's PWM, 100 times a second."""
        if self.throttle == "firmware":
            follow_motors(board, from_ps, board.world.throttle)


def follow_motors(board: BoardView, at_ps: int, before: tuple[float, ...]) -> None:
    """Set the motors from the PWM, until another action sets them."""
    if board.world.throttle != before:
        return
    duties = board.motor_duties()
    if duties != before:
        board.world.run_motors(duties)
    next_ps = at_ps + FOLLOWED_EVERY_PS
    board.clock.schedule(next_ps, partial(follow_motors, board, next_ps, duties))


# -- What happens at one moment -----------------------------------------------------------------------------


LONGEST_INPUT = 4096  # bytes of one ``send``


class Jump(WorldAction):
    """A change of the world at one moment."""

    LIVE: ClassVar[bool] = True


class Setter(Jump):
    """A value that changes without a motion."""

    def plan(self, world: World, start_s: float) -> None:
        """Pass arguments by position, because the parameters of the world's method have shorter names."""
        del start_s
        getattr(world, dict(self)["do"])(*self.arguments().values())


class SetAttitude(Setter):
    """Set another attitude without a motion in between."""

    MOVES: ClassVar[frozenset[str]] = ATTITUDE
    do: Literal["set_attitude"]
    roll_deg: Annotated[float, within(limits.ANGLE)] = 0.0
    pitch_deg: Annotated[float, within(limits.ANGLE)] = 0.0
    yaw_deg: Annotated[float, within(limits.ANGLE)] = 0.0


class FollowAction(Jump):
    """A motion by hand. It is continuous from one command to the next."""

    interrupts: bool = True
    time_constant: Length = HAND_PS


class FollowAttitude(FollowAction):
    """Turn towards an attitude until the next command."""

    MOVES: ClassVar[frozenset[str]] = ATTITUDE
    do: Literal["follow_attitude"]
    roll_deg: Annotated[float, within(limits.ANGLE)] = 0.0
    pitch_deg: Annotated[float, within(limits.ANGLE)] = 0.0
    yaw_deg: Annotated[float, within(limits.ANGLE)] = 0.0


class FollowAltitude(FollowAction):
    """Rise or sink towards a height above the floor until the next command."""

    MOVES: ClassVar[frozenset[str]] = ALTITUDE
    do: Literal["follow_altitude"]
    metres: Annotated[float, within(limits.ALTITUDE)]


class FollowMagnet(FollowAction):
    """Move a magnet to a place relative to the board until the next command."""

    MOVES: ClassVar[frozenset[str]] = MAGNET
    do: Literal["follow_magnet"]
    north_m: Annotated[float, within(limits.PLACE)] = 0.0
    west_m: Annotated[float, within(limits.PLACE)] = 0.0
    up_m: Annotated[float, within(limits.PLACE)] = 0.0
    moment_am2: Annotated[float, within(limits.MOMENT)] = MOMENT_AM2


class TakeMagnetAway(Jump):
    """Take the hand-held magnet away from the board."""

    MOVES: ClassVar[frozenset[str]] = MAGNET
    do: Literal["take_magnet_away"]


class SetPressure(Setter):
    """Set the weather so that the pressure at the board's current altitude has this value."""

    do: Literal["set_pressure"]
    pressure_hpa: Annotated[float, within(limits.PRESSURE)]


class SetTemperature(Setter):
    """Set the temperature of the air."""

    do: Literal["set_temperature"]
    temperature_degc: Annotated[float, within(limits.TEMPERATURE)]


class SetHumidity(Setter):
    """Set the relative humidity of the air."""

    do: Literal["set_humidity"]
    humidity_percent: Annotated[float, within(limits.HUMIDITY)]


class SetField(Setter):
    """Set another field of the Earth."""

    do: Literal["set_field"]
    field: FieldTable

    def plan(self, world: World, start_s: float) -> None:
        del start_s
        world.set_magnetic_field(**self.arguments())


class InjectFault(TimelineAction):
    """Break the sensor bus, for a time or permanently (see I2CFault)."""

    do: Literal["inject_fault"]
    kind: FaultKind
    for_: Length | None = Field(None, alias="for")
    address: Address | None = None
    byte_index: int = Field(0, ge=0, le=255)

    @property
    def length_ps(self) -> int:
        """Return the duration, or 0 for a permanent fault."""
        return self.for_ or 0

    def act(self, board: BoardView, from_ps: int) -> None:
        until_ps = from_ps + self.for_ if self.for_ else NEVER_PS
        board.i2c().inject(I2CFault.in_ps(self.kind, from_ps, until_ps, self.address, self.byte_index))


def _parse_hex(value: object) -> bytes:
    try:
        if isinstance(value, str) and len(value) <= 3 * LONGEST_INPUT:
            return bytes.fromhex(value)
    except ValueError:
        pass
    raise ValueError(f'must be bytes in hexadecimal, such as "0d 0a", not {shown(value)}')


class Send(TimelineAction):
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
            raise ValueError('must have either text = "..." or hex = "0d 0a"')
        if self.text is not None and any(ord(character) > 0xFF for character in self.text):
            raise ValueError("'text' must have Latin-1 characters only; send other bytes with 'hex'")
        return self

    def act(self, board: BoardView, from_ps: int) -> None:
        del from_ps
        board.terminal.write(self.text or self.hex or b"")


def _pin_name(name: str) -> str:
    parse_pin(name)
    return name


class PressButton(TimelineAction):
    """Press a button between a pin of the chip and ground, or the supply with ``level`` 1."""

    do: Literal["press_button"]
    pin: Annotated[str, AfterValidator(_pin_name)]
    level: Annotated[int, Field(ge=0, le=1)] = 0
    for_: Length = Field(to_ps(BUTTON_S), alias="for")

    @property
    def length_ps(self) -> int:
        return self.for_

    def act(self, board: BoardView, from_ps: int) -> None:
        """Press the button now. The board releases it at the end of the action."""
        del from_ps
        board.press_button(self.pin, self.level, self.for_ / PS_PER_S)


_RENAMED = {"weather": "change_pressure", "wind": "blow_wind", "door": "slam_door", "fault": "inject_fault"}


def _with_current_action(entry: Any) -> Any:
    if isinstance(entry, dict) and str(entry.get("do")) in _RENAMED:
        return {**entry, "do": current_name(entry["do"], _RENAMED)}
    return entry


AnyEntry = Annotated[
    Hold
    | RotateTo
    | Sweep
    | TurnOver
    | FigureEight
    | Lift
    | Move
    | FreeFall
    | Shake
    | Tap
    | DisturbField
    | PassMagnet
    | ChangePressure
    | BlowWind
    | SlamDoor
    | Replay
    | TakeInHand
    | PutDown
    | RunMotors
    | SetAttitude
    | FollowAttitude
    | FollowAltitude
    | FollowMagnet
    | TakeMagnetAway
    | SetPressure
    | SetTemperature
    | SetHumidity
    | SetField
    | InjectFault
    | PressButton
    | Send,
    Field(discriminator="do"),
    BeforeValidator(_with_current_action),
]
