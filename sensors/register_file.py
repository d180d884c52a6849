"""Registers in memory, and the rules for reading and writing bursts.

A burst is planned once per address and length; one read method per byte would cost six times as much at 800 Hz x 4
bursts. Masters cache bytes: ``prefetch`` returns the results of one-byte reads, ``commit`` applies their effects.
"""

from __future__ import annotations

from array import array
from collections.abc import Callable, Mapping
from functools import partial
from typing import Final, Protocol, TypeAlias

from fcu_emulator.sensors.register import ADDRESSES, Register, RegisterMap

ReadHook: TypeAlias = Callable[[int, int, int], bytes | None]
"""``hook(first, end, now_ps)`` before a read: returns the bytes, or None for those of ``mem``."""

AfterHook: TypeAlias = Callable[[int, int, int], None]
"""``hook(first, end, now_ps)``, called after the read of these bytes."""

WriteHook: TypeAlias = Callable[[int, int, int], None]
"""``hook(old, new, now_ps)``, called after a byte has been written."""

NoteCallback: TypeAlias = Callable[[int, str, str], None]
"""``note(now_ps, kind, text)``: an event for the user's trace."""

WriteLog: TypeAlias = Callable[[int, str, int, int], None]
"""``log(now_ps, register, old, new)``: a register was written."""

_Piece: TypeAlias = tuple[ReadHook | None, int, int, AfterHook | None]
_Plan: TypeAlias = tuple[_Piece, tuple[_Piece, ...]]  # the first piece, and the following ones

NEVER_PS = 1 << 62  # later than any run; an int, so that comparisons stay fast

_COUNT_BITS = 22  # of a plan's key, which thus stays a small integer
_ONE_BYTE = tuple(bytes((value,)) for value in range(256))  # slower to build than to look up
_LONGEST_KEPT = 64  # bytes of a burst whose plan is cached
_PREFETCHED_AT_ONCE = 32  # bytes per prefetch


Prefetched: TypeAlias = tuple[bytes, int, int]
"""Bytes, end of validity (ps), and reads without side effects; see ``RegisterFile.prefetch``."""

NOTHING_PREFETCHED: Prefetched = (b"", 0, 0)
EACH_ALONE: Final = 1
"""Bit 0 of the mask of reads without side effects: the sub-address does not increment."""


class Prefetcher(Protocol):
    """Source of a register's bytes before they are read."""

    def prefetch(self, first: int, end: int, now_ps: int) -> Prefetched: ...

    def valid_until_ps(self, first: int, end: int) -> int:
        """Return how long these bytes can be read again; 0 if unknown."""
        ...

    def commit(self, first: int, count: int) -> None: ...

    def burst_reader(self, first: int, end: int) -> BurstReader | None: ...


BurstReader: TypeAlias = Callable[[int], tuple[bytes, int]]
"""``read_burst(now_ps)``: bytes, and how long (ps) a repeated read has no effect."""

_Source: TypeAlias = tuple[Prefetcher, ReadHook | None, AfterHook | None]  # valid while these are the hooks
_Region: TypeAlias = tuple[Prefetcher, int]  # source of the bytes from an address on, and their end
_BurstSources: TypeAlias = tuple[tuple[Prefetcher, int, int], ...]  # for each piece of a burst


class AccessError(ValueError):
    """A burst that no bus could carry: a wrong address or length."""

    def __init__(self, what: str, address: int, count: int) -> None:
        self.address = address
        self.count = count
        super().__init__(
            f"cannot {what} {count} bytes at sub-address {address:#04x}; "
            "give an address from 0x00 to 0x7F and at least one byte"
        )


def _one_after_the_other(earlier: AfterHook, later: AfterHook) -> AfterHook:
    def both(first: int, end: int, now_ps: int) -> None:
        earlier(first, end, now_ps)
        later(first, end, now_ps)

    return both


def _no_note(now_ps: int, kind: str, text: str) -> None:
    del now_ps, kind, text


