"""Which pins of a block are still to be switched to it."""

from __future__ import annotations

from emulator.arm.peripherals.pins import unconnected
from emulator.clock import Clock
from emulator.gpio import Gpio
from emulator.trace import Trace

I2C2 = (("B", 10, 4), ("B", 3, 9))  # SCL as AF4, SDA as AF9 (STM32F401 datasheet, table 9)


def test_pins_not_switched_yet_are_named_with_what_they_need() -> None:
    gpio = Gpio(Clock(), Trace())
    assert unconnected(gpio, I2C2) == "PB10 to AF4, PB3 to AF9"
    gpio.set_alternate("B", 10, 4)
    gpio.set_alternate("B", 3, 4)
    assert unconnected(gpio, I2C2) == "PB3 to AF9"
    gpio.set_alternate("B", 3, 9)
    assert unconnected(gpio, I2C2) == ""
    gpio.set_alternate("B", 10, None)
    assert unconnected(gpio, I2C2) == "PB10 to AF4"
