"""Search for a value among a firmware's computed values."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np
import numpy.typing as npt

from fcu_emulator.emulator.chip.cpu.value_log import Values, as_numbers

_TYPES: Final = ("int32", "float32", "float64")
_MOST_VALUES: Final = 40
"""An instruction with more values in one pose belongs to a counter or a copy, where any value may occur.
"""


class ValueSearch:
    """Logged values in several poses. An instruction computes a quantity if its values fit in all poses."""

    def __init__(self, logs: Sequence[Values]) -> None:
        self._tables = [_sorted(log) for log in logs]

    def addresses(self, expected: npt.NDArray[np.float64], tolerance: npt.NDArray[np.float64]) -> list[int]:
        """Return, in ascending order, the addresses of instructions that compute the expected value of each pose."""
        if not np.all(np.isfinite(expected)):
            return []
        found: set[int] = set()
        for kind in _TYPES:
            common: set[int] | None = None
            for table, value, apart in zip(self._tables, expected, tolerance, strict=True):
                values, addresses = table[kind]
                begin, end = np.searchsorted(values, (value - apart, value + apart))
                if end < len(values) and values[end] == value + apart:
                    end += 1
                here = set(addresses[begin:end].tolist())
                common = here if common is None else common & here
                if not common:
                    break
            found |= common or set()
        return sorted(found)


def _sorted(log: Values) -> dict[str, tuple[npt.NDArray[np.float64], npt.NDArray[np.uint32]]]:
    tables = {}
    _, which, counts = np.unique(log["address"], return_inverse=True, return_counts=True)
    few = counts[which] <= _MOST_VALUES
    for kind, values in as_numbers(log).items():
        usable = np.isfinite(values) & few
        order = np.argsort(values[usable], kind="stable")
        tables[kind] = values[usable][order], log["address"][usable][order]
    return tables
