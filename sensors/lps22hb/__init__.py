"""LPS22HB: pressure sensor (datasheet DocID027083 Rev 6).

===========  ==================================================================
registers    register map (datasheet 9)
barometer    measurement, filter, noise, supply current (datasheet 3, 4)
interrupt    reference, differential interrupt, INT_DRDY (datasheet 9.1 to 9.7)
fifo         FIFO (datasheet 5)
output       output registers, STATUS, BDU (datasheet 9.5, 9.17)
model        the sensor, commands, reset
declaration  signals, bus, deviations, functions
===========  ==================================================================
"""

from fcu_emulator.sensors.lps22hb.declaration import LPS22HBErrors
from fcu_emulator.sensors.lps22hb.model import LPS22HB

__all__ = ["LPS22HB", "LPS22HBErrors"]
