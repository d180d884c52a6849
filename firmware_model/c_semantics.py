"""C semantics that differ from Python: float32, integer division, division by zero, pow(), printf.

A Python float is C's double. Storing it as float32 rounds it. So products and quotients of two
float32 values match single precision.

``sprintf`` supports ``%d %i %u %x %X %c %s %f %F %e %E %g %G %%``, flags, width, precision and hh,
h, l, ll, for int and long of 32 bits (C11 7.21.6.1).

Decision: printf formatting does not use Python's ``%`` operator, because the operator differs from C.
Differences are zero padding with a precision, a precision of 0, ``%#x`` of 0, negative ``%x``, and
infinities.
"""

from __future__ import annotations

import math
import operator
import re
import struct
from collections.abc import Iterator
from typing import NamedTuple, SupportsFloat, SupportsIndex

# -- Arithmetic ---------------------------------------------------------------------------------------------


_FLOAT = struct.Struct("<f")


def f32(value: float) -> float:
    """Return the nearest float32, as on the FPU. Large values become infinity."""
    try:
        (single,) = _FLOAT.unpack(_FLOAT.pack(value))
    except OverflowError:  # struct refuses values that become an infinity on the FPU
        return math.copysign(math.inf, value)
    return float(single)


def int_divide(dividend: int, divisor: int) -> int:
    """Return a C int quotient, truncated toward zero."""
    quotient = abs(dividend) // abs(divisor)
    return quotient if (dividend < 0) == (divisor < 0) else -quotient


def float_divide(dividend: float, divisor: float) -> float:
    """Return a C double quotient (IEEE 754): x/0 is an infinity, 0/0 a NaN."""
    if divisor != 0.0:
        return dividend / divisor
    if dividend == 0.0 or math.isnan(dividend):
        return math.nan
    return math.copysign(math.inf, dividend) * math.copysign(1.0, divisor)


def c_pow(base: float, exponent: float) -> float:
    """Return C's ``pow``: a NaN for a negative base with fractional exponent."""
    try:
        return math.pow(base, exponent)
    except ValueError:
        return math.nan


# -- printf -------------------------------------------------------------------------------------------------


CArgument = SupportsFloat | SupportsIndex | str | bytes

_SPEC = re.compile(r"%([-+ #0]*)(\*|\d+)?(?:\.(\*|\d*))?(hh|h|ll|l)?(.?)", re.DOTALL)
_BITS = {"hh": 8, "h": 16, "": 32, "l": 32, "ll": 64}
_DEFAULT_FLOAT_PRECISION = 6


class _Spec(NamedTuple):
    text: str  # the specification as it was written, for messages
    flags: str
    width: int
    precision: int | None
    length: str
    conversion: str


def sprintf(fmt: str, *args: CArgument) -> bytes:
    """Format ``args`` as C's ``sprintf`` does.

    ``%s`` takes str (sent as UTF-8) or bytes, ``%c`` an integer or one character. Raises ValueError
    for unsupported specifications and missing or wrong arguments.
    """
    arguments = iter(args)
    # One character per byte, so that widths and precisions count bytes as C does.
    template = fmt.encode().decode("latin-1")
    text = _SPEC.sub(lambda match: _convert(_parse(match, arguments), arguments), template)
    return text.encode("latin-1")


def _parse(match: re.Match[str], arguments: Iterator[CArgument]) -> _Spec:
    text = match.group()
    flags, width_text, precision_text, length, conversion = match.groups()
    width = _number(width_text or "0", text, arguments)
    if width < 0:  # "taken as a - flag followed by a positive field width"
        flags, width = flags + "-", -width
    # A lone "." means 0; a negative precision "is taken as if the precision were omitted".
    precision = None if precision_text is None else _number(precision_text or "0", text, arguments)
    if precision is not None and precision < 0:
        precision = None
    return _Spec(text, flags, width, precision, length or "", conversion)


def _number(digits: str, text: str, arguments: Iterator[CArgument]) -> int:
    return _wrapped(_integer_argument(text, arguments), 32, signed=True) if digits == "*" else int(digits)


