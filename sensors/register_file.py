"""Registers in memory, and the rules for reading and writing bursts.

The plan of a burst is cached by address and length, because a method call per byte would take six times as long. Firmware
reads most registers without a call of Python (:mod:`fcu_emulator.sensors.shared_registers`).
"""

from __future__ import annotations

import ctypes
from array import array
from collections.abc import Callable, Mapping
from typing import Protocol, TypeAlias

from fcu_emulator.sensors.register import ADDRESSES, Register, RegisterMap
from fcu_emulator.sensors.shared_registers import LIVE, MEMORY, OUTPUT, STATUS, Bank, Train, address_of

ReadHook: TypeAlias = Callable[[int, int, int], bytes | None]
"""``hook(first, end, now_ps)``, called before a read: returns the bytes to read, or None to read ``mem``."""

AfterHook: TypeAlias = Callable[[int, int, int], None]
"""``hook(first, end, now_ps)``, called after a read of bytes ``first`` to ``end - 1``."""

WriteHook: TypeAlias = Callable[[int, int, int], None]
"""``hook(old, new, now_ps)``, called after a byte has been written."""


class NoteCallback(Protocol):
    """An event for the user's trace.

    ``what``: kind, for example "forbidden" or "write ignored". ``problem``: stable name of the case. ``data``: the
    values in ``text``.
    """

    def __call__(self, now_ps: int, what: str, problem: str, text: str, **data: float | str) -> None: ...


WriteLog: TypeAlias = Callable[[int, str, int, int], None]
"""``log(now_ps, register, old, new)``: a register was written."""

_Piece: TypeAlias = tuple[ReadHook | None, int, int, AfterHook | None]
_Plan: TypeAlias = tuple[_Piece, tuple[_Piece, ...]]  # the first piece, and the following ones

NEVER_PS = 1 << 62  # later than any run; an int, so that comparisons stay fast

_COUNT_BITS = 22  # bits for the length in a plan's key, which stays a small integer
_ONE_BYTE = tuple(bytes((value,)) for value in range(256))  # looking bytes up is faster than creating them
_LONGEST_KEPT = 64  # bytes of a burst whose plan is cached


class SharedOutput(Protocol):
    """Output registers, which C can read from a train of samples."""

    train: Train

    def fill(self, now_ps: int) -> None:
        """Put the current and next samples into the train."""
        ...

    def take_back(self) -> None:
        """End the train, and continue after the samples that C has taken from it."""
        ...

    def burst_reader(self, first: int, end: int) -> BurstReader | None:
        """Return a fast reader of these bytes, or None."""
        ...


BurstReader: TypeAlias = Callable[[int], tuple[bytes, int]]
"""``read_burst(now_ps)``: returns the bytes, and the time until which another read returns the same bytes."""

_Hooks: TypeAlias = tuple[ReadHook | None, AfterHook | None]
_NO_HOOKS: _Hooks = (None, None)


class AccessError(ValueError):
    """A burst has an invalid address or length."""

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


def _no_note(now_ps: int, what: str, problem: str, text: str, **data: float | str) -> None:
    del now_ps, what, problem, text, data


