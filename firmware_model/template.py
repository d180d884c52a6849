"""Exercise 1: the template as handed out. Samples at 800 Hz, prints once a second, blinks the LEDs."""

from __future__ import annotations

from firmware_model.lab import LOOP_DELAY_MS, LabFirmware


class Template(LabFirmware):
    """The template, unchanged."""

    def HAL_TIM_PeriodElapsedCallback(self) -> None:
        """Refresh the sensor values."""
        self.ReadSensorRawData()

    def loop(self) -> None:
        """Print the measured values, wait a second, toggle both LEDs."""
        self.print_template_block()
        self.hal.HAL_Delay(LOOP_DELAY_MS)
        self.led1.toggle()
        self.led2.toggle()
