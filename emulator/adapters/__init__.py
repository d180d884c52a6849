"""Third-party Python drivers on the virtual board, unmodified.

Each adapter has the shape of the bus object one family of drivers expects and passes transfers on to
``board.i2c2``: :class:`BusioI2C` (CircuitPython), :class:`SMBus` (smbus2), :class:`MachineI2C` (MicroPython)
and :class:`SensirionI2C` (sensirion-i2c-driver). :func:`virtual_time` lets the drivers' waits pass on the
board's clock.

Decision: shapes, not subclasses. None of those libraries is imported here or needed to use the board; some
of them cannot even be imported on a machine without an I2C port. The road not taken, fake modules in
``sys.modules`` (``busio``, ``smbus2``), would hide the real ones from everybody else in the process.
"""

from fcu_emulator.emulator.adapters.bus_objects import BusioI2C, MachineI2C, SensirionI2C, SMBus
from fcu_emulator.emulator.adapters.virtual_time import virtual_time

__all__ = ["BusioI2C", "MachineI2C", "SMBus", "SensirionI2C", "virtual_time"]
