"""Sensors of the lab's main.c: start-up, reading, scaling, and axes.

The axes of vectors are X right, Y forward, and Z up from the component side: out.X = -raw.Y, out.Y = raw.X,
out.Z = raw.Z.

Decision: sensors are read in bursts of 6, 6, 6 and 3 bytes. The 24 one-byte transactions of ST's
firmware would exceed 1.25 ms.

Decision: a table of all 65536 raw values replaces the multiplication. A look-up takes 12 ns instead
of 290 ns.
"""

from __future__ import annotations

import itertools
import struct
from array import array
from dataclasses import dataclass
from functools import cache

from fcu_emulator.firmware_model.c_semantics import f32
from fcu_emulator.firmware_model.drivers.component import COMPONENT_OK
from fcu_emulator.firmware_model.drivers.lis2mdl import (
    LIS2MDL_ADDRESS,
    OUTX_L_REG,
    LIS2MDL_Enable,
    LIS2MDL_FlightSetup,
    LIS2MDL_Init,
)
from fcu_emulator.firmware_model.drivers.lps22hb import LPS22HB_Enable, LPS22HB_Get_Press, LPS22HB_Init
from fcu_emulator.firmware_model.drivers.lsm6dsl import (
    LSM6DSL_ADDRESS,
    OUTX_L_G,
    OUTX_L_XL,
    LSM6DSL_FlightSetup,
    LSM6DSL_G_Enable,
    LSM6DSL_G_Init,
    LSM6DSL_X_Enable,
    LSM6DSL_X_Init,
)
from fcu_emulator.firmware_model.hal import HAL_OK, PRINTF, Hal

# -- Three axes, and the int16 -> int32 scaling of the drivers ----------------------------------------------


ACC_MG_PER_LSB = 0.122  # +-4 g
GYRO_MDPS_PER_LSB = 70.0  # 2000 dps
MAG_MGAUSS_PER_LSB = 1.5

unpack_axes = struct.Struct("<HHH").unpack
"""Convert six output bytes to raw X, Y, Z, which are indices of a scale table."""


@dataclass(slots=True)
class AxesRaw:
    """``AxesRaw_TypeDef``: an int32 vector in mg, mdps or mgauss."""

    AXIS_X: int = 0
    AXIS_Y: int = 0
    AXIS_Z: int = 0


AxesRaw_TypeDef = AxesRaw  # the name of the structure in C


@cache
def scale_table(sensitivity: float) -> tuple[int, ...]:
    """Return ``(int32_t)(raw * sensitivity)`` in single precision, indexed by raw uint16."""
    factor = f32(sensitivity)
    raw_values = itertools.chain(range(0x8000), range(-0x8000, 0))
    products = array("f", (raw * factor for raw in raw_values))  # the array rounds to float32
    return tuple(map(int, products))  # int() truncates toward zero, as C's cast does


# -- Start-up in main.c: initialise, enable and configure all sensors ---------------------------------------


_SPIN_MS = 1000


def initializeAllSensors(hal: Hal) -> None:
    """Initialise the sensors. **Never return** if a sensor is missing or has another identity.

    The endless loop contains delays, because only HAL calls take virtual time.
    """
    for init in (LSM6DSL_X_Init, LSM6DSL_G_Init, LIS2MDL_Init, LPS22HB_Init):
        if init(hal) != COMPONENT_OK:
            while True:
                hal.HAL_Delay(_SPIN_MS)


def enableAllSensors(hal: Hal) -> None:
    """Start each sensor and print a message. Ignore the status, as main.c does."""
    LSM6DSL_X_Enable(hal)
    PRINTF(hal, "LSM6DSL MEMS Accelerometer initialized and enabled\n")
    LSM6DSL_G_Enable(hal)
    PRINTF(hal, "LSM6DSL MEMS Gyroscope initialized and enabled\n")
    LIS2MDL_Enable(hal)
    PRINTF(hal, "LIS2MDL Magnetometer initialized and enabled\n")
    LPS22HB_Enable(hal)
    PRINTF(hal, "LPS22HB Pressure sensor initialized and enabled\n")
    LPS22HB_Enable(hal)
    PRINTF(hal, "LPS22HB Temperature sensor initialized and enabled\n")


def setUpForFlight(hal: Hal) -> None:
    """Set the program's rates, ranges and filters."""
    LSM6DSL_FlightSetup(hal)
    LIS2MDL_FlightSetup(hal)


# -- ReadSensorRawData --------------------------------------------------------------------------------------


_REMEMBERED = 4096  # samples of a sensor


class AxesReader:
    """A three-axis sensor in board axes, with cached conversions."""

    def __init__(self, hal: Hal, device: int, register: int, sensitivity: float) -> None:
        self._hal = hal
        self._device = device
        self._register = register
        self._scale = scale_table(sensitivity)
        self._seen: dict[bytes, tuple[int, int, int]] = {}

    def read(self, axes: AxesRaw_TypeDef) -> None:
        """Update ``axes``, unless the read fails."""
        status, data = self._hal.HAL_I2C_Mem_Read(self._device, self._register, 6)
        if status == HAL_OK:
            axes.AXIS_X, axes.AXIS_Y, axes.AXIS_Z = self._seen.get(data) or self._convert(data)

    def _convert(self, data: bytes) -> tuple[int, int, int]:
        raw_x, raw_y, raw_z = unpack_axes(data)
        scale = self._scale
        if len(self._seen) >= _REMEMBERED:
            self._seen.clear()
        self._seen[data] = vector = -scale[raw_y], scale[raw_x], scale[raw_z]
        return vector


class SensorReader:
    """The lab's sensors, read with one HAL."""

    def __init__(self, hal: Hal) -> None:
        self._hal = hal
        self._acc = AxesReader(hal, LSM6DSL_ADDRESS, OUTX_L_XL, ACC_MG_PER_LSB)
        self._gyro = AxesReader(hal, LSM6DSL_ADDRESS, OUTX_L_G, GYRO_MDPS_PER_LSB)
        self._mag = AxesReader(hal, LIS2MDL_ADDRESS, OUTX_L_REG, MAG_MGAUSS_PER_LSB)

    def ReadSensorRawData(
        self, acc: AxesRaw_TypeDef, gyro: AxesRaw_TypeDef, mag: AxesRaw_TypeDef, press: float
    ) -> float:
        """Update ``acc`` (mg), ``gyro`` (mdps), ``mag`` (mgauss). Return the pressure in hPa.

        After a failed read, a value does not change. ``press``: the previous pressure.
        """
        self._acc.read(acc)
        self._gyro.read(gyro)
        self._mag.read(mag)
        return LPS22HB_Get_Press(self._hal, press)
