"""Timers TIM1 to TIM5 and TIM9 to TIM11 (RM0368 sections 12.4, 13.4, 14.4, 14.5)."""

from __future__ import annotations

from fcu_emulator.emulator.chip.registers.declaration import WORD, Variant, Word
from fcu_emulator.sensors.register import Bits

SOURCE = "RM0368 12.4, 13.4, 14.4, 14.5"
INSTANCES = ("TIM1", "TIM2", "TIM3", "TIM4", "TIM5", "TIM9", "TIM10", "TIM11")


def _variants(
    channels: int, *, bits: int = 16, advanced: bool = False, up_only: bool = False, remap: int = 0
) -> dict[str, Variant]:
    """Return the registers of a timer; ``remap`` has the bits of its field in OR."""
    ones = (1 << bits) - 1
    compare = (1 << channels) - 1
    flags = 0x41 | compare << 1 | (0xA0 if advanced else 0)
    dma = 0 if up_only else 0x4100 | compare << 9 | (0x2000 if advanced else 0)
    return {
        "CR1": Variant(0x38F if up_only else 0x3FF),
        "CR2": Variant(0x7FFD if advanced else 0x70 if up_only else 0xF8),
        "SMCR": Variant(0 if channels == 1 else 0xF7 if up_only else WORD),
        "DIER": Variant(flags | dma),
        "SR": Variant(flags | compare << 9),
        "EGR": Variant(flags),
        "CCMR1": Variant(0xFF if channels == 1 else 0xFFFF),
        "CCMR2": Variant(0 if channels < 4 else 0xFFFF),
        "CCER": Variant((0xFFFF if advanced else 0xBBBB) & (1 << 4 * channels) - 1),
        "CNT": Variant(ones),
        "ARR": Variant(ones, reset=ones),
        **{f"CCR{n}": Variant(ones if n <= channels else 0) for n in range(1, 5)},
        "RCR": Variant(WORD if advanced else 0),
        "BDTR": Variant(WORD if advanced else 0),
        "DCR": Variant(0 if up_only else WORD),
        "DMAR": Variant(0 if up_only else WORD),
        "OR": Variant(remap),
    }


VARIANTS = {
    "TIM1": _variants(4, advanced=True),
    "TIM2": _variants(4, bits=32, remap=0xC00),
    "TIM3": _variants(4),
    "TIM4": _variants(4),
    "TIM5": _variants(4, bits=32, remap=0xC0),
    "TIM9": _variants(2, up_only=True),
    "TIM10": _variants(1, up_only=True),
    "TIM11": _variants(1, up_only=True, remap=0x3),
}


class CR1(Word, addr=0x00):
    """Control 1."""

    CKD = Bits(9, 8, modelled=False, doc="clock of the input filters")
    ARPE = Bits(7, doc="ARR is preloaded")
    CMS = Bits(6, 5, doc="edge-aligned, or one of three centre-aligned modes")
    DIR = Bits(4, doc="counts down")
    OPM = Bits(3, doc="one pulse: stops at the next update")
    URS = Bits(2, doc="only overflow and underflow raise UIF")
    UDIS = Bits(1, doc="no updates")
    CEN = Bits(0, doc="counts")


class CR2(Word, addr=0x04):
    """Control 2."""

    OIS4 = Bits(14, modelled=False, doc="idle state of output 4")
    OIS3N = Bits(13, modelled=False, doc="idle state of output 3N")
    OIS3 = Bits(12, modelled=False, doc="idle state of output 3")
    OIS2N = Bits(11, modelled=False, doc="idle state of output 2N")
    OIS2 = Bits(10, modelled=False, doc="idle state of output 2")
    OIS1N = Bits(9, modelled=False, doc="idle state of output 1N")
    OIS1 = Bits(8, modelled=False, doc="idle state of output 1")
    TI1S = Bits(7, modelled=False, doc="input 1 is the XOR of three inputs")
    MMS = Bits(6, 4, doc="trigger output")
    CCDS = Bits(3, modelled=False, doc="DMA requests of the channels are sent at an update")
    CCUS = Bits(2, modelled=False, doc="event that updates preloaded controls")
    CCPC = Bits(0, modelled=False, doc="controls are preloaded")


