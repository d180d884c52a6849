"""The lab's programs: base class, template, and solution.

Decision: each program of the lab is a class derived from ``LabFirmware``, which determines the
order in ``main``.

Decision: the angles are computed in the 800 Hz callback, because the LEDs must follow the tilt
immediately, and MagCalibration and eCompass need every sample.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Literal

from fcu_emulator.firmware_model.drivers.lps22hb import (
    LPS22HB_Get_Press,
    LPS22HB_Get_Temp,
    LPS22HB_WaitForData,
)
from fcu_emulator.firmware_model.ecompass import (
    MAG_MAX_START,
    MAG_MIN_START,
    MagCalibration,
    eCompass,
    getAltitude,
)
from fcu_emulator.firmware_model.hal import GPIO_PIN_RESET, GPIO_PIN_SET, PRINTF, Hal
from fcu_emulator.firmware_model.sensor_data import (
    AxesRaw_TypeDef,
    SensorReader,
    enableAllSensors,
    initializeAllSensors,
    setUpForFlight,
)

# -- Settings; the defaults are the lab's -------------------------------------------------------------------


TIMER_REGISTER_MAX = 0xFFFF  # TIM9's prescaler and auto-reload registers have 16 bits


@dataclass(frozen=True, slots=True, kw_only=True)
class Settings:
    """Firmware settings. Raises ValueError with the setting and its range."""

    mu: float = 1.0
    """Weight of Gx in the slides' roll, 0.01..1."""
    led1_axis: Literal["pitch", "roll"] = "pitch"
    """The angle that LED1 shows ("the x axis"). LED2 shows the other angle."""
    led_threshold_deg: float = 80.0
    """An LED is on while the absolute value of its angle is above this threshold."""
    banner: Literal["FH", "FW"] = "FH"
    """Spelling in the first line: FH as on the slides, or FW as in ST's source."""
    timer_prescaler: int = 83
    """TIM9's PSC; with the period, 84 MHz / 84 / 1250 = 800 Hz."""
    timer_period: int = 1249
    """TIM9's ARR."""

    def __post_init__(self) -> None:
        self._check("mu", 0.01 <= self.mu <= 1, "a number from 0.01 to 1")
        self._check("led1_axis", self.led1_axis in {"pitch", "roll"}, "'pitch' or 'roll'")
        self._check("led_threshold_deg", 0 <= self.led_threshold_deg <= 180, "a number from 0 to 180 degrees")
        self._check("banner", self.banner in {"FH", "FW"}, "'FH' or 'FW'")
        self._check("timer_prescaler", 0 <= self.timer_prescaler <= TIMER_REGISTER_MAX, "from 0 to 65535")
        self._check("timer_period", 0 <= self.timer_period <= TIMER_REGISTER_MAX, "from 0 to 65535")

    def _check(self, name: str, good: bool, right: str) -> None:
        if not good:
            raise ValueError(f"firmware setting {name} must be {right}, not {getattr(self, name)!r}")


# -- LED1 on PB5, LED2 on PB4, both active low (schematic of the STEVAL-FCU001V1) ---------------------------


LED_PORT = "B"
LED1_PIN = 5
LED2_PIN = 4


class LabLed:
    """An initially dark LED on a push-pull output."""

    def __init__(self, hal: Hal, pin: int) -> None:
        self._hal = hal
        self._pin = pin
        self.on = False
        hal.HAL_GPIO_Init(LED_PORT, pin)
        hal.HAL_GPIO_WritePin(LED_PORT, pin, GPIO_PIN_SET)

    def switch(self, on: bool) -> None:
        """Switch the LED, and write its pin only on a change."""
        if on is not self.on:
            self.on = on
            self._hal.HAL_GPIO_WritePin(LED_PORT, self._pin, GPIO_PIN_RESET if on else GPIO_PIN_SET)

    def toggle(self) -> None:
        self.on = not self.on
        self._hal.HAL_GPIO_TogglePin(LED_PORT, self._pin)


# -- The common base of all programs ------------------------------------------------------------------------


LOOP_DELAY_MS = 1000


