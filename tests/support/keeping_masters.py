"""Bus masters on one sensor: two that read it live, one that reads shared memory, and one that keeps bursts."""

from __future__ import annotations

from typing import Protocol

from fcu_emulator.sensors.part import Sensor
from fcu_emulator.sensors.shared_registers import LIVE, OUTPUT, OUTPUTS, STATUS, Bank, Train, bit

BYTE_PS = 22_500_000  # nine bits at 400 kHz


class Master(Protocol):
    """A master that reads and writes one sensor; a message begins at ``now_ps``."""

    part: Sensor

    def read(self, address: int, count: int, now_ps: int) -> bytes:
        """Read bytes in one message."""
        ...

    def write(self, address: int, data: bytes, now_ps: int) -> None:
        """Write bytes in one message."""
        ...


class LiveBytes:
    """A master whose bytes each have the state at the end of their transfer."""

    def __init__(self, part: Sensor) -> None:
        self.part = part

    def read(self, address: int, count: int, now_ps: int) -> bytes:
        data = b""
        for _ in range(count):
            now_ps += BYTE_PS
            data += self.part.read(address, 1, now_ps)
            address = self.part.advance(address, 1)
        return data

    def write(self, address: int, data: bytes, now_ps: int) -> None:
        self.part.write(address, data, now_ps)


class TrainReader:
    """The rules of sensor_registers.c in Python; ``served`` counts bytes that were read without a call of the sensor."""

    def __init__(self, part: Sensor) -> None:
        self.part = part
        self.served = 0

    def read(self, address: int, count: int, now_ps: int) -> bytes:
        data = bytearray()
        for _ in range(count):
            now_ps += BYTE_PS
            bank = self._bank()
            byte = None if bank is None else self._byte(bank, address, now_ps)
            self.served += byte is not None
            data += self.part.read(address, 1, now_ps) if byte is None else bytes((byte,))
            address = self.part.advance(address, 1) if bank is None else bank.next[address]
        return bytes(data)

    def write(self, address: int, data: bytes, now_ps: int) -> None:
        self.part.write(address, data, now_ps)

    def _bank(self) -> Bank | None:
        address = self.part.shared_bank()
        return Bank.from_address(address) if address else None

    def _byte(self, bank: Bank, address: int, now_ps: int) -> int | None:
        access, mem = bank.access[address], self.part.active.mem
        if access == LIVE or (
            access == STATUS and not all(self._due(bank, n, now_ps) for n in range(OUTPUTS) if bank.trains[n])
        ):
            return None
        if access >= OUTPUT:
            if not self._due(bank, access - OUTPUT, now_ps):
                return None
            train, n = self._train(bank, access - OUTPUT), address - self._train(bank, access - OUTPUT).first
            if train.is_stale:
                self._show(bank, train, mem)
            mem[train.status] &= train.keep[n]
            if bank.held & train.releases[n]:
                bank.held &= ~train.releases[n]
            else:
                bank.held |= train.holds[n]
        return mem[address]

    def _train(self, bank: Bank, number: int) -> Train:
        return Train.from_address(bank.trains[number])

    def _due(self, bank: Bank, number: int, now_ps: int) -> bool:
        train, version, mem = self._train(bank, number), self.part.version[0], self.part.active.mem
        if train.version == version and train.is_live:
            return False
        due = train.at
        while due < train.count and train.times[due] <= now_ps:
            due += 1
        if train.version != version or train.times[due] <= now_ps:
            self.part.active.outputs[number].fill(now_ps)
            return train.version == version and not train.is_live
        fresh = due - train.at
        if fresh:
            train.at, train.taken = due, train.taken + fresh
            if train.overrun_shift:
                unread = train.flags if fresh > 1 else mem[train.status] & train.flags
                mem[train.status] |= unread << train.overrun_shift
            mem[train.status] |= train.flags
            train.is_stale = True
            if bank.held:
                self._show(bank, train, mem)
        return True

    def _show(self, bank: Bank, train: Train, mem: bytearray) -> None:
        train.is_stale = False
        for n in range(train.width):
            address = train.first + n
            if bank.held & (bit(address) | bit(train.first + (n ^ 1))):
                train.is_stale = True
            else:
                mem[address] = train.samples[train.at * train.width + n]


class LiveBursts:
    """A master whose bytes all have the state at the start of the message."""

    def __init__(self, part: Sensor) -> None:
        self.part = part

    def read(self, address: int, count: int, now_ps: int) -> bytes:
        return self.part.read(address, count, now_ps)

    def write(self, address: int, data: bytes, now_ps: int) -> None:
        self.part.write(address, data, now_ps)


class BurstKeeper:
    """A master that keeps each burst as long as it is valid."""

    def __init__(self, part: Sensor) -> None:
        self.part = part
        self.served = 0
        self._kept: dict[tuple[int, int], tuple[bytes, int, int]] = {}

    def read(self, address: int, count: int, now_ps: int) -> bytes:
        data, until_ps, version = self._kept.get((address, count), (b"", 0, 0))
        if now_ps < until_ps and version == self.part.version[0]:
            self.served += 1
            return data
        version = self.part.version[0]
        data, until_ps = self.part.burst_reader(address, count)(now_ps)
        self._kept[address, count] = data, until_ps, version
        return data

    def write(self, address: int, data: bytes, now_ps: int) -> None:
        self.part.write(address, data, now_ps)
