"""The SCL clock that an I2C block's registers ask for (RM0368 sections 18.6.2, 18.6.8, 18.6.9)."""

from __future__ import annotations

from collections.abc import Iterator
from fractions import Fraction

from emulator.clock import PS_PER_S
from emulator.i2c import FAST_MODE_HZ

FAST, DUTY = 1 << 15, 1 << 14
_CCR = 0xFFF
_PER_PERIOD = {0: 2, FAST: 3, FAST | DUTY: 25}  # counts of CCR in a period: 1+1, 1+2, 9+16
_RISE_NS = {0: 1000, FAST: 300}  # the I2C specification's longest rise times


def period_ps(ccr: int, pclk_hz: int) -> Fraction | None:
    """The period of SCL for the value of CCR; None where there is no clock because CCR counts nothing."""
    count = ccr & _CCR
    mode = ccr & (FAST | DUTY) if ccr & FAST else 0
    return Fraction(_PER_PERIOD[mode] * count * PS_PER_S, pclk_hz) if count else None


def problems(ccr: int, trise: int, freq_mhz: int, pclk_hz: int) -> Iterator[str]:
    """What the manual forbids of a setting, in words; the block clocks all the same."""
    fast = ccr & FAST
    mode = "fast" if fast else "standard"
    if freq_mhz * 1_000_000 != pclk_hz:
        yield f"CR2.FREQ is {freq_mhz}, PCLK1 is {pclk_hz / 1e6:g} MHz: set-up and hold times are wrong"
    if freq_mhz < (4 if fast else 2):
        yield f"{mode} mode needs PCLK1 of at least {4 if fast else 2} MHz, CR2.FREQ says {freq_mhz}"
    if ccr & _CCR < (1 if ccr & (FAST | DUTY) == FAST | DUTY else 4):
        yield f"CCR counts {ccr & _CCR}; at least 4, or 1 with DUTY"
    longest = freq_mhz * _RISE_NS[fast] // 1000 + 1
    if trise != longest:
        yield f"TRISE is {trise}; {longest} fits {mode} mode at {freq_mhz} MHz"
    period = period_ps(ccr, pclk_hz)
    if period is not None and PS_PER_S / period > FAST_MODE_HZ * Fraction(101, 100):
        yield f"SCL runs at {float(PS_PER_S / period) / 1000:.0f} kHz; the sensors' limit is 400 kHz"
