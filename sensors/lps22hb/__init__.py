"""LPS22HB: pressure sensor (datasheet DocID027083 Rev 6).

=============  ========================================================================================
registers      register map (datasheet 9)
barometer      measurement, low-pass filter, noise, supply current (datasheet 3, 4)
interrupt      reference pressure, differential interrupt, INT_DRDY (datasheet 9.1 to 9.7)
fifo           FIFO (datasheet 5)
output         output registers, STATUS, block data update (datasheet 9.5, 9.17)
model          the sensor itself, commands, reset
declaration    signals, bus, deviations, functions as data
=============  ========================================================================================
"""

from fcu_emulator.sensors.lps22hb.declaration import LPS22HBErrors
from fcu_emulator.sensors.lps22hb.model import LPS22HB

__all__ = ["LPS22HB", "LPS22HBErrors"]
