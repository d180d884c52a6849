"""LSM6DSL: accelerometer and gyroscope (datasheet DocID028475 Rev 7, application note AN5040 Rev 3).

================  ===============================================================
registers         main register bank (datasheet 9)
banks             embedded banks A and B (datasheet 11, 12), rounding (AN5040 4.7)
accelerometer     signal chain (AN5040 3.7, 3.9, 4)
gyroscope         signal chain (AN5040 3.8, 3.9)
measuring         output registers, thermometer (AN5040 9), supply current
pins              INT1 and INT2, data-ready, boot (AN5040 4.2, 4.3, 5.7)
den               data enable (AN5040 4.8)
events            registers and pins of the event functions (AN5040 5)
event_detectors   free fall, wake-up, 6D, tap, inactivity (AN5040 5.1 to 5.6)
embedded          pedometer, motion and tilt functions (AN5040 6.1 to 6.4)
timestamp         the timestamp counter (AN5040 6.5)
function_sources  FUNC_SRC1 and FUNC_SRC2 (AN5040 6, 7)
hub               sensor hub, hard- and soft-iron correction (AN5040 7)
fifo, fifo_sets   FIFO: memory and flags; contents (AN5040 8)
feature, model    interface of a function; the sensor, reset
declaration       signals, bus, deviations, functions
================  ===============================================================
"""

from fcu_emulator.sensors.lsm6dsl.declaration import LSM6DSLErrors
from fcu_emulator.sensors.lsm6dsl.model import LSM6DSL

__all__ = ["LSM6DSL", "LSM6DSLErrors"]
