"""The firmware's hardware interface: STM32Cube HAL protocols, and PRINTF.

**Only HAL calls take virtual time**. In compiled firmware, all instructions take time.

Decision: HAL calls use Python types instead of C pointers: a read returns ``(status, data)``.
Device addresses have 8 bits, as in C: 0xD6, 0x3C, 0xBA.

``PRINTF`` sends at most 254 bytes. ST's ``myprintf`` reads past its buffer.
"""

from __future__ import annotations

from typing import Protocol

from fcu_emulator.firmware_model.c_semantics import CArgument, sprintf

# HAL_StatusTypeDef, stm32f4xx_hal_def.h
HAL_OK = 0
HAL_ERROR = 1
HAL_BUSY = 2
HAL_TIMEOUT = 3

GPIO_PIN_RESET = 0
GPIO_PIN_SET = 1


class Hal(Protocol):
    """The lab's HAL calls. A status is HAL_OK, HAL_ERROR, HAL_BUSY or HAL_TIMEOUT."""

    def HAL_Delay(self, delay_ms: int) -> None:
        """Wait for ``delay_ms`` ticks while interrupts run."""

    def HAL_GetTick(self) -> int:
        """Return milliseconds since reset."""

    def HAL_I2C_Mem_Read(self, dev_address: int, mem_address: int, size: int) -> tuple[int, bytes]:
        """Read ``size`` bytes from ``mem_address``. There is data only with HAL_OK."""

    def HAL_I2C_Mem_Write(self, dev_address: int, mem_address: int, data: bytes) -> int:
        """Write ``data`` to ``mem_address`` and above, and return the status."""

    def HAL_UART_Transmit(self, data: bytes, timeout_ms: int) -> int:
        """Send all bits on USART1 while interrupts run, and return the status."""

    def HAL_UART_Receive(self, size: int, timeout_ms: int) -> tuple[int, bytes]:
        """Return bytes that USART1 receives before the timeout."""

    def HAL_GPIO_Init(self, port: str, pin: int) -> None:
        """Make a pin a push-pull output. ``port`` is a letter, ``pin`` 0..15."""

    def HAL_GPIO_WritePin(self, port: str, pin: int, state: int) -> None:
        """Drive a pin to GPIO_PIN_RESET or GPIO_PIN_SET."""

    def HAL_GPIO_TogglePin(self, port: str, pin: int) -> None:
        """Invert a pin's output."""

    def HAL_TIM_Base_Init(self, prescaler: int, period: int) -> None:
        """Set TIM9's period to (prescaler + 1) * (period + 1) cycles of 84 MHz."""

    def HAL_TIM_Base_Start_IT(self) -> None:
        """Start TIM9, which calls ``HAL_TIM_PeriodElapsedCallback``."""


class Application(Protocol):
    """Firmware functions that the HAL calls."""

    def main(self) -> None:
        """Run the program forever."""

    def HAL_TIM_PeriodElapsedCallback(self) -> None:
        """Handle TIM9's interrupt, which preempts ``main`` during HAL calls."""


PRINTF_LIMIT = 254  # a 255-byte buffer without the terminating zero
PRINTF_TIMEOUT_MS = 1000


def PRINTF(hal: Hal, fmt: str, *args: CArgument) -> None:
    """Format as C does and transmit. The text is lost if the UART is busy."""
    hal.HAL_UART_Transmit(sprintf(fmt, *args)[:PRINTF_LIMIT], PRINTF_TIMEOUT_MS)
