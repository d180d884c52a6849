"""Adapters for unmodified third-party Python drivers on the virtual board.

Four adapters use ``board.i2c2``: :class:`BusioI2C` (CircuitPython), :class:`SMBus` (smbus2),
:class:`MachineI2C` (MicroPython) and :class:`SensirionI2C` (sensirion-i2c-driver). With
:func:`virtual_time`, drivers wait on the board's clock.

Decision: an adapter copies the interface of a library's bus object and is not a subclass, because
some libraries cannot be imported without an I2C port.
"""

from fcu_emulator.emulator.adapters.bus_objects import BusioI2C, MachineI2C, SensirionI2C, SMBus
from fcu_emulator.emulator.adapters.virtual_time import virtual_time

__all__ = ["BusioI2C", "MachineI2C", "SMBus", "SensirionI2C", "virtual_time"]
