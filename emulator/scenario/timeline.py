"""Timeline entries: motions of the board and of magnets near it, jumps of the world, bus faults, typing.

One class holds schema and behaviour of a kind of entry. To add a kind, write a class and add its name to the
union at the end. A motion calls the world's motion of the same name.
"""

from __future__ import annotations

from functools import partial
from typing import Annotated, ClassVar, Literal

from pydantic import (
    BeforeValidator,
    Field,
    PlainSerializer,
    PlainValidator,
    Strict,
    WithJsonSchema,
    model_validator,
)

from fcu_emulator.emulator.buses.i2c import FaultKind, I2CFault
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
from fcu_emulator.emulator.scenario.renamed import with_current_action
from fcu_emulator.emulator.scenario.run_view import BoardView
from fcu_emulator.emulator.text import shown
from fcu_emulator.emulator.time.clock import NEVER_PS, PS_PER_S, to_ps
from fcu_emulator.emulator.world import World, limits
from fcu_emulator.emulator.world.air import DOOR_HPA
from fcu_emulator.emulator.world.hand import TREMOR_HZ, TREMOR_MG, WRIST_M
from fcu_emulator.emulator.world.magnetism import MOMENT_AM2, Magnet

# -- Shared by all entries: start time, duration, moved quantities, action ----------------------------------


class TimelineAction(Table):
    """One ``[[timeline]]`` table."""

    LIVE: ClassVar[bool] = False
    """Whether the action can only be performed at its time (a jump of the world)."""

    MOVES: ClassVar[frozenset[str]] = frozenset()
    """The quantities that every entry of this kind moves."""

    at: Duration | None = None
    """Virtual time since power-on; without it, the end of the previous entry in the file."""

    interrupts: bool = False
    """Whether the entry may cut short a motion in progress; otherwise this is refused."""

    @property
    def length_ps(self) -> int:
        """Return the duration; 0 for an instantaneous action."""
        return 0

    @property
    def moves(self) -> frozenset[str]:
        """Return the moved quantities; each can follow only one motion at a time."""
        return self.MOVES

    def plan(self, world: World, start_s: float) -> None:
        """Change the world from ``start_s`` on. Raises InputError."""

    def act(self, board: BoardView, from_ps: int) -> None:
        """Perform the part of the action outside the world; the time is ``from_ps``."""


# -- Motions ------------------------------------------------------------------------------------------------


ATTITUDE = frozenset({"attitude"})
ALTITUDE = frozenset({"altitude"})
MAGNET = frozenset({"magnet"})
CATCH_PS = 50 * PS_PER_S // 1000
TAP_PS = 10 * PS_PER_S // 1000
HAND_PS = 100 * PS_PER_S // 1000


class MotionAction(TimelineAction):
    """Base class of actions with a given duration."""

    for_: Length = Field(alias="for")

    @property
    def length_ps(self) -> int:
        return self.for_

    @property
    def for_s(self) -> float:
        """Return the duration in seconds, as the world takes it."""
        return self.for_ / PS_PER_S


class Hold(MotionAction):
    """Let time pass without a motion."""

    do: Literal["hold"]


class RotateTo(MotionAction):
    """Rotate by the shortest arc, like a hand."""

    MOVES: ClassVar[frozenset[str]] = ATTITUDE
    do: Literal["rotate_to"]
    roll_deg: Annotated[float, within(limits.ANGLE)] = 0.0
    pitch_deg: Annotated[float, within(limits.ANGLE)] = 0.0
    yaw_deg: Annotated[float, within(limits.ANGLE)] = 0.0

    def plan(self, world: World, start_s: float) -> None:
        world.rotate_to(self.roll_deg, self.pitch_deg, self.yaw_deg, self.for_s, start_s)


class SweepAction(MotionAction):
    """Change one Euler angle over time."""

    MOVES: ClassVar[frozenset[str]] = ATTITUDE
    do: Literal["sweep"]
    axis: Literal["roll", "pitch", "yaw"]
    to_deg: Annotated[float, within(limits.ANGLE)]
    profile: Literal["linear", "minimum_jerk"] = "linear"

    def plan(self, world: World, start_s: float) -> None:
        world.sweep(self.axis, self.to_deg, self.for_s, start_s, self.profile)


