"""C's arithmetic where Python's differs: single precision, integer division, division by zero, pow().

A Python float is C's double, so a float32 variable is modelled by rounding at each store. Single-precision
products and quotients come out right too: for two float32 operands, rounding the double result once more
gives exactly the single-precision result (the 53 bits of a double are at least 2 * 24 + 2).
"""

from __future__ import annotations

import math
import struct

_FLOAT = struct.Struct("<f")


def f32(value: float) -> float:
    """``(float)value``: nearest single; what is too large becomes an infinity, as on the FPU."""
    try:
        (single,) = _FLOAT.unpack(_FLOAT.pack(value))
    except OverflowError:  # struct refuses what the FPU turns into an infinity
        return math.copysign(math.inf, value)
    return float(single)


def int_divide(dividend: int, divisor: int) -> int:
    """``dividend / divisor`` of two C ints: truncated toward zero, where Python's ``//`` rounds down."""
    quotient = abs(dividend) // abs(divisor)
    return quotient if (dividend < 0) == (divisor < 0) else -quotient


def float_divide(dividend: float, divisor: float) -> float:
    """``dividend / divisor`` of two C doubles (IEEE 754): x/0 is an infinity, 0/0 a NaN."""
    if divisor != 0.0:
        return dividend / divisor
    if dividend == 0.0 or math.isnan(dividend):
        return math.nan
    return math.copysign(math.inf, dividend) * math.copysign(1.0, divisor)


def c_pow(base: float, exponent: float) -> float:
    """math.h's ``pow`` (C11 7.12.7.4): a negative base with a fractional exponent gives a NaN."""
    try:
        return math.pow(base, exponent)
    except ValueError:
        return math.nan
