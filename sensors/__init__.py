"""Register-level models of the three sensors on the STEVAL-FCU001V1.

A part has two faces: its registers, read and written through sub-addresses at a given virtual time, and the
physical signals it is given at construction. It knows no bus, no clock and no thread; numpy is all it needs.
"""

from sensors.lis2mdl import LIS2MDL
from sensors.lps22hb import LPS22HB
from sensors.lsm6dsl import LSM6DSL
from sensors.part import Part
from sensors.register_file import AccessError

PARTS: dict[str, type[Part]] = {part.NAME: part for part in (LSM6DSL, LIS2MDL, LPS22HB)}
"""The registry: every part by its name. What is in it is covered by the contract tests."""

__all__ = ["LIS2MDL", "LPS22HB", "LSM6DSL", "PARTS", "AccessError", "Part"]
