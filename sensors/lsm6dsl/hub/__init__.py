"""Sensor hub of the LSM6DSL: the I2C master that reads other sensors by itself (AN5040 section 7)."""

from sensors.lsm6dsl.hub.master import SensorHub

__all__ = ["SensorHub"]