class LabFirmware(ABC):
    """Base class of the lab's programs, with the C program's names.

    ``acc`` is in mg, ``gyro`` in mdps, ``mag`` in mgauss (X right, Y forward, Z up), pressures in
    hPa, ``temperature`` in degC, angles in degrees, ``alt`` in m.
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
        self._boot()
        while True:
            self.loop()

    @abstractmethod
    def loop(self) -> None:
        """Execute main.c's ``while (1)`` body once."""

    @abstractmethod
    def HAL_TIM_PeriodElapsedCallback(self) -> None:
        """Handle TIM9's interrupt, 800 times per second."""

    def ReadSensorRawData(self) -> None:
        """Update all values whose reads succeed."""
        self.press = self._sensors.ReadSensorRawData(self.acc, self.gyro, self.mag, self.press)

    def print_template_block(self) -> None:
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
        self.led1 = LabLed(hal, LED1_PIN)
        self.led2 = LabLed(hal, LED2_PIN)
        initializeAllSensors(hal)
        enableAllSensors(hal)
        setUpForFlight(hal)
        PRINTF(hal, "LAB3 Init...\n")
        self._set_zero_level()
        hal.HAL_TIM_Base_Init(settings.timer_prescaler, settings.timer_period)
        hal.HAL_TIM_Base_Start_IT()

    def _set_zero_level(self) -> None:
        """Read the pressure at the floor, which defines the altitude 0 m, before the callback also uses the bus."""
        LPS22HB_WaitForData(self.hal)
        self.press = self.press_zero_level = LPS22HB_Get_Press(self.hal, self.press)
        self.temperature = LPS22HB_Get_Temp(self.hal, self.temperature)


# -- Exercise 1: the template as handed out -----------------------------------------------------------------


class Template(LabFirmware):
    """The template without any changes."""

    def HAL_TIM_PeriodElapsedCallback(self) -> None:
        self.ReadSensorRawData()

    def loop(self) -> None:
        """Print values, wait for a second, and toggle both LEDs."""
        self.print_template_block()
        self.hal.HAL_Delay(LOOP_DELAY_MS)
        self.led1.toggle()
        self.led2.toggle()


# -- Exercises 1 to 5 solved: attitude, calibrated yaw, altitude, and the tilt on the LEDs ------------------


class Lab3(LabFirmware):
    """The solution of all exercises."""

    def __init__(self, hal: Hal, settings: Settings | None = None) -> None:
        super().__init__(hal, settings)
        # bound once, because it is called 800 times per second
        self._mu = self.settings.mu
        self._threshold_deg = self.settings.led_threshold_deg
        self._led1_shows_pitch = self.settings.led1_axis == "pitch"
        self._angles = (0.0, 0.0, 0.0)

    def HAL_TIM_PeriodElapsedCallback(self) -> None:
        self.ReadSensorRawData()
        MagCalibration(self.mag, self.mag_min, self.mag_max)
        angles = eCompass(self.acc, self.mag, self._mu)
        # if eCompass returns the same object, pins and variables are up to date
        if angles is not self._angles:
            self._angles = angles
            self.pitch, self.roll, self.azimuth = angles
            self._show_tilt()

    def loop(self) -> None:
        self.print_template_block()
        self._print_plot_block()
        self.hal.HAL_Delay(LOOP_DELAY_MS)

    def _show_tilt(self) -> None:
        pitch_steep = abs(self.pitch) > self._threshold_deg
        roll_steep = abs(self.roll) > self._threshold_deg
        self.led1.switch(pitch_steep if self._led1_shows_pitch else roll_steep)
        self.led2.switch(roll_steep if self._led1_shows_pitch else pitch_steep)

    def _print_plot_block(self) -> None:
        self.alt = getAltitude(self.press, self.temperature, self.press_zero_level)
        PRINTF(self.hal, "*****\n\r\n\r")
        PRINTF(self.hal, "Pitch: %f deg Roll: %f deg Yaw: %f deg \n\r", self.pitch, self.roll, self.azimuth)
        PRINTF(self.hal, "Altitude: %f m \n\r", self.alt)
        PRINTF(self.hal, "*****\n\r\n\r")
