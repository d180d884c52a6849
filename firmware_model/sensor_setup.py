"""main.c's start-up of the sensors: initialise all, enable all, set them up (board facts, section 5)."""

from __future__ import annotations

from firmware_model.debug import PRINTF
from firmware_model.drivers.component import COMPONENT_OK
from firmware_model.drivers.lis2mdl import LIS2MDL_Enable, LIS2MDL_FlightSetup, LIS2MDL_Init
from firmware_model.drivers.lps22hb import LPS22HB_Enable, LPS22HB_Init
from firmware_model.drivers.lsm6dsl import (
    LSM6DSL_FlightSetup,
    LSM6DSL_G_Enable,
    LSM6DSL_G_Init,
    LSM6DSL_X_Enable,
    LSM6DSL_X_Init,
)
from firmware_model.hal import Hal

_SPIN_MS = 1000


def initializeAllSensors(hal: Hal) -> None:
    """Initialise the sensors one after the other; **never returns** if one is missing or is another part.

    ST's code then hangs in ``while(1);`` without a word: the banner is all the terminal shows, the LEDs stay
    dark, the timer never starts. Only HAL calls let virtual time pass, so the empty loop is modelled by
    endless delays.
    """
    for init in (LSM6DSL_X_Init, LSM6DSL_G_Init, LIS2MDL_Init, LPS22HB_Init):
        if init(hal) != COMPONENT_OK:
            while True:
                hal.HAL_Delay(_SPIN_MS)


def enableAllSensors(hal: Hal) -> None:
    """Start each sensor and say so; like main.c it does not look at the status."""
    LSM6DSL_X_Enable(hal)
    PRINTF(hal, "LSM6DSL MEMS Accelerometer initialized and enabled\n")
    LSM6DSL_G_Enable(hal)
    PRINTF(hal, "LSM6DSL MEMS Gyroscope initialized and enabled\n")
    LIS2MDL_Enable(hal)
    PRINTF(hal, "LIS2MDL Magnetometer initialized and enabled\n")
    LPS22HB_Enable(hal)
    PRINTF(hal, "LPS22HB Pressure sensor initialized and enabled\n")
    LPS22HB_Enable(hal)
    PRINTF(hal, "LPS22HB Temperature sensor initialized and enabled\n")


def setUpForFlight(hal: Hal) -> None:
    """Set the output rates, ranges and filters the rest of the program counts on."""
    LSM6DSL_FlightSetup(hal)
    LIS2MDL_FlightSetup(hal)
