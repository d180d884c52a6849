"""What is soldered where: profiles, addresses, and how the sensors sit on the board. A list, no behaviour.

Mounting: the output axes of the lab's ``ReadSensorRawData`` are out.X = -raw.Y, out.Y = raw.X, out.Z = raw.Z
(COORDINATE_SYSTEM 3) and are the board's X right, Y forward, Z up; so a sensor measures raw = MOUNTING @
board.
"""

from __future__ import annotations

from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from emulator.boards.description import MagnetometerMounting, Profile
from emulator.errors import InputError

Matrix: TypeAlias = NDArray[np.float64]

MOUNTING: Matrix = np.array([[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])

# The LIS2MDL's own drawing (datasheet figure 2) is left handed: seen from +Z, its Y lies clockwise of X. With
# that mounting the lab's formula is wrong under tilt, which is what flight software has to correct.
MAGNETOMETER_MOUNTING: dict[MagnetometerMounting, Matrix] = {
    "parallel": MOUNTING,
    "left_handed": np.diag([1.0, -1.0, 1.0]) @ MOUNTING,
}

LED1_PIN = ("B", 5)
LED2_PIN = ("B", 4)
UART_CLOCK_HZ = 84_000_000  # PCLK2, which feeds USART1


# -- firmware shipped for it ---------------------------------------------------------------------------------

PYTHON = {
    "lab3": "all exercises: raw data, calibration, altitude, pitch, roll, yaw, LEDs",
    "template": "exercise 1 only: the raw data block once a second",
}
ARM = {
    "solution": "all exercises in C, built for the chip",
    "template-arm": "the students' starting point in C, built for the chip",
}
ARM_PROGRAM = {"solution": "solution", "template-arm": "template"}
"""The program of :mod:`firmware_model.arm` behind each name."""
FIRMWARES = PYTHON | ARM
DEFAULT_FIRMWARE = "lab3"

# -- how the sensors are connected ---------------------------------------------------------------------------

PROFILES = {
    "lab3": Profile(
        "lab3",
        {"LSM6DSL": 0x6B, "LIS2MDL": 0x1E, "LPS22HB": 0x5D},
        {},
        "the lab as the slides draw it: all sensors on I2C2, SCL PB10, SDA PB3",
    ),
    "fcu001v1": Profile(
        "fcu001v1",
        {},
        {"LSM6DSL": "PA8", "LIS2MDL": "PB12", "LPS22HB": "PC13"},
        "the real board: all sensors on SPI2, three wires, one chip select each",
    ),
}


def profile(name: str) -> Profile:
    """The profile of that name. Raises InputError naming the known ones."""
    try:
        return PROFILES[name]
    except KeyError:
        raise InputError(f"unknown board profile {name!r}; known: {', '.join(PROFILES)}") from None
