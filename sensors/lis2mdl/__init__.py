"""LIS2MDL: magnetometer (datasheet DocID030621 Rev 3, application note AN5069 Rev 2).

============  =========================================================
registers     register map (datasheet 8)
magnetometer  measurement, pulses, thermometer (AN5069 3, 8, 9)
modes         modes, boot, output registers (AN5069 3, 6, 7)
interrupt     threshold interrupt, INT/DRDY (AN5069 10)
model         the sensor, reset, forbidden settings, supply current
declaration   signals, bus, deviations, functions
============  =========================================================
"""

from fcu_emulator.sensors.lis2mdl.declaration import LIS2MDLErrors
from fcu_emulator.sensors.lis2mdl.model import LIS2MDL

__all__ = ["LIS2MDL", "LIS2MDLErrors"]
