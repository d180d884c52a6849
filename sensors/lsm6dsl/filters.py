"""Which filters the LSM6DSL's registers select (datasheet figures 5, 7 and 8; AN5040 3.7 and 3.8).

Order and shape are not documented: see ``sensors.filters``. Further decisions:

* filters run at the output data rate, so that a cut-off of ODR/2 is what sampling leaves: no filter at all;
* low-pass filters begin settled on their first sample; slope and high-pass filters begin with zero, as AN5040
  3.7 says of the slope filter, and so do not begin with a lie about the past;
* the gyroscope's overall cut-off (AN5040 Table 19) is one low-pass; what its documented phase at 20 Hz has on
  top of that filter's own is a plain delay. LPF1 switched off has no phase table: it is delayed as FTYPE = 3;
* the long settling of the gyroscope above 833 Hz (AN5040 Table 16: up to 540 samples) is not reproduced
  beyond what these filters do.
"""

from __future__ import annotations

from functools import cache
from typing import NamedTuple

import numpy as np

from sensors.filters import SLOPE, Chain, Section, Start, chain, high_pass, low_pass, response
from sensors.lsm6dsl.event_samples import EventFilters
from sensors.lsm6dsl.registers import CTRL1_XL, CTRL2_G, CTRL4_C, CTRL6_C, CTRL7_G, CTRL8_XL

_UNCHANGED: Section = (1.0, 0.0, 0.0, 0.0, 0.0)

# -- accelerometer (AN5040 3.7 and Table 10) ----------------------------------------------------------------

_DIVISOR = (50, 100, 9, 400)  # CTRL8_XL.HPCF_XL: cut-off of LPF2 and of the high-pass, ODR over this
_SLOPE_CODE = 0  # of HPCF_XL, with HP_SLOPE_XL_EN
_ANALOG_WIDE_HZ, _ANALOG_NARROW_HZ = 1500, 400
_ANALOG_WIDE_FROM_HZ = 1666


def accelerometer_chain(mem: bytearray, odr_hz: float, *, high_performance: bool) -> Chain | None:
    """The filters of the accelerometer's output as the main register bank says; None where there are none."""
    if not odr_hz:
        return None
    control = mem[CTRL8_XL.addr]
    sections = _analog(mem, odr_hz, high_performance=high_performance)
    high_pass_path = bool(control & CTRL8_XL.HP_SLOPE_XL_EN.mask)
    if high_pass_path or control & CTRL8_XL.LPF2_XL_EN.mask:
        narrow = control & CTRL8_XL.INPUT_COMPOSITE.mask
    else:
        narrow = mem[CTRL1_XL.addr] & CTRL1_XL.LPF1_BW_SEL.mask
    if narrow:
        sections.append(low_pass(1 / 4))
    code = CTRL8_XL.HPCF_XL.get(control)
    start: Start = "settled"
    if high_pass_path and code == _SLOPE_CODE:
        start = "zero"
        sections.append(SLOPE)
    elif high_pass_path and control & CTRL8_XL.HP_REF_MODE.mask:
        start = "reference"
        sections.append(_UNCHANGED)
    elif high_pass_path:
        start = "zero"
        sections.append(high_pass(1 / _DIVISOR[code]))
    elif control & CTRL8_XL.LPF2_XL_EN.mask:
        sections.append(low_pass(1 / _DIVISOR[code]))
    return chain(tuple(sections), start) if sections else None


def event_filters(mem: bytearray, odr_hz: float, *, high_performance: bool) -> EventFilters:
    """What the event functions get: LPF1 as INPUT_COMPOSITE selects it, and LPF2 behind it for 6D.

    Their slope and high-pass filters hang on the composite filter's input (datasheet figure 8).
    """
    if not odr_hz:
        return EventFilters(None, None)
    sections = _analog(mem, odr_hz, high_performance=high_performance)
    if mem[CTRL8_XL.addr] & CTRL8_XL.INPUT_COMPOSITE.mask:
        sections.append(low_pass(1 / 4))
    lpf2 = low_pass(1 / _DIVISOR[CTRL8_XL.HPCF_XL.get(mem[CTRL8_XL.addr])])
    return EventFilters(tuple(sections), (*sections, lpf2))


def _analog(mem: bytearray, odr_hz: float, *, high_performance: bool) -> list[Section]:
    sections: list[Section] = []
    if high_performance:
        wide = odr_hz >= _ANALOG_WIDE_FROM_HZ and not mem[CTRL1_XL.addr] & CTRL1_XL.BW0_XL.mask
        _add_low_pass(sections, _ANALOG_WIDE_HZ if wide else _ANALOG_NARROW_HZ, odr_hz)
    return sections


def slow_to_settle(mem: bytearray) -> bool:
    """Whether the accelerometer's output passes LPF1 at ODR/4 or the slope filter (AN5040 Table 13)."""
    control = mem[CTRL8_XL.addr]
    slope = control & CTRL8_XL.HP_SLOPE_XL_EN.mask and CTRL8_XL.HPCF_XL.get(control) == _SLOPE_CODE
    return bool(slope or mem[CTRL1_XL.addr] & CTRL1_XL.LPF1_BW_SEL.mask)