class _Plain:
    """Registers that only writes change."""

    def __init__(self, mem: bytearray) -> None:
        self._mem = mem

    def prefetch(self, first: int, end: int, now_ps: int) -> Prefetched:
        del now_ps
        return bytes(self._mem[first:end]), NEVER_PS, every_length(end - first)

    def valid_until_ps(self, first: int, end: int) -> int:
        del first, end
        return NEVER_PS

    def burst_reader(self, first: int, end: int) -> None:
        """Return None: no fast path exists."""

    def commit(self, first: int, count: int) -> None:
        """Ignore the read: it has no side effect."""


def every_length(count: int) -> int:
    """Return the mask of reads of every length."""
    return (2 << count) - 2


class RegisterFile:
    """A register map's memory with its hooks.

    ``wrap``: address jumps within a burst. Models read ``mem`` without a call. ``version`` counts events that
    invalidate prefetched bytes, in all banks; C reads it at its fixed address.
    """

    def __init__(
        self,
        registers: RegisterMap,
        wrap: Mapping[int, int] | None = None,
        version: array[int] | None = None,
    ) -> None:
        self.map = registers
        self.version: array[int] = array("Q", (0,)) if version is None else version
        self.mem = bytearray(registers.reset)
        self.note: NoteCallback = _no_note
        self.write_log: WriteLog | None = None
        self._wrap = dict(wrap or {})
        self._jumps: dict[int, int] = {}
        self._next: list[int] = []  # the next address after each
        self._before: list[ReadHook | None] = [None] * ADDRESSES
        self._after: list[AfterHook | None] = [None] * ADDRESSES
        self._on_write: list[WriteHook | None] = [None] * ADDRESSES
        self._sources: list[_Source | None] = [None] * ADDRESSES
        self._plain: _Source = (_Plain(self.mem), None, None)
        # block data update: bytes of words whose other byte has not been read
        self.half_read: set[int] = set()
        self._increment = True
        self._plans: dict[int, _Plan] = {}
        self._burst_sources: dict[int, _BurstSources | None] = {}
        self._regions: dict[int, _Region | None] = {}
        self._link()
        for address in range(ADDRESSES):
            register_at = registers.at[address]
            if register_at is None:
                self._before[address] = self._note_reserved_read
            elif not register_at.modelled:
                self._before[address] = self._note_unmodelled_read

    # -- wiring -----------------------------------------------------------------------------------------

    def before_read(self, register: type[Register], hook: ReadHook) -> None:
        """Call ``hook`` before a read, to update ``register``."""
        self._before[register.addr : register.addr + register.size] = [hook] * register.size
        self._forget_plans()

    def set_prefetcher(
        self, register: type[Register], source: Prefetcher, before: ReadHook, after: AfterHook | None = None
    ) -> None:
        """Prefetch ``register`` from ``source``, while these are its hooks."""
        entry = source, before, after
        self._sources[register.addr : register.addr + register.size] = [entry] * register.size
        self._forget_plans()

    def after_read(self, register: type[Register], hook: AfterHook) -> None:
        """Call ``hook`` after a read, and after earlier hooks."""
        earlier = self._after[register.addr]
        both = hook if earlier is None else _one_after_the_other(earlier, hook)
        self._after[register.addr : register.addr + register.size] = [both] * register.size
        self._forget_plans()

    def on_write(self, register: type[Register], hook: WriteHook) -> None:
        """Call ``hook`` after a write to a byte of ``register``."""
        for address in range(register.addr, register.addr + register.size):
            self._on_write[address] = hook

    @property
    def increment(self) -> bool:
        """Whether the sub-address increments (IF_INC, IF_ADD_INC)."""
        return self._increment

    @increment.setter
    def increment(self, on: bool) -> None:
        if on != self._increment:
            self._increment = on
            self._link()

    def set_jumps(self, jumps: Mapping[int, int]) -> None:
        """Set the address jumps beside ``wrap``."""
        self._jumps = dict(jumps)
        self._link()

    # -- access -----------------------------------------------------------------------------------------

    def read(self, address: int, count: int, now_ps: int) -> bytes:
        """Return ``count`` bytes, with all side effects. Raises AccessError."""
        if self.half_read and count > 1:
            return self._read_bytewise(address, count, now_ps)
        plan = self._plans.get(address << _COUNT_BITS | count) or self._plan(address, count)
        (before, first, end, after), rest = plan
        data = None if before is None else before(first, end, now_ps)
        if data is None:
            data = _ONE_BYTE[self.mem[first]] if count == 1 else bytes(self.mem[first:end])
        if after is not None:
            after(first, end, now_ps)
        if not rest:  # the usual burst, inside one register
            return data
        pieces = bytearray(data)
        for before, first, end, after in rest:
            data = None if before is None else before(first, end, now_ps)
            pieces += self.mem[first:end] if data is None else data
            if after is not None:
                after(first, end, now_ps)
        return bytes(pieces)

    def prefetch(self, address: int, count: int, now_ps: int) -> Prefetched:
        """Return about ``count`` one-byte reads: the bytes, their end of validity (ps), and a mask.

        Bit n marks reads of n bytes without side effects, ``EACH_ALONE`` a fixed sub-address.
        """
        region = self._regions[address] if address in self._regions else self._region(address)
        if region is None:
            return NOTHING_PREFETCHED
        source, end = region
        data, until_ps, quiet = source.prefetch(address, end, now_ps)
        length = len(data)
        if length and not self._increment:
            return data, until_ps, quiet | EACH_ALONE
        if 0 < length < count and self._next[end - 1] == end:
            more, more_until_ps, more_quiet = self.prefetch(end, count - length, now_ps)
            if more:
                if quiet >> length & 1:
                    quiet |= more_quiet << length
                return data + more, min(until_ps, more_until_ps), quiet
        return data, until_ps, quiet

    def commit(self, address: int, count: int) -> None:
        while count:
            region = self._regions.get(address) or self._region(address)
            assert region is not None, "bytes that were never prefetched"
            source, end = region
            here = min(count, end - address)
            source.commit(address, here)
            address, count = end, count - here

    def burst_reader(self, address: int, count: int) -> BurstReader:
        """Return a reader of this burst, for one ``version``."""
        sources = self._find_sources(address, count)
        if sources is not None and len(sources) == 1:
            source, first, end = sources[0]
            read_burst = source.burst_reader(first, end)
            if read_burst is not None:
                return read_burst
        return partial(self._read_burst, address, count)

    def _read_burst(self, address: int, count: int, now_ps: int) -> tuple[bytes, int]:
        return self.read(address, count, now_ps), self._valid_until_ps(address, count)

    def write(self, address: int, data: bytes, now_ps: int) -> None:
        """Write ``data``; only writable bits change."""
        for value in data:
            self._write_byte(address, value, now_ps)
            address = self._next[address]

    def advance(self, address: int, count: int) -> int:
        if count == 1:
            return self._next[address]
        for _ in range(count):
            address = self._next[address]
        return address

    def reset(self, *registers: type[Register]) -> None:
        """Reset ``registers`` (default: all), without side effects."""
        for register in registers or self.map.registers:
            end = register.addr + register.size
            self.mem[register.addr : end] = self.map.reset[register.addr : end]

    # -- internals --------------------------------------------------------------------------------------

    def _link(self) -> None:
        self._next = [*range(1, ADDRESSES), 0] if self._increment else list(range(ADDRESSES))
        if self._increment:
            for address, following in (*self._wrap.items(), *self._jumps.items()):
                self._next[address] = following
        self._forget_plans()

    def _forget_plans(self) -> None:
        self._plans.clear()
        self._burst_sources.clear()
        self._regions.clear()

    def _region(self, address: int) -> _Region | None:
        source, end = self._source_of(address), address + 1
        region = None
        if source is not None:
            last = min(address + _PREFETCHED_AT_ONCE, ADDRESSES)
            while end < last and self._leads_to(end) and self._source_of(end) is source:
                end += 1
            region = source[0], end
        self._regions[address] = region
        return region

    def _leads_to(self, address: int) -> bool:
        return not self._increment or self._next[address - 1] == address

    def _source_of(self, address: int) -> _Source | None:
        """Return the prefetcher of a byte; None if other hooks take part."""
        before, after = self._before[address], self._after[address]
        if before is None and after is None:
            return self._plain
        source = self._sources[address]
        return source if source is not None and source[1:] == (before, after) else None

    def _valid_until_ps(self, address: int, count: int) -> int:
        key = address << _COUNT_BITS | count
        sources = (
            self._burst_sources[key] if key in self._burst_sources else self._find_sources(address, count)
        )
        if sources is None:
            return 0
        until_ps = NEVER_PS
        for source, first, end in sources:
            until_ps = min(until_ps, source.valid_until_ps(first, end))
        return until_ps

    def _find_sources(self, address: int, count: int) -> _BurstSources | None:
        first_piece, rest = self._plan(address, count)
        pieces = [(self._source_of(first), first, end) for _, first, end, _ in (first_piece, *rest)]
        sources = tuple((source[0], first, end) for source, first, end in pieces if source is not None)
        found = sources if len(sources) == len(pieces) else None
        if count <= _LONGEST_KEPT:
            self._burst_sources[address << _COUNT_BITS | count] = found
        return found

    def _read_bytewise(self, address: int, count: int, now_ps: int) -> bytes:
        """Read byte by byte, as a burst can release a held word and show newer data."""
        data = bytearray()
        for _ in range(count):
            data += self.read(address, 1, now_ps)
            address = self.advance(address, 1)
        return bytes(data)

    def _write_byte(self, address: int, value: int, now_ps: int) -> None:
        mask = self.map.write_mask[address]
        old = self.mem[address]
        new = (old & ~mask) | (value & mask)
        self.mem[address] = new
        self.version[0] += 1
        if self.write_log is not None:
            self.write_log(now_ps, self.map.name(address), old, new)
        if mask == 0:
            self.note(now_ps, "write ignored", f"{self.map.name(address)} (0x{address:02X}) is not writable")
        else:
            if value != new:
                bits = ", ".join(str(bit) for bit in range(8) if (value ^ new) >> bit & 1)
                self.note(now_ps, "write ignored", f"{self.map.name(address)}: bit {bits} cannot be changed")
            if (new ^ self.map.reset[address]) & self.map.unmodelled[address]:
                self.note(now_ps, "not modelled", f"{self._unmodelled_fields(address, new)} written")
        hook = self._on_write[address]
        if hook is not None:
            hook(old, new, now_ps)

    def _unmodelled_fields(self, address: int, value: int) -> str:
        register = self.map.at[address]
        changed = (value ^ self.map.reset[address]) & self.map.unmodelled[address]
        fields = [bits.name for bits in register.fields if bits.mask & changed] if register else []
        name = self.map.name(address)
        return f"{name}.{'/'.join(fields)}" if fields else name

    def _note_reserved_read(self, first: int, end: int, now_ps: int) -> None:
        for address in range(first, end):
            self.note(now_ps, "reserved", f"0x{address:02X} read; nothing is documented there")

    def _note_unmodelled_read(self, first: int, end: int, now_ps: int) -> None:
        for address in range(first, end):
            self.note(now_ps, "not modelled", f"{self.map.name(address)} read")

    def _plan(self, address: int, count: int) -> _Plan:
        if not 0 <= address < ADDRESSES or not 0 < count < 1 << _COUNT_BITS:  # such a burst never gets a plan
            raise AccessError("read", address, count)
        key = address << _COUNT_BITS | count
        pieces: list[_Piece] = []
        for _ in range(count):
            before, after = self._before[address], self._after[address]
            if pieces and pieces[-1][2] == address and self._joins(pieces[-1], address):
                pieces[-1] = (before, pieces[-1][1], address + 1, after)
            else:
                pieces.append((before, address, address + 1, after))
            address = self._next[address]
        plan = pieces[0], tuple(pieces[1:])
        if count <= _LONGEST_KEPT:  # longer bursts are rare, and must not fill the memory
            self._plans[key] = plan
        return plan

    def _joins(self, piece: _Piece, address: int) -> bool:
        before, after = self._before[address], self._after[address]
        if piece[0] is not before or piece[3] is not after:
            return False
        same_register = self.map.at[piece[1]] is self.map.at[address]
        return same_register or (before is None and after is None)
