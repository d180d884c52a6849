"""Schema of scenario files, version 1.

Decision: scenarios are TOML files, because the standard library reads TOML, and TOML has comments
and no implicit typing. Pydantic provides the JSON schema, and key paths in errors.
"""

from __future__ import annotations

import datetime as dt
from collections.abc import Mapping
from functools import cache
from typing import Annotated, Any, ClassVar, Literal, get_args

from pydantic import (
    AfterValidator,
    BaseModel,
    Field,
    GetCoreSchemaHandler,
    Strict,
    create_model,
    model_validator,
)
from pydantic_core import CoreSchema, core_schema

from fcu_emulator.emulator.boards.description import CRYSTAL_HZ, BoardDescription, BoardErrors, SensorSettings
from fcu_emulator.emulator.boards.fcu001v1 import FCU001V1
from fcu_emulator.emulator.buses.i2c import FAST_MODE_HZ
from fcu_emulator.emulator.clock import PS_PER_S, format_duration
from fcu_emulator.emulator.scenario.expectations import (
    ExpectField,
    ExpectLine,
    ExpectNever,
    ExpectPrinted,
    ExpectRegex,
    ExpectText,
    ExpectWithin,
    FieldName,
)
from fcu_emulator.emulator.scenario.fields import (
    LED_NAMES,
    PART_NAMES,
    BusSpeed,
    CrystalFrequency,
    Duration,
    FieldTable,
    Length,
    Table,
    Vector,
    Window,
    format_frequency,
    within,
)
from fcu_emulator.emulator.scenario.following import ExpectLineFollows
from fcu_emulator.emulator.scenario.hardware import (
    ExpectHardIron,
    ExpectLed,
    ExpectLedFollows,
    ExpectReads,
    ExpectTicks,
)
from fcu_emulator.emulator.scenario.rules import rule_names
from fcu_emulator.emulator.scenario.thresholds import MOST_THRESHOLDS, ThresholdTable
from fcu_emulator.emulator.scenario.timeline import AnyEntry
from fcu_emulator.emulator.text import shown
from fcu_emulator.emulator.world import limits
from fcu_emulator.sensors.errors import Figure, PartErrors, Quality

# -- Tables about the board at power-on: firmware, bus, world, sensors; limits of the run -------------------


LARGEST_FIGURE = 1e6  # larger than every full scale, but too small for an overflow
LONGEST_RUN_PS = 24 * 3600 * PS_PER_S

Row = Annotated[tuple[float, float, float], Strict(False)]
Matrix = Annotated[tuple[Row, Row, Row], Strict(False)]


class Figures:
    """Marker for a table that is generated from the declared figures of a sensor."""

    def __init__(self, errors: type[PartErrors]) -> None:
        ideal = errors()
        fields: dict[str, Any] = {
            name: (_number(figure), Field(getattr(ideal, name), description=_meaning(figure)))
            for name, figure in errors.figures().items()
        }
        self._model: type[BaseModel] = create_model(errors.__name__, __base__=Table, **fields)

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        model = handler.generate_schema(self._model)
        given = core_schema.plain_serializer_function_ser_schema(dict)
        return core_schema.no_info_after_validator_function(_as_given, model, serialization=given)


def _as_given(table: BaseModel) -> dict[str, Any]:
    return table.model_dump(exclude_unset=True)


def _meaning(figure: Figure) -> str:
    return f"{figure.doc}, {figure.unit}; {figure.size} ({figure.source})"


def _number(figure: Figure) -> Any:
    lowest = 0.0 if figure.is_strength else -LARGEST_FIGURE
    low, high = figure.allowed or (lowest, LARGEST_FIGURE)
    number = Annotated[float, Field(ge=low, le=high)]
    return Annotated[tuple[number, number, number], Strict(False)] if figure.axes == 3 else number


class FirmwareTable(Table):
    """[firmware_settings]: options of the firmware model. Only keys in the file are passed to the model."""

    mu: float = Field(1.0, ge=0.01, le=1)
    led1_axis: Literal["pitch", "roll"] = "pitch"
    led_threshold_deg: float = Field(80.0, ge=0, le=180)
    banner: Literal["FH", "FW"] = "FH"
    timer_prescaler: int = Field(83, ge=0, le=0xFFFF)
    timer_period: int = Field(1249, ge=0, le=0xFFFF)


class BusTable(Table):
    """[bus]: the speed of the sensor bus."""

    speed: BusSpeed = FAST_MODE_HZ


class PlaceTable(Table):
    """Place and date on Earth, for the field by the World Magnetic Model 2025.

    ``altitude_m``: height of the floor above the sea. Without it, the field at sea level is used.
    """

    latitude_deg: Annotated[float, within(limits.LATITUDE)]
    longitude_deg: Annotated[float, within(limits.LONGITUDE)]
    altitude_m: Annotated[float, within(limits.ALTITUDE)] | None = None
    date: dt.date
    north: Literal["magnetic", "true"] = "magnetic"


