"""Embedded functions of the LSM6DSL: pedometer, significant motion, tilt and absolute wrist tilt.

AN5040 section 6. They work at 26 Hz on the accelerometer's samples.
"""

from sensors.lsm6dsl.embedded.functions import EmbeddedFunctions

__all__ = ["EmbeddedFunctions"]
