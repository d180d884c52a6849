"""Independent watchdog (RM0368 section 15.4)."""

from __future__ import annotations

from fcu_emulator.emulator.chip.registers.declaration import Word
from fcu_emulator.sensors.register import Bits

SOURCE = "RM0368 15.4"
INSTANCES = ("IWDG",)


class KR(Word, addr=0x00, access="w"):
    """Key."""

    KEY = Bits(15, 0, doc="0x5555 unlocks, 0xAAAA reloads, 0xCCCC starts")


class PR(Word, addr=0x04):
    """Prescaler."""

    PR = Bits(2, 0, doc="LSI divided by 4 to 256")


class RLR(Word, addr=0x08, reset=0xFFF):
    """Reload."""

    RL = Bits(11, 0, doc="the counter's first value")


class SR(Word, addr=0x0C, access="r"):
    """Status."""

    RVU = Bits(1, modelled=False, doc="an update of RLR is in progress")
    PVU = Bits(0, modelled=False, doc="an update of PR is in progress")
