"""A HAL without physics: register memories, a log, and a power switch that ends the firmware's endless loop."""

from __future__ import annotations

import struct

from fcu_emulator.firmware_model import LabFirmware, Settings
from fcu_emulator.firmware_model.hal import HAL_ERROR, HAL_OK, HAL_TIMEOUT

LSM6DSL, LIS2MDL, LPS22HB = 0xD6, 0x3C, 0xBA
LED1, LED2 = ("B", 5), ("B", 4)


class PowerOffError(Exception):
    """The board was switched off during a delay."""


class FakeHal:
    """Three register memories with their reset values, and all calls of the firmware in order.

    Timer interrupts come when the timer starts (STM32: the update flag is already set) and ``ticks_per_delay`` times
    in each later delay. ``power_off_at`` is the number of the delay that never returns, counted from 1.
    """

    def __init__(self, power_off_at: int = 3, ticks_per_delay: int = 1) -> None:
        self.registers = {device: bytearray(0x80) for device in (LSM6DSL, LIS2MDL, LPS22HB)}
        self.registers[LSM6DSL][0x0F] = 0x6A
        self.registers[LSM6DSL][0x12] = 0x04
        self.registers[LIS2MDL][0x4F] = 0x40
        self.registers[LIS2MDL][0x60] = 0x03
        self.registers[LPS22HB][0x0F] = 0xB1
        self.registers[LPS22HB][0x11] = 0x10
        self.registers[LPS22HB][0x27] = 0x03
        self.silent: set[int] = set()
        self.transactions: list[tuple[str, int, int, bytes]] = []
        self.transmissions: list[bytes] = []
        self.delays_ms: list[int] = []
        self.pins: dict[tuple[str, int], int] = {}
        self.pin_events: list[tuple[str, tuple[str, int], int]] = []
        self.timer: tuple[int, int] | None = None
        self.timer_running = False
        self.firmware: LabFirmware | None = None
        self.power_off_at = power_off_at
        self.ticks_per_delay = ticks_per_delay

    @property
    def text(self) -> bytes:
        return b"".join(self.transmissions)

    def set_axes(self, device: int, register: int, x: int, y: int, z: int) -> None:
        struct.pack_into("<hhh", self.registers[device], register, x, y, z)

    def set_pressure(self, raw: int, temperature_raw: int = 2150) -> None:
        self.registers[LPS22HB][0x28:0x2B] = raw.to_bytes(3, "little", signed=True)
        struct.pack_into("<h", self.registers[LPS22HB], 0x2B, temperature_raw)

    def set_slide_values(self) -> None:
        """Set the raw registers of the slides' terminal output; MAG has the nearest values."""
        self.set_axes(LSM6DSL, 0x28, 189, -361, 8264)
        self.set_axes(LSM6DSL, 0x22, -1, -10, -1)
        self.set_axes(LIS2MDL, 0x68, 134, -8, -252)
        self.set_pressure(4003431)

    def tick(self) -> None:
        if self.firmware is not None and self.timer_running:
            self.firmware.HAL_TIM_PeriodElapsedCallback()

    def HAL_Delay(self, delay_ms: int) -> None:
        self.delays_ms.append(delay_ms)
        if len(self.delays_ms) >= self.power_off_at:
            raise PowerOffError
        for _ in range(self.ticks_per_delay):
            self.tick()

    def HAL_GetTick(self) -> int:
        return sum(self.delays_ms)

    def HAL_I2C_Mem_Read(self, dev_address: int, mem_address: int, size: int) -> tuple[int, bytes]:
        if dev_address in self.silent:
            return HAL_ERROR, b""
        data = bytes(self.registers[dev_address][mem_address : mem_address + size])
        self.transactions.append(("R", dev_address, mem_address, data))
        return HAL_OK, data

    def HAL_I2C_Mem_Write(self, dev_address: int, mem_address: int, data: bytes) -> int:
        if dev_address in self.silent:
            return HAL_ERROR
        self.transactions.append(("W", dev_address, mem_address, data))
        self.registers[dev_address][mem_address : mem_address + len(data)] = data
        self.registers[LPS22HB][0x11] &= (
            ~0x84 & 0xFF
        )  # BOOT and SWRESET clear themselves (LPS22HB datasheet 9.6)
        return HAL_OK

    def HAL_UART_Transmit(self, data: bytes, timeout_ms: int) -> int:
        self.transmissions.append(data)
        return HAL_OK

    def HAL_UART_Receive(self, size: int, timeout_ms: int) -> tuple[int, bytes]:
        return HAL_TIMEOUT, b""

    def HAL_GPIO_Init(self, port: str, pin: int) -> None:
        self.pins[port, pin] = 0
        self.pin_events.append(("init", (port, pin), 0))

    def HAL_GPIO_WritePin(self, port: str, pin: int, state: int) -> None:
        self.pins[port, pin] = state
        self.pin_events.append(("write", (port, pin), state))

    def HAL_GPIO_TogglePin(self, port: str, pin: int) -> None:
        self.pins[port, pin] ^= 1
        self.pin_events.append(("toggle", (port, pin), self.pins[port, pin]))

    def HAL_TIM_Base_Init(self, prescaler: int, period: int) -> None:
        self.timer = (prescaler, period)

    def HAL_TIM_Base_Start_IT(self) -> None:
        self.timer_running = True
        self.tick()


def run_until_power_off(
    firmware_class: type[LabFirmware], hal: FakeHal, settings: Settings | None = None
) -> LabFirmware:
    """Boot a firmware on the fake and run it until the delay that never returns."""
    firmware = firmware_class(hal, settings)
    hal.firmware = firmware
    try:
        firmware.main()
    except PowerOffError:
        return firmware
    raise AssertionError("main() returned")
