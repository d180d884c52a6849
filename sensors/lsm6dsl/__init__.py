"""LSM6DSL: accelerometer and gyroscope."""

from sensors.lsm6dsl.declaration import LSM6DSLErrors
from sensors.lsm6dsl.model import LSM6DSL

__all__ = ["LSM6DSL", "LSM6DSLErrors"]