def _convert(spec: _Spec, arguments: Iterator[CArgument]) -> str:
    if spec.text == "%%":
        return "%"
    if spec.conversion in tuple("di"):
        return _signed(spec, _integer_argument(spec.text, arguments))
    if spec.conversion in tuple("uxX"):
        return _unsigned(spec, _integer_argument(spec.text, arguments))
    if spec.conversion in tuple("fFeEgG") and spec.length in {"", "l"}:
        return _floating(spec, _float_argument(spec.text, arguments))
    if spec.conversion in tuple("cs") and not spec.length:
        return _characters(spec, _next_argument(spec.text, arguments))
    raise ValueError(f"sprintf: {spec.text!r} is not supported; use d i u x X c s f F e E g G or %%")


def _next_argument(text: str, arguments: Iterator[CArgument]) -> CArgument:
    for argument in arguments:
        return argument
    raise ValueError(f"sprintf: no argument left for {text!r}; pass one for each specification")


def _integer_argument(text: str, arguments: Iterator[CArgument]) -> int:
    argument = _next_argument(text, arguments)
    if type(argument) is int:  # the usual case; checking a protocol takes a hundred times as long
        return argument
    if isinstance(argument, SupportsIndex):
        return operator.index(argument)
    raise ValueError(f"sprintf: {text!r} got {argument!r}; it needs an integer")


def _float_argument(text: str, arguments: Iterator[CArgument]) -> float:
    argument = _next_argument(text, arguments)
    if type(argument) is float:
        return argument
    if isinstance(argument, SupportsFloat) and not isinstance(argument, SupportsIndex):
        return float(argument)
    raise ValueError(f"sprintf: {text!r} got {argument!r}; it needs a float")


def _wrapped(value: int, bits: int, *, signed: bool) -> int:
    value &= (1 << bits) - 1
    return value - (1 << bits) if signed and value >> (bits - 1) else value


def _sign(spec: _Spec, negative: bool) -> str:
    if negative:
        return "-"
    return "+" if "+" in spec.flags else " " if " " in spec.flags else ""


def _signed(spec: _Spec, argument: int) -> str:
    value = _wrapped(argument, _BITS[spec.length], signed=True)
    return _padded(spec, _sign(spec, value < 0), _digits(spec, abs(value), "d"), spec.precision is None)


def _unsigned(spec: _Spec, argument: int) -> str:
    value = _wrapped(argument, _BITS[spec.length], signed=False)
    prefix = "0" + spec.conversion if "#" in spec.flags and spec.conversion != "u" and value else ""
    base = "d" if spec.conversion == "u" else spec.conversion
    return _padded(spec, prefix, _digits(spec, value, base), spec.precision is None)


def _digits(spec: _Spec, magnitude: int, base: str) -> str:
    if spec.precision == 0 and magnitude == 0:  # C11: "the result ... is no characters"
        return ""
    return format(magnitude, base).rjust(spec.precision or 0, "0")


def _floating(spec: _Spec, value: float) -> str:
    precision = _DEFAULT_FLOAT_PRECISION if spec.precision is None else spec.precision
    alternative = "#" if "#" in spec.flags else ""
    body = f"%{alternative}.{precision}{spec.conversion}" % abs(value)
    negative = math.copysign(1.0, value) < 0  # also -0.0 and a NaN with its sign bit set
    return _padded(spec, _sign(spec, negative), body, math.isfinite(value))


def _characters(spec: _Spec, argument: CArgument) -> str:
    if spec.conversion == "s" and isinstance(argument, str | bytes):
        data = argument.encode() if isinstance(argument, str) else argument
        return _padded(spec, "", data[: spec.precision].decode("latin-1"), zero_fill=False)
    if spec.conversion == "c" and isinstance(argument, str) and len(argument) == 1 and argument.isascii():
        return _padded(spec, "", argument, zero_fill=False)
    if spec.conversion == "c" and isinstance(argument, SupportsIndex):
        return _padded(spec, "", chr(operator.index(argument) & 0xFF), zero_fill=False)
    raise ValueError(f"sprintf: {spec.text!r} got {argument!r}; %s needs text, %c one character")


def _padded(spec: _Spec, prefix: str, body: str, zero_fill: bool) -> str:
    """Pad on the right for "-", between prefix and digits for "0", otherwise on the left."""
    if "-" in spec.flags:
        return (prefix + body).ljust(spec.width)
    if "0" in spec.flags and zero_fill:
        return prefix + body.rjust(spec.width - len(prefix), "0")
    return (prefix + body).rjust(spec.width)