class RegisterFile:
    """A register map's memory with its hooks.

    ``wrap``: address jumps within a burst. Sensor models read ``mem`` directly. ``version`` counts state
    changes of the sensor, except new samples and reads. ``held``: bytes that block data update does not refresh, as
    bits of :func:`fcu_emulator.sensors.shared_registers.bit`. C reads ``mem``, ``version`` and ``held``.
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
        self._next: list[int] = []  # by address: the next address of a burst
        self._before: list[ReadHook | None] = [None] * ADDRESSES
        self._after: list[AfterHook | None] = [None] * ADDRESSES
        self._on_write: list[WriteHook | None] = [None] * ADDRESSES
        self.outputs: list[SharedOutput] = []
        # for each byte: how C reads it, and the hooks for which this access is valid; if the byte has other
        # hooks, C calls Python
        self._access: list[tuple[int, _Hooks]] = [(MEMORY, _NO_HOOKS)] * ADDRESSES
        self._bank_bytes = bytearray(ctypes.sizeof(Bank))
        self._bank = Bank.from_buffer(self._bank_bytes)
        self._bank.memory = address_of(self.mem)
        self._bank_is_outdated = True
        self.held = memoryview(self._bank_bytes)[:8].cast("Q")
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
        """Call ``hook`` before a read, to update ``register``."""
        self._before[register.addr : register.addr + register.size] = [hook] * register.size
        self._forget_plans()

    def add_output(
        self, output: SharedOutput, *registers: tuple[type[Register], ReadHook, AfterHook | None]
    ) -> None:
        """Let C read ``registers`` from the output's train, as long as the registers have no other hooks."""
        access = OUTPUT + len(self.outputs)
        self._bank.trains[len(self.outputs)] = ctypes.addressof(output.train)
        self.outputs.append(output)
        for register, before, after in registers:
            self._set_access(register, access, before, after)

    def set_status(self, register: type[Register], before: ReadHook) -> None:
        """Call the hook ``before`` to update ``register``; this hook must only process due samples."""
        self.before_read(register, before)
        self._set_access(register, STATUS, before, None)

    def _set_access(
        self, register: type[Register], access: int, before: ReadHook, after: AfterHook | None
    ) -> None:
        first, end = register.addr, register.addr + register.size
        self._access[first:end] = [(access, (before, after))] * register.size
        self._forget_plans()

    def after_read(self, register: type[Register], hook: AfterHook) -> None:
        """Call ``hook`` after a read of ``register``, after the hooks added earlier."""
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
        """Set further address jumps, in addition to ``wrap``."""
        self._jumps = dict(jumps)
        self._link()

    # -- access -----------------------------------------------------------------------------------------

    def read(self, address: int, count: int, now_ps: int) -> bytes:
        """Return ``count`` bytes, with all side effects. Raises AccessError."""
        if count > 1 and self.held[0]:
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

    def shared_bank(self) -> int:
        """Update the tables of struct Bank and return its address."""
        bank = self._bank
        if self._bank_is_outdated:
            self._bank_is_outdated = False
            bank.next[:] = self._next
            bank.access[:] = [self._access_at(address) for address in range(ADDRESSES)]
        return ctypes.addressof(bank)

    def take_back(self) -> None:
        """End the trains of all outputs."""
        for output in self.outputs:
            output.take_back()

    def burst_reader(self, address: int, count: int) -> BurstReader:
        """Return a reader of this burst, valid until ``version`` changes."""
        (_, first, end, _), rest = self._plan(address, count)
        access = self._access_at(first)
        if access >= OUTPUT and not rest:
            read_burst = self.outputs[access - OUTPUT].burst_reader(first, end)
            if read_burst is not None:
                return read_burst
        return lambda now_ps: (self.read(address, count, now_ps), 0)

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
        self._bank_is_outdated = True
        self.version[0] += 1

    def _access_at(self, address: int) -> int:
        """Return how C reads a byte: ``LIVE`` if the byte has other hooks."""
        access, hooks = self._access[address]
        return access if hooks == (self._before[address], self._after[address]) else LIVE

    def _read_bytewise(self, address: int, count: int, now_ps: int) -> bytes:
        """Read byte by byte: during a burst, a held word can be released and then shows newer data."""
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
        self._note_write(address, value, new, now_ps)
        hook = self._on_write[address]
        if hook is not None:
            hook(old, new, now_ps)

    def _note_write(self, address: int, value: int, new: int, now_ps: int) -> None:
        name = self.map.name(address)
        if self.map.write_mask[address] == 0:
            text = f"{name} (0x{address:02X}) is not writable"
            self.note(now_ps, "write ignored", "read-only-register", text, register=name, value=value)
            return
        if value != new:
            bits = ", ".join(str(bit) for bit in range(8) if (value ^ new) >> bit & 1)
            text = f"{name}: bit {bits} cannot be changed"
            self.note(now_ps, "write ignored", "read-only-bits", text, register=name, mask=value ^ new)
        if (new ^ self.map.reset[address]) & self.map.unmodelled[address]:
            text = f"{self._unmodelled_fields(address, new)} written"
            self.note(now_ps, "not modelled", "unmodelled-write", text, register=name, value=new)

    def _unmodelled_fields(self, address: int, value: int) -> str:
        register = self.map.at[address]
        changed = (value ^ self.map.reset[address]) & self.map.unmodelled[address]
        fields = [bits.name for bits in register.fields if bits.mask & changed] if register else []
        name = self.map.name(address)
        return f"{name}.{'/'.join(fields)}" if fields else name

    def _note_reserved_read(self, first: int, end: int, now_ps: int) -> None:
        for address in range(first, end):
            text = f"0x{address:02X} read; nothing is documented there"
            self.note(now_ps, "reserved", "reserved-read", text, address=address)

    def _note_unmodelled_read(self, first: int, end: int, now_ps: int) -> None:
        for address in range(first, end):
            name = self.map.name(address)
            self.note(now_ps, "not modelled", "unmodelled-read", f"{name} read", register=name)

    def _plan(self, address: int, count: int) -> _Plan:
        if not 0 <= address < ADDRESSES or not 0 < count < 1 << _COUNT_BITS:  # an invalid burst has no plan
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
        if count <= _LONGEST_KEPT:  # longer bursts are rare; caching them would use much memory
            self._plans[key] = plan
        return plan

    def _joins(self, piece: _Piece, address: int) -> bool:
        before, after = self._before[address], self._after[address]
        if piece[0] is not before or piece[3] is not after:
            return False
        same_register = self.map.at[piece[1]] is self.map.at[address]
        return same_register or (before is None and after is None)
