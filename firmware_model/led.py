"""The board's two LEDs: LED1 on PB5, LED2 on PB4, both active low (board facts, section 2)."""

from __future__ import annotations

from firmware_model.hal import GPIO_PIN_RESET, GPIO_PIN_SET, Hal

LED_PORT = "B"
LED1_PIN = 5
LED2_PIN = 4


class Led:
    """One LED. Creating it is ``BSP_LED_Init`` and ``BSP_LED_Off``: a push-pull output, dark."""

    def __init__(self, hal: Hal, pin: int) -> None:
        self._hal = hal
        self._pin = pin
        self.on = False
        hal.HAL_GPIO_Init(LED_PORT, pin)
        hal.HAL_GPIO_WritePin(LED_PORT, pin, GPIO_PIN_SET)

    def switch(self, on: bool) -> None:
        """Light it or not; the pin is written only on a change, so that a trace shows changes only."""
        if on is not self.on:
            self.on = on
            self._hal.HAL_GPIO_WritePin(LED_PORT, self._pin, GPIO_PIN_RESET if on else GPIO_PIN_SET)

    def toggle(self) -> None:
        """``BSP_LED_Toggle``."""
        self.on = not self.on
        self._hal.HAL_GPIO_TogglePin(LED_PORT, self._pin)
