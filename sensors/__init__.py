"""Register-level models of the three sensors on the STEVAL-FCU001V1.

The registers of a sensor are accessed at a given virtual time. Its physical signals are arguments of the constructor.
This package needs only numpy.

================  ================================================================
part              base class of every sensor, and the I2C protocol
spi               the SPI protocol
register_file     memory, hooks, and the rules for reading and writing bursts
shared_registers  memory that a chip in C reads: registers and sample trains
register          declarations of registers and their bits
sampling          the latest sample at a given time, and its output registers
filters           digital filters on samples
front_end         signal chain before a sample: analog stage, clipping, noise
errors            deviations of a real sensor: offset, scale, drift, noise
declaration       a sensor's declarations: signals, bus, functions
pin               interrupt and data-ready pins
registry          ``SENSORS``, the sensors by name
================  ================================================================
"""

if not __name__.startswith("fcu_emulator."):  # the package was imported by its old name
    from fcu_emulator._old_names import redirect

    redirect(__name__)

import warnings
from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from fcu_emulator.sensors.lis2mdl import LIS2MDL
    from fcu_emulator.sensors.lps22hb import LPS22HB
    from fcu_emulator.sensors.lsm6dsl import LSM6DSL
    from fcu_emulator.sensors.part import Sensor
    from fcu_emulator.sensors.register_file import AccessError
    from fcu_emulator.sensors.registry import SENSORS

_HOMES = {
    "LIS2MDL": "lis2mdl",
    "LPS22HB": "lps22hb",
    "LSM6DSL": "lsm6dsl",
    "SENSORS": "registry",
    "AccessError": "register_file",
    "Sensor": "part",
}
"""Names are loaded on first use, so that C headers are generated from register declarations without numpy."""

__all__ = ["LIS2MDL", "LPS22HB", "LSM6DSL", "SENSORS", "AccessError", "Sensor"]


_OLD_NAMES = {"Part": "Sensor", "PARTS": "SENSORS"}


def __getattr__(name: str) -> Any:
    if name in _OLD_NAMES:
        new = _OLD_NAMES[name]
        warnings.warn(f"{name} is now called {new}; use that name", DeprecationWarning, stacklevel=2)
        return __getattr__(new)
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = getattr(import_module(f"fcu_emulator.sensors.{_HOMES[name]}"), name)
    globals()[name] = value
    return value