class SMCR(Word, addr=0x08):
    """Slave mode control."""

    ETP = Bits(15, modelled=False, doc="external trigger inverted")
    ECE = Bits(14, modelled=False, doc="external clock mode 2")
    ETPS = Bits(13, 12, modelled=False, doc="external trigger prescaler")
    ETF = Bits(11, 8, modelled=False, doc="external trigger filter")
    MSM = Bits(7, modelled=False, doc="the timer is synchronised with its slaves")
    TS = Bits(6, 4, modelled=False, doc="trigger selection")
    SMS = Bits(2, 0, modelled=False, doc="slave mode")


class DIER(Word, addr=0x0C):
    """DMA and interrupt enable."""

    TDE = Bits(14, modelled=False, doc="DMA on trigger")
    COMDE = Bits(13, modelled=False, doc="DMA on commutation")
    CC4DE = Bits(12, modelled=False, doc="DMA on channel 4")
    CC3DE = Bits(11, modelled=False, doc="DMA on channel 3")
    CC2DE = Bits(10, modelled=False, doc="DMA on channel 2")
    CC1DE = Bits(9, modelled=False, doc="DMA on channel 1")
    UDE = Bits(8, doc="DMA on update")
    BIE = Bits(7, doc="interrupt on break")
    TIE = Bits(6, doc="interrupt on trigger")
    COMIE = Bits(5, doc="interrupt on commutation")
    CC4IE = Bits(4, doc="interrupt on channel 4")
    CC3IE = Bits(3, doc="interrupt on channel 3")
    CC2IE = Bits(2, doc="interrupt on channel 2")
    CC1IE = Bits(1, doc="interrupt on channel 1")
    UIE = Bits(0, doc="interrupt on update")


class SR(Word, addr=0x10, access="rc_w0"):
    """Status."""

    CC4OF = Bits(12, doc="channel 4 captured twice")
    CC3OF = Bits(11, doc="channel 3 captured twice")
    CC2OF = Bits(10, doc="channel 2 captured twice")
    CC1OF = Bits(9, doc="channel 1 captured twice")
    BIF = Bits(7, doc="break")
    TIF = Bits(6, doc="trigger")
    COMIF = Bits(5, doc="commutation")
    CC4IF = Bits(4, doc="channel 4 has captured or compared")
    CC3IF = Bits(3, doc="channel 3 has captured or compared")
    CC2IF = Bits(2, doc="channel 2 has captured or compared")
    CC1IF = Bits(1, doc="channel 1 has captured or compared")
    UIF = Bits(0, doc="update")


class EGR(Word, addr=0x14, access="w"):
    """Event generation."""

    BG = Bits(7, doc="break")
    TG = Bits(6, doc="trigger")
    COMG = Bits(5, doc="commutation")
    CC4G = Bits(4, doc="capture or compare 4")
    CC3G = Bits(3, doc="capture or compare 3")
    CC2G = Bits(2, doc="capture or compare 2")
    CC1G = Bits(1, doc="capture or compare 1")
    UG = Bits(0, doc="update")


class CCMR1(Word, addr=0x18):
    """Capture and compare mode, channels 1 and 2."""

    OC2CE = Bits(15, modelled=False, doc="output 2 is cleared by the external trigger")
    OC2M = Bits(14, 12, doc="mode of output 2")
    OC2PE = Bits(11, doc="CCR2 is preloaded")
    OC2FE = Bits(10, modelled=False, doc="output 2 reacts fast to a trigger")
    CC2S = Bits(9, 8, doc="channel 2: output, or the input that it captures")
    OC1CE = Bits(7, modelled=False, doc="output 1 is cleared by the external trigger")
    OC1M = Bits(6, 4, doc="mode of output 1")
    OC1PE = Bits(3, doc="CCR1 is preloaded")
    OC1FE = Bits(2, modelled=False, doc="output 1 reacts fast to a trigger")
    CC1S = Bits(1, 0, doc="channel 1: output, or the input that it captures")
    IC2F = Bits(15, 12, modelled=False, overlay=True, doc="as input: filter")
    IC2PSC = Bits(11, 10, overlay=True, doc="as input: edges per capture")
    IC1F = Bits(7, 4, modelled=False, overlay=True, doc="as input: filter")
    IC1PSC = Bits(3, 2, overlay=True, doc="as input: edges per capture")


