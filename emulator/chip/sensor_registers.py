"""Calls with which C requests the sensors' registers from Python (sensors/shared_registers.py)."""

from __future__ import annotations

import ctypes
from array import array
from collections.abc import Callable
from typing import Any, Final, Protocol

from fcu_emulator.emulator.clock import Clock
from fcu_emulator.sensors.part import Sensor

_i32, _i64 = ctypes.c_int32, ctypes.c_int64
_TARGETS = 8  # TARGETS
_SYNCED: Final = -1  # POSITION_SYNCED
_REFUSED: Final = -1  # BANK_REFUSED
_WORK: Final = 5_000
"""Work to fill a train of samples, in units of work.h."""


class TargetTable(ctypes.Structure):
    """struct TargetCalls of sensor_registers.h."""

    _fields_ = (
        ("bank", ctypes.CFUNCTYPE(_i64, _i64, _i32)),
        ("fill", ctypes.CFUNCTYPE(None, _i64, _i32, _i32)),
    )


class ReadableTarget(Protocol):
    """A sensor at a bus."""

    part: Sensor
    """The sensor. Its sub-addresses include the bus's increment bit."""

    @property
    def version(self) -> array[int]:
        """A number that changes whenever the sensor's state changes."""
        ...

    @property
    def increment_bit(self) -> int:
        """The bit of a sub-address that enables its increment, or 0."""
        ...

    @property
    def position(self) -> int:
        """Return the next sub-address."""
        ...

    def shared_bank(self) -> int | None:
        """Return the address of the registers that C can read, 0 for none; None if the sensor does not answer."""
        ...

    def move_to(self, subaddress: int, /) -> None:
        """Continue at ``subaddress``, after reads in C."""
        ...


class ReadingChip(Protocol):
    """The chip's members that this module uses."""

    clock: Clock
    library: Any
    handle: Any
    shared: Any

    def callback(self, kind: Any, function: Callable[..., Any], /) -> Any: ...


class Targets:
    """All sensors whose registers a chip in C can read."""

    def __init__(self, chip: ReadingChip) -> None:
        self._chip = chip
        self._targets: list[ReadableTarget] = []
        (_, bank), (_, fill) = TargetTable._fields_
        table = TargetTable(chip.callback(bank, self._bank), chip.callback(fill, self._fill))
        address = chip.library.fcu_connect_targets(chip.handle, table)
        self._positions = memoryview((_i64 * _TARGETS).from_address(address)).cast("B").cast("q")

    def add(self, target: ReadableTarget) -> int:
        """Return the target's index, or -1 if C cannot take more targets."""
        if target in self._targets:
            return self._targets.index(target)
        version, _ = target.version.buffer_info()
        index: int = self._chip.library.fcu_add_target(self._chip.handle, version, target.increment_bit)
        if index >= 0:
            self._targets.append(target)
        return index

    def sync_position(self, index: int) -> None:
        position = self._positions[index]
        if position != _SYNCED:
            self._positions[index] = _SYNCED
            self._targets[index].move_to(position)

    def position(self, index: int) -> int:
        return self._targets[index].position

    def _bank(self, index: int) -> int:
        bank = self._targets[index].shared_bank()
        return _REFUSED if bank is None else bank

    def _fill(self, index: int, train: int) -> None:
        self._chip.shared[5] += _WORK
        self._targets[index].part.active.outputs[train].fill(self._chip.clock.now_ps)
