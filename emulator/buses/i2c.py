"""I2C bus with whole transfers and injected faults.

A byte takes nine clock periods; start, repeated start and stop take one each (NXP UM10204 3.1). A
burst returns the sensor's state at the start of the burst.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from typing import Literal, Protocol, Self, TypeAlias, get_args

from fcu_emulator.emulator.clock import NEVER_PS, PS_PER_MS, PS_PER_S, Clock, to_ps
from fcu_emulator.emulator.errors import I2CBusError, I2CError, I2CNackError, I2CStuckError, InputError
from fcu_emulator.emulator.trace import BusTransfer, Fault, Trace
from fcu_emulator.sensors.part import SubaddressTarget
from fcu_emulator.sensors.register_file import BurstReader

STANDARD_MODE_HZ = 100_000
FAST_MODE_HZ = 400_000
BUSY_TIMEOUT_PS = 25 * PS_PER_MS  # I2C_TIMEOUT_BUSY_FLAG of ST's HAL
SCANNED_ADDRESSES = 8

"""If firmware tries at least this number of unused addresses, it searches for devices."""


def is_scan(counts: Iterable[int]) -> bool:
    """Return whether these numbers of failed transfers, one per address, result from a bus scan.

    A scan tries many addresses equally often.
    """
    most = sorted(counts, reverse=True)
    return len(most) >= SCANNED_ADDRESSES and most[0] <= 2 * most[SCANNED_ADDRESSES - 1]


BUS_ERROR = "bus error, a misplaced start or stop"
ARBITRATION_LOST = "arbitration lost to another master"

_BYTE_BITS = 9
_LONGEST = 65535  # HAL's 16-bit length
_SHORT = 32  # longer reads are not cached

_RECENT = 8
_FOR_GOOD_S = 1e6  # later than the end of any run

Message: TypeAlias = tuple[int, int, int, bytes | bytearray, bytes | bytearray, I2CError | str | None]
"""A transfer: start and end in ps, address, bytes written, bytes read, failure."""
FaultKind: TypeAlias = Literal["absent", "nack", "stuck", "bus_error", "arbitration"]


class I2CTarget(Protocol):
    """A device on the bus."""

    def start(self, *, read: bool) -> bool:
        """Handle a start or repeated start. Return True to acknowledge."""
        ...

    def write(self, data: bytes) -> int:
        """Return the number of acknowledged bytes."""
        ...

    def read(self, count: int) -> bytes:
        """Return bytes for the master."""
        ...

    def stop(self) -> None:
        """End the transfer after the master's stop."""
        ...

    def name(self) -> str: ...

    def register_name(self, address: int) -> str:
        """Return the name of a sub-address for the trace."""
        ...


@dataclass(frozen=True, slots=True)
class I2CFault:
    """A rule that makes transfers fail from ``from_s`` until ``until_s``, in seconds since power-on.

    ``absent``: no device answers at ``address``;
    ``nack``: byte ``byte_index`` of a write is not acknowledged (0: the address);
    ``stuck``: a line is held low;
    ``bus_error``: a start or stop is misplaced;
    ``arbitration``: another master wins the bus during the address.

    If ``address`` is None, the rule applies to every address.
    """

    kind: FaultKind
    from_s: float = 0.0
    until_s: float = math.inf
    address: int | None = None
    byte_index: int = 0
    from_ps: int = field(init=False, repr=False)
    until_ps: int = field(init=False, repr=False)

    def __post_init__(self) -> None:
        if self.kind not in get_args(FaultKind):
            raise InputError(f"unknown fault {self.kind!r}; known: {', '.join(get_args(FaultKind))}")
        if not 0 <= self.from_s <= self.until_s:
            raise InputError(
                f"fault window {self.from_s!r} s to {self.until_s!r} s is invalid: "
                "from_s must be at least 0, and until_s must not be before from_s"
            )
        object.__setattr__(self, "from_ps", to_ps(self.from_s))
        object.__setattr__(self, "until_ps", to_ps(self.until_s) if self.until_s < _FOR_GOOD_S else NEVER_PS)

    @classmethod
    def in_ps(
        cls, kind: FaultKind, from_ps: int, until_ps: int, address: int | None = None, byte_index: int = 0
    ) -> Self:
        fault = cls(kind, from_ps / PS_PER_S, until_ps / PS_PER_S, address, byte_index)
        object.__setattr__(fault, "from_ps", from_ps)
        object.__setattr__(fault, "until_ps", until_ps)
        return fault

    def hits(self, address: int, now_ps: int) -> bool:
        return self.from_ps <= now_ps < self.until_ps and self.address in (None, address)


