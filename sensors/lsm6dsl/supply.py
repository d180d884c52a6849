"""What the LSM6DSL draws, for estimates of battery life (datasheet Tables 3 and 4; sensor facts 1.3 and 1.4).

Approximation: the documents give no figure for both sensors together in low-power or normal mode, nor for a
sleeping gyroscope. Together is taken as the sum of the two, never more than the 650 uA of both in
high-performance mode; a sleeping gyroscope as one in its slowest low-power mode.
"""

from __future__ import annotations

from sensors.lsm6dsl.registers import CTRL1_XL, CTRL2_G, CTRL4_C, CTRL6_C, CTRL7_G

_POWER_DOWN_UA = 3.0
_XL_LOW_POWER_UA = {1: 9.0, 2: 14.0, 3: 25.0, 4: 44.0, 5: 85.0, 11: 4.5}  # ODR code, XL_HM_MODE = 1
_XL_HIGH_PERFORMANCE_UA = 150.0
_XL_FAST_UA = 160.0  # 1666 Hz and above
_XL_FAST_CODE = 8
_XL_LAST_CODE = 11
_G_LOW_POWER_UA = {1: 232.0, 2: 245.0, 3: 270.0, 4: 325.0, 5: 430.0}  # ODR code, G_HM_MODE = 1
_G_HIGH_PERFORMANCE_UA = 555.0
_G_LAST_CODE = 10
_BOTH_HIGH_PERFORMANCE_UA = 650.0


def supply_current_ua(mem: bytearray) -> float:
    """Supply current in microampere as the main bank's registers configure the part."""
    xl, g = _accelerometer(mem), _gyroscope(mem)
    if xl and g:
        return min(xl + g, _BOTH_HIGH_PERFORMANCE_UA)
    return xl or g or _POWER_DOWN_UA


def _accelerometer(mem: bytearray) -> float:
    code = CTRL1_XL.ODR_XL.get(mem[CTRL1_XL.addr])
    if not 0 < code <= _XL_LAST_CODE:
        return 0.0
    if mem[CTRL6_C.addr] & CTRL6_C.XL_HM_MODE.mask and code in _XL_LOW_POWER_UA:
        return _XL_LOW_POWER_UA[code]
    return _XL_FAST_UA if _XL_FAST_CODE <= code < _XL_LAST_CODE else _XL_HIGH_PERFORMANCE_UA


def _gyroscope(mem: bytearray) -> float:
    code = CTRL2_G.ODR_G.get(mem[CTRL2_G.addr])
    if not 0 < code <= _G_LAST_CODE:
        return 0.0
    if mem[CTRL4_C.addr] & CTRL4_C.SLEEP.mask:
        return _G_LOW_POWER_UA[1]
    if mem[CTRL7_G.addr] & CTRL7_G.G_HM_MODE.mask and code in _G_LOW_POWER_UA:
        return _G_LOW_POWER_UA[code]
    return _G_HIGH_PERFORMANCE_UA
