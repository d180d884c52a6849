"""Hard- and soft-iron correction of an external magnetometer (AN5040 7.5; bank A, datasheet 11.20 to 11.34).

calibrated = SI * (M - HI), uncalibrated = SI * (M - HI) + HI; SI is the unit matrix while SOFT_EN is off.

Decisions where the documents are silent: results are rounded to the nearest LSB; one that does not fit
16 bits stays at its end and is what HI_FAIL reports.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sensors.lsm6dsl.bank_a import MAG_OFFX_L, MAG_SI_XX
from sensors.sampling import to_int16

RAW_BYTES = 6
_SIGN, _PER_UNIT = 0x80, 8  # sign and magnitude, 1/8 per LSB


@dataclass(frozen=True)
class Ironed:
    """Register bytes of both results, X, Y, Z as little-endian int16."""

    calibrated: bytes
    uncalibrated: bytes
    failed: bool


@dataclass(frozen=True)
class Ironing:
    """``soft``: matrix, (3, 3); ``hard``: offsets in LSB of the magnetometer, (3,)."""

    soft: NDArray[np.float64]
    hard: NDArray[np.float64]

    @classmethod
    def decode(cls, mem: bytearray, *, soft: bool) -> Ironing:
        """Read the correction out of bank A."""
        hard = np.frombuffer(bytes(mem[MAG_OFFX_L.addr : MAG_OFFX_L.addr + 6]), dtype="<i2")
        elements = [_element(value) for value in mem[MAG_SI_XX.addr : MAG_SI_XX.addr + 9]]
        matrix = np.array(elements).reshape(3, 3) if soft else np.eye(3)
        return cls(soft=matrix, hard=hard.astype(np.float64))

    def apply(self, raw: bytes) -> Ironed:
        """Correct one sample, X, Y, Z as little-endian int16."""
        calibrated = np.rint(self.soft @ (np.frombuffer(raw, dtype="<i2") - self.hard))
        uncalibrated = calibrated + self.hard
        both = np.concatenate((calibrated, uncalibrated))
        return Ironed(
            calibrated=to_int16(calibrated).tobytes(),
            uncalibrated=to_int16(uncalibrated).tobytes(),
            failed=bool(np.any(both != to_int16(both))),
        )


def _element(value: int) -> float:
    magnitude = (value & ~_SIGN) / _PER_UNIT
    return -magnitude if value & _SIGN else magnitude
