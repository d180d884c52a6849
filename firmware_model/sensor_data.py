"""ReadSensorRawData: four bursts on the bus, converted and turned into the board's axes.

Output frame (COORDINATE_SYSTEM 3): X right, Y forward, Z up out of the component side: out.X = -raw.Y, out.Y
= raw.X, out.Z = raw.Z for all three vectors, applied after the truncation to int32 (brief, "Axes and units").

Decision: bursts of 6, 6, 6 and 3 bytes. ST's firmware reads each byte in a transaction of its own and
re-reads the full-scale registers every sample; at 400 kHz those 24 transactions would not fit into 1.25 ms.
"""

from __future__ import annotations

from firmware_model.axes import (
    ACC_MG_PER_LSB,
    GYRO_MDPS_PER_LSB,
    MAG_MGAUSS_PER_LSB,
    AxesRaw_TypeDef,
    scale_table,
    unpack_axes,
)
from firmware_model.drivers.lis2mdl import LIS2MDL_ADDRESS, OUTX_L_REG
from firmware_model.drivers.lps22hb import LPS22HB_Get_Press
from firmware_model.drivers.lsm6dsl import LSM6DSL_ADDRESS, OUTX_L_G, OUTX_L_XL
from firmware_model.hal import HAL_OK, Hal


class SensorReader:
    """The sensors on one HAL. Runs 800 times a second: its tables and calls are bound once."""

    def __init__(self, hal: Hal) -> None:
        self._hal = hal
        self._acc_mg = scale_table(ACC_MG_PER_LSB)
        self._gyro_mdps = scale_table(GYRO_MDPS_PER_LSB)
        self._mag_mgauss = scale_table(MAG_MGAUSS_PER_LSB)

    def ReadSensorRawData(
        self, acc: AxesRaw_TypeDef, gyro: AxesRaw_TypeDef, mag: AxesRaw_TypeDef, press: float
    ) -> float:
        """Refresh ``acc`` (mg), ``gyro`` (mdps) and ``mag`` (mgauss) in place; return the pressure in hPa.

        What cannot be read keeps its old value; for the pressure that is ``press``, passed in because Python
        has no pointer to a float.
        """
        hal = self._hal
        _read_axes(hal, LSM6DSL_ADDRESS, OUTX_L_XL, self._acc_mg, acc)
        _read_axes(hal, LSM6DSL_ADDRESS, OUTX_L_G, self._gyro_mdps, gyro)
        _read_axes(hal, LIS2MDL_ADDRESS, OUTX_L_REG, self._mag_mgauss, mag)
        return LPS22HB_Get_Press(hal, press)


def _read_axes(hal: Hal, device: int, register: int, scale: tuple[int, ...], axes: AxesRaw_TypeDef) -> None:
    status, data = hal.HAL_I2C_Mem_Read(device, register, 6)
    if status == HAL_OK:
        raw_x, raw_y, raw_z = unpack_axes(data)
        axes.AXIS_X = -scale[raw_y]
        axes.AXIS_Y = scale[raw_x]
        axes.AXIS_Z = scale[raw_z]
