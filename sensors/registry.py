"""Registry of the sensors; the contract tests cover every entry."""

from __future__ import annotations

from fcu_emulator.sensors.lis2mdl import LIS2MDL
from fcu_emulator.sensors.lps22hb import LPS22HB
from fcu_emulator.sensors.lsm6dsl import LSM6DSL
from fcu_emulator.sensors.part import Sensor

SENSORS: dict[str, type[Sensor]] = {part.NAME: part for part in (LSM6DSL, LIS2MDL, LPS22HB)}