class _CachedRead:
    """A repeatable read, valid for one version of the sensor's state."""

    __slots__ = (
        "data",
        "duration_ps",
        "last_burst",
        "part",
        "read_burst",
        "seen",
        "target",
        "until_ps",
        "version",
        "written",
    )
    read_burst: BurstReader

    def __init__(self, target: SubaddressTarget, subaddress: int, count: int, duration_ps: int) -> None:
        self.target = target
        self.part = target.part
        self.version = target.version
        self.last_burst = subaddress & target.address_mask, count
        self.written = bytes((subaddress & 0xFF,))
        self.duration_ps = duration_ps
        self.data = b""
        self.until_ps, self.seen = 0, -1


class I2CBus:
    """One bus, whose master must wait until the latest transfer's ``end_ps``."""

    def __init__(self, name: str, clock: Clock, trace: Trace, speed_hz: int = FAST_MODE_HZ) -> None:
        self.name = name
        self.end_ps = 0
        self.recent: deque[Message] = deque(maxlen=_RECENT)
        """Latest messages of a master that transfers single bytes."""
        self._remembers = False
        self._clock = clock
        self._trace = trace
        self._targets: dict[int, I2CTarget] = {}
        self._kept: dict[tuple[int, int, int], _CachedRead] = {}
        self._faults: list[I2CFault] = []
        self.has_faults = False
        self.when_changed: list[Callable[[], None]] = []
        """Functions that are called after a fault has been injected or a device attached."""
        self.elsewhere: list[Callable[[], Iterable[Message]]] = []
        """Functions that return the latest messages recorded only by the master."""
        self.shortest_ps = PS_PER_S // speed_hz if speed_hz < FAST_MODE_HZ else 0
        """Shortest period of SCL, or 0 for no limit. If the bus has a low speed at first, firmware cannot raise it."""
        self.set_speed(speed_hz)

    def set_speed(self, speed_hz: int) -> None:
        """Set the clock rate of later transfers."""
        self.speed_hz = speed_hz
        self._kept.clear()  # cached reads contain durations that depend on the clock rate

    @property
    def now_ps(self) -> int:
        return self._clock.now_ps

    @property
    def detailed(self) -> bool:
        return self._trace.detailed

    def attach(self, address: int, target: I2CTarget) -> None:
        """Attach a device at a 7-bit address."""
        self._targets[address] = target
        self._kept.clear()
        for changed in self.when_changed:
            changed()

    def inject(self, fault: I2CFault) -> None:
        """Add a fault for transfers from now on."""
        self._clock.inputs += 1
        self._faults.append(fault)
        self.has_faults = True
        self._kept.clear()
        for changed in self.when_changed:
            changed()
        until = (
            "until the end"
            if fault.until_ps >= PS_PER_S * 10**6
            else f"until {fault.until_ps / PS_PER_S:g} s"
        )
        where = "" if fault.address is None else f" at 0x{fault.address:02X}"
        self._trace.add(Fault(fault.from_ps, self.name, f"{fault.kind}{where} {until}"))

    def duration_ps(self, bits: int) -> int:
        """Return the duration of ``bits`` clock periods."""
        return bits * PS_PER_S // self.speed_hz

    @property
    def targets(self) -> Mapping[int, I2CTarget]:
        return self._targets

    def target(self, address: int) -> I2CTarget | None:
        return self._targets.get(address)

    def faults(self, at_ps: int) -> list[I2CFault]:
        """Return the faults active at ``at_ps``."""
        return [fault for fault in self._faults if fault.from_ps <= at_ps < fault.until_ps]

    # -- transfers --------------------------------------------------------------------------------------

    def read_from(self, address: int, subaddress: int, count: int) -> bytes:
        """Write a sub-address, then read bytes after a repeated start. Raises I2CError."""
        kept = self._kept.get((address, subaddress, count)) or self._keep(address, subaddress, count)
        if kept is None:
            return self.transfer(address, bytes((subaddress,)), count)
        now_ps = self._clock.now_ps
        version = kept.version[0]
        if version != kept.seen:
            if not kept.target.answers():
                return self.transfer(address, bytes((subaddress,)), count)  # raises the error
            kept.read_burst = kept.part.burst_reader(kept.last_burst[0], count)
            kept.data, kept.until_ps = kept.read_burst(now_ps)
            kept.seen = version
        elif now_ps >= kept.until_ps:
            kept.data, kept.until_ps = kept.read_burst(now_ps)
        kept.target.last_burst = kept.last_burst
        self.end_ps = now_ps + kept.duration_ps
        if self._remembers:
            self.recent.append((now_ps, self.end_ps, address, kept.written, kept.data, None))
        if self._trace.detailed:
            self._trace.add_transfer(
                now_ps,
                self.end_ps,
                self.name,
                address,
                kept.part.NAME,
                kept.part.register_name(subaddress),
                kept.written,
                kept.data,
                "ok",
            )
        return kept.data

    def _keep(self, address: int, subaddress: int, count: int) -> _CachedRead | None:
        target = self._targets.get(address)
        if self.has_faults or not isinstance(target, SubaddressTarget) or count > _SHORT:
            return None
        # three address bytes, two starts and a stop: 30 periods; and 9 per byte
        kept = _CachedRead(target, subaddress, count, self.duration_ps(30 + _BYTE_BITS * count))
        self._kept[address, subaddress, count] = kept
        return kept

    def transfer(self, address: int, data: bytes, count: int = 0) -> bytes:
        """Write ``data``, then read ``count`` bytes. Raises I2CError."""
        self._clock.inputs += 1
        start_ps = self._clock.now_ps
        try:
            received = self._run(address, data, count)
        except I2CError as error:
            self.record(start_ps, address, data, b"", str(error))
            raise
        bits = 2 + (_BYTE_BITS * (1 + len(data)) if data or not count else 0)
        if count:
            bits += _BYTE_BITS * (1 + count) + (1 if data else 0)
        self.end_ps = start_ps + self.duration_ps(bits)
        if self._trace.detailed or self._remembers:
            self.record(start_ps, address, data, received, "ok")
        return received

    def _run(self, address: int, data: bytes, count: int) -> bytes:
        nack_at = self._fault(address, reading=not data and count > 0)
        target = self._targets.get(address)
        if target is None:
            raise self._nack(address, 0)
        received = b""
        if data or not count:
            if nack_at == 0 or not target.start(read=False):
                raise self._nack(address, 0)
            acknowledged = target.write(data if nack_at is None else data[: nack_at - 1])
            if acknowledged < len(data):
                target.stop()
                raise self._nack(address, acknowledged + 1)
        if count:
            if not target.start(read=True):
                raise self._nack(address, 0)
            received = target.read(count)
        target.stop()
        return received

    def _fault(self, address: int, *, reading: bool) -> int | None:
        """Raise a fault's error, or return the index of the byte to refuse."""
        now_ps = self._clock.now_ps
        nack_at: int | None = None
        for fault in self._faults:
            if not fault.hits(address, now_ps):
                continue
            if fault.kind == "stuck":
                self.end_ps = now_ps + BUSY_TIMEOUT_PS
                raise I2CStuckError(address, "a line is held low, the bus stays busy")
            if fault.kind == "bus_error":
                self.end_ps = now_ps + self.duration_ps(1 + _BYTE_BITS)
                raise I2CBusError(address, BUS_ERROR)
            if fault.kind == "arbitration":
                self.end_ps = now_ps + self.duration_ps(1 + _BYTE_BITS)
                raise I2CBusError(address, ARBITRATION_LOST)
            nack_at = 0 if fault.kind == "absent" or reading else fault.byte_index
            if nack_at == 0:
                raise self._nack(address, 0)
        return nack_at

    def _nack(self, address: int, byte_index: int) -> I2CNackError:
        self.end_ps = self._clock.now_ps + self.duration_ps(2 + _BYTE_BITS * (1 + byte_index))
        return I2CNackError(address, byte_index)

    def record(self, start_ps: int, address: int, data: bytes, received: bytes, result: str) -> None:
        if self._remembers:
            self.recent.append((start_ps, self.end_ps, address, data, received, result))
        self._trace.add_transfer(*self._fields(start_ps, self.end_ps, address, data, received, result))

    def remember(self, count: int) -> None:
        """Record the latest ``count`` transfers."""
        self._remembers = count > 0
        self.recent = deque(self.recent, maxlen=count or _RECENT)

    def recent_transfers(self) -> list[BusTransfer]:
        """Return the latest messages as trace events."""
        messages = [*self.recent, *(message for kept in self.elsewhere for message in kept())]
        messages.sort(key=lambda message: message[0])
        most = self.recent.maxlen or _RECENT
        return [
            BusTransfer(
                *self._fields(start_ps, end_ps, address, bytes(data), bytes(received), str(error or "ok"))
            )
            for start_ps, end_ps, address, data, received, error in messages[-most:]
        ]

    def _fields(
        self, start_ps: int, end_ps: int, address: int, data: bytes, received: bytes, result: str
    ) -> tuple[int, int, str, int, str, str, bytes, bytes, str]:
        target = self._targets.get(address)
        device = target.name() if target else ""
        register = target.register_name(data[0]) if target and data else ""
        return start_ps, end_ps, self.name, address, device, register, data, received, result


