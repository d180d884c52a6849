"""Timeline entries that move the board, and magnets near it: the world's motions, under their own names."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, PlainSerializer, PlainValidator, ValidationInfo, WithJsonSchema

from emulator.errors import RecordingError
from emulator.scenario.entry import Entry
from emulator.scenario.setup import FieldTable
from emulator.scenario.tables import folder_of, within
from emulator.scenario.units import Length
from emulator.time.clock import PS_PER_S, to_ps
from emulator.time.durations import shown
from emulator.world import Recording, World, limits, load_recording
from emulator.world.magnetism import Magnet

ATTITUDE = frozenset({"attitude"})
ALTITUDE = frozenset({"altitude"})
CATCH_PS = 50 * PS_PER_S // 1000


class Motion(Entry):
    """Something that takes a given time."""

    for_: Length = Field(alias="for")

    @property
    def length_ps(self) -> int:
        """As given."""
        return self.for_

    @property
    def for_s(self) -> float:
        """The duration as the world takes it."""
        return self.for_ / PS_PER_S


class Hold(Motion):
    """Let time pass."""

    do: Literal["hold"]


class RotateTo(Motion):
    """Turn by the shortest arc, as a hand does."""

    do: Literal["rotate_to"]
    roll_deg: Annotated[float, within(limits.ANGLE)] = 0.0
    pitch_deg: Annotated[float, within(limits.ANGLE)] = 0.0
    yaw_deg: Annotated[float, within(limits.ANGLE)] = 0.0

    @property
    def moves(self) -> frozenset[str]:
        """The attitude."""
        return ATTITUDE

    def plan(self, world: World, start_s: float) -> None:
        """World.rotate_to."""
        world.rotate_to(self.roll_deg, self.pitch_deg, self.yaw_deg, self.for_s, start_s)


class Sweep(Motion):
    """Change one Euler angle."""

    do: Literal["sweep"]
    axis: Literal["roll", "pitch", "yaw"]
    to_deg: Annotated[float, within(limits.ANGLE)]
    profile: Literal["linear", "minimum_jerk"] = "linear"

    @property
    def moves(self) -> frozenset[str]:
        """The attitude."""
        return ATTITUDE

    def plan(self, world: World, start_s: float) -> None:
        """World.sweep."""
        world.sweep(self.axis, self.to_deg, self.for_s, start_s, self.profile)


class FigureEight(Motion):
    """The calibration's figure-of-eight, ``turns`` times."""

    do: Literal["figure_eight"]
    turns: int = Field(1, ge=1, le=100)

    @property
    def moves(self) -> frozenset[str]:
        """The attitude."""
        return ATTITUDE

    def plan(self, world: World, start_s: float) -> None:
        """World.figure_eight."""
        world.figure_eight(self.for_s, self.turns, start_s)


class Lift(Motion):
    """Raise the board, or lower it by negative metres."""

    do: Literal["lift"]
    metres: Annotated[float, within(limits.ALTITUDE)]

    @property
    def moves(self) -> frozenset[str]:
        """The altitude."""
        return ALTITUDE

    def plan(self, world: World, start_s: float) -> None:
        """World.lift."""
        world.lift(self.metres, self.for_s, start_s)


class FreeFall(Motion):
    """Let go for a time, then be caught in the time ``catch``."""

    do: Literal["free_fall"]
    catch: Length = CATCH_PS

    @property
    def length_ps(self) -> int:
        """The fall and the catch."""
        return self.for_ + self.catch

    @property
    def moves(self) -> frozenset[str]:
        """The altitude."""
        return ALTITUDE

    def plan(self, world: World, start_s: float) -> None:
        """World.free_fall."""
        world.free_fall(self.for_s, self.catch / PS_PER_S, start_s)


class Shake(Motion):
    """Accelerate to and fro along a world axis, on top of every other motion."""

    do: Literal["shake"]
    axis: Literal["north", "west", "up"]
    amplitude_g: Annotated[float, within(limits.AMPLITUDE)]
    frequency_hz: Annotated[float, within(limits.FREQUENCY)]

    def plan(self, world: World, start_s: float) -> None:
        """World.shake."""
        world.shake(self.axis, self.amplitude_g, self.frequency_hz, self.for_s, start_s)


class DisturbField(Motion):
    """Add a constant field to the Earth's for a time."""

    do: Literal["disturb_field"]
    field: FieldTable

    def plan(self, world: World, start_s: float) -> None:
        """World.disturb_field."""
        field = self.field
        world.disturb_field(field.north_ut, field.east_ut, field.down_ut, self.for_s, start_s)


class PassMagnet(Entry):
    """Move a magnet past the board; distance and speed say how long it takes."""

    do: Literal["pass_magnet"]
    moment_am2: Annotated[float, within(limits.MOMENT)]
    distance_m: Annotated[float, within(limits.DISTANCE)]
    speed_m_s: Annotated[float, within(limits.SPEED)]

    @property
    def length_ps(self) -> int:
        """From beyond the reach of its field to beyond it again."""
        magnet = Magnet.starting_at(0.0, self.moment_am2, self.distance_m, self.speed_m_s)
        return to_ps(2.0 * magnet.closest_s)

    def plan(self, world: World, start_s: float) -> None:
        """World.pass_magnet."""
        world.pass_magnet(self.moment_am2, self.distance_m, self.speed_m_s, start_s)


class NamedRecording:
    """A recording and the path under which the scenario names it."""

    def __init__(self, path: str, recording: Recording) -> None:
        self.path = path
        self.recording = recording


def _read_recording(value: object, info: ValidationInfo) -> NamedRecording:
    if not isinstance(value, str) or "\0" in value:
        raise ValueError(f'is {shown(value)}; give a path in quotes, such as "walk.csv"')
    try:
        return NamedRecording(value, load_recording(folder_of(info) / value))
    except RecordingError as error:
        raise ValueError(str(error)) from error


class Replay(Entry):
    """Give a recording's signals, or follow its attitude; the path counts from the scenario's folder."""

    do: Literal["replay"]
    csv: Annotated[
        NamedRecording,
        PlainValidator(_read_recording),
        PlainSerializer(lambda named: named.path),
        WithJsonSchema({"type": "string"}),
    ]

    @property
    def length_ps(self) -> int:
        """Until its last row."""
        return to_ps(float(self.csv.recording.t_s[-1]))

    @property
    def moves(self) -> frozenset[str]:
        """What its columns replace or move; measured signals count as motions of their own."""
        return frozenset(self.csv.recording.groups)

    def plan(self, world: World, start_s: float) -> None:
        """World.replay."""
        world.replay(self.csv.recording, start_s)
