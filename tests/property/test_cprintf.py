"""The printf of the firmware model equals the C library's printf, which is called through ctypes."""

from __future__ import annotations

import ctypes
import ctypes.util
import struct
import sys
from collections.abc import Callable

from hypothesis import given, settings
from hypothesis import strategies as st

from fcu_emulator.firmware_model.c_semantics import sprintf

DETERMINISTIC = settings(derandomize=True, database=None, deadline=None, max_examples=300)
BUFFER_SIZE = 4096
CValue = int | float | bytes


def posix_snprintf() -> Callable[[bytes, list[CValue]], bytes]:
    library = ctypes.CDLL(ctypes.util.find_library("c"))
    # Without the types of the fixed arguments, variadic calls go wrong on arm64 macOS.
    library.snprintf.argtypes = [ctypes.c_char_p, ctypes.c_size_t, ctypes.c_char_p]

    def promoted(value: CValue) -> object:
        if isinstance(value, float):
            return ctypes.c_double(value)
        return ctypes.c_longlong(value) if isinstance(value, int) else ctypes.c_char_p(value)

    def call(fmt: bytes, args: list[CValue]) -> bytes:
        buffer = ctypes.create_string_buffer(BUFFER_SIZE)
        length = library.snprintf(buffer, BUFFER_SIZE, fmt, *map(promoted, args))
        return buffer.raw[:length]

    return call


def windows_snprintf() -> Callable[[bytes, list[CValue]], bytes]:
    """Return the C99 printf of the universal runtime; msvcrt's printf is older, and ``snprintf`` is inline."""
    library = ctypes.CDLL("ucrtbase")
    standard_behaviour = ctypes.c_uint64(2)  # _CRT_INTERNAL_PRINTF_STANDARD_SNPRINTF_BEHAVIOR

    def slot(value: CValue) -> int:
        if isinstance(value, float):
            return int(struct.unpack("<Q", struct.pack("<d", value))[0])
        if isinstance(value, int):
            return value & (2**64 - 1)
        return ctypes.cast(ctypes.c_char_p(value), ctypes.c_void_p).value or 0

    def call(fmt: bytes, args: list[CValue]) -> bytes:
        buffer = ctypes.create_string_buffer(BUFFER_SIZE)
        # On 64-bit Windows a va_list points to an array of 8-byte slots.
        va_list = (ctypes.c_uint64 * max(len(args), 1))(*map(slot, args))
        length = library.__stdio_common_vsprintf(
            standard_behaviour, buffer, ctypes.c_size_t(BUFFER_SIZE), ctypes.c_char_p(fmt), None, va_list
        )
        return buffer.raw[:length]

    return call


c_snprintf = windows_snprintf() if sys.platform == "win32" else posix_snprintf()

widths = st.just("") | st.integers(0, 40).map(str)
precisions = st.just("") | st.integers(0, 30).map(".{}".format)
lengths = st.sampled_from(["", "h", "hh", "l", "ll"])
integers = st.integers(-(2**63), 2**63 - 1)


def prefixes(flags: str) -> st.SearchStrategy[str]:
    """Return a strategy for the part of a specification before the length modifier."""
    return st.tuples(st.text(flags, max_size=4), widths, precisions).map(lambda parts: "%" + "".join(parts))


def agree(fmt: str, *args: CValue) -> None:
    assert sprintf(fmt, *args) == c_snprintf(fmt.encode(), list(args))


def agree_on_integer(prefix: str, length: str, conversion: str, value: int) -> None:
    fmt = prefix + length + conversion
    host_value = value
    if length == "l":  # ARM's long has 32 bits, the host's may have 64
        low = value & 0xFFFFFFFF
        host_value = low - 2**32 if conversion in "di" and low >= 2**31 else low
    assert sprintf(fmt, value) == c_snprintf(fmt.encode(), [host_value])


@DETERMINISTIC
@given(prefixes("-+ 0"), lengths, st.sampled_from("di"), integers)
def test_signed_integers_print_as_in_c(prefix: str, length: str, conversion: str, value: int) -> None:
    agree_on_integer(prefix, length, conversion, value)


@DETERMINISTIC
@given(prefixes("-0#"), lengths, st.sampled_from("xX"), integers)
def test_hexadecimal_numbers_print_as_in_c(prefix: str, length: str, conversion: str, value: int) -> None:
    agree_on_integer(prefix, length, conversion, value)


@DETERMINISTIC
@given(prefixes("-0"), lengths, integers)
def test_unsigned_integers_print_as_in_c(prefix: str, length: str, value: int) -> None:
    agree_on_integer(prefix, length, "u", value)


@DETERMINISTIC
@given(prefixes("-0"), st.sampled_from("diuxX"), st.integers(-2, 2))
def test_small_integers_print_as_in_c(prefix: str, conversion: str, value: int) -> None:
    agree(prefix + conversion, value)


# A NaN's sign is printed by glibc and newlib but not by every C library; the unit tests state it.
floats = st.floats(allow_nan=False) | st.just(float("nan")) | st.floats(width=32, allow_nan=False)


@DETERMINISTIC
@given(prefixes("-+ #0"), st.sampled_from("fFeEgG"), floats)
def test_floats_print_as_in_c(prefix: str, conversion: str, value: float) -> None:
    agree(prefix + conversion, value)


@DETERMINISTIC
@given(st.sampled_from("feg"), st.integers(0, 8), st.integers(-4000, 4000), st.sampled_from([2, 8, 32, 1000]))
def test_floats_halfway_between_outputs_print_as_in_c(
    conversion: str, precision: int, numerator: int, denominator: int
) -> None:
    agree(f"%.{precision}{conversion}", numerator / denominator)


c_text = st.binary(max_size=20).filter(lambda data: 0 not in data)


@DETERMINISTIC
@given(prefixes("-"), c_text)
def test_strings_print_as_in_c(prefix: str, text: bytes) -> None:
    agree(prefix + "s", text)


@DETERMINISTIC
@given(st.sampled_from(["%", "%-"]), widths, st.integers(0, 255))
def test_characters_print_as_in_c(flags: str, width: str, code: int) -> None:
    agree(f"{flags}{width}c", code)


@DETERMINISTIC
@given(st.integers(-40, 40), st.integers(-10, 30), st.floats(-1e6, 1e6), st.integers(-(2**31), 2**31 - 1))
def test_star_takes_width_and_precision_from_arguments(
    width: int, precision: int, value: float, integer: int
) -> None:
    agree("[%*.*f] [%0*d] [%-*x]", width, precision, value, width, integer, width, integer)


@DETERMINISTIC
@given(*[st.integers(-(2**31), 2**31 - 1)] * 3, st.floats(width=32, allow_nan=False))
def test_lines_of_lab_print_as_in_c(x: int, y: int, z: int, pressure: float) -> None:
    agree("ACC[x,y,z] %d mg %d mg %d mg \n\r", x, y, z)
    agree("Pre: %f hPa \n\r", pressure)
