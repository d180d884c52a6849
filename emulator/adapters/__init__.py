"""Third-party Python drivers on the virtual board, unmodified.

Each adapter has the interface of the bus object that one family of drivers expects and forwards transfers to
``board.i2c2``: :class:`BusioI2C` (CircuitPython), :class:`SMBus` (smbus2), :class:`MachineI2C` (MicroPython)
and :class:`SensirionI2C` (sensirion-i2c-driver). :func:`virtual_time` makes the drivers' waits pass on the
board's clock.

Decision: an adapter copies the interface of a library's bus object and is not a subclass. None of those
libraries is imported here or needed to use the board; some of them cannot even be imported on a machine
without an I2C port. Fake modules in ``sys.modules`` (``busio``, ``smbus2``) were rejected, because they would
hide the real ones from all other code in the process.
"""

from fcu_emulator.emulator.adapters.bus_objects import BusioI2C, MachineI2C, SensirionI2C, SMBus
from fcu_emulator.emulator.adapters.virtual_time import virtual_time

__all__ = ["BusioI2C", "MachineI2C", "SMBus", "SensirionI2C", "virtual_time"]
