"""A whole scenario file, version 1, and its JSON schema for editors.

Decision: TOML, read by the standard library, with comments and without implicit typing; pydantic for the
schema, because its errors carry the key path and it exports the JSON schema. The tables are data; what a
timeline entry or an expectation does stands in its own class, under the same keys.
"""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import AfterValidator, Field

from emulator.boards.fcu001v1 import DEFAULT_FIRMWARE, FIRMWARES
from emulator.scenario.expect_board import ExpectField, ExpectHardIron, ExpectLed, ExpectTicks, FieldName
from emulator.scenario.expect_text import ExpectLine, ExpectNever, ExpectRegex, ExpectText
from emulator.scenario.setup import BusTable, FirmwareTable, LimitsTable, SensorsTable, WorldTable
from emulator.scenario.tables import Table
from emulator.scenario.timeline import AnyEntry
from emulator.scenario.units import Length
from emulator.time.clock import PS_PER_S
from emulator.time.durations import format_duration, shown

MOST_ENTRIES = 1_000  # of the timeline; what needs more is a recording
MOST_EXPECTATIONS = 1_000

AnyExpectation = Annotated[
    ExpectLine
    | ExpectRegex
    | ExpectNever
    | ExpectField
    | ExpectLed
    | ExpectTicks
    | ExpectHardIron
    | ExpectText,
    Field(discriminator="kind"),
]


def _known_firmware(name: str) -> str:
    if name not in FIRMWARES:
        raise ValueError(f"is {shown(name)}; known: {', '.join(FIRMWARES)}")
    return name


class ReportTable(Table):
    """One ``[[report]]``: tell how a printed field compares with the truth, in a small table."""

    field: FieldName
    against: Literal["truth"]


class ScenarioFile(Table):
    """The file."""

    schema_: Literal[1] = Field(alias="schema")
    question: str = Field(min_length=1, max_length=200, pattern=r"^[^\r\n]+$")
    firmware: Annotated[
        str, AfterValidator(_known_firmware), Field(json_schema_extra={"enum": list(FIRMWARES)})
    ] = DEFAULT_FIRMWARE
    seed: int = Field(0, ge=0, lt=2**63)
    duration: Length = 10 * PS_PER_S
    firmware_settings: FirmwareTable = Field(default_factory=lambda: FirmwareTable.model_validate({}))
    bus: BusTable = BusTable()
    world: WorldTable = WorldTable()
    sensors: SensorsTable = SensorsTable()
    timeline: list[AnyEntry] = Field(default_factory=list, max_length=MOST_ENTRIES)
    expect: list[AnyExpectation] = Field(default_factory=list, max_length=MOST_EXPECTATIONS)
    report: list[ReportTable] = Field(default_factory=list, max_length=MOST_EXPECTATIONS)
    limits: LimitsTable = Field(default_factory=lambda: LimitsTable.model_validate({}))


def json_schema() -> dict[str, Any]:
    """The file's JSON schema (draft 2020-12), for an editor's completion and checks."""
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        **_as_written(ScenarioFile.model_json_schema(by_alias=True)),
        "title": "fcu-emulator scenario, schema 1",
    }


def _as_written(schema: Any) -> Any:
    """The schema with the defaults of durations and speeds as they stand in a file, not in our units."""
    if isinstance(schema, list):
        return [_as_written(entry) for entry in schema]
    if not isinstance(schema, dict):
        return schema
    written = {key: _as_written(value) for key, value in schema.items()}
    if written.get("type") == "string" and isinstance(written.get("default"), int):
        of_speed = "Hz" in written.get("pattern", "")
        default = written["default"]
        written["default"] = f"{default // 1000}kHz" if of_speed else format_duration(default)
    return written