class CCMR2(Word, addr=0x1C):
    """Capture and compare mode, channels 3 and 4."""

    OC4CE = Bits(15, modelled=False, doc="output 4 is cleared by the external trigger")
    OC4M = Bits(14, 12, doc="mode of output 4")
    OC4PE = Bits(11, doc="CCR4 is preloaded")
    OC4FE = Bits(10, modelled=False, doc="output 4 reacts fast to a trigger")
    CC4S = Bits(9, 8, doc="channel 4: output, or the input that it captures")
    OC3CE = Bits(7, modelled=False, doc="output 3 is cleared by the external trigger")
    OC3M = Bits(6, 4, doc="mode of output 3")
    OC3PE = Bits(3, doc="CCR3 is preloaded")
    OC3FE = Bits(2, modelled=False, doc="output 3 reacts fast to a trigger")
    CC3S = Bits(1, 0, doc="channel 3: output, or the input that it captures")
    IC4F = Bits(15, 12, modelled=False, overlay=True, doc="as input: filter")
    IC4PSC = Bits(11, 10, overlay=True, doc="as input: edges per capture")
    IC3F = Bits(7, 4, modelled=False, overlay=True, doc="as input: filter")
    IC3PSC = Bits(3, 2, overlay=True, doc="as input: edges per capture")


class CCER(Word, addr=0x20):
    """Capture and compare enable."""

    CC4NP = Bits(15, doc="input 4: both edges")
    CC4P = Bits(13, doc="channel 4 inverted")
    CC4E = Bits(12, doc="channel 4 on")
    CC3NP = Bits(11, doc="output 3N inverted")
    CC3NE = Bits(10, modelled=False, doc="output 3N on")
    CC3P = Bits(9, doc="channel 3 inverted")
    CC3E = Bits(8, doc="channel 3 on")
    CC2NP = Bits(7, doc="output 2N inverted")
    CC2NE = Bits(6, modelled=False, doc="output 2N on")
    CC2P = Bits(5, doc="channel 2 inverted")
    CC2E = Bits(4, doc="channel 2 on")
    CC1NP = Bits(3, doc="output 1N inverted")
    CC1NE = Bits(2, modelled=False, doc="output 1N on")
    CC1P = Bits(1, doc="channel 1 inverted")
    CC1E = Bits(0, doc="channel 1 on")


class CNT(Word, addr=0x24):
    """Counter."""


class PSC(Word, addr=0x28):
    """Prescaler."""

    PSC = Bits(15, 0, doc="the clock is divided by PSC + 1")


class ARR(Word, addr=0x2C, reset=0xFFFF_FFFF):
    """Auto-reload: the highest count."""


class RCR(Word, addr=0x30):
    """Repetition counter."""

    REP = Bits(7, 0, doc="number of overflows without an update")


class CCRx(Word, addr=0x34, count=4, step=0x04, first=1):
    """Capture and compare value."""


class BDTR(Word, addr=0x44):
    """Break and dead time."""

    MOE = Bits(15, doc="main output enable")
    AOE = Bits(14, modelled=False, doc="MOE is set by updates")
    BKP = Bits(13, modelled=False, doc="break polarity")
    BKE = Bits(12, modelled=False, doc="break input on")
    OSSR = Bits(11, modelled=False, doc="state of disabled outputs while MOE is 1")
    OSSI = Bits(10, modelled=False, doc="state of disabled outputs while MOE is 0")
    LOCK = Bits(9, 8, modelled=False, doc="lock level")
    DTG = Bits(7, 0, modelled=False, doc="dead time")


class DCR(Word, addr=0x48):
    """DMA burst control."""

    DBL = Bits(12, 8, modelled=False, doc="length of the burst")
    DBA = Bits(4, 0, modelled=False, doc="first register of the burst")


class DMAR(Word, addr=0x4C):
    """DMA burst access."""

    DMAB = Bits(15, 0, modelled=False, doc="a register of the burst")


class OR(Word, addr=0x50):
    """Input remap."""

    ITR1_RMP = Bits(11, 10, modelled=False, doc="TIM2: internal trigger 1")
    TI4_RMP = Bits(7, 6, doc="TIM5: input 4 is 0 the pin, 1 LSI, 2 LSE, 3 the RTC's wake-up (without effect)")
    TI1_RMP = Bits(1, 0, modelled=False, doc="TIM11: input 1")