class TurnOver(MotionAction):
    """Rotate by half a turn about the board's own X axis."""

    MOVES: ClassVar[frozenset[str]] = ATTITUDE
    do: Literal["turn_over"]

    def plan(self, world: World, start_s: float) -> None:
        world.turn_over(self.for_s, start_s)


class FigureEight(MotionAction):
    """Perform the calibration's figure-of-eight, ``turns`` times."""

    MOVES: ClassVar[frozenset[str]] = ATTITUDE
    do: Literal["figure_eight"]
    turns: int = Field(1, ge=1, le=100)
    by: Literal["field", "hand"] = "field"

    def plan(self, world: World, start_s: float) -> None:
        world.figure_eight(self.for_s, self.turns, start_s, self.by)


class LiftAction(MotionAction):
    """Raise the board, or lower it by negative metres."""

    MOVES: ClassVar[frozenset[str]] = ALTITUDE
    do: Literal["lift"]
    metres: Annotated[float, within(limits.ALTITUDE)]

    def plan(self, world: World, start_s: float) -> None:
        world.lift(self.metres, self.for_s, start_s)


class FreeFallAction(MotionAction):
    """Drop the board for a time, then catch it within the time ``catch``."""

    MOVES: ClassVar[frozenset[str]] = ALTITUDE
    do: Literal["free_fall"]
    catch: Length = CATCH_PS

    @property
    def length_ps(self) -> int:
        return self.for_ + self.catch

    def plan(self, world: World, start_s: float) -> None:
        world.free_fall(self.for_s, self.catch / PS_PER_S, start_s)


class ShakeAction(MotionAction):
    """Accelerate back and forth along a world axis, in addition to every other motion."""

    do: Literal["shake"]
    axis: Literal["north", "west", "up"]
    amplitude_g: Annotated[float, within(limits.AMPLITUDE)]
    frequency_hz: Annotated[float, within(limits.FREQUENCY)]

    def plan(self, world: World, start_s: float) -> None:
        world.shake(self.axis, self.amplitude_g, self.frequency_hz, self.for_s, start_s)


class TapAction(MotionAction):
    """Tap with a fingertip along a world axis, in addition to every other motion."""

    do: Literal["tap"]
    for_: Length = Field(TAP_PS, alias="for")
    axis: Literal["north", "west", "up"] = "up"
    amplitude_g: Annotated[float, within(limits.AMPLITUDE)] = 3.0

    def plan(self, world: World, start_s: float) -> None:
        world.tap(self.axis, self.amplitude_g, self.for_s, start_s)


class DisturbField(MotionAction):
    """Add a constant field to the Earth's for a time."""

    do: Literal["disturb_field"]
    field: FieldTable

    def plan(self, world: World, start_s: float) -> None:
        field = self.field
        world.disturb_field(field.north_ut, field.east_ut, field.down_ut, self.for_s, start_s)


class PassMagnet(TimelineAction):
    """Move a magnet past the board; distance and speed set the duration."""

    do: Literal["pass_magnet"]
    moment_am2: Annotated[float, within(limits.MOMENT)]
    distance_m: Annotated[float, within(limits.DISTANCE)]
    speed_m_s: Annotated[float, within(limits.SPEED)]

    @property
    def length_ps(self) -> int:
        """Return the time from one end of the magnet's range to the other."""
        magnet = Magnet.starting_at(0.0, self.moment_am2, self.distance_m, self.speed_m_s)
        return to_ps(2.0 * magnet.closest_s)

    def plan(self, world: World, start_s: float) -> None:
        world.pass_magnet(self.moment_am2, self.distance_m, self.speed_m_s, start_s)


class Weather(MotionAction):
    """Raise or lower the air's pressure smoothly."""

    MOVES: ClassVar[frozenset[str]] = frozenset({"weather"})
    do: Literal["change_pressure"]
    change_hpa: Annotated[float, within(limits.PRESSURE_CHANGE)]

    def plan(self, world: World, start_s: float) -> None:
        world.change_weather(self.change_hpa, self.for_s, start_s)


class Blow(MotionAction):
    """Add pressure noise of a gusty wind."""

    do: Literal["blow_wind"]
    speed_m_s: Annotated[float, within(limits.WIND)]

    def plan(self, world: World, start_s: float) -> None:
        world.blow(self.speed_m_s, self.for_s, start_s)


