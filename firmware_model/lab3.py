"""Exercises 1 to 5 solved: attitude, calibrated yaw, altitude, and the tilt on the LEDs.

Decision: the angles are computed in the 800 Hz callback, as the brief orders them, not in the main loop where
the plot slide calls eCompass: the LEDs must follow the tilt at once, and MagCalibration and eCompass see
every sample.
"""

from __future__ import annotations

from firmware_model.debug import PRINTF
from firmware_model.ecompass import eCompass, getAltitude
from firmware_model.hal import Hal
from firmware_model.lab import LOOP_DELAY_MS, LabFirmware
from firmware_model.mag_calibration import MagCalibration
from firmware_model.settings import Settings


class Lab3(LabFirmware):
    """All exercises."""

    def __init__(self, hal: Hal, settings: Settings | None = None) -> None:
        super().__init__(hal, settings)
        # Read 800 times a second: bound once.
        self._mu = self.settings.mu
        self._threshold_deg = self.settings.led_threshold_deg
        self._led1_shows_pitch = self.settings.led1_axis == "pitch"
        self._angles = (0.0, 0.0, 0.0)

    def HAL_TIM_PeriodElapsedCallback(self) -> None:
        """Refresh, calibrate, compute the angles, show the tilt."""
        self.ReadSensorRawData()
        MagCalibration(self.mag, self.mag_min, self.mag_max)
        angles = eCompass(self.acc, self.mag, self._mu)
        if angles is not self._angles:  # else pins and variables show them already
            self._angles = angles
            self.pitch, self.roll, self.azimuth = angles
            self._show_tilt()

    def loop(self) -> None:
        """Print both blocks and wait a second; the LEDs belong to the callback."""
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
