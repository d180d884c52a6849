"""What a board is described by, and what of its sensors may be chosen."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal, TypeAlias

from sensors.errors import Grade

Numbers: TypeAlias = Mapping[str, Any]
MagnetometerMounting: TypeAlias = Literal["parallel", "left_handed"]


@dataclass(frozen=True)
class Profile:
    """One way the sensors are connected: 7-bit I2C2 addresses, or SPI2 chip selects, by part name."""

    name: str
    i2c2: dict[str, int]
    spi2: dict[str, str]
    description: str


@dataclass(frozen=True)
class SensorSettings:
    """How far the sensors deviate from ideal ones.

    ``grade`` fills every figure; the mappings replace single ones by explicit numbers, under the field names
    of each part's class of errors (:class:`sensors.lsm6dsl.LSM6DSLErrors` and its like).
    """

    grade: Grade = "typical"
    lsm6dsl: Numbers = field(default_factory=dict)
    lis2mdl: Numbers = field(default_factory=dict)
    lps22hb: Numbers = field(default_factory=dict)
    magnetometer_mounting: MagnetometerMounting = "parallel"
