"""The storage behind a register map, and the rules of reading and writing bursts.

One ``bytearray`` is the whole architectural state. A burst is planned once per (address, length): it is cut
where the address wraps and where a register with a side effect begins or ends; each piece is one slice and at
most one hook before and one after it. So plain registers cost nothing, and a burst of six output bytes is one
dictionary look-up, one hook and one slice. ``tests/property`` holds the law that a burst equals the same
bytes read one at a time. Firmware that polls its bus does read them so, 17,000 a second at 800 Hz.

Road not taken: one read method per byte (what the chip does) costs six times as much at 800 Hz x 4 bursts.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Protocol, TypeAlias

from sensors.register import ADDRESSES, Register, RegisterMap

ReadHook: TypeAlias = Callable[[int, int, int], bytes | None]
"""``hook(first, end, now_ps)``: bytes ``first`` to ``end - 1`` of its register are read.

A hook before the read may return these bytes itself, where it has them at hand; None takes them from ``mem``.
"""

AfterHook: TypeAlias = Callable[[int, int, int], None]
"""Likewise after the read."""

WriteHook: TypeAlias = Callable[[int, int, int], None]
"""``hook(old, new, now_ps)``: a byte has been written; it holds ``new`` already."""

NoteCallback: TypeAlias = Callable[[int, str, str], None]
"""``note(now_ps, kind, text)``: something a user should be able to see in the trace."""

WriteLog: TypeAlias = Callable[[int, str, int, int], None]
"""``log(now_ps, register, old, new)``: a register was written."""

_Piece: TypeAlias = tuple[ReadHook | None, int, int, AfterHook | None]
_Plan: TypeAlias = tuple[_Piece, tuple[_Piece, ...]]  # the first piece, and those after it if there are any

_COUNT_BITS = 22  # of a plan's key, which stays a small integer
_ONE_BYTE = tuple(bytes((value,)) for value in range(256))  # dearer to make than to look up


class Ahead(Protocol):
    """What knows the bytes of a register before they are read, and does afterwards what reading them does."""

    def before_read(self, first: int, end: int, now_ps: int) -> bytes | None:
        """Its hook."""
        ...

    def ahead(self, first: int, now_ps: int) -> tuple[bytes, int]:
        """The bytes from ``first`` to the end of the register, and until when (ps) they are these."""
        ...

    def taken(self, first: int, count: int) -> None:
        """So many of them have been read one by one."""
        ...


class AccessError(ValueError):
    """A burst that no bus could carry: a sub-address of more than 7 bits, no byte at all, or four million."""

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


class RegisterFile:
    """A register map's memory with its hooks.

    ``wrap`` maps an address to the one a burst goes on with, where that is not the next one.
    ``mem`` is public on purpose: models keep a reference and read single bytes without a call.
    """

    def __init__(self, registers: RegisterMap, wrap: Mapping[int, int] | None = None) -> None:
        self.map = registers
        self.mem = bytearray(registers.reset)
        self.note: NoteCallback = _no_note
        self.write_log: WriteLog | None = None
        self._wrap = dict(wrap or {})
        self._jumps: dict[int, int] = {}
        self._next: list[int] = []  # the address after each
        self._before: list[ReadHook | None] = [None] * ADDRESSES
        self._after: list[AfterHook | None] = [None] * ADDRESSES
        self._on_write: list[WriteHook | None] = [None] * ADDRESSES
        self._ahead: list[Ahead | None] = [None] * ADDRESSES
        self.half_read: set[int] = set()  # block data update: bytes read whose partner has not been read yet
        self._increment = True
        self._plans: dict[int, _Plan] = {}
        self._link()
        for address in range(ADDRESSES):
            register_at = registers.at[address]
            if register_at is None:
                self._before[address] = self._note_reserved_read
            elif not register_at.modelled:
                self._before[address] = self._note_unmodelled_read

    # -- wiring -----------------------------------------------------------------------------------------

    def before_read(self, register: type[Register], hook: ReadHook) -> None:
        """Call ``hook`` before bytes of ``register`` are read, so that it can bring them up to date."""
        self._before[register.addr : register.addr + register.size] = [hook] * register.size
        self._plans.clear()

    def know_ahead(self, register: type[Register], source: Ahead) -> None:
        """``source`` knows the bytes of ``register``, as long as nothing else takes part in reading them."""
        self._ahead[register.addr : register.addr + register.size] = [source] * register.size

    def after_read(self, register: type[Register], hook: AfterHook) -> None:
        """Call ``hook`` after bytes of ``register`` have been read, for whatever reading clears.

        Several hooks are called in the order in which they were given.
        """
        earlier = self._after[register.addr]
        both = hook if earlier is None else _one_after_the_other(earlier, hook)
        self._after[register.addr : register.addr + register.size] = [both] * register.size
        self._plans.clear()

    def on_write(self, register: type[Register], hook: WriteHook) -> None:
        """Call ``hook`` after a byte of ``register`` has been written."""
        for address in range(register.addr, register.addr + register.size):
            self._on_write[address] = hook

    @property
    def increment(self) -> bool:
        """Whether the sub-address moves on after each byte (IF_INC, IF_ADD_INC)."""
        return self._increment

    @increment.setter
    def increment(self, on: bool) -> None:
        if on != self._increment:
            self._increment = on
            self._link()

    def set_jumps(self, jumps: Mapping[int, int]) -> None:
        """Addresses that lead elsewhere than to the next one, beside ``wrap``; they replace earlier ones."""
        self._jumps = dict(jumps)
        self._link()

    # -- access -----------------------------------------------------------------------------------------

    def read(self, address: int, count: int, now_ps: int) -> bytes:
        """``count`` bytes from ``address`` on, with all that reading them does. Raises AccessError."""
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

    def read_ahead(self, address: int, now_ps: int) -> tuple[bytes, int]:
        """What single reads from ``address`` on would give, and until when (ps); none if that is not sure.

        Nothing has been read. ``taken(address, count)`` makes up for it before anything else happens.
        """
        source = self._ahead[address]
        if (
            source is None
            or self._after[address] is not None
            or self._before[address] != source.before_read
            or self._next[address] != address + 1
        ):
            return b"", 0
        return source.ahead(address, now_ps)

    def taken(self, address: int, count: int) -> None:
        """So many of the bytes that were told ahead have been read one by one."""
        source = self._ahead[address]
        assert source is not None, "bytes that were never told"
        source.taken(address, count)

    def write(self, address: int, data: bytes, now_ps: int) -> None:
        """Write ``data` from ``address`` on; only writable bits change."""
        for value in data:
            self._write_byte(address, value, now_ps)
            address = self._next[address]

    def advance(self, address: int, count: int) -> int:
        """The address a burst of ``count`` bytes from ``address`` leaves behind."""
        if count == 1:
            return self._next[address]
        for _ in range(count):
            address = self._next[address]
        return address

    def reset(self, *registers: type[Register]) -> None:
        """Give ``registers`` (all, if none is named) their reset values, without side effects."""
        for register in registers or self.map.registers:
            end = register.addr + register.size
            self.mem[register.addr : end] = self.map.reset[register.addr : end]

    # -- inside -----------------------------------------------------------------------------------------

    def _link(self) -> None:
        jumps = {**self._wrap, **self._jumps}
        following = [jumps.get(address, (address + 1) % ADDRESSES) for address in range(ADDRESSES)]
        self._next = following if self._increment else list(range(ADDRESSES))
        self._plans.clear()

    def _read_bytewise(self, address: int, count: int, now_ps: int) -> bytes:
        """A burst over a held pair can release it half-way and show newer data in its later bytes."""
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
        if count <= 64:  # longer bursts are rare, and their number must not fill the memory
            self._plans[key] = plan
        return plan

    def _joins(self, piece: _Piece, address: int) -> bool:
        before, after = self._before[address], self._after[address]
        if piece[0] is not before or piece[3] is not after:
            return False
        same_register = self.map.at[piece[1]] is self.map.at[address]
        return same_register or (before is None and after is None)
