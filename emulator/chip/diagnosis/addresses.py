"""An I2C address at which nobody answers, and which one was probably meant."""

from __future__ import annotations

from emulator.buses.i2c import I2CBus
from emulator.chip.diagnosis.report import Cause

_ADDRESSES = range(0x08, 0x78)  # of devices (NXP UM10204 table 4)


def nobody(bus: I2CBus, address: int, sensors_on_spi: bool) -> Cause:
    """The cause of transfers to ``address``, where no device is."""
    devices = {known: target.name() for known in _ADDRESSES if (target := bus.target(known)) is not None}
    short = f"no answer at {bus.name} address 0x{address:02X}"
    if sensors_on_spi:
        return Cause(short, [absent(bus.name, "SPI2", "fcu001v1", "lab3")])
    for known, name in devices.items():
        if address == known >> 1:
            meant = f"the {name} is at 0x{known:02X}, 0x{known << 1:02X} as HAL address"
            return Cause(
                f"{short}: the HAL was given 0x{known:02X} and wants it shifted left, 0x{known << 1:02X}",
                [f"HAL_I2C_Mem_Read and its like take the address in 8 bits: {meant} (0x{known:02X} << 1)."],
            )
        if address == known << 1 & 0x7F:
            return Cause(f"{short}: the address was shifted left twice", [_answers(name, known)])
        if address == known ^ 1:
            return Cause(
                f"{short}: the {name} answers at 0x{known:02X} (0x{known << 1:02X} as HAL address)",
                [f"Its address pin is {'high' if known & 1 else 'low'} on this board."],
            )
    return Cause(short, [_answers(name, known) for known, name in devices.items()])


def absent(used: str, wired: str, profile: str, other: str) -> str:
    """Firmware uses a bus on which the sensors are not."""
    return (
        f"With profile {profile} the sensors are on {wired}, not on {used}: build the firmware for {wired}, "
        f"or run it with profile {other}."
    )


def _answers(name: str, address: int) -> str:
    return f"The {name} answers at 0x{address:02X}, 0x{address << 1:02X} as HAL address."
