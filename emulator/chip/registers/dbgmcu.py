"""Debug MCU (RM0368 section 23.16)."""

from __future__ import annotations

from fcu_emulator.emulator.chip.registers.declaration import Word
from fcu_emulator.sensors.register import Bits

SOURCE = "RM0368 23.6, 23.16"
INSTANCES = ("DBGMCU",)


class IDCODE(Word, addr=0x00, access="r", reset=0x1001_0423):
    """Identity."""

    REV_ID = Bits(31, 16, doc="revision Z")
    DEV_ID = Bits(11, 0, doc="STM32F401xB/C")


class CR(Word, addr=0x04):
    """Configuration."""

    TRACE_MODE = Bits(7, 6, modelled=False, doc="trace pins")
    TRACE_IOEN = Bits(5, modelled=False, doc="trace pins on")
    DBG_STANDBY = Bits(2, doc="debug in standby")
    DBG_STOP = Bits(1, doc="debug in stop")
    DBG_SLEEP = Bits(0, modelled=False, doc="debug in sleep")


class APB1_FZ(Word, addr=0x08, modelled=False):
    """Timers on APB1 that stop while the core is halted."""

    DBG_I2C3_SMBUS_TIMEOUT = Bits(23, doc="I2C3's time-out")
    DBG_I2C2_SMBUS_TIMEOUT = Bits(22, doc="I2C2's time-out")
    DBG_I2C1_SMBUS_TIMEOUT = Bits(21, doc="I2C1's time-out")
    DBG_IWDG_STOP = Bits(12, doc="IWDG")
    DBG_WWDG_STOP = Bits(11, doc="WWDG")
    DBG_RTC_STOP = Bits(10, doc="RTC")
    DBG_TIM5_STOP = Bits(3, doc="TIM5")
    DBG_TIM4_STOP = Bits(2, doc="TIM4")
    DBG_TIM3_STOP = Bits(1, doc="TIM3")
    DBG_TIM2_STOP = Bits(0, doc="TIM2")


class APB2_FZ(Word, addr=0x0C, modelled=False):
    """Timers on APB2 that stop while the core is halted."""

    DBG_TIM11_STOP = Bits(18, doc="TIM11")
    DBG_TIM10_STOP = Bits(17, doc="TIM10")
    DBG_TIM9_STOP = Bits(16, doc="TIM9")
    DBG_TIM1_STOP = Bits(0, doc="TIM1")
