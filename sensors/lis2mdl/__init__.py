"""LIS2MDL: magnetometer."""

from sensors.lis2mdl.declaration import LIS2MDLErrors
from sensors.lis2mdl.model import LIS2MDL

__all__ = ["LIS2MDL", "LIS2MDLErrors"]