# -- Python as the master -----------------------------------------------------------------------------------


class I2CMaster:
    """A bus master in Python. Firmware runs during its transfers.

    Addresses have 7 bits. Raises I2CError or InputError.
    """

    def __init__(self, bus: I2CBus, run_until_ps: Callable[[int], None]) -> None:
        self.bus = bus
        """The bus, with its speed, targets and latest transfers."""
        self._run_until = run_until_ps

    @property
    def speed_hz(self) -> int:
        return self.bus.speed_hz

    def write(self, address: int, data: bytes) -> None:
        """Send start, address, ``data`` and stop."""
        self._transfer(address, checked_data(data), 0)

    def read(self, address: int, n: int) -> bytes:
        """Send start and address, read ``n`` bytes, send stop."""
        return self._transfer(address, b"", checked_count(n, 1))

    def write_read(self, address: int, data: bytes, n: int) -> bytes:
        """Send start, address, ``data``, repeated start, address; read ``n`` bytes; send stop."""
        return self._transfer(address, checked_data(data), checked_count(n, 1))

    def inject(self, fault: I2CFault) -> None:
        """Add a fault, which also affects firmware's transfers."""
        self.bus.inject(fault)

    def _transfer(self, address: int, data: bytes, count: int) -> bytes:
        address = checked_address(address)
        self._run_until(max(self.bus.end_ps, self.bus.now_ps))  # firmware may be in a transfer
        try:
            return self.bus.transfer(address, data, count)
        finally:
            self._run_until(self.bus.end_ps)


# -- checked arguments --------------------------------------------------------------------------------------


def checked_data(data: object) -> bytes:
    """Return bytes to send. Raises InputError."""
    if isinstance(data, bytes | bytearray | memoryview):
        return bytes(data)
    if isinstance(data, list | tuple) and all(isinstance(byte, int) and 0 <= byte <= 0xFF for byte in data):
        return bytes(data)
    raise InputError(f"data must be bytes, such as b'\\x0f', not {data!r}", kind="not_bytes")


def checked_count(count: object, least: int) -> int:
    """Return a checked number of bytes."""
    if not isinstance(count, int) or not least <= count <= _LONGEST:
        raise InputError(
            f"number of bytes to read must be from {least} to {_LONGEST}, not {count!r}", kind="read_length"
        )
    return count


def checked_address(number: object) -> int:
    """Return a checked 7-bit address."""
    if not isinstance(number, int):
        raise InputError(
            f"I2C address must be an integer from 0x00 to 0x7F, not {number!r}", kind="i2c_address"
        )
    if not 0 <= number <= 0x7F:
        raise InputError(
            f"I2C address must be from 0x00 to 0x7F without the R/W bit, not {number:#x}", kind="i2c_address"
        )
    return number
