"""A sensor on one of its buses: I2C, or SPI with three or four wires."""

from __future__ import annotations

from typing import Literal

from fcu_emulator.sensors.part import SubaddressTarget
from fcu_emulator.sensors.spi import READ, SpiTarget
from tests.support.sensor_fakes import Channel, Chip, ramp

COUNTS_PER_SAMPLE = 317


class Face:
    """One copy of a sensor on one bus; ``own`` are the bits of ``wires`` (address) that this bus needs."""

    def __init__(self, channel: Channel, bus: Literal["I2C", "SPI3", "SPI4"], wires: int, own: int) -> None:
        self.chip = moving(channel)
        self.bus, self.wires, self.own = bus, wires, own
        if bus == "I2C":
            self.i2c = SubaddressTarget(self.chip.part, lambda: self.chip.t_ps)
        else:
            self.spi = SpiTarget(self.chip.part, lambda: self.chip.t_ps)

    def write(self, address: int, data: bytes, wire_bits: int) -> None:
        """Do one write transfer. The bits that select the wires are those of this bus."""
        sent = bytearray(data)
        for offset in range(len(data)):
            if address + offset == self.wires:
                sent[offset] = sent[offset] & ~wire_bits | self.own
        if self.bus == "I2C":
            assert self.i2c.start(read=False)
            assert self.i2c.write(bytes([address]) + sent) == len(sent) + 1
            self.i2c.stop()
        else:
            self.spi.select()
            self.spi.write(bytes([address]), 3)
            self.spi.write(bytes(sent), 3)

    def read(self, address: int, count: int) -> bytes:
        if self.bus == "I2C":
            self.i2c.start(read=False)
            self.i2c.write(bytes([address]))
            self.i2c.start(read=True)
            data = self.i2c.read(count)
            self.i2c.stop()
            return data
        self.spi.select()
        self.spi.write(bytes([READ | address]), 3)
        return self.spi.read(count, 3, 3 if self.bus == "SPI3" else 4)


def moving(channel: Channel) -> Chip:
    """Return a signal: sample k reads k + 1 steps on the first axis, and 1000 counts more on each next axis."""
    chip = Chip(channel.part)
    lsb = channel.scales[0][1]
    per_s = COUNTS_PER_SAMPLE * lsb * float(channel.rate_hz)
    first = COUNTS_PER_SAMPLE * lsb - per_s * channel.sample_ps(0) / 1e12
    offsets = tuple(first + axis * 1000 * lsb for axis in range(channel.axes))
    chip.world.signals[channel.name] = ramp(offsets, channel.value(per_s))
    return chip
