"""Log of the values that firmware computes (cpu/value_log.c)."""

from __future__ import annotations

import ctypes
from collections.abc import Iterable
from types import TracebackType
from typing import Any, Final, TypeAlias

import numpy as np
import numpy.typing as npt

from fcu_emulator.emulator.chip.cpu.core import Core

Values: TypeAlias = npt.NDArray[np.void]
VALUE: Final = np.dtype([("address", "u4"), ("number", "u4"), ("value", "u4"), ("pair", "u4")])
"""struct LoggedValue of value_log.h: a register's value after the instruction at ``address``. ``pair`` is the value
of the neighbouring register, which may contain the other half of a double.
"""
FIRST_FLOAT: Final = 13
"""Lower register numbers are R0 to R12; numbers from this one on are S0 to S31."""
_CAPACITY: Final = 1 << 17
_REGISTERS: Final = 45
_LEVELS: Final = 8
_LATEST: Final = 1 << 16
_ADDRESSES: Final = 1 << 17


class _Level(ctypes.Structure):
    """struct ValueLogLevel of value_log.h."""

    _fields_ = (
        ("exception", ctypes.c_uint32),
        ("address", ctypes.c_uint32),
        ("registers", ctypes.c_uint32 * _REGISTERS),
    )


class _Log(ctypes.Structure):
    """struct ValueLog of value_log.h."""

    values: int
    capacity: int
    count: int
    lost: int
    level: int
    levels: ctypes.Array[_Level]
    keys: ctypes.Array[ctypes.c_uint32]
    counts: ctypes.Array[ctypes.c_uint8]

    _fields_ = (
        ("values", ctypes.c_uint64),
        *((name, ctypes.c_uint32) for name in ("capacity", "count", "lost", "level")),
        ("levels", _Level * _LEVELS),
        ("keys", ctypes.c_uint32 * _LATEST),
        ("latest", ctypes.c_uint32 * _LATEST),
        ("counts", ctypes.c_uint8 * _ADDRESSES),
    )


class ValueLog:
    """Logs the values that instructions in ``ranges`` (begin, end) compute while the context is
    active.

    If an instruction computes the same value several times in succession, the value is logged once. Between
    two calls of :meth:`take`, each instruction logs at most 100 values, so that loops do not fill the log.
    """

    def __init__(self, core: Core, ranges: Iterable[tuple[int, int]]) -> None:
        self._core = core
        self._ranges = tuple(ranges)
        self._values = np.zeros(_CAPACITY, VALUE)
        self._log = _Log(values=self._values.ctypes.data, capacity=_CAPACITY)

    def __enter__(self) -> ValueLog:
        self._watch(True)
        self._core.library.fcu_log_values(self._core.handle, ctypes.byref(self._log))
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._core.library.fcu_log_values(self._core.handle, None)
        self._watch(False)

    @property
    def lost(self) -> int:
        """Number of values that have not fitted into the log since the latest :meth:`take`."""
        return self._log.lost

    def take(self) -> Values:
        """Return and clear the logged ``VALUE`` records."""
        values = self._values[: self._log.count].copy()
        self._log.count = self._log.lost = self._log.level = 0
        for table in (self._log.levels, self._log.keys, self._log.counts):
            ctypes.memset(table, 0, ctypes.sizeof(table))
        return values

    def _watch(self, on: bool) -> None:
        for begin, end in self._ranges:
            self._core.library.fcu_watch_values(self._core.handle, begin, end, on)


def as_numbers(values: Values) -> dict[str, npt.NDArray[Any]]:
    """Return the values as arrays of int32, float32 and float64.

    An element is nan if its register cannot hold the type.
    """
    words = values["value"]
    is_float_register = values["number"] >= FIRST_FLOAT
    index = np.where(is_float_register, values["number"] - FIRST_FLOAT, values["number"])
    low = np.where(index & 1, values["pair"], words).astype("u8")
    high = np.where(index & 1, words, values["pair"]).astype("u8")
    return {
        "int32": np.where(is_float_register, np.nan, words.view("i4")),
        "float32": _as_floats(words),
        "float64": (high << np.uint64(32) | low).view("f8"),
    }


def _as_floats(words: npt.NDArray[np.uint32]) -> npt.NDArray[np.float64]:
    with np.errstate(invalid="ignore"):  # signalling nan
        return words.copy().view("f4").astype("f8")