MOST_STEEL = 16  # in a room


class SteelTable(Table):
    """[[world.steel]]: a sphere of steel. ``moment_am2``: permanent moment (north, east, down)."""

    north_m: Annotated[float, within(limits.PLACE)] = 0.0
    east_m: Annotated[float, within(limits.PLACE)] = 0.0
    up_m: Annotated[float, within(limits.PLACE)] = 0.0
    radius_m: Annotated[float, within(limits.RADIUS)]
    moment_am2: Vector = (0.0, 0.0, 0.0)


class WorldTable(Table):
    """[world]: the state at power-on. The default is Zurich, flat, 25 degC.

    A missing iron value is random and depends on the sensors' quality. An ideal board has no iron.
    """

    roll_deg: Annotated[float, within(limits.ANGLE)] = 0.0
    pitch_deg: Annotated[float, within(limits.ANGLE)] = 0.0
    yaw_deg: Annotated[float, within(limits.ANGLE)] = 0.0
    temperature_degc: Annotated[float, within(limits.TEMPERATURE)] | None = None
    pressure_hpa: Annotated[float, within(limits.PRESSURE)] | None = None
    humidity_percent: Annotated[float, within(limits.HUMIDITY)] | None = None
    floor_altitude_m: Annotated[float, within(limits.ALTITUDE)] | None = None
    field: FieldTable | None = None
    place: PlaceTable | None = None
    hard_iron_mgauss: Vector | None = None
    soft_iron: Matrix | None = None
    steel: list[SteelTable] = Field(default_factory=list, max_length=MOST_STEEL)
    gravity: Annotated[float, within(limits.GRAVITY)] | None = None

    @model_validator(mode="after")
    def _refuse_contradictions(self) -> WorldTable:
        if self.field is not None and self.place is not None:
            raise ValueError("must not have both field and place; give one of them")
        if self.pressure_hpa is not None and self.floor_altitude_m is not None:
            raise ValueError("must not have both pressure_hpa and floor_altitude_m; give one of them")
        return self


class SensorsTable(Table):
    """[sensors]: ``quality`` sets all figures of the sensors. The tables of the sensors replace single figures.

    :func:`sensors_table` adds the keys of the board.
    """

    RENAMED: ClassVar[Mapping[str, str]] = {"grade": "quality"}

    quality: Quality = "typical"

    def settings(self) -> SensorSettings:
        given = {name: getattr(self, name) for name in type(self).model_fields if name != "quality"}
        figures = {name: value for name, value in given.items() if isinstance(value, dict)}
        mountings = {name: value for name, value in given.items() if isinstance(value, str)}
        return SensorSettings(self.quality, figures, mountings)


def sensors_table(board: BoardDescription) -> type[SensorsTable]:
    """Return [sensors] with the board's sensors and its choices of mounting."""
    keys: dict[str, Any] = {}
    for mounted in board.parts:
        if mounted.mounting_key:
            names = tuple(mounted.mountings)
            keys[mounted.mounting_key] = Literal[names], names[0]
    for mounted in board.parts:
        figures = Annotated[dict[str, Any], Figures(mounted.part.ERRORS)]
        keys[mounted.key] = figures, Field(default_factory=dict)
    return create_model("SensorsTable", __base__=SensorsTable, __doc__=SensorsTable.__doc__, **keys)


class LimitsTable(Table):
    """[limits]: resource limits. A run ends when it exceeds a limit.

    ``duration`` is virtual time and is checked when the file is loaded. ``wall`` is checked every
    0.1 s of virtual time.
    """

    duration: Length = 600 * PS_PER_S
    terminal_bytes: int = Field(4 << 20, ge=1, le=8 << 20)  # the board keeps 8 MiB
    wall: Length = 300 * PS_PER_S

    @model_validator(mode="after")
    def _bound(self) -> LimitsTable:
        if self.duration > LONGEST_RUN_PS:
            raise ValueError('duration must be at most "24h"')
        return self


# -- The file -----------------------------------------------------------------------------------------------


MOST_ENTRIES = 10_000  # enough for five minutes of mouse motion
MOST_EXPECTATIONS = 1_000

Kinds = (
    ExpectLine
    | ExpectRegex
    | ExpectNever
    | ExpectField
    | ExpectLed
    | ExpectLedFollows
    | ExpectLineFollows
    | ExpectTicks
    | ExpectReads
    | ExpectHardIron
    | ExpectText
    | ExpectPrinted
    | ExpectWithin
)
"""All expectations, distinguished by ``kind``."""

AnyExpectation = Annotated[Kinds, Field(discriminator="kind")]


class ReportTable(Window):
    """One ``[[report]]``: a table of a printed field and the truth."""

    field: FieldName
    against: Literal["truth"]


