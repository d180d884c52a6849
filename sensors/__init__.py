"""Register-level models of the three sensors on the STEVAL-FCU001V1.

A part has two faces: its registers, read and written through sub-addresses at a given virtual time, and the
physical signals it is given at construction. It knows no bus, no clock and no thread; numpy is all it needs.

What all parts share, from the bus inwards:

=================  ====================================================================================
part               the base of every part, and the protocol of I2C, from message to register
spi                the protocol of SPI
register_file      memory, hooks, and how a burst is read and written
register           how registers and their bits are declared
sampling           which sample is the latest at a given time, and the output registers that show it
filters            digital filters on samples
front_end          what comes before a sample: analog stage, clipping, deviation, noise
errors             by how much a real part deviates: offset, scale, drift, noise
declaration        what a part says about itself: signals, bus, functions
pin                interrupt and data-ready pins
registry           ``PARTS``, the sensors by name
=================  ====================================================================================

Each part is a folder: ``declaration``, ``registers``, ``model``, and a file for each chapter of its datasheet
or application note.
"""

if not __name__.startswith("fcu_emulator."):  # imported by its former name
    from fcu_emulator._old_names import redirect

    redirect(__name__)

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from fcu_emulator.sensors.lis2mdl import LIS2MDL
    from fcu_emulator.sensors.lps22hb import LPS22HB
    from fcu_emulator.sensors.lsm6dsl import LSM6DSL
    from fcu_emulator.sensors.part import Part
    from fcu_emulator.sensors.register_file import AccessError
    from fcu_emulator.sensors.registry import PARTS

_HOMES = {
    "LIS2MDL": "lis2mdl",
    "LPS22HB": "lps22hb",
    "LSM6DSL": "lsm6dsl",
    "PARTS": "registry",
    "AccessError": "register_file",
    "Part": "part",
}
"""Names are loaded when they are first used: the C headers are generated from register declarations without numpy."""

__all__ = ["LIS2MDL", "LPS22HB", "LSM6DSL", "PARTS", "AccessError", "Part"]


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = getattr(import_module(f"fcu_emulator.sensors.{_HOMES[name]}"), name)
    globals()[name] = value
    return value