class ShutDoor(TimelineAction):
    """Shut a door, or tear it open with a negative push."""

    do: Literal["slam_door"]
    push_hpa: Annotated[float, within(limits.PUSH)] = DOOR_HPA

    def plan(self, world: World, start_s: float) -> None:
        world.shut_door(self.push_hpa, start_s)


class Replay(TimelineAction):
    """Replay a recording's signals, or follow its attitude; the path is relative to the scenario's folder."""

    do: Literal["replay"]
    csv: RecordingFile

    @property
    def length_ps(self) -> int:
        return to_ps(float(self.csv.content.t_s[-1]))

    @property
    def moves(self) -> frozenset[str]:
        """Return the quantities of its columns; measured signals count as separate motions."""
        return frozenset(self.csv.content.groups)

    def plan(self, world: World, start_s: float) -> None:
        world.replay(self.csv.content, start_s)


class TakeInHand(TimelineAction):
    """Let a hand hold the board from now on: it turns about the wrist, and trembles."""

    MOVES: ClassVar[frozenset[str]] = ALTITUDE
    do: Literal["take_in_hand"]
    wrist_m: Vector = WRIST_M
    tremor_mg: Annotated[float, within(limits.TREMOR)] = TREMOR_MG
    tremor_hz: Annotated[float, within(limits.TREMOR_FREQUENCY)] = TREMOR_HZ

    def plan(self, world: World, start_s: float) -> None:
        world.take_in_hand(self.wrist_m, self.tremor_mg, self.tremor_hz, start_s)


class PutDown(TimelineAction):
    """Put the board down: it is not held by a hand from now on."""

    MOVES: ClassVar[frozenset[str]] = ALTITUDE
    do: Literal["put_down"]

    def plan(self, world: World, start_s: float) -> None:
        world.put_down(start_s)


Share = Annotated[float, within(limits.THROTTLE)]
FOLLOWED_EVERY_PS = 10 * PS_PER_S // 1000


class RunMotors(TimelineAction):
    """Run the four motors from now on: one throttle for all, four, or the firmware's PWM."""

    LIVE: ClassVar[bool] = True
    MOVES: ClassVar[frozenset[str]] = frozenset({"motors"})
    do: Literal["run_motors"]
    throttle: Share | Annotated[tuple[Share, Share, Share, Share], Strict(False)] | Literal["firmware"]

    def plan(self, world: World, start_s: float) -> None:
        """Call World.run_motors for given throttles; the firmware's PWM is not known ahead."""
        world.run_motors(0.0 if self.throttle == "firmware" else self.throttle, start_s)

    def act(self, board: BoardView, from_ps: int) -> None:
        """Follow the firmware's PWM, 100 times a second."""
        if self.throttle == "firmware":
            follow_motors(board, from_ps, board.world.throttle)


def follow_motors(board: BoardView, at_ps: int, before: tuple[float, ...]) -> None:
    """Set the motors to the PWM at ``at_ps`` and keep following it, until another action sets the motors."""
    if board.world.throttle != before:
        return
    duties = board.motor_duties()
    if duties != before:
        board.world.run_motors(duties)
    next_ps = at_ps + FOLLOWED_EVERY_PS
    board.clock.schedule(next_ps, partial(follow_motors, board, next_ps, duties))


# -- What happens at one moment -----------------------------------------------------------------------------


LONGEST_INPUT = 4096  # limit for the text of one send


class Jump(TimelineAction):
    """A change of the world at one moment."""

    LIVE: ClassVar[bool] = True


class SetAttitude(Jump):
    """Set another attitude without a motion in between."""

    MOVES: ClassVar[frozenset[str]] = ATTITUDE
    do: Literal["set_attitude"]
    roll_deg: Annotated[float, within(limits.ANGLE)] = 0.0
    pitch_deg: Annotated[float, within(limits.ANGLE)] = 0.0
    yaw_deg: Annotated[float, within(limits.ANGLE)] = 0.0

    def plan(self, world: World, start_s: float) -> None:
        del start_s
        world.set_attitude(self.roll_deg, self.pitch_deg, self.yaw_deg)


class Hand(Jump):
    """A motion by hand: rate and acceleration are continuous over successive commands."""

    interrupts: bool = True
    time_constant: Length = HAND_PS

    @property
    def time_constant_s(self) -> float:
        return self.time_constant / PS_PER_S


