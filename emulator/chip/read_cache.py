"""The Python interface of the sensors' read cache in C.

Reads with side effects, such as clearing data-ready, reach the sensors before other Python code runs.
"""

from __future__ import annotations

import ctypes
import struct
from array import array
from collections.abc import Callable
from typing import Any, Final, Protocol

from fcu_emulator.emulator.time.clock import Clock

_i32, _i64 = ctypes.c_int32, ctypes.c_int64
_TARGETS, _BYTES = 8, 32  # TARGETS, LINE_BYTES
_UNCOMMITTED, _READS, _POSITIONS, _ANSWERED = 0, 1, 1 + _TARGETS, 1 + 2 * _TARGETS
_PREFETCHED = 8 * (1 + 3 * _TARGETS)
_PUT: Final = struct.Struct(f"=qQq{_BYTES}s")  # struct Prefetched
_LENGTHS: Final = (1 << _BYTES + 1) - 1
_SYNCED: Final = -1  # POSITION_SYNCED
_WORK: Final = 5_000
"""Work of a request for bytes, in units of work.h."""


class TargetTable(ctypes.Structure):
    """struct TargetCalls of read_cache.h."""

    _fields_ = (
        ("prefetch", ctypes.CFUNCTYPE(_i32, _i64, _i32, _i32, _i32, _i32)),
        ("commit", ctypes.CFUNCTYPE(None, _i64)),
    )


class CacheableTarget(Protocol):
    """A sensor that gives bytes in advance, like :meth:`RegisterFile.prefetch`."""

    @property
    def version(self) -> array[int]:
        """Changes whenever prefetched bytes become invalid."""
        ...

    def prefetch(self, address: int, count: int, now_ps: int, /) -> tuple[bytes, int, int]:
        """Return bytes, the end of their validity (ps), and how many are readable without side effects."""
        ...

    def commit(self, address: int, count: int, /) -> None: ...

    def advance_past(self, address: int, count: int, /) -> None: ...

    @property
    def position(self) -> int: ...


class CachingChip(Protocol):
    """Functions of the chip that the read cache uses."""

    clock: Clock
    library: Any
    handle: Any
    shared: Any

    def callback(self, kind: Any, function: Callable[..., Any], /) -> Any: ...

    def keep_error(self, error: BaseException, /) -> None: ...


class Targets:
    """All targets of a chip. ``uncommitted[0]`` is not 0 while :meth:`commit` is needed."""

    def __init__(self, chip: CachingChip) -> None:
        self._chip = chip
        self._targets: list[CacheableTarget] = []
        (_, prefetch), (_, commit) = TargetTable._fields_
        self._prefetch = prefetch(self._prefetch_at)
        table = TargetTable(self._prefetch, chip.callback(commit, lambda: None))
        address = chip.library.fcu_connect_targets(chip.handle, table)
        shared = (ctypes.c_uint8 * (_PREFETCHED + _PUT.size)).from_address(address)
        self._prefetched = memoryview(shared).cast("B")[_PREFETCHED:]
        self._words = memoryview(shared).cast("B")[:_PREFETCHED].cast("q")
        self.uncommitted = self._words[:1]

    def add(self, target: CacheableTarget) -> int:
        """Return the index, or -1 if there are too many."""
        if target in self._targets:
            return self._targets.index(target)
        version, _ = target.version.buffer_info()
        index: int = self._chip.library.fcu_add_target(self._chip.handle, version)
        if index >= 0:
            self._targets.append(target)
        return index

    def commit(self) -> None:
        """Report delayed reads to the sensors."""
        words = self._words
        uncommitted, words[_UNCOMMITTED] = words[_UNCOMMITTED], 0
        for index in range(uncommitted.bit_length()):
            if uncommitted >> index & 1:
                target, read = self._targets[index], words[_READS + index]
                before = target.version[0]
                target.commit(read >> 8, read & 0xFF)
                if words[_ANSWERED + index] == before:
                    words[_ANSWERED + index] = target.version[0]  # reading does not switch a sensor off

    def sync_position(self, index: int) -> None:
        position = self._words[_POSITIONS + index]
        if position != _SYNCED:
            self._words[_POSITIONS + index] = _SYNCED
            self._targets[index].advance_past(position >> 8, position & 0xFF)

    def prefetch(self, index: int, address: int, count: int, now_ps: int) -> int:
        data, until_ps, side_effect_free = self._targets[index].prefetch(address, count, now_ps)
        _PUT.pack_into(self._prefetched, 0, until_ps, side_effect_free & _LENGTHS, address, data)
        return min(len(data), _BYTES)

    def prefetch_from_here(self, index: int) -> int:
        return self.prefetch(index, self._targets[index].position, 1, self._chip.clock.now_ps)

    def _prefetch_at(self, now_ps: int, index: int, address: int, skip: int, count: int) -> int:
        """Prefetch without :meth:`FcuChip.callback`, for speed."""
        chip = self._chip
        clock = chip.clock
        try:
            clock.now_ps = now_ps
            chip.shared[5] += _WORK
            if self.uncommitted[0]:
                self.commit()
            if skip:
                target = self._targets[index]
                target.advance_past(address, skip)
                address = target.position
            return self.prefetch(index, address, count, now_ps)
        except BaseException as error:
            chip.keep_error(error)
            return 0
        finally:
            chip.shared[1] = clock.next_ps
