"""The auxiliary I2C bus (SDx, SCx): what is attached to it, and how long a transfer takes.

116.3 kHz (datasheet Table 8). A byte is nine clocks; start, repeated start and stop count as one each. The
sub-address goes out as it is, and the attached part's own increment decides what a burst reads.
"""

from __future__ import annotations

from sensors.sampling import PS_PER_S
from sensors.subaddress import AddressedDevice, SubaddressTarget

_CLOCK_HZ = 116_300


def _clocks_ps(clocks: int) -> int:
    return -(-clocks * PS_PER_S // _CLOCK_HZ)


WRITE_PS = _clocks_ps(1 + 9 * 3 + 1)  # address, sub-address, one byte of data
UNANSWERED_PS = _clocks_ps(1 + 9 + 1)  # address, then the master gives up


def read_ps(count: int) -> int:
    """Address, sub-address, repeated start, address, ``count`` bytes."""
    return _clocks_ps(1 + 9 * 2 + 1 + 9 * (1 + count) + 1)


class AuxiliaryBus:
    """Parts by their 7-bit address."""

    def __init__(self) -> None:
        self._targets: dict[int, SubaddressTarget] = {}
        self._now_ps = 0

    def attach(self, address: int, device: AddressedDevice) -> None:
        """Connect a part; ValueError if the address is no 7-bit one or taken."""
        if not 0 <= address < 0x80:
            raise ValueError(f"auxiliary bus: address 0x{address:02X} is not in 0x00 to 0x7F")
        if address in self._targets:
            raise ValueError(f"auxiliary bus: two devices at address 0x{address:02X}")
        self._targets[address] = SubaddressTarget(device, lambda: self._now_ps)

    def answers(self, address: int) -> bool:
        """Whether anybody acknowledges ``address``."""
        target = self._targets.get(address)
        return target is not None and not target.device.i2c_off

    def read(self, address: int, subaddress: int, count: int, at_ps: int) -> bytes:
        """A read from a part that answers, over at ``at_ps``."""
        target = self._begin(address, at_ps)
        target.write(bytes((subaddress,)))
        target.start(read=True)
        data = target.read(count)
        target.stop()
        return data

    def write(self, address: int, subaddress: int, value: int, at_ps: int) -> None:
        """A byte to a part that answers, over at ``at_ps``."""
        target = self._begin(address, at_ps)
        target.write(bytes((subaddress, value)))
        target.stop()

    def _begin(self, address: int, at_ps: int) -> SubaddressTarget:
        self._now_ps = at_ps
        target = self._targets[address]
        target.start(read=False)
        return target