class FollowAttitude(Hand):
    """Turn towards an attitude until another one is given."""

    MOVES: ClassVar[frozenset[str]] = ATTITUDE
    do: Literal["follow_attitude"]
    roll_deg: Annotated[float, within(limits.ANGLE)] = 0.0
    pitch_deg: Annotated[float, within(limits.ANGLE)] = 0.0
    yaw_deg: Annotated[float, within(limits.ANGLE)] = 0.0

    def plan(self, world: World, start_s: float) -> None:
        angles = self.roll_deg, self.pitch_deg, self.yaw_deg
        world.follow_attitude(*angles, self.time_constant_s, start_s)


class FollowAltitude(Hand):
    """Rise or sink towards a height above the floor until another one is given."""

    MOVES: ClassVar[frozenset[str]] = ALTITUDE
    do: Literal["follow_altitude"]
    metres: Annotated[float, within(limits.ALTITUDE)]

    def plan(self, world: World, start_s: float) -> None:
        world.follow_altitude(self.metres, self.time_constant_s, start_s)


class FollowMagnet(Hand):
    """Move a magnet to a place relative to the board until another one is given."""

    MOVES: ClassVar[frozenset[str]] = MAGNET
    do: Literal["follow_magnet"]
    north_m: Annotated[float, within(limits.PLACE)] = 0.0
    west_m: Annotated[float, within(limits.PLACE)] = 0.0
    up_m: Annotated[float, within(limits.PLACE)] = 0.0
    moment_am2: Annotated[float, within(limits.MOMENT)] = MOMENT_AM2

    def plan(self, world: World, start_s: float) -> None:
        place = self.north_m, self.west_m, self.up_m
        world.follow_magnet(*place, self.moment_am2, self.time_constant_s, start_s)


class TakeMagnetAway(Jump):
    """Take the hand-held magnet away from the board."""

    MOVES: ClassVar[frozenset[str]] = MAGNET
    do: Literal["take_magnet_away"]

    def plan(self, world: World, start_s: float) -> None:
        world.take_magnet_away(start_s)


class SetPressure(Jump):
    """Set the weather's pressure at the board's current altitude."""

    do: Literal["set_pressure"]
    pressure_hpa: Annotated[float, within(limits.PRESSURE)]

    def plan(self, world: World, start_s: float) -> None:
        del start_s
        world.set_pressure(self.pressure_hpa)


class SetTemperature(Jump):
    """Set the air's temperature."""

    do: Literal["set_temperature"]
    temperature_degc: Annotated[float, within(limits.TEMPERATURE)]

    def plan(self, world: World, start_s: float) -> None:
        del start_s
        world.set_temperature(self.temperature_degc)


class SetHumidity(Jump):
    """Set the air's relative humidity."""

    do: Literal["set_humidity"]
    humidity_percent: Annotated[float, within(limits.HUMIDITY)]

    def plan(self, world: World, start_s: float) -> None:
        del start_s
        world.set_humidity(self.humidity_percent)


class SetField(Jump):
    """Set another field of the Earth."""

    do: Literal["set_field"]
    field: FieldTable

    def plan(self, world: World, start_s: float) -> None:
        del start_s
        world.set_magnetic_field(self.field.north_ut, self.field.east_ut, self.field.down_ut)


class FaultAction(TimelineAction):
    """Break the sensor bus, for a time or permanently; see I2CFault for the kinds."""

    do: Literal["inject_fault"]
    kind: FaultKind
    for_: Length | None = Field(None, alias="for")
    address: Address | None = None
    byte_index: int = Field(0, ge=0, le=255)

    @property
    def length_ps(self) -> int:
        """Return the given duration; a permanent fault counts as a moment, so that the timeline continues."""
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
            raise ValueError("text must have Latin-1 characters only; send other bytes with hex")
        return self

    def act(self, board: BoardView, from_ps: int) -> None:
        del from_ps
        board.terminal.write(self.text or self.hex or b"")


AnyEntry = Annotated[
    Hold
    | RotateTo
    | SweepAction
    | TurnOver
    | FigureEight
    | LiftAction
    | FreeFallAction
    | ShakeAction
    | TapAction
    | DisturbField
    | PassMagnet
    | Weather
    | Blow
    | ShutDoor
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
    | FaultAction
    | Send,
    Field(discriminator="do"),
    BeforeValidator(with_current_action),
]
