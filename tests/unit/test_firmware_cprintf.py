"""printf according to the C standard, refused specifications, and the limit of PRINTF."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from fcu_emulator.firmware_model.c_semantics import sprintf
from fcu_emulator.firmware_model.hal import PRINTF
from tests.support.firmware_fakes import FakeHal
from tests.support.words import Words


@pytest.mark.parametrize(
    ("fmt", "args", "expected"),
    [
        ("%d %i", (1008, -377), b"1008 -377"),
        ("%d", (2**31,), b"-2147483648"),  # int has 32 bits
        ("%ld", (2**31,), b"-2147483648"),  # and so has long, on ARM
        ("%lld", (2**31,), b"2147483648"),
        ("%u %x %X", (-1, -1, 48879), b"4294967295 ffffffff BEEF"),
        ("%hhd %hd %hhu %hu", (200, 40000, -1, -1), b"-56 -25536 255 65535"),
        ("%#x %#x", (255, 0), b"0xff 0"),  # C11 7.21.6.1: "a nonzero result has 0x prefixed"
        (
            "%08.3d|%.0d|%+.0d",
            (5, 0, 0),
            b"     005||+",
        ),  # a precision cancels the 0 flag; 0 with .0 is no characters
        ("%-6d|%06d|%+d|% d", (5, -5, 5, 5), b"5     |-00005|+5| 5"),
        ("%*d|%*d", (4, 7, -4, 7), b"   7|7   "),
        ("%.*f|%.*f", (2, 1.0, -2, 1.0), b"1.00|1.000000"),
        ("%f", (977.4000244140625,), b"977.400024"),
        ("%f", (np.float32(977.4),), b"977.400024"),  # promoted to double
        ("%lf", (0.5,), b"0.500000"),
        ("%f %f", (-0.0, -1e-9), b"-0.000000 -0.000000"),
        ("%f %F %e %05f", (math.inf, math.inf, -math.inf, math.inf), b"inf INF -inf   inf"),
        ("%f %F %f", (math.nan, math.nan, math.copysign(math.nan, -1)), b"nan NAN -nan"),
        (
            "%e %E %g %G %#g",
            (1e100, 12345.678, 1e-5, 1e10, 1.0),
            b"1.000000e+100 1.234568E+04 1e-05 1E+10 1.00000",
        ),
        ("%c%c%c", (65, "b", 256 + 10), b"Ab\n"),
        ("%s|%5s|%-5s|%.2s", ("abc", "de", "fg", b"hij"), b"abc|   de|fg   |hi"),
        ("%5s°", ("°",), b"   \xc2\xb0\xc2\xb0"),  # widths count bytes, text is sent as UTF-8
        ("100%% \n\r", (), b"100% \n\r"),
        ("%d", (1, 2), b"1"),  # C11 7.21.6.1: excess arguments are ignored
    ],
)
def test_sprintf_formats_as_in_c(fmt: str, args: tuple[Any, ...], expected: bytes) -> None:
    assert sprintf(fmt, *args) == expected


@pytest.mark.parametrize(
    ("fmt", "args"),
    [
        ("%q", (1,)),
        ("%o", (1,)),
        ("%n", (1,)),
        ("%zu", (1,)),
        ("%1$d", (1,)),
        ("%5%", ()),
        ("%hf", (1.0,)),
        ("%lls", ("a",)),
        ("50 %", ()),
        ("%d %d", (1,)),
        ("%*d", (4,)),
        ("%d", (1.0,)),
        ("%f", (1,)),
        ("%f", ("1",)),
        ("%s", (1,)),
        ("%c", ("ab",)),
        ("%c", ("°",)),
    ],
)
def test_sprintf_refuses_unknown_format_in_one_line(fmt: str, args: tuple[Any, ...], words: Words) -> None:
    with pytest.raises(ValueError, match=r"^sprintf: ") as caught:
        sprintf(fmt, *args)
    assert "\n" not in str(caught.value)
    words("python", str(caught.value))


@pytest.mark.parametrize(("length", "sent"), [(0, 0), (253, 253), (254, 254), (255, 254), (1000, 254)])
def test_printf_sends_at_most_254_bytes_per_transmit(length: int, sent: int) -> None:
    hal = FakeHal()
    PRINTF(hal, "%s", "x" * length)  # vsnprintf into 255 bytes, 254 used
    assert hal.transmissions == [b"x" * sent]
