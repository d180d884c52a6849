"""The STEVAL-FCU001V1, according to its schematic: an STM32F401CC with LSM6DSL, LIS2MDL and LPS22HB.

Raw values are MOUNTING @ the vector in the board's axes, because the lab's ``ReadSensorRawData``
has out.X = -raw.Y, out.Y = raw.X, out.Z = raw.Z. On the real board, the sensors are on SPI2; the
lab's slides show I2C2 (wiring ``lab3``).
"""

from __future__ import annotations

import numpy as np

from fcu_emulator.emulator.boards.description import (
    AbsentPart,
    BoardDescription,
    CallbackTimer,
    I2cPins,
    MountedSensor,
    SerialLine,
    Wiring,
)
from fcu_emulator.sensors import LIS2MDL, LPS22HB, LSM6DSL

_MOUNTING = np.array([[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])

# The axes in the LIS2MDL datasheet (figure 2) are left-handed: seen from +Z, Y is clockwise from X. With
# this mounting, the lab's formula is wrong for a tilted board.
_LEFT_HANDED = np.diag([1.0, -1.0, 1.0]) @ _MOUNTING

FCU001V1 = BoardDescription(
    name="STEVAL-FCU001V1",
    parts=(
        MountedSensor(LSM6DSL, {"parallel": _MOUNTING}),
        MountedSensor(
            LIS2MDL,
            {"parallel": _MOUNTING, "left_handed": _LEFT_HANDED},
            mounting_key="magnetometer_mounting",
        ),
        MountedSensor(LPS22HB),
    ),
    i2c={"I2C2": I2cPins(scl=("B", 10, 4), sda=("B", 3, 9))},
    spi=("SPI2",),
    serial=SerialLine("USART1", tx=("A", 9, 7), clock_hz=84_000_000),  # PCLK2
    timer=CallbackTimer("TIM9", input_hz=84_000_000, priority=3),  # TIM1_BRK_TIM9_IRQn, APB2 timer clock
    leds={"LED1": ("B", 5), "LED2": ("B", 4)},
    motors=(("TIM4", 1), ("TIM4", 2), ("TIM4", 3), ("TIM4", 4)),  # PB6 to PB9
    absent=(
        AbsentPart(
            "BlueNRG",
            spi="SPI1",
            chip_select=("B", 0),
            note="the Bluetooth module is absent on the virtual board; firmware continues after its time-outs",
            held={("A", 4): 0},  # interrupt output
        ),
    ),
    wirings=(
        Wiring(
            "lab3",
            "I2C2",
            {"LSM6DSL": 0x6B, "LIS2MDL": 0x1E, "LPS22HB": 0x5D},
            "the wiring on the lab's slides: all sensors on I2C2, SCL PB10, SDA PB3",
            symbols=("hi2c2",),
        ),
        Wiring(
            "fcu001v1",
            "SPI2",
            {"LSM6DSL": "PA8", "LIS2MDL": "PB12", "LPS22HB": "PC13"},
            "the real board: all sensors on SPI2, three wires, one chip select each",
            symbols=("hspi2", "SPI_Sensor_Handle"),
        ),
    ),
    python_firmware={
        "lab3": "all exercises: raw data, calibration, altitude, pitch, roll, yaw, LEDs",
        "template": "exercise 1 only: the raw data block once a second",
    },
    built_firmware={
        "solution": ("solution", "all exercises in C, built for the chip"),
        "template-arm": ("template", "the students' starting point in C, built for the chip"),
    },
    default_firmware="lab3",
)