class ScenarioFile(Table):
    """Root table of a scenario file."""

    RENAMED: ClassVar[Mapping[str, str]] = {"powered_for": "uptime"}

    schema_: Literal[1] = Field(alias="schema")
    question: str = Field(
        min_length=1, max_length=200, pattern=r"^[^\x00-\x1f\x7f-\x9f]+$"
    )  # shown in the list of scenarios
    firmware: str = ""
    seed: int = Field(0, ge=0, lt=2**63)
    uptime: Duration | None = None
    duration: Length = 10 * PS_PER_S
    crystal: CrystalFrequency = CRYSTAL_HZ
    firmware_settings: FirmwareTable = Field(default_factory=lambda: FirmwareTable.model_validate({}))
    bus: BusTable = BusTable()
    world: WorldTable = WorldTable()
    sensors: SensorsTable = SensorsTable()
    board: Annotated[dict[str, Any], Figures(BoardErrors)] = Field(default_factory=dict)
    timeline: list[AnyEntry] = Field(default_factory=list, max_length=MOST_ENTRIES)
    threshold: list[ThresholdTable] = Field(default_factory=list, max_length=MOST_THRESHOLDS)
    """Thresholds, which become part of the timeline."""
    expect: list[AnyExpectation] = Field(default_factory=list, max_length=MOST_EXPECTATIONS)
    report: list[ReportTable] = Field(default_factory=list, max_length=MOST_EXPECTATIONS)
    limits: LimitsTable = Field(default_factory=lambda: LimitsTable.model_validate({}))


@cache
def scenario_file(board: BoardDescription) -> type[ScenarioFile]:
    """Return a class of scenario files with the board's firmware, sensors and mountings."""

    def known(name: str) -> str:
        if name not in board.firmware:
            raise ValueError(f"unknown firmware {shown(name)}; known: {', '.join(board.firmware) or 'none'}")
        return name

    names = Field(json_schema_extra={"enum": list(board.firmware)})
    table = sensors_table(board)
    return create_model(
        "ScenarioFile",
        __base__=ScenarioFile,
        __doc__=ScenarioFile.__doc__,
        firmware=(Annotated[str, AfterValidator(known), names], board.default_firmware),
        sensors=(table, table()),
    )


def json_schema(board: BoardDescription = FCU001V1) -> dict[str, Any]:
    """Return the JSON schema (draft 2020-12) for editors."""
    schema = as_written(scenario_file(board).model_json_schema(by_alias=True), board)
    parts = schema["$defs"]
    with_draws = [
        WorldTable,
        SteelTable,
        PlaceTable,
        FieldTable,
        ThresholdTable,
        *get_args(get_args(AnyEntry)[0]),
    ]
    for name in (table.__name__ for table in with_draws):
        parts[name] = _may_be_drawn(parts[name])
    may_be_rule(schema)
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        **schema,
        "$defs": parts | {"Draw": _DRAW},
        "title": "fcu-emulator scenario, schema 1",
    }


_DRAW = {
    "description": "A number or a duration that is drawn from the seed.",
    "type": "object",
    "properties": {
        "uniform": {"type": "array", "items": {"type": ["number", "string"]}, "minItems": 2, "maxItems": 2},
        "one_of": {"type": "array", "minItems": 1},
        "random_sign": {"type": "boolean"},
    },
    "minProperties": 1,
    "additionalProperties": False,
}


def may_be_rule(table: dict[str, Any]) -> None:
    """Allow entries of ``expect`` that name a rule."""
    rule = {
        "description": "A rule of the lab, by name; other keys add to it or replace its own.",
        "type": "object",
        "properties": {"rule": {"enum": rule_names()}},
        "required": ["rule"],
    }
    expect = table["properties"]["expect"]
    expect["items"] = {"anyOf": [rule, expect["items"]]}


def _may_be_drawn(schema: Any) -> Any:
    if isinstance(schema, list):
        return [_may_be_drawn(one) for one in schema]
    if not isinstance(schema, dict):
        return schema
    if schema.get("type") in ("number", "integer") or schema.get("pattern", "").endswith("min|h)$"):
        kept = {key: value for key, value in schema.items() if key in ("title", "default")}
        return {**kept, "anyOf": [schema, {"$ref": "#/$defs/Draw"}]}
    return {key: _may_be_drawn(value) for key, value in schema.items()}


def as_written(schema: Any, board: BoardDescription) -> Any:
    """Return the schema with the names of the board, and with defaults in the notation of files."""
    if isinstance(schema, list):
        return [as_written(entry, board) for entry in schema]
    if not isinstance(schema, dict):
        return schema
    written = {key: as_written(value, board) for key, value in schema.items()}
    if written.get("enum") == LED_NAMES:
        written["enum"] = [name.lower() for name in board.leds]
    if written.get("enum") == PART_NAMES:
        written["enum"] = list(board.addresses)
    if written.get("type") == "string" and isinstance(written.get("default"), int):
        of_speed = "Hz" in written.get("pattern", "")
        default = written["default"]
        written["default"] = format_frequency(default) if of_speed else format_duration(default)
    return written
