"""What every exercise's firmware has in common: state, boot, the template block.

State variables are attributes under their C names, so that a debugger view, a test or a grader can read
``firmware.acc.AXIS_X`` as on the board.

Decision: one class per firmware, deriving from this one, which fixes the order of ``main``; a firmware adds
its timer callback and the body of its endless loop. One class with exercise switches would have to be read
with every switch in mind.
"""

from __future__ import annotations

from abc import ABC, abstractmethod

from firmware_model.axes import AxesRaw_TypeDef
from firmware_model.debug import PRINTF
from firmware_model.drivers.lps22hb import LPS22HB_Get_Press, LPS22HB_Get_Temp, LPS22HB_WaitForData
from firmware_model.hal import Hal
from firmware_model.led import LED1_PIN, LED2_PIN, Led
from firmware_model.mag_calibration import MAG_MAX_START, MAG_MIN_START
from firmware_model.sensor_data import SensorReader
from firmware_model.sensor_setup import enableAllSensors, initializeAllSensors, setUpForFlight
from firmware_model.settings import Settings

LOOP_DELAY_MS = 1000


class LabFirmware(ABC):
    """The lab's program on a HAL.

    ``acc`` (mg), ``gyro`` (mdps), ``mag`` (mgauss): frame X right, Y forward, Z up; ``press`` and
    ``press_zero_level`` in hPa, ``temperature`` in degC, ``pitch``, ``roll`` and ``azimuth`` in degrees,
    ``alt`` in m: float32 values.
    """

    def __init__(self, hal: Hal, settings: Settings | None = None) -> None:
        self.hal = hal
        self.settings = settings or Settings()
        self.acc = AxesRaw_TypeDef()
        self.gyro = AxesRaw_TypeDef()
        self.mag = AxesRaw_TypeDef()
        self.mag_min = AxesRaw_TypeDef(MAG_MIN_START, MAG_MIN_START, MAG_MIN_START)
        self.mag_max = AxesRaw_TypeDef(MAG_MAX_START, MAG_MAX_START, MAG_MAX_START)
        self.press = 0.0
        self.temperature = 0.0
        self.press_zero_level = 0.0
        self.pitch = 0.0
        self.roll = 0.0
        self.azimuth = 0.0
        self.alt = 0.0
        self._sensors = SensorReader(hal)

    def main(self) -> None:
        """Boot, then loop for ever."""
        self._boot()
        while True:
            self.loop()

    @abstractmethod
    def loop(self) -> None:
        """Do one pass of ``while (1)`` in main.c."""

    @abstractmethod
    def HAL_TIM_PeriodElapsedCallback(self) -> None:
        """TIM9's interrupt, 800 Hz."""

    def ReadSensorRawData(self) -> None:
        """Refresh ``acc``, ``gyro``, ``mag`` and ``press``; what cannot be read keeps its old value."""
        self.press = self._sensors.ReadSensorRawData(self.acc, self.gyro, self.mag, self.press)

    def print_template_block(self) -> None:
        """Print the template's block (brief, "Exact text")."""
        hal, acc, gyro, mag = self.hal, self.acc, self.gyro, self.mag
        PRINTF(hal, "*****\n\n\n")
        PRINTF(hal, "ACC[x,y,z] %d mg %d mg %d mg \n\r", acc.AXIS_X, acc.AXIS_Y, acc.AXIS_Z)
        PRINTF(hal, "GYR[x,y,z] %d mdps %d mdps %d mdps \n\r", gyro.AXIS_X, gyro.AXIS_Y, gyro.AXIS_Z)
        PRINTF(hal, "MAG[x,y,z] %d mg %d mg %d mg \n\r", mag.AXIS_X, mag.AXIS_Y, mag.AXIS_Z)
        PRINTF(hal, "Pre: %f hPa \n\r", self.press)
        PRINTF(hal, "*****\n\n\n")

    def _boot(self) -> None:
        hal, settings = self.hal, self.settings
        PRINTF(hal, "STEVAL-FCU001V1 %s rev.1.0 - Sep 2017\n\n", settings.banner)
        self.led1 = Led(hal, LED1_PIN)
        self.led2 = Led(hal, LED2_PIN)
        initializeAllSensors(hal)
        enableAllSensors(hal)
        setUpForFlight(hal)
        PRINTF(hal, "LAB3 Init...\n")
        self._set_zero_level()
        hal.HAL_TIM_Base_Init(settings.timer_prescaler, settings.timer_period)
        hal.HAL_TIM_Base_Start_IT()

    def _set_zero_level(self) -> None:
        """Take the floor's pressure as 0 m, before the timer starts and shares the bus."""
        LPS22HB_WaitForData(self.hal)
        self.press = self.press_zero_level = LPS22HB_Get_Press(self.hal, self.press)
        self.temperature = LPS22HB_Get_Temp(self.hal, self.temperature)
