"""Memory that Python and the chip in C share, so that firmware reads registers without a call of Python.

The *access* of a byte says how C reads the byte:

* ``LIVE``: call Python, because the read has effects that are not declared here;
* ``MEMORY``: return the byte; reading has no effect;
* ``STATUS``: take the due samples of all outputs, then return the byte;
* ``OUTPUT`` + n: take the due samples of train n, return the byte, and apply the effects of reading.

A *train* is an output's current sample and the next ones, with their times. The effects of reading a
byte are constant. ``keep``: status bits that the read does not clear; ``holds``: bytes that block data update
freezes after the read; ``releases``: bytes that may change again after the read.
A new sample sets the status bits ``flags``. If the previous sample was not read, the new sample also sets the overrun
flags, ``overrun_shift`` bits higher.

Each change of the sensor's state (``version``) ends all trains. Python ends a train before it takes samples
itself, and adds ``taken`` to its count. ``emulator/chip/native/peripherals/sensor_registers.c`` reads trains.
"""

from __future__ import annotations

import ctypes
from collections.abc import Sequence
from typing import Final

from fcu_emulator.sensors.register import ADDRESSES

LIVE: Final = 0
MEMORY: Final = 1
STATUS: Final = 2
OUTPUT: Final = 3

OUTPUTS: Final = 3
"""Maximum number of outputs in a bank."""
WIDTH: Final = 6
"""Maximum number of bytes in an output."""
AHEAD: Final = 256
"""Maximum number of samples in a train after the current one."""
_ENDED: Final = (1 << 64) - 1  # a version that no sensor has

_i64, _u64, _u8 = ctypes.c_int64, ctypes.c_uint64, ctypes.c_uint8


def bit(address: int) -> int:
    """Return the bit that represents the byte at ``address`` in ``held``."""
    return 1 << (address & 63)


class Train(ctypes.Structure):
    """struct Train of sensor_registers.h."""

    _fields_ = (
        ("version", _u64),
        ("at", _i64),
        ("count", _i64),
        ("taken", _i64),
        ("times", _i64 * (AHEAD + 1)),
        ("holds", _u64 * WIDTH),
        ("releases", _u64 * WIDTH),
        ("samples", _u8 * ((AHEAD + 1) * WIDTH)),
        ("keep", _u8 * WIDTH),
        ("first", _u8),
        ("width", _u8),
        ("status", _u8),
        ("flags", _u8),
        ("overrun_shift", _u8),
        ("is_stale", _u8),
        ("is_live", _u8),
    )

    def set_effects(self, holds: Sequence[int], releases: Sequence[int]) -> None:
        """For each byte, set the bytes that block data update freezes and releases when the byte is read."""
        self.holds[: self.width], self.releases[: self.width] = holds, releases

    def fill(self, version: int, samples: bytes, times_ps: Sequence[int], *, stale: bool) -> None:
        """Set the current sample and the samples after it. ``times_ps``: times of the samples after it and of one more.

        ``stale``: the registers do not show the current sample yet.
        """
        ctypes.memmove(self.samples, samples, len(samples))
        count = len(times_ps)
        self.times[:count] = times_ps
        self.at, self.count, self.taken = 0, count - 1, 0
        self.is_stale, self.is_live, self.version = stale, False, version

    def read_live(self, version: int) -> None:
        """Let Python answer reads until the sensor's state changes."""
        self.is_live, self.version = True, version

    def take_back(self) -> int:
        """End the prepared series of samples; return the number of samples that C has taken."""
        taken: int = self.taken
        self.version, self.taken = _ENDED, 0
        return taken


class Bank(ctypes.Structure):
    """struct Bank of sensor_registers.h."""

    _fields_ = (
        ("held", _u64),
        ("memory", _u64),
        ("next", _u8 * ADDRESSES),
        ("access", _u8 * ADDRESSES),
        ("trains", _u64 * OUTPUTS),
    )


def new_train(first: int, keep: bytes) -> tuple[bytearray, Train]:
    """Return a train of the output at ``first``, and its memory, which a snapshot saves.

    ``keep``: for each byte, the status bits that stay set when the byte is read.
    """
    memory = bytearray(ctypes.sizeof(Train))
    train = Train.from_buffer(memory)
    train.first, train.width, train.version = first, len(keep), _ENDED
    train.keep[: len(keep)] = keep
    return memory, train


def address_of(buffer: bytearray) -> int:
    """Return the address of a buffer; the buffer's length must not change while the address is used."""
    return ctypes.addressof((ctypes.c_char * len(buffer)).from_buffer(buffer))
