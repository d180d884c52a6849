"""General-purpose inputs and outputs (RM0368 section 8.4)."""

from __future__ import annotations

from fcu_emulator.emulator.chip.registers.declaration import Variant, Word
from fcu_emulator.sensors.register import Bits

SOURCE = "RM0368 8.4"
INSTANCES = ("GPIOA", "GPIOB", "GPIOC", "GPIOD", "GPIOE", "GPIOH")
VARIANTS = {
    "GPIOA": {
        "MODER": Variant(reset=0xA800_0000),
        "OSPEEDR": Variant(reset=0x0C00_0000),
        "PUPDR": Variant(reset=0x6400_0000),
    },
    "GPIOB": {"MODER": Variant(reset=0x280), "OSPEEDR": Variant(reset=0xC0), "PUPDR": Variant(reset=0x100)},
}
"""The debug port's pins. Some revisions of RM0368 print 0x0C00 0000 for MODER of port A, which contradicts section
8.3.1.
"""


class MODER(Word, addr=0x00):
    """Mode."""

    MODERx = Bits(1, 0, count=16, step=2, doc="input, output, alternate function, analog")


class OTYPER(Word, addr=0x04):
    """Output type."""

    OTx = Bits(0, count=16, doc="open drain")


class OSPEEDR(Word, addr=0x08):
    """Output speed."""

    OSPEEDRx = Bits(1, 0, count=16, step=2, modelled=False, doc="low, medium, fast, high")


class PUPDR(Word, addr=0x0C):
    """Pull-up and pull-down resistors."""

    PUPDRx = Bits(1, 0, count=16, step=2, doc="none, pull-up, pull-down")


class IDR(Word, addr=0x10, access="r"):
    """Input data."""

    IDRx = Bits(0, count=16, doc="the pin's level")


class ODR(Word, addr=0x14):
    """Output data."""

    ODRx = Bits(0, count=16, doc="the latch")


class BSRR(Word, addr=0x18, access="w"):
    """Bit set and reset of ODR."""

    BRx = Bits(16, count=16, doc="clears the latch")
    BSx = Bits(0, count=16, doc="sets the latch; wins over BRx")


class LCKR(Word, addr=0x1C):
    """Configuration lock."""

    LCKK = Bits(16, doc="lock key")
    LCKx = Bits(0, count=16, doc="the pin's configuration is locked")


class AFRL(Word, addr=0x20):
    """Alternate function, pins 0 to 7."""

    AFRLx = Bits(3, 0, count=8, step=4, doc="AF0 to AF15")


class AFRH(Word, addr=0x24):
    """Alternate function, pins 8 to 15."""

    AFRHx = Bits(3, 0, count=8, step=4, first=8, doc="AF0 to AF15")