def reference_mode_is_idle(mem: bytearray) -> bool:
    """HP_REF_MODE without the high-pass filter whose reference it would set (AN5040 3.7)."""
    control = mem[CTRL8_XL.addr]
    high_pass_on = control & CTRL8_XL.HP_SLOPE_XL_EN.mask and CTRL8_XL.HPCF_XL.get(control) != _SLOPE_CODE
    return bool(control & CTRL8_XL.HP_REF_MODE.mask and not high_pass_on)


# -- gyroscope (AN5040 3.8) ---------------------------------------------------------------------------------

_HIGH_PASS_HZ = (0.016, 0.065, 0.260, 1.04)  # CTRL7_G.HPM_G

# Overall cut-off in Hz by ODR code (Table 19): LPF1 off, then FTYPE 0 to 3; the same up to 208 Hz.
_CUTOFF_HZ = {
    1: (4, 4, 4, 4, 4),
    2: (8, 8, 8, 8, 8),
    3: (17, 17, 17, 17, 17),
    4: (33, 33, 33, 33, 33),
    5: (67, 67, 67, 67, 67),
    6: (137, 138, 131, 121, 138),
    7: (312, 245, 195, 155, 293),
    8: (988, 315, 224, 168, 505),
    9: (1161, 343, 234, 172, 925),
    10: (1250, 351, 237, 173, 937),
}
_OFF = 0  # column of LPF1 off

# Phase delay in degrees at 20 Hz by ODR code, FTYPE 0 to 3.
_PHASE_HZ = 20
_PHASE_DEG = {
    3: (144, 146, 149, 142),
    4: (75, 77, 79, 73),
    5: (40, 42, 45, 39),
    6: (23, 25, 28, 21),
    7: (14, 17, 19, 13),
    8: (10, 12, 15, 8),
    9: (8, 10, 12, 6),
    10: (7, 9, 11, 5),
}
_FIRST_PHASE_CODE, _FIRST_PHASE_ODR_HZ = 3, 52  # below, the delay is as many sample periods as here


class GyroscopeFilter(NamedTuple):
    """``chain`` of the output, None where there is none, fed with the rate of ``delay_s`` ago."""

    chain: Chain | None
    delay_s: float


def gyroscope_filter(mem: bytearray, code: int, odr_hz: float, *, high_performance: bool) -> GyroscopeFilter:
    """The gyroscope's filters at ODR code ``code`` (1 to 10), as the main register bank says."""
    if not odr_hz:
        return GyroscopeFilter(None, 0.0)
    lpf1 = high_performance and mem[CTRL4_C.addr] & CTRL4_C.LPF1_SEL_G.mask
    column = 1 + CTRL6_C.FTYPE.get(mem[CTRL6_C.addr]) if lpf1 else _OFF
    low: list[Section] = []
    _add_low_pass(low, _CUTOFF_HZ[code][column], odr_hz)
    delay_s = _delay_s(tuple(low), code, column, odr_hz)
    control = mem[CTRL7_G.addr]
    if high_performance and control & CTRL7_G.HP_EN_G.mask:
        corner = high_pass(_HIGH_PASS_HZ[CTRL7_G.HPM_G.get(control)] / odr_hz)
        return GyroscopeFilter(chain((corner, *low), "zero"), delay_s)
    return GyroscopeFilter(chain(tuple(low), "settled") if low else None, delay_s)


def high_pass_is_idle(mem: bytearray) -> bool:
    """HP_EN_G in low-power or normal mode, where there is no high-pass filter (AN5040 3.8)."""
    control = mem[CTRL7_G.addr]
    low_power = control & CTRL7_G.G_HM_MODE.mask and CTRL2_G.ODR_G.get(mem[CTRL2_G.addr]) in range(1, 6)
    return bool(control & CTRL7_G.HP_EN_G.mask and low_power)


@cache
def _delay_s(low: tuple[Section, ...], code: int, column: int, odr_hz: float) -> float:
    """What the documented phase at 20 Hz leaves after the low-pass filter's own."""
    if code < _FIRST_PHASE_CODE:
        first, periods = _FIRST_PHASE_ODR_HZ, _FIRST_PHASE_ODR_HZ / odr_hz
        same = (low_pass(_CUTOFF_HZ[_FIRST_PHASE_CODE][column] / first),)
        return _delay_s(same, _FIRST_PHASE_CODE, column, first) * periods
    documented = _PHASE_DEG[code][column - 1]  # LPF1 off takes the last one
    gain = response(low, np.array([_PHASE_HZ / odr_hz]))
    own = -float(np.degrees(np.angle(gain[0])))
    return (documented - own) / 360 / _PHASE_HZ


def _add_low_pass(sections: list[Section], cutoff_hz: float, odr_hz: float) -> None:
    if cutoff_hz < odr_hz / 2:
        sections.append(low_pass(cutoff_hz / odr_hz))
